"""Effects that depend on the torque that a joint carries."""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, JointAction
from sea_ident.effects.base import Anchor, Effect, JointEffect, smooth_sign
from sea_ident.effects.drift import TrendEffect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot
from sea_ident.robot.rotor_columns import own_rotor_row

SPRING_LAW = ("spring_stiffness", "spring_stiffening", "spring_damping")
MOTOR_FRICTION = ("viscous_friction", "coulomb_friction")
"""Parameters that an effect by load has as numbers of its own."""

CARRIED = (Side.LINK, Side.BOTH)
"""Sides of what a rigid joint carries beside the bodies of the model."""


@dataclass(frozen=True)
class Term:
    """An effect of a model with the values of its parameters.

    Attributes:
        effect: the effect.
        values: (k,) values of its columns.
    """

    effect: Effect
    values: tuple[float, ...]

    def link(self, state: State, index: int) -> FloatArray:
        """(N,) what it adds to the link row of a joint."""
        return np.asarray(self.effect.evaluate(state).link[:, index] @ np.array(self.values), dtype=np.float64)

    def motor(self, state: State, index: int) -> FloatArray:
        """(N,) what it adds to the motor row of a joint."""
        return np.asarray(self.effect.evaluate(state).motor[:, index] @ np.array(self.values), dtype=np.float64)


@dataclass(frozen=True)
class LoadEffect(Effect):
    """An effect whose columns depend on the load of its joint.

    The load is not measured: it is what the rest of the model says, and is kept in the effect itself (`anchored`), so
    that a model that is saved and read again has the same columns. What is None comes from the robot's description.

    Attributes:
        joint: joint at which it acts.
        smoothing: speed around which the sign of the velocity is smoothed [rad/s] or [m/s].
        stiffness: K1 of its spring [N m/rad].
        cubic_stiffness: K3 of its spring [N m/rad3].
        damping: D of its spring [N m s/rad].
        reflected_inertia: of its motor [kg m2].
        viscous: friction of its motor [N m s/rad].
        coulomb: friction of its motor [N m].
        inertial: (10 b,) standard inertial parameters of all links, for the load of a rigid joint.
        terms: what else the model has in its spring, on the links that a rigid joint carries, and at its motor.
    """

    smoothing: float = 0.01
    stiffness: float | None = None
    cubic_stiffness: float | None = None
    damping: float | None = None
    reflected_inertia: float | None = None
    viscous: float | None = None
    coulomb: float | None = None
    inertial: Sequence[float] = ()
    terms: tuple[Term, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "inertial", tuple(float(value) for value in self.inertial))

    @property
    def at(self) -> str:
        """The joint.

        Raises:
            EffectError: if none was given.
        """
        if self.joint is None:
            raise EffectError(f"the effect {self.name!r} acts at a joint; give joint=...")
        return self.joint

    def anchored(self, anchor: Anchor) -> Self:
        """The same effect with the load that the model gives to its joint."""
        robot, joint = anchor.robot, self.at
        known = robot.joints[robot.index(joint)]
        smoothing = anchor.smoothing(joint)
        changed = replace(
            self,
            smoothing=self.smoothing if smoothing is None else smoothing,
            viscous=anchor.value(f"{joint}.viscous_friction"),
            coulomb=anchor.value(f"{joint}.coulomb_friction"),
            reflected_inertia=_reflected_inertia(robot, joint, anchor),
            terms=tuple(_terms(anchor, self)),
        )
        if known.elastic:
            return replace(
                changed,
                stiffness=anchor.value(f"{joint}.spring_stiffness"),
                cubic_stiffness=anchor.value(f"{joint}.spring_stiffening"),
                damping=anchor.value(f"{joint}.spring_damping"),
            )
        return replace(changed, inertial=anchor.inertial())

    def spring_load(self, robot: Robot, deflection: FloatArray, rate: FloatArray) -> FloatArray:
        """Torque of the spring [N m] at deflections [rad] and deflection rates [rad/s] of any shape.

        Raises:
            EffectError: if its stiffness is known neither from a fit nor from the robot's description.
        """
        spring = robot.spring(self.at)
        stiffness = self.stiffness if self.stiffness is not None else spring.stiffness
        if stiffness is None:
            raise EffectError(
                f"the effect {self.name!r} at {self.at!r} depends on the load, and the stiffness of its spring is not "
                "known: give stiffness=..., or put it into the annotation"
            )
        cubic = self.cubic_stiffness if self.cubic_stiffness is not None else spring.cubic_stiffness
        damping = self.damping if self.damping is not None else spring.damping
        return stiffness * deflection + (cubic or 0.0) * deflection**3 + (damping or 0.0) * rate

    def load(self, state: State) -> FloatArray:
        """(N,) torque from the motor side onto the link [N m]: of the spring, or of all that a rigid joint carries."""
        robot, i = state.robot, state.robot.index(self.at)
        if robot.joints[i].elastic:
            law = self.spring_load(robot, state.motion.deflection[:, i], state.motion.deflection_rate[:, i])
            return sum((term.motor(state, i) for term in self._of(Side.SPRING)), law)
        inertial = np.array(self.inertial) if len(self.inertial) else robot.inertial_parameters
        return sum((term.link(state, i) for term in self._of(*CARRIED)), state.body_torque(inertial)[:, i])

    def motor_torque(self, state: State) -> FloatArray:
        """(N,) torque of the motor: load, inertia of the rotor, friction, and what else the model has there [N m]."""
        robot, motion = state.robot, state.motion
        i = robot.index(self.at)
        actuator = robot.joints[i].actuator
        viscous, coulomb = self.viscous, self.coulomb
        if actuator is not None:
            viscous = actuator.viscous_friction if viscous is None else viscous
            coulomb = actuator.coulomb_friction if coulomb is None else coulomb
        friction = (viscous or 0.0) * motion.dtheta[:, i] + (coulomb or 0.0) * self.sign(motion.dtheta[:, i])
        torque: FloatArray = self.load(state) + self.rotor_torque(state) + friction
        return sum((term.motor(state, i) for term in self._of(Side.MOTOR)), torque)

    def rotor_torque(self, state: State) -> FloatArray:
        """(N,) torque that the rotor of the joint takes for itself by its inertia [N m]."""
        robot = state.robot
        rows = own_rotor_row(robot, state.motion, self.at)
        torque = np.zeros(len(rows))
        for k, rotor in enumerate(robot.rotors):
            if rotor.joint == self.at:
                known = self.reflected_inertia
                inertia = (rotor.rotor_inertia or 0.0) if known is None else known / rotor.gear_ratio**2
                torque += inertia * rows[:, k]
        return torque

    def sign(self, velocity: FloatArray) -> FloatArray:
        """Smoothed sign of a velocity."""
        return smooth_sign(velocity, self.smoothing)

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can hold, with its terms in the same form."""
        record = super().to_dict()
        record["shape"]["terms"] = [{**term.effect.to_dict(), "values": list(term.values)} for term in self.terms]
        return record

    def _of(self, *sides: Side) -> Iterator[Term]:
        return (term for term in self.terms if term.effect.side in sides)


def _reflected_inertia(robot: Robot, joint: str, anchor: Anchor) -> float:
    actuator = robot.joints[robot.index(joint)].actuator
    if actuator is None:
        return 0.0
    return anchor.value(f"{actuator.rotor_group}.rotor_inertia") * actuator.gear_ratio**2


def _terms(anchor: Anchor, own: LoadEffect) -> Iterator[Term]:
    """What else a model has where an effect by load acts, and its load and the torque of its motor are made of."""
    robot, joint = anchor.robot, own.at
    elastic = robot.joints[robot.index(joint)].elastic
    carried = (Side.SPRING,) if elastic else CARRIED
    has = {f"{joint}.{name}" for name in (*SPRING_LAW, *MOTOR_FRICTION)} | set(robot.inertial_names)
    has |= set(robot.rotor_groups)
    for effect in anchor.effects:
        if effect.side not in (*carried, Side.MOTOR) or effect.name == own.name or isinstance(effect, TrendEffect):
            continue
        if effect.joint != joint and (effect.side is Side.MOTOR or isinstance(effect, JointEffect)):
            continue
        names = [column.name for column in effect.columns(robot)]
        values = tuple(anchor.value(name) for name in names)
        if not has.isdisjoint(names) or not any(values):
            continue
        if isinstance(effect, LoadEffect):
            # its own load is all that it follows: two that follow the torque of their motor would follow each other
            effect = replace(effect, terms=tuple(effect._of(*carried)))
        yield Term(effect, values)


class MotorLoadEffect(LoadEffect):
    """An effect at the motor, given by the load of the joint and the speed of the motor."""

    @abstractmethod
    def column_of(self, load: FloatArray, dtheta: FloatArray) -> FloatArray:
        """(N, 1) column from the load (N,) [N m] and the motor velocity (N,)."""

    def evaluate(self, state: State) -> Contribution:
        """Motor row (N, n, 1)."""
        i = state.robot.index(self.at)
        return state.at(Side.MOTOR, self.at, self.column_of(self.load(state), state.motion.dtheta[:, i]))

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The same at the present state, with the torque that the simulator has for the joint."""
        return JointAction(
            robot.index(self.at), self.side.shares, lambda state: self.column_of(state.tau_spring, state.dtheta), values
        )
