"""Instrumental variables: no bias from noise in the regressor, nor from a controller that feeds it back."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.estimation.estimators.base import Estimate, Estimator
from sea_ident.estimation.estimators.weights import SampleWeights, sample_weights, steady
from sea_ident.estimation.observations import Observations
from sea_ident.exceptions import IdentificationError
from sea_ident.motion import Motion
from sea_ident.processing.harmonics import within
from sea_ident.processing.process import SMOOTHING

Simulator = Callable[[Observations, FloatArray], Motion]
"""From observations and base parameters (b,) to the motion, without noise, at the samples of the mean period."""


LEAST_TOLD = 1e-13
"""Smallest singular value of the products of normalised columns that double precision tells from nothing."""


@dataclass(frozen=True)
class InstrumentalVariables(Estimator):
    """Solve ``Z' (torque - F psi) = 0`` with instruments Z that have the signal of F but not its noise.

    With a simulator, Z is the regressor of the simulated motion, with the parameters of the round before (IDIM-IV).
    Without one, the instruments of every period are the regressors of all the others: their noise is another one.
    Samples near reversal where friction varies from pass to pass count less or not at all, see `steady`.

    Of periodic data only the harmonics that theta has count, in the torque as in the regressor. At every reversal
    friction makes the motor jerk, and what its acceleration lacks beyond these harmonics is the same in every period:
    no average takes it away, no spread between periods shows it, and it has the shape of friction. Within them the
    acceleration lacks nothing.

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
        band = observations.processed.motor_harmonics
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
            instruments = within(within(observations.rows_of(motion).total, band) * weights[:, :, None], band)
            cross = _invertible(instruments.reshape(-1, count).T @ flat)
            before, values = values, np.linalg.solve(cross, np.einsum("knb,kn->b", instruments, torque))
            moved = float(np.max(np.abs(values - before) / np.maximum(np.abs(values), 1e-12)))
            if moved < 1e-4:
                break
        note = f"instruments simulated; the parameters moved by {moved:.1g} (relative) in the last round"
        return _estimate(first, values, instruments, cross, band, note)


def _other_periods(observations: Observations, first: SampleWeights) -> Estimate:
    processed, weights = observations.processed, first.weights
    periods, band = processed.periods, processed.motor_harmonics
    if periods < 2:
        raise IdentificationError(
            f"{processed.source}: instruments from other periods need at least two periods; give a simulator"
        )
    count = observations.base.rank
    whole = np.zeros_like(observations.rows)
    for rows in observations.each_period():
        whole += rows.total
    whole = within(whole, band)
    cross, side = np.zeros((count, count)), np.zeros(count)
    for p, rows in enumerate(observations.each_period()):
        own = within(rows.total, band)
        instruments = (whole - own) / (periods - 1.0) * weights[:, :, None]
        cross += instruments.reshape(-1, count).T @ own.reshape(-1, count)
        side += np.einsum("knb,kn->b", instruments, within(processed.period_tau_motor[p], band))
    cross = _invertible(cross)
    values: FloatArray = np.asarray(np.linalg.solve(cross, side), dtype=np.float64)
    mean_instruments = within(whole / periods * weights[:, :, None], band)
    note = "the instruments of every period are the regressors of the other periods"
    return _estimate(first, values, mean_instruments, cross / periods, band, note)


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
    first: SampleWeights, values: FloatArray, instruments: FloatArray, cross: FloatArray, band: int, note: str
) -> Estimate:
    """Values with their covariance by eq. 13, from instruments (N, n, b) and their products with the rows (b, b)."""
    inverse: FloatArray = np.asarray(np.linalg.inv(cross), dtype=np.float64)
    meat = np.einsum("knb,kn,knc->bc", instruments, first.variance, instruments)
    return Estimate(
        values=values,
        instruments=instruments,
        inverse=inverse,
        weights=first.weights,
        covariance=inverse @ meat @ inverse.T,
        log_det_weighted=first.solution.log_det,
        harmonics=band,
        notes=(*first.notes, note),
        warnings=first.warnings,
    )
