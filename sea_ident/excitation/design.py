"""`design_excitation`: from a robot and its limits to the trajectory that tells most about its parameters."""

import time
import warnings as python_warnings
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.arguments import expect, expect_optional, expect_real
from sea_ident.effects import Effect
from sea_ident.exceptions import ExcitationError, SeaIdentWarning
from sea_ident.excitation.board import Progress
from sea_ident.excitation.criteria import Criterion, DOptimality
from sea_ident.excitation.defaults import default_limits
from sea_ident.excitation.design_model import design_model, reduced_effects
from sea_ident.excitation.limit_checks import as_numbers
from sea_ident.excitation.links_inside import LinksAsPlanned, LinksInside, check_stiffness, look_at_links
from sea_ident.excitation.problem import Problem
from sea_ident.excitation.ramp import Ramp
from sea_ident.excitation.result import Excitation
from sea_ident.excitation.springs import PredictedMotors
from sea_ident.excitation.starts import climb_from_starts
from sea_ident.excitation.states import Sampling
from sea_ident.one_thread import one_thread
from sea_ident.robot import Limits, Robot

_MOST_SAMPLES = 1_000_000
"""Of a period; the observation matrix has this many rows per joint."""
_MANY_COEFFICIENTS = 1000
"""From which on a design takes minutes; 14 joints with 30 harmonics have 854."""
_GROWTH = 1.25
"""Of the time of a step with the number of coefficients (three joints, 10 to 249 harmonics)."""


@one_thread
def design_excitation(
    robot: Robot,
    *,
    base_frequency: float = 0.1,
    harmonics: int = 10,
    starts: int = 8,
    seed: int = 0,
    criterion: Criterion | None = None,
    effects: Sequence[Effect] | None = None,
    limits: Limits | None = None,
    motors: PredictedMotors | None = None,
    links: LinksInside | LinksAsPlanned | None = None,
    rate: float = 200.0,
    information: FloatArray | None = None,
    noise: FloatArray | None = None,
    start: FloatArray | None = None,
    ramp: Ramp | None = None,
    tolerance_factor: float = 1.0,
    jobs: int = 2,
    progress: Callable[[Progress], None] | None = None,
) -> Excitation:
    """Design the periodic trajectory that tells most about the parameters, inside all limits at every instant.

    Args:
        robot: the robot.
        base_frequency: of the Fourier series [Hz]; its inverse is the period.
        harmonics: L per joint; below half of `rate`. Hundreds take minutes, which is said before the work begins.
        starts: random starts; the most promising third is climbed to the end and the best result returned. 0 leaves a
            given start as it is, inside the limits: to see what a trajectory of your own tells.
        seed: of the random starts.
        criterion: what to raise; log det by default. Any other begins with the design for log det from the same starts
            and is never below it.
        effects: the model whose parameters are to be told; `reduced_effects` by default.
        limits: limits of the motion; those of the robot by default.
        motors: how motor positions follow from those of the links; theta = q by default. With `PredictedMotors` the
            effects of springs can be among the effects; the rows of links and motors are then kept apart.
        links: ask for links that stay inside the limits where their springs take them while the motors play the
            trajectory. By default so only where the harmonics come near the frequencies at which the links swing, or
            the links would leave a limit by a fifth of its range; else what they leave is in the warnings of the
            result. `LinksAsPlanned()` leaves all that out, for a controller that moves the links themselves along the
            trajectory.
        rate: samples per second of the observation matrix [Hz].
        information: (p, p) information about the base parameters of `effects` that is there already.
        noise: (n,) standard deviation of the torque noise of each joint [N m]; 1 by default. With `motors`, (2 n,) may
            be given: links first, then motors.
        start: (n, 2 L + 1) coefficients of a further start; it is moved inside the limits if it is outside.
        ramp: ask for ramps between rest and the periodic motion, inside the same limits; none by default.
        tolerance_factor: on the gains of the criterion that are too small to go on for [-]; with a larger one a design
            ends earlier, and a little lower.
        jobs: starts that are climbed at the same time, -1 for one per core; the result does not depend on it.
        progress: called after every step.

    Returns:
        The best trajectory. If interrupted from the keyboard, the best so far.

    Raises:
        InfeasibleError: limits exclude each other.
        ExcitationError: other input that cannot be used.
    """
    expect(robot, "design_excitation: robot", Robot)
    begin = time.perf_counter()
    _check_kinds(criterion, effects, limits, motors, links, ramp)
    for name, number in (("base_frequency", base_frequency), ("rate", rate), ("tolerance_factor", tolerance_factor)):
        expect_real(number, f"design_excitation: {name}")
    for name, number in (("harmonics", harmonics), ("starts", starts), ("seed", seed), ("jobs", jobs)):
        _check_whole(name, number, least=-np.inf if name == "jobs" else 0)
    if starts == 0 and start is None:
        raise ExcitationError("starts is 0; give at least 1, or a start")
    # numbers of NumPy may be of few bits, and overflow in what is computed with them
    harmonics, starts, seed, jobs = int(harmonics), int(starts), int(seed), int(jobs)
    samples = _check_sampling(base_frequency, harmonics, rate)
    if effects is not None and not effects:
        raise ExcitationError("effects is empty; name those whose parameters are to be told, or leave it out")
    if isinstance(links, LinksInside):
        check_stiffness(robot)
    if not (np.isfinite(tolerance_factor) and tolerance_factor > 0.0):
        raise ExcitationError(f"tolerance_factor is {tolerance_factor}; it must be a positive number, 1 as usual")
    if jobs == 0:
        raise ExcitationError("jobs is 0; give at least 1, or -1 for one per core")
    notes: list[str] = []
    said = _warn_of_size(robot.n, harmonics, harmonics * base_frequency, notes)
    model, bound = design_model(
        robot,
        reduced_effects(robot) if effects is None else tuple(effects),
        DOptimality() if criterion is None else criterion,
        motors,
    )
    problem = Problem.of(
        robot,
        model,
        bound,
        default_limits(robot, robot.limits if limits is None else limits, notes),
        Sampling(base_frequency, harmonics, samples),
        noise=noise,
        collected=information,
        seed=seed,
        notes=notes,
    )
    problem = replace(problem, tolerance_factor=tolerance_factor)
    given = None if start is None else _check_start(start, problem, notes)
    found = climb_from_starts(problem, starts, seed, given, jobs, progress)
    if not np.isfinite(problem.reported(found.coefficients)):
        raise ExcitationError(
            "no trajectory was found that shows all parameters and stays inside all limits between samples too; take "
            "wider limits, more starts, or fewer effects"
        )
    if found.interrupted:
        notes.append("interrupted; this is the best so far")
    there = look_at_links(problem, found.coefficients, links, notes, hurry=found.interrupted)
    for note in notes[said:]:
        python_warnings.warn(note, SeaIdentWarning, stacklevel=3)
    # told with the result alone: a controller that moves the links along the trajectory keeps their limits
    if there.beyond:
        notes.append(there.beyond)
    ramps = (None, None) if ramp is None else problem.ramps(there.coefficients, ramp)
    seconds = time.perf_counter() - begin
    result = problem.result(there.coefficients, ramps, starts, found.values, seed, seconds, tuple(notes))
    return replace(result, margins={**result.margins, **there.kept}, link_margins=there.margins)


def _check_kinds(
    criterion: object, effects: Sequence[Effect] | None, limits: object, motors: object, links: object, ramp: object
) -> None:
    for each in effects or ():
        expect(each, "design_excitation: each of effects", Effect)
    expect_optional(criterion, "design_excitation: criterion", Criterion)
    expect_optional(limits, "design_excitation: limits", Limits)
    expect_optional(motors, "design_excitation: motors", PredictedMotors)
    expect_optional(links, "design_excitation: links", LinksInside, LinksAsPlanned)
    expect_optional(ramp, "design_excitation: ramp", Ramp)


def _check_start(start: FloatArray, problem: Problem, notes: list[str]) -> FloatArray:
    coefficients = as_numbers("start", start)
    if coefficients.shape != problem.centre.shape or not np.all(np.isfinite(coefficients)):
        raise ExcitationError(
            f"start is {coefficients.shape}; it must hold {problem.centre.shape} finite coefficients, as "
            f"FourierSeries.coefficients"
        )
    outside = problem.outside(coefficients)
    if outside:
        notes.append(f"the given start is outside the limits; it was moved inside: {', '.join(outside)}")
    return coefficients


def _warn_of_size(n: int, harmonics: int, highest: float, notes: list[str]) -> int:
    """Say before the work begins that it will be long; the number of notes that were said."""
    coefficients = n * (2 * harmonics + 1)
    if coefficients < _MANY_COEFFICIENTS:
        return 0
    longer = (coefficients / (21.0 * n)) ** _GROWTH
    notes.append(
        f"{harmonics} harmonics of {n} joints are {coefficients} coefficients, up to {highest:.3g} Hz: a step takes "
        f"about {longer:.0f} times as long as with 10 harmonics. Take fewer, or interrupt to have the best so far"
    )
    python_warnings.warn(notes[-1], SeaIdentWarning, stacklevel=4)
    return len(notes)


def _check_whole(name: str, number: object, least: float) -> None:
    if not isinstance(number, (int, np.integer)) or number < least:
        raise ExcitationError(f"{name} is {number!r}; it must be a whole number of at least {least}")


def _check_sampling(base_frequency: float, harmonics: int, rate: float) -> int:
    """Samples per period."""
    if not (np.isfinite(base_frequency) and base_frequency > 0.0):
        raise ExcitationError(f"base_frequency is {base_frequency} Hz; it must be a positive number")
    if not (np.isfinite(rate) and rate > 0.0):
        raise ExcitationError(f"rate is {rate} Hz; it must be a positive number")
    if harmonics < 1:
        raise ExcitationError(f"harmonics is {harmonics}; a trajectory needs at least 1")
    highest = harmonics * base_frequency
    if highest >= rate / 2.0:
        raise ExcitationError(
            f"{harmonics} harmonics of {base_frequency:g} Hz reach {highest:g} Hz, which is not below half the "
            f"sampling rate ({rate / 2.0:g} Hz); take fewer harmonics or a higher rate"
        )
    if rate / base_frequency > _MOST_SAMPLES:
        raise ExcitationError(
            f"a period of {1.0 / base_frequency:g} s has {rate / base_frequency:.3g} samples at {rate:g} Hz, more than "
            f"{_MOST_SAMPLES}; take a higher base frequency or a lower rate"
        )
    return round(rate / base_frequency)
