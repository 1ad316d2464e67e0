"""The numbers that a simulation needs: bodies, rotors, springs, friction, drives."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect
from sea_ident.exceptions import SimulationError
from sea_ident.robot import Robot


@dataclass(frozen=True, eq=False)
class PlantedEffect:
    """A further effect that acts in a simulation.

    Attributes:
        effect: where and how it acts.
        values: (k,) values of its parameters, in the order of its columns.
    """

    effect: Effect
    values: FloatArray


@dataclass(frozen=True, eq=False)
class Plant:
    """A robot with all its numbers known.

    Attributes:
        robot: the robot, with the inertial parameters of its links and rotors.
        viscous_friction: (n,) at the motors (rigid joint: at the joint) [N m s/rad].
        coulomb_friction: (n,) at the motors [N m].
        link_viscous_friction: (n,) at the links of elastic joints [N m s/rad].
        link_coulomb_friction: (n,) at the links of elastic joints [N m].
        stiffness: (n,) K1, 0 at a rigid joint [N m/rad].
        cubic_stiffness: (n,) K3 [N m/rad3].
        spring_damping: (n,) D [N m s/rad].
        efficiency: (n,) of the transmissions, 1 where there is none [-].
        torque_constant: (n,) at the motor shaft, NaN where not known [N m/A].
        notes: what was taken as absent.
    """

    robot: Robot
    viscous_friction: FloatArray
    coulomb_friction: FloatArray
    link_viscous_friction: FloatArray
    link_coulomb_friction: FloatArray
    stiffness: FloatArray
    cubic_stiffness: FloatArray
    spring_damping: FloatArray
    efficiency: FloatArray
    torque_constant: FloatArray
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in self.numbers():
            values = np.asarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, values)
            if values.shape != (self.robot.n,):
                raise SimulationError(f"plant of {self.robot.name}: {name} is {values.shape}, not ({self.robot.n},)")
            if name == "torque_constant":
                continue
            bad = np.flatnonzero(~np.isfinite(values))
            if bad.size:
                raise SimulationError(f"joint {self.robot.joint_names[bad[0]]!r}: {name} is {values[bad[0]]}")
        for i, joint in enumerate(self.robot.joints):
            if joint.elastic and not self.stiffness[i] > 0.0:
                raise SimulationError(
                    f"joint {joint.name!r}: the stiffness of its spring is {self.stiffness[i]:g} "
                    f"{joint.torque_unit}/{joint.position_unit}; "
                    "it must be positive"
                )
            if not 0.0 < self.efficiency[i] <= 1.0:
                raise SimulationError(f"joint {joint.name!r}: efficiency {self.efficiency[i]:g} is not in (0, 1]")

    @staticmethod
    def numbers() -> tuple[str, ...]:
        """Names of the (n,) fields."""
        return (
            "viscous_friction", "coulomb_friction", "link_viscous_friction", "link_coulomb_friction", "stiffness",
            "cubic_stiffness", "spring_damping", "efficiency", "torque_constant",
        )  # fmt: skip

    def replace(self, **changes: FloatArray | Robot) -> "Plant":
        """A copy with some fields replaced, as `dataclasses.replace`."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def values_of(self, effects: Sequence[Effect]) -> FloatArray:
        """True parameters of a model whose effects the plant holds.

        Args:
            effects: rigid bodies, rotors, friction and springs, in any order.

        Returns:
            (p,) values in the order of the model's columns.

        Raises:
            SimulationError: for an effect that is not one of the plant's own.
        """
        robot = self.robot
        parts: list[FloatArray] = []
        for effect in effects:
            i = 0 if effect.joint is None else robot.index(effect.joint)
            match effect.name:
                case "rigid_bodies" | "rotor_inertia":
                    parts.append(effect.prior(robot))
                case "viscous_friction":
                    parts.append(self.viscous_friction[i : i + 1])
                case "coulomb_friction":
                    parts.append(self.coulomb_friction[i : i + 1])
                case "link_friction":
                    parts.append(np.array([self.link_viscous_friction[i], self.link_coulomb_friction[i]]))
                case "spring_stiffness":
                    parts.append(self.stiffness[i : i + 1])
                case "spring_stiffening":
                    parts.append(self.cubic_stiffness[i : i + 1])
                case "spring_damping":
                    parts.append(self.spring_damping[i : i + 1])
                case other:
                    raise SimulationError(f"the plant of {robot.name} has no numbers for the effect {other!r}")
        return np.concatenate(parts) if parts else np.zeros(0)

    def summary(self) -> str:
        """A table of the numbers per joint."""
        lines = [f"plant of {self.robot.name}"]
        for i, joint in enumerate(self.robot.joints):
            spring = (
                f", spring {self.stiffness[i]:g} {self.cubic_stiffness[i]:g} {self.spring_damping[i]:g}"
                if joint.elastic
                else ""
            )
            lines.append(
                f"  {joint.name}: friction {self.viscous_friction[i]:g} {self.coulomb_friction[i]:g}, link friction "
                f"{self.link_viscous_friction[i]:g} {self.link_coulomb_friction[i]:g}{spring}, "
                f"efficiency {self.efficiency[i]:g}"
            )
        lines.extend(f"  note: {text}" for text in self.notes)
        return "\n".join(lines)


_ABSENT = {
    "viscousFriction": "no viscous friction of the motor",
    "coulombFriction": "no Coulomb friction of the motor",
    "rotorInertia": "a motor without inertia",
    "damping": "a spring without damping",
    "cubicStiffness": "a linear spring",
    "efficiency": "a transmission without losses",
}
"""What a simulation takes a number for that the annotation leaves out."""


def plant_from_robot(robot: Robot) -> Plant:
    """The plant that the URDF and the annotation describe.

    What no motion is possible without is an error where the annotation leaves it out: the stiffness of a spring and the
    rotor inertia before it. All else is absent where it is not stated, and the notes say so: friction, the damping of a
    spring, its cubic stiffness, losses of a transmission, the rotor of a rigid joint. A joint without `<dynamics>` has
    no link friction (the URDF's own default), and a joint without motor has no friction of a motor.

    Raises:
        SimulationError: a number is missing; the message names the joint and the element.
    """
    n = robot.n
    missing: list[str] = []
    absent: dict[str, list[str]] = {}
    numbers = {name: np.zeros(n) for name in Plant.numbers()}
    numbers["efficiency"][:] = 1.0
    numbers["torque_constant"][:] = np.nan
    for i, joint in enumerate(robot.joints):
        actuator = joint.actuator
        on_link = "link_" if joint.elastic else ""
        numbers[f"{on_link}viscous_friction"][i] += joint.damping or 0.0
        numbers[f"{on_link}coulomb_friction"][i] += joint.friction or 0.0
        if actuator is None:
            continue
        known: dict[str, float | None] = {
            "viscousFriction": actuator.viscous_friction,
            "coulombFriction": actuator.coulomb_friction,
            "efficiency": actuator.efficiency,
        }
        needed = {}
        if joint.elastic:
            spring = robot.spring(joint.name)
            known |= {"damping": spring.damping, "cubicStiffness": spring.cubic_stiffness}
            needed = {
                "<rotorInertia> in <actuator>": actuator.rotor_inertia or None,
                'stiffness="..." in <seriesElastic>': spring.stiffness,
            }
            numbers["stiffness"][i] = spring.stiffness or 0.0
            numbers["spring_damping"][i] = spring.damping or 0.0
            numbers["cubic_stiffness"][i] = spring.cubic_stiffness or 0.0
        else:
            known["rotorInertia"] = actuator.rotor_inertia
            # a rigid joint has one friction, wherever it is stated
            stated = {"viscousFriction": joint.damping, "coulombFriction": joint.friction}
            known |= {tag: value for tag, value in stated.items() if known[tag] is None}
        missing += [f"{joint.name}: {tag}" for tag, value in needed.items() if value is None]
        for tag, value in known.items():
            if value is None:
                absent.setdefault(tag, []).append(joint.name)
        numbers["viscous_friction"][i] += actuator.viscous_friction or 0.0
        numbers["coulomb_friction"][i] += actuator.coulomb_friction or 0.0
        if actuator.efficiency is not None:
            numbers["efficiency"][i] = actuator.efficiency
        if actuator.torque_constant is not None:
            numbers["torque_constant"][i] = actuator.torque_constant
    if missing:
        raise SimulationError(
            f"{robot.source}: an elastic joint cannot be simulated without its spring and the inertia of its rotor, "
            f"and the <transmission> states none, or zero, of {'; '.join(missing)}. State them, or in Python give "
            "simulate(plant=...)"
        )
    notes = tuple(
        f"no {tag}, so {meaning}: {', '.join(absent[tag])}" for tag, meaning in _ABSENT.items() if tag in absent
    )
    return Plant(robot, notes=notes, **numbers)
