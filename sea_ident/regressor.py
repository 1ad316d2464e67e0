"""The regressor: effects in, labelled columns out."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects import Column, Contribution, Effect, State, corrected_motion
from sea_ident.exceptions import SeaIdentError
from sea_ident.motion import Motion
from sea_ident.robot import Robot


@dataclass(frozen=True, eq=False)
class Regressor:
    """Link and motor rows of the regressor Phi (paper, eq. 8).

    Attributes:
        columns: (p,) labels.
        link: (N, n, p) link rows: ``link @ psi = 0``, with the springs among the columns.
        motor: (N, n, p) motor rows: ``motor @ psi = tau_motor``.
        recorded_sum: (N, n, p) sum of both at the times of the recorded torques; None where these are on time.
    """

    columns: tuple[Column, ...]
    link: FloatArray
    motor: FloatArray
    recorded_sum: FloatArray | None = None

    @property
    def sum(self) -> FloatArray:
        """(N, n, p) sum of both: ``sum @ psi = tau_motor`` without a spring model (paper, eq. 4)."""
        return self.link + self.motor if self.recorded_sum is None else self.recorded_sum

    @property
    def names(self) -> tuple[str, ...]:
        """(p,) names of the parameters."""
        return tuple(column.name for column in self.columns)

    def summary(self) -> str:
        """Size and columns."""
        samples, n, _ = self.link.shape
        lines = [f"regressor: {samples} samples, {n} joints, {len(self.columns)} columns"]
        lines.extend(f"  {c.name} [{c.unit}] {c.effect}, {c.side}" for c in self.columns)
        return "\n".join(lines)


def model_columns(robot: Robot, effects: Sequence[Effect]) -> tuple[Column, ...]:
    """Labels of all columns of a model, in order.

    Raises:
        SeaIdentError: if two columns share a name.
    """
    columns = tuple(column for effect in effects for column in effect.columns(robot))
    twice = sorted(name for name, count in Counter(column.name for column in columns).items() if count > 1)
    if twice:
        raise SeaIdentError(
            f"the effects give two columns the same name: {', '.join(twice)}; leave one out, or number them where the "
            "effect has a number, as torque_ripple does (number=2)"
        )
    return columns


def prior_parameters(robot: Robot, effects: Sequence[Effect]) -> FloatArray:
    """(p,) values that the robot's description gives to all parameters, NaN where it gives none."""
    return np.concatenate([effect.prior(robot) for effect in effects]) if effects else np.zeros(0)


def build_regressor(
    robot: Robot,
    effects: Sequence[Effect],
    motion: Motion,
    channels: Mapping[str, FloatArray] | None = None,
) -> Regressor:
    """Build the regressor of a motion.

    Args:
        robot: the robot.
        effects: the model.
        motion: (N, n) motion.
        channels: further measured signals (N, n) by kind, for effects that need them.

    Returns:
        Labelled link and motor rows.

    Raises:
        SeaIdentError: if the motion does not fit the robot.
    """
    _check_joints(robot, motion)
    state = State(robot, corrected_motion(robot, effects, motion), channels)
    columns = model_columns(robot, effects)
    link, motor = np.zeros((2, len(motion), robot.n, len(columns)))
    for place, part in _parts(effects, state):
        _put(link, place, part.link, part.joint, slice(None))
        _put(motor, place, part.motor, part.joint, slice(None))
    late = [effect for effect in effects if type(effect).shifted is not Effect.shifted]
    if not late:
        return Regressor(columns, link, motor)
    rows, whole = Contribution(link, motor), _as_motor_rows(link + motor)
    for effect in late:
        rows, whole = (effect.shifted(robot, motion.time, each) for each in (rows, whole))
    return Regressor(columns, rows.link, rows.motor, whole.link + whole.motor)


def build_total(
    robot: Robot,
    effects: Sequence[Effect],
    motion: Motion,
    channels: Mapping[str, FloatArray] | None = None,
    columns: IntArray | None = None,
) -> FloatArray:
    """Build the sum of link and motor rows alone (paper, eq. 4), in a third of the memory and time.

    Args:
        robot: the robot.
        effects: the model.
        motion: (N, n) motion.
        channels: further measured signals (N, n) by kind, for effects that need them.
        columns: indices of the columns to be kept, rising; all by default.

    Returns:
        (N, n, k) rows: ``total @ psi = tau_motor``.

    Raises:
        SeaIdentError: if the motion does not fit the robot.
    """
    _check_joints(robot, motion)
    state = State(robot, corrected_motion(robot, effects, motion), channels)
    kept = np.arange(len(model_columns(robot, effects))) if columns is None else columns
    total = np.zeros((len(motion), robot.n, len(kept)))
    for place, part in _parts(effects, state):
        first, last = np.searchsorted(kept, (place.start, place.stop))
        if first == last:
            continue
        inside = kept[first:last] - place.start
        take: IntArray | slice = slice(None) if len(inside) == place.stop - place.start else inside
        _put(total, slice(first, last), part.link, part.joint, take)
        _put(total, slice(first, last), part.motor, part.joint, take, _is_nothing(part.link))
    late = [effect for effect in effects if type(effect).shifted is not Effect.shifted]
    if not late:
        return total
    whole = _as_motor_rows(total)
    for effect in late:
        whole = effect.shifted(robot, motion.time, whole)
    return whole.link + whole.motor


def _as_motor_rows(total: FloatArray) -> Contribution:
    """The sum of both rows as rows of the motor, whose torque it gives: it is late as a whole."""
    return Contribution(np.zeros_like(total), total)


def _parts(effects: Sequence[Effect], state: State) -> Iterator[tuple[slice, Contribution]]:
    """Columns of every effect and where they belong."""
    start = 0
    for effect in effects:
        part = effect.evaluate(state)
        stop = start + part.link.shape[2]
        yield slice(start, stop), part
        start = stop


def _put(
    total: FloatArray,
    place: slice,
    rows: FloatArray,
    joint: int | None,
    take: IntArray | slice,
    untouched: bool = True,
) -> None:
    """Put rows into their columns, or add them to what is there, touching no more memory than they need."""
    if _is_nothing(rows):
        return
    where = slice(None) if joint is None else joint
    if untouched:
        total[:, where, place] = rows[:, where, take]
    else:
        total[:, where, place] += rows[:, where, take]


def _is_nothing(rows: FloatArray) -> bool:
    """Whether rows are one zero that is repeated without taking memory."""
    return rows.size > 0 and not any(rows.strides) and rows.flat[0] == 0.0


def _check_joints(robot: Robot, motion: Motion) -> None:
    if motion.n != robot.n:
        raise SeaIdentError(f"the motion has {motion.n} joints, {robot.name} has {robot.n}")


def regressor_chunks(robot: Robot, effects: Sequence[Effect], motion: Motion, size: int = 1000) -> Iterator[Regressor]:
    """The regressor in parts of at most `size` samples, so that memory does not grow with the recording."""
    for part in motion.chunks(size):
        yield build_regressor(robot, effects, part)


def inverse_dynamics(robot: Robot, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Torque of bodies and rotors with the inertial parameters of the robot, by Pinocchio's RNEA.

    Args:
        robot: the robot.
        motion: (N, n) motion.

    Returns:
        Link rows (N, n) and motor rows (N, n) [N m]; their sum is the motor torque of the frictionless robot.
    """
    model = robot.extended_model
    data = model.createData()
    x = np.ascontiguousarray(robot.extended_state(motion.q, motion.theta))
    v = np.ascontiguousarray(robot.extended_rate(motion.dq, motion.dtheta))
    a = np.ascontiguousarray(robot.extended_rate(motion.ddq, motion.ddtheta))
    torque = np.empty_like(x)
    for k in range(len(motion)):
        torque[k] = pin.rnea(model, data, x[k], v[k], a[k])
    return torque @ robot.link_map, torque @ robot.motor_map
