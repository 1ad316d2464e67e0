"""Data that were not used: other periods or another motion, on which a real effect holds and a wrong one does not."""

from dataclasses import replace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.compared.heldout import Kind, held_out, other_periods, tried, without_history
from sea_ident.discrepancy.compared.transfer import _Trial
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Side, make_effect
from sea_ident.exceptions import DiagnosisError
from sea_ident.recordings import Recording

PERIOD = 5.0


@pytest.fixture(scope="module")
def ripple(rippled):
    bench, start, with_it = rippled
    return bench, Selection(start, with_it, 1, (1e-9,))


@pytest.fixture(scope="module")
def with_ripple(laboratory):
    return laboratory.record([("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0})], periods=5, motion=1, seed=8)


@pytest.mark.scenario
def test_every_other_period_is_held_out(ripple):
    bench, selection = ripple
    found = other_periods(bench, selection)
    assert found.kind is Kind.OTHER_PERIODS
    assert "periods 2, 4, 6" in found.source
    np.testing.assert_array_equal(found.bench.data.period_tau_motor, bench.data.period_tau_motor[1::2])
    np.testing.assert_allclose(found.bench.data.tau_motor, bench.data.period_tau_motor[1::2].mean(axis=0))
    # fitted to the other half: parameters are not those of all periods
    assert found.after.parameters["hip.torque_ripple_sine"] != selection.final.fit.parameters["hip.torque_ripple_sine"]
    assert found.transfers[0].tested
    assert found.transfers[0].share == pytest.approx(1.0, abs=0.1)


@pytest.mark.scenario
def test_a_real_effect_holds_on_another_motion(ripple, with_ripple):
    found, warnings = held_out(*ripple, with_ripple)
    assert warnings == ()
    assert found.kind is Kind.OTHER_MOTION
    (transfer,) = found.transfers
    assert transfer.tested
    assert transfer.share == pytest.approx(1.0, abs=0.1)
    assert transfer.holds
    # at lower speeds the recording does not tell where friction turns over
    own, used = found.bench.data.slowest, ripple[0].data.slowest
    assert all(own[key] >= used[key] for key in own if key[1] is Side.MOTOR)
    # parameters as they were found: nothing is fitted to the held-out data
    assert found.after.parameters == pytest.approx(ripple[1].final.fit.parameters)
    hip = [e.joint == "hip" and str(e.kind) == "motor" for e in found.bench.data.equations].index(True)
    power = [np.sum(np.abs(fit.residual[:, hip]) ** 2) for fit in (found.before, found.after)]
    assert power[1] < 0.3 * power[0]


@pytest.mark.scenario
def test_what_foretells_the_same_of_another_motion_is_told_apart_by_nothing_there(ripple, with_ripple):
    """A constant in a spring and another zero of its encoder: the same torque, but for what the link weighs there."""
    bench, selection = ripple
    found, _ = held_out(bench, selection, with_ripple)
    fit, springs = selection.final.fit, {}
    stiffness = fit.parameters["knee.spring_stiffness"]
    for size in (1e-5, 0.02):
        zero = bench.predicted((*fit.effects, make_effect("encoder_offset", "knee", offset=size)), fit.parameters)
        constant = {**fit.parameters, "knee.spring_offset": stiffness * size}
        springs[size] = [
            replace(selection, final=Settled(each, selection.final.noise), added=2)
            for each in (zero, bench.predicted((*fit.effects, make_effect("spring_offset", "knee")), constant))
        ]
    assert found.foretell_the_same(*springs[1e-5])
    # where it is large the spring stiffens with it, and the link hangs otherwise
    assert not found.foretell_the_same(*springs[0.02])
    assert not found.foretell_the_same(springs[1e-5][0], selection)


@pytest.mark.scenario
def test_nothing_is_tested_on_a_torque_of_the_wrong_sign(ripple, with_ripple):
    kind = "current_ankle"
    found, said = held_out(*ripple, with_ripple.replace_columns({kind: -with_ripple.columns[kind]}))
    assert found.kind is Kind.OTHER_PERIODS
    assert any(text.startswith("held-out data: ") and "'ankle' moves comes out negative" in text for text in said)
    assert any("cannot be used; nothing was tested on it" in text for text in said)


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_rest_after_either_recording_is_in_nothing_that_is_looked_at(leg, laboratory, ripple, with_ripple, monkeypatch):
    """What is read beside the periods is read from the same part of a recording: its end is theirs."""

    def and_rest(recording):
        rested = {n: np.concatenate([v, np.full(1000, v[-1])]) for n, v in recording.columns.items()}
        step = recording.duration / (recording.samples - 1)
        return Recording(np.arange(recording.samples + 1000) * step, rested, "rested")

    seen = []

    def cleaned(data, recording):
        seen.append(recording)
        raise DiagnosisError("seen")

    monkeypatch.setattr("sea_ident.discrepancy.measured.check.cleaned", cleaned)
    with pytest.raises(DiagnosisError, match="seen"):
        held_out(*ripple, and_rest(with_ripple))
    model = sea_ident.identify(leg, with_ripple, period=PERIOD)
    with pytest.raises(DiagnosisError, match="seen"):
        sea_ident.diagnose(model, and_rest(with_ripple))
    assert [part.samples for part in seen] == pytest.approx([with_ripple.samples] * 2, rel=0.01)


@pytest.mark.scenario
def test_what_one_of_several_effects_is_worth_is_what_it_is_among_all(laboratory):
    planted = [("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0}), ("spring_offset", "knee", [0.5], {})]
    bench = laboratory.bench(laboratory.record(planted))
    start = settle(bench, bench.effects)
    added = make_effect("torque_ripple", "hip", order=4.0), make_effect("spring_hysteresis", "knee", slip=0.02)
    selection = Selection(start, settle(bench, (*bench.effects, *added)), 2, (1e-9, 1e-9))
    found = held_out(bench, selection, laboratory.record(planted, motion=1, seed=8))[0]
    first = len(bench.effects)
    assert tuple(found.worth(selection, first + k) for k in range(2)) == found.transfers
    assert found.transfers[0] != found.transfers[1]


@pytest.mark.scenario
def test_what_an_effect_is_worth_does_not_depend_on_what_was_tried_before(laboratory, ripple, with_ripple):
    """A torque that comes late jumps after the motor turned back: these samples are left out for it alone."""
    bench, selection = ripple
    found, _ = held_out(bench, selection, with_ripple)
    fit, position = selection.final.fit, len(selection.final.fit.effects) - 1
    late = (*fit.effects[:-1], make_effect("torque_delay", "knee", delay=0.03))
    other = Settled(bench.fit(late, selection.final.noise, start=fit.parameters), selection.final.noise)
    before, compared = found.worth(selection, position), found.bench.freed(None).count
    rival = found.worth(replace(selection, final=other), position)
    assert rival != before
    assert found.bench.freed(None).count == compared
    assert found.worth(selection, position) == before
    apart = found.bench.apart()
    apart.release(late)
    assert apart.freed(None).count > compared == found.bench.freed(None).count


@pytest.mark.scenario
def test_what_is_far_behind_another_is_ruled_out_without_a_fit(ripple, with_ripple, monkeypatch):
    """And a fit would rule it out as well; what is not far behind is fitted, as if nothing stood beside it."""
    bench, selection = ripple
    found, _ = held_out(bench, selection, with_ripple)
    fit, position = selection.final.fit, len(selection.final.fit.effects) - 1
    (own,) = found.transfers

    def with_order(order):
        model = (*fit.effects[:-1], replace(fit.effects[-1], order=order))
        other = Settled(bench.fit(model, selection.final.noise, start=fit.parameters), selection.final.noise)
        return replace(selection, final=other)

    wrong, right = with_order(6.0), with_order(fit.effects[-1].order + 1e-3)
    behind, fitted = found.worth(wrong, position, own), found.worth(wrong, position)
    assert not behind.holds
    assert behind != fitted
    for rival in (behind, fitted):
        assert rival.statistic - own.statistic > own.margin
    # about the same in the noise floor of the better one as in its own
    assert behind.statistic == pytest.approx(fitted.statistic, rel=0.3)
    assert found.worth(right, position, own) == found.worth(right, position)
    # nor is what is behind one that is a surprise itself, or only where the first motion hardly told it
    assert found.worth(wrong, position, replace(own, by_chance=-1e9)) == fitted
    assert behind.surprise > own.surprise + own.margin
    monkeypatch.setattr(_Trial, "by_chance", lambda trial, fixed: 0.9 * fixed.statistic)
    assert found.worth(wrong, position, own) == found.worth(wrong, position)
    assert found.worth(right, position, own).holds


@pytest.mark.scenario
def test_the_same_motion_again_is_no_other_motion(laboratory, ripple):
    """Whatever sensors and friction made of it, and wherever in it the recording begins."""
    again = laboratory.record([("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0})], periods=5, seed=9)
    later = replace(again, columns={name: np.roll(values, -317) for name, values in again.columns.items()})
    for recording in (again, later):
        found, warnings = held_out(*ripple, recording)
        assert warnings == ()
        assert found.kind is Kind.SAME_MOTION
        assert not found.other_motion
        # it is what was given that is tried, not periods of the recording itself
        assert found.bench.data.periods == 5
        assert found.recording is recording
        assert found.transfers[0].share == pytest.approx(1.0, abs=0.1)
        # and with another selection it stays the same data
        assert found.again(ripple[1]).kind is Kind.SAME_MOTION


@pytest.mark.scenario
def test_an_effect_that_is_not_there_does_not_hold(laboratory, ripple):
    """The other motion was recorded without it: with its parameters as they are, it makes things worse."""
    (transfer,) = held_out(*ripple, laboratory.record(periods=5, motion=1, seed=8))[0].transfers
    assert transfer.share < 0.1 or not transfer.tested


@pytest.mark.scenario
def test_an_effect_of_the_opposite_sign_does_not_hold(laboratory, ripple):
    turned = laboratory.record([("torque_ripple", "hip", [-1.0, -0.5], {"order": 4.0})], periods=5, motion=1, seed=8)
    (transfer,) = held_out(*ripple, turned)[0].transfers
    assert transfer.tested
    assert transfer.share == pytest.approx(-3.0, abs=0.5)  # 1 - (2 a)^2 / a^2
    assert not transfer.holds


def test_nothing_was_added_and_nothing_is_held_out(nothing_missing):
    bench, now = nothing_missing
    assert held_out(bench, Selection(now, now, 0, ()), None) == (None, ())


@pytest.mark.scenario
def test_five_periods_are_not_split(laboratory, ripple):
    whole = laboratory.record()
    bench = laboratory.bench(whole.crop(float(whole.time[0]), float(whole.time[0]) + 5 * 5.0))
    assert bench.data.periods == 5
    now = settle(bench, bench.effects)
    assert other_periods(bench, Selection(now, now, 1, (1e-9,))) is None


@pytest.mark.scenario
def test_one_pass_tests_nothing_and_it_is_said(laboratory, ripple):
    found, warnings = held_out(*ripple, laboratory.record(periods=1, motion=1))
    assert found.kind is Kind.OTHER_PERIODS
    assert "less than two periods" in warnings[0]


@pytest.mark.scenario
def test_a_constant_torque_of_a_spring_that_remembers_does_not_count(ripple):
    bench, selection = ripple
    fit = bench.predicted(selection.start.fit.effects, selection.start.fit.parameters)
    constant = bench.column_spectra(make_effect("spring_offset", "hip"), fit.effects)[:, :, 0]
    loaded = replace(fit, residual=fit.residual + 3.0 * constant)
    assert without_history(bench, fit, []) is fit
    cleaned, other = (without_history(bench, each, ["hip"]).residual for each in (fit, loaded))
    np.testing.assert_allclose(other, cleaned, atol=1e-9)
    touched = [e.joint == "hip" for e in bench.data.equations]
    np.testing.assert_array_equal(cleaned[:, ~np.array(touched)], fit.residual[:, ~np.array(touched)])
    # only the mean goes, and of it what both equations of the joint share
    np.testing.assert_allclose(cleaned[1:], fit.residual[1:], atol=1e-9)
    assert abs(np.vdot(constant[0], cleaned[0])) < 1e-9


@pytest.mark.scenario
def test_that_constant_is_left_out_for_springs_with_dry_friction_alone(ripple):
    bench, selection = ripple
    start = selection.start.fit
    means = {}
    for name in ("spring_hysteresis", "torque_offset"):
        fit = bench.fit((*start.effects, make_effect(name, "hip")), selection.start.noise, start=start.parameters)
        found = tried(bench, replace(selection, final=Settled(fit, selection.start.noise)), "the same")
        predicted = bench.predicted(fit.effects, fit.parameters)
        means[name] = np.array_equal(found.after.residual, predicted.residual)
    assert means == {"spring_hysteresis": False, "torque_offset": True}
