"""The scene of the viewer: triangles in the right place."""

import base64
import warnings

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from scipy.spatial import Delaunay

from sea_ident import load_robot
from sea_ident.exceptions import RobotError, SeaIdentWarning
from sea_ident.report.scene import MOST_FACES, MOST_FRAMES, _parts, build_scene, simplify
from sea_ident.robot import robot_from_text
from sea_ident.robot.geometry import read_geometry


def test_the_foot_hangs_where_forward_kinematics_put_it(leg_model):
    robot = leg_model.robot
    q = np.array([[0.0, 0.0, 0.0], [0.5, -0.3, 0.2]])
    scene = build_scene(robot, np.array([0.0, 1.0]), q, periodic=False)
    # hand-computed: hip at the origin, 0.42 m to the knee and 0.42 m to the ankle; positive turns move forward (+x)
    ankle = scene.poses[:, 2, :, 3]
    np.testing.assert_allclose(ankle[0], [0.0, 0.0, -0.84], atol=1e-12)
    expected = 0.42 * np.array([np.sin(0.5) + np.sin(0.2), 0.0, -np.cos(0.5) - np.cos(0.2)])
    np.testing.assert_allclose(ankle[1], expected, atol=1e-12)


def test_the_parts_of_a_body_have_the_volume_of_its_solids(leg_model):
    scene = build_scene(leg_model.robot, np.array([0.0, 1.0]), np.zeros((2, 3)), periodic=False)
    foot = sum(
        trimesh.Trimesh(part.vertices, part.faces, process=False).volume for part in scene.parts if part.body == 2
    )
    # disc, upright, sole plate and heel cup of the URDF; the disc is a polygon of 36 sides
    polygon = 36 / 2 * np.sin(2 * np.pi / 36) * 0.04**2 * 0.03
    solids = polygon + 0.038 * 0.02 * 0.08 + 0.25 * 0.09 * 0.014 + 0.03 * 0.088 * 0.05
    assert foot == pytest.approx(solids, rel=1e-6)


def test_bounds_hold_every_vertex_of_every_pose(leg_model):
    robot = leg_model.robot
    time = np.linspace(0.0, 1.0, 15)
    q = np.random.default_rng(0).uniform(robot.limits.lower, robot.limits.upper, (15, 3))
    scene = build_scene(robot, time, q, periodic=True)
    low, high = scene.bounds()
    for part in scene.parts:
        for pose in scene.poses[:, max(part.body, 0)]:
            placed = part.vertices if part.body < 0 else part.vertices @ pose[:, :3].T + pose[:, 3]
            assert np.all(placed >= low - 1e-9)
            assert np.all(placed <= high + 1e-9)


def test_long_motions_are_thinned_and_keep_their_period(leg_model):
    time = np.arange(2000) * 0.005
    scene = build_scene(leg_model.robot, time, np.zeros((2000, 3)), periodic=True)
    assert len(scene.poses) <= MOST_FRAMES
    assert scene.period == pytest.approx(10.0)
    record = scene.to_dict()
    poses = np.frombuffer(base64.b64decode(record["poses"]), "<f4")
    assert poses.size == record["frames"] * record["bodies"] * 12


@pytest.mark.filterwarnings("ignore:.*no transmission:sea_ident.exceptions.SeaIdentWarning")
def test_a_robot_of_meshes_is_drawn_with_few_triangles():
    robot = load_robot("example:ur_description/urdf/ur5_robot.urdf")
    scene = build_scene(robot, np.array([0.0, 1.0]), np.zeros((2, robot.n)), periodic=False)
    faces = sum(len(part.faces) for part in scene.parts)
    assert 1000 < faces <= 1.2 * MOST_FACES
    assert all(part.faces.max() < len(part.vertices) < 2**16 for part in scene.parts)
    # the arm at zero lies stretched out along x, about 0.95 m long
    low, high = scene.bounds()
    assert 0.8 < high[0] - low[0] < 1.3


@pytest.mark.filterwarnings("ignore:.*no transmission:sea_ident.exceptions.SeaIdentWarning")
def test_meshes_out_of_reach_become_sticks_to_the_next_joint():
    text = load_robot("example:ur_description/urdf/ur5_robot.urdf").urdf
    robot = robot_from_text(text, "a model file")
    scene = build_scene(robot, np.array([0.0, 1.0]), np.zeros((2, robot.n)), periodic=False)
    assert {part.body for part in scene.parts} == set(range(-1, robot.n))
    model = robot.model
    upper_arm = next(part for part in scene.parts if part.body == 1)
    length = np.linalg.norm(model.jointPlacements[model.getJointId("elbow_joint")].translation)
    reach = np.linalg.norm(upper_arm.vertices, axis=1).max()
    assert length <= reach <= 1.1 * length


def test_simplifying_a_sphere_keeps_its_shape():
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.5)
    vertices, faces = simplify(np.asarray(ball.vertices), np.asarray(ball.faces), 800)
    assert 300 < len(faces) <= 800
    radius = np.linalg.norm(vertices, axis=1)
    assert np.all((radius > 0.44) & (radius < 0.505))
    coarse = trimesh.Trimesh(vertices, faces, process=False)
    assert coarse.volume == pytest.approx(ball.volume, rel=0.12)


def test_frames_of_the_viewer_are_those_of_pinocchio(leg_model):
    robot = leg_model.robot
    q = np.array([[0.3, -0.2, 0.9]])
    scene = build_scene(robot, np.array([0.0]), q, periodic=False)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q[0])
    for k in range(3):
        np.testing.assert_allclose(scene.poses[0, k, :, :3], data.oMi[k + 1].rotation, atol=1e-12)
        np.testing.assert_allclose(scene.poses[0, k, :, 3], data.oMi[k + 1].translation, atol=1e-12)


def test_shapes_that_cannot_be_read_are_sticks(leg_model):
    damaged = robot_from_text(leg_model.robot.urdf.replace('<box size="', '<box size="thick '), "damaged")
    with pytest.raises(RobotError, match="damaged: its shapes cannot be read"):
        read_geometry(damaged.urdf, damaged.source)
    scene = build_scene(damaged, np.array([0.0, 1.0]), np.zeros((2, 3)), periodic=False)
    assert [part.body for part in scene.parts] == [0, 1, 2]


def test_sticks_hang_together_at_branches_and_slides():
    """Without any visual, every joint begins inside a stick of the body that carries it, in every pose."""
    box = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    limit = '<limit lower="-0.2" upper="0.3" velocity="1" effort="1"/>'

    def joint(name, kind, parent, child, xyz):
        return (
            f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}" rpy="0.3 -0.2 0.5"/><parent link="{parent}"/>'
            f'<child link="{child}"/><axis xyz="0 0.6 0.8"/>{limit}</joint>'
        )

    text = '<robot name="r">' + "".join(f'<link name="{n}">{box}</link>' for n in "abcde")
    text += joint("one", "revolute", "a", "b", "0.1 0.2 0.3") + joint("two", "prismatic", "b", "c", "0.4 0 0.1")
    text += (
        joint("three", "revolute", "b", "d", "0 -0.3 0.2") + joint("four", "revolute", "c", "e", "0 0 0.3") + "</robot>"
    )
    with pytest.warns(SeaIdentWarning, match="no transmission"):
        robot = robot_from_text(text, "r.urdf")
    q = np.random.default_rng(1).uniform(-0.19, 0.29, (5, 4))
    scene = build_scene(robot, np.arange(5.0), q, periodic=False)
    for k in range(5):
        for body in range(4):
            parent = robot.model.parents[body + 1] - 1
            place = np.eye(3, 4) if parent < 0 else scene.poses[k, parent]
            inside = place[:, :3].T @ (scene.poses[k, body, :, 3] - place[:, 3])
            hulls = [Delaunay(part.vertices) for part in scene.parts if part.body == parent]
            assert any(hull.find_simplex(inside, tol=1e-6) >= 0 for hull in hulls), (k, body)


def test_a_link_that_carries_the_name_of_a_joint_is_drawn():
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    box = '<visual><geometry><box size="0.1 0.2 0.3"/></geometry></visual>'
    links = f'<link name="base"/><link name="arm">{inertial}{box}</link>'
    joint = '<joint name="arm" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>'
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        robot = robot_from_text(f'<robot name="twice">{links}{joint}</robot>', "twice.urdf")
    (part,) = (part for part in _parts(robot) if part.body == 0)
    assert np.ptp(part.vertices, axis=0) == pytest.approx([0.1, 0.2, 0.3])
