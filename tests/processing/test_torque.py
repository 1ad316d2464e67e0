"""Doubts of a motor torque, in words."""

import numpy as np
import pytest

from sea_ident.processing.torque import torque_source
from sea_ident.recordings import Recording


@pytest.mark.parametrize(("places", "said"), [([120], "has 1 spike,"), ([120, 300], "has 2 spikes,")])
def test_spikes_are_counted_and_told_with_what_identify_can_do(leg, places, said):
    time = np.arange(500) * 0.01
    columns = {f"tau_motor_{name}": np.sin(3.0 * time) for name in leg.joint_names}
    columns["tau_motor_knee"] = columns["tau_motor_knee"].copy()
    columns["tau_motor_knee"][places] += 40.0
    (text,) = torque_source(Recording(time, columns, "leg.csv"), leg).warnings
    assert f"column tau_motor_knee {said} the first at sample 120 (time 1.2 s)" in text
    assert "identify with the robust estimator" in text  # a diagnosis relays it, and has no estimator
