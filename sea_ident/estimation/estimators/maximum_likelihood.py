"""Maximum likelihood with noise on angles and torques."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.sparse.linalg import LinearOperator, lsmr

from sea_ident._typing import FloatArray, IntArray
from sea_ident.estimation.estimators.base import Estimate, Estimator
from sea_ident.estimation.estimators.weights import sample_weights, steady
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.solve import solve_weighted
from sea_ident.exceptions import IdentificationError
from sea_ident.motion import Motion
from sea_ident.processing.process import SMOOTHING

STEP = 1e-6
"""Step of the numerical derivatives of the torque [rad, rad/s, rad/s2]."""


@dataclass(frozen=True)
class MaximumLikelihood(Estimator):
    """The true motion is unknown too: parameters and Fourier coefficients of q and theta are found together.

    Minimises ``sum (tau - Phi(x) psi)^2 / var_tau + sum |c - c_measured|^2 / var_c`` over the parameters psi and the
    coefficients c of the motion x. The noise of the coefficients is that of the periods, harmonic by harmonic. Rounds
    alternate between the motion (linearised, solved by LSMR with Fourier transforms) and the parameters.

    Attributes:
        smoothing: width of the window over which the torque variance is averaged [s].
        rounds: rounds at most.

    References:
        Olsen, Swevers, Verdonck, Maximum likelihood identification of a dynamic robot model: implementation issues,
        International Journal of Robotics Research, 2002.
    """

    smoothing: float = SMOOTHING
    rounds: int = 8

    name: ClassVar[str] = "maximum_likelihood"

    def estimate(self, observations: Observations) -> Estimate:
        """Estimate; see `Estimator.estimate`."""
        processed = observations.processed
        if processed.period is None or processed.periods < 2:
            raise IdentificationError(
                f"{processed.source}: maximum likelihood takes the noise of the angles from the scatter between "
                "periods; it needs a periodic recording with at least two periods"
            )
        first = sample_weights(observations, self.smoothing, steady(observations))
        weights = first.weights
        noise = _MotionNoise.build(observations)
        motion, rows = processed.motion, observations.rows
        solution, values = first.solution, first.solution.values
        correction = np.zeros(noise.size)
        for _ in range(self.rounds):
            slopes = _slopes(observations, motion, values)
            operator = _whitened(noise, slopes, weights)
            # residual as it would be at the measured motion, to first order
            residual = observations.torque - rows @ values + noise.torque(slopes, correction)
            correction = lsmr(operator, (np.sqrt(weights) * residual).ravel(), damp=1.0, atol=1e-8, btol=1e-8)[0]
            motion = noise.moved(processed.motion, correction)
            rows = observations.rows_of(motion).total
            solution = solve_weighted(rows, observations.torque, weights)
            before, values = values, solution.values
            scale = np.sqrt(np.maximum(np.diag(solution.inverse), 1e-300))
            if np.max(np.abs(values - before) / scale) < 1e-2:
                break
        slopes = _slopes(observations, motion, values)
        operator = _whitened(noise, slopes, weights)
        instruments = np.empty_like(rows)
        root = np.sqrt(weights)
        for k in range(rows.shape[-1]):
            white = (root * rows[:, :, k]).ravel()
            moved = lsmr(operator, white, damp=1.0, atol=1e-8, btol=1e-8)[0]
            instruments[:, :, k] = root * (white - operator.matvec(moved)).reshape(root.shape)
        count = rows.shape[-1]
        cross = instruments.reshape(-1, count).T @ rows.reshape(-1, count)
        inverse: FloatArray = np.asarray(np.linalg.inv(cross), dtype=np.float64)
        return Estimate(
            values=values,
            instruments=instruments,
            inverse=inverse,
            weights=weights,
            covariance=0.5 * (inverse + inverse.T),
            log_det_weighted=solution.log_det,
            motion=motion,
            notes=first.notes,
            warnings=first.warnings,
        )


@dataclass(frozen=True, eq=False)
class _MotionNoise:
    """Noise of the Fourier coefficients of the mean motion.

    Corrections are real numbers in units of standard deviations: cosine and sine part of every harmonic kept, first of
    q, then of theta at elastic joints.

    Attributes:
        period: [s].
        samples: N.
        link: (L, n) standard deviation of the coefficients of q, as of ``rfft / N``.
        motor: (M, m) of theta at the m elastic joints.
        elastic: (m,) indices of elastic joints.
        joints: n.
    """

    period: float
    samples: int
    link: FloatArray
    motor: FloatArray
    elastic: IntArray
    joints: int

    @staticmethod
    def build(observations: Observations) -> "_MotionNoise":
        processed = observations.processed
        elastic = observations.robot.elastic_indices
        q = np.stack([motion.q for motion in processed.period_motions])
        theta = np.stack([motion.theta for motion in processed.period_motions])[:, :, elastic]
        return _MotionNoise(
            period=float(processed.period or 0.0),
            samples=processed.samples,
            link=_coefficient_noise(q, processed.link_harmonics),
            motor=_coefficient_noise(theta, processed.motor_harmonics),
            elastic=elastic.astype(np.intp),
            joints=observations.robot.n,
        )

    @property
    def size(self) -> int:
        return 2 * (self.link.size + self.motor.size)

    def _signals(self, correction: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
        """(N, n) change of q and (N, n) of theta, or of a derivative."""
        split = 2 * self.link.size
        q = self._series(correction[:split], self.link, order)
        theta = q.copy()
        if self.motor.size:
            theta[:, self.elastic] = self._series(correction[split:], self.motor, order)
        return q, theta

    def _series(self, part: FloatArray, deviation: FloatArray, order: int) -> FloatArray:
        number = len(deviation)
        real, imaginary = part.reshape(2, *deviation.shape)
        spectrum = np.zeros((self.samples // 2 + 1, deviation.shape[1]), dtype=complex)
        factor = (2j * np.pi / self.period * np.arange(1, number + 1)) ** order
        spectrum[1 : number + 1] = (real + 1j * imaginary) * deviation * factor[:, None] * self.samples
        return np.asarray(np.fft.irfft(spectrum, self.samples, axis=0), dtype=np.float64)

    def _adjoint(self, signal: FloatArray, deviation: FloatArray, order: int) -> FloatArray:
        """Transpose of `_series`."""
        number = len(deviation)
        spectrum = np.fft.rfft(signal, axis=0)[1 : number + 1]
        factor = (2j * np.pi / self.period * np.arange(1, number + 1)) ** order
        back = 2.0 * np.conj(factor)[:, None] * spectrum * deviation
        return np.stack([back.real, back.imag]).ravel()

    def torque(self, slopes: FloatArray, correction: FloatArray) -> FloatArray:
        """(N, n) change of the torque; slopes (6, N, n, n) over q, q', q'', theta, theta', theta''."""
        total = np.zeros(slopes.shape[1:3])
        for order in range(3):
            q, theta = self._signals(correction, order)
            total += np.einsum("kij,kj->ki", slopes[order], q) + np.einsum("kij,kj->ki", slopes[3 + order], theta)
        return total

    def adjoint(self, slopes: FloatArray, torque: FloatArray) -> FloatArray:
        """Transpose of `torque`."""
        links = np.zeros(2 * self.link.size)
        motors = np.zeros(2 * self.motor.size)
        rigid = np.ones(self.joints, dtype=bool)
        rigid[self.elastic] = False
        for order in range(3):
            on_q = np.einsum("kij,ki->kj", slopes[order], torque)
            on_theta = np.einsum("kij,ki->kj", slopes[3 + order], torque)
            links += self._adjoint(on_q + on_theta * rigid, self.link, order)
            if self.motor.size:
                motors += self._adjoint(on_theta[:, self.elastic], self.motor, order)
        return np.concatenate([links, motors])

    def moved(self, motion: Motion, correction: FloatArray) -> Motion:
        """The motion with the correction added."""
        changes = [self._signals(correction, order) for order in range(3)]
        return Motion(
            motion.time,
            motion.q + changes[0][0],
            motion.dq + changes[1][0],
            motion.ddq + changes[2][0],
            motion.theta + changes[0][1],
            motion.dtheta + changes[1][1],
            motion.ddtheta + changes[2][1],
        )


def _coefficient_noise(stack: FloatArray, harmonics: int) -> FloatArray:
    """(L, n) standard deviation of real and imaginary part of the coefficients of the mean, smoothed over harmonics."""
    periods, samples, width = stack.shape
    if not width:
        return np.zeros((0, 0))
    coefficients = np.fft.rfft(stack, axis=1)[:, 1 : harmonics + 1] / samples
    scatter = (np.abs(coefficients - coefficients.mean(axis=0)) ** 2).sum(axis=0) / (2.0 * periods * (periods - 1.0))
    count = min(9, len(scatter))
    padded = np.pad(scatter, ((count // 2, count - 1 - count // 2), (0, 0)), mode="edge")
    smooth = [np.convolve(column, np.ones(count) / count, mode="valid") for column in padded.T]
    return np.asarray(np.sqrt(np.stack(smooth, axis=1)), dtype=np.float64)


def _slopes(observations: Observations, motion: Motion, values: FloatArray) -> FloatArray:
    """(6, N, n, n) derivatives of the torque over q, q', q'', theta, theta', theta'' of every joint.

    At a rigid joint theta is q: the derivative over theta is taken with q held, and both are added where they act.
    """
    n = observations.robot.n
    fields = ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")
    signals = {name: getattr(motion, name) for name in fields}
    slopes = np.zeros((6, len(motion), n, n))
    for f, name in enumerate(fields):
        for j in range(n):
            if not np.ptp(signals[name][:, j]):
                continue
            step = np.zeros(n)
            step[j] = STEP * max(float(np.abs(signals[name][:, j]).max()), 1e-3)
            ends = []
            for sign in (1.0, -1.0):
                changed = {**signals, name: signals[name] + sign * step}
                ends.append(observations.rows_of(Motion(motion.time, *(changed[k] for k in fields))).total @ values)
            slopes[f, :, :, j] = (ends[0] - ends[1]) / (2.0 * step[j])
    return slopes


def _whitened(noise: _MotionNoise, slopes: FloatArray, weights: FloatArray) -> LinearOperator:
    """From corrections in standard deviations to torques in standard deviations."""
    root = np.sqrt(weights)
    return LinearOperator(
        (root.size, noise.size),
        matvec=lambda x: (root * noise.torque(slopes, np.ravel(x))).ravel(),
        rmatvec=lambda y: noise.adjoint(slopes, root * np.reshape(y, root.shape)),
        dtype=np.float64,
    )
