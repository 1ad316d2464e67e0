"""The step that a simulation takes by itself resolves how friction turns over at a reversal."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from plants import baxter_arm, from_parts, joint, link, modest_series, motor, ur10

from sea_ident import FourierSeries
from sea_ident.simulation import (
    ComputedTorque,
    FrictionJitter,
    PreslidingCoulomb,
    SensorNoise,
    Settling,
    SmoothCoulomb,
    VelocityController,
    plant_from_robot,
    simulate,
)
from sea_ident.simulation.passes import Clock, Passes
from sea_ident.simulation.reference import PeriodicReference
from sea_ident.simulation.usual_step import LONGEST, LONGEST_BETWEEN, SHORTEST, usual_step

FRICTION = np.array([6.7, 8.0, 6.4, 0.0, 0.0, 0.0])
"""Coulomb friction of a rigid arm of which the inertia of the rotors is not known, wrist apart [N m]."""


@pytest.fixture(scope="module")
def arm():
    robot = ur10()
    plant = replace(plant_from_robot(robot), coulomb_friction=FRICTION)
    return robot, plant, modest_series(robot, base_frequency=0.2, harmonics=5)


def steps(robot, plant, law, series):
    return usual_step(plant, [law] * robot.n, PeriodicReference(series))


@pytest.mark.scenario
def test_a_light_joint_with_much_friction_is_not_thrown_back_where_it_reverses(arm):
    robot, plant, series = arm
    begin = series.motion(np.zeros(1))

    def run(step):
        return simulate(
            robot, series, periods=1, plant=plant, step=step, friction=SmoothCoulomb(0.009), start=begin,
            sensors=SensorNoise.none(), jitter=FrictionJitter.none(),
        )  # fmt: skip

    usual, exact, long = run(None), run(3e-4), run(LONGEST)
    assert usual.step < LONGEST
    assert np.abs(usual.motion.q - exact.motion.q).max() < 1e-6
    usual_error, long_error = (np.abs(run.motion.dq - exact.motion.dq).max() for run in (usual, long))
    assert usual_error < 1e-4
    assert long_error > 3.0 * usual_error


@pytest.mark.scenario
def test_a_light_rotor_that_reverses_quickly_is_where_short_steps_put_it():
    numbers = "<viscousFriction>0.4</viscousFriction><coulombFriction>1.0</coulombFriction>"
    robot = from_parts(
        link("base"), link("one"), joint("a", "base", "one", "0 1 0"),
        motor("a", 'stiffness="300" damping="1.0"', numbers).replace("3e-5", "1e-5"),
    )  # fmt: skip
    series = FourierSeries(0.5, np.zeros(1), np.array([[0.0, 0.0, 0.3]]), np.array([[0.1, 0.0, 0.3]]))

    def positions(step):
        quiet = {"sensors": SensorNoise.none(), "jitter": FrictionJitter.none()}
        run = simulate(robot, series, periods=1, step=step, start=series.motion(np.zeros(1)), **quiet)
        return run.step, run.motion.q, run.motion.theta

    (usual, *found), (_, *exact) = positions(None), positions(6e-5)
    assert usual < LONGEST
    assert np.max(np.abs(np.subtract(found, exact))) < 5e-5


def test_friction_of_geared_joints_with_springs_needs_no_much_shorter_step(leg, leg_series):
    assert steps(leg, plant_from_robot(leg), SmoothCoulomb(), leg_series) == LONGEST
    baxter = baxter_arm()
    assert steps(baxter, plant_from_robot(baxter), SmoothCoulomb(), modest_series(baxter)) > 0.5 * LONGEST


def test_the_step_goes_with_the_smoothing_and_the_friction_to_an_end(arm):
    robot, plant, series = arm
    usual = steps(robot, plant, SmoothCoulomb(0.009), series)
    assert SHORTEST < usual < LONGEST
    assert steps(robot, plant, SmoothCoulomb(0.009 / 2.0), series) == pytest.approx(usual / 2.0)
    more = replace(plant, coulomb_friction=2.0 * FRICTION)
    assert steps(robot, more, SmoothCoulomb(0.009), series) == pytest.approx(usual / 2.0)
    assert steps(robot, plant, SmoothCoulomb(1e-5), series) == SHORTEST
    assert steps(robot, plant, PreslidingCoulomb(), series) == LONGEST


def test_friction_of_a_link_counts_too(leg, leg_series):
    plant = plant_from_robot(leg)
    heavy = replace(plant, link_coulomb_friction=np.full(3, 20.0))
    assert steps(leg, heavy, SmoothCoulomb(), leg_series) < steps(leg, plant, SmoothCoulomb(), leg_series)


def test_a_step_that_is_given_is_taken(arm):
    robot, plant, series = arm
    assert simulate(robot, series, periods=1, plant=plant, step=5e-3).step == pytest.approx(5e-3)


@pytest.mark.scenario
def test_a_fast_arm_without_friction_keeps_to_its_own_equations_of_motion():
    """Stiff gains on light wrists: a step that knew the state but not the command was 2e-5 rad and 0.1 N m off."""
    robot = ur10()
    generator = np.random.default_rng(4)
    series = FourierSeries(0.2, np.zeros(6), *(0.5 * generator.standard_normal((2, 6, 5))))
    begin = series.motion(np.zeros(1))

    def run(step):
        return simulate(
            robot, series, periods=1, step=step, start=begin, sensors=SensorNoise.none(), jitter=FrictionJitter.none()
        )

    usual, exact = run(None), run(LONGEST / 10.0)
    assert usual.step == LONGEST
    assert np.abs(usual.motion.dq).max() > 3.0
    assert np.abs(usual.motion.q - exact.motion.q).max() < 3e-6
    assert np.abs(usual.tau_motor - exact.tau_motor).max() < 0.03


@pytest.mark.scenario
@pytest.mark.parametrize("which", ["leg", "baxter", "rigid arm", "stiction"])
def test_long_steps_between_reversals_leave_the_motion_where_short_ones_put_it(which, leg, leg_series, arm):
    robot, plant, series = arm
    law = SmoothCoulomb(0.009)
    if which in ("leg", "stiction"):
        robot, plant, series = leg, plant_from_robot(leg), leg_series
        law = PreslidingCoulomb() if which == "stiction" else SmoothCoulomb()
    elif which == "baxter":
        robot = baxter_arm()
        plant, series, law = (
            plant_from_robot(robot),
            modest_series(robot, base_frequency=0.2, harmonics=3),
            SmoothCoulomb(),
        )

    def run(step):
        quiet = {"sensors": SensorNoise.none(), "jitter": FrictionJitter.none(), "start": begin}
        return simulate(robot, series, periods=1, plant=plant, step=step, friction=law, **quiet)

    def errors(run):
        torque = np.abs(run.tau_motor - exact.tau_motor).max(axis=0) / np.abs(exact.tau_motor).max(axis=0)
        return np.abs(run.motion.q - exact.motion.q).max(), torque.max()

    begin = simulate(robot, series, periods=1, plant=plant, friction=law, settling=Settling(1e-4)).motion
    usual = run(None)
    short, exact = run(usual.step), run(usual.step / 4.0)
    assert usual.steps < 0.9 * short.steps
    assert np.all(np.array(errors(usual)) < np.maximum([1e-5, 2e-3], 1.5 * np.array(errors(short))))


def test_steps_are_made_of_shorter_ones():
    reference = PeriodicReference(FourierSeries(0.5, np.zeros(1), np.ones((1, 1)), np.ones((1, 1))))

    def steps(rate, short):
        return [clock.step for clock in Clock.from_short_to_long(reference, rate, short, LONGEST_BETWEEN)]

    assert steps(200.0, 2.5e-3) == pytest.approx([2.5e-3, 5e-3])
    assert steps(200.0, 5e-4) == pytest.approx([5e-3 / 12, 5e-3 / 3, 5e-3])
    assert steps(50.0, 2.5e-3) == pytest.approx([2.5e-3, 5e-3])
    assert steps(1000.0, 2.5e-3) == pytest.approx([1e-3])
    assert steps(1000.0, 5e-4) == pytest.approx([5e-4, 1e-3])


def test_where_every_long_step_is_too_long_few_are_tried(leg):
    series = FourierSeries(2.0, np.zeros(3), np.full((3, 2), 0.05), np.full((3, 2), 0.1))
    usual = simulate(leg, series, periods=1)
    short = simulate(leg, series, periods=1, step=usual.step)
    assert short.settling_periods == usual.settling_periods
    assert usual.steps < 1.2 * short.steps


def test_no_long_step_goes_across_a_reversal(leg, leg_series, monkeypatch):
    """Stiction lets the error of a step stay small there, and what comes after it is wrong all the same."""
    crossed, strode = [], Passes._strode

    def noted(self, track, state, begin, k):
        after = strode(self, track, state, begin, k)
        if after is not None:
            crossed.append(np.any((state * after)[len(state) // 2 :] < 0.0))
        return after

    monkeypatch.setattr(Passes, "_strode", noted)
    usual = simulate(leg, leg_series, periods=1, friction=PreslidingCoulomb(), settling=Settling(longest=1))
    assert len(crossed) > 50
    assert not any(crossed)
    speeds = np.concatenate([usual.motion.dq, usual.motion.dtheta], axis=1)
    assert np.sum(np.any(speeds[1:] * speeds[:-1] < 0.0, axis=1)) > 20


def test_a_step_that_is_given_is_taken_throughout(leg, leg_series):
    given = simulate(leg, leg_series, periods=1, step=2.5e-3, start=leg_series.motion(np.zeros(1)))
    assert given.steps == round(given.period / 2.5e-3)


def test_gains_do_not_change_with_the_steps(leg, leg_series):
    reference = PeriodicReference(leg_series)
    for controller in (VelocityController(), ComputedTorque()):
        one, other = (controller.drive(leg, reference, np.linspace(0.0, end, 7)) for end in (1.0, 3.0))
        np.testing.assert_array_equal(one.velocity_gain, other.velocity_gain)
        np.testing.assert_array_equal(one.position_gain, other.position_gain)


def test_what_turns_fast_takes_shorter_steps(leg, leg_series):
    plant = plant_from_robot(leg)
    fast = replace(leg_series, a=6.0 * leg_series.a, b=6.0 * leg_series.b)
    times = np.linspace(0.0, fast.period, 200)
    turning = np.max(np.abs(np.cumsum(fast.motion(times).dq, axis=1)))  # all about the same axis
    step = steps(leg, plant, SmoothCoulomb(), fast)
    assert SHORTEST < step < LONGEST
    assert step * turning == pytest.approx(0.034, rel=0.01)


def test_a_fast_arm_without_friction_moves_as_its_torques_ask():
    robot = ur10()
    series = modest_series(robot, base_frequency=0.5, harmonics=2)
    series = replace(series, a=6.0 * series.a, b=6.0 * series.b)
    quiet = {"sensors": SensorNoise.none(), "jitter": FrictionJitter.none(), "controller": ComputedTorque()}

    def missing(step):
        """Part of the torque that inverse dynamics of the positions do not give [-]."""
        run = simulate(robot, series, periods=2, step=step, **quiet)
        samples = len(run.motion) // 2
        spectrum = np.fft.rfft(run.motion.q[samples:], axis=0)
        rate = 2j * np.pi * np.arange(len(spectrum))[:, None] / series.period
        spectrum[samples // 5 :] = 0.0
        q, dq, ddq = (np.fft.irfft(spectrum * rate**order, samples, axis=0) for order in range(3))
        data = robot.model.createData()
        torque = np.array([pin.rnea(robot.model, data, *each) for each in zip(q, dq, ddq, strict=True)])
        error = run.tau_motor[samples:] - torque
        return run.step, float(np.max(np.std(error, axis=0) / np.std(torque, axis=0)))

    (usual, left), (_, long_left) = missing(None), missing(LONGEST)
    assert usual < LONGEST
    assert left < 5e-5
    assert long_left > 3.0 * left
