"""A drive that gives its torque later than the record says."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Shape
from sea_ident.effects.signal import DelayEffect, ahead
from sea_ident.effects.state import Contribution
from sea_ident.motion import Motion
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TorqueDelay(DelayEffect):
    """The torque recorded at t acts at t + delay.

    Attributes:
        joint: joint at which it acts, None where it does at all of them.
        delay: [s].
    """

    delay: float = 0.0

    name: ClassVar[str] = "torque_delay"
    source: ClassVar[str] = "Swevers, Verdonck, De Schutter, Dynamic model identification for industrial robots, 2007"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("delay", "s", -0.1, 0.1, logarithmic=False),)

    @property
    def reservation(self) -> str | None:
        """At all joints, that encoders which are late are the same."""
        if self.joint is not None:
            return None
        early, late = ("early", "late") if self.delay > 0.0 else ("late", "early")
        return (
            f"{self.title} is the time between the recorded torques and the encoders: torques that are {early} by "
            f"{abs(self.delay):.3g} s, or all encoders that are {late} by that, those of links and motors alike"
        )

    def turning(self, motion: Motion, robot: Robot) -> dict[int, FloatArray]:
        """The speed of the motor when the recorded torque acts: that is when its friction jumps in the record."""
        return {i: ahead(motion.time, motion.dtheta[:, i], self.delay) for i in self.indices(robot)}

    def shifted(self, robot: Robot, time: FloatArray, rows: Contribution) -> Contribution:
        """The rows that give the torque of these motors, ahead of time."""
        late = [i for i in self.indices(robot) if rows.joint in (None, i)]
        if not late:
            return rows
        link, motor = rows.link.copy(), rows.motor.copy()
        for i in late:
            motor[:, i] = ahead(time, rows.motor[:, i], self.delay)
            if not robot.joints[i].elastic:
                link[:, i] = ahead(time, rows.link[:, i], self.delay)
        return Contribution(link, motor, rows.joint)

    def delivered(self, robot: Robot, time: FloatArray, tau_motor: FloatArray) -> FloatArray:
        """The torque when it acted."""
        out = tau_motor.copy()
        for i in self.indices(robot):
            out[:, i] = ahead(time, tau_motor[:, i], -self.delay)
        return out

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """The torque as recorded."""
        out = dict(signals)
        if "tau_motor" in signals:
            out["tau_motor"] = signals["tau_motor"].copy()
            for i in self.indices(robot):
                out["tau_motor"][:, i] = ahead(time, signals["tau_motor"][:, i], self.delay)
        return out
