"""Rest around a motion is in no period and hides none; a standstill that belongs to the motion stays in it."""

import warnings

import numpy as np
import pytest
from estimation.synthetic import record

from sea_ident.exceptions import SeaIdentWarning
from sea_ident.processing import process
from sea_ident.processing.rest import without_rest, without_stop
from sea_ident.recordings import Recording

INTERVAL = 0.005


@pytest.fixture(scope="module")
def motion(leg, truth):
    """Eight periods of 10 s."""
    return record(leg, truth, 8, torque_noise=0.05, encoder_noise=1e-6)


def smooth(share):
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def with_rest(motion, before, after, step=0.0, creep=0.0):
    """Rest, a start of 2 s in the motion, a stop of 1 s in it, and rest again, in which it creeps on."""
    time = np.arange(round((motion.duration + before + after) / INTERVAL) + 1) * INTERVAL
    inside = time - before
    moves = smooth(np.clip(inside / 2.0, 0.0, 1.0))
    if after:
        moves *= smooth(np.clip(motion.duration - inside, 0.0, 1.0))
    on = creep * np.exp(-np.maximum(inside - motion.duration, 0.0) / 2.0)
    rng = np.random.default_rng(5)
    columns = {}
    for name, values in motion.columns.items():
        middle = values.mean()
        columns[name] = middle + moves * (np.interp(inside, motion.time, values) - middle)
        if not name.startswith("tau"):
            columns[name] += on * np.ptp(values) + 1e-6 * rng.standard_normal(len(time))
        if step and not name.startswith("tau"):
            columns[name] = step * np.round(columns[name] / step)
    return Recording(time, columns, "rested")


@pytest.mark.scenario
@pytest.mark.parametrize("pauses", [(0.0, 14.0), (2.0, 14.0), (14.0, 0.0), (2.0, 4.0)], ids=str)
@pytest.mark.parametrize(("step", "creep"), [(0.0, 0.0), (1.5e-3, 0.0), (0.0, 0.02)])
def test_rest_hides_no_period_and_is_in_none(leg, truth, motion, pauses, step, creep):
    recording = with_rest(motion, *pauses, step=step, creep=creep)
    with pytest.warns(SeaIdentWarning, match="rested: the robot rests, or comes to rest") as caught:
        found = process(recording, leg)
    assert found.period == pytest.approx(10.0, abs=1e-3)
    assert found.periods >= 6
    # nothing but the motion is in the mean and in any period
    first, last = found.extent
    assert pauses[0] <= first <= pauses[0] + 1.5
    assert last <= recording.time[-1] - pauses[1]
    if pauses[1]:
        assert last < recording.time[-1] - pauses[1] - 0.5  # the stop repeats nothing either
    tolerance = max(3e-4, step)
    for part in found.period_motions:
        assert np.abs(part.q - found.motion.q).max() < tolerance
    assert np.ptp(found.motion.q, axis=0) == pytest.approx(np.ptp(truth.motion.q, axis=0), abs=2.0 * tolerance)
    for pause, end in zip(pauses, ("beginning", "end"), strict=True):
        assert any(f"s at the {end}" in str(w.message) for w in caught) == (pause > 0.0)
    # what follows takes the last periods of the same part
    part = found.used_of(recording)
    assert (part.time[0], part.time[-1]) == found.extent
    assert part.time[-1] - found.periods * found.period >= part.time[0] - found.period


def test_a_period_that_is_given_holds_no_rest_either(leg, motion):
    with pytest.warns(SeaIdentWarning, match="s at the beginning and 15 s at the end"):
        found = process(with_rest(motion, 2.0, 14.0), leg, period=10.0)
    assert found.periods >= 6
    assert all(np.abs(part.q - found.motion.q).max() < 3e-4 for part in found.period_motions)


def test_a_start_from_rest_leaves_the_periods_as_they_are(leg, motion):
    """The last whole periods are where they were, to the last bit."""
    recording = with_rest(motion, 2.0, 0.0)
    with pytest.warns(SeaIdentWarning, match="at the beginning of the recording: left out"):
        found = process(recording, leg, period=10.0)
    short = recording.crop(recording.time[-found.periods * 2000], None)
    assert found.periods == 7
    np.testing.assert_array_equal(found.period_tau_motor, process(short, leg, period=10.0).period_tau_motor)


def test_a_motion_without_rest_is_left_alone(leg, motion):
    assert without_rest(motion, leg) is motion
    assert without_stop(motion, leg, 10.0).samples == motion.samples
    assert process(motion, leg).extent is None


def test_a_standstill_of_every_period_belongs_to_it(leg, motion):
    """A second of dwell in each, with which the recording begins and ends."""
    first = {name: values[:2000] for name, values in motion.columns.items()}
    rise = smooth(np.clip((np.arange(2000) * INTERVAL - 0.5) / 1.0, 0.0, 1.0))
    window = rise * rise[::-1]
    rng = np.random.default_rng(6)
    columns = {n: np.tile(window * (v - v[0]), 6) + 1e-6 * rng.standard_normal(12000) for n, v in first.items()}
    recording = Recording(np.arange(12000) * INTERVAL, columns, "dwelling")
    assert without_rest(recording, leg) is recording
    assert process(recording, leg).periods == 6


def test_a_small_motion_after_a_large_one_is_not_taken_for_rest(leg, motion):
    """A robot is moved to where a motion of a hundredth of that begins."""
    approach = np.clip(motion.time / 5.0, 0.0, 1.0)
    columns = {name: 0.001 * values + 0.3 * smooth(approach) - 0.4 for name, values in motion.columns.items()}
    recording = motion.replace_columns(columns)
    assert without_rest(recording, leg).samples < 2000
    found = process(recording, leg, period=10.0)
    assert found.periods == 7  # without the first, which holds the approach
    assert found.extent is None


def test_rest_is_kept_where_there_is_no_period(leg, motion):
    single = motion.crop(None, 9.9)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = process(with_rest(single, 3.0, 3.0), leg)
    assert not found.periodic
    assert found.motion.time[-1] > 14.0
    assert found.extent is None


def test_a_reference_that_moves_on_is_no_rest(leg, motion):
    """As where friction holds a robot whose reference moves on."""
    recording = with_rest(motion, 0.0, 6.0)
    wave = np.sin(2.0 * np.pi * recording.time)
    referred = recording.replace_columns({f"q_reference_{name}": wave for name in leg.joint_names})
    assert without_rest(recording, leg) is not recording
    assert without_rest(referred, leg) is referred
