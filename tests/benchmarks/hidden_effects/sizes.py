"""Errors of the sizes that a diagnosis gives, in standard deviations of its own, where the truth has the same form."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tests.benchmarks.hidden_effects.case import Planted

SIZES = {
    "stribeck_friction": ("", "speed", "exponent"),
    "nonlinear_viscous_friction": ("", "exponent"),
    "load_dependent_friction": ("",),
    "directional_efficiency": ("",),
    "torque_offset": ("",),
    "torque_saturation": ("",),
    "spring_offset": ("",),
    "parallel_spring": ("stiffness",),
    "link_friction": ("coulomb",),
    "backlash": ("half_width",),
    "presliding_friction": ("displacement",),
    "encoder_offset": ("offset",),
    "position_delay": ("delay",),
}
"""Parameters of effects that are the size of the truth, and then those of its shape, by the name after the effect's."""

WAVES = ("torque_ripple", "position_dependent_friction", "encoder_eccentricity")
"""Effects that are the sine and the cosine of the truth's size at its phase."""


def size_errors(planted: Planted, entry: Mapping[str, Any]) -> list[float]:
    """Errors over standard deviations [-] of what an entry of `missing` says of an effect that it names rightly.

    Args:
        planted: the truth.
        entry: with its parameters.

    Returns:
        One for every parameter that is comparable and was not held; none where the form of the truth is another.
    """
    if planted.form != "library":
        return []
    prefix = f"{planted.joint}.{planted.effect}"
    parameters = entry.get("parameters", ())
    told = {p["name"].removeprefix(prefix).removeprefix("_"): (p["value"], p["std"]) for p in parameters}
    truth = dict(zip(SIZES.get(planted.effect, ()), (planted.size, *planted.shape.values()), strict=False))
    if planted.effect in WAVES:
        phase = planted.shape["phase"]
        truth = {"sine": planted.size * np.cos(phase), "cosine": planted.size * np.sin(phase)}
        truth |= {"order": planted.shape["order"]} if "order" in planted.shape else {}
    if planted.effect == "spring_hysteresis":  # of two elements that share its force
        truth = {"narrow": 0.5 * planted.size, "wide": 0.5 * planted.size, "slip": planted.shape["width"]}
    if planted.effect == "torque_constant":
        truth = {"": 1.0 / (1.0 + planted.size) - 1.0}
    if planted.effect == "torque_delay":  # a measured torque that is late is what the model's comes before
        truth = {"delay": -planted.size}
    return [
        float((told[name][0] - value) / told[name][1])
        for name, value in truth.items()
        if name in told and told[name][1] > 0.0
    ]
