"""One motor that moves two joints: a belt, a cable or a wrist gear that passes another joint."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, SimulationState
from sea_ident.effects.base import Anchor, Column, Effect, Shape, smooth_sign, titled
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.motion import Motion
from sea_ident.robot import Robot

SMALLEST_SHIFT = 1e-4
"""Share of the smoothing speed below which the derivative stands for the difference [-]."""

LARGEST_RATIO = 1.0
"""A fit begins with no more than this, between joints of one kind [-], ..."""

LEVERS = (0.01, 1.0)
"""... and between a slide and a turning joint with no more than a pinion of the first radius or a drum of the second
[m].
"""

BEYOND_LARGEST = 1.5
"""Times the largest ratio up to which a fit may go from there: a belt of one to one is not at the end of its range."""

TRIED = (0.0, -0.3, 0.3, -1.0, 1.0)
"""Ratios that a search begins with, as shares of the largest. What a large one does is no multiple of what a small one
does: the motor turns the other way half of the time."""


@dataclass(frozen=True)
class TransmissionCoupling(Effect):
    """The motor of `joint` turns by theta + r q of another joint: its inertia and friction couple the two.

    Its parameters are r times what the motor has: r J, r b and r c. So the model needs no other parameter to be known
    beforehand but r itself, around which the sign of the Coulomb friction turns. That is a shape: where it turns says
    r much better than how large it is, which the friction that a fit gives the motor takes a part of.

    Attributes:
        joint: joint of the motor.
        other: joint that its transmission passes.
        reflected_inertia: of the motor, None for that of the description [kg m2].
        viscous: friction of the motor [N m s/rad].
        coulomb: friction of the motor [N m].
        smoothing: speed around which the sign is smoothed [rad/s].
        ratio: r at which the Coulomb friction turns over: with the speed of the motor, not of the joint [-], or
            [rad/m] where only the other joint slides, [m/rad] where only the own does.
        largest: ratio that a fit may begin with, either way, in the unit of `ratio`.
    """

    other: str | None = None
    reflected_inertia: float | None = None
    viscous: float | None = None
    coulomb: float | None = None
    smoothing: float = 0.01
    ratio: float = 0.0
    largest: float = LARGEST_RATIO

    name: ClassVar[str] = "transmission_coupling"
    side: ClassVar[Side] = Side.BOTH
    source: ClassVar[str] = "Staubli RX-90 wrist; Gautier, Dynamic identification of robots with power model, ICRA 1997"

    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("ratio", "-", -BEYOND_LARGEST * LARGEST_RATIO, BEYOND_LARGEST * LARGEST_RATIO, logarithmic=False),
    )

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """Every motor with the joint before it in the tree and the joints after it."""
        return tuple(
            cls(joint=joint.name, other=robot.joint_names[k])
            for i, joint in enumerate(robot.joints)
            if joint.actuator is not None
            for k in robot.neighbours(i)
        )

    @property
    def title(self) -> str:
        """Name and joint, and the joint that its transmission passes: one motor may have two couplings."""
        return titled(self.name, self.joint) + ("" if self.other is None else f" from {self.other}")

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """The ratio r times the inertia, the viscous and the Coulomb friction of the motor."""
        own, other = (robot.joints[k] for k in self._indices(robot))
        # what is between two joints is symmetric, as in a matrix of masses: N s2/rad whichever of them slides
        first, second = (own, other) if own.prismatic else (other, own)
        units = (
            f"{first.torque_unit} s2/{second.position_unit}",
            f"{first.torque_unit} s/{second.position_unit}",
            other.torque_unit,
        )
        return tuple(
            Column(self.parameter_name(f"{label}_from_{self.other}"), unit, self.name, self.joint, self.side)
            for label, unit in zip(("inertia", "viscous", "coulomb"), units, strict=True)
        )

    def evaluate(self, state: State) -> Contribution:
        """The motor feels the other link, and the other link feels the motor."""
        i, k = self._indices(state.robot)
        motion = state.motion
        link, motor = (np.zeros((len(motion), state.robot.n, 3)) for _ in range(2))
        turned = motion.dtheta[:, i] + self.ratio * motion.dq[:, k]
        sign = smooth_sign(turned, self.smoothing)
        if np.abs(self.ratio * motion.dq[:, k]).max(initial=0.0) > SMALLEST_SHIFT * self.smoothing:
            change = (sign - smooth_sign(motion.dtheta[:, i], self.smoothing)) / self.ratio
        else:
            change = (1.0 - sign**2) / self.smoothing * motion.dq[:, k]
        motor[:, i, 0] = motion.ddq[:, k]
        link[:, k, 0] = motion.ddtheta[:, i] + self.ratio * motion.ddq[:, k]
        motor[:, i, 1] = motion.dq[:, k]
        link[:, k, 1] = turned
        motor[:, i, 2] = change
        link[:, k, 2] = sign
        return Contribution(link, motor)

    def variants(self, state: State) -> tuple["TransmissionCoupling", ...]:
        """With ratios from a small one, about which its amounts say more, to that of a belt."""
        return tuple(replace(self, ratio=share * self._largest_ratio(state.robot)) for share in TRIED)

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """With the ratios that joints of such kinds may have."""
        (ratio,) = self.shapes
        return (replace(ratio, lower=-BEYOND_LARGEST * self.largest, upper=BEYOND_LARGEST * self.largest),)

    def shape_unit(self, shape: Shape, robot: Robot) -> str:
        """That of the motor over that of the other joint."""
        own, other = (robot.joints[k].position_unit for k in self._indices(robot))
        return "-" if own == other else f"{own}/{other}"

    def planted(self, robot: Robot, ratio: float) -> FloatArray:
        """(3,) parameters of a motor of this description."""
        return ratio * np.array(self._motor(robot))

    def turning(self, motion: Motion, robot: Robot) -> dict[int, FloatArray]:
        """The speed of the motor, which is not that of its joint."""
        i, k = self._indices(robot)
        return {i: motion.dtheta[:, i] + self.ratio * motion.dq[:, k]}

    def anchored(self, anchor: Anchor) -> "TransmissionCoupling":
        """With the inertia and the friction of the motor in the model, and at first the ratio that they say."""
        i, _ = self._indices(anchor.robot)
        actuator = anchor.robot.joints[i].actuator
        inertia = 0.0
        if actuator is not None:
            inertia = anchor.value(f"{actuator.rotor_group}.rotor_inertia") * actuator.gear_ratio**2
        known = replace(
            self,
            reflected_inertia=inertia,
            viscous=anchor.value(f"{self.joint}.viscous_friction"),
            coulomb=anchor.value(f"{self.joint}.coulomb_friction"),
            smoothing=anchor.smoothing(str(self.joint)) or self.smoothing,
            largest=self._largest_ratio(anchor.robot),
        )
        if self.ratio != 0.0:
            return known
        values = np.array([anchor.value(column.name) for column in self.columns(anchor.robot)])
        return replace(known, ratio=float(np.clip(known._ratio(anchor.robot, values), -known.largest, known.largest)))

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The friction, as in the columns; the inertia acts in `modified`."""
        i, k = self._indices(robot)
        ratio = self.ratio or self._ratio(robot, values)
        _, viscous, coulomb = (float(value) for value in values)
        own_coulomb = coulomb / ratio if ratio else 0.0

        def act(state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
            own, other = state.dtheta[i], state.dq[k]
            turned = own + ratio * other
            sign = float(np.tanh(turned / self.smoothing))
            motor[i] += viscous * other + own_coulomb * (sign - float(np.tanh(own / self.smoothing)))
            link[k] += viscous * turned + coulomb * sign

        return act

    def modified(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot whose rotor turns with both joints."""
        i, k = self._indices(robot)
        inertia = self._motor(robot)[0]
        ratio = float(values[0]) / inertia if inertia > 0.0 else 0.0
        link_map = robot.link_map.copy()
        for index, rotor in zip(robot.rotor_indices, robot.rotors, strict=True):
            if rotor.joint == self.joint:
                row = robot.extended_model.joints[int(index)].idx_v
                link_map[row, k] += ratio * (robot.motor_map[row, i] + robot.link_map[row, i])
        return replace(robot, link_map=link_map)

    def _ratio(self, robot: Robot, values: FloatArray) -> float:
        """R by the friction, the Coulomb friction first: it says it by where it turns over."""
        _, viscous, coulomb = self._motor(robot)
        amount, of = (values[2], coulomb) if coulomb > 0.0 else (values[1], viscous)
        return float(amount) / of if of > 0.0 else 0.0

    def _largest_ratio(self, robot: Robot) -> float:
        """Largest r that a fit begins with, in the unit of `ratio`."""
        own, other = (robot.joints[k] for k in self._indices(robot))
        if own.prismatic == other.prismatic:
            return LARGEST_RATIO
        shortest, longest = LEVERS
        return longest if own.prismatic else 1.0 / shortest

    def _motor(self, robot: Robot) -> tuple[float, float, float]:
        actuator = robot.joints[self._indices(robot)[0]].actuator
        known = (0.0, 0.0, 0.0)
        if actuator is not None:
            known = (
                (actuator.rotor_inertia or 0.0) * actuator.gear_ratio**2,
                actuator.viscous_friction or 0.0,
                actuator.coulomb_friction or 0.0,
            )
        own = (self.reflected_inertia, self.viscous, self.coulomb)
        inertia, viscous, coulomb = (a if b is None else b for a, b in zip(known, own, strict=True))
        return inertia, viscous, coulomb

    def _indices(self, robot: Robot) -> tuple[int, int]:
        if self.joint is None or self.other is None:
            raise EffectError(f"the effect {self.name!r} couples two joints; give joint=... and other=...")
        if self.joint == self.other:
            raise EffectError(f"the effect {self.name!r} couples joint {self.joint!r} with itself; give another one")
        i, k = robot.index(self.joint), robot.index(self.other)
        if robot.joints[i].actuator is None:
            raise EffectError(f"joint {self.joint!r} of {robot.name} has no motor that could move another joint")
        return i, k
