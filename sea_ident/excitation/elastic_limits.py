"""Limits of a robot whose links follow its motors on springs: how far a periodic motion keeps them."""

from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.excitation.curvature_bounds import MotionBounds
from sea_ident.excitation.dynamic_limits import DynamicLimits
from sea_ident.excitation.elastic_response import Springs, elastic_response
from sea_ident.excitation.linear_limits import LinearLimits
from sea_ident.excitation.space_limits import SpaceLimits
from sea_ident.excitation.space_proof import proven_rooms
from sea_ident.excitation.walls import parabolic_overshoot
from sea_ident.motion import FourierSeries, Motion
from sea_ident.regressor import inverse_dynamics

# samples for one harmonic of the motors at which torques are looked at
_FINE = 64


@dataclass(frozen=True, eq=False)
class ElasticLimits:
    """The limits of a robot, for links that go where the springs take them.

    Attributes:
        springs: the robot and its springs.
        linear: limits on positions, velocities and accelerations of the links.
        dynamic: limits on torque and deflection.
        space: half-spaces and self-collision.
    """

    springs: Springs
    linear: LinearLimits
    dynamic: DynamicLimits
    space: SpaceLimits

    @property
    def names(self) -> tuple[str, ...]:
        """(m,) names in the order of `margins`."""
        return (*self.linear.names, *self.dynamic.names, *self.space.names)

    @property
    def units(self) -> tuple[str, ...]:
        """(m,) units in the order of `margins`."""
        return (*self.linear.units, *self.dynamic.units, *(["m"] * len(self.space)))

    @property
    def sizes(self) -> FloatArray:
        """(m,) range of each limit, in the order of `margins`."""
        space = np.full(len(self.space), self.space.reach)
        return np.concatenate([self.linear.width, 2.0 * self.dynamic.bound, space])

    def tightened(self, part: float) -> "ElasticLimits":
        """With a part of the range taken off at either side of limits on the motion, and off torques."""
        less = 0.5 * part * self.linear.width
        linear = replace(self.linear, lower=self.linear.lower + less, upper=self.linear.upper - less)
        return replace(self, linear=linear, dynamic=self.dynamic.tightened(part))

    def margins(self, motors: FourierSeries) -> FloatArray | None:
        """(m,) smallest distance to each limit while the motors follow a series; None if no response was found.

        Those of positions, velocities, accelerations and their combinations are exact for the series of the links,
        those in space are proven for it; torques are looked at on a grid, with parabolas through its points.
        """
        response = elastic_response(self.springs, motors)
        if response is None:
            return None
        count = _FINE * motors.harmonics
        torque = self.torques(response.motion(motors.sample(samples=count).time)).T
        below, above = parabolic_overshoot(torque)
        largest = np.maximum(torque + above, below - torque).max(axis=1, initial=0.0)
        links = response.links
        rooms = proven_rooms(self.space, links.motion, links.period, MotionBounds.of(links))
        return np.concatenate([self.linear.margins(links), self.dynamic.bound - largest, rooms])

    def torques(self, motion: Motion) -> FloatArray:
        """(N, r) torques of motors, and of springs as far as their deflection makes them [N m]."""
        link, motor = inverse_dynamics(self.springs.robot, motion)
        whole = np.where(self.dynamic.springs, 0.0, (link + motor)[:, self.dynamic.rows])
        bent = np.where(self.dynamic.springs, self.stiffness(motion.deflection)[0][:, self.dynamic.rows], 0.0)
        torque: FloatArray = whole + bent + self.friction(motion)
        return torque

    def friction(self, motion: Motion) -> FloatArray:
        """(N, r) part of `torques` that is friction of known size [N m]."""
        found = np.zeros((len(motion), len(self.dynamic)))
        for friction in self.dynamic.friction:
            i = friction.joint
            state = (motion.q[:, i], motion.dq[:, i], motion.theta[:, i], motion.dtheta[:, i])
            places = (self.dynamic.rows == i) & ~self.dynamic.springs
            found[:, places] += (friction.effect.local_columns(*state) @ friction.values)[:, None]
        return found

    def stiffness(self, deflection: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N, n) torque that bends springs so far, and (N, n) its slope; 0 at joints whose spring is not known."""
        linear, cubic = np.zeros((2, self.springs.robot.n))
        linear[self.springs.joints], cubic[self.springs.joints] = self.springs.stiffness, self.springs.cubic
        return linear * deflection + cubic * deflection**3, linear + 3.0 * cubic * deflection**2
