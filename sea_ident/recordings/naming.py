"""Names of columns: `<kind>_<joint>`, with the physical dimension and the SI unit of every kind.

The longest kind that fits wins: `q_reference_hip` is the reference of joint `hip`, not q of `reference_hip`.
"""

from typing import Final

TIME: Final = "time"

DIMENSIONS: Final[dict[str, str]] = {
    "q": "position",
    "dq": "velocity",
    "ddq": "acceleration",
    "theta": "position",
    "dtheta": "velocity",
    "ddtheta": "acceleration",
    "tau_motor": "effort",
    "tau_spring": "effort",
    "current": "current",
    "temperature": "temperature",
    "q_reference": "position",
    "dq_reference": "velocity",
    "theta_reference": "position",
    "dtheta_reference": "velocity",
    "tau_motor_reference": "effort",
    "current_reference": "current",
    "external_force": "effort",
}
"""Kind of column -> physical dimension."""

SI_UNITS: Final[dict[str, str]] = {
    "time": "s",
    "position": "rad or m",
    "velocity": "rad/s or m/s",
    "acceleration": "rad/s^2 or m/s^2",
    "effort": "N m or N",
    "current": "A",
    "temperature": "degC",
}
"""Physical dimension -> unit in a recording (the second for prismatic joints)."""

_LONGEST_FIRST: Final = tuple(sorted(DIMENSIONS, key=len, reverse=True))


def split_name(name: str) -> tuple[str, str] | None:
    """Split a column name into kind and joint.

    Args:
        name: Column name, such as `tau_motor_knee`.

    Returns:
        `("tau_motor", "knee")`, or None where the name does not start with a known kind.
    """
    for kind in _LONGEST_FIRST:
        if name.startswith(kind + "_") and len(name) > len(kind) + 1:
            return kind, name[len(kind) + 1 :]
    return None


def dimension_of(name: str) -> str | None:
    """Physical dimension of a column of a recording, `time` included; None where the name is not known."""
    if name == TIME:
        return "time"
    parts = split_name(name)
    return None if parts is None else DIMENSIONS[parts[0]]
