"""What the sensors see: noise, quantisation, currents, temperature."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from scipy.signal import lfilter

from sea_ident._typing import FloatArray
from sea_ident.exceptions import SimulationError
from sea_ident.robot import Robot
from sea_ident.simulation.friction import SLIDE
from sea_ident.simulation.plant import Plant

Spread = float | tuple[float, ...]

PART_OF_LIMIT = 0.01
"""Largest usual noise of torque, as a part of the limit of the torque of the joint [-]."""


@dataclass(frozen=True)
class SensorNoise:
    """Noise and resolution of the sensors; every number is one for all joints or one per joint.

    Encoders read a noisy position and round it. Noise of current and torque is white, or has an exponential correlation
    over `correlation_time`.

    Attributes:
        link_position: standard deviation of q [rad] or [m].
        motor_position: standard deviation of theta [rad] or [m].
        link_resolution: step of the link encoder, 0 for none [rad] or [m].
        motor_resolution: step of the motor encoder after the gear, 0 for none [rad] or [m].
        current: standard deviation of the current [A].
        motor_torque: standard deviation of tau_motor, where it is recorded instead of the current [N m] or [N].
        spring_torque: standard deviation of tau_spring; None where the springs have no torque sensor [N m] or [N].
        temperature: standard deviation of the temperature [degC].
        correlation_time: of the noise of current and torques, 0 for white noise [s].
    """

    link_position: Spread = 2e-5
    motor_position: Spread = 1e-5
    link_resolution: Spread = 2.0 * np.pi / 2**17
    motor_resolution: Spread = 2.0 * np.pi / 2**18
    current: Spread = 0.05
    motor_torque: Spread = 0.2
    spring_torque: Spread | None = None
    temperature: Spread = 0.1
    correlation_time: float = 0.0

    def __post_init__(self) -> None:
        for f in fields(self):
            if getattr(self, f.name) is None:
                continue
            values = np.atleast_1d(np.asarray(getattr(self, f.name), dtype=np.float64))
            if values.ndim != 1 or not np.all(np.isfinite(values)) or np.any(values < 0.0):
                raise SimulationError(f"sensor noise: {f.name} is {getattr(self, f.name)}; give numbers >= 0")

    @staticmethod
    def usual(robot: Robot) -> "SensorNoise":
        """That of the sensors that a robot would have.

        Encoders of slides are ten times as fine, in metres, as those of turning joints in radians. What measures
        current or torque has a standard deviation of 1 % of what the joint may bear, where that is less than usual: a
        finger has other sensors than a leg.

        Args:
            robot: the robot.
        """
        usual = SensorNoise()
        fine = np.where([joint.prismatic for joint in robot.joints], SLIDE, 1.0)
        torque = np.minimum(usual.per_joint("motor_torque", robot.n), PART_OF_LIMIT * robot.limits.torque)
        drives = [joint.actuator for joint in robot.joints]
        constants = np.array([np.nan if a is None else (a.torque_constant or np.nan) for a in drives])
        most = PART_OF_LIMIT * robot.limits.torque / np.abs(robot.gear_ratios * constants)

        def as_fine(name: str) -> tuple[float, ...]:
            return tuple((fine * usual.per_joint(name, robot.n)).tolist())

        return SensorNoise(
            link_position=as_fine("link_position"),
            motor_position=as_fine("motor_position"),
            link_resolution=as_fine("link_resolution"),
            motor_resolution=as_fine("motor_resolution"),
            current=tuple(np.fmin(usual.per_joint("current", robot.n), most).tolist()),
            motor_torque=tuple(torque.tolist()),
        )

    @staticmethod
    def none() -> "SensorNoise":
        """Perfect sensors, none in the springs."""
        exact = dict.fromkeys((f.name for f in fields(SensorNoise) if f.name != "spring_torque"), 0.0)
        return SensorNoise(**exact)

    def per_joint(self, name: str, n: int) -> FloatArray:
        """(n,) values of one field.

        Raises:
            SimulationError: if it has another number of joints.
        """
        values = np.asarray(getattr(self, name), dtype=np.float64)
        if values.ndim == 1 and len(values) != n:
            raise SimulationError(f"sensor noise: {name} has {len(values)} values for {n} joints")
        return np.broadcast_to(values, (n,))


@dataclass(frozen=True)
class WarmUp:
    """Temperature of the motors: ambient + rise (1 - exp(-t / time_constant)) from the start of the recording.

    Attributes:
        ambient: [degC].
        rise: final rise, one for all joints or one per joint [K].
        time_constant: [s].
    """

    ambient: float = 22.0
    rise: Spread = 25.0
    time_constant: float = 600.0

    def at(self, time: FloatArray | float, n: int) -> FloatArray:
        """(..., n) temperatures at the times (...) [degC]."""
        share = 1.0 - np.exp(-np.maximum(np.asarray(time), 0.0) / self.time_constant)
        rise = np.broadcast_to(np.asarray(self.rise, dtype=np.float64), (n,))
        return np.asarray(self.ambient + share[..., None] * rise, dtype=np.float64)


def motor_current(plant: Plant, dtheta: FloatArray, tau_motor: FloatArray) -> FloatArray:
    """Current that the drives need to deliver a torque at the joint side.

    The transmission loses torque on the way of the power: tau_m = N k_t I eta where the motor drives the joint,
    tau_m = N k_t I / eta where the joint drives the motor (paper, eq. 7). NaN where the torque constant is not known.

    Args:
        plant: efficiencies and torque constants.
        dtheta: (N, n) motor velocities [rad/s].
        tau_motor: (N, n) torques at the joint side [N m].

    Returns:
        (N, n) currents [A].
    """
    ratio = plant.robot.gear_ratios
    driving = dtheta * tau_motor
    loss = plant.efficiency ** np.sign(driving)
    current: FloatArray = tau_motor / (ratio * plant.torque_constant * loss)
    return current


def noise(generator: np.random.Generator, shape: tuple[int, int], correlation: float) -> FloatArray:
    """Unit-variance noise of (N, n) samples, first-order with the one-step correlation given."""
    white = generator.standard_normal(shape)
    if correlation == 0.0:
        return white
    drive = white * np.sqrt(1.0 - correlation**2)
    drive[0] = white[0]
    coloured: FloatArray = lfilter([1.0], [1.0, -correlation], drive, axis=0)
    return coloured


def _quantise(values: FloatArray, resolution: FloatArray) -> FloatArray:
    step = np.where(resolution > 0.0, resolution, 1.0)
    return np.where(resolution > 0.0, np.round(values / step) * step, values)


def sensed_columns(
    plant: Plant,
    time: FloatArray,
    dtheta: FloatArray,
    signals: Mapping[str, FloatArray],
    sensors: SensorNoise,
    seed: np.random.SeedSequence,
) -> dict[str, FloatArray]:
    """Columns of the recording.

    Args:
        plant: the plant.
        time: (N,) [s].
        dtheta: (N, n) exact motor velocities, which the efficiency depends on [rad/s].
        signals: (N, n) q, theta, tau_motor, tau_spring and possibly temperature, after the effects in the signal chain.
        sensors: noise and resolution.
        seed: of the noise.

    Returns:
        Column name -> (N,) samples: q, theta (elastic joints), current or tau_motor, tau_spring (elastic joints),
        temperature.
    """
    robot = plant.robot
    n, shape = robot.n, dtheta.shape
    step = float(np.median(np.diff(time)))
    correlation = float(np.exp(-step / sensors.correlation_time)) if sensors.correlation_time > 0.0 else 0.0
    generators = iter([np.random.default_rng(child) for child in seed.spawn(5)])

    def read(name: str, values: FloatArray, memory: float = 0.0) -> FloatArray:
        return values + noise(next(generators), shape, memory) * sensors.per_joint(name, n)

    q = _quantise(read("link_position", signals["q"]), sensors.per_joint("link_resolution", n))
    theta = _quantise(read("motor_position", signals["theta"]), sensors.per_joint("motor_resolution", n))
    generator = next(generators)
    unit = noise(generator, shape, correlation)
    current = motor_current(plant, dtheta, signals["tau_motor"]) + unit * sensors.per_joint("current", n)
    torque = signals["tau_motor"] + unit * sensors.per_joint("motor_torque", n)
    columns: dict[str, FloatArray] = {}
    for i, joint in enumerate(robot.joints):
        columns[f"q_{joint.name}"] = q[:, i]
        if joint.elastic:
            columns[f"theta_{joint.name}"] = theta[:, i]
        if np.isfinite(plant.torque_constant[i]):
            columns[f"current_{joint.name}"] = current[:, i]
        else:
            columns[f"tau_motor_{joint.name}"] = torque[:, i]
    if sensors.spring_torque is not None:
        spring = read("spring_torque", signals["tau_spring"], correlation)
        columns |= {f"tau_spring_{joint.name}": spring[:, i] for i, joint in enumerate(robot.joints) if joint.elastic}
    if "temperature" in signals:
        measured = read("temperature", signals["temperature"])
        columns |= {f"temperature_{name}": measured[:, i] for i, name in enumerate(robot.joint_names)}
    return columns
