"""Instrumental variables: no bias from noise in the regressor, nor from a controller that feeds it back."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.estimation.estimators.band import Band
from sea_ident.estimation.estimators.base import Estimate, Estimator
from sea_ident.estimation.estimators.weights import SampleWeights, sample_weights, steady
from sea_ident.estimation.observations import Observations
from sea_ident.exceptions import IdentificationError
from sea_ident.motion import Motion
from sea_ident.processing.harmonics import FEWEST_PERIODS, within
from sea_ident.processing.process import SMOOTHING

Simulator = Callable[[Observations, FloatArray], Motion]
"""From observations and base parameters (b,) to the motion, without noise, at the samples of the mean period."""


LACKING = 2.0
"""Energy of the mean residual beyond the harmonics of theta over that of its noise: above, acceleration is lacking."""

LOSS = 1.1
"""Standard deviation by eq. 13 within the harmonics of theta over that of all, up to which only those count."""

LOSS_BESIDE = 1.5
"""The same where the samples around reversals are left out, too, and with them what they leave in every period."""

GAIN = 0.5
"""The same ratio from which on: below, columns are told apart by rounding and noise only."""

MOST_LEFT_OUT = 0.3
"""Share of the samples of a joint around reversals up to which the equations are solved without."""

LEAST_TOLD = 1e-13
"""Smallest singular value of the products of normalised columns that double precision tells from nothing."""


@dataclass(frozen=True)
class InstrumentalVariables(Estimator):
    """Solve ``Z' (torque - F psi) = 0`` with instruments Z that have the signal of F but not its noise.

    With a simulator, Z is the regressor of the simulated motion, with the parameters of the round before (IDIM-IV).
    Without one, the instruments of every period are the regressors of all the others: their noise is another one.
    Samples near reversal where friction varies from pass to pass count less or not at all, see `steady`.

    At every reversal friction makes the motor jerk. What its acceleration lacks beyond the harmonics that theta was
    fitted by is the same in every period: no average takes it away, no spread between periods shows it, and it has the
    shape of friction. So only the harmonics of theta count, or those of q where these are fewer, in the torque as in
    the regressor. Within them the acceleration lacks nothing but what the samples beside a reversal make of a jump that
    falls between them, and friction follows a speed that does not bend as sharply as that of the motor. Both are there
    and then, so that instruments that vanish around reversals do not see them, see `Band`. Where the residual beyond
    the harmonics is noise, or a standard deviation would grow by half (by a tenth where reversals stay), all count.

    Attributes:
        simulator: gives the motion that the closed loop makes with given parameters.
        smoothing: width of the window over which the torque variance is averaged [s].
        rounds: rounds of simulation at most.

    References:
        Janot, Vandanjon, Gautier, A generic instrumental variable approach for industrial robot identification, IEEE
        Transactions on Control Systems Technology, 2014.
    """

    simulator: Simulator | None = None
    smoothing: float = SMOOTHING
    rounds: int = 5

    name: ClassVar[str] = "instrumental_variables"

    def estimate(self, observations: Observations) -> Estimate:
        """Estimate; see `Estimator.estimate`."""
        first = sample_weights(observations, self.smoothing, steady(observations))
        if self.simulator is None:
            return _other_periods(observations, first)
        return self._simulated(observations, first, self.simulator)

    def _simulated(self, observations: Observations, first: SampleWeights, simulator: Simulator) -> Estimate:
        rows, torque, weights, values = observations.rows, observations.torque, first.weights, first.solution.values
        band = _band(observations, first)
        count = rows.shape[-1]
        flat = rows.reshape(-1, count)
        moved = np.inf
        for _ in range(self.rounds):
            motion = simulator(observations, values)
            if len(motion) != len(rows):
                raise IdentificationError(
                    f"the simulated motion has {len(motion)} samples, the mean period has {len(rows)}; give it at the "
                    "times of the mean motion"
                )
            instruments = _part(_part(observations.rows_of(motion).total, band) * weights[:, :, None], band)
            cross = _invertible(instruments.reshape(-1, count).T @ flat)
            before, values = values, np.linalg.solve(cross, np.einsum("knb,kn->b", instruments, torque))
            moved = float(np.max(np.abs(values - before) / np.maximum(np.abs(values), 1e-12)))
            if moved < 1e-4:
                break
        note = f"instruments simulated; the parameters moved by {moved:.1g} (relative) in the last round"
        return _estimate(first, values, instruments, cross, band, note)


def _other_periods(observations: Observations, first: SampleWeights) -> Estimate:
    processed, weights = observations.processed, first.weights
    periods, band = processed.periods, _band(observations, first)
    if periods < 2:
        raise IdentificationError(
            f"{processed.source}: instruments from other periods need at least two periods; give a simulator"
        )
    count = observations.base.rank
    whole = np.zeros_like(observations.rows)
    for rows in observations.each_period():
        whole += rows.total
    whole = _part(whole, band)
    cross, side = np.zeros((count, count)), np.zeros(count)
    for p, rows in enumerate(observations.each_period()):
        own = _part(rows.total, band)
        instruments = (whole - own) / (periods - 1.0) * weights[:, :, None]
        cross += instruments.reshape(-1, count).T @ own.reshape(-1, count)
        side += np.einsum("knb,kn->b", instruments, _part(processed.period_tau_motor[p], band))
    cross = _invertible(cross)
    values: FloatArray = np.asarray(np.linalg.solve(cross, side), dtype=np.float64)
    mean_instruments = _part(whole / periods * weights[:, :, None], band)
    note = "the instruments of every period are the regressors of the other periods"
    return _estimate(first, values, mean_instruments, cross / periods, band, note)


def _part(values: FloatArray, band: Band | None) -> FloatArray:
    return values if band is None else band.part_of(values)


def _band(observations: Observations, first: SampleWeights) -> Band | None:
    """What counts of the equations; None where all does: nothing is lacking beyond theta, or much is told there.

    A motor that jerks has so many harmonics that little is lost. One that does not may have a few only; then most of
    what tells friction lies beyond them, and its acceleration lacks nothing. Links mostly have fewer harmonics than
    motors: between, the equations lack the acceleration of the links, so without that is tried first.
    """
    processed, motors = observations.processed, observations.processed.motor_harmonics
    samples, nowhere = processed.samples, np.zeros(observations.torque.shape, dtype=np.bool_)
    if processed.periods < FEWEST_PERIODS or not 0 < motors < samples // 2:
        return None
    values = first.solution.values
    mean, residuals = observations.residual(values), observations.period_residuals(values)
    residuals = residuals - residuals.mean(axis=0)
    noise = sum(_energy(residual, motors) for residual in residuals) / (processed.periods * (processed.periods - 1.0))
    if not np.any(_energy(mean, motors) > LACKING * noise):
        return None
    # a joint that never moves has nothing beside its rest
    around = ~observations.judged & np.any(observations.judged, axis=0)
    fewest = min(motors, processed.link_harmonics or motors)
    for band in (Band(samples, fewest, around), Band(samples, motors, around), Band(samples, motors, nowhere)):
        if _tells(observations, first, band):
            return band
    return None


def _tells(observations: Observations, first: SampleWeights, band: Band) -> bool:
    """Whether the standard deviations by eq. 13 from this part of the equations are about those from all of them."""
    if band.left_out.mean(axis=0).max() > MOST_LEFT_OUT:
        return False
    rows, count = observations.rows, observations.base.rank
    instruments = band.part_of(band.part_of(rows) * first.weights[:, :, None])
    inverse = np.linalg.inv(_invertible(instruments.reshape(-1, count).T @ rows.reshape(-1, count)))
    moves = instruments @ inverse.T
    variance = np.einsum("knb,kn,knb->b", moves, first.variance, moves)
    ratio = variance / np.diag(first.solution.inverse)
    most = LOSS_BESIDE if np.any(band.left_out) else LOSS
    return bool(np.all((ratio <= most**2) & (ratio >= GAIN**2)))


def _energy(residual: FloatArray, harmonics: int) -> FloatArray:
    """(n,) sum of squares of a residual (N, n) beyond these harmonics."""
    return np.asarray(np.sum((residual - within(residual, harmonics)) ** 2, axis=0), dtype=np.float64)


def _invertible(cross: FloatArray) -> FloatArray:
    """Products (b, b) that have an inverse: what two columns hardly tell apart gets a standard deviation that says so.

    Columns that differ just enough to be told apart have products that in double precision do not.
    """
    scale = np.sqrt(np.abs(np.diag(cross)))
    scale = np.where(scale > 0.0, scale, 1.0)
    plain = cross / np.outer(scale, scale)
    least = float(np.linalg.svd(plain, compute_uv=False)[-1])
    if least > LEAST_TOLD:
        return cross
    return np.asarray((plain + LEAST_TOLD * np.eye(len(plain))) * np.outer(scale, scale), dtype=np.float64)


def _estimate(
    first: SampleWeights, values: FloatArray, instruments: FloatArray, cross: FloatArray, band: Band | None, note: str
) -> Estimate:
    """Values with their covariance by eq. 13, from instruments (N, n, b) and their products with the rows (b, b)."""
    inverse: FloatArray = np.asarray(np.linalg.inv(cross), dtype=np.float64)
    # by its root: where two columns are hardly told apart, the products would leave no more than rounding
    moves = (instruments * np.sqrt(first.variance)[:, :, None]).reshape(-1, len(values)) @ inverse.T
    return Estimate(
        values=values,
        instruments=instruments,
        inverse=inverse,
        weights=first.weights,
        covariance=moves.T @ moves,
        log_det_weighted=first.solution.log_det,
        band=band,
        notes=(*first.notes, note),
        warnings=first.warnings,
    )
