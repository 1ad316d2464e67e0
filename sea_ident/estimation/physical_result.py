"""A physically consistent model, and what it was asked for."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Column
from sea_ident.estimation.model import Model
from sea_ident.robot import Robot

CONSISTENT = 1e-3
"""Largest shift of a base parameter, in its standard deviations, that is rounding of the solver."""


WITHIN = 2.0
"""Shift of a base parameter, in its standard deviations, that noise explains."""


class Pull(StrEnum):
    """What draws the free directions toward the description."""

    ENTROPIC = "entropic"
    EUCLIDEAN = "euclidean"


@dataclass(frozen=True, eq=False)
class PhysicalParameters:
    """Standard parameters of real bodies that agree with an identified model.

    Attributes:
        columns: (p,) their columns.
        values: (p,) values, in the order of the columns.
        base_values: (b,) base parameters that they give.
        shift: (b,) `base_values` less the identified ones.
        shift_in_std: (b,) the same in standard deviations.
        chi_square: ``shift' F' Sigma^-1 F shift``: how much worse the fit becomes.
        bodies: bodies that hold the identified values back: what is measured is impossible for them.
        limited: other parameters at their limit of zero.
        model: the identified model with `base_values` in place of the identified ones.
        pull: what drew the free directions; None where real bodies are so tightly held by the data that only the
            point nearest to the data was found.
    """

    columns: tuple[Column, ...]
    values: FloatArray
    base_values: FloatArray
    shift: FloatArray
    shift_in_std: FloatArray
    chi_square: float
    bodies: tuple[str, ...]
    limited: tuple[str, ...]
    model: Model
    pull: Pull | None

    @property
    def consistent(self) -> bool:
        """Whether the identified base parameters are those of real bodies as they stand."""
        return bool(np.all(np.abs(self.shift_in_std) < CONSISTENT))

    @property
    def within_uncertainty(self) -> bool:
        """Whether real bodies have base parameters that the data cannot tell from the identified ones."""
        return bool(np.all(np.abs(self.shift_in_std) <= WITHIN))

    def verdict(self) -> str:
        """One sentence on whether data and physics agree."""
        if self.consistent:
            return "the identified base parameters are those of real bodies"
        worst = int(np.argmax(np.abs(self.shift_in_std)))
        name, unit = self.model.names[worst], self.model.base.units[worst]
        identified = self.base_values[worst] - self.shift[worst]
        moved = (
            f"most of all {name} from {identified:.4g} to {self.base_values[worst]:.4g} {unit}, "
            f"{abs(self.shift_in_std[worst]):.2g} standard deviations"
        )
        if self.within_uncertainty:
            return f"base parameters moved to those of real bodies, within their uncertainty: {moved}"
        return (
            f"no real bodies have the identified base parameters; those of the nearest are taken: {moved} (chi square "
            f"{self.chi_square:.3g}). Something is wrong in the model or the data: `diagnose` looks for it"
        )

    def named(self) -> dict[str, float]:
        """Values by name."""
        return {column.name: float(v) for column, v in zip(self.columns, self.values, strict=True)}

    @property
    def inertial(self) -> FloatArray:
        """(10 bodies,) standard inertial parameters, as `Robot.inertial_parameters`."""
        values = self.named()
        robot = self.model.robot
        return np.array(
            [
                values.get(name, default)
                for name, default in zip(robot.inertial_names, robot.inertial_parameters, strict=True)
            ]
        )

    @property
    def rotor_inertias(self) -> FloatArray:
        """(rotors,) rotor inertias at the shaft, as `Robot.rotor_inertias` [kg m2]."""
        values = self.named()
        robot = self.model.robot
        return np.array(
            [
                values.get(f"{rotor.rotor_group}.rotor_inertia", default)
                for rotor, default in zip(robot.rotors, robot.rotor_inertias(), strict=True)
            ]
        )

    def robot(self) -> Robot:
        """The robot with these inertial parameters and rotor inertias."""
        return self.model.robot.with_inertial_parameters(self.inertial, self.rotor_inertias)

    def summary(self) -> str:
        """Whether data and physics agree, and the parameters."""
        lines = [self.verdict()]
        if not self.consistent:
            if self.bodies:
                lines.append(f"  bodies that hold back: {', '.join(self.bodies)}")
            if self.limited:
                lines.append(f"  at zero: {', '.join(self.limited)}")
        lines.extend(f"  {c.name} = {v:.6g} {c.unit}" for c, v in zip(self.columns, self.values, strict=True))
        return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class Box:
    """Space that a body occupies, in the frame of its joint, axes parallel to it.

    Attributes:
        lower: (3,) [m].
        upper: (3,) [m].
    """

    lower: FloatArray
    upper: FloatArray
