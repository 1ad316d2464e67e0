"""The working bench: models made of effects, fitted to one recording in its noise."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
import scipy.linalg
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.data import (
    EquationKind,
    PeriodData,
    around_reversal,
    free_samples,
    spectrum,
    towards_mean,
)
from sea_ident.discrepancy.noise import NoiseFloor, noise_beside_model, noise_from_periods, stacked
from sea_ident.effects import (
    Anchor,
    Column,
    Contribution,
    Effect,
    JointEffect,
    Shape,
    Side,
    State,
    corrected_motion,
)
from sea_ident.effects.load import LoadEffect
from sea_ident.effects.signal import SignalEffect
from sea_ident.motion import Motion
from sea_ident.regressor import prior_parameters

ComplexArray = NDArray[np.complex128]

PERIOD_SAMPLES = 2.5
"""Samples of a single period that its model torque is computed at, per harmonic compared."""

MOST_FIT_STEPS = 10
"""Largest number of steps of a fit; a model that is right needs two."""

RANK_TOLERANCE = 1e-9
"""Singular directions of the normalised columns below this share of the largest are left out."""

STANDS_STILL = 1e-3
"""A step of the shapes that takes less than this share of the excess was the last."""

RIDGE = 1e-6
"""Keeps steps of shapes finite that do the same, as a share of what each does."""

VARIANTS_KEPT = 3e8
"""Bytes of columns of candidates that are kept for the next search."""

SHAPES_THAT_STAY = {"spring_stiffening": ("exponent",), "external_force": ("start", "stop")}
"""Shape parameters that are not refined: they say which effect it is, or come from elsewhere."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to the mean residual, everything free.

    Attributes:
        effects: the model, with its shapes.
        columns: (p,) labels.
        values: (p,) parameters; where the data tell only combinations, as near to the priors as they let.
        residual: (H + 1, E) complex residual of the mean [N m].
        scale: (E,) factor of the residual before it is whitened [-].
        whitened: (M,) whitened residual.
        basis: (M, r) orthonormal basis of everything that is free: columns, and tangents of the shapes.
        directions: (H + 1, E, p + s) scaled torque by columns, and tangents of the shapes.
        covariance_factor: (p + s, r) factor whose square is the covariance of parameters and shapes.
        free_shapes: (s,) which shapes are free: index of the effect, and the shape.
    """

    effects: tuple[Effect, ...]
    columns: tuple[Column, ...]
    values: FloatArray
    residual: ComplexArray
    scale: FloatArray
    whitened: FloatArray
    basis: FloatArray
    directions: ComplexArray
    covariance_factor: FloatArray
    free_shapes: tuple[tuple[int, Shape], ...]

    @property
    def statistic(self) -> float:
        """Weighted sum of squared residuals."""
        return float(self.whitened @ self.whitened)

    @property
    def dof(self) -> int:
        """Degrees of freedom of the statistic."""
        return int(len(self.whitened) - self.basis.shape[1])

    @property
    def excess(self) -> float:
        """Part of the statistic beyond what noise leaves, at least zero."""
        return max(self.statistic - self.dof, 0.0)

    @cached_property
    def parameters(self) -> dict[str, float]:
        """Value of every parameter by name."""
        return {column.name: float(value) for column, value in zip(self.columns, self.values, strict=True)}

    def std(self, index: int) -> float:
        """Standard deviation of a parameter (index < p) or a shape (p + position in `free_shapes`)."""
        return float(np.linalg.norm(self.covariance_factor[index]))

    def slice_of(self, position: int, robot_columns: Sequence[int]) -> slice:
        """Columns of one effect, given the number of columns of every effect."""
        start = int(sum(robot_columns[:position]))
        return slice(start, start + int(robot_columns[position]))


class Bench:
    """Evaluates models on one recording; what was computed once is kept.

    Args:
        data: the recording.
        effects: the model that is diagnosed.
    """

    def __init__(self, data: PeriodData, effects: Sequence[Effect]) -> None:
        self.data = data
        self.effects = tuple(effects)
        self.robot = data.robot
        self._target = spectrum(data.target(data.tau_motor), data.harmonics)
        self._left_out = data.left_out
        self._free = free_samples(data.left_out, data.harmonics)
        self._free_basis: tuple[NoiseFloor | None, FloatArray] | None = None
        self._states: dict[tuple[Effect, ...], State] = {}
        self._columns: dict[tuple[Effect, tuple[Effect, ...]], ComplexArray] = {}
        stride = max(1, int(data.samples / (PERIOD_SAMPLES * data.harmonics)))
        self._stride = next(s for s in range(stride, 0, -1) if data.samples % s == 0)
        self._variants: dict[tuple[tuple[Effect, ...], tuple[Effect, ...]], tuple[IntArray, ComplexArray]] = {}
        self.derivatives: tuple[object, tuple[FloatArray, FloatArray, FloatArray]] | None = None
        self._period_bodies: dict[tuple[Effect, ...], list[tuple[State, FloatArray]]] = {}

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

    # -- columns of the mean ---------------------------------------------------------------------------------------

    def state(self, effects: Sequence[Effect]) -> State:
        """Robot and mean motion, with the errors of the sensors taken out that the effects describe."""
        signals = signal_effects(effects)
        if signals not in self._states:
            if len(self._states) > 12:
                self._states.pop(next(k for k in self._states if k))
            motion = corrected_motion(self.robot, signals, self.data.motion)
            self._states[signals] = State(self.robot, motion, self.data.channels)
        return self._states[signals]

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

    def column_spectra(self, effect: Effect, effects: Sequence[Effect]) -> ComplexArray:
        """(H + 1, E, k) columns of one effect within a model."""
        signals = signal_effects(effects)
        key = (effect, signals)
        if key not in self._columns:
            if len(self._columns) > 400:
                self._columns.clear()
            self._columns[key] = self._spectra(effect.evaluate(self.state(effects)), signals)
        return self._columns[key]

    def variant_spectra(self, variants: Sequence[Effect], effects: Sequence[Effect]) -> tuple[IntArray, ComplexArray]:
        """Columns of one effect in all its variants.

        Returns:
            (e,) equations that it touches, and (H + 1, e, v, k) columns in these.
        """
        signals = signal_effects(effects)
        key = (tuple(variants), signals)
        if key not in self._variants:
            if sum(spectra.nbytes for _, spectra in self._variants.values()) > VARIANTS_KEPT:
                self._variants.clear()
            state = self.state(effects)
            parts = [variant.evaluate(state) for variant in variants]
            both = Contribution(np.stack([p.link for p in parts], 2), np.stack([p.motor for p in parts], 2))
            self._variants[key] = self._touched(both, signals)
        return self._variants[key]

    def _touched(self, part: Contribution, signals: tuple[Effect, ...]) -> tuple[IntArray, ComplexArray]:
        """Equations with anything in them, and the spectra (H + 1, e, ...) there."""
        for signal in signals:
            part = signal.shifted(self.robot, self.data.motion.time, part)
        rows = self.data.rows(part)
        touched = np.array([e for e in range(rows.shape[1]) if np.any(rows[:, e])], dtype=np.intp)
        return touched, spectrum(rows[:, touched], self.data.harmonics)

    def spectra_of(self, part: Contribution, effects: Sequence[Effect]) -> ComplexArray:
        """(H + 1, E, ...) of link and motor rows (N, n, ...) within a model."""
        return self._spectra(part, signal_effects(effects))

    def _spectra(self, part: Contribution, signals: tuple[Effect, ...]) -> ComplexArray:
        touched, found = self._touched(part, signals)
        out = np.zeros((self.data.harmonics + 1, len(self.data.equations), *found.shape[2:]), dtype=np.complex128)
        out[:, touched] = found
        return out

    def design(self, effects: Sequence[Effect]) -> ComplexArray:
        """(H + 1, E, p) columns of a model."""
        return np.concatenate([self.column_spectra(effect, effects) for effect in effects], axis=2)

    def labels(self, effects: Sequence[Effect]) -> tuple[Column, ...]:
        """(p,) labels of the columns of a model."""
        return tuple(column for effect in effects for column in effect.columns(self.robot))

    def counts(self, effects: Sequence[Effect]) -> list[int]:
        """Number of columns of every effect."""
        return [len(effect.columns(self.robot)) for effect in effects]

    # -- fits --------------------------------------------------------------------------------------------------------

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
            whitened = _off(free, whiten(whitener, residual * scale))
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
            step = solve(_off(free, whiten(whitener, scaled)), whitened)[0]
            values = values + step
        if noise is None:
            residual, scale = target - design @ values, np.ones(len(self.data.equations))
            whitened = _off(free, whiten(whitener, residual))
        else:
            assert best is not None
            values, residual, scale, whitened = best
        directions = self._scaled_columns(columns, values, design, residual, scale, noise)
        shapes = free_shapes(effects) if tangents else ()
        if shapes:
            stiffness = self.stiffness_slopes(columns, design) @ values
            bent = self.scaled(*self.tangents(effects, columns, values, shapes), residual, scale, stiffness)
            directions = np.concatenate([directions, bent], axis=2)
        _, basis, factor = solve(_off(free, whiten(whitener, directions)), whitened)
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

    def stiffness_slopes(self, columns: Sequence[Column], design: ComplexArray) -> FloatArray:
        """(E, p) part of every parameter in the mean slope of the spring torque of a link over its deflection."""
        out = np.zeros((len(self.data.equations), len(columns)))
        for e, deflection in self._deflections.items():
            joint = self.data.equations[e].joint
            own = [k for k, c in enumerate(columns) if c.joint == joint and c.side is Side.SPRING]
            power = float(np.sum(np.abs(deflection) ** 2))
            if own and power > 0.0:
                out[e, own] = -np.real(deflection.conj() @ design[1:, e, own]) / power
        return out

    @cached_property
    def _deflections(self) -> dict[int, ComplexArray]:
        """(H,) spectrum of the deflection, without its mean, for every link equation."""
        deflection = spectrum(self.data.motion.deflection, self.data.harmonics)[1:]
        return {
            e: deflection[:, equation.index]
            for e, equation in enumerate(self.data.equations)
            if equation.kind is EquationKind.LINK
        }

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

    def slopes_of(self, change: ComplexArray, equations: Sequence[int]) -> FloatArray:
        """(E, k) slope over the deflection of a torque (H + 1, E, k) of the springs of some link equations."""
        out = np.zeros(change.shape[1:])
        for e in equations:
            if e in self._deflections:
                deflection = self._deflections[e]
                power = float(np.sum(np.abs(deflection) ** 2))
                if power > 0.0:
                    out[e] = -np.real(deflection.conj() @ change[1:, e]) / power
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
        left = _off(self.free_basis(noise), whiten(noise.whitener(), fit.residual * fit.scale))
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

    def tangents(
        self,
        effects: tuple[Effect, ...],
        columns: tuple[Column, ...],
        values: FloatArray,
        shapes: Sequence[tuple[int, Shape]],
    ) -> tuple[ComplexArray, FloatArray]:
        """Change with each free shape, in the coordinates of `moved`.

        Returns:
            (H + 1, E, s) of the model torque, and (E, s) of the stiffness of the springs.
        """
        counts = self.counts(effects)
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(int)
        out = np.zeros((self.data.harmonics + 1, len(self.data.equations), len(shapes)), dtype=np.complex128)
        slopes = np.zeros(out.shape[1:])
        parameters = {column.name: float(value) for column, value in zip(columns, values, strict=True)}
        for k, (position, shape) in enumerate(shapes):
            effect = effects[position]
            if isinstance(effect, SignalEffect):
                torque, slope = self.signal_tangent(effect, shape, effects, parameters)
                # `moved` counts in ranges of the amount
                out[:, :, k], slopes[:, k] = ((shape.upper - shape.lower) * part for part in (torque, slope))
                continue
            own = values[starts[position] : starts[position + 1]]
            low, high = (moved(effect, shape, step) for step in (-1e-3, 1e-3))
            state = self.state(effects)
            parts = [e.evaluate(state) for e in (low, high)]
            change = Contribution(
                (parts[1].link - parts[0].link) @ own / 2e-3, (parts[1].motor - parts[0].motor) @ own / 2e-3
            )
            out[:, :, k] = self._spectra(change, signal_effects(effects))
            if effect.side is Side.SPRING:
                slopes[:, k] = self.slopes_of(out[:, :, k : k + 1], self.links_of(effect))[:, 0]
        return out, slopes

    def links_of(self, effect: Effect) -> list[int]:
        """Link equations of the joint of an effect."""
        return [e for e in self._deflections if self.data.equations[e].joint == effect.joint]

    def signal_tangent(
        self, effect: SignalEffect, amount: Shape, effects: Sequence[Effect], parameters: dict[str, float]
    ) -> tuple[ComplexArray, FloatArray]:
        """Change with the amount of an effect in the chain of signals.

        Bodies and rotors by the analytic derivatives of their torque, all other effects by differences.

        Returns:
            (H + 1, E) of the model torque, and (E,) of the stiffness of the springs.
        """
        signals = signal_effects(effects)
        step = 1e-4 * (amount.upper - amount.lower)
        here = float(getattr(effect, amount.name))
        others = tuple(s for s in signals if s != effect)
        motions, rows, springs = [], [], []
        # what stands at another joint does not see this signal
        rest = [e for e in effects if isinstance(e, JointEffect | LoadEffect) and e.joint == effect.joint]
        for sign in (-1.0, 1.0):
            changed = (*others, replace(effect, **{amount.name: here + sign * step}))  # type: ignore[arg-type]
            motion = corrected_motion(self.robot, changed, self.data.motion)
            motions.append(motion)
            state = State(self.robot, motion, self.data.channels)
            total, spring = (np.zeros((2, len(motion), self.robot.n)) for _ in range(2))
            for e in rest:
                own = np.array([parameters.get(c.name, 0.0) for c in e.columns(self.robot)])
                if np.any(own):
                    part = e.evaluate(state)
                    total += np.stack([part.link @ own, part.motor @ own])
                    if e.side is Side.SPRING:
                        spring += np.stack([part.link @ own, part.motor @ own])
            rows.append(total)
            springs.append(spring)
        change = (rows[1] - rows[0]) / (2.0 * step)
        base = self.state(effects)
        tangent = _bodies_tangent(self, base, motions[0], motions[1], parameters) / (2.0 * step)
        part = Contribution((change[0] + tangent[0])[:, :, None], (change[1] + tangent[1])[:, :, None])
        moved_rows = Contribution(np.zeros_like(part.link), np.zeros_like(part.motor))
        if type(effect).shifted is not Effect.shifted:
            moved_rows = self._shift_tangent(effect, amount, effects, parameters, step)
        part = Contribution(part.link + moved_rows.link, part.motor + moved_rows.motor)
        stiffer = (springs[1] - springs[0])[:, :, :, None] / (2.0 * step)
        slopes = self.slopes_of(self._spectra(Contribution(stiffer[0], stiffer[1]), ()), self.links_of(effect))
        return self._spectra(part, signals)[:, :, 0], slopes[:, 0]

    def _shift_tangent(
        self, effect: SignalEffect, amount: Shape, effects: Sequence[Effect], parameters: dict[str, float], step: float
    ) -> Contribution:
        """Change of the rows (N, n, 1) by an effect that moves the torque in time."""
        state = self.state(effects)
        link, motor = (np.zeros((len(state.motion), self.robot.n, 1)) for _ in range(2))
        for e in effects:
            own = np.array([parameters.get(c.name, 0.0) for c in e.columns(self.robot)])
            if len(own) and np.any(own):
                part = e.evaluate(state)
                link[:, :, 0] += part.link @ own
                motor[:, :, 0] += part.motor @ own
        rows = Contribution(link, motor)
        ends = [
            replace(effect, **{amount.name: sign * step}).shifted(self.robot, self.data.motion.time, rows)  # type: ignore[arg-type]
            for sign in (-1.0, 1.0)
        ]
        return Contribution(
            (ends[1].link - ends[0].link) / (2.0 * step), (ends[1].motor - ends[0].motor) / (2.0 * step)
        )

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
        directions = _off(free, whiten(whitener, tangents))
        across = _off(fit.basis, directions)
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

    def anchored(self, effects: Sequence[Effect], parameters: dict[str, float] | None) -> tuple[Effect, ...]:
        """The same effects, knowing what they need of the rest of the model."""
        effects = tuple(effects)
        if parameters is None:
            return effects
        anchor = Anchor(self.robot, effects, parameters)
        return tuple(effect.anchored(anchor) for effect in effects)

    # -- noise -------------------------------------------------------------------------------------------------------

    def period_residuals(self, fit: Fit) -> ComplexArray:
        """(P, H + 1, E) residuals of every period from its own signals, scaled as that of the mean.

        They are linearised over distances as small as the error of the mean: the noise of one period would carry a
        velocity across the turn of friction that the mean, P times better known, stays on one side of.
        """
        data = self.data
        signals = signal_effects(fit.effects)
        bodies = [e for e in fit.effects if e.name in ("rigid_bodies", "rotor_inertia")]
        rest = [e for e in fit.effects if e.name not in ("rigid_bodies", "rotor_inertia")]
        own = np.concatenate(
            [np.array([fit.parameters[c.name] for c in e.columns(self.robot)]) for e in bodies] or [np.zeros(0)]
        )
        predicted = []
        for state, body_rows in self._body_rows(signals, tuple(bodies)):
            rows = body_rows @ own
            link = rows[:, : self.robot.n].copy()
            motor = rows[:, self.robot.n :].copy()
            for e in rest:
                values = np.array([fit.parameters[c.name] for c in e.columns(self.robot)])
                if len(values):
                    part = e.evaluate(state)
                    link += part.link @ values
                    motor += part.motor @ values
            part = Contribution(link, motor)
            for signal in signals:
                part = signal.shifted(self.robot, state.motion.time, part)
            predicted.append(spectrum(data.rows(part), data.harmonics))
        changes = (np.stack(predicted[1:]) - predicted[0]) * np.sqrt(data.periods)
        targets = np.stack([spectrum(data.target(tau), data.harmonics) for tau in data.period_tau_motor])
        return np.asarray(fit.scale * (fit.residual + targets - targets.mean(axis=0) - changes), dtype=np.complex128)

    def _body_rows(self, signals: tuple[Effect, ...], bodies: tuple[Effect, ...]) -> list[tuple[State, FloatArray]]:
        """State and rows (N', 2 n, k) of bodies and rotors of the mean, then of every period, at fewer samples."""
        if signals not in self._period_bodies:
            if len(self._period_bodies) > 3:
                self._period_bodies.clear()
            found = []
            mean, near = towards_mean(self.data.period_motions, 1.0 / np.sqrt(self.data.periods))
            for motion in (mean, *near):
                thin = corrected_motion(self.robot, signals, motion)[:: self._stride]
                state = State(self.robot, thin, _thinned(self.data.channels, self._stride))
                parts = [body.evaluate(state) for body in bodies]
                width = 2 * self.robot.n
                rows = np.concatenate(
                    [np.concatenate([part.link, part.motor], axis=1) for part in parts]
                    or [np.zeros((len(thin), width, 0))],
                    axis=2,
                )
                found.append((State(self.robot, thin, state.channels), rows))
            self._period_bodies[signals] = found
        return self._period_bodies[signals]

    def noise(self, fit: Fit) -> NoiseFloor:
        """Noise floor with the parameters of a fit."""
        residuals = self.period_residuals(fit)
        plain = noise_from_periods(residuals)
        whitener = plain.whitener()
        free = self.free_basis(plain)
        taken = solve(_off(free, whiten(whitener, fit.directions)), np.zeros(len(free)))[1]
        return noise_beside_model(residuals, plain, np.concatenate([free, taken], axis=1))

    @cached_property
    def torque_rms(self) -> FloatArray:
        """(E,) rms of the motor torque of the joint that each equation belongs to [N m]."""
        rms = np.sqrt(np.mean(self.data.tau_motor**2, axis=0))
        return np.asarray(rms[[equation.index for equation in self.data.equations]], dtype=np.float64)


def _thinned(channels: Mapping[str, FloatArray], stride: int) -> dict[str, FloatArray]:
    return {kind: values[::stride] for kind, values in channels.items()}


def solve(columns: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Least squares with columns that may depend on each other.

    Args:
        columns: (M, p).
        target: (M,).

    Returns:
        (p,) smallest solution in normalised columns, (M, r) orthonormal basis, and (p, r) factor L so that L L' is the
        covariance of the solution for targets of unit variance.
    """
    if columns.shape[1] == 0:
        return np.zeros(0), np.zeros((len(columns), 0)), np.zeros((0, 0))
    norms = np.linalg.norm(columns, axis=0)
    scale = np.where(norms > 1e-300, norms, 1.0)
    # QR first: the singular values of a small triangle cost next to nothing
    q, r = scipy.linalg.qr(columns / scale, mode="economic", check_finite=False)
    left, strength, right = np.linalg.svd(r)
    keep = strength > RANK_TOLERANCE * max(float(strength[0]), 1e-300)
    basis = q @ left[:, : len(strength)][:, keep]
    factor = (right[: len(strength)][keep].T / strength[keep]) / scale[:, None]
    return factor @ (basis.T @ target), basis, factor


def whiten(whitener: ComplexArray, values: ComplexArray) -> FloatArray:
    """(M, ...) whitened real numbers from coefficients (H + 1, E) or (H + 1, E, p)."""
    if values.ndim == 2:
        return stacked(np.matmul(whitener, values[:, :, None])[:, :, 0])
    return stacked(np.matmul(whitener, values))


def _off(basis: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns without their part in the span of an orthonormal basis."""
    left: FloatArray = columns - basis @ (basis.T @ columns)
    return left


def is_signal(effect: Effect) -> bool:
    """Whether an effect sits in the chain of signals."""
    return isinstance(effect, SignalEffect)


def signal_effects(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Those effects that sit in the chain of signals."""
    return tuple(effect for effect in effects if is_signal(effect))


def free_shapes(effects: Sequence[Effect]) -> tuple[tuple[int, Shape], ...]:
    """Shape parameters that a fit is free to change, and amounts of signal effects."""
    found: list[tuple[int, Shape]] = []
    for position, effect in enumerate(effects):
        stay = SHAPES_THAT_STAY.get(effect.name, ())
        shapes = effect.amounts if isinstance(effect, SignalEffect) else effect.shapes
        found.extend((position, shape) for shape in shapes if shape.name not in stay)
    return tuple(found)


def moved(effect: Effect, shape: Shape, step: float) -> Effect:
    """The effect with one shape moved: by a factor exp(step), or by `step` of its range, within its range."""
    value = float(getattr(effect, shape.name))
    new = value * np.exp(step) if shape.logarithmic else value + step * (shape.upper - shape.lower)
    return replace(effect, **{shape.name: float(np.clip(new, shape.lower, shape.upper))})  # type: ignore[arg-type]


def _bodies_tangent(bench: Bench, state: State, low: Motion, high: Motion, parameters: dict[str, float]) -> FloatArray:
    """(2, N, n) change of link and motor rows of bodies and rotors from one motion to another close by."""
    robot, motion = bench.robot, state.motion
    dx = robot.extended_state(high.q, high.theta) - robot.extended_state(low.q, low.theta)
    dv = robot.extended_rate(high.dq, high.dtheta) - robot.extended_rate(low.dq, low.dtheta)
    da = robot.extended_rate(high.ddq, high.ddtheta) - robot.extended_rate(low.ddq, low.ddtheta)
    touched = np.any(dx) or np.any(dv) or np.any(da)
    if not touched:
        return np.zeros((2, len(motion), robot.n))
    by_position, by_velocity, mass = bench_derivatives(bench, state, parameters)
    torque = np.einsum("kij,kj->ki", by_position, dx) + np.einsum("kij,kj->ki", by_velocity, dv)
    torque += np.einsum("kij,kj->ki", mass, da)
    return np.stack([torque @ robot.link_map, torque @ robot.motor_map])


def bench_derivatives(
    bench: Bench, state: State, parameters: dict[str, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives (N, nv, nv) of the torque of bodies and rotors with position, velocity, acceleration.

    The torque is linear in the inertial parameters. A unit mass is put on every body and its own derivative taken off
    again, so that a body without mass may have a first moment.
    """
    robot = bench.robot
    inertial = np.array([parameters.get(name, 0.0) for name in robot.inertial_names])
    rotors = np.array([parameters.get(f"{rotor.rotor_group}.rotor_inertia", 0.0) for rotor in robot.rotors])
    key = (tuple(inertial), tuple(rotors), id(state))
    if bench.derivatives is not None and bench.derivatives[0] == key:
        return bench.derivatives[1]
    unit = np.zeros_like(inertial)
    unit[::10] = 1.0
    offset = 1.0 + 10.0 * float(np.max(np.abs(inertial), initial=0.0))
    spare = float(np.max(np.abs(rotors), initial=1e-6))  # keeps a rotor with a negative estimate positive
    whole = robot.with_inertial_parameters(inertial + offset * unit, rotors + 2.0 * spare)
    alone = robot.with_inertial_parameters(offset * unit, np.full_like(rotors, 2.0 * spare))
    motion = state.motion
    x = np.ascontiguousarray(robot.extended_state(motion.q, motion.theta))
    v = np.ascontiguousarray(robot.extended_rate(motion.dq, motion.dtheta))
    a = np.ascontiguousarray(robot.extended_rate(motion.ddq, motion.ddtheta))
    out = []
    for part in (whole, alone):
        model = part.extended_model
        data = model.createData()
        size = model.nv
        parts = np.empty((3, len(motion), size, size))
        for k in range(len(motion)):
            pin.computeRNEADerivatives(model, data, x[k], v[k], a[k])
            parts[0, k], parts[1, k] = data.dtau_dq, data.dtau_dv
            parts[2, k] = data.M
        upper = np.triu(parts[2])
        parts[2] = upper + np.triu(upper, 1).transpose(0, 2, 1)
        out.append(parts)
    change = out[0] - out[1]
    bench.derivatives = (key, (change[0], change[1], change[2]))
    return bench.derivatives[1]
