"""A held-out recording that is the recording itself is refused, however it was written; another one is not."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.measured.data import wide_processing
from sea_ident.discrepancy.measured.same import not_the_same, same_motion
from sea_ident.exceptions import DiagnosisError
from sea_ident.recordings import Recording

SAMPLES = 3000
INTERVAL = 0.005


def recording(seed, name="a.csv", noise=1e-4, samples=SAMPLES):
    """Three periods of one motion with noise of its own."""
    time = np.arange(samples) * INTERVAL
    phase = 2.0 * np.pi * time / (INTERVAL * 1000)
    clean = {"q_hip": np.sin(phase), "current_hip": np.cos(2.0 * phase), "q_knee": np.sin(3.0 * phase)}
    rng = np.random.default_rng(seed)
    columns = {key: values + noise * rng.standard_normal(samples) for key, values in clean.items()}
    return Recording(time=time, columns=columns, source=name)


def changed(original, change):
    time = original.time[: len(change(original.time))]
    columns = {key: change(values) for key, values in original.columns.items()}
    return Recording(time=time, columns=columns, source="b.csv")


@pytest.mark.parametrize(
    "change",
    [
        lambda x: x,
        lambda x: np.round(x, 5),
        lambda x: np.round(x[700:], 5),
        lambda x: x[1234:],
        lambda x: x[:1700].astype(np.float32).astype(np.float64),
        lambda x: x + 1e-6 * np.random.default_rng(9).standard_normal(len(x)),
    ],
)
def test_a_copy_is_refused_however_it_was_written(change):
    first = recording(1)
    second = changed(first, change)
    for pair in ((first, second), (second, first)):
        with pytest.raises(DiagnosisError, match="it proves nothing"):
            not_the_same(*pair)


def test_periods_in_another_order_are_refused():
    """No two of six pieces stay side by side: it is the samples that are known again."""
    first = recording(1)
    order = np.concatenate([np.arange(500) + 500 * piece for piece in (3, 0, 4, 1, 5, 2)])
    with pytest.raises(DiagnosisError, match="3000 of 3000"):
        not_the_same(first, changed(first, lambda x: x[order]))


def test_more_than_half_in_common_is_a_copy():
    whole = recording(1, samples=5000)
    with pytest.raises(DiagnosisError, match="2000 of 3000"):
        not_the_same(changed(whole, lambda x: x[:3000]), changed(whole, lambda x: x[1000:4000]))


@pytest.mark.parametrize(
    ("name", "values"),
    [("q_grip", np.full(SAMPLES, 0.25)), ("q_reference_hip", np.linspace(0.0, 1.0, SAMPLES))],
    ids=["a joint that stands still", "a reference, which has no noise"],
)
def test_what_has_no_noise_hides_no_copy(name, values):
    first = recording(1)
    first = Recording(time=first.time, columns={**first.columns, name: values}, source="a.csv")
    with pytest.raises(DiagnosisError, match="it proves nothing"):
        not_the_same(first, changed(first, lambda x: np.round(x, 5)))


@pytest.mark.scenario
def test_the_same_periods_processed_by_a_caller_are_refused(laboratory):
    first, same, other = (
        wide_processing(laboratory.record(periods=3, seed=seed), laboratory.leg, 5.0) for seed in (3, 3, 4)
    )
    with pytest.raises(DiagnosisError, match="it proves nothing"):
        not_the_same(first, same)
    not_the_same(first, other)


def test_a_copy_with_a_column_more_is_refused():
    first = recording(1)
    second = Recording(time=first.time, columns={**first.columns, "theta_hip": first.columns["q_hip"]}, source="b.csv")
    with pytest.raises(DiagnosisError, match="3000 of 3000"):
        not_the_same(first, second)


def test_the_same_motion_measured_again_is_no_copy():
    for seed in range(2, 12):
        not_the_same(recording(1), recording(seed))


def test_one_column_in_common_makes_no_copy():
    first, second = recording(1), recording(2)
    second = Recording(time=second.time, columns={**second.columns, "q_knee": first.columns["q_knee"]}, source="b.csv")
    not_the_same(first, second)


def test_the_same_motion_measured_again_by_coarse_sensors_is_no_copy():
    first, second = (changed(recording(seed, noise=1e-3), lambda x: 1e-3 * np.round(x / 1e-3)) for seed in (1, 2))
    not_the_same(first, second)


def test_without_noise_a_motion_of_other_friction_is_no_copy():
    first = recording(1, noise=0.0)
    columns = {key: values + 1e-3 * np.sign(first.columns["q_hip"]) for key, values in first.columns.items()}
    not_the_same(first, Recording(time=first.time, columns=columns, source="b.csv"))


def test_less_than_half_in_common_is_another_recording():
    whole = recording(1, samples=5000)
    not_the_same(changed(whole, lambda x: x[:3000]), changed(whole, lambda x: x[2000:]))


@pytest.mark.parametrize(
    ("change", "same"),
    [
        (lambda theta: theta, True),
        (lambda theta: np.roll(theta, 200, axis=0), True),
        (lambda theta: theta + 0.05 * (theta - theta.mean(axis=0)), True),
        (lambda theta: theta[::2], True),  # by half the rate
        (lambda theta: theta + 0.2 * (theta - theta.mean(axis=0)) * [0.0, 1.0, 0.0], False),  # one joint is enough
        (lambda theta: theta * [1.0, 1.0, -1.0], False),
        (lambda theta: theta + np.array([0.5, 0.0, 0.0]), False),  # gravity acts otherwise there
        (lambda theta: theta[::-1], False),
        (lambda theta: np.stack([theta[:, 0], np.roll(theta[:, 1], 200), theta[:, 2]], axis=1), False),
    ],
)
def test_a_motion_is_the_same_wherever_it_begins_and_another_where_one_joint_moves_otherwise(
    nothing_missing, change, same
):
    data = nothing_missing[0].data
    theta = change(data.motion.theta)
    motion = replace(data.motion, **{
        kind: theta if kind == "theta" else np.zeros_like(theta)
        for kind in ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")
    }, time=data.motion.time[: len(theta)])  # fmt: skip
    assert same_motion(data, replace(data, motion=motion)) is same


def test_the_same_path_in_another_time_is_another_motion(nothing_missing):
    data = nothing_missing[0].data
    assert same_motion(data, replace(data, period=1.005 * data.period))
    assert not same_motion(data, replace(data, period=1.1 * data.period))
