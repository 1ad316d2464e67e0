"""Where a motor stands: what stays uncompared beside a reversal."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.measured.data import EquationKind
from sea_ident.discrepancy.measured.standing import (
    BESIDE_REVERSALS,
    compared_beside_reversals,
    longest_standing,
    no_slower_than,
)


def test_what_stands_stays_out_and_what_is_only_slow_is_compared(jittery):
    data = jittery
    near = compared_beside_reversals(data)
    assert near.caution == BESIDE_REVERSALS
    assert not np.any(near.left_out & ~data.left_out)
    for e, equation in enumerate(data.equations):
        if equation.kind is EquationKind.LINK:
            assert np.array_equal(near.left_out[:, e], data.left_out[:, e])
            continue
        speed = data.motion.dtheta[:, equation.index]
        noise = np.median(np.std([m.dtheta[:, equation.index] for m in data.period_motions], axis=0, ddof=1))
        assert np.all(near.left_out[np.abs(speed) < 2.0 * noise, e])
        for turn in np.flatnonzero(np.diff(np.sign(speed))):
            # the samples to both sides of the turn, and two further on only where they stand
            assert np.all(near.left_out[[turn, turn + 1], e])
            beyond = np.array([turn - 1, turn + 2])
            assert np.array_equal(near.left_out[beyond, e], np.abs(speed[beyond]) < 2.0 * noise)
        assert np.mean(near.left_out[:, e]) < 0.8 * np.mean(data.left_out[:, e])


def test_the_joint_of_which_most_is_not_compared(jittery):
    data = jittery
    found = longest_standing(data)
    motors = {eq.joint: e for e, eq in enumerate(data.equations) if eq.kind is EquationKind.MOTOR}
    shares = {joint: np.mean(data.left_out[:, e]) for joint, e in motors.items()}
    assert found.share == max(shares.values()) == shares[found.joint]
    index = data.robot.index(found.joint)
    rows = data.left_out[:, motors[found.joint]]
    assert np.all(np.abs(data.motion.dtheta[rows, index]) <= found.speed)
    assert found.speed in np.abs(data.motion.dtheta[rows, index])


@pytest.mark.parametrize(("share", "out"), [(0.4, True), (0.7, False)])
def test_what_is_slower_than_all_that_another_recording_compares_is_left_out(jittery, share, out):
    """Where that leaves something to compare; of links, which have no friction there, nothing."""
    data = jittery
    left_out = data.left_out.copy()
    limits = {}
    for e, equation in enumerate(data.equations):
        if equation.kind is not EquationKind.LINK:
            speed = np.abs(data.motion.dtheta[:, equation.index])
            limits[e] = float(np.quantile(speed, share))
            left_out[:, e] |= speed < limits[e]
    found = no_slower_than(data, replace(data, left_out=left_out))
    for e, equation in enumerate(data.equations):
        expected = data.left_out[:, e]
        if out and e in limits:
            expected = expected | (np.abs(data.motion.dtheta[:, equation.index]) < limits[e])
        assert np.array_equal(found.left_out[:, e], expected)
