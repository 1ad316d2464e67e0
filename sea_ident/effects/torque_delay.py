"""A drive that gives its torque later than the record says."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Shape
from sea_ident.effects.signal import SignalEffect, ahead
from sea_ident.effects.state import Contribution
from sea_ident.motion import Motion
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TorqueDelay(SignalEffect):
    """The torque recorded at t acts at t + delay.

    Attributes:
        joint: joint at which it acts.
        delay: [s].
    """

    delay: float = 0.0

    name: ClassVar[str] = "torque_delay"
    source: ClassVar[str] = "Swevers, Verdonck, De Schutter, Dynamic model identification for industrial robots, 2007"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("delay", "s", -0.1, 0.1, logarithmic=False),)

    def turning(self, motion: Motion, robot: Robot) -> tuple[int, FloatArray] | None:
        """The speed of the motor when the recorded torque acts: that is when its friction jumps in the record."""
        i = self.required_index(robot)
        return i, ahead(motion.time, motion.dtheta[:, i], self.delay)

    def shifted(self, robot: Robot, time: FloatArray, rows: Contribution) -> Contribution:
        """The rows that give the torque of this motor, ahead of time."""
        i = self.required_index(robot)
        if rows.joint not in (None, i):
            return rows
        motor, link = rows.motor.copy(), rows.link
        motor[:, i] = ahead(time, rows.motor[:, i], self.delay)
        if not robot.joints[i].elastic:
            link = rows.link.copy()
            link[:, i] = ahead(time, rows.link[:, i], self.delay)
        return Contribution(link, motor, rows.joint)

    def delivered(self, robot: Robot, time: FloatArray, tau_motor: FloatArray) -> FloatArray:
        """The torque when it acted."""
        i = self.required_index(robot)
        out = tau_motor.copy()
        out[:, i] = ahead(time, tau_motor[:, i], -self.delay)
        return out

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """The torque as recorded."""
        i = self.required_index(robot)
        out = dict(signals)
        if "tau_motor" in signals:
            out["tau_motor"] = signals["tau_motor"].copy()
            out["tau_motor"][:, i] = ahead(time, signals["tau_motor"][:, i], self.delay)
        return out
