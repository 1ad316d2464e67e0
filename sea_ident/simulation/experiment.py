"""`simulate`: closed-loop forward dynamics of the elastic robot."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.arguments import expect, expect_optional, expect_real, expect_whole
from sea_ident.effects import measured_signals
from sea_ident.exceptions import SimulationError
from sea_ident.motion import FourierSeries, Motion
from sea_ident.one_thread import one_thread
from sea_ident.recordings import Recording
from sea_ident.robot import Robot
from sea_ident.simulation.controller import Controller, Drive, VelocityController
from sea_ident.simulation.dynamics import ClosedLoop
from sea_ident.simulation.elastic_inverse import link_position_at_rest
from sea_ident.simulation.excess import broken_limits
from sea_ident.simulation.friction import FrictionJitter, FrictionLaw, SmoothCoulomb
from sea_ident.simulation.passes import Clock, Passes
from sea_ident.simulation.plant import Plant, PlantedEffect, plant_from_robot
from sea_ident.simulation.planted import PlantedTorques, altered_robot, check_planted, demands
from sea_ident.simulation.reference import HasSeries, Reference, as_reference
from sea_ident.simulation.result import Simulation
from sea_ident.simulation.rosenbrock import ros34pw2
from sea_ident.simulation.sensors import SensorNoise, WarmUp, sensed_columns
from sea_ident.simulation.usual_step import LONGEST_BETWEEN, usual_step


@dataclass(frozen=True)
class Settling:
    """When the motion counts as periodic.

    Attributes:
        tolerance: largest change of a position from one period to the next [rad] or [m].
        longest: periods after which the recording starts in any case, with a warning.
    """

    tolerance: float = 1e-8
    longest: int = 10


MOST_STEPS = 20_000_000
"""Of the integrator in one pass of the reference, or samples; a pass is held in memory."""


@one_thread
def simulate(
    robot: Robot,
    reference: FourierSeries | HasSeries | Motion,
    *,
    periods: int = 20,
    seed: int = 0,
    sensors: SensorNoise | None = None,
    jitter: FrictionJitter | None = None,
    controller: Controller | None = None,
    friction: FrictionLaw | Sequence[FrictionLaw] | None = None,
    plant: Plant | None = None,
    effects: Sequence[PlantedEffect] = (),
    warm_up: WarmUp | None = None,
    rate: float = 200.0,
    step: float | None = None,
    settling: Settling | None = None,
    start: Motion | None = None,
    lead: float = 0.0,
    progress: Callable[[int], None] | None = None,
) -> Simulation:
    """Simulate an experiment: the motors follow a reference, the sensors are recorded.

    The controller commands torque at the joint side; the currents are those that the drives then need, by the
    efficiency of the transmission in the direction of the power (paper, eq. 7). It sees the true motion, not the noise
    of the encoders.

    The default step resolves how the friction turns over where a joint reverses: halving it changes the positions of
    legs and of arms by less than 5e-5 rad, mostly 1e-5; the error falls with the third power of the step. Between
    reversals, and while the integrator finds no larger error, steps are 5 ms long. Where nothing damps a soft spring,
    the errors of its free swings add up, and may be a hundred times that; a step that errs by 0.1 rad/s is told.

    Args:
        robot: the robot as the controller knows it, and the plant unless one is given.
        reference: a Fourier series (or an Excitation), followed again and again; or a Motion, followed once.
        periods: number of recorded periods of a Fourier series.
        seed: of noise and jitter; equal seeds give equal results.
        sensors: noise and resolution; `SensorNoise.usual(robot)` by default, `SensorNoise.none()` for exact signals.
        jitter: friction that varies from pass to pass, at all joints alike; `FrictionJitter.usual(robot)` by default.
        controller: `VelocityController()` by default, which applies the reference to the motors.
        friction: Coulomb friction around zero speed, one law or one per joint; `SmoothCoulomb.usual(robot)` by default.
        plant: the true numbers; those of the robot's description by default.
        effects: what else acts.
        warm_up: temperature of the motors; not simulated by default.
        rate: samples per second [Hz]; a whole number per period is taken.
        step: longest step of the integrator [s]; a whole number per sample is taken. By default 5 ms between reversals
            and 2.5 ms around them, down to 0.5 ms where much friction turns over quickly at a joint of little inertia,
            or where links turn fast.
        settling: when the motion counts as periodic.
        start: its first sample is the initial state, and nothing is settled; by default a Fourier series is settled,
            and a Motion starts with its own velocity and the links in static equilibrium.
        lead: time from `start` to the recording, one period of a Fourier series at most [s].
        progress: called with the number of periods recorded so far, from 0 when the recording begins.

    Returns:
        The recording and the exact signals behind it.

    Raises:
        SimulationError: a number is missing, the reference does not fit, or the motion diverges.
    """
    expect(robot, "simulate: robot", Robot)
    for each in effects:
        expect(each, "simulate: each of effects", PlantedEffect)
    for argument, given, wanted in (
        ("sensors", sensors, SensorNoise),
        ("jitter", jitter, FrictionJitter),
        ("controller", controller, Controller),
        ("plant", plant, Plant),
        ("warm_up", warm_up, WarmUp),
        ("settling", settling, Settling),
        ("start", start, Motion),
    ):
        expect_optional(given, f"simulate: {argument}", wanted)
    _check_numbers(periods, seed, rate, step, lead)
    check_planted(robot, effects)
    plant = plant_from_robot(robot) if plant is None else plant
    if plant.robot.joint_names != robot.joint_names or plant.robot.elastic != robot.elastic:
        raise SimulationError(f"the plant is another robot, with the joints {', '.join(plant.robot.joint_names)}")
    plant = plant.replace(robot=altered_robot(plant.robot, effects))
    follow = as_reference(robot, reference)
    laws = _per_joint(robot, friction or SmoothCoulomb.usual(robot))
    longest = LONGEST_BETWEEN if step is None else step
    step = usual_step(plant, laws, follow) if step is None else step
    _check_size(follow, rate, step)
    clocks, method = Clock.from_short_to_long(follow, rate, step, longest), ros34pw2()
    clock, times = clocks[0], np.concatenate([each.stage_times(method.nodes) for each in clocks])
    drive = (controller or VelocityController()).drive(robot, follow, times)
    state = _initial_state(plant, drive, start)
    lead_samples = _lead_samples(lead, start, follow, clock)
    streams = np.random.SeedSequence(seed).spawn(2)

    # -- the closed loop
    motors = [
        law.start(float(viscous), float(coulomb), float(theta))
        for law, viscous, coulomb, theta in zip(
            laws, plant.viscous_friction, plant.coulomb_friction, _motor_positions(robot, state), strict=True
        )
    ]
    links = [
        law.start(float(viscous), float(coulomb), float(q)) if elastic and (viscous or coulomb) else None
        for law, viscous, coulomb, q, elastic in zip(
            laws, plant.link_viscous_friction, plant.link_coulomb_friction, state[: robot.n], robot.elastic, strict=True
        )
    ]
    planted = PlantedTorques(plant.robot, effects, follow.begin) if effects else None
    if planted is not None and planted.idle:
        planted = None
    system = ClosedLoop(plant, drive, motors, links, planted, method, demands(plant.robot, effects))
    system.check_mass(state)
    system.accept(follow.begin - (lead_samples * clock.interval or clock.duration), state)
    passes = Passes(system, drive, clocks, method.nodes, follow.begin)

    # -- settle, then record
    warnings = list(plant.notes)
    settled, settling_periods = float("nan"), 0
    if follow.period is not None and start is None:
        rule, settled = settling or Settling(), float("inf")
        while settled > rule.tolerance and settling_periods < rule.longest:
            before, state = state, passes.settle(state)
            settling_periods += 1
            settled = float(np.max(np.abs(state - before)[: system.size]))
        if settled > rule.tolerance:
            warnings.append(
                f"after {settling_periods} settling periods the motion still changes by {settled:.2g} (rad or m) from "
                "one period to the next"
            )
    if lead_samples:
        state = passes.settle(state, lead_samples)
    varied = FrictionJitter.usual(robot) if jitter is None else (jitter,) * robot.n
    seeds = streams[0].spawn(robot.n)
    system.replace_motor_friction([v.on(f, child) for v, f, child in zip(varied, motors, seeds, strict=True)])
    count = periods if follow.period is not None else 1
    tell = progress or (lambda done: None)
    tell(0)
    for number in range(count):
        state = passes.record(state, number)
        tell(number + 1)
    if follow.period is None:
        passes.record_end(state)

    warnings += passes.notes()

    # -- what the sensors saw
    motion, tau_motor, tau_spring = passes.motion(), passes.tau_motor, passes.tau_spring
    signals = {"q": motion.q, "theta": motion.theta, "tau_motor": tau_motor, "tau_spring": tau_spring}
    if warm_up is not None:
        signals["temperature"] = warm_up.at(motion.time, robot.n)
    signals = measured_signals(plant.robot, [each.effect for each in effects], motion.time, signals)
    sensors = sensors or SensorNoise.usual(robot)
    columns = sensed_columns(plant, motion.time, motion.dtheta, signals, sensors, streams[1])
    reference_motion = _sampled(drive.reference, motion.time, clock, len(method.nodes))
    for i, joint in enumerate(robot.joints):
        kind, values = ("theta", reference_motion.theta) if joint.elastic else ("q", reference_motion.q)
        columns[f"{kind}_reference_{joint.name}"] = values[:, i]
    return Simulation(
        recording=Recording(motion.time, columns, f"simulation of {robot.name}"),
        motion=motion,
        tau_motor=tau_motor,
        tau_spring=tau_spring,
        reference=reference_motion,
        plant=plant,
        effects=tuple(effects),
        period=follow.period,
        periods=count,
        settling_periods=settling_periods,
        settled=settled,
        step=clock.step,
        steps=passes.steps,
        warnings=(*warnings, *broken_limits(robot, motion, tau_motor, settled=follow.period is not None)),
    )


def _check_numbers(periods: int, seed: object, rate: float, step: float | None, lead: float) -> None:
    expect_whole(periods, "simulate: periods")
    expect_whole(seed, "simulate: seed", least=0)
    for name, number in (("rate", rate), ("step", rate if step is None else step), ("lead", lead)):
        expect_real(number, f"simulate: {name}")
    if periods < 1 or not 0.0 < rate < np.inf or not (step is None or 0.0 < step < np.inf):
        given = "" if step is None else f" and step {step} s"
        raise SimulationError(f"periods {periods}, rate {rate} Hz{given} must all be positive and finite")


def _check_size(follow: Reference, rate: float, step: float) -> None:
    """Refuse what no memory holds, before it is asked for."""
    steps = follow.duration * max(rate, 1.0 / step)
    if steps > MOST_STEPS:
        raise SimulationError(
            f"{follow.duration:g} s at a rate of {rate:g} Hz and steps of {step:g} s are {steps:.3g} steps, more than "
            f"{MOST_STEPS}; take a lower rate or a longer step"
        )


def _per_joint(robot: Robot, friction: FrictionLaw | Sequence[FrictionLaw]) -> list[FrictionLaw]:
    """(n,) friction laws."""
    if isinstance(friction, FrictionLaw):
        return [friction] * robot.n
    for each in [friction] if not isinstance(friction, Sequence) else friction:
        expect(each, "simulate: each of friction", FrictionLaw)
    if len(friction) != robot.n:
        raise SimulationError(f"{len(friction)} friction laws for {robot.n} joints; give one, or one per joint")
    return list(friction)


def _motor_positions(robot: Robot, state: FloatArray) -> FloatArray:
    """(n,) motor positions after the gear in a state (2 size,)."""
    theta = state[: robot.n].copy()
    elastic = robot.elastic_indices
    theta[elastic] = state[robot.n : robot.n + len(elastic)]
    return theta


def _initial_state(plant: Plant, drive: Drive, start: Motion | None) -> FloatArray:
    """(2 size,) state in which the simulation starts."""
    robot = plant.robot
    if start is not None and (start.n != robot.n or len(start) == 0):
        raise SimulationError(f"the start has {len(start)} samples of {start.n} joints; {robot.name} has {robot.n}")
    first = drive.reference[0:1] if start is None else start[0:1]
    q, theta, elastic = first.q[0], first.theta[0], robot.elastic_indices
    if start is None and len(elastic) and np.array_equal(q, theta):
        q = link_position_at_rest(plant, theta)
    return np.concatenate([q, theta[elastic], first.dq[0], first.dtheta[0, elastic]])


def _lead_samples(lead: float, start: Motion | None, follow: Reference, clock: Clock) -> int:
    """Sampling intervals of the time before the recording."""
    if lead == 0.0:
        return 0
    if start is None or follow.period is None:
        raise SimulationError(
            f"a lead of {lead} s begins in a known state: give `start`, and a Fourier series to follow"
        )
    samples = round(lead / clock.interval) if 0.0 < lead < np.inf else 0
    if not 0 < samples <= clock.samples:
        raise SimulationError(
            f"lead is {lead} s; give more than {0.5 * clock.interval:g} s, and {clock.duration:g} s at most"
        )
    return samples


def _sampled(reference: Motion, time: FloatArray, clock: Clock, stages: int) -> Motion:
    """The reference at the recorded instants, from the reference at all stages of a pass."""
    per_sample = clock.substeps * stages
    rows = np.arange(len(time)) % clock.samples if len(time) > clock.samples + 1 else np.arange(len(time))
    names = ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")
    return replace(reference, time=time, **{name: getattr(reference, name)[rows * per_sample] for name in names})
