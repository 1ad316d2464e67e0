"""The working bench: models made of effects, fitted to one recording in its noise."""

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.columns import Evaluated
from sea_ident.discrepancy.bench.fit import Fit, Known
from sea_ident.discrepancy.bench.free_shapes import free_shapes, moved_within, room, turning_in_sight
from sea_ident.discrepancy.bench.linear import off, span, whiten
from sea_ident.discrepancy.bench.parameter_fits import ParameterFits
from sea_ident.discrepancy.bench.periods import Periods, with_other_steps
from sea_ident.discrepancy.bench.whitening import Whitening
from sea_ident.discrepancy.measured.data import PeriodData
from sea_ident.discrepancy.measured.noise import (
    REPEATED_VARIANCE,
    ComplexArray,
    NoiseFloor,
    closed_freedom_of_many,
    leverage_of,
    noise_beside_model,
    noise_from_steps,
    step_freedom,
)
from sea_ident.effects import Effect
from sea_ident.effects.drift import TrendEffect
from sea_ident.effects.nonlinear_viscous_friction import NonlinearViscousFriction

EVALUATED_ON = (
    "robot",
    "motion",
    "period_motions",
    "channels",
    "equations",
    "tau_motor",
    "period_tau_motor",
    "step_errors",
)
"""What of a recording effects are evaluated on."""

NOISE_ROUNDS = 2
"""Noise floors in turn: what a model takes up of the scatter depends on the floor that it is weighted by. No more than
that: what is left of friction at reversals that differs from pass to pass goes where the weight is small, which makes
the weight there still smaller."""

RUNAWAY = 0.3
"""Share of the torque of the motor beyond which an effect must not grow ..."""

RUNAWAY_STEP = 1.2
"""... by more than this factor with one step of its shape."""

LEAST_GAIN = 0.05
"""A step of the shapes that takes less than this of the statistic ..."""

STANDS_STILL = 1e-3
"""... and this share of the excess was the last."""

HOPE = 10.0
"""How many times the gain of the last step all further ones together may bring: steps that shrink by a tenth each."""

CAREFUL = ((1.0, 1.0), (1.0, 1.0 / 3.0), (100.0, 1.0), (1e3, 1.0 / 3.0), (3e4, 1.0 / 9.0), (1e6, 1.0 / 81.0))
"""How careful a step is, more and more so where it makes a fit worse. The information about a shape (for its logarithm,
or as a share of its range) below which it stays about where it is: noise would carry it anywhere, and the motion bends
what it shows so little of long before. And the part of the step that is taken: so that what is plain is not held up by
what is not, the information comes first."""

RIDGE = 1e-6
"""Keeps steps of shapes finite that do the same, as a share of what each does."""


@dataclass
class _Caution:
    """What a refinement has learnt of the steps that it can take.

    Attributes:
        level: how careful the last step had to be, in `CAREFUL`.
        others_stand: whether only what runs away has still a way to go.
    """

    level: int = 0
    others_stand: bool = False


class Bench(ParameterFits):
    """Fits models to one recording, their shapes too, and finds its noise beside them.

    Args:
        data: the recording.
        effects: the model that is diagnosed.
        evaluated: what was evaluated on the recording already.
    """

    def __init__(self, data: PeriodData, effects: Sequence[Effect], evaluated: Evaluated | None = None) -> None:
        super().__init__(data, effects, evaluated)
        self._periods = Periods(data, self._evaluated.periods)
        disturbed = with_other_steps(data)
        self._other_steps = None if disturbed is None else Periods(disturbed, self._evaluated.steps)

    def comparing(self, data: PeriodData) -> "Bench":
        """The same model and recording on another bench that compares other samples, or knows more of it.

        What does not depend on that is evaluated once for both.

        Raises:
            ValueError: it is not the same recording.
        """
        same = all(getattr(data, name) is getattr(self.data, name) for name in EVALUATED_ON)
        if not same or data.harmonics != self.data.harmonics:
            raise ValueError(f"{data.source} is another recording, or other periods of it")
        return Bench(data, self.effects, self._evaluated)

    def modelling(self, effects: Sequence[Effect]) -> "Bench":
        """The same recording with another model."""
        return Bench(self.data, effects, self._evaluated)

    def apart(self) -> "Bench":
        """The same bench, on which samples may be released that are compared on this one."""
        return copy(self)

    def refine(
        self,
        effects: Sequence[Effect],
        noise: NoiseFloor,
        *,
        start: Mapping[str, float] | None = None,
        only: int = 0,
        rounds: int = 12,
        beat: float = np.inf,
        known: Known | None = None,
    ) -> Fit:
        """Fit parameters and shapes together: Gauss-Newton on the shapes, the parameters solved for in every step.

        Args:
            effects: the model.
            noise: noise floor.
            start: parameters to start from.
            only: position from which on shapes are refined; those before keep theirs, for a quick look.
            rounds: largest number of steps.
            beat: statistic that is of interest; what is far above and comes down too slowly is given up.
            known: what is there beside the model.

        Returns:
            The fit.
        """
        begun = turning_in_sight(effects, self.data.slowest, only)
        fit = self.fit(begun, noise, start=start, tangents=False, known=known)
        caution = _Caution()
        for _ in range(rounds):
            stood, last, better = caution.others_stand, fit, self._refine_step(fit, noise, only, caution)
            if better is None:
                break
            fit = better
            if caution.others_stand and not stood:
                continue  # it is the turn of what runs away
            if _stands_still(last, fit) or fit.statistic - HOPE * (last.statistic - fit.statistic) > beat:
                break
        return self.fit(fit.effects, noise, start=fit.parameters, known=known)

    def _refine_step(self, fit: Fit, noise: NoiseFloor, only: int, caution: "_Caution") -> Fit | None:
        shapes = tuple((k, shape) for k, shape in free_shapes(fit.effects) if k >= only)
        if not shapes:
            return None
        bent = self.tangents(fit.effects, fit.columns, fit.values, shapes)
        tangents = self.scaled(*bent, fit.residual, fit.scale, self.stiffness_of(fit))
        directions = self.whitening(noise).flat(tangents)
        across = off(fit.basis, directions)  # the samples that are left out are out of them already
        strength = np.linalg.norm(across, axis=0)
        seen = strength > 1e-9
        if not np.any(seen):
            return None
        # every shape in its own unit: what one does may be a thousand times what another does
        unit = across[:, seen] / strength[seen]
        normal, gradient = unit.T @ unit, unit.T @ fit.whitened
        rooms = np.array([room(fit.effects[position], shape) for position, shape in shapes]).T[:, seen] * strength[seen]
        follow = -fit.step_factor[: len(fit.values)] @ (fit.basis.T @ directions)

        def stepped(level: int, held: Collection[int] = ()) -> Fit | None:
            """The fit after a step of the shapes of all effects that are not held."""
            needed, part = CAREFUL[level]
            free = np.array([position not in held for position, _ in shapes])[seen]
            inner, step = np.zeros(len(free)), np.zeros(len(shapes))
            damped = normal + np.diag(RIDGE + needed / strength[seen] ** 2)
            inner[free] = _within(damped[np.ix_(free, free)], gradient[free], rooms[:, free])
            step[seen] = part * np.clip(inner / strength[seen], -1.0, 1.0)
            effects = fit.effects
            for (position, shape), amount in zip(shapes, step, strict=True):
                effects = moved_within(effects, position, shape, float(amount))
            if effects == fit.effects:
                return None
            # parameters go along with the shapes: a spring that is less of a compliance must be stiffer
            ahead = fit.values + follow @ step
            start = {column.name: float(value) for column, value in zip(fit.columns, ahead, strict=True)}
            new = self.fit(effects, noise, start=start, tangents=False, known=fit.known)
            slack = len(self.slack_links(new)) > len(self.slack_links(fit))
            return new if new.statistic < fit.statistic and not slack else None

        for level in range(max(caution.level - 1, 0), len(CAREFUL)):
            new = stepped(level)
            if new is None:
                continue
            away = self._run_away(fit, new)
            if away and not caution.others_stand:
                # the others have a way of their own, and need not creep along beside it
                new = stepped(level, away)
                away = set() if new is None else self._run_away(fit, new)
                caution.others_stand = new is None or bool(away) or _stands_still(fit, new)
            if new is not None and not away:
                caution.level = level
                return new
        return None

    def _run_away(self, before: Fit, after: Fit) -> set[int]:
        """Positions of effects beside the model that become large by a step of the shapes: others then cancel them."""
        counts, found = self.counts(after.effects), set()
        for position in range(len(self.effects), len(after.effects)):
            if isinstance(after.effects[position], NonlinearViscousFriction):
                continue  # by a power of nearly one it is large beside viscous friction, and may pass it
            own = slice(sum(counts[:position]), sum(counts[: position + 1]))
            torques = [self.column_spectra(f.effects[position], f.effects) @ f.values[own] for f in (before, after)]
            sizes = [np.sqrt(np.sum(np.abs(torque) ** 2, axis=0)) for torque in torques]
            if np.any((sizes[1] > RUNAWAY * self.torque_rms) & (sizes[1] > RUNAWAY_STEP * sizes[0])):
                found.add(position)
        return found

    def period_residuals(self, fit: Fit) -> ComplexArray:
        """(P, H + 1, E) residuals of every period from its own signals, scaled as that of the mean."""
        return self._periods.residuals(fit)

    def period_steps(self, fit: Fit) -> ComplexArray:
        """(S, H + 1, E) differences of successive periods over the root of two, scaled alike: see `Periods.steps`."""
        return self._periods.steps(fit)

    def period_column_changes(self, effect: TrendEffect, fit: Fit) -> ComplexArray:
        """(P, H + 1, E, k) what the columns of a trend are in every period beyond those of the mean, scaled alike."""
        return np.asarray(self._periods.column_changes(effect, fit) * fit.scale[:, None], dtype=np.complex128)

    def noise(self, fit: Fit) -> NoiseFloor:
        """Noise floor of the mean with the parameters of a fit, and what steps of encoders do to every period alike."""
        steps = self.period_steps(fit)
        floor = self._noise(fit, steps, self.data.averaged, closed_freedom_of_many(len(steps)))
        return floor if self._other_steps is None else floor.beside(self._step_errors(fit, self._other_steps))

    def share_of_steps(self, fit: Fit, noise: NoiseFloor) -> float:
        """Share of a noise floor that steps of encoders make up, which repeat in every period [-]."""
        if self._other_steps is None:
            return 0.0
        errors = self._step_errors(fit, self._other_steps)
        whitened = np.stack([whiten(noise.whitener(), error) for error in errors])
        return float(REPEATED_VARIANCE * np.mean(whitened**2))

    def _step_errors(self, fit: Fit, others: Periods) -> ComplexArray:
        """(K, H + 1, E) what the residual of a fit changes by where the steps of encoders lie elsewhere."""
        changes = others.residuals(fit) - fit.scale * fit.residual
        return np.asarray(changes / np.sqrt(len(changes)), dtype=np.complex128)

    def noise_of_cut(self, fit: Fit) -> NoiseFloor:
        """The same by periods as they are cut, which do not close: to compare these with one another."""
        steps = np.diff(self.period_residuals(fit), axis=0) / np.sqrt(2.0)
        return self._noise(fit, steps, self.data.periods, step_freedom(self.data.periods))

    def _noise(self, fit: Fit, steps: ComplexArray, periods: float, each: float) -> NoiseFloor:
        noise = noise_from_steps(steps, periods, each)
        for _ in range(NOISE_ROUNDS):
            whitening = Whitening(self, noise.whitener(), self._free)
            taken = span(whitening.flat(fit.directions))
            left = off(taken, whitening.flat(steps.transpose(1, 2, 0)))
            leverage = whitening.free.leverage + leverage_of(taken, len(self.data.equations))
            noise = noise_beside_model(left, noise, each, leverage)
        return noise

    @cached_property
    def torque_rms(self) -> FloatArray:
        """(E,) rms of the motor torque of the joint that each equation belongs to [N m]."""
        return self._rms_of_joints(self.data.tau_motor)

    @cached_property
    def described_rms(self) -> FloatArray:
        """(E,) rms of what the bodies need there as they are described [N m]: a constant may cancel their weight."""
        return self._rms_of_joints(self.state(self.effects).body_torque(self.robot.inertial_parameters))

    def _rms_of_joints(self, torque: FloatArray) -> FloatArray:
        rms = np.sqrt(np.mean(torque**2, axis=0))
        return np.asarray(rms[[equation.index for equation in self.data.equations]], dtype=np.float64)


def _stands_still(before: Fit, after: Fit) -> bool:
    """Whether a step of the shapes brought next to nothing."""
    return before.statistic - after.statistic < LEAST_GAIN + STANDS_STILL * after.excess


def _within(normal: FloatArray, gradient: FloatArray, rooms: FloatArray) -> FloatArray:
    """(s,) least squares step by its normal equations (s, s), (s,) within rooms (2, s) below and above.

    Where one shape stands at the end of its range, the others have another way than they would have beside it.
    """
    step = np.linalg.solve(normal, gradient)
    if np.all((step >= rooms[0]) & (step <= rooms[1])):
        return np.asarray(step, dtype=np.float64)
    root = np.linalg.cholesky(normal)
    found = lsq_linear(root.T, solve_triangular(root, gradient, lower=True), rooms, method="bvls")
    return np.asarray(found.x, dtype=np.float64)
