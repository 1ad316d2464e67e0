"""`simulate`: closed-loop forward dynamics of the elastic robot."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, isfinite

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import SimulationError
from sea_ident.motion import FourierSeries, Motion
from sea_ident.recordings import Recording
from sea_ident.robot import Robot
from sea_ident.simulation.controller import Controller, Drive, VelocityController
from sea_ident.simulation.dynamics import ClosedLoop
from sea_ident.simulation.friction import FrictionJitter, FrictionLaw, JointFriction, SmoothCoulomb
from sea_ident.simulation.plant import Plant, PlantedEffect, plant_from_robot
from sea_ident.simulation.planted import PlantedTorques, altered_robot, check_planted
from sea_ident.simulation.reference import HasSeries, Reference, as_reference
from sea_ident.simulation.result import Simulation
from sea_ident.simulation.rosenbrock import ros34pw2
from sea_ident.simulation.sensors import SensorNoise, WarmUp, sensed_columns

FASTEST = 1e4
"""A speed beyond this [rad/s or m/s] is a divergence."""


@dataclass(frozen=True)
class Settling:
    """When the motion counts as periodic.

    Attributes:
        tolerance: largest change of a position from one period to the next [rad] or [m].
        longest: periods after which the recording starts in any case, with a warning.
    """

    tolerance: float = 1e-8
    longest: int = 10


def simulate(
    robot: Robot,
    reference: FourierSeries | HasSeries | Motion,
    *,
    periods: int = 20,
    seed: int = 0,
    sensors: SensorNoise | None = None,
    jitter: FrictionJitter | None = None,
    controller: Controller | None = None,
    friction: FrictionLaw | None = None,
    plant: Plant | None = None,
    effects: Sequence[PlantedEffect] = (),
    warm_up: WarmUp | None = None,
    rate: float = 200.0,
    step: float = 2.5e-3,
    settling: Settling | None = None,
    start: Motion | None = None,
) -> Simulation:
    """Simulate an experiment: the motors follow a reference, the sensors are recorded.

    The controller commands torque at the joint side; the currents are those that the drives then need, by the
    efficiency of the transmission in the direction of the power (paper, eq. 7).

    Args:
        robot: the robot as the controller knows it, and the plant unless one is given.
        reference: a Fourier series (or an Excitation), followed periodically by the motors; or a Motion, followed once.
        periods: number of recorded periods.
        seed: of noise and jitter; equal seeds give equal results.
        sensors: noise and resolution; `SensorNoise()` by default, `SensorNoise.none()` for exact signals.
        jitter: friction that varies from pass to pass; `FrictionJitter()` by default.
        controller: `VelocityController()` by default.
        friction: Coulomb friction around zero speed; `SmoothCoulomb()` by default.
        plant: the true numbers; those of the robot's description by default.
        effects: what else acts.
        warm_up: temperature of the motors; none by default.
        rate: samples per second [Hz]; a whole number per period is taken.
        step: longest step of the integrator [s]; a whole number per sample is taken.
        settling: when the motion counts as periodic.
        start: its first sample is the initial state, and nothing is settled; by default a periodic reference is
            settled, and a single pass starts at rest in static equilibrium.

    Returns:
        The recording and the exact signals behind it.

    Raises:
        SimulationError: a number is missing, the reference does not fit, or the motion diverges.
    """
    if periods < 1 or not rate > 0.0 or not step > 0.0:
        raise SimulationError(f"periods {periods}, rate {rate} Hz and step {step} s must all be positive")
    check_planted(robot, effects)
    plant = plant_from_robot(robot) if plant is None else plant
    if plant.robot.joint_names != robot.joint_names:
        raise SimulationError("the plant is another robot: its joints are " + ", ".join(plant.robot.joint_names))
    acting = plant.replace(robot=altered_robot(plant.robot, effects)) if effects else plant
    follow = as_reference(robot, reference)
    clock = _Clock.build(follow, rate, step)
    method = ros34pw2()
    drive = (controller or VelocityController()).drive(robot, follow, clock.stage_times(method.nodes))
    streams = np.random.SeedSequence(seed).spawn(2)
    state = _initial_state(acting, drive, start)
    law, vary = friction or SmoothCoulomb(), jitter or FrictionJitter()
    run = _Run(acting, drive, clock, len(method.nodes), len(effects))

    def loop(frictions: list[JointFriction]) -> ClosedLoop:
        planted = None
        if effects:
            temperature = None if warm_up is None else lambda t: warm_up.at(t, robot.n)
            planted = PlantedTorques(robot, effects, _motor_coordinates(robot), clock.duration, temperature)
        links = [
            law.start(acting.link_viscous_friction[i], acting.link_coulomb_friction[i], float(state[i]))
            if robot.elastic[i] and (acting.link_viscous_friction[i] or acting.link_coulomb_friction[i])
            else None
            for i in range(robot.n)
        ]
        return ClosedLoop(acting, drive, frictions, links, planted, method, clock.step)

    motors = _motor_coordinates(robot)
    frictions = [
        law.start(float(acting.viscous_friction[i]), float(acting.coulomb_friction[i]), float(state[motors[i]]))
        for i in range(robot.n)
    ]
    system = loop(frictions)
    warnings: list[str] = list(plant.notes)
    settled, settling_periods = float("nan"), 0
    if follow.period is not None and start is None:
        rule = settling or Settling()
        settled = float("inf")
        while settled > rule.tolerance and settling_periods < rule.longest:
            before = state.copy()
            state = run.period(system, state, -follow.period)
            settling_periods += 1
            settled = float(np.max(np.abs(state - before)[: len(state) // 2]))
        if settled > rule.tolerance:
            warnings.append(
                f"the motion still changes by {settled:.2g} rad per period after {settling_periods} settling periods"
            )
    smoothing = getattr(law, "smoothing", 0.005)
    system.replace_motor_friction(
        [
            vary.on(f, float(acting.coulomb_friction[i]), smoothing, seed_i)
            for i, (f, seed_i) in enumerate(zip(frictions, streams[0].spawn(robot.n), strict=True))
        ]
    )
    count = periods if follow.period is not None else 1
    for k in range(count):
        state = run.record(system, state, k * clock.duration)
    return run.result(plant, acting, follow, tuple(effects), sensors or SensorNoise(), warm_up, streams[1],
                      count, settling_periods, settled, tuple(warnings))  # fmt: skip


@dataclass(frozen=True)
class _Clock:
    """Samples and steps of one pass."""

    samples: int
    substeps: int
    duration: float

    @staticmethod
    def build(reference: Reference, rate: float, step: float) -> "_Clock":
        samples = max(1, round(rate * reference.duration))
        return _Clock(samples, ceil(reference.duration / samples / step - 1e-9), reference.duration)

    @property
    def step(self) -> float:
        return self.duration / (self.samples * self.substeps)

    def stage_times(self, nodes: FloatArray) -> FloatArray:
        steps = np.arange(self.samples * self.substeps)
        return (self.step * (steps[:, None] + nodes)).ravel()


def _motor_coordinates(robot: Robot) -> list[int]:
    motors = list(range(robot.n))
    for k, i in enumerate(robot.elastic_indices):
        motors[int(i)] = robot.n + k
    return motors


def _initial_state(plant: Plant, drive: Drive, start: Motion | None) -> FloatArray:
    """(2 size,) state in which the simulation starts."""
    robot = plant.robot
    elastic = robot.elastic_indices
    first = drive.reference[0:1] if start is None else start[0:1]
    if start is not None and start.n != robot.n:
        raise SimulationError(f"the start has {start.n} joints, {robot.name} has {robot.n}")
    return np.concatenate([first.q[0], first.theta[0, elastic], first.dq[0], first.dtheta[0, elastic]])


class _Run:
    """Steps through passes and keeps what is recorded."""

    def __init__(self, plant: Plant, drive: Drive, clock: _Clock, stages: int, effects: int) -> None:
        self.plant, self.drive, self.clock = plant, drive, clock
        n = plant.robot.n
        self.biases: list[list[list[float]]] = drive.bias.reshape(-1, stages, n).tolist()
        self.stages = stages
        self.states: list[FloatArray] = []
        self.accelerations: list[FloatArray] = []
        self.tau_motor: list[list[float]] = []
        self.tau_spring: list[list[float]] = []
        self.steps = 0

    def period(self, system: ClosedLoop, state: FloatArray, begin: float) -> FloatArray:
        """One pass, not recorded."""
        return self._pass(system, state, begin, False)

    def record(self, system: ClosedLoop, state: FloatArray, begin: float) -> FloatArray:
        """One pass, recorded."""
        return self._pass(system, state, begin, True)

    def _pass(self, system: ClosedLoop, state: FloatArray, begin: float, keep: bool) -> FloatArray:
        clock, h = self.clock, self.clock.step
        k = 0
        for _ in range(clock.samples):
            if keep:
                system.evaluate(begin + k * h, self.biases[k][0], state)
                self.states.append(state)
                self.accelerations.append(system.acceleration)
                self.tau_motor.append(list(system.tau_motor))
                self.tau_spring.append(list(system.tau_spring))
            for _ in range(clock.substeps):
                try:
                    state = system.step(begin + k * h, self.biases[k], state)
                except SimulationError as error:
                    raise SimulationError(f"{error} (at {begin + k * h:.4f} s)") from None
                k += 1
                system.accept(begin + k * h, state)
            self._check(state, begin + k * h)
        self.steps += k
        return state

    def _check(self, state: FloatArray, time: float) -> None:
        size = len(state) // 2
        if isfinite(float(state.sum())) and float(np.abs(state[size:]).max()) < FASTEST:
            return
        robot = self.plant.robot
        speeds = np.where(np.isfinite(state[size:]), np.abs(state[size:]), np.inf)
        k = int(np.argmax(speeds))
        i, side = (k, "link") if k < robot.n else (int(robot.elastic_indices[k - robot.n]), "motor")
        raise SimulationError(
            f"the simulation diverged at {time:.4f} s: the {side} of joint {robot.joint_names[i]!r} moves at "
            f"{speeds[k]:.3g} rad/s; take a smaller step ({self.clock.step:g} s), or softer gains of the controller"
        )

    def result(
        self,
        plant: Plant,
        acting: Plant,
        follow: Reference,
        effects: tuple[PlantedEffect, ...],
        sensors: SensorNoise,
        warm_up: WarmUp | None,
        seed: np.random.SeedSequence,
        count: int,
        settling_periods: int,
        settled: float,
        warnings: tuple[str, ...],
    ) -> Simulation:
        robot = plant.robot
        n, motors = robot.n, _motor_coordinates(robot)
        samples = self.clock.samples * count
        time: FloatArray = np.arange(samples) * (self.clock.duration / self.clock.samples)
        states, accelerations = np.array(self.states), np.array(self.accelerations)
        size = states.shape[1] // 2
        position, velocity = states[:, :size], states[:, size:]
        motion = Motion(
            time, position[:, :n], velocity[:, :n], accelerations[:, :n],
            position[:, motors], velocity[:, motors], accelerations[:, motors],
        )  # fmt: skip
        tau_motor, tau_spring = np.array(self.tau_motor), np.array(self.tau_spring)
        once = self.drive.reference
        rows = np.tile(np.arange(self.clock.samples) * self.clock.substeps * self.stages, count)
        reference = replace(once[rows], time=time)
        signals = {"q": motion.q, "theta": motion.theta, "tau_motor": tau_motor, "tau_spring": tau_spring}
        for planted in effects:
            signals = planted.effect.measured(robot, time, signals)
        temperature = None if warm_up is None else warm_up.at(time, n)
        columns = sensed_columns(plant, time, motion.dtheta, signals, sensors, seed, temperature)
        for i, joint in enumerate(robot.joints):
            kind, of = ("theta_reference", reference.theta) if joint.elastic else ("q_reference", reference.q)
            columns[f"{kind}_{joint.name}"] = of[:, i]
        over = [
            f"joint {name!r}: the motor reaches {np.max(np.abs(tau_motor[:, i])):.4g} of {robot.limits.torque[i]:.4g} N m"
            for i, name in enumerate(robot.joint_names)
            if np.max(np.abs(tau_motor[:, i])) > robot.limits.torque[i]
        ]
        return Simulation(
            recording=Recording(time, columns, f"simulation of {robot.name}"),
            motion=motion, tau_motor=tau_motor, tau_spring=tau_spring, reference=reference, plant=acting,
            effects=effects, period=follow.period, periods=count, settling_periods=settling_periods, settled=settled,
            step=self.clock.step, steps=self.steps, warnings=(*warnings, *over),
        )  # fmt: skip
