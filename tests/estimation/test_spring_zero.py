"""A spring that fits badly because its two encoders have different zeros is told with the difference."""

import re

import pytest

from estimation.synthetic import record
from sea_ident.estimation import identify

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
NOISE = {"torque_noise": 0.2, "encoder_noise": 1e-5}


def told(model):
    return [text for text in model.warnings if "zeros of theta_" in text and "that differ by" in text]


@pytest.mark.parametrize("zero", [0.02, 0.3, -0.05])
def test_a_difference_of_zeros_is_told_with_its_size(leg, truth, zero):
    recording = record(leg, truth, 8, **NOISE)
    moved = recording.replace_columns({"theta_knee": recording.columns["theta_knee"] + zero})
    (said,) = told(identify(leg, moved, period=10.0))
    assert float(re.search(r"theta_knee and q_knee that differ by (\S+) rad", said)[1]) == pytest.approx(zero, abs=1e-4)
    assert "--unknown-zero knee" in said
    assert told(identify(leg, moved, period=10.0, unknown_zero=["knee"])) == []


def test_equal_zeros_are_not_told_of(leg, truth):
    assert told(identify(leg, record(leg, truth, 8, **NOISE), period=10.0)) == []


def test_nothing_is_said_of_zeros_where_the_period_is_wrong(leg, truth):
    recording = record(leg, truth, 8, **NOISE)
    moved = recording.replace_columns({"theta_knee": recording.columns["theta_knee"] + 0.3})
    assert told(identify(leg, moved, period=10.0))
    assert told(identify(leg, moved, period=7.3)) == []
