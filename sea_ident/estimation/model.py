"""The identified model: base parameters with their covariance, springs, and how well they fit."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import BaseParameters
from sea_ident.effects import Effect
from sea_ident.estimation.agreement import Agreement
from sea_ident.estimation.observations import base_rows
from sea_ident.estimation.spring_result import SpringResult, SpringTerm
from sea_ident.estimation.trend_term import TrendTerm, trend_torque
from sea_ident.estimation.uncertainty import CovarianceKind, Uncertainty
from sea_ident.estimation.update_result import Update
from sea_ident.motion import Motion
from sea_ident.robot import Robot


@dataclass(frozen=True, eq=False)
class Fit:
    """How well a model fits the data it was identified from.

    Attributes:
        rms_residual: (n,) rms of the residual of the mean torque [N m] or [N].
        noise_std: (n,) standard deviation of the noise of the mean torque, from the scatter between periods [N m].
        rms_torque: (n,) rms of the mean torque [N m] or [N].
        condition_number: of the column-normalised F.
        log_det: natural logarithm of det F' F.
        log_det_weighted: natural logarithm of det F' Sigma^-1 F.
        samples: N of the mean motion.
        periods: P.
        period: [s], None where the recording is not periodic.
        agreement: residual away from reversals beside its noise; None where one period says nothing of noise.
    """

    rms_residual: FloatArray
    noise_std: FloatArray
    rms_torque: FloatArray
    condition_number: float
    log_det: float
    log_det_weighted: float
    samples: int
    periods: int
    period: float | None
    agreement: Agreement | None = None


@dataclass(frozen=True, eq=False)
class Excerpt:
    """The data behind a model, thinned, so that a report can be written from the model alone.

    Attributes:
        motion: (K, n) mean motion.
        tau_motor: (K, n) mean motor torque [N m].
        tau_std: (K, n) standard deviation of the torque of one period [N m].
        tau_model: (K, n) torque of the model [N m].
        tau_spring: (K, m) spring torque of the elastic joints [N m].
        residual_std: (K, n) standard deviation of the residual of one period, noise of the encoders in it [N m].
    """

    motion: Motion
    tau_motor: FloatArray
    tau_std: FloatArray
    tau_model: FloatArray
    tau_spring: FloatArray
    residual_std: FloatArray


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect that stands on its own.

    Attributes:
        name: name of the parameter.
        joint: its joint; None where several motors share it.
        effect: name of the effect.
        value: value.
        std: standard deviation.
        unit: unit.
        prior: value in the robot's description, None where it gives none.
    """

    name: str
    joint: str | None
    effect: str
    value: float
    std: float
    unit: str
    prior: float | None


@dataclass(frozen=True, eq=False)
class Model:
    """An identified dynamic model.

    Attributes:
        robot: the robot, with the parameters of its description.
        effects: the effects of the model.
        base: base parameters as combinations of all parameters.
        values: (b,) identified base parameters.
        model_covariance: (b, b) covariance if the torque noise were white (paper, eq. 13).
        uncertainty: covariance from the spread between periods, with its degrees of freedom.
        information: (b, b) F' Sigma^-1 F of this recording.
        estimator: name of the estimator.
        springs: one result for every elastic joint, with further effects in it where the model has some.
        fit: how well it fits.
        excerpt: thinned data.
        recording: where the data came from.
        update: how an earlier model entered, None where none did.
        trends: what changes in the course of a recording; all else is as in the mean of the one it was identified from.
        notes: what was done.
        warnings: what a user should know before trusting it.
    """

    robot: Robot
    effects: tuple[Effect, ...]
    base: BaseParameters
    values: FloatArray
    model_covariance: FloatArray
    uncertainty: Uncertainty
    information: FloatArray
    estimator: str
    springs: tuple[SpringResult, ...]
    fit: Fit
    excerpt: Excerpt
    recording: str
    update: Update | None = None
    trends: tuple[TrendTerm, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def covariance(self) -> FloatArray:
        """(b, b) covariance of the base parameters that is reported."""
        return self.uncertainty.covariance

    @property
    def covariance_kind(self) -> CovarianceKind:
        """Where `covariance` comes from."""
        return self.uncertainty.kind

    @property
    def std(self) -> FloatArray:
        """(b,) standard deviations of the base parameters."""
        return self.uncertainty.std

    @property
    def names(self) -> tuple[str, ...]:
        """(b,) names of the base parameters."""
        return self.base.names

    @property
    def relative_std_percent(self) -> FloatArray:
        """(b,) standard deviations as a share of the values [%]; infinite where a value is zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = 100.0 * self.std / np.abs(self.values)
        return np.asarray(np.where(np.isnan(ratio), np.inf, ratio), dtype=np.float64)

    def interval(self, level: float = 0.95) -> tuple[FloatArray, FloatArray]:
        """Lower and upper ends (b,), (b,) of intervals that cover the truth with this probability."""
        half = self.uncertainty.half_width(level)
        return self.values - half, self.values + half

    @property
    def spring_effects(self) -> tuple[Effect, ...]:
        """Effects in the springs beyond stiffness, cubic stiffness and damping; the motor torque does not show them."""
        return tuple(term.effect for spring in self.springs for term in spring.terms)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Rotor inertias, friction and every other effect's parameters that the data tell apart from the bodies.

        Those of further effects in the springs follow those of the motor torque, then those of trends.
        """
        from sea_ident.regressor import prior_parameters

        prior = prior_parameters(self.robot, self.effects)
        found = []
        for row, index in enumerate(self.base.independent):
            column = self.base.columns[index]
            if column.effect == "rigid_bodies":
                continue
            known = float(prior[index])
            found.append(
                Parameter(
                    name=column.name,
                    joint=column.joint,
                    effect=column.effect,
                    value=float(self.values[row]),
                    std=float(self.std[row]),
                    unit=column.unit,
                    prior=known if np.isfinite(known) else None,
                )
            )
        beside: list[SpringTerm | TrendTerm] = [term for spring in self.springs for term in spring.terms]
        for term in (*beside, *self.trends):
            for column, value, std in zip(term.effect.columns(self.robot), term.values, term.stds, strict=True):
                found.append(Parameter(column.name, column.joint, column.effect, value, std, column.unit, None))
        return tuple(found)

    def predict(self, motion: Motion, channels: Mapping[str, FloatArray] | None = None) -> FloatArray:
        """Motor torque of a motion.

        Args:
            motion: (N, n); where the model has trends, its times are those since a recording began [s].
            channels: further measured signals (N, n) by kind, for effects that need them.

        Returns:
            (N, n) motor torque at the joint side [N m] or [N].

        Raises:
            EffectError: a signal that an effect needs is not among the channels.
        """
        torque: FloatArray = base_rows(self.robot, self.effects, self.base, motion, channels) @ self.values
        return torque + self._of_trends(motion, channels)[0]

    def predict_std(self, motion: Motion, channels: Mapping[str, FloatArray] | None = None) -> FloatArray:
        """(N, n) standard deviation of the predicted torque, from the uncertainty of the parameters alone [N m].

        Args:
            motion: (N, n), as for `predict`.
            channels: the same.

        Raises:
            EffectError: a signal that an effect needs is not among the channels.
        """
        rows = base_rows(self.robot, self.effects, self.base, motion, channels)
        variance = np.einsum("knb,bc,knc->kn", rows, self.covariance, rows)
        variance += self._of_trends(motion, channels)[1]
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64)

    def _of_trends(
        self, motion: Motion, channels: Mapping[str, FloatArray] | None
    ) -> tuple[FloatArray, FloatArray | float]:
        """(N, n) torque of the trends and its variance."""
        if not self.trends:
            return np.zeros((len(motion), self.robot.n)), 0.0
        return trend_torque(self.robot, self.effects, self.trends, motion, channels)

    def summary(self) -> str:
        """Parameters with intervals, springs, fit and warnings."""
        lines = [
            f"{self.robot.name}: {self.base.rank} base parameters by {self.estimator} from "
            f"{self.fit.periods} {'period' if self.fit.periods == 1 else 'periods'} of {self.recording}",
            f"  condition number {self.fit.condition_number:.4g}, log det F'F {self.fit.log_det:.5g}, weighted "
            f"{self.fit.log_det_weighted:.5g}; standard deviations: {self.covariance_kind}",
        ]
        width = max(len(name) for name in self.names)
        half = self.uncertainty.half_width()
        for name, value, std, wide, unit in zip(self.names, self.values, self.std, half, self.base.units, strict=True):
            lines.append(f"  {name:<{width}}  {value:>12.6g} +- {std:<10.3g} 95 %: +- {wide:<10.3g} {unit}")
        if any(name.endswith("*") for name in self.names):
            lines.append("  * and other parameters that only act together with it: `sea-ident inspect` lists which")
        lines.extend(f"  spring {spring.summary()}" for spring in self.springs)
        lines.extend(f"  trend {trend.summary(self.robot)}" for trend in self.trends)
        near = None if self.fit.agreement is None else self.fit.agreement.words()
        for i, joint in enumerate(self.robot.joints):
            lines.append(
                f"  {joint.name}: residual {self.fit.rms_residual[i]:.4g}, noise {self.fit.noise_std[i]:.4g}, torque "
                f"{self.fit.rms_torque[i]:.4g} {joint.torque_unit} (rms){'' if near is None else near[i]}"
            )
        if self.update is not None:
            lines.extend(f"  {line}" for line in self.update.summary().splitlines())
        lines.extend(f"  note: {text}" for text in self.notes)
        lines.extend(f"  warning: {text}" for text in self.warnings)
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The content of MODEL.json."""
        from sea_ident.estimation.model_file import model_to_dict

        return model_to_dict(self)

    def save(self, path: str | Path) -> None:
        """Write MODEL.json; the file is complete or does not appear.

        Raises:
            ModelFileError: if it cannot be written.
        """
        from sea_ident.estimation.model_file import write_model

        write_model(self, path)
