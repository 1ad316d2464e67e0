"""A position at rest inside all limits, those that depend on it nonlinearly included."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import InfeasibleError
from sea_ident.excitation.feasibility import RestLimits, at_rest, inner_position
from sea_ident.excitation.linear_limits import LinearLimits
from sea_ident.excitation.walls import Wall

_LEAST_ROOM = 1e-3
_ENOUGH_ROOM = 0.05
_COMFORT = 0.3
_DRAWS = 400
_IMPROVED = 8  # of the positions drawn, the best
_STEPS = 25
_MOST_NAMED = 6
_REFUTATIONS = 20


def comfortable_position(
    limits: LinearLimits,
    walls: Sequence[Wall],
    harmonics: int,
    describe: Callable[[int, float], str],
    generator: np.random.Generator,
) -> FloatArray:
    """A position at rest inside the linear limits and inside walls that depend on it nonlinearly.

    Args:
        limits: linear limits.
        walls: torque and other limits.
        harmonics: L of the trajectories that the walls take.
        describe: says how a limit stands: from its row in all walls and the part of its range that is left.
        generator: of random positions, tried if the middle of the limits is outside.

    Returns:
        (n,) position.

    Raises:
        InfeasibleError: no position was found that can be held.
    """
    middle = inner_position(limits)
    rest = RestLimits.of(limits)
    rooms = _Rooms(walls, harmonics)
    reach = limits.joint_width()
    tried: list[tuple[float, FloatArray, FloatArray]] = []
    for trial in range(_DRAWS):
        position = middle
        if trial:
            wish = 0.5 * reach * generator.uniform(-1.0, 1.0, len(middle))
            ahead, free = rest.rows @ wish, rest.bounds - rest.rows @ middle
            with np.errstate(divide="ignore", invalid="ignore"):
                factor = np.where(ahead > 0.0, free / ahead, np.inf).min(initial=1.0)
            position = middle + 0.9 * min(1.0, float(factor)) * wish
        values = rooms.at(position)
        tried.append((float(values.min(initial=1.0)), position, values))
        best = max(room for room, _, _ in tried)
        if best > _COMFORT or (trial >= 60 and best > _ENOUGH_ROOM):
            break
    if best <= _ENOUGH_ROOM:
        for _, position, _ in sorted(tried, key=lambda item: -item[0])[:_IMPROVED]:
            position = _improve(rest, rooms, position, reach)
            values = rooms.at(position)
            tried.append((float(values.min()), position, values))
            if tried[-1][0] > _ENOUGH_ROOM:
                break
    room, position, _ = max(tried, key=lambda item: item[0])
    if room <= _LEAST_ROOM:
        positions = [item[1] for item in tried]
        raise InfeasibleError(_conflict_in_words(rest, rooms, reach, positions, [item[2] for item in tried], describe))
    return position


def _conflict_in_words(
    rest: RestLimits,
    walls: "_Rooms",
    reach: FloatArray,
    positions: list[FloatArray],
    values: list[FloatArray],
    describe: Callable[[int, float], str],
) -> str:
    """Which limits exclude each other and how they stand where they nearly do not."""
    rooms, kept = np.array(values), _conflict(np.array(values))
    for _ in range(_REFUTATIONS):
        # these limits alone: where they can be kept after all, the conflict is a larger one
        start = positions[int(np.argmax(rooms[:, kept].min(axis=1)))]
        position = _improve(rest, walls, start, reach, kept)
        found = walls.at(position)
        positions.append(position)
        rooms = np.vstack([rooms, found])
        if float(found[kept].min()) <= _LEAST_ROOM:
            break
        kept = _conflict(rooms)
    nearest = rooms[int(np.argmax(rooms[:, kept].min(axis=1)))]
    named = list(dict.fromkeys(describe(int(k), float(nearest[k])) for k in kept))
    if len(named) > _MOST_NAMED:
        named[_MOST_NAMED:] = [f"{len(named) - _MOST_NAMED} more"]
    return (
        f"no position was found at which the robot can keep these limits together. At the best of {len(rooms)}: "
        f"{'; '.join(named)}. Widen them"
    )


def _conflict(rooms: FloatArray) -> IntArray:
    """A smallest set of limits of which no position keeps all: none of it can be left out.

    Args:
        rooms: (T, r) part of its range that each limit leaves at each position.

    Returns:
        Indices of limits.
    """
    lost = rooms <= _LEAST_ROOM
    kept = np.flatnonzero(lost.any(axis=0))
    # what is lost least often is the first to be left out
    for k in kept[np.argsort(lost[:, kept].sum(axis=0), kind="stable")]:
        rest = kept[kept != k]
        if np.all(lost[:, rest].any(axis=1)):
            kept = rest
    return kept


@dataclass(frozen=True, eq=False)
class _Rooms:
    """What positions at rest leave of every limit, as a part of its half range."""

    walls: Sequence[Wall]
    harmonics: int

    def at(self, position: FloatArray) -> FloatArray:
        """(r,) negative outside."""
        rest = at_rest(position, self.harmonics)
        parts = [np.ones(0)]
        for wall in self.walls:
            value, half = wall.values(rest)[:, :1], _half_range(wall)
            parts.append((np.minimum(value - wall.lower, wall.upper - value) / half)[:, 0])
        return np.concatenate(parts)

    def sides(self, position: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
        """(R,) what every finite side leaves, (R, n) how that changes with the position, and (R,) whose side it is."""
        rest, n = at_rest(position, self.harmonics), len(position)
        rooms, slopes, owners, first = [np.zeros(0)], [np.zeros((0, n))], [np.zeros(0, dtype=np.intp)], 0
        for wall in self.walls:
            value, half, tangent = wall.values(rest)[:, :1], _half_range(wall), wall.tangent(rest)
            by_position = np.column_stack([tangent.push(at_rest(unit, self.harmonics))[:, 0] for unit in np.eye(n)])
            for sign, bound in ((1.0, wall.upper), (-1.0, wall.lower)):
                finite = np.isfinite(bound[:, 0])
                rooms.append((sign * (bound - value) / half)[finite, 0])
                slopes.append((-sign * by_position / half)[finite])
                owners.append(first + np.flatnonzero(finite))
            first += len(value)
        return np.concatenate(rooms), np.concatenate(slopes), np.concatenate(owners)


def _half_range(wall: Wall) -> FloatArray:
    both = np.isfinite(wall.upper) & np.isfinite(wall.lower)
    one = np.where(np.isfinite(wall.upper), np.abs(wall.upper), np.abs(wall.lower))
    with np.errstate(invalid="ignore"):
        return np.where(both, 0.5 * (wall.upper - wall.lower), one)


def _improve(
    rest: RestLimits, rooms: _Rooms, position: FloatArray, reach: FloatArray, chosen: IntArray | None = None
) -> FloatArray:
    """Raise the smallest room of chosen limits by linear programs, inside the linear limits and a box that adapts."""
    n, box = len(position), 0.2
    which = np.arange(len(rooms.at(position))) if chosen is None else chosen
    room = float(rooms.at(position)[which].min())
    for _ in range(_STEPS):
        values, slopes, owners = rooms.sides(position)
        taken = np.isin(owners, which)
        values, slopes = values[taken], slopes[taken]
        # maximise s with values + slopes step >= s, and the linear limits
        program = linprog(
            np.append(np.zeros(n), -1.0),
            A_ub=np.vstack(
                [
                    np.column_stack([-slopes, np.ones(len(values))]),
                    np.column_stack([rest.rows, np.zeros(len(rest.rows))]),
                ]
            ),
            b_ub=np.concatenate([values, rest.bounds - rest.rows @ position]),
            bounds=[(-box * width, box * width) for width in reach] + [(None, _COMFORT)],
        )
        if program.status != 0:
            break
        trial = position + 0.98 * program.x[:n]
        found = float(rooms.at(trial)[which].min())
        if found > room:
            position, room, box = trial, found, min(0.3, 1.5 * box)
        else:
            box *= 0.4
        if room > _ENOUGH_ROOM or box < 1e-4:
            break
    return position
