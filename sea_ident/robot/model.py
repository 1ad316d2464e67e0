"""The robot: links and rotors as one Pinocchio model, exact in the plane and in 3-D."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import RobotError
from sea_ident.robot.actuator import Actuator, SeriesElasticActuator
from sea_ident.robot.describe import robot_summary
from sea_ident.robot.limits import Limits

INERTIAL_NAMES = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
INERTIAL_UNITS = ("kg", "kg m", "kg m", "kg m") + ("kg m2",) * 6

UPRIGHT = (0.0, 0.0, -9.81)
"""Gravity of a robot that stands, as Pinocchio has it [m/s2]."""

LARGEST_GRAVITY = 30.0
"""That of the largest planet [m/s2]."""

LONGEST_LEVER = 10.0
"""Distance of a centre of mass from its joint up to which it is as good as any to compute with [m]."""

SPARE_MASS = 1.0
"""Mass that a body without any is given [kg]."""


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint that moves on its own.

    Attributes:
        name: name in the URDF.
        type: revolute, continuous or prismatic.
        child: name of the link that it moves.
        damping: prior of the link-side viscous friction [N m s/rad], None where not stated.
        friction: prior of the link-side Coulomb friction [N m], None where not stated.
        actuator: the motor, None where the annotation names none.
        followers: joints that mimic this one.
    """

    name: str
    type: str
    child: str
    damping: float | None
    friction: float | None
    actuator: Actuator | None
    followers: tuple[str, ...] = ()

    @property
    def elastic(self) -> bool:
        """Whether a spring stands between motor and link."""
        return self.actuator is not None and self.actuator.elastic

    @property
    def prismatic(self) -> bool:
        """Whether the joint slides."""
        return self.type == "prismatic"

    @property
    def torque_unit(self) -> str:
        """Unit of the joint torque or force."""
        return "N" if self.prismatic else "N m"

    @property
    def position_unit(self) -> str:
        """Unit of the joint position."""
        return "m" if self.prismatic else "rad"


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot whose rotors are bodies of their own.

    With q the link positions and theta the motor positions after the gear (theta = q at a rigid joint), the
    coordinates of the extended model are ``x = link_map @ q + motor_map @ theta + offset``. Everything follows from
    that one linear map: gear ratios, identical coordinates of mimic joints, rotors of rigid joints.

    Attributes:
        name: name of the robot.
        source: what `load_robot` was given.
        urdf: text of the URDF.
        annotation: text of the annotation fragment, None where the URDF itself is annotated.
        joints: (n,) joints in kinematic order.
        limits: limits of the motion.
        bodies: names of the moving link bodies, one per joint of the tree (mimic joints included).
        rotors: actuators, one per rotor body.
        model: links only, locked joints merged; mimic joints are coordinates of their own.
        extended_model: links and rotors.
        body_indices: joint index in `extended_model` of each body.
        rotor_indices: joint index in `extended_model` of each rotor.
        link_map: (nv, n) part of the extended velocity due to q'.
        motor_map: (nv, n) part due to theta'.
        offset: (nv,) extended position at q = theta = 0 (offsets of mimic joints).
        locked: positions of the joints that were locked.
        warnings: what a user should know about this description.
    """

    name: str
    source: str
    urdf: str
    annotation: str | None
    joints: tuple[Joint, ...]
    limits: Limits
    bodies: tuple[str, ...]
    rotors: tuple[Actuator, ...]
    model: pin.Model
    extended_model: pin.Model
    body_indices: IntArray
    rotor_indices: IntArray
    link_map: FloatArray
    motor_map: FloatArray
    offset: FloatArray
    locked: dict[str, float]
    warnings: tuple[str, ...] = ()

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in kinematic order."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def elastic(self) -> tuple[bool, ...]:
        """(n,) whether each joint has a spring."""
        return tuple(joint.elastic for joint in self.joints)

    @property
    def elastic_indices(self) -> IntArray:
        """Indices of the joints that have a spring."""
        return np.flatnonzero(np.array(self.elastic, dtype=bool))

    @property
    def gear_ratios(self) -> FloatArray:
        """(n,) gear ratios, 1 where there is no motor [-]."""
        return np.array([1.0 if j.actuator is None else j.actuator.gear_ratio for j in self.joints])

    def index(self, joint: str) -> int:
        """Position of a joint in `joints`.

        Raises:
            RobotError: if there is no such joint.
        """
        try:
            return self.joint_names.index(joint)
        except ValueError:
            raise RobotError(
                f"{self.name} has no joint {joint!r}; its joints are {', '.join(self.joint_names)}"
            ) from None

    def neighbours(self, index: int) -> tuple[int, ...]:
        """Positions in `joints` of the joint before one in the kinematic tree, if there is any, and of those after it.

        Joints that are locked or mimic others are passed over.

        Args:
            index: position of the joint in `joints`.
        """
        before = self.parents
        first = () if before[index] < 0 else (before[index],)
        return (*first, *(k for k in range(self.n) if before[k] == index))

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """(n,) position in `joints` of the joint before each one in the kinematic tree, -1 at the base."""
        names, parents = list(self.model.names), self.model.parents
        found = []
        for name in self.joint_names:
            body = parents[names.index(name, 1)]
            while body and names[body] not in self.joint_names:
                body = parents[body]
            found.append(self.index(names[body]) if body else -1)
        return tuple(found)

    def spring(self, joint: str) -> SeriesElasticActuator:
        """Actuator of an elastic joint.

        Raises:
            RobotError: if the joint does not exist or is rigid.
        """
        actuator = self.joints[self.index(joint)].actuator
        if not isinstance(actuator, SeriesElasticActuator):
            raise RobotError(f"joint {joint!r} of {self.name} is rigid; it has no spring")
        return actuator

    # -- parameters ------------------------------------------------------------------------------------------------

    @cached_property
    def inertial_names(self) -> tuple[str, ...]:
        """(10 b,) names of the standard inertial parameters, body by body in Pinocchio's order."""
        return tuple(f"{body}.{name}" for body in self.bodies for name in INERTIAL_NAMES)

    @property
    def inertial_parameters(self) -> FloatArray:
        """(10 b,) values that the URDF gives to them (about the joint frame) [kg, kg m, kg m2]."""
        inertias = self.extended_model.inertias
        values = [inertias[int(i)].toDynamicParameters() for i in self.body_indices]
        return np.concatenate(values) if values else np.zeros(0)

    @cached_property
    def rotor_groups(self) -> tuple[str, ...]:
        """Names of the distinct rotor inertia parameters, `<joint or group>.rotor_inertia`."""
        return tuple(dict.fromkeys(f"{rotor.rotor_group}.rotor_inertia" for rotor in self.rotors))

    def rotor_inertias(self) -> FloatArray:
        """(rotors,) inertia of each rotor at its shaft, 0 where no prior is given [kg m2]."""
        inertias = self.extended_model.inertias
        return np.array([inertias[int(i)].inertia[2, 2] for i in self.rotor_indices])

    def of_positive_mass(self, inertial: FloatArray) -> FloatArray:
        """(10 b,) inertial parameters with which the robot needs the same torques, no turning body without a mass.

        A mass on the axis of a joint may be a part of either body. Pinocchio divides by the mass of bodies together,
        of which an estimate that is free may have less than none.

        Args:
            inertial: (10 b,) standard inertial parameters in the order of `inertial_names`.
        """
        model, out = self.extended_model, np.array(inertial, dtype=np.float64).reshape(-1, 10)
        bodies = {int(index): k for k, index in enumerate(self.body_indices)}
        for index in sorted(bodies, reverse=True):  # a parent comes before its children
            own = out[bodies[index]]
            moment = float(np.linalg.norm(own[1:4]))
            if own[0] * LONGEST_LEVER > moment or not model.joints[index].shortname().startswith("JointModelR"):
                continue
            added = max(SPARE_MASS, moment) - own[0]
            own[0] += added
            parent = int(model.parents[index])
            if parent in bodies:
                at = pin.Inertia(1.0, model.jointPlacements[index].translation, np.zeros((3, 3)))
                out[bodies[parent]] -= added * at.toDynamicParameters()
        return out.ravel()

    @property
    def gravity(self) -> FloatArray:
        """(3,) gravity, as the root link of the URDF feels it [m/s2]."""
        return np.array(self.model.gravity.linear)

    def with_gravity(self, gravity: Sequence[float] | FloatArray) -> "Robot":
        """The same robot under another gravity, as the root link feels it.

        Args:
            gravity: (3,) [m/s2].

        Raises:
            RobotError: it is none of a robot.
        """
        try:
            given = np.asarray(gravity, dtype=np.float64)
        except (TypeError, ValueError):
            given = np.zeros(0)
        if given.shape != (3,) or not np.all(np.isfinite(given)):
            raise RobotError(f"gravity is {gravity!r}; give three numbers [m/s2], as (0, 0, -9.81)")
        size = math.hypot(*given)  # of any finite numbers
        if size > LARGEST_GRAVITY:
            raise RobotError(f"gravity is {given.tolist()}, {size:.4g} m/s2; is it in m/s2? Usual is 9.81 at most")
        model, extended = pin.Model(self.model), pin.Model(self.extended_model)
        model.gravity = pin.Motion(given, np.zeros(3))
        extended.gravity = pin.Motion(given, np.zeros(3))
        return replace(self, model=model, extended_model=extended)

    def with_joint_moved(self, joint: str, way: FloatArray) -> "Robot":
        """The same robot with a joint, and all that it carries, moved in the frame of the joint before it.

        Args:
            joint: its name.
            way: (3,) [m].

        Raises:
            RobotError: if there is no such joint.
        """
        self.index(joint)
        models = pin.Model(self.model), pin.Model(self.extended_model)
        for model in models:
            # rotors stay: they have an inertia about their axis and no mass, so that where they are does not matter
            place = model.getJointId(joint)
            now = model.jointPlacements[place]
            model.jointPlacements[place] = pin.SE3(now.rotation, now.translation + np.asarray(way, dtype=np.float64))
        return replace(self, model=models[0], extended_model=models[1])

    def with_inertial_parameters(self, inertial: FloatArray, rotor_inertias: FloatArray) -> "Robot":
        """The same robot with other inertial parameters.

        Args:
            inertial: (10 b,) standard inertial parameters in the order of `inertial_names`.
            rotor_inertias: (rotors,) rotor inertias at the shaft [kg m2].

        Returns:
            A new robot; this one is left as it is.
        """
        model, extended = pin.Model(self.model), pin.Model(self.extended_model)
        for k, index in enumerate(self.body_indices):
            inertia = pin.Inertia.FromDynamicParameters(inertial[10 * k : 10 * k + 10])
            extended.inertias[int(index)] = inertia
            model.inertias[k + 1] = inertia
        rotors = []
        for rotor, index, value in zip(self.rotors, self.rotor_indices, rotor_inertias, strict=True):
            extended.inertias[int(index)] = rotor_body(float(value))
            rotors.append(replace(rotor, rotor_inertia=float(value)))
        by_joint = {rotor.joint: rotor for rotor in rotors}
        joints = tuple(replace(j, actuator=by_joint.get(j.name, j.actuator)) for j in self.joints)
        return replace(self, model=model, extended_model=extended, rotors=tuple(rotors), joints=joints)

    # -- dynamics --------------------------------------------------------------------------------------------------

    def extended_state(self, q: FloatArray, theta: FloatArray | None = None) -> FloatArray:
        """(..., nv) position of the extended model from q and theta (..., n) [rad]; theta = q where it is None."""
        motor = q if theta is None else theta
        state: FloatArray = q @ self.link_map.T + motor @ self.motor_map.T + self.offset
        return state

    def extended_rate(self, dq: FloatArray, dtheta: FloatArray | None = None) -> FloatArray:
        """(..., nv) velocity (or acceleration) of the extended model from those of q and theta (..., n) [rad/s]."""
        motor = dq if dtheta is None else dtheta
        rate: FloatArray = dq @ self.link_map.T + motor @ self.motor_map.T
        return rate

    def mass_matrices(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Blocks of the mass matrix at one configuration.

        Args:
            q: (n,) link positions [rad].

        Returns:
            H (n, n), S (n, n) with motor rows, and B (n, n), so that the motor rows read ``S q'' + B theta''``
            [kg m2] (paper, eqs. 1-2).
        """
        data = self.extended_model.createData()
        mass = pin.crba(self.extended_model, data, self.extended_state(np.asarray(q, dtype=float)))
        mass = np.triu(mass) + np.triu(mass, 1).T
        link, motor = self.link_map, self.motor_map
        return link.T @ mass @ link, motor.T @ mass @ link, motor.T @ mass @ motor

    def inertia(self, q: FloatArray) -> FloatArray:
        """H(q): (n, n) link inertia matrix with the rotors carried along [kg m2] (paper, eq. 1)."""
        return self.mass_matrices(q)[0]

    def coupling(self, q: FloatArray) -> FloatArray:
        """S(q): (n, n) coupling between motors (rows) and links (columns) [kg m2] (paper, eq. 2).

        Constant and strictly lower triangular where all axes are parallel and every motor sits before its joint;
        otherwise it depends on q.
        """
        return self.mass_matrices(q)[1]

    def motor_inertia(self, q: FloatArray) -> FloatArray:
        """B(q): (n, n) motor inertia after the gear [kg m2] (paper, eq. 2)."""
        return self.mass_matrices(q)[2]

    def gyroscopic_terms(self, q: FloatArray, dq: FloatArray, dtheta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What turning rotors add when their axes turn: zero where motor axes are parallel to all link axes.

        Args:
            q: (n,) link positions [rad].
            dq: (n,) link velocities [rad/s].
            dtheta: (n,) motor velocities after the gear [rad/s].

        Returns:
            C1(q, theta') q' (n,) in the link rows, bilinear in q' and theta', and C2(q, q') q' (n,) in the motor rows
            [N m] (paper, eqs. 1-2).
        """
        model, data = self.extended_model, self.extended_model.createData()
        x, rest = self.extended_state(np.asarray(q, dtype=float)), np.zeros(self.extended_model.nv)
        turning = self.extended_rate(np.asarray(dq, dtype=float), np.asarray(dtheta, dtype=float))
        at_rest = self.extended_rate(np.asarray(dq, dtype=float), np.zeros(self.n))
        with_rotors = pin.rnea(model, data, x, turning, rest).copy()
        without = pin.rnea(model, data, x, at_rest, rest)
        first: FloatArray = self.link_map.T @ (with_rotors - without)
        second: FloatArray = self.motor_map.T @ with_rotors
        return first, second

    def summary(self) -> str:
        """A table of joints, with limits, motors and springs as far as the description states them."""
        return robot_summary(self)


def rotor_body(inertia: float) -> pin.Inertia:
    """A body with nothing but an inertia about its z axis [kg m2].

    A rotor is symmetric about its spin axis: its mass and transverse inertia do not depend on its angle and belong to
    the link that carries it.
    """
    return pin.Inertia(0.0, np.zeros(3), np.diag([0.0, 0.0, inertia]))
