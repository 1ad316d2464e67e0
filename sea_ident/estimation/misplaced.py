"""Columns of another joint or of the wrong sense, or a robot that is mounted another way: told by a better fit."""

from collections.abc import Iterator, Sequence
from itertools import combinations, product

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, State
from sea_ident.estimation.put_right import Order, Trial, as_they_say
from sea_ident.motion import Motion
from sea_ident.plain import plain
from sea_ident.processing import ProcessedRecording
from sea_ident.robot import Robot

LARGE = 0.01
"""Share of the power of the torque, the mean of the joints, from which on what is left asks for a reason [-], ..."""

SMALL = 1e-3
"""... and this where chains that are alike may have changed places."""

BETTER = 0.1
"""What is left with the columns put right, over what was left, up to which they were wrong [-]."""

LEAST, LESS = 1e-4, 0.7
"""`LARGE` and `BETTER` where the bodies as they are described pull the other way: a model whose bodies are free, and
negative then, leaves little."""

ALIKE = 2.0
"""Times what is left at best up to which directions of gravity are alike [-]."""

HEAVIER = 2.0
"""Times as heavy as they are described, or as light, that bodies may be for gravity to act another way [-]."""

FELT = 0.05
"""Share of the weight that is felt from another side from which on a robot is not level [-]."""

NEARLY = 0.1
"""Share by which directions of gravity differ at least to be others [-]."""

EXPLAINED = 0.03
"""Share of the power of the torque that may be left then: a model of a real robot lacks something, too [-]."""


def misplaced_columns(robot: Robot, effects: Sequence[Effect], processed: ProcessedRecording) -> str | None:
    """What is wrong with a recording that the model fits only after two joints change places, or gravity another way.

    Nothing is looked for where the model leaves little of the torque. What a model lacks does not look like this: with
    the columns put right a tenth of what was left must be left, and every joint must have a positive inertia.

    Args:
        robot: the robot.
        effects: the model.
        processed: the recording.

    Returns:
        A sentence; None where the columns may be as they say.
    """
    trial = Trial.of(robot, effects, processed)
    if trial is None:
        return None
    motion, torque = trial.motion, trial.torque
    before, _ = trial(as_they_say(robot))
    feels = _feels_gravity(robot, motion)
    upside_down = feels and _weight(robot, motion, torque, robot.gravity)[0] < -1.0 / HEAVIER
    if before < (LEAST if upside_down else SMALL):
        return None
    kind = "current" if trial.by_current else "tau_motor"
    mountings = _mountings(robot) if feels and (upside_down or before >= LARGE) else ()
    orders = (*_chains_exchanged(robot, kind), *mountings, *(_orders(robot, kind) if before >= LARGE else ()))
    found = [(*trial(order), order) for order in orders]
    # bodies that are free may have any weight, and as they are described about theirs
    weights = [None if o.gravity is None else _weight(robot, motion, torque, o.gravity) for _, _, o in found]
    possible = [
        (left, order, 0.0 if weight is None else weight[1])
        for (left, positive, order), weight in zip(found, weights, strict=True)
        if positive and (weight is None or 1.0 / HEAVIER < weight[0] < HEAVIER)
    ]
    if not possible:
        return None
    after, order, _ = min(possible, key=lambda each: each[0])
    if order.gravity is not None:
        # and of any sign feel gravity from either side
        alike = [each for each in possible if each[1].gravity is not None and each[0] <= ALIKE * after]
        after, order, _ = max(alike, key=lambda each: each[2])
    most = LESS if upside_down and order.gravity is not None else BETTER
    if not (after < most * before and after < EXPLAINED):
        return None
    return (
        f"{processed.source}: {order.text}. With that the model leaves {plain(100.0 * after**0.5)} % of the torque "
        f"beyond its noise, without it {plain(100.0 * before**0.5)} %"
    )


def _feels_gravity(robot: Robot, motion: Motion) -> bool:
    """Whether the bodies as described are felt as the robot is: else it is level, and a tilt would do for a wall."""
    state, size, bodies = State(robot, motion), float(np.linalg.norm(robot.gravity)), robot.inertial_parameters
    ways = (robot.gravity, *(size * np.eye(3)))
    own, *others = (float(np.linalg.norm(state.gravity_torque(way, bodies))) for way in ways)
    return own > FELT * max(others)


def _weight(robot: Robot, motion: Motion, torque: FloatArray, gravity: FloatArray) -> tuple[float, float]:
    """How often the weight of the bodies as described is in a torque (N, n), and how well it goes with it [-]."""
    weight = State(robot, motion).gravity_torque(gravity, robot.inertial_parameters)
    size = max(float(np.linalg.norm(weight)), 1e-300)
    along = float(np.sum(weight * torque)) / size
    return along / size, along / max(float(np.linalg.norm(torque)), 1e-300)


def _orders(robot: Robot, torque: str) -> Iterator[Order]:
    """What may have happened to the columns of one joint or of two, with the kind of column that torques are."""
    own, plain = np.arange(robot.n), np.ones(robot.n)
    elastic = set(robot.elastic_indices.tolist())
    for i, j in combinations(range(robot.n), 2):
        other = own.copy()
        other[[i, j]] = other[[j, i]]
        names = robot.joint_names[i], robot.joint_names[j]
        springs = i in elastic or j in elastic
        positions = ("q", "theta") if springs else ("q",)
        yield Order(other, other, other, plain, plain, _exchanged("all columns", (*positions, torque), *names))
        yield Order(own, own, other, plain, plain, _exchanged(f"columns {torque}", (torque,), *names))
        yield Order(other, other, own, plain, plain, _exchanged("the positions", positions, *names))
        if springs:
            yield Order(other, own, own, plain, plain, _exchanged("columns q", ("q",), *names))
            yield Order(own, other, own, plain, plain, _exchanged("columns theta", ("theta",), *names))
    for i, name in enumerate(robot.joint_names):
        turned = plain.copy()
        turned[i] = -1.0
        positions = ("q", "theta") if i in elastic else ("q",)
        yield Order(own, own, own, plain, turned, _reversed((torque,), name))
        yield Order(own, own, own, turned, plain, _reversed(positions, name))
        yield Order(own, own, own, turned, turned, _reversed((*positions, torque), name))


def _chains_exchanged(robot: Robot, torque: str) -> Iterator[Order]:
    """Chains that changed places as a whole: as alike as legs are, they leave little of the torque as others."""
    own, plain = np.arange(robot.n), np.ones(robot.n)
    elastic = set(robot.elastic_indices.tolist())
    for one, two in _alike_chains(robot):
        other = own.copy()
        other[[*one, *two]] = [*two, *one]
        kinds = {i: (("q", "theta") if i in elastic else ("q",)) for i in (*one, *two)}
        pairs = [
            (kind, robot.joint_names[a], robot.joint_names[b])
            for i, j in zip(one, two, strict=True)
            for a, b in ((i, j), (j, i))
            for kind in (*kinds[i], torque)
        ]
        chains = " and ".join(", ".join(robot.joint_names[i] for i in chain) for chain in (one, two))
        yield Order(
            other, other, other, plain, plain, f"all columns of the chains {chains} look exchanged. {_named(pairs)}"
        )


def _mountings(robot: Robot) -> Iterator[Order]:
    """Gravity along the edges, the diagonals of the sides and those of the whole of a cube around the root link."""
    own, plain = np.arange(robot.n), np.ones(robot.n)
    size = float(np.linalg.norm(robot.gravity))
    for way in product((0.0, -1.0, 1.0), repeat=3):
        if not size or not any(way):
            continue
        gravity = size * np.array(way) / np.linalg.norm(way)
        if np.linalg.norm(gravity - robot.gravity) < NEARLY * size:
            continue
        now, then = (", ".join(f"{value + 0.0:.3g}" for value in each) for each in (robot.gravity, gravity))
        text = (
            f"gravity looks like ({then}) m/s2 in the root link, not ({now}): does the robot hang, or is it on a "
            f"wall? Load it with gravity=({then}), on the command line --gravity={then.replace(' ', '')}"
        )
        yield Order(own, own, own, plain, plain, text, gravity)


def _exchanged(what: str, kinds: tuple[str, ...], a: str, b: str) -> str:
    pairs = [(kind, x, y) for kind in kinds for x, y in ((a, b), (b, a))]
    return f"{what} of {a!r} and {b!r} look exchanged. {_named(pairs)}"


def _named(pairs: Sequence[tuple[str, str, str]]) -> str:
    """What to do about columns of a kind that stand under the name of a joint and belong to another."""
    names = ", ".join(f"'{kind}_{a}={kind}_{b}'" for kind, a, b in pairs)
    return f"Name them the other way: ColumnSource, or --column with {names}"


def _alike_chains(robot: Robot) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Pairs of chains of two joints or more that begin at one place, as the legs of a robot do, joint by joint."""
    parents, elastic = robot.parents, set(robot.elastic_indices.tolist())

    def chain(i: int) -> tuple[int, ...]:
        """The joints from one on, as long as none has two behind it."""
        behind = [k for k, before in enumerate(parents) if before == i]
        return (i, *chain(behind[0])) if len(behind) == 1 else (i,)

    for i, j in combinations(range(robot.n), 2):
        one, two = chain(i), chain(j)
        same = [k in elastic for k in one] == [k in elastic for k in two]
        if parents[i] == parents[j] and len(one) > 1 and same:
            yield one, two


def _reversed(kinds: tuple[str, ...], joint: str) -> str:
    *first, last = (f"{kind}_{joint}" for kind in kinds)
    columns = f"{', '.join(first)} and {last}" if first else last
    names = ", ".join(f"'{kind}_{joint}={kind}_{joint},sign=-1'" for kind in kinds)
    verb = "has" if len(kinds) == 1 else "have"
    return f"{columns} {verb} the other sign, by the other joints. Turn it: ColumnSource, or --column with {names}"
