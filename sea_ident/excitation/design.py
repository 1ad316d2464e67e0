"""`design_excitation`: from a robot and its limits to the trajectory that tells most about its parameters."""

import time
import warnings as python_warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import BaseParameters, find_base_parameters
from sea_ident.effects import Effect
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.effects.viscous_friction import ViscousFriction
from sea_ident.exceptions import ExcitationError, SeaIdentWarning
from sea_ident.excitation.ascent import Ascent, Problem, climb
from sea_ident.excitation.columns import ModelColumns
from sea_ident.excitation.criteria import Criterion, DOptimality
from sea_ident.excitation.feasibility import inner_point, random_start
from sea_ident.excitation.information import Information
from sea_ident.excitation.linear_limits import linear_limits
from sea_ident.excitation.result import Excitation
from sea_ident.motion import FourierSeries
from sea_ident.robot import Limits, Robot


@dataclass(frozen=True)
class Progress:
    """Where a design stands, for progress displays.

    Attributes:
        start: which start reports.
        starts: how many there are.
        step: how many steps it has made.
        value: its criterion.
        best: best criterion of all starts so far.
    """

    start: int
    starts: int
    step: int
    value: float
    best: float


def reduced_effects(robot: Robot) -> tuple[Effect, ...]:
    """The model that an excitation can be designed for before anything is known (paper, eq. 14).

    Bodies, and viscous and Coulomb friction lumped at the joints; no springs and no motor inertia.
    """
    return (*RigidBodies.instances(robot), *ViscousFriction.instances(robot), *CoulombFriction.instances(robot))


class _Board:
    """The best trajectory so far, shared by the starts; also the place where they are told to stop."""

    def __init__(self, starts: int, progress: Callable[[Progress], None] | None) -> None:
        self.starts = starts
        self.progress = progress
        self.stop = False
        self.best = -np.inf
        self.found: dict[int, tuple[float, FloatArray]] = {}
        self.steps: dict[int, int] = {}

    def note(self, start: int, value: float, coefficients: FloatArray) -> bool:
        self.found[start] = (value, coefficients)
        self.steps[start] = self.steps.get(start, -1) + 1
        self.best = max(self.best, value)
        if self.progress is not None:
            self.progress(Progress(start, self.starts, self.steps[start], value, self.best))
        return self.stop


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
    rate: float = 200.0,
    information: FloatArray | None = None,
    noise: FloatArray | None = None,
    jobs: int = 1,
    progress: Callable[[Progress], None] | None = None,
) -> Excitation:
    """Design the periodic trajectory that tells most about the parameters, inside all limits at every instant.

    Args:
        robot: the robot.
        base_frequency: of the Fourier series [Hz]; its inverse is the period.
        harmonics: L per joint.
        starts: random starts; the best result is returned.
        seed: of the random starts.
        criterion: what to raise; log det by default.
        effects: the model whose parameters are to be told; `reduced_effects` by default.
        limits: limits of the motion; those of the robot by default.
        rate: samples per second at which log det is reported [Hz].
        information: (p, p) information about the base parameters of `effects` that is there already.
        noise: (n,) standard deviation of the torque noise of each joint [N m]; 1 by default.
        jobs: starts that are climbed at the same time; the result does not depend on it.
        progress: called after every step.

    Returns:
        The best trajectory.

    Raises:
        InfeasibleError: limits exclude each other.
        ExcitationError: other input that cannot be used.
    """
    begin = time.perf_counter()
    chosen = DOptimality() if criterion is None else criterion
    samples = _check_sampling(base_frequency, harmonics, starts, rate)
    notes: list[str] = []
    bounded = _default_limits(robot, robot.limits if limits is None else limits, notes)
    model = reduced_effects(robot) if effects is None else tuple(effects)
    base = find_base_parameters(robot, model)
    fine = _information(robot, model, base, base_frequency, harmonics, samples, samples, noise, information)
    coarse_samples = min(samples, max(20 * harmonics, 8 * base.rank // robot.n, 60))
    coarse = _information(robot, model, base, base_frequency, harmonics, coarse_samples, samples, noise, information)
    problem = Problem(coarse, chosen, linear_limits(robot, bounded))
    centre = inner_point(problem.limits)
    board = _Board(starts, progress)

    def one(start: int) -> Ascent:
        generator = np.random.default_rng([seed, start])
        point = random_start(problem, centre, generator)
        board.note(start, problem.value(point), point)
        return climb(problem, point, report=lambda value, found: board.note(start, value, found))

    try:
        Parallel(n_jobs=jobs, backend="threading")(delayed(one)(start) for start in range(starts))
    except KeyboardInterrupt:
        board.stop = True
        if not board.found:
            raise
        notes.append("interrupted; this is the best so far")
    for note in notes:
        python_warnings.warn(note, SeaIdentWarning, stacklevel=2)
    ranked = sorted(board.found)
    best = max(ranked, key=lambda start: board.found[start][0])
    series = problem.series(board.found[best][1])
    return _result(
        robot, problem, fine, base, series, starts, tuple(board.found[k][0] for k in ranked), seed, begin, tuple(notes)
    )


def _check_sampling(base_frequency: float, harmonics: int, starts: int, rate: float) -> int:
    """Samples per period."""
    if not (np.isfinite(base_frequency) and base_frequency > 0.0):
        raise ExcitationError(f"base_frequency is {base_frequency} Hz; it must be a positive number")
    if not (np.isfinite(rate) and rate > 0.0):
        raise ExcitationError(f"rate is {rate} Hz; it must be a positive number")
    if harmonics < 1:
        raise ExcitationError(f"harmonics is {harmonics}; a trajectory needs at least 1")
    if starts < 1:
        raise ExcitationError(f"starts is {starts}; give at least 1")
    highest = harmonics * base_frequency
    if highest >= rate / 2.0:
        raise ExcitationError(
            f"{harmonics} harmonics of {base_frequency:g} Hz reach {highest:g} Hz, which is not below half the "
            f"sampling rate ({rate / 2.0:g} Hz); take fewer harmonics or a higher rate"
        )
    return round(rate / base_frequency)


def _default_limits(robot: Robot, limits: Limits, notes: list[str]) -> Limits:
    """Limits with stated defaults where a joint has none that bound its motion."""
    lower, upper, velocity = limits.lower.copy(), limits.upper.copy(), limits.velocity.copy()
    for i, joint in enumerate(robot.joints):
        reach, unit = (1.0, "m") if joint.prismatic else (np.pi, "rad")
        if np.isneginf(lower[i]) and np.isposinf(upper[i]):
            lower[i], upper[i] = -reach, reach
            notes.append(f"joint {joint.name!r} has no position limits; it is kept within +-{reach:.4g} {unit}")
        elif np.isneginf(lower[i]):
            lower[i] = upper[i] - 2.0 * reach
            notes.append(f"joint {joint.name!r} has no lower limit; it is kept above {lower[i]:.4g} {unit}")
        elif np.isposinf(upper[i]):
            upper[i] = lower[i] + 2.0 * reach
            notes.append(f"joint {joint.name!r} has no upper limit; it is kept below {upper[i]:.4g} {unit}")
        if np.isposinf(velocity[i]):
            velocity[i] = reach
            notes.append(f"joint {joint.name!r} has no velocity limit; it is kept within +-{reach:.4g} {unit}/s")
    return limits.replace(lower=lower, upper=upper, velocity=velocity)


def _information(
    robot: Robot,
    effects: tuple[Effect, ...],
    base: BaseParameters,
    base_frequency: float,
    harmonics: int,
    samples: int,
    counted: int,
    noise: FloatArray | None,
    collected: FloatArray | None,
) -> Information:
    p = base.rank
    prior = np.zeros((p, p)) if collected is None else np.asarray(collected, dtype=np.float64)
    if prior.shape != (p, p) or not np.all(np.isfinite(prior)):
        raise ExcitationError(
            f"information is {prior.shape}; it must be a finite ({p}, {p}) matrix about {', '.join(base.names)}"
        )
    deviation = np.ones(robot.n) if noise is None else np.asarray(noise, dtype=np.float64)
    if deviation.shape != (robot.n,) or not np.all(deviation > 0.0):
        raise ExcitationError(f"noise must be {robot.n} positive standard deviations, not {deviation}")
    columns = ModelColumns(robot, effects, base.independent)
    return Information(columns, base_frequency, harmonics, samples, counted / samples, 1.0 / deviation, prior)


def _result(
    robot: Robot,
    problem: Problem,
    fine: Information,
    base: BaseParameters,
    series: FourierSeries,
    starts: int,
    values: tuple[float, ...],
    seed: int,
    begin: float,
    notes: tuple[str, ...],
) -> Excitation:
    matrix = fine.matrix(series.coefficients)
    eigenvalues = np.linalg.eigvalsh(matrix)
    scale = 1.0 / np.sqrt(np.diag(matrix))
    normalised = np.linalg.eigvalsh(matrix * np.outer(scale, scale))
    limits = problem.limits
    margins = limits.margins(series)
    return Excitation(
        series=series,
        joint_names=robot.joint_names,
        robot=robot.source,
        criterion=problem.criterion.name,
        value=problem.criterion.reported(eigenvalues),
        log_det=float(np.log(eigenvalues).sum()),
        condition_number=float(np.sqrt(normalised[-1] / normalised[0])),
        raw_condition_number=float(np.sqrt(eigenvalues[-1] / eigenvalues[0])),
        parameters=base.names,
        samples=fine.samples,
        margins={name: float(value) for name, value in zip(limits.names, margins, strict=True)},
        limits={name: (float(limits.lower[k]), float(limits.upper[k])) for k, name in enumerate(limits.names)},
        starts=starts,
        start_values=values,
        seed=seed,
        seconds=time.perf_counter() - begin,
        warnings=notes,
    )
