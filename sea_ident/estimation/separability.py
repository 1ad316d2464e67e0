"""Friction of motor and link of one joint: told apart only by what the spring lets them move differently."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import BaseParameters
from sea_ident.estimation.uncertainty import Uncertainty

PAIRS = (("viscous_friction", "link_friction_viscous"), ("coulomb_friction", "link_friction_coulomb"))
"""What acts alike at the motor and at the link of a joint."""

BLURRED = 5.0
"""Standard deviation of a part, in those of the sum, from which on the two hinder each other."""

UNKNOWN = 0.3
"""Standard deviation of a part, as a share of the sum, from which on it is not known."""


def unseparated_friction(base: BaseParameters, values: FloatArray, uncertainty: Uncertainty) -> tuple[str, ...]:
    """Warn of joints whose motor and link friction this recording tells in sum only.

    The torque of such a spring is not known either, as the friction between motor and spring is not: its stiffness
    comes out with a wide interval, and is the first to be wrong where the model lacks anything.

    Args:
        base: the base parameters.
        values: (b,) what was identified.
        uncertainty: their covariance.

    Returns:
        One warning that names the joints with the figures, or none.
    """
    place = {base.columns[k].name: row for row, k in enumerate(base.independent)}
    joints = dict.fromkeys(column.joint for column in base.columns if column.joint is not None)
    found = []
    for joint in joints:
        for motor, link in PAIRS:
            names = f"{joint}.{motor}", f"{joint}.{link}"
            if not all(name in place for name in names):
                continue
            rows = np.array([place[name] for name in names])
            block = uncertainty.covariance[np.ix_(rows, rows)]
            part, whole = float(np.sqrt(block.diagonal().min())), float(np.sqrt(max(block.sum(), 0.0)))
            total = abs(float(values[rows].sum()))
            if part > BLURRED * whole and part > UNKNOWN * total:
                kind = motor.split("_")[0]
                found.append(f"{joint} ({kind}: sum {total:.3g} +- {whole:.1g}, each part +- {part:.2g})")
    if not found:
        return ()
    return (
        f"friction of motor and of link cannot be told apart here: {'; '.join(found)}. Only their sum is known, so "
        "neither are the torques of these springs nor their stiffness; leave the friction of one side out, or deflect "
        "these springs more",
    )
