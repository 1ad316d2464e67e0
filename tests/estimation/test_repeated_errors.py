"""Errors that are the same in every period: no average takes them away, and no spread between periods shows them."""

import numpy as np
import pytest

from estimation.synthetic import record, truth_of
from sea_ident.estimation import identify, repeated_steps
from sea_ident.motion import FourierSeries
from sea_ident.processing import process
from sea_ident.processing.encoder_steps import step_of
from sea_ident.processing.harmonics import within
from sea_ident.recordings import Recording
from sea_ident.robot import robot_from_text

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")

RIGID = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.02 0.01 -0.2"/><mass value="3"/>
<inertia ixx="0.03" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><origin xyz="0 0.01 -0.15"/><mass value="2"/>
<inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="first" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" velocity="5" effort="100"/></joint>
<joint name="second" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/>
<axis xyz="1 0 0"/><limit lower="-3" upper="3" velocity="5" effort="100"/></joint></robot>"""

STEP = 2.0 * np.pi / 2**14


def rounded(leg, truth, seed, step):
    """A recording whose encoders have steps, and hardly any noise that would make them average out."""
    fine = record(leg, truth, 8, seed=seed, torque_noise=0.05, encoder_noise=0.1 * step)
    columns = {
        name: np.round(values / step) * step if name.startswith(("q_", "theta_")) else values
        for name, values in fine.columns.items()
    }
    return Recording(fine.time, columns, "rounded")


def test_steps_are_found_in_counts_and_not_in_noise():
    rng = np.random.default_rng(0)
    values = np.sin(np.linspace(0.0, 40.0, 4000)) + 1e-4 * rng.standard_normal(4000)
    assert step_of(values) == 0.0
    assert step_of(np.round(values / STEP) * STEP) == pytest.approx(STEP)
    assert step_of(np.zeros(10)) == 0.0


@pytest.mark.scenario
def test_steps_that_repeat_are_told_and_counted(leg, truth):
    outside = []
    for seed in range(3):
        recording = rounded(leg, truth, seed, STEP)
        processed = process(recording, leg, period=10.0)
        assert processed.encoder_steps is not None
        np.testing.assert_allclose(processed.encoder_steps.motor, STEP, rtol=1e-9)
        model = identify(leg, processed)
        assert any("encoder steps do not average out" in text for text in model.warnings)
        # what they make of the deflection is no law that a spring lacks
        assert not any("its law leaves" in text for text in model.warnings)
        outside.extend(abs(s.stiffness - leg.spring(s.joint).stiffness) > s.half_width()[0] for s in model.springs)
        # what a repetition does not show counts, too
        assert np.all(model.std > np.sqrt(np.diag(model.uncertainty.repeatability)))
    # nine intervals of 95 %: three or more outside are chance in one case of a hundred
    assert sum(outside) <= 2


@pytest.mark.scenario
def test_what_steps_change_is_seen_in_a_few_periods(leg, truth, monkeypatch):
    """The same errors in all periods change the estimate by the same."""
    processed = process(rounded(leg, truth, 0, STEP), leg, period=10.0)
    assert processed.periods > repeated_steps.FEW
    few = identify(leg, processed)
    monkeypatch.setattr(repeated_steps, "FEW", processed.periods)
    whole = identify(leg, processed)
    more = [np.diag(m.uncertainty.covariance - m.uncertainty.repeatability) for m in (few, whole)]
    assert np.all(more[1] > 0.0)
    np.testing.assert_allclose(np.sqrt(more[0]), np.sqrt(more[1]), rtol=0.1)
    known = [[s.stiffness_std for s in m.springs] for m in (few, whole)]
    np.testing.assert_allclose(*known, rtol=0.1)


def test_a_rigid_joint_has_one_encoder():
    """Its motor errs as its link does, and no column that is not there is named."""
    robot = robot_from_text(RIGID, "arm")
    a, b = np.random.default_rng(4).normal(0.0, 0.3, (2, robot.n, 5))
    truth = truth_of(robot, FourierSeries(0.1, np.zeros(robot.n), a, b))
    processed = process(rounded(robot, truth, 0, STEP), robot, period=10.0, link_harmonics=200)
    steps = processed.encoder_steps
    assert np.all(steps.link_error > 0.0)
    assert "theta" not in steps.words(robot.joint_names)
    errors = steps.another(processed.motion, 10.0, (20, 20), np.random.default_rng(0))
    for own, other in zip(errors[:3], errors[3:], strict=True):
        np.testing.assert_array_equal(own, other)
    model = identify(robot, processed)
    told = [text for text in model.warnings if "larger than its noise" in text]
    assert all("the steps of these encoders, which repeat in every period, may be all of it" in text for text in told)
    assert told


def test_steps_below_the_noise_average_out(leg, truth):
    fine = record(leg, truth, 8, seed=1, torque_noise=0.05, encoder_noise=2.0 * STEP)
    columns = {
        name: np.round(values / STEP) * STEP if name.startswith(("q_", "theta_")) else values
        for name, values in fine.columns.items()
    }
    assert process(Recording(fine.time, columns, "dithered"), leg, period=10.0).encoder_steps is None


def test_harmonics_within_are_a_projection():
    rng = np.random.default_rng(2)
    a, b = rng.standard_normal((2, 200, 3))
    once = within(a, 20)
    np.testing.assert_allclose(within(once, 20), once, atol=1e-12)
    assert np.sum(once * b) == pytest.approx(np.sum(a * within(b, 20)))
    assert np.array_equal(within(a, 0), a)
