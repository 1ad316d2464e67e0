"""How the torque of a model changes with its nonlinear parameters."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from scipy.signal import resample

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.columns import Columns, Evaluated
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import distance, moved_within, signal_effects
from sea_ident.discrepancy.measured.data import EquationKind, PeriodData, spectrum
from sea_ident.discrepancy.measured.noise import ComplexArray
from sea_ident.effects import Column, Contribution, Effect, JointEffect, Shape, Side, State, corrected_motion
from sea_ident.effects.load import LoadEffect
from sea_ident.effects.signal import SignalEffect
from sea_ident.motion import Motion
from sea_ident.robot.model import LONGEST_LEVER

SAMPLES_PER_HARMONIC = 4
"""Samples of the derivatives of the dynamics for every harmonic that is compared: what folds back into these is three
times as high, where a motion has next to nothing [-]."""

STEP = 2e-5
"""Step by which the change with a shape is told, in the coordinates of `moved`: the ratio of a transmission between a
slide and a turning joint has a range of hundreds of radians per metre, and turns friction over within a hundredth [-].
"""

SIGNALS_KEPT = 12
"""Errors of the encoders of which the deflections are kept."""


class Tangents(Columns):
    """Derivatives with respect to shapes and to amounts of effects in the chain of signals.

    Args:
        data: the recording.
        evaluated: what was evaluated on it already.
    """

    def __init__(self, data: PeriodData, evaluated: Evaluated | None = None) -> None:
        super().__init__(data, evaluated)
        self._stiffness: tuple[Fit, FloatArray] | None = None
        self._derivatives: tuple[State, object, tuple[FloatArray, FloatArray, FloatArray]] | None = None

    def stiffness_slopes(
        self, columns: Sequence[Column], design: ComplexArray, effects: Sequence[Effect]
    ) -> FloatArray:
        """(E, p) part of every parameter in the mean slope of the spring torque of a link over its deflection."""
        out = np.zeros((len(self.data.equations), len(columns)))
        for e, deflection in self._deflections(signal_effects(effects)).items():
            joint = self.data.equations[e].joint
            own = [k for k, c in enumerate(columns) if c.joint == joint and c.side is Side.SPRING]
            if own:
                out[e, own] = _slope(design[1:, e, own], deflection)
        return out

    def stiffness_of(self, fit: Fit) -> FloatArray:
        """(E,) slope of the springs of a fit over their deflection, with what is known beside it."""
        if self._stiffness is not None and self._stiffness[0] is fit:
            return self._stiffness[1]
        counts, signals = self.counts(fit.effects), signal_effects(fit.effects)
        begins = np.cumsum([0, *counts])
        total = np.zeros(len(self.data.equations)) if fit.known is None else fit.known.stiffness.copy()
        for effect, begin, count in zip(fit.effects, begins, counts, strict=False):
            columns = fit.columns[begin : begin + count]
            if any(column.side is Side.SPRING for column in columns):
                slopes = self.stiffness_slopes(columns, self.columns_behind(effect, signals), fit.effects)
                total += slopes @ fit.values[begin : begin + count]
        self._stiffness = fit, total
        return total

    @cached_property
    def links(self) -> tuple[int, ...]:
        """The link equations."""
        return tuple(e for e, equation in enumerate(self.data.equations) if equation.kind is EquationKind.LINK)

    def _deflections(self, signals: tuple[Effect, ...]) -> dict[int, ComplexArray]:
        """(H,) spectrum of the deflection, without its mean, for every link equation.

        As right encoders show it, for their noise is to be measured in it. What one shows late is no deflection: over
        that a spring would seem softer than it is.
        """
        shown = self._evaluated.deflections
        if signals not in shown:
            if len(shown) > SIGNALS_KEPT:
                shown.clear()
            motion = self.data.motion
            for signal in signals:
                motion = signal.read(self.robot, motion)
            deflection = spectrum(motion.deflection, self.data.harmonics)[1:]
            shown[signals] = {e: deflection[:, self.data.equations[e].index] for e in self.links}
        return shown[signals]

    def slopes_of(self, change: ComplexArray, equations: Sequence[int], effects: Sequence[Effect]) -> FloatArray:
        """(E, k) slope over the deflection of a torque (H + 1, E, k) of the springs of some links within a model."""
        out, deflections = np.zeros(change.shape[1:]), self._deflections(signal_effects(effects))
        for e in equations:
            out[e] = _slope(change[1:, e], deflections[e])
        return out

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
            low, high = (moved_within(effects, position, shape, step) for step in (-STEP, STEP))
            state, apart = self.state(effects), distance(low[position], high[position], shape)
            for j, pair in enumerate(zip(low, high, strict=True)):
                if pair[0] is pair[1]:
                    continue
                own = values[starts[j] : starts[j + 1]]
                parts = [e.evaluate(state) for e in pair]
                change = Contribution(
                    (parts[1].link - parts[0].link) @ own / apart, (parts[1].motor - parts[0].motor) @ own / apart
                )
                out[:, :, k] += self._spectra(change, signal_effects(effects))
            if effect.side is Side.SPRING:
                slopes[:, k] = self.slopes_of(out[:, :, k : k + 1], self.links_of(effect), effects)[:, 0]
        return out, slopes

    def followed(
        self, effects: tuple[Effect, ...], columns: tuple[Column, ...], values: FloatArray
    ) -> ComplexArray | None:
        """(H + 1, E, p) change of what effects do with the bodies that they are anchored in; None where there is none.

        An estimate is as unsure as what it is multiplied by.
        """
        begins, names = np.cumsum([0, *self.counts(effects)]), [column.name for column in columns]
        out: ComplexArray | None = None
        for effect, begin, end in zip(effects, begins, begins[1:], strict=False):
            rows = effect.followed(self.state(effects), values[begin:end])
            if rows is None or not set(self.robot.inertial_names) <= set(names):
                continue
            change = np.zeros((self.data.harmonics + 1, len(self.data.equations), len(names)), dtype=np.complex128)
            own = [names.index(name) for name in self.robot.inertial_names]
            change[:, :, own] = self._spectra(Contribution(rows, np.zeros_like(rows)), signal_effects(effects))
            out = change if out is None else out + change
        return out

    def links_of(self, effect: Effect) -> list[int]:
        """Link equations of the joint of an effect, all of one that acts at all joints."""
        return [e for e in self.links if effect.joint in (None, self.data.equations[e].joint)]

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
        # corrections do not commute: every one stays in its place
        chain = signals if effect in signals else (*signals, effect)
        motions, rows, springs, wholes = [], [], [], []
        # what stands at another joint does not see this signal
        own_joint = [e for e in effects if effect.joint in (None, e.joint)]
        rest = [e for e in own_joint if isinstance(e, JointEffect | LoadEffect)]
        for sign in (-1.0, 1.0):
            changed = replace(effect, **{amount.name: here + sign * step})  # type: ignore[arg-type]
            whole = tuple(changed if signal == effect else signal for signal in chain)
            motion = corrected_motion(self.robot, whole, self.data.motion)
            motions.append(motion)
            wholes.append(whole)
            state = State(self.robot, motion, self.data.channels)
            total, spring = (np.zeros((2, len(motion), self.robot.n)) for _ in range(2))
            for e in rest:
                own = np.array([parameters.get(c.name, 0.0) for c in e.columns(self.robot)])
                if np.any(own):
                    part = e.evaluate(state)
                    for side, acts in enumerate((part.link @ own, part.motor @ own)):
                        total[side] += acts
                        if e.side is Side.SPRING:
                            spring[side] += acts
            rows.append(total)
            springs.append(spring)
        change = (rows[1] - rows[0]) / (2.0 * step)
        base = self.state(effects)
        tangent = self._bodies_tangent(base, motions[0], motions[1], parameters) / (2.0 * step)
        part = Contribution((change[0] + tangent[0])[:, :, None], (change[1] + tangent[1])[:, :, None])
        moved_rows = Contribution(np.zeros_like(part.link), np.zeros_like(part.motor))
        if type(effect).shifted is not Effect.shifted:
            moved_rows = self._shift_tangent(effect, amount, effects, parameters, step)
        part = Contribution(part.link + moved_rows.link, part.motor + moved_rows.motor)
        low, high = (
            self.slopes_of(self._spectra(Contribution(*spring[:, :, :, None]), ()), self.links_of(effect), whole)
            for spring, whole in zip(springs, wholes, strict=True)
        )
        return self._spectra(part, signals)[:, :, 0], (high - low)[:, 0] / (2.0 * step)

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

    def _bodies_tangent(self, state: State, low: Motion, high: Motion, parameters: dict[str, float]) -> FloatArray:
        """(2, N, n) change of link and motor rows of bodies and rotors from one motion to another close by.

        Evaluated at some samples, as many as its harmonics ask for.
        """
        robot, count = self.robot, len(state.motion)
        some = slice(None, None, self._stride)
        low, high = low[some], high[some]
        dx = robot.extended_state(high.q, high.theta) - robot.extended_state(low.q, low.theta)
        dv = robot.extended_rate(high.dq, high.dtheta) - robot.extended_rate(low.dq, low.dtheta)
        da = robot.extended_rate(high.ddq, high.ddtheta) - robot.extended_rate(low.ddq, low.ddtheta)
        touched = np.any(dx) or np.any(dv) or np.any(da)
        if not touched:
            return np.zeros((2, count, robot.n))
        by_position, by_velocity, mass = self._dynamics_derivatives(state, parameters)
        torque = np.einsum("kij,kj->ki", by_position, dx) + np.einsum("kij,kj->ki", by_velocity, dv)
        torque += np.einsum("kij,kj->ki", mass, da)
        torque = torque if self._stride == 1 else np.asarray(resample(torque, count, axis=0))
        return np.stack([torque @ robot.link_map, torque @ robot.motor_map])

    @cached_property
    def _stride(self) -> int:
        """Every which sample is enough for the derivatives of the dynamics: the largest divisor of their number."""
        samples, harmonics = self.data.samples, self.data.harmonics
        enough = max(SAMPLES_PER_HARMONIC * harmonics, harmonics + self.data.reach + 1)
        return max(k for k in range(1, samples + 1) if samples % k == 0 and (k == 1 or samples // k >= enough))

    def _dynamics_derivatives(
        self, state: State, parameters: dict[str, float]
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Derivatives (K, nv, nv) of the torque of bodies and rotors with position, velocity, acceleration.

        At every sample that `_stride` leaves.

        The torque is linear in the inertial parameters. Where a body that slides has a first moment without a mass,
        which is no lever, or a rotor has no inertia, more is put on every body and its own derivative taken off again.
        """
        robot = self.robot
        inertial = robot.of_positive_mass(np.array([parameters.get(name, 0.0) for name in robot.inertial_names]))
        rotors = np.array([parameters.get(f"{rotor.rotor_group}.rotor_inertia", 0.0) for rotor in robot.rotors])
        key = tuple(inertial), tuple(rotors)
        if self._derivatives is not None and self._derivatives[0] is state and self._derivatives[1] == key:
            return self._derivatives[2]
        bodies = inertial.reshape(-1, 10)
        moments = np.linalg.norm(bodies[:, 1:4], axis=1)
        if np.all(rotors > 0.0) and np.all(bodies[:, 0] > moments / LONGEST_LEVER):
            models = [robot.with_inertial_parameters(inertial, rotors)]
        else:
            unit = np.zeros_like(inertial)
            unit[::10] = 1.0
            offset = 1.0 + 10.0 * float(np.max(np.abs(inertial), initial=0.0))
            spare = float(np.max(np.abs(rotors), initial=1e-6))  # keeps a rotor with a negative estimate positive
            models = [
                robot.with_inertial_parameters(inertial + offset * unit, rotors + 2.0 * spare),
                robot.with_inertial_parameters(offset * unit, np.full_like(rotors, 2.0 * spare)),
            ]
        motion = state.motion[:: self._stride]
        x = np.ascontiguousarray(robot.extended_state(motion.q, motion.theta))
        v = np.ascontiguousarray(robot.extended_rate(motion.dq, motion.dtheta))
        a = np.ascontiguousarray(robot.extended_rate(motion.ddq, motion.ddtheta))
        out = []
        for part in models:
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
        change = out[0] if len(out) == 1 else out[0] - out[1]
        self._derivatives = state, key, (change[0], change[1], change[2])
        return self._derivatives[2]


def _slope(torque: ComplexArray, deflection: ComplexArray) -> FloatArray:
    """(k,) slope of the spring torque that springs leave in a link equation (H, k) over the deflection (H,)."""
    power = float(np.sum(np.abs(deflection) ** 2))
    if power == 0.0:
        return np.zeros(torque.shape[1])
    return np.asarray(-np.real(deflection.conj() @ torque) / power, dtype=np.float64)
