"""Where a motor lingers, what no model has must not hide what the rest of the motion shows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy import searching
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.conclude import unexplained
from sea_ident.discrepancy.measured.data import away_from_reversals, period_data, wide_processing
from sea_ident.discrepancy.search.confirm import Confirmed, confirm, without_the_slow
from sea_ident.discrepancy.search.search import Selection, search
from sea_ident.effects import base_effects, spring_effects
from sea_ident.motion import FourierSeries

PERIOD = 5.0


@pytest.fixture(scope="module")
def lingering(laboratory, leg, series):
    """A ripple at a hip that lingers twice in a period, and there a torque that no model has."""
    motion = series[0].sample(samples=1000)
    phase = 2 * np.pi * motion.time / PERIOD
    velocity = np.sin(phase) ** 3 * (1 + 0.6 * np.cos(2 * phase))
    path = np.cumsum(velocity - velocity.mean())
    q = motion.q.copy()
    q[:, 0] = 0.35 + 0.5 * (path - path.mean()) / np.ptp(path)
    slow = FourierSeries.fit(motion.time, q, 1 / PERIOD, 12)
    ripple = ("torque_ripple", "hip", [0.45, 0.3], {"order": 19.0})
    recording = replace(laboratory, motions=(slow,)).record([ripple], periods=10, seed=5)
    data = period_data(wide_processing(recording, leg, PERIOD), leg)
    speed = data.motion.dtheta[:, 0]
    # known to its spread between the periods; up to four times that is left out anyway
    spread = np.std([m.dtheta[:, 0] for m in data.period_motions], axis=0).mean()
    stick = 7.0 * np.sign(np.gradient(speed)) * (np.abs(speed) < 10.0 * spread)
    torque = np.stack([stick, np.zeros_like(stick), np.zeros_like(stick)], axis=1)
    return replace(data, tau_motor=data.tau_motor + torque, period_tau_motor=data.period_tau_motor + torque)


def named(selection):
    return [(effect.name, effect.joint) for effect in selection.effects]


@pytest.mark.scenario
def test_the_search_without_the_slow_samples_finds_what_they_hide(lingering):
    leg = lingering.robot
    bench = Bench(lingering, (*base_effects(leg), *spring_effects(leg)))
    confirmed = confirm(bench, search(bench, bench.effects))
    assert unexplained(confirmed)
    second = without_the_slow(bench, confirmed)
    assert second is not None
    assert named(second.selection) == [("torque_ripple", "hip")]
    assert second.final.fit.effects[-1].order == pytest.approx(19.0, abs=0.5)
    assert not unexplained(second)
    # what is there all the same is not forgotten
    assert second.among_the_slow > 0.01
    assert second.bench.data.caution > 1
    assert second.bench.data.left_out[:, 0].mean() > bench.data.left_out[:, 0].mean()


@pytest.mark.scenario
def test_more_caution_leaves_out_more_and_nothing_else(lingering):
    far = away_from_reversals(lingering, 6)
    assert np.all(far.left_out >= lingering.left_out)
    assert far.left_out.mean() > lingering.left_out.mean()
    np.testing.assert_array_equal(far.tau_motor, lingering.tau_motor)


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("added", "promised", "begins"), [(1, 0.5, False), (1, 0.7, True), (0, 0.5, True), (0, 0.2, False)]
)
def test_no_search_begins_that_would_be_given_up(lingering, monkeypatch, added, promised, begins):
    """Where much is left beside what was found, a next effect that leaves 0.4 of it is the end of a search."""
    bench = Bench(lingering, (*base_effects(lingering.robot), *spring_effects(lingering.robot)))
    start = settle(bench, bench.effects)
    begun = []

    def searched(far, effects, found=None):
        begun.append(found)
        return Selection(start, start, 0, ())

    monkeypatch.setattr("sea_ident.discrepancy.search.confirm.HOPELESS", 1.0)
    monkeypatch.setattr("sea_ident.discrepancy.search.confirm.search", searched)
    monkeypatch.setattr(
        "sea_ident.discrepancy.search.confirm.scan",
        lambda far, fit, noise: [SimpleNamespace(gain=promised * fit.excess)],
    )
    assert without_the_slow(bench, Confirmed(Selection(start, start, added, ()), bench, start, start)) is None
    assert bool(begun) is begins


@pytest.mark.scenario
@pytest.mark.parametrize(("left", "taken"), [(0.4, True), (0.6, False)])
def test_what_explains_most_of_what_is_left_is_taken(lingering, monkeypatch, left, taken):
    """Beside noise: of twice the noise, what leaves 1.4 times it explains more than half of what is there."""
    bench = Bench(lingering, (*base_effects(lingering.robot), *spring_effects(lingering.robot)))
    start = settle(bench, bench.effects)

    def leaving(excess):
        fit = start.fit
        size = np.sqrt((1.0 + excess) * fit.dof / fit.statistic)
        return replace(start, fit=replace(fit, whitened=size * fit.whitened))

    found = Selection(start, leaving(left), 1, (1e-9,))
    monkeypatch.setattr("sea_ident.discrepancy.search.confirm.settle_again", lambda far, fit: leaving(1.0))
    monkeypatch.setattr("sea_ident.discrepancy.search.confirm.search", lambda far, effects, begun=None: found)
    monkeypatch.setattr(
        "sea_ident.discrepancy.search.confirm.scan", lambda far, fit, noise: [SimpleNamespace(gain=0.9 * fit.excess)]
    )
    second = without_the_slow(bench, Confirmed(Selection(start, start, 0, ()), bench, start, start))
    assert (second is not None) is taken


@pytest.mark.parametrize("shown", [True, False])
def test_where_the_slow_samples_show_a_friction_they_are_compared_again(monkeypatch, shown):
    """And nobody is told that they were left out."""
    bench, far, near = (SimpleNamespace(effects=(), data=name) for name in ("usual", "far", "near"))
    first, second, third = (SimpleNamespace(name=name, bench=far) for name in ("first", "second", "third"))
    monkeypatch.setattr(searching, "search", lambda *_, **__: None)
    monkeypatch.setattr(searching, "confirm", lambda *_: first)
    monkeypatch.setattr(searching, "unexplained", lambda confirmed: confirmed is first)
    monkeypatch.setattr(searching, "without_the_slow", lambda bench, confirmed: second)
    monkeypatch.setattr(
        searching, "friction_of_the_slow", lambda *given: (near, third) if shown and given == (bench, second) else None
    )
    monkeypatch.setattr(searching, "compared", lambda *given: given)
    monkeypatch.setattr(searching.words, "slow_samples", lambda data: f"without the slow: {data}")
    found = searching._searched_mean(bench, None, lambda what, share: None)
    assert found == ((near, third, None, ()) if shown else (far, second, None, ("without the slow: far",)))


@pytest.mark.slow
def test_the_search_goes_on_from_what_explains_nearly_all(lingering, monkeypatch):
    """A large offset is plain with the slow samples too; only the ripple is looked for without them."""
    leg = lingering.robot
    offset = np.array([[0.0, 4.0, 0.0]])
    data = replace(
        lingering, tau_motor=lingering.tau_motor + offset, period_tau_motor=lingering.period_tau_motor + offset
    )
    bench = Bench(data, (*base_effects(leg), *spring_effects(leg)))
    first = search(bench, bench.effects)
    assert ("torque_offset", "knee") in named(first)
    begun = []

    def noted(far, effects, found=None):
        begun.append(found)
        return search(far, effects, found)

    monkeypatch.setattr("sea_ident.discrepancy.search.confirm.search", noted)
    second = without_the_slow(bench, confirm(bench, first))
    (before,) = begun
    assert before.final is first.final
    # what was outdone among the slow samples may do better without them
    assert first.tried
    assert before.tried == {}
    assert second is not None
    assert set(named(second.selection)) == {("torque_offset", "knee"), ("torque_ripple", "hip")}
