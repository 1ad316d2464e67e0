"""The robot as MJCF: links, rotors as bodies of their own, springs as tendons.

    q        a hinge or slide at every joint
    theta    a hinge "<joint> rotor" on the link that carries the motor, at N theta
    spring   a fixed tendon of length theta - q, with stiffness (K1, 0, K3) and damping D
    friction damping and frictionloss, of the rotor at an elastic joint, of the joint at a rigid one
    motor    an actuator whose control is the motor torque at the joint side

A rigid joint with a motor ties its rotor to the joint by an equality constraint, as a mimic joint its follower.

MuJoCo wants mass and three moments of inertia of every body, a rotor of this model has an inertia about its axis alone:
its mass and transverse inertia belong to the link that carries it. So every rotor takes a small mass and half its
inertia about each transverse axis (a thin disc) out of that link, which leaves the same robot.

MuJoCo's frictionloss is the sign function where this project has tanh(v / v_off); they agree to rounding from 20 v_off
on. A cubic spring needs a MuJoCo with polynomial stiffness (4.0 has it), linear ones do not. The efficiency of the gear
and the torque constant are not in an MJCF: its input is a torque after the gear.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from lxml import etree

from sea_ident._typing import FloatArray
from sea_ident.exceptions import ExportError
from sea_ident.export.bodies import check_body
from sea_ident.export.values import ExportValues
from sea_ident.export.visuals import Visual, read_visuals
from sea_ident.robot import Actuator
from sea_ident.robot.joints import root_master
from sea_ident.robot.urdf import UrdfTree, parse_urdf

TIME_STEP = 0.001
_ROTOR_MASS = 0.01  # part of the mass of the link that carries it
_SMALLEST = 1e-12  # MuJoCo refuses bodies without mass
_TIE = {"solref": "0.004 1", "solimp": "0.999 0.9999 0.001"}


def rotor_name(joint: str) -> str:
    """Name of the hinge and the body of the motor of a joint."""
    return f"{joint} rotor"


def mjcf_text(values: ExportValues) -> tuple[str, list[str]]:
    """Write the robot as MJCF.

    Args:
        values: the values.

    Returns:
        Text of the MJCF, and notes for the user.

    Raises:
        ExportError: if a body is not physically consistent, a spring has no stiffness, or a link is too light for the
            rotor that it carries.
    """
    writer = _Writer(values)
    notes = []
    if values.left_out:
        notes.append(f"an MJCF has no place for {', '.join(values.left_out)}: left out")
    negative = [
        f"{joint.joint} {label}"
        for joint in values.joints
        for label, value in (
            ("viscous friction", joint.viscous_friction),
            ("Coulomb friction", joint.coulomb_friction),
            ("spring damping", joint.damping),
        )
        if value is not None and value < 0.0
    ]
    if negative:
        notes.append(f"negative, so that the exported robot gains energy: {', '.join(negative)}")
    return writer.text(), notes


@dataclass(frozen=True, eq=False)
class _Body:
    """A moving body about its centre of mass: what is left of it after its rotors."""

    mass: float
    centre: FloatArray
    inertia: FloatArray


class _Writer:
    def __init__(self, values: ExportValues) -> None:
        self.values, self.robot = values, values.robot
        self.tree: UrdfTree = parse_urdf(self.robot.urdf, self.robot.source)
        self.visuals = read_visuals(self.tree.root)
        self.of_joint = {v.joint: v for v in values.joints}
        self.carried: dict[int, list[tuple[Actuator, FloatArray]]] = {}
        model = self.robot.model
        for rotor in self.robot.rotors:
            frame = model.frames[model.getFrameId(rotor.carrier, pin.FrameType.BODY)]
            axis = frame.placement.rotation @ rotor.rotor_axis
            self.carried.setdefault(int(frame.parentJoint), []).append((rotor, axis))

    def text(self) -> str:
        root = etree.Element("mujoco", model=self.robot.name)
        etree.SubElement(root, "compiler", angle="radian", inertiafromgeom="false", autolimits="true")
        gravity = _numbers(self.robot.model.gravity.linear)
        etree.SubElement(root, "option", gravity=gravity, timestep=_number(TIME_STEP), integrator="implicitfast")
        world = etree.SubElement(root, "worldbody")
        self._fill(world, 0, np.zeros(3))
        bodies = {0: world}
        for k in range(1, self.robot.model.njoints):
            bodies[k] = self._body(bodies[self.robot.model.parents[k]], k)
        self._springs(etree.SubElement(root, "tendon"))
        self._ties(etree.SubElement(root, "equality"))
        self._actuators(etree.SubElement(root, "actuator"))
        for empty in [child for child in root if len(child) == 0 and child.tag in ("tendon", "equality")]:
            root.remove(empty)
        etree.indent(root)
        return str(etree.tostring(root, encoding="utf-8", xml_declaration=True).decode()) + "\n"

    def _body(self, parent: etree._Element, k: int) -> etree._Element:
        model, name = self.robot.model, self.robot.bodies[k - 1]
        placement = model.jointPlacements[k]
        element = etree.SubElement(parent, "body", name=name, pos=_numbers(placement.translation))
        element.set("quat", _quaternion(placement.rotation))
        body = self._split(k)
        tensor = body.inertia
        etree.SubElement(
            element,
            "inertial",
            pos=_numbers(body.centre),
            mass=_number(body.mass),
            fullinertia=_numbers(tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
        )
        self._joint(element, model.names[k])
        self._fill(element, k, body.centre)
        return element

    def _joint(self, element: etree._Element, name: str) -> None:
        urdf = self.tree.joints[name]
        kind = "slide" if urdf.type == "prismatic" else "hinge"
        joint = etree.SubElement(element, "joint", name=name, type=kind, axis=_numbers(urdf.axis))
        if np.isfinite(urdf.lower) and np.isfinite(urdf.upper):
            joint.set("range", _numbers(np.array([urdf.lower, urdf.upper])))
        values = self.of_joint.get(name)
        if values is None:  # it mimics another
            return
        elastic = self.robot.joints[self.robot.index(name)].elastic
        damping = values.link_viscous_friction if elastic else values.viscous_friction
        friction = values.link_coulomb_friction if elastic else values.coulomb_friction
        _friction(joint, damping, friction, 1.0)

    def _split(self, k: int) -> _Body:
        """The body of joint `k` without what its rotors take with them."""
        name, inertia = self.robot.bodies[k - 1], self.robot.model.inertias[k]
        check_body(name, inertia.toDynamicParameters())
        mass = max(inertia.mass, _SMALLEST)
        about_centre, rotors = inertia.inertia.copy(), self.carried.get(k, [])
        for rotor, axis in rotors:
            about_centre -= _transverse(rotor) * (np.eye(3) - np.outer(axis, axis))
            mass -= self._rotor_mass(k)
        spread = 0.5 * np.trace(about_centre) * np.eye(3) - about_centre  # second moments
        least, largest = np.linalg.eigvalsh(spread)[[0, -1]]
        if rotors and least < 0.0:
            joints = ", ".join(repr(rotor.joint) for rotor, _ in rotors)
            raise ExportError(
                f"link {name!r}: its inertia leaves no room for the rotors of {joints} that it carries: it lacks "
                f"{-2.0 * least:.3g} kg m2 of what they have about their diameters; MuJoCo cannot hold this robot. "
                f"Count the rotors into the <inertia> of this link, or mount them on another (<rotorAxis>)"
            )
        # a body without extension along some axis: MuJoCo wants strictly positive moments that a body can have
        about_centre += 2.0 * max(_SMALLEST - least, 0.0) * np.eye(3) if least < _SMALLEST else 0.0
        about_centre += 1e-14 * max(largest, 0.0) * np.eye(3)
        return _Body(mass, inertia.lever, about_centre)

    def _rotor_mass(self, k: int) -> float:
        return _ROTOR_MASS * float(self.robot.model.inertias[k].mass) if k else 1.0

    def _fill(self, element: etree._Element, k: int, centre: FloatArray) -> None:
        """Geometry and rotors of a body (0: the world)."""
        model = self.robot.model
        for frame in model.frames:
            if frame.type == pin.FrameType.BODY and frame.parentJoint == k:
                for visual in self.visuals.get(frame.name, ()):
                    _geom(element, visual, frame.placement)
        for rotor, axis in self.carried.get(k, []):
            rotation = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis).matrix()
            body = etree.SubElement(element, "body", name=rotor_name(rotor.joint), pos=_numbers(centre))
            body.set("quat", _quaternion(rotation))
            spin = max(rotor.rotor_inertia or 0.0, 2.0 * _SMALLEST)
            transverse = max(_transverse(rotor), _SMALLEST)
            moments = _numbers(np.array([transverse, transverse, spin]))
            etree.SubElement(body, "inertial", pos="0 0 0", mass=_number(self._rotor_mass(k)), diaginertia=moments)
            joint = etree.SubElement(body, "joint", name=rotor_name(rotor.joint), type="hinge", axis="0 0 1")
            values = self.of_joint[rotor.joint]
            if rotor.elastic:
                _friction(joint, values.viscous_friction, values.coulomb_friction, rotor.gear_ratio)

    def _springs(self, tendons: etree._Element) -> None:
        for joint in self.robot.joints:
            if joint.actuator is None or not joint.elastic:
                continue
            values = self.of_joint[joint.name]
            if values.stiffness is None:
                raise ExportError(f"the spring of joint {joint.name!r} has no stiffness; identify the springs first")
            # one number where it suffices, which MuJoCo 3 reads too
            stiffness = np.array([values.stiffness, 0.0, values.cubic_stiffness or 0.0])[
                : 3 if values.cubic_stiffness else 1
            ]
            spring = etree.SubElement(
                tendons, "fixed", name=f"{joint.name} spring", springlength="0", stiffness=_numbers(stiffness)
            )
            spring.set("damping", _number(values.damping or 0.0))
            inverse = _number(1.0 / joint.actuator.gear_ratio)
            etree.SubElement(spring, "joint", joint=rotor_name(joint.name), coef=inverse)
            etree.SubElement(spring, "joint", joint=joint.name, coef="-1")

    def _ties(self, equality: etree._Element) -> None:
        for joint in self.robot.joints:
            if joint.actuator is not None and not joint.elastic:
                ratio = _numbers(np.array([0.0, joint.actuator.gear_ratio, 0.0, 0.0, 0.0]))
                etree.SubElement(
                    equality, "joint", _TIE, joint1=rotor_name(joint.name), joint2=joint.name, polycoef=ratio
                )
            for follower in joint.followers:
                _, multiplier, offset = root_master(self.tree, follower)
                law = _numbers(np.array([offset, multiplier, 0.0, 0.0, 0.0]))
                etree.SubElement(equality, "joint", _TIE, joint1=follower, joint2=joint.name, polycoef=law)

    def _actuators(self, actuators: etree._Element) -> None:
        for i, joint in enumerate(self.robot.joints):
            gear = 1.0 / joint.actuator.gear_ratio if joint.actuator is not None and joint.elastic else 1.0
            at = rotor_name(joint.name) if joint.elastic else joint.name
            motor = etree.SubElement(actuators, "general", name=joint.name, joint=at, gear=_number(gear))
            offset = self.of_joint[joint.name].torque_offset
            if offset:
                motor.set("biastype", "affine")
                motor.set("biasprm", _numbers(np.array([-offset, 0.0, 0.0])))
            limit = float(self.robot.limits.torque[i])
            if np.isfinite(limit):
                motor.set("ctrlrange", _numbers(np.array([-limit, limit])))


def _transverse(rotor: Actuator) -> float:
    """Inertia of a thin disc about its diameter [kg m2]."""
    return 0.5 * (rotor.rotor_inertia or 0.0)


def _friction(joint: etree._Element, viscous: float | None, coulomb: float | None, gear_ratio: float) -> None:
    if viscous:
        joint.set("damping", _number(viscous / gear_ratio**2))
    if coulomb:
        joint.set("frictionloss", _number(coulomb / abs(gear_ratio)))


def _geom(element: etree._Element, visual: Visual, placement: pin.SE3) -> None:
    """A shape to look at, that neither weighs nor collides."""
    at = placement * pin.SE3(visual.rotation, visual.position)
    geom = etree.SubElement(
        element,
        "geom",
        type=visual.shape,
        size=_numbers(visual.size),
        pos=_numbers(at.translation),
        quat=_quaternion(at.rotation),
        contype="0",
        conaffinity="0",
        group="1",
        mass="0",
    )
    if visual.colour is not None:
        geom.set("rgba", _numbers(visual.colour))


def _quaternion(rotation: FloatArray) -> str:
    x, y, z, w = pin.Quaternion(np.ascontiguousarray(rotation)).normalized().coeffs()
    return _numbers(np.array([w, x, y, z]))


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: FloatArray) -> str:
    return " ".join(_number(value) for value in values)
