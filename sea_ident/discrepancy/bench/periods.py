"""The periods of a recording in the light of a model."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.columns import KeptPeriods, PeriodStates
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import moving, nearly, signal_effects
from sea_ident.discrepancy.measured.closing import successive
from sea_ident.discrepancy.measured.data import PeriodData, spectrum, towards
from sea_ident.discrepancy.measured.noise import ComplexArray
from sea_ident.effects import Contribution, Effect, State, corrected_motion
from sea_ident.effects.drift import TrendEffect
from sea_ident.effects.memory import MemoryEffect
from sea_ident.motion import Motion
from sea_ident.robot import Robot
from sea_ident.side_by_side import side_by_side

PERIOD_SAMPLES = 2
"""Samples of a single period that its model torque is computed at, per harmonic of its motion."""

AMOUNT_DIGITS = 3
"""Digits of errors in the chain of signals that periods are compared behind: they are the same in all of them."""


BODIES = "rigid_bodies", "rotor_inertia"
"""Effects whose columns cost the most."""

STATES_KEPT = 6
"""Halves of the periods, each behind other effects in the chain of signals, that are kept."""


def with_other_steps(data: PeriodData) -> PeriodData | None:
    """Its mean with steps of the encoders that lie elsewhere, as periods of a recording; None where they average out.

    What these periods differ by is what such steps do to a torque, in every period of the recording alike, times the
    root of their number: periods are compared at that part of their distance from the mean.
    """
    if data.step_errors is None:
        return None
    size = np.sqrt(len(data.step_errors))
    return replace(
        data,
        period_motions=tuple(data.motion.plus(size * errors) for errors in data.step_errors),
        period_tau_motor=np.stack([data.tau_motor] * len(data.step_errors)),
        places=(),
        step_errors=None,
    )


class Periods:
    """Evaluates models on every period; what was computed once is kept.

    Args:
        data: the recording.
        kept: what was evaluated on it already.
    """

    def __init__(self, data: PeriodData, kept: KeptPeriods) -> None:
        self.data = data
        self.robot = data.robot
        stride = max(1, data.samples // (PERIOD_SAMPLES * data.reach + 1))
        self._stride = next(s for s in range(stride, 0, -1) if data.samples % s == 0)
        self._kept = kept

    def residuals(self, fit: Fit) -> ComplexArray:
        """(P, H + 1, E) residuals of every period from its own signals, scaled as that of the mean."""
        targets, changes = (spectrum(part, self.data.harmonics) for part in self._deviations(fit))
        return np.asarray(fit.scale * (fit.residual + np.moveaxis(targets - changes, 1, 0)), dtype=np.complex128)

    def steps(self, fit: Fit) -> ComplexArray:
        """(S, H + 1, E) differences between residuals of successive periods over the root of two, scaled alike.

        A period cut out of a recording does not close: noise jumps at its ends, and where noise is differentiated the
        jump is seen in all harmonics. The mean of successive periods has no part in that, for what one ends with the
        next begins with. So every period is led over into the one before it, whose end is its beginning; its energy
        stays the same at every phase. Few periods are taken as they are, for that costs one of them.
        """
        places = self.data.places or tuple(range(self.data.periods))
        targets, changes = (spectrum(successive(part, places), self.data.harmonics) for part in self._deviations(fit))
        return np.asarray(fit.scale * np.moveaxis(targets - changes, 1, 0), dtype=np.complex128)

    def _deviations(self, fit: Fit) -> tuple[FloatArray, FloatArray]:
        """(N, P, E) measured torques and (N', P, E) torques of a model, in what every period differs from the mean.

        They are linearised over distances as small as the error of the mean: the noise of one period would carry a
        velocity across the turn of friction that the mean, P times better known, stays on one side of.
        """
        data = self.data
        # each process keeps the states of its half
        model = np.concatenate(list(side_by_side(lambda half: self.torque(fit, half), self._halves)), axis=1)
        changes = (model[:, 1:] - model[:, :1]) * np.sqrt(data.periods)
        targets = np.stack([data.target(tau) for tau in data.period_tau_motor], axis=1)
        return targets - data.target(data.tau_motor)[:, None], changes

    def torque(self, fit: Fit, which: range) -> FloatArray:
        """(N', S, E) torque of a model in the mean (0) and in periods (from 1 on)."""
        signals = signal_effects(fit.effects)
        bodies = [e for e in fit.effects if e.name in BODIES]
        rest = [e for e in fit.effects if e.name not in BODIES]
        own = np.concatenate(
            [np.array([fit.parameters[c.name] for c in e.columns(self.robot)]) for e in bodies] or [np.zeros(0)]
        )
        states = self._states(moving(signals), tuple(bodies), which)
        rows = states.bodies @ own
        link, motor = rows[:, : self.robot.n].copy(), rows[:, self.robot.n :].copy()
        for effect, values in torques_of(rest, fit.parameters, self.robot):
            # all periods together cost little more than one; but what remembers its path begins each anew
            pieces = _pieces(states) if isinstance(effect, MemoryEffect) else [(slice(None), states.joined)]
            for piece, state in pieces:
                add_torque(effect, values, state, link[piece], motor[piece])
        found = []
        for piece, state in _pieces(states):
            total = Contribution(link[piece], motor[piece])
            for signal in signals:
                total = signal.shifted(self.robot, state.motion.time, total)
            found.append(self.data.rows(total))
        return np.stack(found, axis=1)

    def column_changes(self, effect: TrendEffect, fit: Fit) -> ComplexArray:
        """(P, H + 1, E, k) what the columns of a trend are in every period beyond those of the mean, unscaled.

        A spring that softens is deflected more and more: the columns of one period are not those of another.
        """
        data, signals = self.data, signal_effects(fit.effects)
        bodies = tuple(e for e in fit.effects if e.name in BODIES)
        states = [state for half in self._halves for state in self._states(moving(signals), bodies, half).each]
        torques = [
            data.tau_motor,
            *(data.tau_motor + (tau - data.tau_motor) / np.sqrt(data.periods) for tau in data.period_tau_motor),
        ]
        found = []
        for state, torque in zip(states, torques, strict=True):
            channels = {**(state.channels or {}), "tau_motor": torque[:: self._stride]}
            part = effect.steady(replace(state, channels=channels))
            for signal in signals:
                part = signal.shifted(self.robot, state.motion.time, part)
            found.append(spectrum(data.rows(part), data.harmonics))
        return np.asarray((np.stack(found[1:]) - found[0]) * np.sqrt(data.periods), dtype=np.complex128)

    @property
    def _halves(self) -> tuple[range, range]:
        """The mean (0) and the first periods, and the others."""
        middle = self.data.periods // 2 + 1
        return range(middle), range(middle, self.data.periods + 1)

    def _states(self, signals: tuple[Effect, ...], bodies: tuple[Effect, ...], which: range) -> PeriodStates:
        """The mean (0) and periods (from 1 on) behind effects in the chain of signals."""
        signals = nearly(signals, AMOUNT_DIGITS)
        if (signals, which) not in self._kept:
            if len(self._kept) > STATES_KEPT:
                self._kept.clear()
            mean, data = self.data.motion, self.data
            some = data.period_motions[max(which.start - 1, 0) : which.stop - 1]
            motions = towards(mean, [*([mean] if 0 in which else []), *some], 1.0 / np.sqrt(data.periods))
            thin = [corrected_motion(self.robot, signals, motion)[:: self._stride] for motion in motions]
            channels = {kind: values[:: self._stride] for kind, values in self.data.channels.items()}
            many = {kind: np.concatenate([values] * len(thin)) for kind, values in channels.items()}
            joined = State(self.robot, Motion.concatenate(thin), many)
            parts = [body.evaluate(joined) for body in bodies]
            rows = [np.concatenate([part.link, part.motor], axis=1) for part in parts]
            nothing = np.zeros((len(joined.motion), 2 * self.robot.n, 0))
            # other states than those of the bodies, for these keep their regressor
            self._kept[signals, which] = PeriodStates(
                tuple(State(self.robot, motion, channels) for motion in thin),
                State(self.robot, joined.motion, many),
                np.concatenate([nothing, *rows], axis=2),
            )
        return self._kept[signals, which]


def _pieces(states: PeriodStates) -> list[tuple[slice, State]]:
    """The rows of the mean and of every period, and its state."""
    length = len(states.each[0].motion)
    return [(slice(k * length, (k + 1) * length), state) for k, state in enumerate(states.each)]


def torques_of(
    effects: Sequence[Effect], parameters: Mapping[str, float], robot: Robot
) -> list[tuple[Effect, FloatArray]]:
    """Effects with columns, and the values (k,) of these."""
    values = [np.array([parameters[column.name] for column in effect.columns(robot)]) for effect in effects]
    return [(effect, each) for effect, each in zip(effects, values, strict=True) if len(each)]


def model_torque(
    begun: Contribution, acting: Sequence[tuple[Effect, FloatArray]], signals: Sequence[Effect], state: State
) -> Contribution:
    """Torques (N, n) of a model on one motion.

    Args:
        begun: torques (N, n) that are known already.
        acting: effects and the values of their columns.
        signals: effects in the chain of signals, those that only change the torque too.
        state: robot and motion.
    """
    link, motor = begun.link.copy(), begun.motor.copy()
    for effect, values in acting:
        add_torque(effect, values, state, link, motor)
    total = Contribution(link, motor)
    for signal in signals:
        total = signal.shifted(state.robot, state.motion.time, total)
    return total


def add_torque(effect: Effect, values: FloatArray, state: State, link: FloatArray, motor: FloatArray) -> None:
    """Add the torque of an effect with these values (k,) of its columns to that at links and motors (N, n)."""
    part = effect.evaluate(state)
    joint = slice(None) if part.joint is None else part.joint
    link[:, joint] += part.link[:, joint] @ values
    motor[:, joint] += part.motor[:, joint] @ values
