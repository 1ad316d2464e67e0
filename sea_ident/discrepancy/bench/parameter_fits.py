"""Parameters of models fitted to one recording, their shapes held."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.bench.columns import Evaluated
from sea_ident.discrepancy.bench.fit import Fit, Known, Solution
from sea_ident.discrepancy.bench.free_samples import free_samples
from sea_ident.discrepancy.bench.free_shapes import free_shapes
from sea_ident.discrepancy.bench.freed import FreeColumns, Freed
from sea_ident.discrepancy.bench.linear import least_squares, least_squares_near, whiten
from sea_ident.discrepancy.bench.tangents import Tangents
from sea_ident.discrepancy.bench.whitening import Parts, Whitening
from sea_ident.discrepancy.measured.data import EquationKind, PeriodData, spectrum
from sea_ident.discrepancy.measured.noise import ComplexArray, NoiseFloor, stacked
from sea_ident.effects import Column, Effect
from sea_ident.regressor import prior_parameters
from sea_ident.reversals import around_reversal

MOST_FIT_STEPS = 30
"""Largest number of steps of a fit; a model that is right needs two, one without what its springs need twenty."""

LEAST_STIFFNESS = 0.02
"""Share of the stiffness of the first fit below which that of another no longer scales its link equation."""

WHITENINGS_KEPT = 3
"""Noise floors of which whitened columns are kept."""


@dataclass(frozen=True, eq=False)
class _Given:
    """What a fit of the parameters of a model is given.

    Attributes:
        effects: the model.
        noise: noise floor, None where all equations count alike.
        known: what is there beside the model.
        columns: (p,) its labels.
        design: (H + 1, E, p) its columns.
        target: (H + 1, E) what it is fitted to.
        whitening: by the noise.
        parts: (G, M, p) whitened columns in parts.
        whole: (G, M) whitened target in parts.
        slopes: (E, p) part of every parameter in the stiffness of the links.
        beside: (E,) stiffness that is known beside it.
    """

    effects: tuple[Effect, ...]
    noise: NoiseFloor | None
    known: Known | None
    columns: tuple[Column, ...]
    design: ComplexArray
    target: ComplexArray
    whitening: Whitening
    parts: Parts
    whole: FloatArray
    slopes: FloatArray
    beside: FloatArray


class ParameterFits(Tangents):
    """Fits the parameters of models to one recording.

    Args:
        data: the recording.
        effects: the model that is diagnosed.
        evaluated: what was evaluated on the recording already.
    """

    def __init__(self, data: PeriodData, effects: Sequence[Effect], evaluated: Evaluated | None = None) -> None:
        super().__init__(data, evaluated)
        self.effects = tuple(effects)
        self._target = spectrum(data.target(data.tau_motor), data.harmonics)
        self._left_out = data.left_out
        self._free = FreeColumns.of(free_samples(data.left_out, data.harmonics, data.alike))
        self._whitenings: list[tuple[NoiseFloor | None, Whitening]] = []

    def release(self, effects: Sequence[Effect]) -> None:
        """Leave out further samples: where torques of a model jump at the reversal of a speed of their own."""
        left_out = self._left_out.copy()
        for effect in effects:
            for joint, speed in effect.turning(self.data.motion, self.robot).items():
                rows = around_reversal(speed)
                for e, equation in enumerate(self.data.equations):
                    if equation.index == joint and equation.kind is not EquationKind.LINK:
                        left_out[:, e] |= rows
        if np.any(left_out != self._left_out):
            self._left_out, self._whitenings = left_out, []
            self._free = FreeColumns.of(free_samples(left_out, self.data.harmonics, self.data.alike))

    def predicted(self, effects: Sequence[Effect], parameters: Mapping[str, float]) -> Fit:
        """A model with given parameters, nothing fitted."""
        effects, columns = tuple(effects), self.labels(effects)
        values = np.array([parameters.get(column.name, 0.0) for column in columns])
        design = self.design(effects)
        residual = self._target - design @ values
        scale = self._link_scale(self.stiffness_slopes(columns, design, effects) @ values)
        flat = stacked(residual)
        nothing = np.zeros((*residual.shape, 0), dtype=np.complex128)
        empty = np.zeros((len(flat), 0))
        unit = np.broadcast_to(np.eye(residual.shape[1], dtype=np.complex128), (*residual.shape, residual.shape[1]))
        free = Freed(unit, FreeColumns.of(nothing))
        return Fit(effects, columns, values, residual, scale, flat, free, lambda: (empty, nothing), ())

    def fit(
        self,
        effects: Sequence[Effect],
        noise: NoiseFloor | None,
        *,
        start: Mapping[str, float] | None = None,
        tangents: bool = True,
        known: Known | None = None,
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
            known: what is there beside the model.

        Returns:
            The fit.
        """
        given = self._given(tuple(effects), noise, known)
        if start is None and noise is not None:
            start = self.fit(effects, None, tangents=False).parameters
        if start is None:
            values = np.nan_to_num(prior_parameters(self.robot, given.effects))
        else:
            values = np.array([start.get(column.name, 0.0) for column in given.columns])
        frame = None
        if noise is None:
            factors = given.whitening.factors(np.ones(len(self.data.equations)))
            left = given.whole - given.parts @ values
            values = values + least_squares(given.parts.scaled(factors), factors @ left)[0]
        else:
            values, frame = self._descend(given, values)
        return self._at(given, values, frame, tangents)

    def again(self, solution: Solution, noise: NoiseFloor, known: Known | None = None) -> Fit:
        """A fit from what it came to, to the last digit.

        Args:
            solution: of a fit on this recording.
            noise: noise floor that it was fitted in.
            known: what is there beside the model.

        Returns:
            The fit, its shapes free.
        """
        return self._at(self._given(solution.effects, noise, known), solution.values, solution.frame, tangents=True)

    def _given(self, effects: tuple[Effect, ...], noise: NoiseFloor | None, known: Known | None) -> "_Given":
        columns, design, whitening = self.labels(effects), self.design(effects), self.whitening(noise)
        parts = whitening.design(effects)
        slopes = self.stiffness_slopes(columns, design, effects)
        if known is None:
            target, whole, beside = self._target, self._whole(whitening), np.zeros(len(self.data.equations))
        else:
            target, beside = self._target - known.torque, known.stiffness
            whole = whitening.in_parts(target[:, :, None]) @ np.ones(1)
        return _Given(effects, noise, known, columns, design, target, whitening, parts, whole, slopes, beside)

    def _at(self, given: "_Given", values: FloatArray, frame: FloatArray | None, tangents: bool) -> Fit:
        """A model with parameters (p,) that were fitted."""
        effects, columns, noise, slopes, parts = given.effects, given.columns, given.noise, given.slopes, given.parts
        design, whitening = given.design, given.whitening
        stiffness = slopes @ values + given.beside
        scale = np.ones(len(self.data.equations)) if noise is None else self._link_scale(stiffness)
        left = given.whole - parts @ values
        factors = whitening.factors(scale)
        whitened = factors @ left
        residual = given.target - design @ values
        shapes = free_shapes(effects) if tangents else ()
        # not the whitening itself, which keeps the columns of all candidates
        whitener, free, part_of = whitening.whitener, whitening.free, whitening.parts

        def linear() -> tuple[FloatArray, ComplexArray]:
            if noise is None:
                flat, spectra = parts.scaled(factors), design
            else:
                flat = self._flat_columns(parts, left, part_of, slopes, scale, factors, stiffness)
                spectra = self.scaled(design, slopes, residual, scale, stiffness)
            if shapes:
                bent = self.scaled(*self.tangents(effects, columns, values, shapes), residual, scale, stiffness)
                flat = np.concatenate([flat, free.off(whiten(whitener, bent))], axis=1)
                spectra = np.concatenate([spectra, bent], axis=2)
            return flat, spectra

        def followed() -> FloatArray | None:
            change = self.followed(effects, columns, values)
            return None if change is None else free.off(whiten(whitener, change * scale[:, None]))

        frame = None if shapes else frame
        return Fit(
            effects, columns, values, residual, scale, whitened, free, linear, shapes, frame, given.known, followed
        )

    def _descend(self, given: "_Given", values: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """(p,) parameters after Gauss-Newton steps: the scale of a link equation follows its own stiffness.

        And the frame (p, r) of the first step: between steps columns change by that scale alone.
        """
        parts, whole, whitening, slopes, beside = given.parts, given.whole, given.whitening, given.slopes, given.beside
        cost, best, step = np.inf, values, np.zeros(len(values))
        frame: FloatArray | None = None
        for _ in range(MOST_FIT_STEPS):
            left = whole - parts @ values
            scale = self._link_scale(slopes @ values + beside)
            whitened = whitening.factors(scale) @ left
            new_cost = float(whitened @ whitened)
            tight, before = (self._scaled_links(slopes @ each + beside) for each in (values, best))
            gone = len(tight) < len(before)
            if gone or not new_cost <= cost * (1.0 + 1e-9):
                step = 0.3 * step
                values = best + step
                continue
            converged = cost - new_cost < 1e-3 + 1e-6 * new_cost
            cost, best = new_cost, values
            if converged:
                break
            factors = whitening.factors(scale)
            flat = self._flat_columns(parts, left, whitening.parts, slopes, scale, factors, slopes @ values + beside)
            if frame is None:
                step, frame = least_squares(flat, whitened)
            else:
                step = least_squares_near(frame, flat, whitened)
            values = values + step
        return best, frame

    def _link_scale(self, stiffness: FloatArray) -> FloatArray:
        """(E,) factor of the residual of each equation: for links the stiffness of the first fit over that of this."""
        first = self.first_stiffness
        return np.where(first > 0.0, first / np.maximum(stiffness, LEAST_STIFFNESS * first + 1e-300), 1.0)

    def slack_links(self, fit: Fit, below: float = LEAST_STIFFNESS) -> list[int]:
        """Link equations of springs that have lost their stiffness in a fit: they explain nothing, at no price.

        Args:
            fit: the fit.
            below: share of the stiffness of the first fit that is none any more [-].
        """
        tight = self._scaled_links(self.stiffness_of(fit), below)
        return [e for e in self.links if self.first_stiffness[e] > 0.0 and e not in tight]

    def _scaled_links(self, stiffness: FloatArray, above: float = LEAST_STIFFNESS) -> list[int]:
        """Link equations of which the scale follows the stiffness (E,)."""
        first = self.first_stiffness
        return [e for e in self.links if first[e] > 0.0 and stiffness[e] > above * first[e]]

    @cached_property
    def first_stiffness(self) -> FloatArray:
        """(E,) mean slope of the spring torque over the deflection in the first fit, 0 where there is no spring.

        A motion that was only designed has no torques, and nothing to be fitted to.
        """
        if not np.any(self._target):
            return np.zeros(len(self.data.equations))
        fit = self.first_fit
        slopes = self.stiffness_slopes(fit.columns, self.design(fit.effects), fit.effects) @ fit.values
        for e, equation in enumerate(self.data.equations):
            if equation.kind is EquationKind.LINK:
                known = self.robot.spring(equation.joint).stiffness or 0.0
                slopes[e] = max(slopes[e], 0.2 * known)
        return np.asarray(np.maximum(slopes, 0.0), dtype=np.float64)

    def _flat_columns(
        self,
        parts: Parts,
        left: FloatArray,
        part_of: IntArray,
        slopes: FloatArray,
        scale: FloatArray,
        factors: FloatArray,
        stiffness: FloatArray,
    ) -> FloatArray:
        """(M, p) whitened decrease of the scaled residual with every parameter: `scaled`, in parts."""
        out = parts.scaled(factors)
        for e in self._scaled_links(stiffness):
            for k in np.flatnonzero(slopes[e]):
                out[:, k] += scale[e] * slopes[e, k] / stiffness[e] * left[part_of[e]]
        return out

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
        for e in self._scaled_links(stiffness):
            stiffer = np.flatnonzero(slopes[e])
            out[:, e, stiffer] += scale[e] * np.outer(residual[:, e], slopes[e, stiffer] / stiffness[e])
        return out

    @cached_property
    def first_fit(self) -> Fit:
        """The model that is diagnosed, all equations counting alike: no weight can pull its parameters to zero."""
        return self.fit(self.effects, None, tangents=False)

    def whitening(self, noise: NoiseFloor | None) -> Whitening:
        """A noise floor and the samples that are left out, applied to torques; the last ones are kept."""
        for known, kept in self._whitenings:
            if known is noise:
                return kept
        made = Whitening(self, self._plain_whitener() if noise is None else noise.whitener(), self._free)
        self._whitenings = [*self._whitenings[1 - WHITENINGS_KEPT :], (noise, made)]
        return made

    def _whole(self, whitening: Whitening) -> FloatArray:
        """(G, M) target in parts."""
        if whitening.target is None:
            whitening.target = whitening.in_parts(self._target[:, :, None]) @ np.ones(1)
        return whitening.target

    def freed(self, noise: NoiseFloor | None) -> Freed:
        """The samples that are left out, whitened."""
        return self.whitening(noise).free

    def statistic(self, fit: Fit, noise: NoiseFloor) -> float:
        """Weighted sum of squares of the residual of a fit in another noise floor, without fitting again."""
        left = self.whitening(noise).flat(fit.residual * fit.scale)
        return float(left @ left)

    def clean_residual(self, fit: Fit) -> ComplexArray:
        """(H + 1, E) residual of a fit without what the samples that are left out put into it [N m].

        All harmonics and equations count alike, whatever their noise: where something is missing, it would be spread to
        where there is more noise, and to the samples of other equations that share it.
        """
        return self.cleaned(fit.residual)

    def cleaned(self, residual: ComplexArray) -> ComplexArray:
        """(H + 1, E) residuals without what the samples that are left out put into them."""
        free = self._free.spectra
        if not self._free.count:
            return residual
        amounts = stacked(free).T @ stacked(residual)  # the columns are orthonormal
        found: ComplexArray = residual - free @ amounts
        return found

    def whitener(self, noise: NoiseFloor | None) -> ComplexArray:
        """(H + 1, E, E) whitening of a noise floor."""
        return self.whitening(noise).whitener

    def _plain_whitener(self) -> ComplexArray:
        """(H + 1, E, E) whitening without a noise floor: every equation in its own torque."""
        power = np.sqrt(np.sum(np.abs(self._target) ** 2, axis=0))
        # a link equation has no torque of its own: next to nothing that is known to act there is no measure of it
        power[list(self.links)] = 0.0
        typical = float(np.max(power))
        scale = np.diag(1.0 / np.where(power > 0.0, power, typical)).astype(np.complex128)
        return np.broadcast_to(scale, (self.data.harmonics + 1, *scale.shape))
