"""Steps of encoders that no average over the periods takes away."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.motion import Motion
from sea_ident.processing.harmonics import differentiate

WHOLE = 0.02
"""How far a difference between two values may be from a whole number of steps [steps]."""

LEAST = 1e-6
"""Steps below this share of the range of a signal are digits of a file, or do not matter."""

TOP = 0.875
"""Share of the spectrum above which it is compared: lower down, the jerks of a motor at reversals repeat, too."""

FEWEST = 40
"""Harmonics that are compared at least, where there are as many."""

SURE = 5.0
"""Standard deviations by which the mean must have more there than the scatter of the periods leaves."""


@dataclass(frozen=True, eq=False)
class EncoderSteps:
    """Steps of encoders, and what of them is the same in every period.

    Noise of more than about half a step makes the steps average out. With less, every period passes the same steps at
    the same places; what they do to the acceleration then is in the mean, and no spread between periods shows it.

    Attributes:
        link: (n,) steps of q [rad] or [m]; 0 where there are none.
        motor: (n,) steps of theta.
        link_error: (n,) standard deviation of what repeats in q [rad] or [m]; 0 where steps average out.
        motor_error: (n,) the same of theta.
        elastic: (m,) joints that have an encoder of theta; that of q is the only one of the others.
    """

    link: FloatArray
    motor: FloatArray
    link_error: FloatArray
    motor_error: FloatArray
    elastic: IntArray

    @property
    def repeat(self) -> bool:
        """Whether steps of any encoder repeat."""
        return bool(np.any(self.link_error > 0.0) or np.any(self.motor_error > 0.0))

    @property
    def joints(self) -> NDArray[np.bool_]:
        """(n,) joints with an encoder whose steps repeat."""
        return np.asarray((self.link_error > 0.0) | (self.motor_error > 0.0))

    def words(self, joint_names: tuple[str, ...]) -> str:
        """Which encoders have steps that repeat, with numbers."""
        return ", ".join(
            f"{kind}_{name} {step:.3g} (repeated error {error:.2g} rms)"
            for kind, steps, errors in (("q", self.link, self.link_error), ("theta", self.motor, self.motor_error))
            for name, step, error in zip(joint_names, steps, errors, strict=True)
            if error > 0.0
        )

    def another(
        self, motion: Motion, period: float, harmonics: tuple[int, int], rng: np.random.Generator
    ) -> FloatArray:
        """An error of the mean motion as these encoders make it when their steps lie elsewhere.

        Args:
            motion: (N, n) mean motion.
            period: [s].
            harmonics: of q and of theta.
            rng: draws where the steps lie.

        Returns:
            (6, N, n) errors of q, q', q'', theta, theta', theta''.
        """
        link = _errors(motion.q, self.link, self.link_error, rng)
        motor = link.copy()
        own = _errors(motion.theta, self.motor, self.motor_error, rng)
        motor[:, self.elastic] = own[:, self.elastic]
        return np.stack([*differentiate(link, period, harmonics[0]), *differentiate(motor, period, harmonics[1])])


def _errors(values: FloatArray, steps: FloatArray, errors: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(N, n) differences of values (N, n) to the next step, of the size (n,) that repeats."""
    out = np.zeros_like(values)
    for i in np.flatnonzero(errors > 0.0):
        shifted = values[:, i] + rng.uniform(0.0, steps[i])
        rounded = np.round(shifted / steps[i]) * steps[i] - shifted
        out[:, i] = rounded * (errors[i] / max(float(rounded.std()), 1e-300))
    return out


def step_of(values: FloatArray) -> float:
    """The step of which all values (M,) are whole multiples but for an offset; 0 where there is none."""
    levels = np.unique(values)
    distances = np.diff(levels)
    if len(distances) < 2:
        return 0.0
    step = float(distances.min())
    if step < LEAST * (levels[-1] - levels[0]):
        return 0.0
    number = distances / step
    return step if bool(np.all(np.abs(number - np.round(number)) <= WHOLE * np.maximum(number, 1.0) ** 0.5)) else 0.0


def encoder_steps(
    link: FloatArray, motor: FloatArray, link_stack: FloatArray, motor_stack: FloatArray, elastic: IntArray
) -> EncoderSteps | None:
    """The steps of all encoders.

    Args:
        link: (M, n) q as it was recorded [rad] or [m].
        motor: (M, n) theta.
        link_stack: (P, N, n) q of the periods.
        motor_stack: (P, N, n) theta of the periods.
        elastic: (m,) joints that have an encoder of theta.

    Returns:
        The steps; None where none repeats, or where a single period cannot tell.
    """
    if len(link_stack) < 2:
        return None
    parts = []
    for values, stack in ((link, link_stack), (motor, motor_stack)):
        steps = np.array([step_of(column) for column in values.T])
        parts.append((steps, _repeated(stack, steps) if np.any(steps > 0.0) else np.zeros_like(steps)))
    (links, link_errors), (motors, motor_errors) = parts
    rigid = np.setdiff1d(np.arange(link.shape[1]), elastic)
    motors[rigid], motor_errors[rigid] = 0.0, 0.0
    found = EncoderSteps(links, motors, link_errors, motor_errors, elastic)
    return found if found.repeat else None


def _repeated(stack: FloatArray, steps: FloatArray) -> FloatArray:
    """(n,) standard deviation of what repeats, at most that of steps alone, from the top of the spectrum."""
    periods, samples, _ = stack.shape
    most = samples // 2
    first = max(min(int(TOP * most), most - FEWEST), 1)
    coefficients = np.fft.rfft(stack, axis=1)[:, first : most + 1] / samples
    mean = coefficients.mean(axis=0)
    scatter = (np.abs(coefficients - mean) ** 2).sum(axis=0).mean(axis=0) / (periods * (periods - 1))
    # powers of noise are exponentially distributed: their median is ln 2 of the mean, and scatters as mean / sqrt(L)
    floor = np.median(np.abs(mean) ** 2, axis=0) / np.log(2.0)
    limit = 1.0 + SURE / np.sqrt(len(mean))
    variance = np.where(floor > limit * scatter, (floor - scatter) * samples, 0.0)
    return np.asarray(np.sqrt(np.minimum(variance, steps**2 / 12.0)), dtype=np.float64)
