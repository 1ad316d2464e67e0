"""Steps of encoders that no average over the periods takes away."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.motion import Motion
from sea_ident.processing.harmonics import differentiate, smoothed

WHOLE = 0.02
"""How far a difference between two values may be from a whole number of steps [steps]."""

LEAST = 1e-6
"""Steps below this share of the range of a signal are digits of a file, or do not matter."""

NOISE = np.linspace(0.0, 1.0, 201)
"""Standard deviations of noise for which it is known what of the steps repeats [steps]; more of it leaves nothing."""

ORDERS = 1000
"""Harmonics of the saw tooth that rounding adds to a position."""

STRETCHES = 32
"""Parts of a period that each have their own scatter: what is restless in one of them says nothing of the others."""

LEAST_SAMPLES = 16
"""Samples in such a part at least."""

COUNTS = 0.25
"""Share of the power of the noise of the mean from which on what repeats counts, in the harmonics where it is [-]."""

DRAWS = 8
"""Other places of the steps, for the power of what they leave in the mean."""

SEED = 2


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

    def link_power(self, stack: FloatArray) -> FloatArray:
        """(N // 2, n) power of what repeats in the harmonics of the mean of q (P, N, n), from harmonic 1 on."""
        return _power(stack.mean(axis=0), self.link, self.link_error)

    def motor_power(self, stack: FloatArray) -> FloatArray:
        """(N // 2, m) the same of theta (P, N, m) of the joints that have an encoder of it."""
        return _power(stack.mean(axis=0), self.motor[self.elastic], self.motor_error[self.elastic])

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
        # noise makes the saw tooth smaller; one that is smaller from the start belongs to a joint that hardly moves
        out[:, i] = rounded * min(errors[i] / max(float(rounded.std()), 1e-300), 1.0)
    return out


def _power(mean: FloatArray, steps: FloatArray, errors: FloatArray) -> FloatArray:
    """Power of what repeats in the harmonics of a mean over the periods.

    Errors of rounding are white only where every sample is another step. Where a step lasts for many samples, they are
    where the motion passes as many steps in a period as the harmonic has waves, and below. Rounded once more, to steps
    that lie elsewhere, the motion has errors of about the same spectrum. It is taken from the harmonics that are larger
    than steps can make them: rounding what is rounded already would change nothing.

    Args:
        mean: (N, n) positions [rad] or [m].
        steps: (n,) of the encoders.
        errors: (n,) standard deviation of what repeats.

    Returns:
        (N // 2, n) powers |c_l|^2, from harmonic 1 on.
    """
    samples = len(mean)
    coefficients = np.fft.rfft(mean, axis=0)
    moves = np.abs(coefficients / samples) ** 2 > 0.5 * errors**2
    moves[0] = True
    motion = np.fft.irfft(np.where(moves, coefficients, 0.0), samples, axis=0)
    rng = np.random.default_rng(SEED)
    draws = [_errors(motion, steps, errors, rng) for _ in range(DRAWS)]
    power = np.mean([np.abs(np.fft.rfft(draw, axis=0)[1 : samples // 2 + 1] / samples) ** 2 for draw in draws], axis=0)
    # the fastest motion for long has a peak of its own
    return np.asarray(np.maximum(power, smoothed(power)), dtype=np.float64)


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
    links, motors = (np.array([step_of(column) for column in values.T]) for values in (link, motor))
    link_errors, motor_errors = repeated_errors(link_stack, links), repeated_errors(motor_stack, motors)
    rigid = np.setdiff1d(np.arange(link.shape[1]), elastic)
    motors[rigid], motor_errors[rigid] = 0.0, 0.0
    found = EncoderSteps(links, motors, link_errors, motor_errors, elastic)
    return found if found.repeat else None


def repeated_errors(stack: FloatArray, steps: FloatArray) -> FloatArray:
    """(n,) standard deviation of what repeats, from the scatter between the periods (P, N, n); 0 where it is little.

    Args:
        stack: signals in two periods or more.
        steps: (n,) of which they are whole multiples; 0 where there are none.
    """
    if not np.any(steps > 0.0):
        return np.zeros_like(steps)
    periods, samples, _ = stack.shape
    # about half the recording apart, periods differ by all that drifts, and by an odd number by what comes in turn; the
    # median leaves out one that stands alone
    apart = 0.5 * (stack - np.roll(stack, periods // 2 | 1, axis=0)) ** 2
    stretches = np.array_split(apart, max(min(STRETCHES, samples // LEAST_SAMPLES), 1), axis=1)
    variances = np.stack([np.median(stretch.mean(axis=1), axis=0) for stretch in stretches])
    within, left = _left_by_noise()
    errors = np.zeros_like(steps)
    for i in np.flatnonzero(steps > 0.0):
        errors[i] = steps[i] * np.sqrt(np.mean(np.interp(variances[:, i] / steps[i] ** 2, within, left, right=0.0)))
    power = _power(stack.mean(axis=0), steps, errors)
    total = power.sum(axis=0)
    density = np.divide((power**2).sum(axis=0), total, out=np.zeros_like(total), where=total > 0.0)
    noise = np.median(variances, axis=0) / (periods * samples)
    return np.where(density > COUNTS * noise, errors, 0.0)


def _left_by_noise() -> tuple[FloatArray, FloatArray]:
    """Variances of one rounded position at one place of the period: between passes, and of the error of their mean.

    Rounding adds a saw tooth of the position, whose variance is a twelfth of the square of a step. Noise shifts its
    phase from pass to pass, which leaves exp(-2 (pi k sigma)^2) of its order k in the mean. Both variances together are
    that of the noise and of the saw tooth.

    Returns:
        (K,) variances between passes and (K,) of what repeats, rising and falling with the noise [steps^2].
    """
    orders = np.arange(1, ORDERS + 1)[:, None]
    left = np.sum(np.exp(-((2.0 * np.pi * orders * NOISE) ** 2)) / (2.0 * np.pi**2 * orders**2), axis=0)
    return left[0] + NOISE**2 - left, left
