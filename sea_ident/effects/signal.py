"""Effects in the chain of signals: encoders that err, signals that come late."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, no_torque
from sea_ident.effects.base import Column, Effect, Shape
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.motion import Motion
from sea_ident.robot import Robot


class SignalEffect(Effect):
    """An effect in a sensor or on the way of a signal.

    It adds no torque and so no column. It says how to get from the signal as recorded to the signal as it was, and
    its amounts enter the model through all other columns. Both directions exist: `corrected` and `shifted` for a
    model, `measured` for a simulation.

    A search uses the derivative of the model torque with respect to its amounts.
    """

    side: ClassVar[Side] = Side.SENSOR
    amounts: ClassVar[tuple[Shape, ...]]

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """None: its amounts are attributes."""
        self.indices(robot)
        return ()

    def evaluate(self, state: State) -> Contribution:
        """No columns."""
        empty = np.zeros((len(state.motion), state.robot.n, 0))
        return Contribution(empty, empty)

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """None: it acts in `measured`."""
        return no_torque

    @abstractmethod
    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """The signals (N, n) as recorded, from the true ones."""

    def delivered(self, robot: Robot, time: FloatArray, tau_motor: FloatArray) -> FloatArray:
        """(N, n) torques of the motors as they acted, from those recorded [N m] or [N]; the same by default."""
        return tau_motor

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """Its amounts with the ranges that they have beside the rest of the model; those of its kind by default."""
        return self.amounts

    @property
    def amount_values(self) -> dict[str, float]:
        """Values of its amounts."""
        return {amount.name: float(getattr(self, amount.name)) for amount in self.amounts}

    def indices(self, robot: Robot) -> tuple[int, ...]:
        """Indices of the joints whose signals it changes; by default that of its joint.

        Raises:
            EffectError: if none was given, where it acts at a joint.
        """
        return (self.required_index(robot),)

    def required_index(self, robot: Robot) -> int:
        """Index of its joint.

        Raises:
            EffectError: if none was given.
        """
        if self.joint is None:
            raise EffectError(f"the effect {self.name!r} acts at a joint; give joint=...")
        return robot.index(self.joint)


class DelayEffect(SignalEffect):
    """A signal that comes late: that of a joint or, where none is given, those of all joints by the same time.

    Currents and angles that two devices record have one delay between them, not one per joint.
    """

    def indices(self, robot: Robot) -> tuple[int, ...]:
        """That of its joint; all where it has none."""
        return tuple(range(robot.n)) if self.joint is None else (self.required_index(robot),)


WANDERED = 0.5
"""Share of the largest step by which the ends of the mean of periods may miss each other [-]."""


def is_closed(values: FloatArray) -> bool:
    """Whether samples (N,) or (N, n) of one uniform period close on themselves.

    The mean of periods that wander, as those of a joint without a controller of its position do, closes but for a part
    of a step.
    """
    if len(values) < 8:
        return False
    bend = np.abs(np.diff(values, n=2, axis=0)).max(axis=0)
    step = np.abs(np.diff(values, axis=0)).max(axis=0)
    gap = np.abs(values[0] - (2.0 * values[-1] - values[-2]))
    return bool(np.all(gap <= np.maximum(3.0 * bend, WANDERED * step) + 1e-12))


def ahead(time: FloatArray, values: FloatArray, by: float) -> FloatArray:
    """Values (N, ...) at ``time + by`` from values at the uniform times (N,) [s].

    A closed period is shifted round, exactly as a Fourier series; any other signal is interpolated by a cubic spline
    and held at its ends.
    """
    if by == 0.0:
        return values
    if is_closed(values.reshape(len(values), -1)):
        step = float(time[-1] - time[0]) / (len(time) - 1)
        spectrum = np.fft.rfft(values, axis=0)
        phase = np.exp(2j * np.pi * np.fft.rfftfreq(len(time), step) * by)
        turned = spectrum * phase.reshape(-1, *([1] * (values.ndim - 1)))
        return np.asarray(np.fft.irfft(turned, n=len(time), axis=0), dtype=np.float64)
    spline = CubicSpline(time, values, axis=0)
    return np.asarray(spline(np.clip(time + by, time[0], time[-1])), dtype=np.float64)


def rate_of(time: FloatArray, values: FloatArray) -> FloatArray:
    """Rate of change of values (N,) at the uniform times (N,) [s]: of a closed period exactly, as a Fourier series."""
    if is_closed(values):
        step = float(time[-1] - time[0]) / (len(time) - 1)
        spectrum = np.fft.rfft(values) * 2j * np.pi * np.fft.rfftfreq(len(time), step)
        return np.asarray(np.fft.irfft(spectrum, n=len(time)), dtype=np.float64)
    return np.asarray(CubicSpline(time, values)(time, 1), dtype=np.float64)


def below(time: FloatArray, values: FloatArray, corner: float) -> FloatArray:
    """What of values (N,) at the uniform times (N,) [s] is slower than a corner frequency [rad/s], in phase.

    Of a closed period its harmonics up to there, of any other signal what a Butterworth filter leaves.
    """
    step = float(time[-1] - time[0]) / (len(time) - 1)
    if is_closed(values):
        spectrum = np.fft.rfft(values)
        spectrum[2.0 * np.pi * np.fft.rfftfreq(len(time), step) > corner] = 0.0
        return np.asarray(np.fft.irfft(spectrum, n=len(time)), dtype=np.float64)
    share = corner * step / np.pi
    if share >= 1.0:
        return values
    return np.asarray(sosfiltfilt(butter(2, share, output="sos"), values), dtype=np.float64)


def with_joint(robot: Robot, motion: Motion, joint: int, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> Motion:
    """The motion with other link samples (N,) of one joint; where it is rigid, the motor follows."""
    new = {
        "q": _replaced(motion.q, joint, q),
        "dq": _replaced(motion.dq, joint, dq),
        "ddq": _replaced(motion.ddq, joint, ddq),
    }
    if robot.joints[joint].elastic:
        return Motion(motion.time, new["q"], new["dq"], new["ddq"], motion.theta, motion.dtheta, motion.ddtheta)
    return Motion(
        motion.time, new["q"], new["dq"], new["ddq"],
        _replaced(motion.theta, joint, q), _replaced(motion.dtheta, joint, dq), _replaced(motion.ddtheta, joint, ddq),
    )  # fmt: skip


def _replaced(values: FloatArray, column: int, new: FloatArray) -> FloatArray:
    out = values.copy()
    out[:, column] = new
    return out


def corrected_motion(robot: Robot, effects: Sequence[Effect], motion: Motion) -> Motion:
    """The motion with the errors of all sensors taken out that the effects of a model describe, in whatever order."""
    for effect in sorted(effects, key=_depth):
        motion = effect.corrected(robot, motion)
    return motion


def measured_signals(
    robot: Robot, effects: Sequence[Effect], time: FloatArray, signals: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """The signals as recorded, with all that the effects do to them: the way back of `corrected_motion`."""
    shown = dict(signals)
    for effect in reversed(sorted(effects, key=_depth)):
        shown = effect.measured(robot, time, shown)
    return shown


def _depth(effect: Effect) -> int:
    return effect.depth
