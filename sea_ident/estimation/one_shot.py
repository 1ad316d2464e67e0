"""Dynamics and springs in one estimation, as an alternative to the paper's two steps."""

import warnings as python_warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects import Effect
from sea_ident.estimation.estimators.weights import LEAST_REST, steady
from sea_ident.estimation.identify import identify
from sea_ident.estimation.model import Model
from sea_ident.estimation.observations import Observations, Rows, SpringSide
from sea_ident.estimation.period_scores import period_scores
from sea_ident.estimation.spring_result import SpringResult
from sea_ident.estimation.uncertainty import FEW_PERIODS, CovarianceKind, Uncertainty
from sea_ident.exceptions import IdentificationError, SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.one_thread import one_thread
from sea_ident.processing import ProcessedRecording, process
from sea_ident.processing.process import SMOOTHING
from sea_ident.processing.variance import smooth_over_phase
from sea_ident.recordings import Recording
from sea_ident.robot import Robot

ROUNDS = 3


@one_thread
def identify_one_shot(
    robot: Robot,
    recording: Recording | ProcessedRecording,
    *,
    effects: Sequence[Effect] | None = None,
    period: float | None = None,
) -> Model:
    """Identify dynamics and springs together.

    Link rows and motor rows are kept apart, with the springs among the unknowns (paper, eqs. 1, 2, 21 at once)::

        link   Phi_link psi - spring = 0
        motor  Phi_motor psi + spring = tau_motor

    Each kind of row is weighted by its own scatter between periods: link rows have no torque noise, so they weigh much
    more and tie the parameters to each other, while the motor rows give the scale. Products are taken between different
    periods only; otherwise noise in the link rows, whose right-hand side is zero, would shrink everything.
    Motor rows near reversal where friction varies from pass to pass count less or not at all, see `steady`.

    Args:
        robot: the robot, with at least one spring.
        recording: what was measured; at least two periods.
        effects: the model without springs; the usual one where None.
        period: [s]; found from the data where None.

    Returns:
        The model, its springs from the same estimation.

    Raises:
        IdentificationError: no spring, fewer than two periods, or link rows that the data do not determine.
    """
    processed = recording if isinstance(recording, ProcessedRecording) else process(recording, robot, period=period)
    if not robot.elastic_indices.size:
        raise IdentificationError(f"{robot.name} has no spring; identify its dynamics with identify")
    if processed.periods < 2:
        raise IdentificationError(
            f"{processed.source}: one estimation for dynamics and springs needs two periods or more; noise in the link "
            "rows would shrink all parameters"
        )
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        first = identify(robot, processed, effects=effects)
    observations = Observations(robot, first.effects, first.base, processed)
    if observations.spring_side is not SpringSide.LINK:
        raise IdentificationError(f"{robot.name}: the base parameters do not determine the link rows; use identify")
    system = _System(observations)
    start = np.concatenate([first.values, *([s.stiffness, s.cubic_stiffness, s.damping] for s in first.springs)])
    values, influences, inverse = system.solve(start)
    return _result(first, values, influences, inverse)


@dataclass(frozen=True, eq=False)
class _System:
    """Equations of all periods: link rows of elastic joints, then motor rows (sum rows at rigid joints)."""

    observations: Observations

    @property
    def _elastic(self) -> IntArray:
        return self.observations.robot.elastic_indices.astype(np.intp)

    def _equations(self, rows: Rows, motion: Motion, torque: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N, m + n, b + 3 m) rows and (N, m + n) right-hand sides."""
        elastic = self._elastic
        samples, n, count = rows.total.shape
        m = len(elastic)
        table = np.zeros((samples, m + n, count + 3 * m))
        side = np.zeros((samples, m + n))
        table[:, :m, :count] = rows.spring
        table[:, m:, :count] = rows.total
        table[:, m + elastic, :count] -= rows.spring
        side[:, m:] = torque
        for k, joint in enumerate(elastic):
            d = motion.deflection[:, joint]
            law = np.column_stack([d, d**3, motion.deflection_rate[:, joint]])
            place = slice(count + 3 * k, count + 3 * k + 3)
            table[:, k, place] = -law
            table[:, m + joint, place] = law
        return table, side

    def _each(self) -> Iterator[tuple[FloatArray, FloatArray]]:
        processed = self.observations.processed
        for rows, motion, torque in zip(
            self.observations.each_period(), processed.period_motions, processed.period_tau_motor, strict=True
        ):
            yield self._equations(rows, motion, torque)

    def _mean(self) -> tuple[FloatArray, FloatArray]:
        """Mean of the equations over the periods."""
        parts = self._each()
        table, side = next(parts)
        for more, torque in parts:
            table += more
            side += torque
        return table / self.observations.periods, side / self.observations.periods

    def solve(self, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(c,) values, (P, c) influences of the periods, and (c, c) inverse of the normal matrix."""
        periods, m, size = self.observations.periods, len(self._elastic), len(values)
        mean_table, mean_side = self._mean()
        scale = np.linalg.norm(mean_table.reshape(-1, size), axis=0)
        for _ in range(ROUNDS):
            whitening = _Whitening.of(self._residuals(values), m, self.observations)
            own, cross = np.zeros((size, size)), np.zeros(size)
            for table, side in self._each():
                flat = whitening.apply(table / scale).reshape(-1, size)
                own += flat.T @ flat / periods
                cross += flat.T @ whitening.apply(side[:, :, None]).ravel() / periods
            flat = whitening.apply(mean_table / scale).reshape(-1, size)
            right = flat.T @ whitening.apply(mean_side[:, :, None]).ravel()
            gram = (periods * flat.T @ flat - own) / (periods - 1.0)
            values = np.linalg.solve(gram, (periods * right - cross) / (periods - 1.0)) / scale
        inverse = np.linalg.inv(gram)
        residuals = self._residuals(values)
        centred = residuals - residuals.mean(axis=0)
        # whitening is symmetric: done twice to the mean rows, it need not be done to the residuals
        instruments = whitening.apply(whitening.apply(mean_table / scale))
        scores = period_scores(centred, instruments, self.observations.processed.places)
        influences = scores @ inverse.T / scale / periods
        return values, influences, inverse / np.outer(scale, scale)

    def _residuals(self, values: FloatArray) -> FloatArray:
        """(P, N, m + n) residuals of every period."""
        return np.stack([side - table @ values for table, side in self._each()])


@dataclass(frozen=True, eq=False)
class _Whitening:
    """Makes the noise of all rows of the mean white, with variance one.

    The noise of link rows comes from encoders: stationary, but growing with the square of frequency. It is whitened
    harmonic by harmonic. That of motor rows depends on the phase of the motion. It is whitened sample by sample.

    Attributes:
        gains: (N // 2 + 1, m) by harmonic, for link rows.
        roots: (N, n) by sample, for motor rows.
    """

    gains: FloatArray
    roots: FloatArray

    @staticmethod
    def of(residuals: FloatArray, links: int, observations: Observations) -> "_Whitening":
        periods, samples = residuals.shape[:2]
        mean = residuals.mean(axis=0)
        scatter = residuals - mean
        power = (np.abs(np.fft.rfft(scatter[:, :, :links], axis=1)) ** 2).sum(axis=0) / (periods * (periods - 1.0))
        power = _smooth(np.maximum(power, 0.0), 15)
        # what repeats in every period is no noise, but no information either
        total = _smooth(np.abs(np.fft.rfft(mean[:, :links], axis=0)) ** 2, 15)
        power = np.where(total > 2.0 * power, total, power)
        power = np.maximum(power, 1e-14 * power.max(axis=0, initial=1e-300))
        gains = np.sqrt(samples / power)
        # beyond the harmonics kept, linear terms were cut off while products still reach there
        gains[min(observations.processed.link_harmonics, observations.processed.motor_harmonics) + 1 :] = 0.0
        valid, own = observations.valid * steady(observations), scatter[:, :, links:]
        variance = smooth_over_phase((own**2).sum(axis=0), observations.processed.interval, SMOOTHING)
        variance = variance / (periods * (periods - 1.0))
        count = np.maximum(valid.sum(axis=0), 1.0)
        noise = (variance * valid).sum(axis=0) / count
        rest = (mean[:, links:] ** 2 * valid).sum(axis=0) / count - noise
        floor = 1e-14 * np.mean(observations.torque**2, axis=0) + 1e-300
        roots = np.sqrt(valid / (variance + np.where(rest > LEAST_REST * noise, rest, 0.0) + floor))
        return _Whitening(gains, roots)

    def apply(self, table: FloatArray) -> FloatArray:
        """(N, m + n, c) rows with white noise."""
        links = self.gains.shape[1]
        out = np.empty_like(table)
        out[:, :links] = np.fft.irfft(
            np.fft.rfft(table[:, :links], axis=0) * self.gains[:, :, None], len(table), axis=0
        )
        out[:, links:] = table[:, links:] * self.roots[:, :, None]
        return out


def _smooth(power: FloatArray, width: int) -> FloatArray:
    """(L, m) moving average over neighbouring harmonics."""
    width = min(width, len(power))
    padded = np.pad(power, ((width // 2, width - 1 - width // 2), (0, 0)), mode="edge")
    columns = [np.convolve(column, np.ones(width) / width, mode="valid") for column in padded.T]
    return np.stack(columns, axis=1)


def _result(first: Model, values: FloatArray, influences: FloatArray, inverse: FloatArray) -> Model:
    """The two-step model with the values of the one-shot estimation."""
    count, periods = first.base.rank, len(influences)
    covariance = influences.T @ influences * (periods / (periods - 1.0))
    remainder = first.uncertainty.kind is CovarianceKind.REMAINDER
    rest = first.uncertainty.covariance - first.uncertainty.repeatability
    own = covariance[:count, :count] + rest
    springs = []
    for k, spring in enumerate(first.springs):
        place = slice(count + 3 * k, count + 3 * k + 3)
        springs.append(_spring(spring, values[place], covariance[place, place], periods - 1.0))
    found = []
    if periods < FEW_PERIODS:
        found.append(f"{periods} periods only: the standard deviations themselves are known to a factor of two at best")
    uncertainty = Uncertainty(
        covariance=own,
        degrees_of_freedom=periods - 1.0,
        kind=CovarianceKind.REMAINDER if remainder else CovarianceKind.PERIODS,
        influences=influences[:, :count],
        repeatability=covariance[:count, :count],
    )
    return replace(
        first,
        values=values[:count],
        model_covariance=inverse[:count, :count],
        uncertainty=uncertainty,
        estimator="one_shot",
        springs=tuple(springs),
        warnings=(*first.warnings, *found),
    )


def _spring(spring: SpringResult, law: FloatArray, covariance: FloatArray, freedom: float) -> SpringResult:
    if spring.misfit:
        covariance = covariance + np.array(spring.misfit)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return replace(
        spring,
        stiffness=float(law[0]),
        stiffness_std=float(std[0]),
        cubic_stiffness=float(law[1]),
        cubic_stiffness_std=float(std[1]),
        damping=float(law[2]),
        damping_std=float(std[2]),
        covariance=tuple(tuple(float(v) for v in row) for row in covariance),
        degrees_of_freedom=freedom,
    )
