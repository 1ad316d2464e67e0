"""Derivatives of columns that no formula gives: against the columns themselves, in steps along the whole state."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.effects import effect_classes
from sea_ident.excitation.columns import ModelColumns
from sea_ident.excitation.other_columns import STATES
from sea_ident.motion import Motion

SAMPLES = 150
"""More than are evaluated at a time, with all their steps."""

LOADS = ("torque_constant", "load_dependent_friction", "directional_efficiency", "torque_saturation")
WHOLE = ("payload", "base_tilt")


def motion_of(robot, elastic):
    rng = np.random.default_rng(3)
    q, dq, ddq = rng.uniform(-2.0, 2.0, (3, SAMPLES, robot.n))
    time = np.arange(SAMPLES) * 0.01
    if not elastic:
        return Motion.rigid(time, q, dq, ddq)
    bent = rng.uniform(-0.1, 0.1, (3, SAMPLES, robot.n))
    return Motion(time, q, dq, ddq, *(part + more for part, more in zip((q, dq, ddq), bent, strict=True)))


@pytest.mark.parametrize("name", LOADS + WHOLE)
@pytest.mark.parametrize(
    ("robot", "joint", "elastic"),
    [
        ("exo_leg", "knee", True),
        ("ur10", "elbow_joint", False),
        ("tiago", "arm_1_joint", False),
    ],
)
def test_pull_and_slopes_are_those_of_the_columns(robot_of, robot, joint, elastic, name):
    robot = robot_of(robot)
    effect = effect_classes()[name]() if name == "base_tilt" else effect_classes()[name](joint=joint)
    count = len(effect.columns(robot))
    model = ModelColumns(robot, (effect,), np.arange(count), elastic, separate=elastic)
    motion = motion_of(robot, elastic)
    there = model.at(motion)
    rng = np.random.default_rng(4)
    lever = rng.normal(size=(model.rows, count, SAMPLES))
    along = rng.normal(size=(len(STATES) if elastic else 3, SAMPLES, robot.n))

    def moved(steps):
        names = STATES if elastic else STATES[:3]
        changed = {s: getattr(motion, s) + steps * 1e-5 * a for s, a in zip(names, along, strict=True)}
        if not elastic:
            changed |= {f"{of}theta": changed[f"{of}q"] for of in ("", "d", "dd")}
        return model.at(replace(motion, **changed)).columns()

    expected = (moved(1) - moved(-1)) / 2e-5
    states = along.transpose(0, 2, 1).reshape(-1, SAMPLES)
    slopes = there.slopes()
    # of the sign of a speed that is nearly zero the third derivative is large, and few of the speeds are
    off = np.abs(np.einsum("nrks,sn->rkn", slopes, states) - expected).max(axis=(0, 1))
    assert np.quantile(off, 0.9) < 1e-5 * max(1.0, np.abs(expected).max())
    pulled = np.sum(there.pull(lever) * states, axis=0)
    of_slopes = np.einsum("rkn,nrks,sn->n", lever, slopes, states)
    np.testing.assert_allclose(pulled, of_slopes, atol=1e-9 * np.abs(of_slopes).max())
    assert np.any(expected)
