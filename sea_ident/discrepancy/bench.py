"""The working bench: models made of effects, fitted to one recording in its noise."""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.data import EquationKind, PeriodData, around_reversal, free_samples, spectrum
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.free_shapes import free_shapes, moved
from sea_ident.discrepancy.linear import off, solve, whiten
from sea_ident.discrepancy.noise import ComplexArray, NoiseFloor, noise_beside_model, noise_from_periods, stacked
from sea_ident.discrepancy.periods import Periods
from sea_ident.discrepancy.tangents import Tangents
from sea_ident.effects import Column, Effect
from sea_ident.regressor import prior_parameters

MOST_FIT_STEPS = 10
"""Largest number of steps of a fit; a model that is right needs two."""

STANDS_STILL = 1e-3
"""A step of the shapes that takes less than this share of the excess was the last."""

RIDGE = 1e-6
"""Keeps steps of shapes finite that do the same, as a share of what each does."""


class Bench(Tangents):
    """Fits models to one recording.

    Args:
        data: the recording.
        effects: the model that is diagnosed.
    """

    def __init__(self, data: PeriodData, effects: Sequence[Effect]) -> None:
        super().__init__(data)
        self.effects = tuple(effects)
        self._target = spectrum(data.target(data.tau_motor), data.harmonics)
        self._left_out = data.left_out
        self._free = free_samples(data.left_out, data.harmonics)
        self._free_basis: tuple[NoiseFloor | None, FloatArray] | None = None
        self._periods = Periods(data)

    def release(self, effects: Sequence[Effect]) -> None:
        """Leave out further samples: where torques of a model jump at the reversal of a speed of their own."""
        left_out = self._left_out.copy()
        for effect in effects:
            turning = effect.turning(self.data.motion, self.robot)
            if turning is not None:
                rows = around_reversal(turning[1])
                for e, equation in enumerate(self.data.equations):
                    if equation.index == turning[0] and equation.kind is not EquationKind.LINK:
                        left_out[:, e] |= rows
        if np.any(left_out != self._left_out):
            self._left_out, self._free_basis = left_out, None
            self._free = free_samples(left_out, self.data.harmonics)

    def predicted(self, effects: Sequence[Effect], parameters: Mapping[str, float]) -> Fit:
        """A model with given parameters, nothing fitted."""
        effects, columns = tuple(effects), self.labels(effects)
        values = np.array([parameters.get(column.name, 0.0) for column in columns])
        residual = self._target - self.design(effects) @ values
        none = np.zeros((len(values), 0))
        unit = np.ones(len(self.data.equations))
        flat = stacked(residual)
        nothing = np.zeros((*residual.shape, 0), dtype=np.complex128)
        return Fit(effects, columns, values, residual, unit, flat, np.zeros((len(flat), 0)), nothing, none, ())

    def fit(
        self,
        effects: Sequence[Effect],
        noise: NoiseFloor | None,
        *,
        start: Mapping[str, float] | None = None,
        tangents: bool = True,
        known: ComplexArray | None = None,
    ) -> Fit:
        """Fit the parameters of a model, its shapes held.

        A link equation has nothing on its right-hand side: smaller parameters always leave a smaller residual. So its
        residual is measured in deflection, that is divided by the stiffness of its own fit (and multiplied by that of
        the first fit, to stay a torque). The scale of the parameters then comes from the motor equations alone.

        Args:
            effects: the model.
            noise: noise floor; without one all equations count alike, and no scale can go wrong.
            start: parameters by name to start from; those of the unweighted fit by default.
            tangents: whether shapes are free in what is said about degrees of freedom and covariance.
            known: (H + 1, E) torque that is there beside the model.

        Returns:
            The fit.
        """
        effects = tuple(effects)
        columns, design, whitener = self.labels(effects), self.design(effects), self.whitener(noise)
        target = self._target if known is None else self._target - known
        free = self.free_basis(noise)
        values = np.nan_to_num(prior_parameters(self.robot, effects))
        if start is None and noise is not None:
            start = self.fit(effects, None, tangents=False).parameters
        if start is not None:
            values = np.array([start.get(column.name, 0.0) for column in columns])
        cost, best = np.inf, None
        step = np.zeros(0)
        for _ in range(MOST_FIT_STEPS if noise is not None else 1):
            residual = target - design @ values
            scale = np.ones(len(self.data.equations)) if noise is None else self.link_scale(columns, design, values)
            whitened = off(free, whiten(whitener, residual * scale))
            new_cost = float(whitened @ whitened)
            if best is not None and new_cost > cost * (1.0 + 1e-9):
                step *= 0.3
                values = best[0] + step
                continue
            converged = best is not None and cost - new_cost < 1e-3 + 1e-6 * new_cost
            cost, best = new_cost, (values, residual, scale, whitened)
            if converged:
                break
            scaled = self._scaled_columns(columns, values, design, residual, scale, noise)
            step = solve(off(free, whiten(whitener, scaled)), whitened)[0]
            values = values + step
        if noise is None:
            residual, scale = target - design @ values, np.ones(len(self.data.equations))
            whitened = off(free, whiten(whitener, residual))
        else:
            assert best is not None
            values, residual, scale, whitened = best
        directions = self._scaled_columns(columns, values, design, residual, scale, noise)
        shapes = free_shapes(effects) if tangents else ()
        if shapes:
            stiffness = self.stiffness_slopes(columns, design) @ values
            bent = self.scaled(*self.tangents(effects, columns, values, shapes), residual, scale, stiffness)
            directions = np.concatenate([directions, bent], axis=2)
        _, basis, factor = solve(off(free, whiten(whitener, directions)), whitened)
        basis = np.concatenate([free, basis], axis=1)
        return Fit(effects, columns, values, residual, scale, whitened, basis, directions, factor, shapes)

    def link_scale(self, columns: Sequence[Column], design: ComplexArray, values: FloatArray) -> FloatArray:
        """(E,) factor of the residual of each equation: for links the stiffness of the first fit over that of this."""
        first = self.first_stiffness
        slopes = self.stiffness_slopes(columns, design) @ values
        return np.where(first > 0.0, first / np.maximum(slopes, 0.02 * first + 1e-300), 1.0)

    @cached_property
    def first_stiffness(self) -> FloatArray:
        """(E,) mean slope of the spring torque over the deflection in the first fit, 0 where there is no spring."""
        fit = self.first_fit
        slopes = self.stiffness_slopes(fit.columns, self.design(fit.effects)) @ fit.values
        for e, equation in enumerate(self.data.equations):
            if equation.kind is EquationKind.LINK:
                known = self.robot.spring(equation.joint).stiffness or 0.0
                slopes[e] = max(slopes[e], 0.2 * known)
        return np.asarray(np.maximum(slopes, 0.0), dtype=np.float64)

    def _scaled_columns(
        self,
        columns: Sequence[Column],
        values: FloatArray,
        design: ComplexArray,
        residual: ComplexArray,
        scale: FloatArray,
        noise: NoiseFloor | None,
    ) -> ComplexArray:
        """(H + 1, E, p) decrease of the scaled residual with every parameter."""
        if noise is None:
            return design * scale[:, None]
        slopes = self.stiffness_slopes(columns, design)
        return self.scaled(design, slopes, residual, scale, slopes @ values)

    def scaled(
        self, change: ComplexArray, slopes: FloatArray, residual: ComplexArray, scale: FloatArray, stiffness: FloatArray
    ) -> ComplexArray:
        """Decrease of the scaled residual where the model torque changes, and the stiffness that scales it.

        Args:
            change: (H + 1, E, k) change of the model torque.
            slopes: (E, k) change of the stiffness with it.
            residual: (H + 1, E).
            scale: (E,) factor of the residual.
            stiffness: (E,) of the springs in the link equations.

        Returns:
            (H + 1, E, k).
        """
        out = change * scale[:, None]
        for e in self._deflections:
            if self.first_stiffness[e] > 0.0 and stiffness[e] > 0.02 * self.first_stiffness[e]:
                out[:, e] += scale[e] * np.outer(residual[:, e], slopes[e] / stiffness[e])
        return out

    def stiffness_of(self, fit: Fit) -> FloatArray:
        """(E,) slope of the springs of a fit over their deflection."""
        slopes: FloatArray = self.stiffness_slopes(fit.columns, self.design(fit.effects)) @ fit.values
        return slopes

    @cached_property
    def first_fit(self) -> Fit:
        """The model that is diagnosed, all equations counting alike: no weight can pull its parameters to zero."""
        return self.fit(self.effects, None, tangents=False)

    def free_basis(self, noise: NoiseFloor | None) -> FloatArray:
        """(M, m) orthonormal basis of the samples that are left out, whitened."""
        if self._free_basis is None or self._free_basis[0] is not noise:
            flat = whiten(self.whitener(noise), self._free)
            self._free_basis = (noise, solve(flat, np.zeros(len(flat)))[1])
        return self._free_basis[1]

    def statistic(self, fit: Fit, noise: NoiseFloor) -> float:
        """Weighted sum of squares of the residual of a fit in another noise floor, without fitting again."""
        left = off(self.free_basis(noise), whiten(noise.whitener(), fit.residual * fit.scale))
        return float(left @ left)

    def clean_residual(self, fit: Fit, noise: NoiseFloor) -> ComplexArray:
        """(H + 1, E) residual of a fit without what the samples that are left out put into it [N m]."""
        if not self._free.shape[2]:
            return fit.residual
        whitener = noise.whitener()
        free = whiten(whitener, self._free)
        norms = np.linalg.norm(free, axis=0)
        amounts = np.linalg.lstsq(free / norms, whiten(whitener, fit.residual * fit.scale), rcond=1e-8)[0] / norms
        cleaned: ComplexArray = fit.residual - (self._free @ amounts) / fit.scale
        return cleaned

    def whitener(self, noise: NoiseFloor | None) -> ComplexArray:
        """(H + 1, E, E) whitening of a noise floor."""
        if noise is None:
            power = np.sqrt(np.sum(np.abs(self._target) ** 2, axis=0))
            typical = float(np.max(power))
            scale = np.diag(1.0 / np.where(power > 0.0, power, typical)).astype(np.complex128)
            return np.broadcast_to(scale, (self.data.harmonics + 1, *scale.shape))
        return noise.whitener()

    def refine(
        self,
        effects: Sequence[Effect],
        noise: NoiseFloor,
        *,
        start: Mapping[str, float] | None = None,
        only: int = 0,
        rounds: int = 12,
    ) -> Fit:
        """Fit parameters and shapes together: Gauss-Newton on the shapes, the parameters solved for in every step.

        Args:
            effects: the model.
            noise: noise floor.
            start: parameters to start from.
            only: position from which on shapes are refined; those before keep theirs, for a quick look.
            rounds: largest number of steps.

        Returns:
            The fit.
        """
        fit = self.fit(effects, noise, start=start, tangents=False)
        for _ in range(rounds):
            better = self._refine_step(fit, noise, only)
            if better is None:
                break
            gain = fit.statistic - better.statistic
            fit = better
            if gain < 0.05 + STANDS_STILL * fit.excess:
                break
        return self.fit(fit.effects, noise, start=fit.parameters)

    def _refine_step(self, fit: Fit, noise: NoiseFloor, only: int) -> Fit | None:
        shapes = tuple((k, shape) for k, shape in free_shapes(fit.effects) if k >= only)
        if not shapes:
            return None
        whitener, free = self.whitener(noise), self.free_basis(noise)
        bent = self.tangents(fit.effects, fit.columns, fit.values, shapes)
        tangents = self.scaled(*bent, fit.residual, fit.scale, self.stiffness_of(fit))
        directions = off(free, whiten(whitener, tangents))
        across = off(fit.basis, directions)
        strength = np.linalg.norm(across, axis=0)
        if not np.any(strength > 1e-9):
            return None
        seen = strength > 1e-9
        step = np.zeros(len(strength))
        # every shape in its own unit: what one does may be a thousand times what another does
        unit = across[:, seen] / strength[seen]
        normal = unit.T @ unit + RIDGE * np.eye(int(seen.sum()))
        step[seen] = np.linalg.solve(normal, unit.T @ fit.whitened) / strength[seen]
        step *= min(1.0, 1.0 / max(float(np.max(np.abs(step))), 1e-300))
        rank = fit.covariance_factor.shape[1]
        follow = -fit.covariance_factor[: len(fit.values)] @ (fit.basis[:, fit.basis.shape[1] - rank :].T @ directions)
        for _ in range(5):
            effects = list(fit.effects)
            for (position, shape), amount in zip(shapes, step, strict=True):
                effects[position] = moved(effects[position], shape, float(amount))
            # parameters go along with the shapes: a spring that is less of a compliance must be stiffer
            ahead = fit.values + follow @ step
            start = {column.name: float(value) for column, value in zip(fit.columns, ahead, strict=True)}
            new = self.fit(effects, noise, start=start, tangents=False)
            if new.statistic < fit.statistic:
                return new
            step = step / 3.0
        return None

    def period_residuals(self, fit: Fit) -> ComplexArray:
        """(P, H + 1, E) residuals of every period from its own signals, scaled as that of the mean."""
        return self._periods.residuals(fit)

    def noise(self, fit: Fit) -> NoiseFloor:
        """Noise floor with the parameters of a fit."""
        residuals = self.period_residuals(fit)
        plain = noise_from_periods(residuals)
        whitener = plain.whitener()
        free = self.free_basis(plain)
        taken = solve(off(free, whiten(whitener, fit.directions)), np.zeros(len(free)))[1]
        return noise_beside_model(residuals, plain, np.concatenate([free, taken], axis=1))

    @cached_property
    def torque_rms(self) -> FloatArray:
        """(E,) rms of the motor torque of the joint that each equation belongs to [N m]."""
        rms = np.sqrt(np.mean(self.data.tau_motor**2, axis=0))
        return np.asarray(rms[[equation.index for equation in self.data.equations]], dtype=np.float64)
