"""The reason of a verdict on a spring."""

import numpy as np
import pytest

from sea_ident.estimation.spring_verdict import verdict_of


@pytest.mark.parametrize(
    ("linear", "cubic", "told"),
    [
        (0.0450, 0.0310, "held-out rms falls from 0.045 to 0.031 with the cubic term"),
        (0.004503, 0.004498, "held-out rms falls from 0.004503 to 0.004498 with the cubic term"),
    ],
)
def test_what_falls_is_seen_to_fall(linear, cubic, told):
    held_out = {"linear": linear, "cubic": cubic, "hysteresis": cubic}
    law, std = np.array([200.0, 45.0, 0.8]), np.array([0.05, 1.0, 1e-3])
    verdict, reason = verdict_of(law, std, 30.0, held_out, "0.01 rad", 3.0)
    assert (verdict, reason) == ("stiffening", told)
