"""Columns of another joint or of the wrong sense, or a robot that is mounted another way: told by a better fit."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, State
from sea_ident.motion import Motion
from sea_ident.processing import ProcessedRecording
from sea_ident.processing.torque import transmitted
from sea_ident.regressor import build_total
from sea_ident.robot import Robot

EQUATIONS = 900
"""Equations that are looked at, of all joints together."""

LARGE = 0.01
"""Share of the power of the torque, the mean of the joints, from which on what is left asks for a reason [-], ..."""

SMALL = 1e-3
"""... and this where chains that are alike may have changed places, or the bodies as described pull the other way."""

BETTER = 0.1
"""What is left with the columns put right, over what was left, up to which they were wrong [-]."""

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


@dataclass(frozen=True, eq=False)
class _Order:
    """Columns as they may have been meant.

    Attributes:
        link: (n,) number of the joint under whose name the q of every joint stands.
        motor: (n,) the same of theta.
        torque: (n,) the same of the torque.
        motion_sign: (n,) 1 or -1.
        torque_sign: (n,) 1 or -1.
        text: what is wrong if this is right, and what to do.
        gravity: (3,) in the root link [m/s2]; that of the description where None.
    """

    link: NDArray[np.int_]
    motor: NDArray[np.int_]
    torque: NDArray[np.int_]
    motion_sign: FloatArray
    torque_sign: FloatArray
    text: str
    gravity: FloatArray | None = None


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
    thin = slice(None, None, max(1, processed.samples * robot.n // EQUATIONS))
    motion, torque = processed.motion[thin], processed.tau_motor[thin]
    channels = {kind: values[thin] for kind, values in processed.channels.items()}
    power = np.mean(torque**2, axis=0)
    if not np.all(power > 0.0):
        return None
    noise = np.mean(processed.raw_tau_variance[thin], axis=0) / processed.periods / power
    current = channels.get("current")
    by_current = current is not None and np.allclose(_from_current(robot, current, motion), torque, rtol=1e-6)

    def tried(order: _Order) -> tuple[float, bool]:
        """Share of the torque that is left, and whether all inertias are positive."""
        arranged = _arranged(robot, motion, order)
        target = torque[:, order.torque] * order.torque_sign
        if current is not None and by_current:
            target = _from_current(robot, current[:, order.torque] * order.torque_sign, arranged)
        mounted = robot if order.gravity is None else robot.with_gravity(order.gravity)
        rows = build_total(mounted, effects, arranged, channels)
        scale = 1.0 / np.sqrt(np.mean(target**2, axis=0))
        table = (rows * scale[:, None]).reshape(-1, rows.shape[-1])
        norms = np.linalg.norm(table, axis=0)
        norms = np.where(norms > 0.0, norms, 1.0)
        values = np.linalg.lstsq(table / norms, (target * scale).ravel(), rcond=1e-8)[0]
        residual = target * scale - (table / norms @ values).reshape(target.shape)
        left = np.maximum(np.mean(residual**2, axis=0) - noise[order.torque], 0.0)
        response = build_total(mounted, effects, _pushes(robot, arranged.q.mean(axis=0)))
        inertia = np.array([(response[i, i] - response[-1, i]) / norms @ values for i in range(robot.n)])
        return float(np.mean(left)), bool(np.all(inertia > 0.0))

    own = np.arange(robot.n)
    plain = np.ones(robot.n)
    before, _ = tried(_Order(own, own, own, plain, plain, ""))
    feels = _feels_gravity(robot, motion)
    # bodies that are free and pulled the other way are negative ones to a model, which leaves little
    upside_down = feels and _weight(robot, motion, torque, robot.gravity)[0] < -1.0 / HEAVIER
    if before < SMALL:
        return None
    kind = "current" if by_current else "tau_motor"
    mountings = _mountings(robot) if feels and (upside_down or before >= LARGE) else ()
    orders = (*_chains_exchanged(robot, kind), *mountings, *(_orders(robot, kind) if before >= LARGE else ()))
    found = [(*tried(order), order) for order in orders]
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
    if not (after < BETTER * before and after < EXPLAINED):
        return None
    return (
        f"{processed.source}: {order.text}. With that the model leaves {100.0 * after**0.5:.2g} % of the torque beyond "
        f"its noise, without it {100.0 * before**0.5:.2g} %"
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


def _orders(robot: Robot, torque: str) -> Iterator[_Order]:
    """What may have happened to the columns of one joint or of two, with the kind of column that torques are."""
    own, plain = np.arange(robot.n), np.ones(robot.n)
    elastic = set(robot.elastic_indices.tolist())
    for i, j in combinations(range(robot.n), 2):
        other = own.copy()
        other[[i, j]] = other[[j, i]]
        names = robot.joint_names[i], robot.joint_names[j]
        springs = i in elastic or j in elastic
        positions = ("q", "theta") if springs else ("q",)
        yield _Order(other, other, other, plain, plain, _exchanged("all columns", (*positions, torque), *names))
        yield _Order(own, own, other, plain, plain, _exchanged(f"columns {torque}", (torque,), *names))
        yield _Order(other, other, own, plain, plain, _exchanged("the positions", positions, *names))
        if springs:
            yield _Order(other, own, own, plain, plain, _exchanged("columns q", ("q",), *names))
            yield _Order(own, other, own, plain, plain, _exchanged("columns theta", ("theta",), *names))
    for i, name in enumerate(robot.joint_names):
        turned = plain.copy()
        turned[i] = -1.0
        positions = ("q", "theta") if i in elastic else ("q",)
        yield _Order(own, own, own, plain, turned, _reversed((torque,), name))
        yield _Order(own, own, own, turned, plain, _reversed(positions, name))
        yield _Order(own, own, own, turned, turned, _reversed((*positions, torque), name))


def _chains_exchanged(robot: Robot, torque: str) -> Iterator[_Order]:
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
        yield _Order(
            other, other, other, plain, plain, f"all columns of the chains {chains} look exchanged. {_named(pairs)}"
        )


def _mountings(robot: Robot) -> Iterator[_Order]:
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
        yield _Order(own, own, own, plain, plain, text, gravity)


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


def _arranged(robot: Robot, motion: Motion, order: _Order) -> Motion:
    """A motion with the columns of its joints put right."""
    link = [getattr(motion, kind)[:, order.link] * order.motion_sign for kind in ("q", "dq", "ddq")]
    motor = [getattr(motion, kind)[:, order.motor] * order.motion_sign for kind in ("theta", "dtheta", "ddtheta")]
    rigid = np.setdiff1d(np.arange(robot.n), robot.elastic_indices)
    for own, other in zip(motor, link, strict=True):
        own[:, rigid] = other[:, rigid]
    return Motion(motion.time, *link, *motor)


def _from_current(robot: Robot, current: FloatArray, motion: Motion) -> FloatArray:
    """(N, n) torque of currents (N, n) of the motors [N m] or [N]; zero where a motor is not described."""
    torque, efficiency = np.zeros_like(current), np.ones(robot.n)
    for i, joint in enumerate(robot.joints):
        if joint.actuator is not None and joint.actuator.torque_constant is not None:
            torque[:, i] = joint.actuator.gear_ratio * joint.actuator.torque_constant * current[:, i]
            efficiency[i] = joint.actuator.efficiency or 1.0
    return torque * transmitted(torque, efficiency, motion.dtheta)


def _pushes(robot: Robot, middle: FloatArray) -> Motion:
    """(n + 1 samples) every joint accelerated alone at one posture (n,), and none."""
    still = np.zeros((robot.n + 1, robot.n))
    push = np.vstack([np.eye(robot.n), np.zeros((1, robot.n))])
    return Motion.rigid(np.arange(robot.n + 1.0), still + middle, still, push)
