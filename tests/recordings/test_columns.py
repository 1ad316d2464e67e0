"""Units, gears, counts, signs and zeros against values worked out by hand."""

import math

import numpy as np
import pytest

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import ColumnSource
from sea_ident.recordings.columns import check_unit_in_name, convert


@pytest.mark.parametrize(
    ("raw", "target", "how", "expected"),
    [
        (2.0, "q_a", {}, 2.0),
        (180.0, "q_a", {"unit": "deg"}, math.pi),
        (0.25, "q_a", {"unit": "rev"}, math.pi / 2),
        (250.0, "q_slider", {"unit": "mm"}, 0.25),
        (1024.0, "theta_a", {"unit": "counts", "counts_per_rev": 4096}, math.pi / 2),
        (1536.0, "theta_a", {"unit": "counts", "counts_per_rev": 4096, "zero": 512}, math.pi / 2),
        (60.0, "dq_a", {"unit": "rpm"}, 2 * math.pi),
        (3000.0, "dtheta_a", {"unit": "rpm", "gear_ratio": 100}, math.pi),
        (90.0, "dq_a", {"unit": "deg/s", "sign": -1}, -math.pi / 2),
        (4096.0, "dtheta_a", {"unit": "counts/s", "counts_per_rev": 4096, "gear_ratio": -2}, -math.pi),
        (100.0, "theta_a", {"gear_ratio": 50}, 2.0),
        (36000.0, "theta_a", {"unit": "deg", "gear_ratio": 100}, 2 * math.pi),
        (25.0, "tau_motor_a", {"unit": "mN m", "gear_ratio": 100}, 2.5),
        (1.5, "tau_spring_a", {"unit": "kN m"}, 1500.0),
        (1500.0, "current_a", {"unit": "mA"}, 1.5),
        (0.1, "current_a", {"scale": 20.0, "zero": 0.025}, 1.5),
        (300.0, "temperature_a", {"unit": "K"}, 26.85),
        (212.0, "temperature_a", {"unit": "degF"}, 100.0),
        (2500.0, "time", {"unit": "ms"}, 2.5),
        (2.5e9, "time", {"unit": "ns"}, 2.5),
    ],
)
def test_conversion(raw, target, how, expected):
    values = convert(np.array([raw]), target, ColumnSource("x", **how))
    assert values[0] == pytest.approx(expected, rel=1e-14)


def test_wraps_are_undone_before_anything_else():
    turns = np.linspace(0.0, 1000.0, 500)
    how = ColumnSource("x", unit="deg", wraps_at=360.0, zero=90.0, gear_ratio=2.0)
    found = convert(np.mod(turns, 360.0), "theta_a", how)
    np.testing.assert_allclose(found, np.deg2rad(turns - 90.0) / 2.0, atol=1e-12)


def test_nan_stays_where_it_is_when_wraps_are_undone():
    raw = np.array([350.0, 10.0, np.nan, 20.0])
    found = convert(raw, "q_a", ColumnSource("x", unit="deg", wraps_at=360.0))
    assert np.flatnonzero(np.isnan(found)).tolist() == [2]


@pytest.mark.parametrize(
    ("how", "part"),
    [
        ({"gear_ratio": 0.0}, "gear_ratio is 0"),
        ({"gear_ratio": math.nan}, "gear_ratio is nan"),
        ({"scale": 0.0}, "scale is 0"),
        ({"zero": math.inf}, "zero is inf"),
        ({"sign": 2}, "sign is 2"),
        ({"unit": "counts"}, "needs counts_per_rev"),
        ({"unit": "deg", "counts_per_rev": 10}, "goes with the unit 'counts'"),
        ({"unit": "counts", "counts_per_rev": 0}, "must be positive"),
        ({"wraps_at": -1.0}, "must be positive"),
    ],
)
def test_impossible_translations_are_refused(how, part):
    with pytest.raises(RecordingError, match=part):
        ColumnSource("x", **how)


@pytest.mark.parametrize(
    ("target", "how", "part"),
    [
        ("q_a", {"unit": "rpm"}, "a position has one of rad"),
        ("dq_a", {"unit": "deg"}, "a velocity has one of rad/s"),
        ("current_a", {"gear_ratio": 100}, "current passes no gear"),
        ("torque_a", {}, "is not a column of a recording"),
    ],
)
def test_units_and_gears_must_fit_the_kind(target, how, part):
    with pytest.raises(RecordingError, match=part):
        convert(np.ones(3), target, ColumnSource("x", **how))


@pytest.mark.parametrize(
    ("target", "name", "unit", "said"),
    [
        ("q_a", "pos (deg)", None, "unit=deg"),
        ("q_a", "pos [deg]", "rad", "unit=deg"),
        ("q_a", "pos (°)", None, "unit=deg"),
        ("time", "Time(ms)", None, "unit=ms"),
        ("current_a", "i [mA]", None, "unit=mA"),
        ("tau_motor_a", "torque (mNm)", None, "unit=mN m"),
        ("q_a", "pos (rad)", "deg", "unit=rad"),
        ("q_a", "pos (deg)", "deg", None),
        ("q_a", "pos [rad]", None, None),
        ("tau_motor_a", "torque [Nm]", None, None),
        ("q_a", "pos[3]", None, None),
        ("q_a", "pos (filtered)", None, None),
        ("dq_a", "v (deg/s)", "deg/s", None),
    ],
)
def test_a_unit_in_the_name_of_a_column_is_not_passed_over(target, name, unit, said):
    how = ColumnSource(name, unit=unit)
    if said is None:
        check_unit_in_name(target, how, "log.csv")
        return
    with pytest.raises(RecordingError, match=f"log.csv: .* say {said},"):
        check_unit_in_name(target, how, "log.csv")
