import numpy as np
import pytest

from sea_ident import SeaIdentError
from sea_ident.motion import Motion
from sea_ident.robot import robot_from_text
from sea_ident.simulation import FrictionJitter, SensorNoise, WarmUp, motor_current, plant_from_robot, simulate
from sea_ident.simulation.sensors import noise


def test_current_pays_for_the_transmission_in_the_direction_of_the_power(leg):
    plant = plant_from_robot(leg)
    speed = np.array([[1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]])
    torque = np.array([[10.0, -10.0, 4.0], [10.0, -10.0, -4.0]])
    current = motor_current(plant, speed, torque)
    ratio, constant, eta = leg.gear_ratios, plant.torque_constant, plant.efficiency
    forward = np.array([[True, True, True], [False, False, False]])
    # paper, eq. 7, read from the current to the torque
    direction = np.sign(speed * ratio * constant * current)
    assert np.array_equal(direction > 0.0, forward)
    np.testing.assert_allclose(ratio * constant * current * eta**direction, torque, rtol=1e-14)
    assert abs(current[0, 0]) > abs(current[1, 0])


def test_perfect_sensors_read_the_exact_signals(exact, leg):
    recording = exact.recording
    names = leg.joint_names
    np.testing.assert_array_equal(recording.channel("q", names), exact.motion.q)
    np.testing.assert_array_equal(recording.channel("theta", names), exact.motion.theta)
    np.testing.assert_array_equal(
        recording.channel("current", names), motor_current(exact.plant, exact.motion.dtheta, exact.tau_motor)
    )
    assert not recording.has("tau_spring", "hip")
    assert recording.warnings == ()


def test_encoders_round_and_currents_scatter(leg, leg_series):
    sensors = SensorNoise(link_position=3e-4, link_resolution=1e-3, motor_resolution=(1e-3, 2e-3, 4e-3), current=0.2)
    run = simulate(leg, leg_series, periods=3, sensors=sensors, jitter=FrictionJitter.none(), seed=3)
    q, theta = run.recording.channel("q", leg.joint_names), run.recording.channel("theta", leg.joint_names)
    np.testing.assert_allclose(q / 1e-3, np.round(q / 1e-3), atol=1e-6)
    steps = np.array([1e-3, 2e-3, 4e-3])
    np.testing.assert_allclose(theta / steps, np.round(theta / steps), atol=1e-6)
    assert np.std(q - run.motion.q) == pytest.approx(np.hypot(3e-4, 1e-3 / np.sqrt(12.0)), rel=0.1)
    exact = motor_current(run.plant, run.motion.dtheta, run.tau_motor)
    error = run.recording.channel("current", leg.joint_names) - exact
    np.testing.assert_allclose(error.std(axis=0), 0.2, rtol=0.1)
    neighbours = np.mean(error[1:] * error[:-1]) / np.mean(error**2)
    assert abs(neighbours) < 0.1


def test_coloured_noise_has_the_correlation_asked_for():
    samples = noise(np.random.default_rng(0), (200_000, 1), float(np.exp(-0.005 / 0.02)))[:, 0]
    for lag in (1, 4, 8):
        measured = np.mean(samples[lag:] * samples[:-lag])
        assert measured == pytest.approx(np.exp(-lag * 0.005 / 0.02), abs=0.02)


def test_spring_torque_and_temperature_only_where_there_are_such_sensors(leg, leg_series):
    sensors = SensorNoise(spring_torque=0.0, temperature=0.0)
    warm = WarmUp(ambient=20.0, rise=(10.0, 20.0, 30.0), time_constant=4.0)
    run = simulate(leg, leg_series, periods=2, sensors=sensors, warm_up=warm)
    np.testing.assert_array_equal(run.recording.channel("tau_spring", leg.joint_names), run.tau_spring)
    heat = run.recording.channel("temperature", leg.joint_names)
    expected = 20.0 + np.outer(1.0 - np.exp(-run.motion.time / 4.0), [10.0, 20.0, 30.0])
    np.testing.assert_allclose(heat, expected, rtol=1e-12)


@pytest.mark.scenario
def test_torque_variance_over_periods_peaks_at_velocity_reversal(leg, leg_series):
    # Paper, fig. 1(b). Noise of the sensors is left out: what is seen is the friction.
    run = simulate(leg, leg_series, periods=16, sensors=SensorNoise.none(), seed=2)
    samples = len(run.motion) // run.periods
    torque = run.tau_motor.reshape(run.periods, samples, leg.n)
    variance = torque.var(axis=0, ddof=1)
    speed = np.abs(run.motion.dtheta.reshape(run.periods, samples, leg.n).mean(axis=0))
    for i in range(leg.n):
        near, far = speed[:, i] < 0.1 * speed[:, i].max(), speed[:, i] > 0.6 * speed[:, i].max()
        assert near.sum() > 10
        assert far.sum() > 10
        assert variance[near, i].mean() > 5.0 * variance[far, i].mean()


@pytest.mark.parametrize(
    ("change", "match"),
    [({"current": -1.0}, "current"), ({"link_resolution": float("nan")}, "link_resolution")],
)
def test_impossible_sensors_are_refused(change, match):
    with pytest.raises(SeaIdentError, match=match):
        SensorNoise(**change)


def test_wrong_number_of_sensors_is_refused(leg, leg_series):
    with pytest.raises(SeaIdentError, match="current has 2 values for 3 joints"):
        simulate(leg, leg_series, periods=1, sensors=SensorNoise(current=(0.1, 0.1)))


FINGER = """<robot name="finger"><link name="palm"/>
  <link name="slide"><inertial><mass value="0.05"/>
    <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tip"><inertial><origin xyz="0.02 0 0"/><mass value="0.02"/>
    <inertia ixx="1e-6" iyy="4e-6" izz="4e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="reach" type="prismatic"><parent link="palm"/><child link="slide"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.05" velocity="0.1" effort="4"/></joint>
  <joint name="bend" type="revolute"><parent link="slide"/><child link="tip"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="1.5" velocity="5" effort="0.1"/></joint>
  <transmission name="r" type="sea_ident/SeriesElastic"><joint name="reach"/><actuator name="rm">
    <mechanicalReduction>2000</mechanicalReduction><torqueConstant>0.002</torqueConstant>
    <rotorInertia>1e-9</rotorInertia><viscousFriction>0.5</viscousFriction><coulombFriction>0.1</coulombFriction>
    </actuator>
    <seriesElastic stiffness="900"/></transmission>
  <transmission name="b" type="sea_ident/SeriesElastic"><joint name="bend"/><actuator name="bm">
    <mechanicalReduction>64</mechanicalReduction><rotorInertia>2e-9</rotorInertia>
    <viscousFriction>1e-4</viscousFriction><coulombFriction>4e-4</coulombFriction></actuator>
    <seriesElastic stiffness="0.15"/></transmission></robot>"""


def test_usual_sensors_suit_what_a_joint_may_bear_and_slides():
    robot = robot_from_text(FINGER, "finger.urdf")
    usual, found = SensorNoise(), SensorNoise.usual(robot)
    assert found.motor_torque == pytest.approx((0.04, 0.001))
    assert found.current == pytest.approx((0.04 / (2000 * 0.002), usual.current))
    for name in ("link_position", "motor_position", "link_resolution", "motor_resolution"):
        assert getattr(found, name) == pytest.approx((0.1 * getattr(usual, name), getattr(usual, name)))


def test_a_finger_is_recorded_with_torque_that_tells_something():
    robot = robot_from_text(FINGER, "finger.urdf")
    still = np.zeros((200, 2))
    rest = Motion.rigid(np.arange(200) * 0.005, still + np.array([0.02, 0.5]), still, still)
    recording = simulate(robot, rest, seed=1, plant=plant_from_robot(robot)).recording
    torque = recording.channel("tau_motor", ("bend",))
    assert np.std(torque) == pytest.approx(0.001, rel=0.3)


def test_usual_sensors_of_the_leg_are_those_of_no_robot_in_particular(leg):
    usual, found = SensorNoise(), SensorNoise.usual(leg)
    for name in ("link_position", "motor_position", "link_resolution", "motor_resolution", "current", "motor_torque"):
        np.testing.assert_array_equal(found.per_joint(name, leg.n), usual.per_joint(name, leg.n))
    assert found.spring_torque is None
