"""Controllers: what drives the motors along a reference.

A controller is reduced to a torque that depends on time alone and two gains per motor, so that every step of the
integrator sees it implicitly: tau_motor = bias(t) - position_gain theta - velocity_gain theta'.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import SimulationError
from sea_ident.motion import Motion
from sea_ident.regressor import inverse_dynamics
from sea_ident.robot import Robot
from sea_ident.simulation.elastic_inverse import elastic_inverse
from sea_ident.simulation.plant import Plant, plant_from_robot
from sea_ident.simulation.reference import Reference


@dataclass(frozen=True, eq=False)
class Drive:
    """Torque of the motors as a function of time and motor state.

    Attributes:
        bias: (N, n) torque at theta = theta' = 0 [N m].
        position_gain: (n,) [N m/rad].
        velocity_gain: (n,) [N m s/rad].
        reference: (N, n) motion that the motors are meant to follow (theta), and the links with rigid joints (q).
    """

    bias: FloatArray
    position_gain: FloatArray
    velocity_gain: FloatArray
    reference: Motion


class Controller(ABC):
    """How the motors are driven."""

    @abstractmethod
    def drive(self, robot: Robot, reference: Reference, time: FloatArray) -> Drive:
        """The drive at the times (N,) [s]; `robot` is what the controller knows, not the plant."""


def _gained(reference: Motion, feedforward: FloatArray, position_gain: FloatArray, velocity_gain: FloatArray) -> Drive:
    bias = feedforward + reference.theta * position_gain + reference.dtheta * velocity_gain
    return Drive(bias, position_gain, velocity_gain, reference)


CONFIGURATIONS = 50
"""Along a reference over which the inertia that sets the gains is averaged."""

SAMPLES = 1000
"""Of a reference that say how far it moves a joint."""


def reference_inertia(robot: Robot, reference: Reference) -> FloatArray:
    """(n,) mean inertia that each motor moves with all springs stiff, over a reference of links [kg m2]."""
    total = np.zeros(robot.n)
    for sample in _along(reference, CONFIGURATIONS).q:
        h, s, b = robot.mass_matrices(sample)
        total += np.diag(h + s + s.T + b)
    return total / CONFIGURATIONS


def _along(reference: Reference, count: int) -> Motion:
    """(count, n) the reference at so many times: gains must not depend on the steps of the integrator."""
    times = np.linspace(0.0, reference.duration, count, endpoint=False, dtype=np.float64)
    return reference.motion(times)


HIGHEST_GAIN = 100.0
"""Largest factor by which friction may raise the gains of a controller; a joint at rest needs to overcome none."""


@dataclass(frozen=True)
class VelocityController(Controller):
    """Velocity loop with position correction and feed-forward, on the motor side (paper, section III.C).

    tau_m = f tau_model(reference) + J w_v ((theta_r' - theta') + w_p (theta_r - theta)), J being the inertia that the
    motor moves. The reference is applied to the motors, as in the paper: the springs then take the links elsewhere.

    Attributes:
        bandwidth: w_v of the velocity loop [rad/s].
        correction: w_p of the position correction [rad/s].
        feedforward: f, share of the torque of the robot's own URDF model (bodies, rotors, viscous friction) [-].
        held_back: where the Coulomb friction of the description would hold back more than this share of the motion
            (rms), as at small slides behind a large gear, the gains rise until it does not [-].
    """

    bandwidth: float = 60.0
    correction: float = 15.0
    feedforward: float = 1.0
    held_back: float = 0.2

    def __post_init__(self) -> None:
        if not (self.bandwidth > 0.0 and self.correction >= 0.0 and self.feedforward >= 0.0 and self.held_back > 0.0):
            raise SimulationError(
                f"velocity controller: bandwidth {self.bandwidth} and held_back {self.held_back} must be positive, "
                f"correction {self.correction} and feedforward {self.feedforward} not negative"
            )

    def drive(self, robot: Robot, reference: Reference, time: FloatArray) -> Drive:
        """The drive at the times (N,) [s]."""
        motion = reference.motion(time)
        velocity_gain = reference_inertia(robot, reference) * self.bandwidth
        allowed = self.held_back * self.correction * _along(reference, SAMPLES).theta.std(axis=0)
        overcoming = _known_coulomb_friction(robot) / np.maximum(allowed, 1e-12)
        velocity_gain = np.clip(overcoming, velocity_gain, HIGHEST_GAIN * velocity_gain)
        torque = np.zeros_like(motion.q)
        if self.feedforward > 0.0:
            link, motor = inverse_dynamics(robot, motion)
            torque = self.feedforward * (link + motor + motion.dtheta * _known_viscous_friction(robot))
        return _gained(motion, torque, velocity_gain * self.correction, velocity_gain)


def _known_viscous_friction(robot: Robot) -> FloatArray:
    values = [
        (joint.damping or 0.0) + ((joint.actuator.viscous_friction or 0.0) if joint.actuator is not None else 0.0)
        for joint in robot.joints
    ]
    return np.array(values)


def _known_coulomb_friction(robot: Robot) -> FloatArray:
    values = [
        (joint.friction or 0.0) + ((joint.actuator.coulomb_friction or 0.0) if joint.actuator is not None else 0.0)
        for joint in robot.joints
    ]
    return np.array(values)


@dataclass(frozen=True, eq=False)
class ComputedTorque(Controller):
    """The reference applied to the links: motor motion and torque come from the elastic inverse dynamics of a model.

    The spring torque that the link rows need gives the deflection, and so the motor motion; the motor rows then give
    the torque. A motor-side loop corrects what the model does not know.

    Attributes:
        model: the model that the controller uses; None takes the robot's own description.
        bandwidth: of the velocity loop around it [rad/s].
        correction: of the position correction around it [rad/s].
        smoothing: v_off of the model's Coulomb friction [rad/s].
    """

    model: Plant | None = None
    bandwidth: float = 60.0
    correction: float = 15.0
    smoothing: float = 0.02

    def drive(self, robot: Robot, reference: Reference, time: FloatArray) -> Drive:
        """The drive at the times (N,) [s]."""
        model = plant_from_robot(robot) if self.model is None else self.model
        motion, torque = elastic_inverse(model, reference, time, self.smoothing)
        velocity_gain = reference_inertia(model.robot, reference) * self.bandwidth
        return _gained(motion, torque, velocity_gain * self.correction, velocity_gain)
