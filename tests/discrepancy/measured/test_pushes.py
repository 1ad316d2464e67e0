"""Pushes are found to the sample where they are, and none where nothing pushes."""

import warnings
from importlib import import_module

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.measured.data import wide_processing
from sea_ident.discrepancy.measured.pushes import Push, find_pushes, pushed, repeated
from sea_ident.discrepancy.unrepeated import pushes_between_passes
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning

PERIOD = 5.0
INTERVAL = 0.01
SAMPLES = 500
"""Of one pass."""

PASSES = 10
TIME = np.arange(PASSES * SAMPLES) * INTERVAL
PHASE = np.tile(2.0 * np.pi * np.arange(SAMPLES) / SAMPLES, PASSES)
SPEED = np.stack([np.cos(PHASE), np.sin(PHASE)], axis=1)


def misfit():
    """What the model lacks: friction that comes again in every pass, far larger than the noise."""
    return np.stack([2.0 * np.sign(SPEED[:, 0]), np.sin(3.0 * PHASE)], axis=1)


def residual(seed=0, noise=0.02):
    return misfit() + noise * np.random.default_rng(seed).standard_normal(misfit().shape)


@pytest.mark.parametrize(("joint", "first", "last", "force"), [(0, 1234, 1301, 1.5), (1, 2740, 2755, -3.0)])
def test_edges_to_the_sample(joint, first, last, force):
    values = residual()
    values[first : last + 1, joint] += force
    (push,) = find_pushes(TIME, values, SPEED, SAMPLES)
    assert push.joint == joint
    assert abs(push.start - TIME[first]) <= 1.01 * INTERVAL
    assert abs(push.stop - TIME[last]) <= 1.01 * INTERVAL
    assert push.force == pytest.approx(force, abs=0.15)
    assert push.impulse == pytest.approx(force * (last - first + 1) * INTERVAL, rel=0.05)
    assert push.z > 10.0


def test_two_pushes_at_two_joints_in_the_order_of_time():
    values = residual()
    values[3000:3030, 0] += 2.0
    values[800:860, 1] += 2.0
    found = find_pushes(TIME, values, SPEED, SAMPLES)
    assert [p.joint for p in found] == [1, 0]


def test_what_matters_to_nobody_is_no_push_however_quiet_the_rest():
    """As where a simulation without noise has settled but for the last digits."""
    values = residual(noise=1e-9)
    values[1234:1302] += [1.5e-5, -1.5]
    assert len(find_pushes(TIME, values, SPEED, SAMPLES)) == 2
    (push,) = find_pushes(TIME, values, SPEED, SAMPLES, least=np.array([1e-3, 1e-3]))
    assert push.joint == 1
    assert push.force == pytest.approx(-1.5, abs=1e-6)
    assert abs(push.start - TIME[1234]) <= 1.01 * INTERVAL


@pytest.mark.parametrize("samples", [SAMPLES, 0])
def test_what_a_filter_makes_of_the_ends_of_a_recording_is_no_push(samples):
    values = residual(noise=1e-6) if samples else 1e-6 * residual(noise=0.5)
    values[:3] += 0.3
    values[-4:] -= 0.2
    assert find_pushes(TIME, values, SPEED, samples) == ()
    values[2000:2030, 0] += 0.3
    (push,) = find_pushes(TIME, values, SPEED, samples)
    assert push.force == pytest.approx(0.3, rel=0.01)


def test_what_comes_again_in_every_pass_is_no_push():
    for seed in range(5):
        assert find_pushes(TIME, residual(seed), SPEED, SAMPLES) == ()


def test_departures_that_come_beside_reversals_are_friction_even_where_one_lasts():
    """Friction that lets go at another instant in every pass; pushes come at any time."""
    turns = np.flatnonzero(np.diff(np.sign(SPEED[:, 1])) != 0.0)[1:-1]
    rng = np.random.default_rng(5)
    lasting = residual()
    for k, turn in enumerate(rng.choice(turns, 8, replace=False)):
        lasting[turn - 1 : turn + (16 if k == 0 else 4), 1] += 1.5 * rng.choice([-1.0, 1.0])
    assert find_pushes(TIME, lasting, SPEED, SAMPLES) == ()
    anywhere = residual()
    starts = np.sort(rng.choice(len(TIME) // 60 - 1, 8, replace=False)) * 60 + 20
    for start in starts:
        anywhere[start : start + 12, 1] += 1.5
    assert len(find_pushes(TIME, anywhere, SPEED, SAMPLES)) == 8


def test_friction_that_lets_go_for_some_samples_is_none_beside_a_push_that_is_clear():
    turns = np.flatnonzero(np.diff(np.sign(SPEED[:, 1])) != 0.0)[1:-1]
    values = residual()
    values[turns[3] - 1 : turns[3] + 2, 1] += 1.5
    values[turns[5] + 100 : turns[5] + 130, 1] += 1.5
    (push,) = find_pushes(TIME, values, SPEED, SAMPLES)
    assert push.start == pytest.approx(TIME[turns[5] + 100], abs=1.01 * INTERVAL)
    # one that lasts about as long as those that are clear is one of them, wherever it comes
    values[turns[7] - 10 : turns[7] + 10, 1] += 1.5
    assert len(find_pushes(TIME, values, SPEED, SAMPLES)) == 2


def test_what_lasts_for_most_of_the_time_is_a_poor_model():
    values = residual()
    values[500:2500, 0] += 2.0
    assert find_pushes(TIME, values, SPEED, SAMPLES) == ()


def test_without_passes_the_time_around_reversals_is_left_aside():
    clean = 0.02 * np.random.default_rng(2).standard_normal(misfit().shape)
    assert find_pushes(TIME, clean, SPEED) == ()
    turn = int(1.25 / INTERVAL)  # of the first joint
    clean[turn - 3 : turn + 3, 0] += 2.0
    assert find_pushes(TIME, clean, SPEED) == ()
    clean[turn + 50 : turn + 56, 0] += 2.0
    (push,) = find_pushes(TIME, clean + 0.1 * TIME[:, None] / TIME[-1], SPEED)
    assert push.start == pytest.approx(TIME[turn + 50], abs=1.01 * INTERVAL)
    assert push.stop == pytest.approx(TIME[turn + 55], abs=1.01 * INTERVAL)
    assert push.force == pytest.approx(2.0, abs=0.1)


def test_repeated_is_the_median_at_the_same_phase():
    values = misfit()[: 4 * SAMPLES + 100]
    spoiled = values.copy()
    spoiled[700:720] += 9.0
    np.testing.assert_allclose(repeated(spoiled, SAMPLES), values, atol=1e-9)


def test_pushed_is_the_push_and_its_margin_at_its_joint():
    values = residual()
    values[1000:1050, 0] += 2.0
    found = find_pushes(TIME, values, SPEED, SAMPLES)
    here = np.flatnonzero(pushed(found, TIME, 0, 0.1))
    assert abs(here[0] - 990) <= 1
    assert abs(here[-1] - 1059) <= 1
    assert not np.any(pushed(found, TIME, 1, 0.1))


@pytest.mark.scenario
@pytest.mark.parametrize(("periods", "seed"), [(4, 1), (6, 6), (9, 9)])
def test_friction_that_differs_from_pass_to_pass_is_no_push(laboratory, periods, seed):
    recording = laboratory.record(periods=periods, seed=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = sea_ident.identify(laboratory.leg, recording, period=PERIOD)
        processed = wide_processing(recording, laboratory.leg, PERIOD)
        assert pushes_between_passes(model, recording, processed) == ()


@pytest.mark.scenario
def test_a_push_that_the_refitted_model_does_not_show_gives_no_mean_up(laboratory, monkeypatch):
    """One pass of five seemed to be pushed beside the model as it was given; there is nothing of it after a refit."""
    seeming = Push(1, 12.3, 12.4, 0.5, 0.04, 15.0)
    module = import_module("sea_ident.discrepancy.diagnose")
    monkeypatch.setattr(module, "pushes_between_passes", lambda *_: (seeming,))
    push = make_effect("external_force", "knee", start=12.0, stop=12.6)
    said = []
    for planted in ((), [(push, [20.0, 0.0, 10.0])]):
        recording = laboratory.record(planted, periods=5)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            model = sea_ident.identify(laboratory.leg, recording, period=PERIOD)
            said.append(sea_ident.diagnose(model, recording))
    assert (said[0].verdict, said[0].missing) == ("none", ())
    assert said[0].lack_of_fit.dof > 0
    # where one pushes, the mean is of no use
    assert "external_force" in {missing.effect for missing in said[1].missing}
    assert said[1].lack_of_fit.dof == 0
    starts = [p.value for missing in said[1].missing for p in missing.parameters if p.name.endswith("first_start")]
    assert starts == pytest.approx([12.0] * len(starts), abs=0.02)


def test_a_reversal_at_which_the_joint_lingers_is_no_push():
    # slow around zero for 80 ms, where friction that differs from pass to pass may last just as long
    speed = np.stack([np.cos(PHASE), np.sin(PHASE)], axis=1)
    values = 0.02 * np.random.default_rng(3).standard_normal(speed.shape)
    turn = 1625  # of the first joint
    speed[turn - 5 : turn + 5, 0] = 0.01
    values[turn - 5 : turn + 4, 0] += 2.0
    assert find_pushes(TIME, values, speed, SAMPLES) == ()
    speed[turn - 5 : turn + 5, 0] = 0.1
    (push,) = find_pushes(TIME, values, speed, SAMPLES)
    assert push.start == pytest.approx(TIME[turn - 5], abs=1.01 * INTERVAL)


def test_a_departure_that_a_long_recording_holds_by_chance_is_no_push():
    tails = np.random.default_rng(4).laplace(scale=0.02, size=(len(TIME), 1))
    quiet = np.full((len(TIME), 1), 1.0)
    lasting = slice(3000, 3003)
    for z, count in ((11.0, 0), (25.0, 1)):
        values = tails.copy()
        values[lasting] = z * float(np.median(np.abs(tails))) / 0.6745
        found = find_pushes(TIME, values, quiet, SAMPLES)
        assert len(found) == count
