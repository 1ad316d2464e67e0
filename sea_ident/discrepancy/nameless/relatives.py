"""Relatives of an effect: effects of nearly the same form that the library does not have.

Its own columns times a signal that they do not depend on, the same effect driven by another joint, in one direction of
motion or of the load only, turned in it, or on the other side of the spring. What depends on a signal already is not
multiplied by it: friction that grows with another power of the speed is still friction that grows with the speed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from functools import cache
from typing import ClassVar, Self

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.free_shapes import is_signal
from sea_ident.effects import Anchor, Column, Contribution, Effect, JointEffect, Side, State
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.load import LoadEffect, MotorLoadEffect
from sea_ident.effects.torque_constant import TorqueConstant
from sea_ident.robot import Robot

FASTER = 1.5
"""Factor of the speed by which it is tried whether columns depend on it [-]."""

FURTHER = 0.3
"""Way by which all positions are moved to try whether columns depend on them [rad] or [m]."""

DEPENDS = 0.1
"""Share by which columns must change to depend on a signal: its sign alone, smoothed, changes less [-]."""


class Growth(StrEnum):
    """What the columns of a relative are multiplied by: a signal of the joint."""

    LOAD = "load"
    LOAD_MAGNITUDE = "magnitude of the load"
    SPEED = "speed"
    SPEED_MAGNITUDE = "magnitude of the speed"
    POSITION = "position"


class Only(StrEnum):
    """Where alone a relative acts, or where it acts the other way round."""

    DRIVING = "only where the motor drives"
    DRIVEN = "only where the motor is driven"
    FORWARD = "only in the positive direction of motion"
    BACKWARD = "only in the negative direction of motion"
    POSITIVE_LOAD = "only under a positive load"
    NEGATIVE_LOAD = "only under a negative load"
    TURNS_DRIVEN = "the other way round where the motor is driven"
    TURNS_BACKWARD = "the other way round in the negative direction of motion"
    TURNS_UNDER_LOAD = "the other way round under a negative load"


_TURNS = (Only.TURNS_DRIVEN, Only.TURNS_BACKWARD, Only.TURNS_UNDER_LOAD)
_LOADS = (Growth.LOAD, Growth.LOAD_MAGNITUDE)
_SPEEDS = (Growth.SPEED, Growth.SPEED_MAGNITUDE)


@dataclass(frozen=True)
class Relative(Effect):
    """What all relatives have beside the effect that they are related to, which is their other base class.

    Attributes:
        growth: what the columns are multiplied by, None where by nothing.
        only: where alone it acts or is turned, None where everywhere.
        carrier: knows the load of the joint.
        middle: position at which what grows with the position vanishes [rad] or [m].
        driver: the effect at the joint that drives it, None where it is the own.
    """

    growth: Growth | None = None
    only: Only | None = None
    carrier: TorqueConstant = field(default_factory=TorqueConstant)
    middle: float = 0.0
    driver: Effect | None = None

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Those of the effect; with any sign, for physics demands none of what has no name."""
        return tuple(replace(column, nonnegative=False) for column in super().columns(robot))  # type: ignore[safe-super]

    def evaluate(self, state: State) -> Contribution:
        """Rows (N, n, k) of the effect times the signal, or those that it has at the other joint."""
        if self.driver is not None:
            shapes = {shape.name: getattr(self, shape.name) for shape in self.shapes}
            return _rows_there(replace(self.driver, **shapes), state, str(self.joint))
        if self.only is not None and isinstance(self, TorqueConstant):
            # what one way only loses is lost in the gear, and what the rotor takes for itself does not pass that
            part = state.at(Side.MOTOR, self.at, self.column_of(self.load(state), state.motion.dtheta[:, 0]))
        else:
            part = super().evaluate(state)  # type: ignore[safe-super]
        factor = self._factor(state)[:, None, None]
        return Contribution(part.link * factor, part.motor * factor, part.joint)

    def anchored(self, anchor: Anchor) -> Self:
        """With what the model says of the joint, and of the one that drives it."""
        driver = None if self.driver is None else self.driver.anchored(anchor)
        return replace(super().anchored(anchor), carrier=self.carrier.anchored(anchor), driver=driver)

    def plausible(self, values: FloatArray, parameters: Mapping[str, float]) -> bool:
        """Whatever: nothing is known of what has no name."""
        return True

    def _factor(self, state: State) -> FloatArray:
        """(N,) signal that it grows with."""
        i = state.robot.index(str(self.joint))
        motion = state.motion
        if self.only is not None:
            return self._there(self.carrier.load(state), motion.dtheta[:, i])
        if self.growth in _LOADS:
            signal = self.carrier.load(state)
        elif self.growth in _SPEEDS:
            signal = motion.dtheta[:, i]
        else:
            signal = motion.theta[:, i] - self.middle
        magnitude = self.growth in (Growth.LOAD_MAGNITUDE, Growth.SPEED_MAGNITUDE)
        return np.abs(signal) if magnitude else np.asarray(signal, dtype=np.float64)

    def _there(self, load: FloatArray, dtheta: FloatArray) -> FloatArray:
        """(N,) one where it acts, minus one where turned, zero elsewhere, from the load and the motor velocity."""
        match self.only:
            case Only.DRIVING | Only.DRIVEN | Only.TURNS_DRIVEN:
                way = load * dtheta
            case Only.FORWARD | Only.BACKWARD | Only.TURNS_BACKWARD:
                way = dtheta
            case _:
                way = load
        if self.only in _TURNS:
            return np.sign(way)
        positive = self.only in (Only.DRIVING, Only.FORWARD, Only.POSITIVE_LOAD)
        return np.asarray(way > 0.0 if positive else way < 0.0, dtype=np.float64)


class BehindTheSpring(JointEffect):
    """An effect of a motor where it acts on the link instead, which is its other base class."""

    side: ClassVar[Side] = Side.LINK

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Those of the effect, of the state of the link."""
        return super().local_columns(q, dq, q, dq)  # type: ignore[safe-super]


def relatives_of(bench: Bench, model: Sequence[Effect], effect: Effect) -> tuple[Relative, ...]:
    """All relatives of an effect of a model; none of what is no torque of a single joint in every period."""
    if effect.joint is None or is_signal(effect) or isinstance(effect, ExternalForce):
        return ()
    state = bench.state(model)
    grown = [growth for growth in Growth if not _depends(state, effect, growth)]
    drivers: list[Effect] = []
    # a spring acts between the two sides of its own joint, whatever the others do
    if isinstance(effect, JointEffect | LoadEffect) and effect.side is not Side.SPRING:
        places = [place.joint for place in type(effect).instances(bench.robot) if place.joint != effect.joint]
        drivers = [replace(effect, joint=joint) for joint in places]
    own = {item.name: getattr(effect, item.name) for item in fields(effect)}
    kind, carrier = _related(type(effect)), TorqueConstant(joint=effect.joint)
    middle = float(np.mean(state.motion.theta[:, bench.robot.index(effect.joint)]))
    return (
        *(kind(**own, growth=growth, carrier=carrier, middle=middle) for growth in grown),
        *(kind(**own, carrier=carrier, driver=driver) for driver in drivers),
    )


def one_sided(effect: Effect) -> tuple[Relative, ...]:
    """An effect in one direction only or turned in it, in each; none of what is no torque of a single joint always."""
    if effect.joint is None or is_signal(effect) or isinstance(effect, ExternalForce):
        return ()
    own = {item.name: getattr(effect, item.name) for item in fields(effect)}
    kind, carrier = _related(type(effect)), TorqueConstant(joint=effect.joint)
    return tuple(kind(**own, only=only, carrier=carrier) for only in Only)


def behind_the_spring(bench: Bench, effect: Effect) -> tuple[Effect, ...]:
    """An effect of the motor where it acts on the link instead; none of what is no torque of a joint with a spring."""
    if not isinstance(effect, JointEffect) or effect.side is not Side.MOTOR:
        return ()
    if bench.robot.index(effect.required_joint) not in bench.robot.elastic_indices:
        return ()
    own = {item.name: getattr(effect, item.name) for item in fields(effect)}
    return (_behind(type(effect))(**own),)


def _depends(state: State, effect: Effect, growth: Growth) -> bool:
    """Whether the columns of an effect depend on a signal, and not on its sign alone."""
    if growth in _LOADS:
        return isinstance(effect, LoadEffect) or effect.side is Side.SPRING
    motion = state.motion
    if growth in _SPEEDS:
        changed = replace(motion, dq=FASTER * motion.dq, dtheta=FASTER * motion.dtheta)
    else:
        changed = replace(motion, q=motion.q + FURTHER, theta=motion.theta + FURTHER)
    before, after = (effect.evaluate(s) for s in (state, State(state.robot, changed, state.channels)))
    size = np.linalg.norm(before.link) + np.linalg.norm(before.motor)
    change = np.linalg.norm(after.link - before.link) + np.linalg.norm(after.motor - before.motor)
    return bool(change > DEPENDS * size)


def _rows_there(driver: Effect, state: State, joint: str) -> Contribution:
    """Rows (N, n, k) at a joint of what acts at another one.

    What follows the torque of a joint follows all that its motor gives, with its inertia and friction: at the joint
    itself these take up their part.
    """
    here, there = state.robot.index(joint), state.robot.index(str(driver.joint))
    if isinstance(driver, MotorLoadEffect):
        columns = driver.column_of(driver.motor_torque(state), state.motion.dtheta[:, there])
        return state.at(Side.MOTOR, joint, columns)
    rows = driver.evaluate(state)
    return Contribution(_moved(rows.link, there, here), _moved(rows.motor, there, here), here)


def _moved(rows: FloatArray, source: int, target: int) -> FloatArray:
    """Rows (N, n, k) with those of one joint at another, and nothing elsewhere."""
    out = np.zeros_like(rows)
    out[:, target] = rows[:, source]
    return out


@cache
def _related(form: type[Effect]) -> type[Relative]:
    """The class of the relatives of an effect: they have its shapes, and are refined as it is."""
    return dataclass(frozen=True)(type(f"RelativeOf{form.__name__}", (Relative, form), {}))


@cache
def _behind(form: type[JointEffect]) -> type[JointEffect]:
    """The class of the same effect on the link."""
    return dataclass(frozen=True)(type(f"{form.__name__}BehindTheSpring", (BehindTheSpring, form), {}))
