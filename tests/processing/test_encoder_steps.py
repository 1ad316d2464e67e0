"""Steps of coarse encoders that repeat in every period: how large they are, and what they hide."""

import numpy as np
import pytest

from sea_ident.motion import FourierSeries
from sea_ident.processing import process
from sea_ident.processing.encoder_steps import encoder_steps
from sea_ident.processing.harmonics import choose_harmonics, choose_motor_harmonics
from sea_ident.recordings import Recording
from sea_ident.robot import robot_from_text

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")

PERIOD, PERIODS, HARMONICS = 10.0, 12, 5
MOTOR = np.array([0])

ARM = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.02 0.01 -0.2"/><mass value="3"/>
<inertia ixx="0.03" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="first" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" velocity="5" effort="100"/></joint></robot>"""


def moving(rate, harmonics=HARMONICS):
    """(N,) a motion of 0.2 rad with so many harmonics, at a sampling rate [Hz]."""
    phase = 2.0 * np.pi * np.arange(round(PERIOD * rate)) / (PERIOD * rate)
    a, b = np.random.default_rng(0).normal(size=(2, harmonics))
    motion = sum(a[k] * np.sin((k + 1) * phase) + b[k] * np.cos((k + 1) * phase) for k in range(harmonics))
    return 0.2 * motion / np.abs(motion).max()


def read(motion, step, noise, periods=PERIODS, seed=1):
    """(P, N, 1) what an encoder reads of a motion, with noise in units of its step."""
    rng = np.random.default_rng(seed)
    return step * np.round(motion / step + noise * rng.standard_normal((periods, len(motion))))[:, :, None]


def steps_in(stack):
    values = stack.reshape(-1, 1)
    return encoder_steps(values, values, stack, stack, MOTOR)


@pytest.mark.scenario
@pytest.mark.parametrize("noise", [0.0, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("rate", [250, 4000])
@pytest.mark.parametrize("bits", [10, 12, 14])
def test_what_repeats_is_found_whether_a_step_lasts_or_not(bits, rate, noise):
    motion, step = moving(rate), 2.0 * np.pi / 2**bits
    many = 200
    error = read(motion, step, noise, many, seed=2)
    known = error.mean(axis=0)[:, 0] - motion
    # what so many periods have not averaged out does not repeat
    truth = np.sqrt(known.var() - error.var(axis=0, ddof=1).mean() / many)
    found = steps_in(read(motion, step, noise))
    assert found.link_error[0] == pytest.approx(truth, rel=0.12)
    if noise == 0.0:
        assert found.link_error[0] == pytest.approx(step / np.sqrt(12.0), rel=0.01)


@pytest.mark.parametrize("rate", [250, 4000])
def test_steps_in_much_noise_do_not_repeat(rate):
    assert steps_in(read(moving(rate), 2.0 * np.pi / 2**12, 0.5)) is None


@pytest.mark.parametrize("held", [1000, 10000], ids=["a part of a period", "a period"])
def test_what_happens_once_hides_no_steps(held):
    """The motion stops before the end of the recording, many steps away from where it should be."""
    motion, step = moving(1000), 2.0 * np.pi / 2**12
    stack = read(motion, step, 0.05)
    usual = steps_in(stack).link_error[0]
    stack[-1, -held:] = stack[-1, -held]
    assert steps_in(stack).link_error[0] == pytest.approx(usual, rel=0.02)


def test_a_part_in_which_periods_differ_hides_no_steps_elsewhere():
    """Where friction holds a joint, periods may differ by many steps, and repeat to the step where it moves."""
    motion, step = moving(1000), 2.0 * np.pi / 2**12
    counts = read(motion / step, 1.0, 0.05)
    usual = steps_in(step * counts).link_error[0]
    counts[:, -1000:] += np.random.default_rng(4).integers(-10, 10, (PERIODS, 1, 1))
    assert steps_in(step * counts).link_error[0] == pytest.approx(np.sqrt(0.9) * usual, rel=0.05)


def test_periods_that_differ_in_turn_repeat_no_steps():
    """Where half the period is taken for it."""
    motion, step = moving(1000), 2.0 * np.pi / 2**12
    assert steps_in(read(motion, step, 0.05).reshape(2 * PERIODS, -1, 1)) is None


def test_steps_average_out_where_the_motion_drifts_across_them():
    motion, step = moving(1000), 2.0 * np.pi / 2**12
    drifts = np.linspace(0.0, 4.0, PERIODS)[:, None] * step
    counts = np.round((motion + drifts) / step + 0.05 * np.random.default_rng(1).standard_normal((PERIODS, 10000)))
    assert steps_in(step * counts[:, :, None]) is None


def test_a_joint_that_rests_between_two_steps_has_none_that_repeat():
    counts = np.random.default_rng(3).integers(0, 3, (PERIODS, 500, 1))
    assert steps_in(2.0 * np.pi / 2**12 * counts) is None


@pytest.mark.parametrize("noise", [0.0, 0.07, 0.1])
@pytest.mark.parametrize("rate", [1000, 2000, 4000])
@pytest.mark.parametrize("harmonics", [1, 5])
def test_no_harmonic_is_made_of_steps(harmonics, rate, noise):
    """The motion has some harmonics, and steps that last for many samples have hundreds."""
    stack = read(moving(rate, harmonics), 2.0 * np.pi / 2**12, noise)
    steps, most = steps_in(stack), stack.shape[1] // 3
    assert choose_harmonics(stack, most) > 20
    assert choose_harmonics(stack, most, steps.link_power(stack)) == harmonics
    assert choose_motor_harmonics(stack, most, steps.motor_power(stack)) == harmonics


def test_harmonics_of_the_motion_that_are_small_are_not_taken_for_steps():
    """A twentieth of a step in harmonic 30 is more than all steps leave there."""
    phase = 2.0 * np.pi * np.arange(10000) / 10000
    step = 2.0 * np.pi / 2**12
    stack = read(moving(1000) + 0.5 * step * np.cos(30.0 * phase), step, 0.05)
    assert choose_harmonics(stack, 3333, steps_in(stack).link_power(stack)) == 30


def test_a_coarse_encoder_gives_the_acceleration_at_a_high_rate():
    """The acceleration is that of the motion to a per cent, and not hundreds of times as large."""
    arm = robot_from_text(ARM, "arm")
    a, b = 0.1 * np.random.default_rng(5).normal(size=(2, 1, HARMONICS))
    truth = FourierSeries(1.0 / PERIOD, np.zeros(1), a, b).sample(samples=20000)
    step = 2.0 * np.pi / 2**12
    q = read(truth.q[:, 0], step, 0.05).ravel()
    torque = np.tile(truth.ddq[:, 0], PERIODS) + 0.01 * np.random.default_rng(6).standard_normal(len(q))
    time = np.arange(len(q)) * (PERIOD / 20000)
    found = process(Recording(time, {"q_first": q, "tau_motor_first": torque}, "coarse"), arm, period=PERIOD)
    assert found.link_harmonics == HARMONICS
    error = np.sqrt(np.mean((found.motion.ddq - truth.ddq) ** 2))
    assert error < 0.01 * np.sqrt(np.mean(truth.ddq**2))
