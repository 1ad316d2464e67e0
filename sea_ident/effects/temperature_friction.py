"""Friction that follows the measured temperature."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import SimulationState
from sea_ident.effects.base import Anchor, Column, Effect, JointEffect, smooth_sign
from sea_ident.effects.drift import TrendEffect, friction_throughout
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TemperatureFriction(JointEffect, TrendEffect):
    """Viscous and Coulomb friction of the motor, times T - T_0.

    Attributes:
        joint: joint at which it acts.
        reference: T_0 [degC].
        rise: of the temperature in a simulation, where nothing else gives it [K].
        time_constant: of that rise [s].
        smoothing: speed around which the sign is smoothed [rad/s] or [m/s].
    """

    reference: float = 25.0
    rise: float = 15.0
    time_constant: float = 100.0
    smoothing: float = 0.01

    name: ClassVar[str] = "temperature_friction"
    follows: ClassVar[str | None] = "temperature"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Bittencourt, Gunnarsson, Static friction in a robot joint, ASME J. Dyn. Sys. 134, 2012"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Change of the viscous and of the Coulomb friction per kelvin."""
        torque, position = self.units_of(robot)
        units = (f"{torque} s/{position}/K", f"{torque}/K")
        return tuple(
            Column(self.parameter_name(label), unit, self.name, self.joint, self.side)
            for label, unit in zip(("viscous", "coulomb"), units, strict=True)
        )

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Columns for one kelvin."""
        return np.stack([dtheta, smooth_sign(dtheta, self.smoothing)], axis=1)

    def evaluate(self, state: State) -> Contribution:
        """Columns times the measured temperature.

        Raises:
            EffectError: if the temperature was not measured.
        """
        if state.channels is None or "temperature" not in state.channels:
            raise EffectError(f"the effect {self.name!r} needs the channel temperature_{self.joint} [degC]")
        i = state.robot.index(self.required_joint)
        above = state.channels["temperature"][:, i] - self.reference
        rows = self.steady(state)
        return Contribution(rows.link * above[:, None, None], rows.motor * above[:, None, None], rows.joint)

    def steady(self, state: State) -> Contribution:
        """Columns for one kelvin."""
        return JointEffect.evaluate(self, state)

    def change(self, time: FloatArray, temperature: FloatArray | None) -> FloatArray:
        """Measured temperature above the reference.

        Raises:
            EffectError: if it was not measured.
        """
        if temperature is None:
            raise EffectError(f"the effect {self.name!r} needs the channel temperature_{self.joint} [degC]")
        return temperature - self.reference

    @property
    def moment(self) -> str:
        """Where it is none, for people."""
        return f"at {self.reference:.4g} degC"

    def about(self, change: float) -> "TemperatureFriction":
        """With that temperature as T_0, which it has in a simulation throughout."""
        return replace(self, reference=self.reference + change, rise=0.0)

    def throughout(self, values: FloatArray, change: float) -> tuple[tuple[Effect, FloatArray], ...]:
        """So much more friction."""
        return friction_throughout(self.required_joint, self.smoothing, change * values)

    def anchored(self, anchor: Anchor) -> "TemperatureFriction":
        """With the smoothing of the model's Coulomb friction."""
        return replace(self, smoothing=anchor.smoothing(self.required_joint) or self.smoothing)

    def temperature(self, time: FloatArray) -> FloatArray:
        """Temperature in a simulation at the times (any shape) [degC]."""
        value: FloatArray = self.reference - self.rise * np.expm1(-time / self.time_constant)
        return value

    def present_columns(self, state: SimulationState) -> FloatArray:
        """Columns times the temperature, which rises as `rise` and `time_constant` say."""
        return super().present_columns(state) * (self.temperature(np.array(state.time)) - self.reference)

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """A thermometer beside the other sensors."""
        out = dict(signals)
        temperature = (
            out["temperature"].copy() if "temperature" in out else np.full((len(time), robot.n), self.reference)
        )
        temperature[:, robot.index(self.required_joint)] = self.temperature(time)
        out["temperature"] = temperature
        return out
