"""Half-spaces and self-collision: rooms, slopes, proofs and designs, against Pinocchio's own collision geometry."""

import pickle
import re
import warnings
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import nnls

from sea_ident.exceptions import ExcitationError, InfeasibleError, RobotError, SeaIdentWarning
from sea_ident.excitation import Ramp, design_excitation, read_excitation, sample_trajectory
from sea_ident.excitation.curvature_bounds import MotionBounds
from sea_ident.excitation.space_limits import space_limits
from sea_ident.excitation.space_proof import TOLERANCE, proven_rooms
from sea_ident.motion import FourierSeries
from sea_ident.robot import HalfSpace, SelfCollision, example_robots_folder, load_robot, robot_from_text

SMALL = {"harmonics": 3, "starts": 1, "rate": 50.0, "jobs": 1}
UR10 = "ur_description/urdf/ur10_robot.urdf"
ARM = """<robot name="arm">
  <link name="base"><collision><origin xyz="0 0 -0.1"/><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="upper"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.5 0 0"/><geometry><box size="0.8 0.1 0.1"/></geometry></collision></link>
  <link name="lower"><inertial><origin xyz="0.4 0 0"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="hand"><inertial><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.07"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 -1 0"/>
    <limit lower="-3" upper="3" velocity="2" effort="200"/></joint>
  <joint name="elbow" type="revolute"><origin xyz="1 0 0"/><parent link="upper"/><child link="lower"/>
    <axis xyz="0 -1 0"/><limit lower="-2.9" upper="2.9" velocity="2" effort="200"/></joint>
  <joint name="tip" type="fixed"><origin xyz="0.8 0 0"/><parent link="lower"/><child link="hand"/></joint>
  %s
</robot>"""


def arm(more=""):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return robot_from_text(ARM % more, "arm.urdf")


def half_space(link="hand", normal=(0.0, 0.0, -1.0), offset=0.3, point=(0.0, 0.0, 0.0), name="floor"):
    return HalfSpace(name, link, np.array(normal), offset, np.array(point))


def design(robot, **changes):
    limits = robot.limits.replace(**changes)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return design_excitation(robot, limits=limits, **SMALL)


@pytest.fixture(scope="module")
def crowded(robot_of):
    """UR10 with a joint range of a full turn, and what it has to keep clear of."""
    robot = robot_of("ur10")
    limits = robot.limits.replace(
        lower=np.maximum(robot.limits.lower, -np.pi),
        upper=np.minimum(robot.limits.upper, np.pi),
        torque=np.full(6, np.inf),
    )
    clear = limits.replace(
        half_spaces=(
            half_space("ee_link", (0.0, 0.0, -2.0), -0.2, name="table"),
            half_space("wrist_1_link", (0.0, 1.0, 0.0), 0.8, (0.0, 0.05, 0.0), name="wall"),
        ),
        self_collision=SelfCollision(0.04),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        free = design_excitation(robot, limits=limits, **SMALL)
        kept = design_excitation(robot, limits=clear, **SMALL)
    return robot, clear, free, kept


def pinocchio_geometry(robot, path, pairs, hulls=True):
    """The collision geometry as Pinocchio reads it, meshes by their hulls, and one pair of bodies for each of links."""
    folder = str(example_robots_folder().parent.parent)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = pin.buildModelFromUrdf(str(example_robots_folder() / path))
        geometry = pin.buildGeomFromUrdf(model, str(example_robots_folder() / path), pin.GeometryType.COLLISION, folder)
    assert list(model.names)[1:] == list(robot.joint_names)
    by_link = {}
    for k, item in enumerate(geometry.geometryObjects):
        by_link.setdefault(model.frames[item.parentFrame].name, []).append(k)
        if hulls and isinstance(item.geometry, coal.BVHModelBase):
            item.geometry.buildConvexHull(True, "Qt")
            item.geometry = item.geometry.convex
    for a, b in pairs:
        for i in by_link[a]:
            for k in by_link[b]:
                geometry.addCollisionPair(pin.CollisionPair(i, k))
    return model, geometry


def watched(excitation):
    found = [name.removesuffix(".distance").split(" - ") for name in excitation.margins if name.endswith(".distance")]
    return {tuple(pair): excitation.limits[" - ".join(pair) + ".distance"][0] for pair in found}


def smallest(model, geometry, q):
    """Least distance of every pair over samples."""
    data, placed = model.createData(), pin.GeometryData(geometry)
    least = np.full(len(geometry.collisionPairs), np.inf)
    for x in q:
        pin.computeDistances(model, data, geometry, placed, x)
        least = np.minimum(least, [result.min_distance for result in placed.distanceResults])
    return least


@pytest.mark.scenario
def test_design_keeps_clear_at_all_times(crowded):
    """On a grid fifty times finer than the samples, with Pinocchio's kinematics, geometry and distances."""
    robot, _, free, kept = crowded
    pairs = watched(kept)
    model, geometry = pinocchio_geometry(robot, UR10, pairs)
    assert len(geometry.collisionPairs) == len(pairs) == 20
    time = np.linspace(0.0, 10.0, 50 * 500 + 1)
    least = smallest(model, geometry, kept.series.evaluate(time))
    margins = np.array([kept.margins[" - ".join(pair) + ".distance"] for pair in pairs])
    assert min(kept.margins.values()) >= 0.0
    # what is reported is kept, and near the limit it is no more than the tolerance below the truth
    assert np.all(least - np.array(list(pairs.values())) >= margins)
    tight = margins < 0.01
    assert np.any(tight)
    size = space_limits(robot, crowded[1], []).size
    np.testing.assert_allclose(least[tight] - np.array(list(pairs.values()))[tight], margins[tight], atol=1.2e-3 * size)
    # without the limits it would have collided
    assert smallest(model, geometry, free.series.evaluate(time[::100])).min() <= 0.0


@pytest.mark.scenario
def test_meshes_are_no_nearer_than_their_hulls(crowded):
    robot, _, _, kept = crowded
    pairs = watched(kept)
    model, geometry = pinocchio_geometry(robot, UR10, pairs, hulls=False)
    least = smallest(model, geometry, kept.series.evaluate(np.linspace(0.0, 10.0, 41)))
    assert np.all(least >= np.array(list(pairs.values())))


@pytest.mark.scenario
def test_points_stay_on_their_side_at_all_times(crowded):
    _, _, free, kept = crowded
    model = pin.buildModelFromUrdf(str(example_robots_folder() / UR10))
    data = model.createData()

    def lowest(excitation):
        table, wall = np.inf, -np.inf
        for x in excitation.series.evaluate(np.linspace(0.0, 10.0, 50 * 500 + 1)):
            pin.framesForwardKinematics(model, data, x)
            table = min(table, data.oMf[model.getFrameId("ee_link")].translation[2])
            wrist = data.oMf[model.getFrameId("wrist_1_link")]
            wall = max(wall, wrist.act(np.array([0.0, 0.05, 0.0]))[1])
        return table - 0.1, 0.8 - wall

    rooms, margins = lowest(kept), [kept.margins["table (ee_link)"], kept.margins["wall (wrist_1_link)"]]
    assert np.all(np.array(rooms) >= margins)
    assert min(margins) >= 0.0
    assert min(lowest(free)) < -0.1
    assert kept.limits["table (ee_link)"] == (-np.inf, -0.1)  # the normal had length 2


@pytest.mark.scenario
def test_result_says_it_all(crowded, tmp_path):
    kept = crowded[3]
    text = kept.summary()
    assert "table (ee_link)" in text
    assert "more pairs of links" in text
    neighbours = next(note for note in kept.warnings if "neighbours" in note)
    assert "base_link - shoulder_link" in neighbours
    assert any("watched for contact only" in note for note in kept.warnings)
    kept.save(tmp_path / "e.json")
    again = read_excitation(tmp_path / "e.json")
    assert again.margins == kept.margins
    assert again.limits == kept.limits
    assert kept.limits["forearm_link - wrist_3_link.distance"] == (0.04, np.inf)


def test_rooms_of_an_arm_are_those_of_a_drawing():
    """Two bars in a plane: where the hand is, and how far its ball is from that of the base and from the upper bar."""
    robot = arm()
    limits = robot.limits.replace(
        half_spaces=(half_space(offset=0.3), half_space("lower", (3.0, 0.0, 4.0), 5.0, (0.2, 0.0, 0.1))),
        self_collision=SelfCollision(0.05),
    )
    space = space_limits(robot, limits, [])
    assert space.names == ("floor (hand)", "floor (lower)", "base - hand.distance")
    q = np.random.default_rng(0).uniform((-3.0, 2.3), (3.0, 3.0), (200, 2))
    turn = q.cumsum(axis=1)
    elbow = np.column_stack([np.cos(turn[:, 0]), np.sin(turn[:, 0])])
    along = np.column_stack([np.cos(turn[:, 1]), np.sin(turn[:, 1])])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    hand, point = elbow + 0.8 * along, elbow + 0.2 * along + 0.1 * across
    rooms = space.rooms(q)
    np.testing.assert_allclose(rooms[:, 0], 0.3 + hand[:, 1], atol=1e-12)
    np.testing.assert_allclose(rooms[:, 1], 1.0 - point @ [0.6, 0.8], atol=1e-12)
    apart = np.linalg.norm(hand - [0.0, -0.1], axis=1) - 0.17 - 0.05 - 1e-5
    np.testing.assert_allclose(rooms[:, 2], np.minimum(apart, space.reach), atol=1e-6)
    assert 20 < np.count_nonzero(apart < space.reach) < 180


def specimens(robot_of):
    yield arm(), (half_space(),), None
    yield robot_of("ur10"), (half_space("ee_link", (0.3, 0.4, -1.0), 0.2, (0.1, 0.2, 0.3)),), UR10
    yield robot_of("tiago"), (half_space("arm_1_link", (1.0, 1.0, 1.0), 2.0, (0.1, 0.0, 0.0)),), None
    yield robot_of("panda"), (half_space("panda_leftfinger", (0.0, 0.0, 1.0), 1.5),), None


def build_space(robot, planes, distance=0.01):
    collision = SelfCollision(distance) if robot.name != "tiago" else None
    return space_limits(robot, robot.limits.replace(half_spaces=planes, self_collision=collision), [])


def test_distances_of_hulls_are_those_of_a_quadratic_program(robot_of):
    """min |x - y| over convex combinations of vertices, for the nearest pairs of UR10 in random positions."""
    robot = robot_of("ur10")
    space = build_space(robot, ())
    q = np.random.default_rng(4).uniform(-2.0, 2.0, (6, 6))
    rooms, poses = space.rooms(q), space.chain.at(q)
    near = np.argwhere((rooms > 0.01) & (rooms < 0.9 * space.reach))
    assert len(near) > 10
    for m, k in near:
        (pair,) = (pair for pair, limit in zip(space.pairs, space.members, strict=True) if limit == k)
        first, second = (
            shape.vertices @ poses.rotations[shape.body, m].T + poses.positions[shape.body, m]
            for shape in (space.shapes[pair.first], space.shapes[pair.second])
        )
        stacked = np.vstack([first, -second])
        owner = np.repeat(np.eye(2), [len(first), len(second)], axis=0)
        # one squared penalty for each sum of weights turns the program into non-negative least squares
        weights, _ = nnls(np.vstack([stacked.T, 1e4 * owner.T]), np.array([0.0, 0.0, 0.0, 1e4, 1e4]))
        distance = float(np.linalg.norm(weights @ stacked))
        assert rooms[m, k] + space.least[k] == pytest.approx(distance, abs=3e-5)


def test_slopes_match_central_differences(robot_of):
    rng = np.random.default_rng(1)
    compared = {}
    for robot, planes, _ in specimens(robot_of):
        space = build_space(robot, planes)
        q = rng.uniform(-2.5, 2.5, (60, robot.n))
        slopes, rooms = space.slopes(q), space.rooms(q)
        step = 1e-5
        for i in range(robot.n):
            ahead, behind = (space.rooms(q + sign * step * np.eye(robot.n)[i]) for sign in (1.0, -1.0))
            forward, backward = (ahead - rooms) / step, (rooms - behind) / step
            # where the nearest corner changes there is no slope
            smooth = (np.abs(forward - backward) < 1e-2) & (rooms < 0.999 * space.reach) & (rooms > 1e-3)
            smooth[:, : len(planes)] = True
            np.testing.assert_allclose(slopes[:, :, i][smooth], (0.5 * (forward + backward))[smooth], atol=5e-3)
            exact = 0.5 * (forward + backward)[:, : len(planes)]
            np.testing.assert_allclose(slopes[:, : len(planes), i], exact, atol=1e-8)
            compared[robot.name] = compared.get(robot.name, 0) + int(smooth[:, len(planes) :].sum())
    assert min(compared["ur10"], compared["panda"]) > 50


def test_rooms_change_no_faster_than_their_levers_allow(robot_of):
    rng = np.random.default_rng(2)
    for robot, planes, _ in specimens(robot_of):
        space = build_space(robot, planes)
        series = FourierSeries(0.1, 0.3 * rng.normal(size=robot.n), *(0.3 * rng.normal(size=(2, robot.n, 3))))
        bounds = MotionBounds.of(series)
        levers = space.levers(bounds.derivatives[0]) @ np.abs(space.chain.map)
        time = np.linspace(0.0, 10.0, 2001)
        step = time[1]
        motion = series.motion(time)
        change = np.abs(np.diff(space.rooms(motion.q), axis=0))
        speed = np.maximum(np.abs(motion.dq[:-1]), np.abs(motion.dq[1:])) + step * bounds.derivatives[2]
        assert np.all(change <= step * speed @ levers.T + 1e-6)
        # and they are levers, not just large numbers
        assert (change / (step * speed @ levers.T + 1e-9)).max() > 0.2


@pytest.mark.scenario
def test_proof_is_a_lower_bound_and_tight_near_the_limit(robot_of):
    rng = np.random.default_rng(3)
    for robot, planes, _ in specimens(robot_of):
        space = build_space(robot, planes, 0.03)
        for size in (0.05, 0.3):
            series = FourierSeries(0.1, size * rng.normal(size=robot.n), *(size * rng.normal(size=(2, robot.n, 3))))
            proven = proven_rooms(space, series.motion, 10.0, MotionBounds.of(series))
            seen = space.rooms(series.evaluate(np.linspace(0.0, 10.0, 3001))).min(axis=0)
            assert np.all(proven <= seen)
            near = seen < 0.02 * space.size
            np.testing.assert_allclose(proven[near], seen[near], atol=2.0 * TOLERANCE * space.size)
            assert np.all(proven[~near] > 0.019 * space.size)


def test_cylinders_are_prisms_around_them(robot_of):
    """exo_leg is made of cylinders and boxes: never farther than the truth, and within 1 % of their radius."""
    robot = robot_of("exo_leg")
    notes = []
    space = space_limits(robot, robot.limits.replace(self_collision=SelfCollision(0.0)), notes)
    model = pin.buildModelFromUrdf(str(Path(__file__).parents[2] / "robots/exo_leg/exo_leg.urdf"))
    geometry = pin.buildGeomFromUrdf(
        model, str(Path(__file__).parents[2] / "robots/exo_leg/exo_leg.urdf"), pin.GeometryType.COLLISION
    )
    links = [model.frames[item.parentFrame].name for item in geometry.geometryObjects]
    assert space.names == ("hip_base - shank.distance", "hip_base - foot.distance", "thigh - foot.distance")
    for name in space.names:
        a, b = name.removesuffix(".distance").split(" - ")
        geometry.addCollisionPair(pin.CollisionPair(links.index(a), links.index(b)))
    q = np.random.default_rng(0).uniform(-2.6, 2.6, (300, 3))
    data, placed = model.createData(), pin.GeometryData(geometry)
    for rooms, x in zip(space.rooms(q), q, strict=True):
        pin.computeDistances(model, data, geometry, placed, x)
        truth = np.minimum([result.min_distance for result in placed.distanceResults], space.reach)
        assert np.all((rooms <= truth + 1e-9) & (rooms >= truth - 2e-3) | (truth <= 0.0))
        assert np.all((rooms <= 0.0) | (truth > 0.0))


def test_ramps_keep_clear_too():
    robot = arm()
    limits = robot.limits.replace(half_spaces=(half_space(offset=0.2),), self_collision=SelfCollision(0.05))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = design_excitation(robot, limits=limits, ramp=Ramp(1.0), **SMALL)
    motion = sample_trajectory(found, 2500.0)
    assert space_limits(robot, limits, []).rooms(motion.q).min() >= 0.0


def test_starts_in_other_processes(robot_of):
    """What a limit needs travels, after it has been used as well."""
    robot = robot_of("ur10")
    space = build_space(robot, ())
    q = np.zeros((1, 6))
    before = space.rooms(q)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(space)).rooms(q), before)


ANNOTATED = """
  <transmission name="floor" type="sea_ident/HalfSpace">
    <link name="hand" xyz="0 0 0.05"/><link name="lower"/><plane normal="0 0 -1" offset="0.25"/>
  </transmission>
  <transmission name="apart" type="sea_ident/SelfCollision">
    <distance>0.03</distance><ignore link1="base" link2="upper"/>
  </transmission>"""


def test_annotation_states_them():
    robot = arm(ANNOTATED)
    first, second = robot.limits.half_spaces
    assert (first.name, first.link, first.offset) == ("floor", "hand", 0.25)
    np.testing.assert_array_equal(first.normal, [0.0, 0.0, -1.0])
    np.testing.assert_array_equal(first.point, [0.0, 0.0, 0.05])
    assert second.link == "lower"
    assert robot.limits.self_collision == SelfCollision(0.03, (("base", "upper"),))
    found = design(robot)
    assert {"floor (hand)", "floor (lower)", "base - hand.distance"} <= set(found.margins)
    assert min(found.margins.values()) >= 0.0


def state(kind, inside):
    return f'<transmission name="x" type="sea_ident/{kind}">{inside}</transmission>'


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (state("HalfSpace", '<link name="hand"/>'), "needs <link"),
        (state("HalfSpace", '<plane normal="0 0 1" offset="0"/>'), "needs <link"),
        (state("HalfSpace", '<link name="hand"/><plane offset="1"/>'), "has no normal"),
        (state("HalfSpace", '<link name="hand"/><plane normal="0 0 0" offset="1"/>'), "normal of its <plane> is zero"),
        (state("HalfSpace", '<link name="hand"/><plane normal="0 0 1"/>'), "no attribute 'offset'"),
        (state("HalfSpace", '<link name="hand"/><plane normal="0 0 nan" offset="1"/>'), "not three finite numbers"),
        (state("HalfSpace", '<link name="foot"/><plane normal="0 0 1" offset="1"/>'), "link 'foot', which is not in"),
        (state("SelfCollision", "<distance>wide</distance>"), "'wide', not a number"),
        (state("SelfCollision", "<distance>-1</distance>"), "finite and not negative"),
        (state("SelfCollision", '<ignore link1="hand"/>'), "link '', which is not in"),
        (2 * state("SelfCollision", ""), "is the second"),
    ],
)
def test_annotation_that_cannot_be_used(more, says):
    with pytest.raises(RobotError, match=says):
        arm(more)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"half_spaces": (half_space("foot"),)}, "no link 'foot'; its links: base, upper, lower, hand"),
        ({"half_spaces": (half_space("base", offset=-0.5),)}, "'base' never moves; its point is 0.5 m outside"),
        ({"half_spaces": (half_space(normal=(0.0, 0.0, 0.0)),)}, "normal is zero"),
        ({"half_spaces": (half_space(offset=np.nan),)}, "finite numbers"),
        ({"half_spaces": (half_space(normal=(1.0, 0.0)),)}, "finite numbers"),
        ({"self_collision": SelfCollision(np.nan)}, "distance is nan m"),
        ({"self_collision": SelfCollision(-0.1)}, "distance is -0.1 m"),
        ({"self_collision": SelfCollision(0.1, (("hand", "foot"),))}, "no link 'foot' to ignore"),
    ],
)
def test_limits_that_cannot_be_used(changes, says):
    with pytest.raises(ExcitationError, match=says):
        design(arm(), **changes)


@pytest.mark.scenario
def test_what_nobody_can_keep_is_said_with_plane_and_numbers():
    with pytest.raises(InfeasibleError, match=r"floor \(hand\): n . p = .* m with n = \[0.0, 0.0, 1.0\], at most -3 m"):
        design(arm(), half_spaces=(half_space(normal=(0.0, 0.0, 1.0), offset=-3.0),))
    # the hand near the base, and far from it; the wall far away has no part in it
    near = tuple(half_space(normal=sign * np.eye(3)[axis], offset=0.3) for sign in (1.0, -1.0) for axis in (0, 2))
    away = half_space("lower", (1.0, 0.0, 0.0), 5.0, name="wall")
    with pytest.raises(InfeasibleError, match=r"base - hand.distance: 0\.\d+ m apart, at least 0.6 m") as caught:
        design(arm(), half_spaces=(*near, away), self_collision=SelfCollision(0.6))
    text = str(caught.value)
    assert "floor (hand)" in text
    assert "wall" not in text
    # what only a small part of all positions keeps is found
    assert min(design(arm(), half_spaces=near, self_collision=SelfCollision(0.2)).margins.values()) >= 0.0


def test_start_outside_is_moved_inside_and_the_limits_are_named():
    robot = arm()
    limits = robot.limits.replace(half_spaces=(half_space(offset=0.2),))
    start = np.zeros((2, 7))
    start[:, -1] = (-1.5, 0.0)  # hanging down
    start[:, 0] = 0.1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = design_excitation(robot, limits=limits, start=start, **SMALL)
    note = next(note for note in found.warnings if "outside" in note)
    assert re.search(r"outside the limits; it was moved inside: floor \(hand\) by 1\.6\d* m$", note), note
    assert min(found.margins.values()) >= 0.0


def test_robots_whose_geometry_cannot_be_used():
    for old, new, says in (
        ("<collision>", "<other>", "no link has a <collision>"),
        ('<sphere radius="0.07"/>', '<mesh filename="hand.stl"/>', "link 'hand': there is no file 'hand.stl'"),
        ('<sphere radius="0.07"/>', '<box size="0.1 nan 0.1"/>', "not finite"),
    ):
        text = (ARM % "").replace(old, new).replace("</collision>", "</other>" if new == "<other>" else "</collision>")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            robot = robot_from_text(text, "arm.urdf")
        with pytest.raises(ExcitationError, match=says):
            design(robot, self_collision=SelfCollision())


def test_mesh_that_is_none(tmp_path):
    (tmp_path / "hand.stl").write_bytes(b"no mesh")
    text = (ARM % "").replace('<sphere radius="0.07"/>', '<mesh filename="hand.stl"/>')
    (tmp_path / "arm.urdf").write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        robot = load_robot(tmp_path / "arm.urdf")
    with pytest.raises(ExcitationError, match=r"hand.stl"):
        design(robot, self_collision=SelfCollision())
