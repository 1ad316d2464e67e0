"""A link that bends behind its encoder."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Anchor, Effect, Shape
from sea_ident.effects.load import SPRING_LAW
from sea_ident.effects.signal import SignalEffect, below, rate_of, with_joint
from sea_ident.exceptions import EffectError
from sea_ident.motion import Motion
from sea_ident.robot import Robot

NEWTON_STEPS = 4
"""Steps to the deflection of the whole; a linear spring needs one."""

LEAST = 0.1
"""Smallest share of the compliance that lies before the encoder [-]."""

FEWEST_SAMPLES = 16
"""Samples from which on the rate of an acceleration is told."""


@dataclass(frozen=True)
class LinkFlexibility(SignalEffect):
    """The bodies stand at q - c tau_spring, where q is what the link encoder shows.

    The compliance bends without inertia of its own, and by the damping of the spring too: at a few hertz that is some
    hundredths of what it bends, out of phase with the rest. The spring of the model is the whole of both compliances,
    between motor and bodies: it is what tau_spring follows from in the description. With the law of the part before
    the encoder, whose deflection is measured, tau_spring follows from that: it is what a model without this effect
    finds.

    Attributes:
        joint: joint at which it acts.
        compliance: c, behind the encoder [rad/(N m)].
        stiffness: K1 of the part before the encoder, None to take the whole spring of the description [N m/rad].
        cubic_stiffness: K3 of that part [N m/rad3].
        damping: D of that part [N m s/rad].
    """

    compliance: float = 0.0
    stiffness: float | None = None
    cubic_stiffness: float | None = None
    damping: float | None = None

    name: ClassVar[str] = "link_flexibility"
    depth: ClassVar[int] = 1
    source: ClassVar[str] = "Wernholt, Moberg, Nonlinear gray-box identification using local models, Automatica 2011"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("compliance", "rad/(N m)", 0.0, 0.01, logarithmic=False),)

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """At every elastic joint."""
        return tuple(cls(joint=joint.name) for joint in robot.joints if joint.elastic)

    def anchored(self, anchor: Anchor) -> "LinkFlexibility":
        """With the spring of the model; the bodies stay where they are."""
        linear, cubic, damping = (anchor.value(f"{self.joint}.{name}") for name in SPRING_LAW)
        if self.stiffness is None:
            return replace(self, stiffness=linear, cubic_stiffness=cubic, damping=damping)
        before, bends = self.stiffness, self.compliance * self.stiffness
        now = linear * (1.0 + bends)  # the whole is softer by what bends behind the encoder
        if not (before > 0.0 and now > 0.0):
            return self
        # what the bodies were moved by the other terms so far was not left for the spring of the whole to explain
        moved = bends / (1.0 + bends)
        return replace(
            self,
            compliance=self.compliance * before / now,
            stiffness=now,
            cubic_stiffness=cubic * (1.0 + bends) ** 3 + (self.cubic_stiffness or 0.0) * moved,
            damping=damping * (1.0 + bends) + (self.damping or 0.0) * moved,
        )

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """A compliance up to that of the spring before the encoder, where this is a soft one."""
        if self.stiffness is None or not self.stiffness > 0.0:
            return self.amounts
        return tuple(replace(each, upper=max(each.upper, 1.0 / self.stiffness)) for each in self.amounts)

    def corrected(self, robot: Robot, motion: Motion) -> Motion:
        """Q of the bodies."""
        i = self.required_index(robot)
        d, c = motion.deflection[:, i], self.compliance
        rate, bend = motion.deflection_rate[:, i], motion.ddtheta[:, i] - motion.ddq[:, i]
        if self.stiffness is not None:
            linear, cubic, damping = self.stiffness, self.cubic_stiffness or 0.0, self.damping or 0.0
            whole = d + c * (linear * d + cubic * d**3)
            share = 1.0 + c * (linear + 3.0 * cubic * d**2)
            whole_rate, whole_bend = share * rate, share * bend + c * 6.0 * cubic * d * rate**2
        else:
            linear, cubic, damping = self._whole_spring(robot)
            whole, most = d, np.abs(d) / LEAST
            for _ in range(NEWTON_STEPS):
                slope = linear + 3.0 * cubic * whole**2
                step = (whole - d - c * (linear * whole + cubic * whole**3)) / np.maximum(1.0 - c * slope, LEAST)
                # a compliance of more than the whole has no deflection; it must not run away in search of one
                whole = np.clip(whole - step, -most, most)
            share = np.maximum(1.0 - c * (linear + 3.0 * cubic * whole**2), LEAST)
            whole_rate = rate / share
            whole_bend = (bend + c * 6.0 * cubic * whole * whole_rate**2) / share
            # of the part before the encoder
            stiffer = 1.0 / max(1.0 - c * linear, LEAST)
            linear, damping = stiffer * linear, stiffer**2 * damping
        lag = self._lag(motion.time, np.stack([rate, bend]), damping, linear)
        return with_joint(
            robot,
            motion,
            i,
            motion.theta[:, i] - whole - lag[0],
            motion.dtheta[:, i] - whole_rate - lag[1],
            motion.ddtheta[:, i] - whole_bend - lag[2],
        )

    def read(self, robot: Robot, motion: Motion) -> Motion:
        """As it is: what bends behind an encoder is no error of it."""
        return motion

    def modified(self, robot: Robot, values: FloatArray) -> Robot:
        """As it is: the spring of its description is the whole.

        Raises:
            EffectError: if more would bend behind the encoder than in all.
        """
        whole = robot.spring(str(self.joint)).stiffness if self.stiffness is None else None
        if whole is not None and self.compliance * whole >= 1.0:
            unit = self.shape_unit(self.amounts[0], robot)
            raise EffectError(
                f"{self.title}: a compliance of {self.compliance:g} {unit} behind the encoder is more than the "
                f"{1.0 / whole:.3g} {unit} of all that gives between motor and link; give less, or a softer spring"
            )
        return robot

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Q where the encoder sits, between the two compliances.

        Raises:
            EffectError: if the signals do not hold the spring torque.
        """
        i = self.required_index(robot)
        if "tau_spring" not in signals:
            raise EffectError(f"the effect {self.name!r} needs the spring torque of the simulation, tau_spring")
        out = dict(signals)
        out["q"] = signals["q"].copy()
        out["q"][:, i] += self.compliance * signals["tau_spring"][:, i]
        return out

    def _lag(self, time: FloatArray, rates: FloatArray, damping: float, stiffness: float) -> FloatArray:
        """(3, N) what the damping bends, with its rates, from the first two rates (2, N) of the deflection.

        Up to the frequency at which the damper becomes stiffer than the spring: beyond it, three derivatives of a
        position are noise more than anything. Of a few samples the third is not told at all.
        """
        lag = self.compliance * damping
        if lag == 0.0 or len(time) < FEWEST_SAMPLES:
            return lag * np.stack([*rates, np.zeros(len(time))])
        slow = [below(time, each, abs(stiffness / damping)) for each in rates]
        return lag * np.stack([*slow, rate_of(time, slow[1])])

    def _whole_spring(self, robot: Robot) -> tuple[float, float, float]:
        spring = robot.spring(str(self.joint))
        if spring.stiffness is None:
            raise EffectError(
                f"the effect {self.name!r} at {self.joint!r} needs the stiffness of its spring: give stiffness=..., "
                "or put it into the annotation"
            )
        return spring.stiffness, spring.cubic_stiffness or 0.0, spring.damping or 0.0
