"""A joint that is elsewhere: the columns are what the bodies need more, and nothing that other parameters would do."""

from pathlib import Path

import numpy as np
import pytest

from sea_ident.base_parameters import random_motion
from sea_ident.effects import Anchor, State, base_effects, make_effect
from sea_ident.effects.joint_placement import JointPlacement
from sea_ident.exceptions import EffectError
from sea_ident.regressor import build_regressor
from sea_ident.robot import load_robot

ROBOTS = Path(__file__).parents[1] / "benchmarks" / "hidden_effects" / "robots"
NAMES = ("exo_leg", "oblique_arm", "torso", "prosthesis")


@pytest.fixture(scope="module", params=NAMES)
def robot(request):
    file = ROBOTS / f"{request.param}.urdf"
    return load_robot(file if file.exists() else request.param)


def test_columns_are_what_the_bodies_need_more(robot):
    """Exactly, for a way of any length: the difference of the torques of two robots."""
    motion, rng = random_motion(robot, 20, 1), np.random.default_rng(2)
    state = State(robot, motion)
    places = JointPlacement.instances(robot)
    assert places
    for place in places:
        values = rng.normal(0.0, 0.2, len(place.columns(robot)))
        anchored = place.anchored(
            Anchor(
                robot,
                (),
                {
                    **dict(zip(robot.inertial_names, robot.inertial_parameters, strict=True)),
                    **{c.name: v for c, v in zip(place.columns(robot), values, strict=True)},
                },
            )
        )
        rows = anchored.evaluate(state)
        moved = anchored.modified(robot, values)
        more = State(moved, motion).body_torque(robot.inertial_parameters) - state.body_torque(
            robot.inertial_parameters
        )
        np.testing.assert_allclose(rows.link @ values, more, atol=1e-9 * np.abs(more).max())
        assert not np.any(rows.motor)
        np.testing.assert_allclose(
            anchored.followed(state, values) @ robot.inertial_parameters, more, atol=1e-9 * np.abs(more).max()
        )


def test_bodies_are_shared_out_as_the_columns_have_it(robot):
    """A model knows its bodies in sums, which hold where the joint is described to be."""
    motion, rng = random_motion(robot, 20, 1), np.random.default_rng(5)
    state = State(robot, motion)
    # the same sums, otherwise shared out: what no motion shows of the bodies
    large = State(robot, random_motion(robot, 300, 6)).body_regressor.reshape(300 * robot.n, -1)
    _, sizes, ways = np.linalg.svd(large, full_matrices=True)
    unseen = ways[np.sum(sizes > 1e-9 * sizes[0]) :]
    own = robot.inertial_parameters
    other = own + 0.02 * np.linalg.norm(own) * rng.normal(size=len(unseen)) @ unseen
    for place in JointPlacement.instances(robot):
        values = rng.normal(0.0, 0.1, len(place.columns(robot)))
        known = dict(zip(robot.inertial_names, other, strict=True))
        names = [column.name for column in place.columns(robot)]
        anchored = place.anchored(Anchor(robot, (), {**known, **dict(zip(names, values, strict=True))}))
        torque = state.body_torque(own) + anchored.evaluate(state).link @ values
        moved = anchored.modified(robot, values)
        simulated = State(moved, motion).body_torque(moved.inertial_parameters)
        np.testing.assert_allclose(simulated, torque, atol=1e-7 * np.abs(torque).max())
        # which it is not by the bodies as they are
        as_they_are = State(moved, motion).body_torque(own)
        if np.abs(as_they_are - torque).max() > 1e-6 * np.abs(torque).max():
            assert np.abs(moved.inertial_parameters - own).max() > 1e-6


def test_what_other_parameters_would_do_has_no_column(robot):
    """And what has one is told apart from all bodies, rotors and frictions."""
    motion = random_motion(robot, 400, 3)
    state, inertial = State(robot, motion), tuple(np.random.default_rng(4).normal(size=10 * len(robot.bodies)))
    base = build_regressor(robot, base_effects(robot), motion).sum.reshape(400 * robot.n, -1)
    basis = np.linalg.svd(base / np.maximum(np.linalg.norm(base, axis=0), 1e-12), full_matrices=False)
    basis = basis[0][:, basis[1] > 1e-9 * basis[1][0]]
    for name in robot.joint_names:
        if robot.parents[robot.index(name)] < 0:
            with pytest.raises(EffectError, match=f"joint_placement at '{name}': it is the first joint"):
                JointPlacement(name).directions(robot)
            continue
        place = JointPlacement(name, inertial=inertial)
        ways = place.directions(robot)
        rows = place.evaluate(state).link.reshape(400 * robot.n, -1)
        left = rows - basis @ (basis.T @ rows)
        sizes = np.linalg.svd(left, compute_uv=False) / np.linalg.norm(rows)
        assert np.all(sizes > 1e-5)
        # of the three ways of a joint all others are taken up, or moved the next joint would do the same
        inward = robot.model.jointPlacements[robot.model.getJointId(name)].rotation
        for way in ways.values():
            assert np.linalg.norm(way) == pytest.approx(1.0)
        assert len(ways) in (1, 2)
        assert inward.shape == (3, 3)


def test_the_way_is_told_away_from_the_joint_before(robot):
    for place in JointPlacement.instances(robot):
        model = robot.model
        line = np.array(model.jointPlacements[model.getJointId(place.joint)].translation)
        directions = place.directions(robot)
        if "along" in directions and len(directions) == 2:
            assert directions["along"] @ line >= -1e-12
            assert abs(directions["across"] @ line) < 1e-9 + 1e-6 * np.linalg.norm(line)


def test_a_way_survives_in_a_model(robot):
    place = make_effect("joint_placement", robot.joint_names[-1], shift=(0.1, 0.02))
    assert place.shift == (0.1, 0.02)
    assert "<origin>" in place.reservation
