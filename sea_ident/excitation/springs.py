"""Springs with prior stiffness: the torque that bends them, and how far."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.dynamic_limits import DynamicLimits, known_friction
from sea_ident.motion import Motion
from sea_ident.robot import Robot


@dataclass(frozen=True)
class PredictedMotors:
    """Predict theta from q with prior springs, so that motor and spring columns take part in a design.

    The deflection is that of ``K1 d + K3 d^3 = tau_spring``, with the spring torque of the prior model at theta = q;
    damping and the coupling by theta'' - q'' are left out.

    Attributes:
        stiffness: K1 [N m/rad] of joints whose description gives none, or another.
        cubic_stiffness: K3 [N m/rad3] likewise.
    """

    stiffness: Mapping[str, float] | None = None
    cubic_stiffness: Mapping[str, float] | None = None

    def springs(self, robot: Robot) -> "SpringTorque":
        """The springs of a robot.

        Raises:
            ExcitationError: no spring, or one of unknown stiffness.
        """
        joints = robot.elastic_indices
        if not len(joints):
            raise ExcitationError(f"{robot.name} has no elastic joint; leave out motors=PredictedMotors()")
        linear, cubic = np.full(robot.n, np.inf), np.zeros(robot.n)
        for i in joints:
            name = robot.joint_names[int(i)]
            spring = robot.spring(name)
            stiffness = (self.stiffness or {}).get(name, spring.stiffness)
            if stiffness is None or not stiffness > 0.0:
                raise ExcitationError(
                    f"joint {name!r}: its deflection can only be predicted with a positive prior stiffness; give it in "
                    f"the annotation (stiffness=...) or as PredictedMotors(stiffness={{{name!r}: ...}})"
                )
            linear[i] = stiffness
            cubic[i] = (self.cubic_stiffness or {}).get(name, spring.cubic_stiffness or 0.0)
        names = tuple(f"{robot.joint_names[int(i)]}.spring_torque" for i in joints)
        torque = DynamicLimits(
            robot,
            names,
            joints,
            np.ones(len(joints), dtype=bool),
            np.full(len(joints), np.inf),
            tuple(robot.joints[int(i)].torque_unit for i in joints),
            known_friction(robot),
        )
        return SpringTorque(torque, joints, linear, np.maximum(cubic, 0.0))


@dataclass(frozen=True, eq=False)
class SpringTorque:
    """Springs with known stiffness.

    Attributes:
        torque: the torque through each.
        joints: (e,) elastic joints.
        linear: (n,) K1 [N m/rad], infinite at rigid joints.
        cubic: (n,) K3 [N m/rad3].
    """

    torque: DynamicLimits
    joints: IntArray
    linear: FloatArray
    cubic: FloatArray

    def predict(self, motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Deflections of a motion.

        Args:
            motion: (N, n) motion of the links.

        Returns:
            (N, n) deflection [rad], (N, n) its slope by the spring torque [rad/(N m)], and (N, n, 3 n) slope of the
            torque by q, q' and q''; zero at rigid joints.
        """
        found, by_state = self.torque.evaluate(motion)
        samples, n = motion.q.shape
        torque, slopes = np.zeros((samples, n)), np.zeros((samples, n, 3 * n))
        torque[:, self.joints], slopes[:, self.joints] = found, by_state
        deflection = torque / self.linear
        # |torque| / K1 is not below the root of the rising convex branch: Newton's method runs down to it
        for _ in range(60):
            stiffness = self.linear + 3.0 * self.cubic * deflection**2
            wrong = np.where(
                np.isfinite(self.linear),
                np.where(np.isfinite(self.linear), self.linear, 0.0) * deflection + self.cubic * deflection**3 - torque,
                0.0,
            )
            step = wrong / stiffness
            deflection = deflection - step
            if float(np.abs(step).max(initial=0.0)) <= 1e-15:
                break
        softness = 1.0 / (self.linear + 3.0 * self.cubic * deflection**2)
        return deflection, softness, slopes
