"""Several random starts: a short climb from each, a long one from the best."""

from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Event, Lock

import numpy as np
from joblib import Parallel, delayed

from sea_ident._typing import FloatArray
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.barrier import raise_inside
from sea_ident.excitation.criteria import Criterion, DOptimality
from sea_ident.excitation.feasibility import random_start, repair
from sea_ident.excitation.information import Information
from sea_ident.excitation.problem import Problem

# samples per harmonic of the short and of the long climb
_SCOUT_SAMPLES = 12
_CLIMB_SAMPLES = 50
_SCOUT_STEPS = 10
_CLIMB_STEPS = 60
_DRAWS = 5


@dataclass(frozen=True)
class Progress:
    """Where a design stands, for progress displays.

    Attributes:
        start: which start reports.
        starts: how many there are.
        step: how many steps it has made.
        value: its criterion; of different meaning in the short climbs, on few samples, and in the long ones.
        best: best criterion of all starts so far.
    """

    start: int
    starts: int
    step: int
    value: float
    best: float


@dataclass(frozen=True, eq=False)
class Found:
    """What the starts led to.

    Attributes:
        coefficients: (n, 2 L + 1) best trajectory, inside all limits.
        values: criterion that each start reached, on the samples of the result.
        interrupted: whether it was stopped from the keyboard.
    """

    coefficients: FloatArray
    values: tuple[float, ...]
    interrupted: bool


@dataclass(eq=False)
class _Board:
    """The latest trajectory of every start, shared by the threads that climb; also where they are told to stop."""

    starts: int
    progress: Callable[[Progress], None] | None
    stop: Event = field(default_factory=Event)
    lock: Lock = field(default_factory=Lock)
    latest: dict[int, FloatArray] = field(default_factory=dict)
    steps: dict[int, int] = field(default_factory=dict)
    best: float = -np.inf

    def note(self, start: int, value: float, coefficients: FloatArray) -> bool:
        with self.lock:
            self.latest[start] = coefficients
            self.steps[start] = self.steps.get(start, 0) + 1
            self.best = max(self.best, value)
            if self.progress is not None:
                self.progress(Progress(start, self.starts, self.steps[start], value, self.best))
        return self.stop.is_set()


def climb_from_starts(
    problem: Problem,
    starts: int,
    seed: int,
    given: FloatArray | None,
    jobs: int,
    progress: Callable[[Progress], None] | None,
) -> Found:
    """Climb from random starts and from a given one.

    Args:
        problem: what to raise, inside what.
        starts: number of random starts.
        seed: of the random numbers; start k draws from a stream of its own.
        given: (n, 2 L + 1) a further start.
        jobs: threads.
        progress: called after every step.

    Returns:
        The best trajectory.
    """
    board = _Board(starts, progress)
    harmonics = problem.harmonics
    count = starts + (given is not None)

    def scout(start: int) -> float:
        generator = np.random.default_rng([seed, start])
        for draw in range(_DRAWS):
            point = random_start(problem.limits, problem.base_frequency, problem.centre, generator)
            if start >= starts and given is not None:
                # limits are convex: what lies between two trajectories inside is inside too
                share = draw / (_DRAWS - 1)
                point = share * point + (1.0 - share) * repair(
                    problem.limits, problem.base_frequency, problem.centre, given
                )
            point = _loosen(problem, point)
            information = problem.coarse(_SCOUT_SAMPLES * harmonics, 0.3 * _speed(problem, point))
            if np.isfinite(problem.value(information, point)):
                break
        else:
            raise ExcitationError(_singular(problem, information, point))
        board.latest[start] = point
        # log det is the smoothest way to where all parameters are seen, whatever is asked for in the end; but its
        # optimum need not be near that of another criterion: every other start goes straight for that
        criterion = problem.criterion if start % 2 else DOptimality()
        _raise(problem, information, criterion, board, start, _SCOUT_STEPS, 1e-2, 30.0 * criterion.tolerance)
        return problem.value(information, board.latest[start])

    def climb(start: int) -> None:
        point = board.latest[start]
        samples = min(problem.fine.sampling.samples, _CLIMB_SAMPLES * harmonics)
        spacing = 1.0 / (problem.base_frequency * samples)
        information = problem.coarse(samples, 0.5 * spacing * _speed(problem, point, derivative=2))
        criterion = problem.criterion
        _raise(problem, information, criterion, board, start, _CLIMB_STEPS, 1e-3, criterion.tolerance)

    interrupted = False
    try:
        parallel = Parallel(n_jobs=min(jobs, count), backend="threading")
        scouted = parallel(delayed(scout)(start) for start in range(count))
        order = np.argsort(-np.array(scouted), kind="stable")[: max(1, -(-count // 3))]
        board.best = -np.inf
        parallel(delayed(climb)(int(start)) for start in order)
    except KeyboardInterrupt:
        board.stop.set()
        if not board.latest:
            raise
        interrupted = True
    settled = {start: problem.settle(point) for start, point in sorted(board.latest.items())}
    values = {start: problem.value(problem.fine, point) for start, point in settled.items()}
    best = max(values, key=lambda start: values[start])
    return Found(settled[best], tuple(values.values()), interrupted)


def _raise(
    problem: Problem,
    information: Information,
    criterion: Criterion,
    board: _Board,
    start: int,
    steps: int,
    barrier: float,
    tolerance: float,
) -> None:
    """Climb from the latest trajectory of a start."""
    board.latest[start] = raise_inside(
        information,
        criterion,
        problem.walls,
        problem.centre,
        board.latest[start],
        iterations=steps,
        barrier=barrier,
        tolerance=tolerance,
        report=lambda value, found: board.note(start, value, found),
    )


def _singular(problem: Problem, information: Information, point: FloatArray) -> str:
    """Say which parameters a trajectory does not show."""
    matrix = information.matrix(point)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    _, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    hidden = [problem.model.names[int(k)] for k in np.argsort(-np.abs(vectors[:, 0]))[:3]]
    return (
        f"no trajectory was found that shows all {len(matrix)} parameters; least visible: {', '.join(hidden)}. Take "
        f"more harmonics, wider limits, or fewer effects"
    )


def _loosen(problem: Problem, point: FloatArray) -> FloatArray:
    """Shrink a start until torque and other nonlinear limits hold too, with room to move.

    It is rounded: the last digits of a QP's solution may depend on where its memory happens to lie, and an ascent would
    carry them on into another optimum.
    """
    grain = 2.0 ** np.round(np.log2(np.abs(point).max()) - 20.0)
    point = np.round(point / grain) * grain
    factor = 0.95
    for _ in range(40):
        trial = problem.centre + factor * (point - problem.centre)
        if all(
            bool(np.all(wall.values(trial) < wall.upper)) and bool(np.all(wall.values(trial) > wall.lower))
            for wall in problem.walls
        ):
            return trial
        factor *= 0.8
    return problem.centre + factor * (point - problem.centre)


def _speed(problem: Problem, coefficients: FloatArray, derivative: int = 1) -> FloatArray:
    """(n,) root mean square of a derivative of a trajectory."""
    series = problem.series(coefficients)
    time = np.arange(8 * series.harmonics) / (8 * series.harmonics * series.base_frequency)
    speed: FloatArray = np.sqrt(np.mean(series.evaluate(time, derivative) ** 2, axis=0))
    return speed
