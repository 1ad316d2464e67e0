import pytest

from sea_ident.recordings.columns import UNITS
from sea_ident.recordings.naming import DIMENSIONS, SI_UNITS, dimension_of, split_name


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("q_hip", ("q", "hip")),
        ("q_left_hip", ("q", "left_hip")),
        ("q_reference_hip", ("q_reference", "hip")),
        ("theta_reference_stage1", ("theta_reference", "stage1")),
        ("tau_motor_reference_x", ("tau_motor_reference", "x")),
        ("tau_motor_x", ("tau_motor", "x")),
        ("q_", None),
        ("q", None),
        ("quantity_hip", None),
        ("Q_hip", None),
        ("time", None),
    ],
)
def test_the_longest_kind_wins(name, parts):
    assert split_name(name) == parts


def test_every_kind_has_units_and_its_si_unit_has_factor_one():
    assert dimension_of("time") == "time"
    for kind, dimension in DIMENSIONS.items():
        assert dimension_of(f"{kind}_a") == dimension
        for unit in SI_UNITS[dimension].split(" or "):
            assert UNITS[dimension][unit] == 1.0
