"""A push from outside during part of the time."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Action, Column, Contribution, Effect, Shape, Side, SimulationState, State
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot


@dataclass(frozen=True)
class ExternalForce(Effect):
    """A constant force on the centre of mass of a link from `start` to `stop`, -J' f in the link rows.

    Attributes:
        joint: joint whose link is pushed.
        start: [s].
        stop: [s].
    """

    start: float = 0.0
    stop: float = float("inf")

    name: ClassVar[str] = "external_force"
    side: ClassVar[Side] = Side.LINK
    source: ClassVar[str] = (
        "Haddadin, De Luca, Albu-Schaffer, Robot collisions: a survey, IEEE Trans. Robotics 33, 2017"
    )
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("start", "s", 0.0, 1e6, logarithmic=False),
        Shape("stop", "s", 0.0, 1e6, logarithmic=False),
    )

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Force along the axes of the base."""
        self._body(robot)
        return tuple(Column(self.parameter_name(axis), "N", self.name, self.joint, self.side) for axis in "xyz")

    def evaluate(self, state: State) -> Contribution:
        """-J' while it pushes."""
        motion, robot = state.motion, state.robot
        link = np.zeros((len(motion), robot.n, 3))
        pushes = np.flatnonzero((motion.time >= self.start) & (motion.time <= self.stop))
        body, data = self._body(robot), robot.extended_model.createData()
        for k in pushes:
            x = robot.extended_state(motion.q[k], motion.theta[k])
            link[k] = -robot.link_map.T @ _jacobian(robot, data, body, x)
        return Contribution(link, np.zeros_like(link))

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The same at the present state."""
        body, data = self._body(robot), robot.extended_model.createData()
        force = np.asarray(values, dtype=np.float64)

        def act(state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
            if self.start <= state.time <= self.stop:
                x = robot.extended_state(state.q, state.theta)
                link[:] -= robot.link_map.T @ (_jacobian(robot, data, body, x) @ force)

        return act

    def variants(self, state: State) -> tuple["ExternalForce", ...]:
        """None but itself: the times come from the residual."""
        return (self,)

    def _body(self, robot: Robot) -> int:
        if self.joint is None:
            raise EffectError(f"the effect {self.name!r} pushes a link; give the joint that moves it, joint=...")
        robot.index(self.joint)
        names = [robot.extended_model.names[int(index)] for index in robot.body_indices]
        return int(robot.body_indices[names.index(self.joint)])


def _jacobian(robot: Robot, data: pin.Data, body: int, x: FloatArray) -> FloatArray:
    """(nv, 3) transposed Jacobian of the centre of mass of a body, in the axes of the base."""
    model = robot.extended_model
    pin.computeJointJacobians(model, data, x)
    full = pin.getJointJacobian(model, data, body, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    arm = data.oMi[body].rotation @ model.inertias[body].lever
    jacobian: FloatArray = full[:3] - pin.skew(arm) @ full[3:]
    return jacobian.T
