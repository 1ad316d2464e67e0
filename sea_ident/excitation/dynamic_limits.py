"""Limits on motor torque and spring deflection: nonlinear in the motion, through the robot's prior parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects import JointEffect, make_effect
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.effects.viscous_friction import ViscousFriction
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.local_slopes import local_slopes
from sea_ident.motion import Motion
from sea_ident.robot import Limits, Robot


@dataclass(frozen=True, eq=False)
class KnownFriction:
    """A friction with known values at one joint."""

    effect: JointEffect
    joint: int
    link: bool
    values: FloatArray


@dataclass(frozen=True, eq=False)
class DynamicLimits:
    """|torque| <= bound for the motors and the springs of a robot that follows q (theta = q).

    A deflection limit is a limit on the torque of the spring that bends it so far: K1 d + K3 d^3 rises with d.

    Attributes:
        robot: the robot, with its prior parameters.
        names: (r,) names of the limits.
        rows: (r,) joint of each.
        springs: (r,) whether it is about the spring (link row) or the motor (sum of link and motor row).
        bound: (r,) largest torque [N m].
        units: (r,) units.
        friction: friction with known values.
    """

    robot: Robot
    names: tuple[str, ...]
    rows: IntArray
    springs: NDArray[np.bool_]
    bound: FloatArray
    units: tuple[str, ...]
    friction: tuple[KnownFriction, ...]

    def __len__(self) -> int:
        return len(self.names)

    def tightened(self, part: float) -> "DynamicLimits":
        """The limits with a part of each taken off."""
        return replace(self, bound=(1.0 - part) * self.bound)

    @cached_property
    def fold(self) -> FloatArray:
        """(nv, r) from torques of coordinates of the extended model to those that are limited."""
        robot = self.robot
        both = robot.link_map + robot.motor_map
        return np.where(self.springs[None, :], robot.link_map[:, self.rows], both[:, self.rows])

    def evaluate(
        self, motion: Motion, *, derivatives: bool = True, shifts: Sequence[FloatArray] | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Torques of a motion.

        Args:
            motion: (N, n) motion; theta = q.
            derivatives: whether to compute them.
            shifts: velocities (n,) or (N, n) that are added to those of the joints where friction is computed
                [rad/s]; the torques follow for each of them in turn.

        Returns:
            (N, r) torques (r more for every further shift), and their derivatives (N, r, 3 n) by q, q' and q'' (empty
            if not asked for).
        """
        n = self.robot.n
        by_coordinate, by_state = self._torques(motion, derivatives)
        torque = by_coordinate @ self.fold
        slopes = np.zeros((len(motion), len(self), 3 * n if derivatives else 0))
        for k, by_motion in enumerate(by_state):
            slopes[:, :, k * n : (k + 1) * n] = self.fold.T @ by_motion
        shifted = [np.zeros(n)] if shifts is None else list(shifts)
        torque, slopes = np.tile(torque, (1, len(shifted))), np.tile(slopes, (1, len(shifted), 1))
        for k, shift in enumerate(shifted):
            for friction in self.friction:
                i = friction.joint
                places = np.flatnonzero((self.rows == i) & (friction.link | ~self.springs)) + k * len(self)
                velocity = motion.dq[:, i] + shift[..., i]
                state = (motion.q[:, i], velocity, motion.q[:, i], velocity)
                torque[:, places] += (friction.effect.local_columns(*state) @ friction.values)[:, None]
                if not derivatives:
                    continue
                for part, block in zip(local_slopes(friction.effect, *state), (0, 1, 0, 1), strict=True):
                    if part is not None:
                        slopes[:, places, block * n + i] += (part @ friction.values)[:, None]
        return torque, slopes

    def _torques(self, motion: Motion, derivatives: bool) -> tuple[FloatArray, tuple[FloatArray, ...]]:
        """(N, nv) torques of the extended model, and (N, nv, n) their derivatives by q, q' and q'' if asked for."""
        robot, model = self.robot, self.robot.extended_model
        both = robot.link_map + robot.motor_map
        x = np.ascontiguousarray(motion.q @ both.T + robot.offset)
        v, a = np.ascontiguousarray(motion.dq @ both.T), np.ascontiguousarray(motion.ddq @ both.T)
        data, torque = model.createData(), np.empty(x.shape)
        if not derivatives:
            for k in range(len(x)):
                torque[k] = pin.rnea(model, data, x[k], v[k], a[k])
            return torque, ()
        slopes = np.empty((3, len(x), model.nv, model.nv))
        for k in range(len(x)):
            slopes[0, k], slopes[1, k], slopes[2, k] = pin.computeRNEADerivatives(model, data, x[k], v[k], a[k])
            torque[k] = data.tau
        return torque, tuple(part @ both for part in slopes)

    def smoothed(self, smoothing: FloatArray) -> "DynamicLimits":
        """The limits with friction that turns over within at least (n,) velocities [rad/s]."""
        widened = []
        for friction in self.friction:
            shape = friction.effect.shape_values
            if "smoothing" in shape:
                shape["smoothing"] = max(shape["smoothing"], float(smoothing[friction.joint]))
                effect = make_effect(friction.effect.name, friction.effect.joint, **shape)
                assert isinstance(effect, JointEffect)
                friction = replace(friction, effect=effect)
            widened.append(friction)
        return replace(self, friction=tuple(widened))


def dynamic_limits(robot: Robot, limits: Limits, notes: list[str]) -> DynamicLimits:
    """The torque and deflection limits of a robot.

    Args:
        robot: the robot; torques are those of its prior inertial parameters, rotors and friction.
        limits: its limits.
        notes: what is left out is added here.

    Returns:
        Those that limit anything.

    Raises:
        ExcitationError: a bound that is NaN or not positive, or a deflection limit at a joint without stiffness.
    """
    names, rows, springs, bounds, units = [], [], [], [], []
    for i, joint in enumerate(robot.joints):
        for kind, values in (("torque", limits.torque), ("deflection", limits.deflection)):
            value = float(values[i])
            if np.isnan(value) or value <= 0.0:
                raise ExcitationError(f"limit {joint.name}.{kind}: is {value}; give a positive number or infinity")
            if np.isposinf(value):
                continue
            if kind == "deflection":
                spring = robot.spring(joint.name) if joint.elastic else None
                if spring is None:
                    raise ExcitationError(f"limit {joint.name}.deflection: the joint is rigid; remove the limit")
                if spring.stiffness is None:
                    notes.append(
                        f"the deflection limit of {joint.name!r} is left out: no prior stiffness predicts what bends it"
                    )
                    continue
                value = spring.stiffness * value + (spring.cubic_stiffness or 0.0) * value**3
            names.append(f"{joint.name}.{'spring_torque' if kind == 'deflection' else 'torque'}")
            rows.append(i)
            springs.append(kind == "deflection")
            bounds.append(value)
            units.append(joint.torque_unit)
    if rows:
        _note_unknown(robot, sorted(set(rows)), notes)
    return DynamicLimits(
        robot,
        tuple(names),
        np.array(rows, dtype=np.intp),
        np.array(springs, dtype=bool),
        np.array(bounds),
        tuple(units),
        known_friction(robot),
    )


def known_friction(robot: Robot) -> tuple[KnownFriction, ...]:
    """Every friction with values in the robot's description."""
    found = []
    for kind, link in ((ViscousFriction, False), (CoulombFriction, False), (LinkFriction, True)):
        for effect in kind.instances(robot):
            assert isinstance(effect, JointEffect)
            values = np.nan_to_num(effect.prior(robot))
            if np.any(values):
                found.append(KnownFriction(effect, robot.index(effect.required_joint), link, values))
    return tuple(found)


def _note_unknown(robot: Robot, rows: list[int], notes: list[str]) -> None:
    """Say which friction the predicted torque leaves out."""
    missing = [
        robot.joints[i]
        for i in rows
        if np.isnan(ViscousFriction(joint=robot.joints[i].name).prior(robot)[0])
        and np.isnan(CoulombFriction(joint=robot.joints[i].name).prior(robot)[0])
    ]
    # friction of an elastic joint's link is in the prediction, and says nothing of its motor's
    links = [joint.name for joint in missing if joint.elastic and (joint.damping or joint.friction)]
    neither = [joint.name for joint in missing if joint.name not in links]
    for names, without, given in (
        (neither, "friction", "none"),
        (links, "friction of the motors", "that of the links alone"),
    ):
        if names:
            notes.append(
                f"torques are predicted without {without} at {', '.join(names)}: the description gives {given}; lower "
                f"the torque limits by what friction may take"
            )
