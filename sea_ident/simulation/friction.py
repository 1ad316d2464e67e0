"""Friction laws of the simulator, and friction that varies from pass to pass.

They are objects of their own: what the simulator does at zero speed is not what a model assumes there.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import exp, tanh
from typing import Protocol

import numpy as np

from sea_ident.exceptions import SimulationError
from sea_ident.robot import Robot

SLIDE = 0.1
"""Speeds [m/s] of a slide per speeds [rad/s] of a turning joint, where nothing else is known."""


class JointFriction(Protocol):
    """Friction of one side of one joint in a running simulation.

    Attributes:
        level: factor on the Coulomb friction [-].
    """

    level: float

    def torque(self, position: float, velocity: float) -> float:
        """Torque at a trial state, positive at positive speed [N m]."""

    def slope(self, velocity: float) -> float:
        """Slope over the speed, for the implicit part of the integrator [N m s/rad]."""

    def accept(self, position: float, velocity: float) -> None:
        """The state at the end of a step that is kept."""


class FrictionLaw(ABC):
    """How Coulomb friction behaves around zero speed."""

    @abstractmethod
    def start(self, viscous: float, coulomb: float, position: float) -> JointFriction:
        """Friction of one joint side at rest at `position`; viscous [N m s/rad], Coulomb [N m]."""

    def steepest(self, coulomb: float) -> float:
        """Largest slope of Coulomb friction [N m] over the speed [N m s/rad], none by default."""
        return 0.0


@dataclass(frozen=True)
class SmoothCoulomb(FrictionLaw):
    """c tanh(v / v_off), v_off being the simulator's own (paper, eq. 3).

    Attributes:
        smoothing: v_off [rad/s] or [m/s].
    """

    smoothing: float = 0.008

    @staticmethod
    def usual(robot: Robot) -> tuple["SmoothCoulomb", ...]:
        """(n,) one per joint; slides, which move at tenths of a metre per second, turn over at a tenth of the speed."""
        return tuple(
            SmoothCoulomb(SLIDE * SmoothCoulomb.smoothing if j.prismatic else SmoothCoulomb.smoothing)
            for j in robot.joints
        )

    def __post_init__(self) -> None:
        if not self.smoothing > 0.0:
            raise SimulationError(f"the smoothing speed of Coulomb friction is {self.smoothing}; it must be positive")

    def start(self, viscous: float, coulomb: float, position: float) -> JointFriction:
        """Friction without memory."""
        return _SmoothJoint(viscous, coulomb, self.smoothing)

    def steepest(self, coulomb: float) -> float:
        """The slope at rest."""
        return coulomb / self.smoothing


class _SmoothJoint:
    __slots__ = ("coulomb", "level", "smoothing", "viscous")

    def __init__(self, viscous: float, coulomb: float, smoothing: float) -> None:
        self.viscous, self.coulomb, self.smoothing, self.level = viscous, coulomb, smoothing, 1.0

    def torque(self, position: float, velocity: float) -> float:
        return self.viscous * velocity + self.coulomb * self.level * tanh(velocity / self.smoothing)

    def slope(self, velocity: float) -> float:
        sign = tanh(velocity / self.smoothing)
        return self.viscous + self.coulomb * self.level / self.smoothing * (1.0 - sign * sign)

    def accept(self, position: float, velocity: float) -> None:
        return None


@dataclass(frozen=True)
class PreslidingCoulomb(FrictionLaw):
    """True stiction: below the Coulomb torque the contact deflects like a spring and does not slide (Dahl, 1968).

    dF/dx = (c / deflection) (1 - F sgn(v) / c); the state is updated exactly over the distance of a step.

    Attributes:
        deflection: distance over which friction builds up [rad] or [m].
    """

    deflection: float = 5e-4

    def __post_init__(self) -> None:
        if not self.deflection > 0.0:
            raise SimulationError(f"the presliding deflection is {self.deflection}; it must be positive")

    def start(self, viscous: float, coulomb: float, position: float) -> JointFriction:
        """Friction with an unloaded contact."""
        return _PreslidingJoint(viscous, coulomb, self.deflection, position)


class _PreslidingJoint:
    __slots__ = ("coulomb", "deflection", "last_position", "level", "load", "viscous")

    def __init__(self, viscous: float, coulomb: float, deflection: float, position: float) -> None:
        self.viscous, self.coulomb, self.deflection = viscous, coulomb, deflection
        self.last_position, self.load, self.level = position, 0.0, 1.0

    def _load(self, position: float) -> float:
        distance = position - self.last_position
        end = self.level if distance > 0.0 else -self.level
        return end + (self.load - end) * exp(-abs(distance) / self.deflection)

    def torque(self, position: float, velocity: float) -> float:
        return self.viscous * velocity + self.coulomb * self._load(position)

    def slope(self, velocity: float) -> float:
        return self.viscous

    def accept(self, position: float, velocity: float) -> None:
        self.load = self._load(position)
        self.last_position = position


@dataclass(frozen=True)
class FrictionJitter:
    """Coulomb friction near zero speed that is another one at every pass.

    From one reversal to the next the motor's Coulomb friction is multiplied by 1 + s exp(-(v / v_j)^2); s is drawn
    anew at every reversal. Its mean is zero: jitter is no Stribeck friction.

    Attributes:
        spread: standard deviation of s [-].
        speed: v_j, speed up to which it acts [rad/s] or [m/s].
    """

    spread: float = 0.5
    speed: float = 0.1

    def __post_init__(self) -> None:
        if self.spread < 0.0 or not self.speed > 0.0:
            raise SimulationError(
                f"friction jitter: spread {self.spread} must not be negative, speed {self.speed} must be positive"
            )

    @staticmethod
    def usual(robot: Robot) -> tuple["FrictionJitter", ...]:
        """(n,) one per joint; that of slides ends at a tenth of the speed."""
        return tuple(
            FrictionJitter(speed=SLIDE * FrictionJitter.speed if j.prismatic else FrictionJitter.speed)
            for j in robot.joints
        )

    @staticmethod
    def none() -> "FrictionJitter":
        """Every pass alike."""
        return FrictionJitter(spread=0.0)

    def on(self, friction: JointFriction, seed: np.random.SeedSequence) -> JointFriction:
        """The friction of a joint with this jitter."""
        if self.spread == 0.0:
            return friction
        return _JitteredJoint(friction, self, np.random.default_rng(seed))


class _JitteredJoint:
    """Two amplitudes, one for each direction, so that a step across zero speed sees the right one on each side."""

    __slots__ = ("amplitudes", "forward", "friction", "generator", "jitter", "level")

    def __init__(self, friction: JointFriction, jitter: FrictionJitter, generator: np.random.Generator) -> None:
        self.friction, self.jitter, self.generator, self.level = friction, jitter, generator, 1.0
        self.amplitudes = [self._draw(), self._draw()]
        self.forward = False

    def _draw(self) -> float:
        # Friction never pushes: the few draws beyond are cut on both sides, so that the mean stays zero.
        return max(-1.0, min(1.0, self.jitter.spread * float(self.generator.standard_normal())))

    def _set_level(self, velocity: float) -> None:
        ratio = velocity / self.jitter.speed
        self.friction.level = self.level * (1.0 + self.amplitudes[velocity > 0.0] * exp(-ratio * ratio))

    def torque(self, position: float, velocity: float) -> float:
        self._set_level(velocity)
        return self.friction.torque(position, velocity)

    def slope(self, velocity: float) -> float:
        self._set_level(velocity)
        return self.friction.slope(velocity)

    def accept(self, position: float, velocity: float) -> None:
        self._set_level(velocity)
        self.friction.accept(position, velocity)
        forward = velocity > 0.0
        if forward != self.forward:
            self.forward = forward
            self.amplitudes[not forward] = self._draw()
