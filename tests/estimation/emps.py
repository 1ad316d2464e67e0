"""The electro-mechanical positioning system: its recording, its model, and what was published of it."""

from pathlib import Path

from sea_ident.effects import make_effect

IDENTIFICATION = Path(__file__).parents[2] / ".." / "shared" / "data" / "emps" / "identification.csv"

EFFECTS = (
    make_effect("rigid_bodies"),
    make_effect("viscous_friction", "slider"),
    # v_off well below the speeds of the axis (0.125 m/s), as the published model has a sign function
    make_effect("coulomb_friction", "slider", smoothing=1e-3),
    make_effect("torque_offset", "slider"),
)

PUBLISHED = {"M [kg]": 95.1089, "Fv [N s/m]": 203.5034, "Fc [N]": 20.3935, "offset [N]": -3.1648}
"""In the order of the effects."""
