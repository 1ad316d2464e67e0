"""Margins of links on springs are the smallest distances on a fine grid."""

import numpy as np
import pytest
from soft_arms import soft_arm

from sea_ident.excitation.dynamic_limits import dynamic_limits
from sea_ident.excitation.elastic_limits import ElasticLimits
from sea_ident.excitation.elastic_response import Springs, elastic_response
from sea_ident.excitation.linear_limits import linear_limits
from sea_ident.excitation.space_limits import space_limits
from sea_ident.motion import FourierSeries
from sea_ident.regressor import inverse_dynamics


def limits_of(robot, **changes):
    limits = robot.limits.replace(**changes)
    return ElasticLimits(
        Springs.of(robot),
        linear_limits(robot, limits),
        dynamic_limits(robot, limits, []),
        space_limits(robot, limits, []),
    )


def test_margins_are_smallest_distances():
    arm = soft_arm()
    limits = limits_of(arm, deflection=np.array([0.3, 0.3]))
    coefficients = 0.2 * np.random.default_rng(1).normal(size=(2, 9))
    series = FourierSeries.from_coefficients(coefficients, 0.2)
    margins = dict(zip(limits.names, limits.margins(series), strict=True))
    response = elastic_response(limits.springs, series)
    motion = response.motion(np.linspace(0.0, 5.0, 20_001))
    link, motor = inverse_dynamics(arm, motion)
    torque = np.abs(link + motor + 3.0 * motion.dtheta).max(axis=0)
    for i, name in enumerate(arm.joint_names):
        assert margins[f"{name}.position"] == pytest.approx(
            min(motion.q[:, i].min() + 0.9, 0.7 - motion.q[:, i].max()), abs=1e-6
        )
        assert margins[f"{name}.velocity"] == pytest.approx(1.5 - np.abs(motion.dq[:, i]).max(), abs=1e-5)
        assert margins[f"{name}.acceleration"] == pytest.approx(4.0 - np.abs(motion.ddq[:, i]).max(), abs=1e-4)
        assert margins[f"{name}.torque"] == pytest.approx(60.0 - torque[i], abs=1e-2)
    k1 = limits.springs.stiffness
    bent = np.abs(motion.deflection).max(axis=0)
    for i, name in enumerate(arm.joint_names):
        law = [k1[i] * d + 2.0 * k1[i] * d**3 for d in (0.3, bent[i])]
        assert margins[f"{name}.spring_torque"] == pytest.approx(law[0] - law[1], abs=1e-3)


def test_tightened_limits_leave_a_part_free():
    limits = limits_of(soft_arm())
    series = FourierSeries.from_coefficients(0.1 * np.random.default_rng(1).normal(size=(2, 9)), 0.2)
    wide, narrow = limits.margins(series), limits.tightened(0.1).margins(series)
    taken = dict(zip(limits.names, wide - narrow, strict=True))
    assert taken["elbow.position"] == pytest.approx(0.08)
    assert taken["elbow.acceleration"] == pytest.approx(0.4)
    assert taken["elbow.torque"] == pytest.approx(6.0)
