"""The robots that ship with sea_ident: their files say what they claim, and load."""

import math
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from lxml import etree

from sea_ident.exceptions import SeaIdentWarning
from sea_ident.robot import Robot, example_robots_folder, load_robot, robots_folder

ROBOTS = {
    "exo_leg": ("hip", "knee", "ankle"),
    "exo_leg_link_friction": ("hip", "knee", "ankle"),
    "exo_leg_abduction": ("hip_abduction", "hip", "knee", "ankle"),
    "emps": ("slider",),
    "quanser_2dof": ("stage1", "stage2"),
    "hebi_x5": ("output",),
}
BAXTER = "baxter_description/urdf/baxter.urdf"
BAXTER_JOINTS = tuple(f"{side}_{j}" for side in ("left", "right") for j in ("s0", "s1", "e0", "e1", "w0", "w1", "w2"))
FRAGMENTS = {
    "baxter_sea": (BAXTER, BAXTER_JOINTS),
    "baxter_tilted": (BAXTER, BAXTER_JOINTS),
    "centauro_sea": (
        "centauro_description/urdf/centauro.urdf",
        tuple(f"j_arm{arm}_{k}" for arm in (1, 2) for k in range(1, 7)),
    ),
    "anymal_b_sea": (
        "anymal_b_simple_description/robots/anymal.urdf",
        tuple(f"{leg}_{j}" for leg in ("LF", "LH", "RF", "RH") for j in ("HAA", "HFE", "KFE")),
    ),
    "icub_sea": ("icub_description/robots/icub.urdf", ("l_knee", "l_ankle_pitch", "r_knee", "r_ankle_pitch")),
}
LEGS = ("exo_leg", "exo_leg_link_friction", "exo_leg_abduction")
GRAVITY = 9.81


def file_of(name: str) -> Path:
    (path,) = robots_folder().glob(f"*/{name}.urdf")
    return path


def tree_of(name: str) -> etree._Element:
    return etree.parse(str(file_of(name))).getroot()


def load(name: str) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)  # a robot without transmissions says that it is rigid
        return load_robot(name)


def load_annotated(name: str) -> Robot:
    source, joints = FRAGMENTS[name]
    return load_robot(f"example:{source}", name, joints)


def pinocchio_model(name: str) -> pin.Model:
    return pin.buildModelFromUrdf(str(file_of(name)))


def axis_in_carrier(robot: Robot, joint: str, carrier: str) -> np.ndarray:
    """Axis of a joint in the frame of the link that carries its motor, at q = 0, by Pinocchio's frames."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, pin.neutral(robot.model))
    index = robot.model.getJointId(joint)
    column = pin.computeJointJacobian(robot.model, data, pin.neutral(robot.model), index)[3:]
    axis = data.oMi[index].rotation @ column[:, robot.model.joints[index].idx_v]
    return data.oMf[robot.model.getFrameId(carrier)].rotation.T @ axis


def test_every_file_is_covered_here() -> None:
    stems = {path.stem for path in robots_folder().glob("*/*.urdf")}
    assert stems == set(ROBOTS) | set(FRAGMENTS)


@pytest.mark.parametrize("name", [*ROBOTS, *FRAGMENTS])
def test_files_are_plain_ascii_xml_with_unit_axes_and_a_comment_on_sources(name: str) -> None:
    text = file_of(name).read_bytes()
    assert text.isascii()
    assert b"assumption" in text
    for element in tree_of(name).iter("axis", "rotorAxis"):
        assert np.linalg.norm([float(v) for v in element.get("xyz").split()]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_robot_loads_with_its_joints(name: str) -> None:
    robot = load(name)
    assert robot.name == name
    assert robot.joint_names == ROBOTS[name]
    assert robot.elastic == (name != "emps",) * robot.n
    assert np.all(robot.limits.lower < robot.limits.upper)
    assert np.all(np.isfinite(robot.limits.velocity))


@pytest.mark.parametrize("name", ROBOTS)
def test_every_link_is_a_body_that_can_exist(name: str) -> None:
    for inertia in list(pinocchio_model(name).inertias)[1:]:
        small, middle, large = np.linalg.eigvalsh(inertia.inertia)
        assert inertia.mass > 0.0
        assert small > 0.0
        assert small + middle >= large * (1 - 1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_drawn_with_primitive_shapes_only(name: str) -> None:
    root = tree_of(name)
    assert not list(root.iter("mesh"))
    for link in root.findall("link"):
        assert link.find("visual") is not None, link.get("name")


# -- exoskeleton leg ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", LEGS)
def test_leg_inertias_are_those_of_the_solids_that_are_drawn(name: str) -> None:
    for link in tree_of(name).findall("link"):
        total = pin.Inertia.Zero()
        for visual in link.findall("visual"):
            mass = float(visual.getchildren()[0].text.split()[0])  # the comment beside the shape, "1.3 kg"
            origin, shape = visual.find("origin"), visual.find("geometry")[0]
            if shape.tag == "box":
                solid = pin.Inertia.FromBox(mass, *(float(v) for v in shape.get("size").split()))
            else:
                solid = pin.Inertia.FromCylinder(mass, float(shape.get("radius")), float(shape.get("length")))
            placement = pin.SE3(
                pin.rpy.rpyToMatrix(np.array([float(v) for v in origin.get("rpy").split()])),
                np.array([float(v) for v in origin.get("xyz").split()]),
            )
            total += solid.se3Action(placement)
        inertial = link.find("inertial")
        tensor = inertial.find("inertia")
        ixx, ixy, ixz, iyy, iyz, izz = (float(tensor.get(k)) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
        assert float(inertial.find("mass").get("value")) == pytest.approx(total.mass, rel=1e-12)
        lever = [float(v) for v in inertial.find("origin").get("xyz").split()]
        np.testing.assert_allclose(lever, total.lever, atol=1e-9)
        np.testing.assert_allclose(
            [[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]], total.inertia, atol=2e-9, err_msg=link.get("name")
        )


@pytest.mark.parametrize("name", LEGS[:2])
def test_leg_weighs_ten_kilograms(name: str) -> None:
    assert sum(inertia.mass for inertia in list(pinocchio_model(name).inertias)[1:]) == pytest.approx(10.0)


@pytest.mark.parametrize("name", LEGS)
def test_leg_has_the_limits_of_the_paper(name: str) -> None:
    robot = load(name)
    limits, pick = robot.limits, [robot.index(j) for j in ("hip", "knee", "ankle")]
    np.testing.assert_allclose(limits.lower[pick], [0.0, -math.pi / 6, -math.pi / 9], atol=1e-12)
    np.testing.assert_allclose(limits.upper[pick], [2 * math.pi / 9, 0.0, math.pi / 2], atol=1e-12)
    np.testing.assert_allclose(limits.velocity[pick], math.pi)
    np.testing.assert_allclose(limits.acceleration[pick], np.array([1.0, 1.5, 2.0]) * math.pi)
    (row,) = limits.combinations
    np.testing.assert_array_equal(row[pick], [1.0, 1.0, 0.0])
    assert row.sum() == 2.0
    assert limits.combination_lower[0] == 0.1
    assert limits.combination_upper[0] == math.inf


@pytest.mark.parametrize("name", LEGS)
def test_leg_has_identical_motors_and_every_prior(name: str) -> None:
    robot = load(name)
    assert robot.rotor_groups == ("motor.rotor_inertia",)
    assert len({(r.torque_constant, r.rotor_inertia) for r in robot.rotors}) == 1
    for joint in robot.joint_names:
        spring = robot.spring(joint)
        values = (spring.stiffness, spring.cubic_stiffness, spring.damping, spring.efficiency)
        assert all(v is not None and v > 0.0 for v in (*values, spring.viscous_friction, spring.coulomb_friction))
        assert spring.efficiency < 1.0
    link_friction = [(j.damping, j.friction) for j in robot.joints]
    if name == "exo_leg_link_friction":
        assert all(d > 0.0 and f > 0.0 for d, f in link_friction)
    else:
        assert link_friction == [(None, None)] * robot.n


def test_planar_leg_hangs_in_gravity_and_no_moment_is_zero() -> None:
    model = pinocchio_model("exo_leg")
    data = model.createData()
    pin.forwardKinematics(model, data, np.array([0.3, -0.2, 0.4]))
    for k in (1, 2, 3):  # all axes along the same line
        axis = data.oMi[k].rotation @ pin.computeJointJacobian(model, data, np.array([0.3, -0.2, 0.4]), k)[3:, k - 1]
        np.testing.assert_allclose(axis, [0.0, -1.0, 0.0], atol=1e-12)
    for inertia in list(model.inertias)[1:]:
        assert np.all(np.abs(inertia.mass * inertia.lever[[0, 2]]) > 0.01)  # kg m, of 0.03 .. 1
    # flexion lifts the leg forward, and gravity pulls it back
    height = [pin.centerOfMass(model, data, np.array([hip, 0.0, 0.0])).copy() for hip in (0.2, 0.4, 0.6)]
    assert all(b[2] > a[2] and b[0] > a[0] for a, b in pairwise(height))
    assert pin.computeGeneralizedGravity(model, data, np.array([0.6, 0.0, 0.0]))[0] > 0.0


@pytest.mark.parametrize("name", LEGS)
def test_leg_springs_give_way_by_hundredths_of_a_radian_and_motors_can_hold(name: str) -> None:
    robot, model = load(name), pinocchio_model(name)
    data, rng = model.createData(), np.random.default_rng(1)
    torques = []
    for _ in range(300):
        q = rng.uniform(model.lowerPositionLimit, model.upperPositionLimit)
        a = rng.uniform(-1, 1, model.nv) * robot.limits.acceleration
        torques.append(np.abs(pin.rnea(model, data, q, np.zeros(model.nv), a)))
    largest = np.max(torques, axis=0)
    assert np.all(largest < 0.8 * model.effortLimit)
    deflection = []
    for joint, torque in zip(robot.joint_names, largest, strict=True):
        spring = robot.spring(joint)
        roots = np.roots([spring.cubic_stiffness, 0.0, spring.stiffness, -torque])
        deflection.append(float(roots[np.abs(roots.imag) < 1e-9].real[0]))
    *proximal, ankle = deflection
    assert all(0.03 < d < 0.12 for d in proximal)
    assert 0.003 < ankle < 0.02  # hardly excited, the foot is light


def test_variants_keep_the_links_of_the_leg() -> None:
    reference = {link.get("name"): etree.tostring(link) for link in tree_of("exo_leg").findall("link")}
    friction = {link.get("name"): etree.tostring(link) for link in tree_of("exo_leg_link_friction").findall("link")}
    abduction = {link.get("name"): etree.tostring(link) for link in tree_of("exo_leg_abduction").findall("link")}
    assert friction == reference
    for name in ("thigh", "shank", "foot"):
        assert abduction[name] == reference[name]


def test_abduction_leg_has_rotors_across_their_joints() -> None:
    robot = load("exo_leg_abduction")
    cosines = [abs(axis_in_carrier(robot, r.joint, r.carrier) @ r.rotor_axis) for r in robot.rotors]
    np.testing.assert_allclose(cosines, [1.0, 1.0, 0.0, 0.0], atol=1e-12)


# -- robots of the real recordings -------------------------------------------------------------------------------------


def test_emps_slides_without_gravity() -> None:
    model = pinocchio_model("emps")
    assert load("emps").joints[0].prismatic
    assert pin.computeGeneralizedGravity(model, model.createData(), np.array([0.1]))[0] == 0.0


def test_quanser_has_the_makers_figures() -> None:
    robot, model = load("quanser_2dof"), pinocchio_model("quanser_2dof")
    stages = [robot.spring(j) for j in robot.joint_names]
    per_ampere = [s.gear_ratio * s.torque_constant for s in stages]
    np.testing.assert_allclose(per_ampere, [8.925, 0.870], rtol=1e-12)
    np.testing.assert_allclose([s.gear_ratio**2 * s.rotor_inertia for s in stages], [0.0635, 0.00302], rtol=1e-9)
    assert [s.stiffness for s in stages] == [39.96, 6.858]
    assert [s.viscous_friction for s in stages] == [4.0, 1.5]
    assert [s.efficiency for s in stages] == [1.0, 1.0]
    assert [s.carrier for s in stages] == ["base", "link1"]
    data = model.createData()
    np.testing.assert_allclose(np.diag(pin.crba(model, data, np.zeros(2))), [0.1704, 0.00644], rtol=5e-4)
    assert np.all(pin.computeGeneralizedGravity(model, data, np.array([0.4, -0.7])) == 0.0)


def test_hebi_module_has_the_gear_of_its_recordings_and_leaves_the_unknown_out() -> None:
    spring = load("hebi_x5").spring("output")
    assert spring.gear_ratio == 272.222
    assert spring.stiffness == 40.0
    assert spring.torque_constant is None
    assert spring.rotor_inertia is None


# -- fragments for robots of example-robot-data ------------------------------------------------------------------------


@pytest.mark.parametrize("name", FRAGMENTS)
def test_fragment_names_joints_and_links_that_exist(name: str) -> None:
    source, joints = FRAGMENTS[name]
    urdf = etree.parse(str(example_robots_folder() / source)).getroot()
    known = {j.get("name") for j in urdf.findall("joint") if j.get("type") in ("revolute", "continuous", "prismatic")}
    fragment = tree_of(name)
    assert {child.tag for child in fragment.iterchildren(etree.Element)} == {"transmission"}
    assert fragment.get("name") == urdf.get("name")
    named = [t.find("joint").get("name") for t in fragment.findall("transmission")]
    assert sorted(named) == sorted(joints)
    assert set(named) <= known
    links = {link.get("name") for link in urdf.findall("link")}
    assert {axis.get("link") for axis in fragment.iter("rotorAxis")} <= links


@pytest.mark.parametrize("name", FRAGMENTS)
def test_fragment_makes_every_joint_elastic_and_excitable(name: str) -> None:
    robot = load_annotated(name)
    assert sorted(robot.joint_names) == sorted(FRAGMENTS[name][1])
    assert all(robot.elastic)
    assert np.all(np.isfinite(robot.limits.acceleration))
    assert np.all(np.isfinite(robot.limits.velocity))
    assert all(robot.spring(j).stiffness > 0.0 and robot.spring(j).rotor_inertia > 0.0 for j in robot.joint_names)


def test_baxter_figures() -> None:
    robot = load_annotated("baxter_sea")
    for joint in robot.joint_names:
        large = joint.split("_")[1][0] in "se"
        assert robot.spring(joint).stiffness == (843.0 if large else 250.0)
        index = robot.model.joints[robot.model.getJointId(joint)].idx_v
        assert robot.model.effortLimit[index] == (50.0 if large else 15.0)
    assert robot.rotor_groups == ("large.rotor_inertia", "small.rotor_inertia")


def test_baxter_variants_differ_only_in_their_drives_and_tilt_every_rotor() -> None:
    plain, tilted = load_annotated("baxter_sea"), load_annotated("baxter_tilted")
    for a, b in zip(plain.rotors, tilted.rotors, strict=True):
        assert (a.joint, a.rotor_group, a.efficiency) == (b.joint, b.rotor_group, b.efficiency)
        assert a.gear_ratio**2 * a.rotor_inertia == pytest.approx(b.gear_ratio**2 * b.rotor_inertia)
        assert a.gear_ratio * a.torque_constant == pytest.approx(b.gear_ratio * b.torque_constant)
        assert axis_in_carrier(plain, a.joint, a.carrier) @ a.rotor_axis == pytest.approx(1.0, abs=1e-9)
    cosines = {r.joint: abs(axis_in_carrier(tilted, r.joint, r.carrier) @ r.rotor_axis) for r in tilted.rotors}
    assert max(cosines.values()) < 0.8
    assert {round(c, 6) for c in cosines.values()} == {0.0, round(math.sqrt(0.5), 6)}


def test_centauro_rotor_and_friction_figures_follow_from_their_source() -> None:
    robot = load_annotated("centauro_sea")
    orange, lemon = robot.spring("j_arm1_3"), robot.spring("j_arm1_5")
    assert orange.rotor_inertia == pytest.approx((0.3594 + 0.1120) / 100**2, rel=1e-3)
    assert lemon.rotor_inertia == pytest.approx((0.0472 + 0.0280) / 50**2, rel=1e-3)
    assert orange.viscous_friction == pytest.approx(0.0056 + 3.4375)
    assert robot.spring("j_arm1_1").viscous_friction == pytest.approx(orange.viscous_friction * 1.6**2, rel=2e-2)
    assert robot.spring("j_arm1_1").coulomb_friction == pytest.approx((3.3 + 3.7) * 1.6)
    assert lemon.viscous_friction == pytest.approx((0.0005 + 0.8594) * 1.6**2, rel=2e-2)
    assert lemon.coulomb_friction == pytest.approx((1.05 + 3.3) * 1.6, rel=2e-2)
