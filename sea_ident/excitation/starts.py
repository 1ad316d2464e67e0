"""Several random starts: a short climb from each, a longer one from the best, then moves around the best of these.

A move draws the trajectories of some joints half way to random ones and climbs again. Good optima lie near good ones:
moves raise log det further than as many fresh starts.

Log det is concave in the information and smooth, other criteria have more optima of their own: for them all this is
done twice, and what was found by log det is one more start that is climbed to the end.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed
from joblib.parallel import get_active_backend

from sea_ident._typing import FloatArray
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.barrier import raise_inside
from sea_ident.excitation.board import Board, Progress
from sea_ident.excitation.criteria import Criterion, DOptimality
from sea_ident.excitation.feasibility import random_start, repair
from sea_ident.excitation.information import Information
from sea_ident.excitation.problem import Problem

# samples per harmonic of the short and of the long climb
_SCOUT_SAMPLES = 12
_CLIMB_SAMPLES = 50
_SCOUT_STEPS = 8
_CLIMB_STEPS = 30
_POLISH_STEPS = 60
_DRAWS = 5
# gains, in units of the criterion's tolerance, that end a climb which another one follows
_COARSE = 30.0
# moves at the same time; the best of them is where the next ones begin
_TOGETHER = 4
# [s] for which a thread may compute before another one does
_TURN = 5e-4
# of joints that a move draws to random trajectories, and how far
_MOVED = 1.0 / 3.0
_SHARE = 0.5
# a move is given up if so many times its last gain would not bring it to the best
_PATIENCE = 4.0


@dataclass(frozen=True, eq=False)
class Found:
    """What the starts led to.

    Attributes:
        coefficients: (n, 2 L + 1) best trajectory, inside all limits.
        values: criterion that each start reached on its own, on the samples of the result.
        interrupted: whether it was stopped from the keyboard.
    """

    coefficients: FloatArray
    values: tuple[float, ...]
    interrupted: bool


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
        starts: number of random starts; 0 keeps a given one as it is, moved inside.
        seed: of the random numbers; start k draws from a stream of its own.
        given: (n, 2 L + 1) a further start.
        jobs: at the same time; threads, unless `joblib.parallel_config` names another backend.
        progress: called after every step.

    Returns:
        The best trajectory; by its own criterion it is never below the D-optimal one from the same starts.
    """
    if given is not None and not starts:
        return Found(_moved_inside(problem, given) if problem.outside(given) else given, (), interrupted=False)
    search = _Search(problem, starts, seed, given, jobs, progress)
    if isinstance(problem.criterion, DOptimality):
        return search.run()
    # log det is the smoothest way to where all parameters are seen, whatever is asked for in the end
    widest = replace(search, problem=replace(problem, criterion=DOptimality())).run()
    if widest.interrupted:
        return Found(widest.coefficients, (problem.reported(widest.coefficients),), interrupted=True)
    return replace(search, first=widest.coefficients).run()


@dataclass(frozen=True, eq=False)
class _Search:
    """Starts that are climbed by one criterion.

    Attributes:
        problem: what to raise, inside what.
        starts: number of random starts.
        seed: of the random numbers.
        given: (n, 2 L + 1) a further start.
        jobs: at the same time.
        progress: called after every step.
        first: (n, 2 L + 1) a trajectory inside all limits that the result must not be below.
    """

    problem: Problem
    starts: int
    seed: int
    given: FloatArray | None
    jobs: int
    progress: Callable[[Progress], None] | None
    first: FloatArray | None = None

    @property
    def count(self) -> int:
        """Of starts, with a given one."""
        return self.starts + (self.given is not None)

    def run(self) -> Found:
        """The best trajectory, or the best so far when interrupted."""
        board = Board(self.starts, self.problem.criterion.name, self.progress)
        if self.first is not None:
            board.latest[self.count] = self.first
        interrupted = False
        try:
            with _short_turns():
                self._climb_all(board)
        except KeyboardInterrupt:
            board.stop.set()
            if not board.latest:
                raise
            interrupted = True
        reached = {start: self.problem.reported(point) for start, point in sorted(board.latest.items())}
        values = {start: value for start, value in (board.values or reached).items() if start < self.count}
        return Found(self._best_inside(board.latest, reached), tuple(values.values()), interrupted)

    def _climb_all(self, board: Board) -> None:
        problem, count = self.problem, self.count
        parallel = Parallel(n_jobs=min(self.jobs, max(count, _TOGETHER)), prefer="threads")
        # whoever chose another backend, such as a cluster, has it: its workers share no memory with this process
        shared = bool(getattr(get_active_backend(prefer="threads")[0], "supports_sharedmem", False))
        if shared:
            scouted = parallel(delayed(_scout)(problem, board, self.seed, self.given, start) for start in range(count))
        else:
            far = parallel(
                delayed(_scout_apart)(problem, self.starts, self.seed, self.given, start) for start in range(count)
            )
            scouted = [value for value, _ in far]
            for start, (value, point) in enumerate(far):
                board.note(start, value, point)
        order = [int(k) for k in np.argsort(-np.array(scouted), kind="stable")[: max(1, -(-count // 3))]]
        if self.first is not None:
            order.append(count)
        board.best = -np.inf
        if shared:
            parallel(delayed(_climb)(problem, board, start) for start in order)
        else:
            points = parallel(
                delayed(_climb_apart)(problem, self.starts, start, board.latest[start]) for start in order
            )
            board.latest.update(zip(order, points, strict=True))
        board.values = {start: problem.reported(point) for start, point in sorted(board.latest.items())}
        # the two best go on side by side, as the best may be stuck; few moves all go to the best
        ahead = sorted(order, key=lambda start: -board.values[start])[: 2 if count > _TOGETHER else 1]
        judges = {start: detailed(problem, board.latest[start]) for start in ahead}
        moves = count + (_TOGETHER if count > _TOGETHER else 0)
        for first in range(0, moves, _TOGETHER):
            bases = [ahead[move % len(ahead)] for move in range(first, min(first + _TOGETHER, moves))]
            moved = parallel(
                delayed(_move)(
                    problem, judges[base], board.latest[base], [self.seed, first + k, 1], board if shared else None
                )
                for k, base in enumerate(bases)
            )
            for start in ahead:
                own = [pair for base, pair in zip(bases, moved, strict=True) if base == start]
                value, point = max(own, key=lambda pair: pair[0], default=(-np.inf, board.latest[start]))
                if value > problem.value(judges[start], board.latest[start]):
                    board.note(start, value, point)
        best = max(ahead, key=lambda start: problem.reported(board.latest[start]))
        _polish(problem, judges[best], board, best)

    def _best_inside(self, latest: Mapping[int, FloatArray], reached: Mapping[int, float]) -> FloatArray:
        """The best trajectory of those that were reached, once it is inside at all times.

        What it takes to be inside between the grid points too may cost one much and another nothing.
        """
        problem = self.problem
        order = sorted(reached, key=lambda start: -reached[start])
        chosen = problem.settle(latest[order[0]])
        for start in order[1:]:
            if reached[start] <= problem.reported(chosen):
                break
            settled = problem.settle(latest[start])
            if problem.reported(settled) > problem.reported(chosen):
                chosen = settled
        if self.first is not None and problem.reported(self.first) > problem.reported(chosen):
            return self.first
        return chosen


@contextmanager
def _short_turns() -> Iterator[None]:
    """Threads hand over to each other often: a step is made of products much shorter than a usual turn."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(min(usual, _TURN))
    try:
        yield
    finally:
        sys.setswitchinterval(usual)


def _scout(problem: Problem, board: Board, seed: int, given: FloatArray | None, start: int) -> float:
    """Draw a start and climb a little."""
    generator = np.random.default_rng([seed, start])
    for draw in range(_DRAWS):
        point = random_start(problem.limits, problem.base_frequency, problem.centre, generator)
        if start >= board.starts and given is not None:
            # limits are convex: what lies between two trajectories inside is inside too
            share = draw / (_DRAWS - 1)
            point = share * point + (1.0 - share) * _nearest(problem, given)
        point = _loosen(problem, point)
        information = problem.coarse(_SCOUT_SAMPLES * problem.harmonics, 0.3 * _speed(problem, point))
        if np.isfinite(problem.value(information, point)):
            break
    else:
        raise ExcitationError(_singular(problem, information, point))
    board.latest[start] = point
    # the way of log det and that of the criterion itself may lead to different optima
    criterion = problem.criterion if start % 2 else DOptimality()
    _raise(problem, information, criterion, board, start, _SCOUT_STEPS, 1e-2, _COARSE * problem.tolerance(criterion))
    return problem.value(information, board.latest[start])


def _climb(problem: Problem, board: Board, start: int) -> None:
    """Climb until little is left to gain."""
    information = detailed(problem, board.latest[start])
    criterion = problem.criterion
    _raise(problem, information, criterion, board, start, _CLIMB_STEPS, 1e-3, _COARSE * problem.tolerance(criterion))


def _polish(problem: Problem, information: Information, board: Board, start: int) -> None:
    """Climb to the end."""
    criterion = problem.criterion.refined()
    _raise(problem, information, criterion, board, start, _POLISH_STEPS, 1e-5, problem.tolerance(criterion))


def detailed(problem: Problem, point: FloatArray) -> Information:
    """Information on so many samples that little is missed."""
    samples = min(problem.fine.sampling.samples, _CLIMB_SAMPLES * problem.harmonics)
    spacing = 1.0 / (problem.base_frequency * samples)
    return problem.coarse(samples, 0.5 * spacing * _speed(problem, point, derivative=2))


def _move(
    problem: Problem, information: Information, base: FloatArray, seed: list[int], board: Board | None
) -> tuple[float, FloatArray]:
    """Draw some joints half way to a random trajectory and climb from there.

    Args:
        problem: what to raise, inside what.
        information: by which it is judged.
        base: (n, 2 L + 1) trajectory, inside.
        seed: of the random numbers.
        board: tells to stop; None in another process, which does not see it.

    Returns:
        Criterion and coefficients.
    """
    generator = np.random.default_rng(seed)
    n = len(base)
    other = random_start(problem.limits, problem.base_frequency, problem.centre, generator)
    joints = generator.permutation(n)[: max(1, round(_MOVED * n))]
    point = base.copy()
    point[joints] += _SHARE * (other[joints] - point[joints])
    goal, last = problem.value(information, base), -np.inf

    def hopeless(value: float, _: FloatArray) -> bool:
        nonlocal last
        gain, last = value - last, value
        return (board is not None and board.stop.is_set()) or value + _PATIENCE * gain < goal

    point = raise_inside(
        information,
        problem.criterion,
        problem.walls,
        problem.centre,
        _loosen(problem, point),
        iterations=_CLIMB_STEPS,
        barrier=1e-2,
        tolerance=_COARSE * problem.tolerance(problem.criterion),
        report=hopeless,
    )
    return problem.value(information, point), point


def _scout_apart(
    problem: Problem, starts: int, seed: int, given: FloatArray | None, start: int
) -> tuple[float, FloatArray]:
    """The same in another process, which does not see the board of this one."""
    board = Board(starts, problem.criterion.name, None)
    return _scout(problem, board, seed, given, start), board.latest[start]


def _climb_apart(problem: Problem, starts: int, start: int, point: FloatArray) -> FloatArray:
    """The same in another process."""
    board = Board(starts, problem.criterion.name, None, latest={start: point})
    _climb(problem, board, start)
    return board.latest[start]


def _raise(
    problem: Problem,
    information: Information,
    criterion: Criterion,
    board: Board,
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


def _nearest(problem: Problem, given: FloatArray) -> FloatArray:
    """The trajectory inside all linear limits that is nearest to a given one."""
    return repair(problem.limits, problem.base_frequency, problem.centre, given)


def _moved_inside(problem: Problem, given: FloatArray) -> FloatArray:
    """The same, shrunk until the other limits hold for all t too."""
    return problem.settle(_loosen(problem, _nearest(problem, given)))


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
