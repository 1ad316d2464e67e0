"""Whether an effect holds on another motion: what it is worth there, and what is not its own fault."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.contribution import torque_factor
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.compared.transfer import Transfer, _Trial, transfer
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import make_effect
from sea_ident.simulation import FrictionJitter, SmoothCoulomb


@pytest.mark.scenario
def test_what_others_gain_by_a_refit_does_not_count_against_what_another_motion_hardly_shows(laboratory):
    """The ripple of the hip is larger there; that of the ankle counts where it is large enough to be seen."""
    used, unseen, seen = (
        [("torque_ripple", "hip", [a, 0.5 * a], {"order": 4.0}), ("torque_ripple", "ankle", [b, 0.0], {"order": 30.0})]
        for a, b in ((3.0, 0.006), (4.0, 0.006), (4.0, 0.15))
    )
    bench = laboratory.bench(laboratory.record(used, periods=5))
    start = settle(bench, bench.effects)
    added = (make_effect(name, joint, **shapes) for name, joint, _, shapes in used)
    selection = Selection(start, settle(bench, (*bench.effects, *added)), 2, (1e-9, 1e-9))
    fit = selection.final.fit
    for planted, tested in ((unseen, False), (seen, True)):
        other = Bench(laboratory.data(laboratory.record(planted, periods=5, motion=1, seed=8)), bench.effects)
        now = settle_again(other, other.predicted(fit.effects, fit.parameters))
        hip, ankle = transfer(other, selection, now)
        assert hip.tested
        assert hip.holds
        assert ankle.tested == tested
        assert ankle.holds == (not tested)


def ripples(hip, knee):
    """Torque ripples of hip and knee, of these amplitudes [N m]."""
    return [
        ("torque_ripple", "hip", [hip, 0.0], {"order": 4.0}),
        ("torque_ripple", "knee", [knee, 0.0], {"order": 9.0}),
    ]


def transfers_of(laboratory, used, there, **options):
    """What was found of one recording is worth on another, with other effects or another friction there."""
    bench = laboratory.bench(laboratory.record(used, periods=6))
    start = settle(bench, bench.effects)
    added = (make_effect(name, joint, **shapes) for name, joint, _, shapes in used)
    selection = Selection(start, settle(bench, (*bench.effects, *added)), len(used), (1e-9,) * len(used))
    fit = selection.final.fit
    other = Bench(laboratory.data(laboratory.record(there, periods=6, motion=1, seed=8, **options)), bench.effects)
    return transfer(other, selection, settle_again(other, other.predicted(fit.effects, fit.parameters)))


@pytest.mark.scenario
def test_what_is_wrong_with_one_effect_is_not_held_against_another(laboratory):
    """The ripple of the knee is far larger on the other motion: that of the hip is what it was."""
    hip, knee = transfers_of(laboratory, ripples(0.4, 1.0), ripples(0.4, 4.5))
    assert hip.tested
    assert hip.holds
    assert knee.tested
    assert not knee.holds


@pytest.mark.scenario
def test_friction_that_turns_over_at_another_speed_is_not_held_against_an_effect(laboratory):
    hip, knee = transfers_of(
        laboratory,
        ripples(0.4, 0.4),
        ripples(0.4, 0.4),
        friction=SmoothCoulomb(smoothing=0.05),
        jitter=FrictionJitter.none(),
    )
    assert hip.share > 0.8
    assert knee.share > 0.8


@pytest.mark.parametrize(
    ("share", "possible", "excess", "out"),
    [
        (0.6, 1e3, 1e5, False),  # it holds
        (0.4, 1e3, 5e2, True),  # little else is missing that could speak against it
        (0.4, 1e3, 5e3, False),
        (0.2, 1e3, 5e3, True),  # whatever else is missing
        (-3.0, 1e3, 5e3, True),
    ],
)
def test_what_explains_less_than_is_missing_beside_it_is_not_ruled_out_by_half(share, possible, excess, out):
    assert Transfer(share, True, excess=excess, possible=possible).ruled_out == out
    assert not Transfer(share, False, excess=excess, possible=possible).ruled_out


@pytest.mark.scenario
def test_values_that_the_other_motion_would_have_as_well_hold_there(laboratory, monkeypatch):
    """To second order: an offset of 4 that is said to be 1 leaves nine sixteenths of what it explains."""
    ripple = ("torque_ripple", "hip", [0.4, 0.0], {"order": 24.0})
    used = [("torque_offset", "ankle", [0.7], {}), ("torque_offset", "knee", [1.0], {}), ripple]
    there = [("torque_offset", "ankle", [0.7], {}), ("torque_offset", "knee", [4.0], {}), ripple]
    bench = laboratory.bench(laboratory.record(used, periods=6))
    start = settle(bench, bench.effects)
    fit = settle(bench, (*bench.effects, *(make_effect(n, j, **shapes) for n, j, _, shapes in used))).fit
    other = Bench(laboratory.data(laboratory.record(there, periods=6, motion=1, seed=8)), bench.effects)
    now = settle_again(other, other.predicted(fit.effects, fit.parameters))
    added = range(len(start.fit.effects), len(fit.effects))
    same, less, shaped = (_Trial(other, fit, added, now, position)._share_by_values() for position in added)
    assert same == pytest.approx(1.0, abs=0.01)
    assert less == pytest.approx(1.0 - (3.0 / 4.0) ** 2, abs=0.02)
    assert shaped == 0.0  # its order is found too
    # and that counts where the comparison of statistics speaks against it
    monkeypatch.setattr(_Trial, "_share", staticmethod(lambda without, fixed, free: 0.0))
    monkeypatch.setattr(_Trial, "_share_beside_free", lambda self: 0.0)
    monkeypatch.setattr(_Trial, "_within_its_deviations", lambda self, fixed: -np.inf)
    outcomes = [_Trial(other, fit, added, now, position).outcome() for position in added]
    assert [outcome.tested for outcome in outcomes] == [True, True, True]
    assert [outcome.share for outcome in outcomes] == [same, less, shaped]
    assert [outcome.holds for outcome in outcomes] == [True, False, False]


@pytest.fixture(scope="module")
def elsewhere(laboratory, rippled):
    """Gives trials of that ripple on another motion that shows its values far better, these off by some amount."""
    bench, _, found = rippled
    fit, position = found.fit, len(found.fit.effects) - 1
    own = slice(len(fit.columns) - 2, len(fit.columns))

    @functools.cache
    def there(lacking):
        planted = [("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0})]
        planted.extend((name, joint, list(values), dict(shapes)) for name, joint, values, shapes in lacking)
        other = Bench(laboratory.data(laboratory.record(planted, periods=5, motion=1, seed=8)), bench.effects)
        return other, settle_again(other, other.predicted(fit.effects, fit.parameters))

    def trial(off=0.0, unsure=10.0, lacking=()):
        other, now = there(lacking)
        # off in the direction that the first motion told least, which was `unsure` times less sure of all; its order
        # is as it was
        less_sure = replace(fit)
        factor = unsure * fit.covariance_factor[len(fit.columns) - 2 :]
        object.__setattr__(less_sure, "covariance_factor", unsure * fit.covariance_factor)
        information, directions = np.linalg.eigh(np.linalg.inv(factor @ factor.T)[:2, :2])
        values = fit.values.copy()
        values[own] += off / np.sqrt(information[0]) * directions[:, 0]
        object.__setattr__(less_sure, "values", values)
        return _Trial(other, less_sure, range(position, position + 1), now, position)

    return trial


@pytest.mark.scenario
@pytest.mark.parametrize("lacking", [(), (("torque_ripple", "knee", (3.0, 0.0), (("order", 9.0),)),)])
def test_an_effect_is_as_sure_elsewhere_as_it_was_found(elsewhere, lacking):
    """The density of what is left, against the full covariance matrix of it, also where more is left than noise."""
    one = elsewhere(2.0, lacking=lacking)
    other, now = one._bench, one._now
    assert (now.fit.unit > 2.0) is bool(lacking)
    fixed, _ = one.as_found()
    rows = torque_factor(other, one._fit, [one._position]) * fixed.scale[:, None]
    free = fixed.off(other.whitening(now.noise).flat(rows))
    unit = now.fit.unit
    covariance = unit * np.eye(len(fixed.whitened)) + free @ free.T
    expected = unit * (
        fixed.whitened @ np.linalg.solve(covariance, fixed.whitened) + np.linalg.slogdet(covariance / unit)[1]
    )
    assert np.linalg.norm(free) > 3.0
    assert fixed.statistic - one.by_chance(fixed) == pytest.approx(expected, rel=1e-9)


@pytest.mark.scenario
def test_what_the_first_motion_hardly_told_is_not_held_against_an_effect(elsewhere):
    """Values that are off by two of their own standard deviations are nothing; by ten, they are wrong."""
    plain, fair = {}, {}
    for off in (0.0, 2.0, 10.0):
        one = elsewhere(off)
        outcome = one.outcome()
        plain[off], fair[off] = outcome.statistic, outcome.surprise
    assert plain[2.0] - plain[0.0] > 2.0 * EQUALLY_GOOD
    assert abs(fair[2.0] - fair[0.0]) < 0.5 * EQUALLY_GOOD
    assert fair[10.0] - fair[0.0] > 4.0 * EQUALLY_GOOD


@pytest.mark.scenario
def test_what_is_hardly_known_pays_for_all_that_it_may_be(elsewhere):
    """It explains whatever is there, and that is no merit: the wider, the less likely each of it was."""
    sure, unsure, vague = (elsewhere(unsure=unsure).outcome().surprise for unsure in (1.0, 30.0, 1e3))
    assert unsure > sure + 1.0
    # of two parameters and a shape, each a factor of 33
    assert vague - unsure == pytest.approx(2.0 * 3.0 * np.log(1e3 / 30.0), rel=0.2)


@pytest.mark.scenario
@pytest.mark.parametrize(("off", "holds"), [(2.0, True), (10.0, False)])
def test_an_effect_holds_elsewhere_within_three_deviations_of_what_it_was_found_to_be(elsewhere, off, holds):
    """Off by what it is unsure by, an effect may be worse than none on another motion, and is right all the same."""
    one = elsewhere(off, unsure=30.0)
    fixed, _ = one.as_found()
    left, stds = one._along_its_deviations(fixed)
    assert np.all(np.abs(left) < 3.0 * stds) == holds
    outcome = one.outcome()
    assert outcome.tested
    assert outcome.holds is holds
    assert outcome.ruled_out is not holds
