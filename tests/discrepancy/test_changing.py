"""What changes, followed to data that were held out."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.gap import gap_of
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.changing import Changing, followed
from sea_ident.discrepancy.compared.heldout import HeldOut
from sea_ident.discrepancy.search.search import Selection
from sea_ident.discrepancy.trends.trend import Trend, TrendTest
from sea_ident.effects import make_effect
from sea_ident.estimation import TrendTerm
from sea_ident.recordings import Recording

WARM = make_effect("temperature_friction", "knee", reference=20.0, rise=30.0, time_constant=50.0)
PER_KELVIN = 0.1


def trend(effect, *values):
    numbers = np.array(values)
    return TrendTest(1e-9, (Trend(effect, numbers, 0.01 * np.abs(numbers), 100.0, 1e-9, 0.02),), False)


@pytest.fixture(scope="module")
def warmed(laboratory):
    """A leg whose knee warms up while it is recorded, and another motion of it that begins as cold and is shorter."""
    planted = [(WARM, [0.0, PER_KELVIN])]
    recordings = laboratory.record(planted, periods=16), laboratory.record(planted, periods=6, motion=1, seed=8)
    benches = [laboratory.bench(recording) for recording in recordings]
    fits = [settle(bench, bench.effects) for bench in benches]
    start, other = fits[0], benches[1]
    found = other.predicted(start.fit.effects, start.fit.parameters)
    selection = Selection(start, start, 0, ())
    held = HeldOut(other, found, found, other.noise(found), fits[1], (), "other", recording=recordings[1])
    return recordings, benches, selection, held


def gap(held):
    return gap_of(held.bench, held.before, held.after, held.noise)


@pytest.mark.scenario
def test_friction_of_another_temperature_is_predicted_on_data_that_were_held_out(warmed):
    recordings, benches, selection, held = warmed
    changing = Changing.of(SimpleNamespace(trends=()), recordings[0], benches[0].data)
    here, there_warm = (np.mean(r.channel("temperature", ["knee"])) for r in recordings)
    assert here - there_warm > 3.0
    alone = gap(held)
    assert alone.after["knee"] == pytest.approx(PER_KELVIN * (here - there_warm), rel=0.15)
    trends = trend(replace(WARM, smoothing=0.01), 0.0, PER_KELVIN)
    there = changing.elsewhere(benches[0], selection.final.fit, trends, held)
    known = gap(followed(held, there.changed))
    assert known.before == alone.before
    assert known.after["knee"] < 0.15 * alone.after["knee"]
    # as much less friction in all of a simulation
    present = there.present(held.bench.robot)
    viscous, coulomb = present.effects
    assert [each.effect.name for each in present.effects] == ["viscous_friction", "coulomb_friction"]
    assert coulomb.effect in selection.final.fit.effects
    assert (viscous.values[0], coulomb.values[0]) == (0.0, pytest.approx(-PER_KELVIN * (here - there_warm), rel=0.02))
    assert there.notes == ()
    assert set(changing.gaps(benches[0], selection.final.fit, trends, held)) == {"training", "holdout"}


@pytest.mark.scenario
def test_without_its_temperature_there_nothing_is_predicted(warmed):
    recordings, benches, selection, held = warmed
    changing, fit = Changing.of(SimpleNamespace(trends=()), recordings[0], benches[0].data), selection.final.fit
    trends = trend(WARM, 0.0, PER_KELVIN)
    columns = {name: values for name, values in recordings[1].columns.items() if name != "temperature_knee"}
    cold = replace(held, recording=Recording(time=recordings[1].time, columns=columns, source="other"))
    there = changing.elsewhere(benches[0], fit, trends, cold)
    assert (there.changed, there.notes) == ((), ())
    assert not there.present(held.bench.robot).differs
    assert followed(cold, there.changed) is cold
    assert set(changing.gaps(benches[0], fit, trends, cold)) == {"training"}
    nothing = changing.elsewhere(benches[0], fit, trends, None)
    assert nothing.changed == ()
    assert followed(None, nothing.changed) is None


@pytest.mark.scenario
def test_what_drifts_by_time_is_predicted_where_the_other_recording_began_as_this_one(warmed):
    """The knee warms up anew in both: as friction that grows by time, it is 2.3 N m/min less soon after the begin."""
    recordings, benches, selection, held = warmed
    changing, fit = Changing.of(SimpleNamespace(trends=()), recordings[0], benches[0].data), selection.final.fit
    drift = make_effect("friction_drift", "knee", time_constant=WARM.time_constant)
    rate = PER_KELVIN * WARM.rise / WARM.time_constant * 60.0
    alone = gap(held)
    anew = changing.elsewhere(benches[0], fit, trend(drift, 0.0, rate), held)
    assert [one.term.effect.name for one in anew.changed] == ["friction_drift"]
    assert gap(followed(held, anew.changed)).after["knee"] < 0.15 * alone.after["knee"]
    assert anew.notes == ()
    # a mean period closes: what it ends with is what it begins with, though all goes on in every period
    (course,) = (one.course for one in anew.changed)
    a_period = np.ptp(drift.change(np.array([0.0, 5.0]), None))
    assert abs(course[-1] - course[0]) < 0.01 * a_period
    # had it gone the other way it would have begun elsewhere
    other = changing.elsewhere(benches[0], fit, trend(drift, 0.0, -rate), held)
    assert other.changed == ()
    (text,) = other.notes
    assert text.startswith("friction_drift at knee: other did not begin where the recording did")


@pytest.mark.scenario
def test_what_a_model_holds_is_looked_for_first(warmed):
    recordings, benches, selection, _ = warmed
    held = SimpleNamespace(trends=(TrendTerm(make_effect("friction_drift", "knee"), (0.0, 0.1), (0.0, 0.0)),))
    names = []
    for model in (SimpleNamespace(trends=()), held):
        changing = Changing.of(model, recordings[0], benches[0].data)
        found = changing.compared(benches[0], selection.final.fit)
        names.append([(trend.effect.name, trend.in_model) for trend in found.trends])
        assert changing.not_shown_by(found) == ()
    assert names == [[("temperature_friction", False)], [("friction_drift", True)]]
    quiet = replace(found, trends=())
    (told,) = changing.not_shown_by(quiet)
    assert told.startswith("friction_drift at knee of the model does not show in this recording")
