"""The robot as an MJCF model: links and rotors as bodies, each rotor on a hinge of its carrier."""

from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from sea_ident.robot import Robot
from tests.benchmarks.hidden_effects.case import FloatArray

ROTOR_MASS_SHARE = 0.03


@dataclass(frozen=True)
class Payload:
    """A mass fixed to a link.

    Attributes:
        joint: joint that moves the link.
        mass: [kg].
        position: (3,) in the frame of the joint [m].
    """

    joint: str
    mass: float
    position: tuple[float, float, float]


@dataclass(frozen=True)
class Flexibility:
    """A hinge with a spring between the encoder of a joint and its link, about the joint's axis.

    Attributes:
        joint: joint.
        stiffness: [N m/rad].
        damping: [N m s/rad].
        inertia: of what turns with the encoder [kg m2].
    """

    joint: str
    stiffness: float
    damping: float
    inertia: float


@dataclass(frozen=True)
class Coupling:
    """A motor whose stage turns with its own joint and with another link.

    Attributes:
        joint: joint of the motor.
        other: joint that it passes.
        ratio: r in theta + r q_other [-].
    """

    joint: str
    other: str
    ratio: float


COUPLED_SHARE = 0.8
"""Share of the inertia of a rotor that turns with another joint too [-]."""

PARALLEL = 1e-9
"""How far the cosine of the angle of two parallel axes may be from one [-]."""


def build_mjcf(
    robot: Robot,
    timestep: float,
    payloads: tuple[Payload, ...] = (),
    flexibilities: tuple[Flexibility, ...] = (),
    couplings: tuple[Coupling, ...] = (),
) -> mujoco.MjModel:
    """Build MuJoCo's model of a robot from the masses, places and axes of its bodies.

    A rotor gets mass and transverse inertia of its own, at the centre of mass of its carrier, and the carrier loses
    as much, so that the totals are those of `robot`: where that mass sits is no concern of the equations of motion.

    Args:
        robot: the robot with its true parameters.
        timestep: [s].
        payloads: masses to add.
        flexibilities: flexible links.
        couplings: motors whose stage turns with another joint too; their rotors lack its inertia, which is of
            `Stages`.

    Returns:
        The model; joint names are those of `robot.extended_model`.
    """
    model = robot.extended_model
    rotors = {int(i): rotor for i, rotor in zip(robot.rotor_indices, robot.rotors, strict=True)}
    children: dict[int, list[int]] = {k: [] for k in range(model.njoints)}
    for k in range(1, model.njoints):
        children[int(model.parents[k])].append(k)
    flexible = {f.joint: f for f in flexibilities}
    coupled = {f"{c.joint} rotor" for c in couplings}

    def inertial(mass: float, centre: FloatArray, about_centre: FloatArray) -> str:
        i = about_centre
        full = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
        return f'<inertial mass="{mass!r}" pos="{_text(centre)}" fullinertia="{_text(full)}"/>'

    def axis(k: int) -> tuple[str, FloatArray]:
        data = model.joints[k].createData()
        model.joints[k].calc(data, np.zeros(1), np.zeros(1))
        subspace = np.asarray(data.S).reshape(6)
        return ("hinge", subspace[3:]) if np.any(subspace[3:]) else ("slide", subspace[:3])

    def link(k: int) -> str:
        body = model.inertias[k]
        mass, moments = float(body.mass), body.inertia.copy()
        carried = [c for c in children[k] if c in rotors]
        inner = ""
        for c in carried:
            spin = float(model.inertias[c].inertia[2, 2])
            rotation = model.jointPlacements[c].rotation
            share, transverse = ROTOR_MASS_SHARE * float(body.mass), 0.7 * spin
            mass -= share
            moments -= rotation @ np.diag([transverse, transverse, 0.0]) @ rotation.T
            inner += rotor(c, share, transverse, body.lever)
        kind, direction = axis(k)
        own = inertial(mass, body.lever, moments)
        joint = f'<joint name="{model.names[k]}" type="{kind}" axis="{_text(direction)}"/>'
        extra = "".join(
            f'<body pos="{_text(p.position)}"><inertial mass="{p.mass!r}" pos="0 0 0" diaginertia='
            f'"{p.mass * 4e-4!r} {p.mass * 4e-4!r} {p.mass * 4e-4!r}"/></body>'
            for p in payloads
            if p.joint == model.names[k]
        )
        rest = own + inner + extra + "".join(link(c) for c in children[k] if c not in rotors)
        soft = flexible.get(model.names[k])
        if soft is not None:
            # what turns with the encoder is a body of its own; the link hangs on it by a second hinge
            small = np.eye(3) * soft.inertia
            rest = (
                inertial(1e-3, np.zeros(3), small)
                + f'<body name="{model.names[k]} after flexibility"><joint name="{model.names[k]} flexibility" '
                + f'type="{kind}" axis="{_text(direction)}" stiffness="{soft.stiffness!r}" '
                + f'damping="{soft.damping!r}"/>{rest}</body>'
            )
        return f'<body name="{model.names[k]}" {_place(model.jointPlacements[k])}>{joint}{rest}</body>'

    def rotor(k: int, mass: float, transverse: float, position: FloatArray) -> str:
        spin = float(model.inertias[k].inertia[2, 2])
        if model.names[k] in coupled:  # most of its inertia turns with another joint too
            transverse, spin = 0.7 * spin, (1.0 - COUPLED_SHARE) * spin
            transverse = max(transverse, 0.5 * spin)
        moments = np.diag([transverse, transverse, spin])
        placement = pin.SE3(model.jointPlacements[k].rotation, position)
        joint = f'<joint name="{model.names[k]}" type="hinge" axis="0 0 1"/>'
        own = inertial(mass, np.zeros(3), moments)
        return f'<body name="{model.names[k]}" {_place(placement)}>{joint}{own}</body>'

    grounded = "".join(rotor(c, 0.1, 0.7 * float(model.inertias[c].inertia[2, 2]), np.zeros(3))
                       for c in children[0] if c in rotors)  # fmt: skip
    world = grounded + "".join(link(c) for c in children[0] if c not in rotors)
    gravity = _text(model.gravity.linear)
    text = (
        f'<mujoco><compiler angle="radian"/><option timestep="{timestep!r}" gravity="{gravity}" integrator="Euler">'
        f'<flag contact="disable" constraint="disable"/></option>'
        f"<worldbody>{world}</worldbody></mujoco>"
    )
    return mujoco.MjModel.from_xml_string(text)


class Stages:
    """What turns with its own joint and with another link: inertias beside those of the bodies of MuJoCo.

    MuJoCo's own means, a tendon with an armature, leaves out whatever inertia couples joints of which none carries the
    other, for it has no place in its matrix.

    Args:
        robot: the robot.
        model: MuJoCo's, built with the same couplings.
        couplings: the motors.
    """

    def __init__(self, robot: Robot, model: mujoco.MjModel, couplings: tuple[Coupling, ...]) -> None:
        extended = robot.extended_model
        self._amounts, inverse = np.zeros((len(couplings), model.nv)), np.zeros(len(couplings))
        for k, coupling in enumerate(couplings):
            gear = next(float(rotor.gear_ratio) for rotor in robot.rotors if rotor.joint == coupling.joint)
            spin = extended.inertias[extended.getJointId(f"{coupling.joint} rotor")].inertia[2, 2]
            inverse[k] = 1.0 / (COUPLED_SHARE * float(spin) * gear**2)
            for name, amount in _turning(extended, coupling, gear).items():
                joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
                self._amounts[k, model.jnt_dofadr[joint]] += amount
        self._model, self._inverse = model, np.diag(inverse)

    def __len__(self) -> int:
        return len(self._amounts)

    def inertia(self, data: mujoco.MjData) -> FloatArray:
        """(nv, nv) inertia of the bodies and these."""
        full = np.zeros((self._model.nv, self._model.nv))
        mujoco.mj_fullM(self._model, data, full)
        if not len(self):
            return full
        return full + self._amounts.T @ np.linalg.inv(self._inverse) @ self._amounts

    def accelerations(self, data: mujoco.MjData) -> FloatArray:
        """(nv,) with them, from those without: the matrix inversion lemma, for inertias of a few ways to turn."""
        if not len(self):
            return np.asarray(data.qacc)
        alone = np.zeros_like(self._amounts)
        mujoco.mj_solveM(self._model, data, alone, self._amounts)
        shared = np.linalg.solve(self._inverse + self._amounts @ alone.T, self._amounts @ data.qacc)
        return np.asarray(data.qacc - shared @ alone)


def _turning(model: pin.Model, coupling: Coupling, gear: float) -> dict[str, float]:
    """What the stage of a coupled rotor turns by with every joint, in space and over its gear.

    It turns with the links that carry it as the rotor does, where their axes stay parallel to its own: what is hidden
    is how it turns with another joint, not that it no longer feels its carrier.
    """
    data = model.createData()
    amounts = {f"{coupling.joint} rotor": 1.0 / gear, coupling.other: coupling.ratio}
    pin.forwardKinematics(model, data, pin.neutral(model))
    names = list(model.names)
    k = names.index(f"{coupling.joint} rotor")
    spin = data.oMi[k].rotation[:, 2]
    while (k := int(model.parents[k])) != 0:
        joint = model.joints[k].createData()
        model.joints[k].calc(joint, np.zeros(1), np.zeros(1))
        along = float(spin @ data.oMi[k].rotation @ np.asarray(joint.S).reshape(6)[3:])
        if abs(abs(along) - 1.0) > PARALLEL:
            break
        amounts[names[k]] = amounts.get(names[k], 0.0) + along / gear
    return amounts


def _text(values: object) -> str:
    return " ".join(repr(float(v)) for v in values)  # type: ignore[attr-defined]


def _place(placement: pin.SE3) -> str:
    quaternion = pin.Quaternion(placement.rotation)
    turn = (quaternion.w, quaternion.x, quaternion.y, quaternion.z)
    return f'pos="{_text(placement.translation)}" quat="{_text(turn)}"'
