"""What steps of the encoders that repeat in every period do to an estimate."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import JointEffect
from sea_ident.estimation.estimators import Estimator
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.spring_result import SpringResult, SpringTerm
from sea_ident.estimation.springs import springs_from
from sea_ident.estimation.uncertainty import Uncertainty
from sea_ident.processing import ProcessedRecording
from sea_ident.processing.harmonics import FEWEST_PERIODS

DRAWS = 8
"""Other places of the steps for which everything is estimated again."""

SEED = 1

FEW = FEWEST_PERIODS
"""Periods in which that is done: the same error is in all of them."""


@dataclass(frozen=True, eq=False)
class RepeatedSteps:
    """The same estimation with errors of the encoders as their steps make them, drawn anew and added.

    An error that is added once more changes the estimate about as much as the error that is in the data already did:
    both the scatter of the changes and their mean, as the errors act by their squares.

    Attributes:
        again: (K,) some periods of the data with the errors added.
        moves: (K, b) by how much the base parameters change.
        text: what a user should know.
    """

    again: tuple[Observations, ...]
    moves: FloatArray
    text: str

    def widened(self, uncertainty: Uncertainty) -> Uncertainty:
        """The uncertainty of the base parameters with these changes in it; they are not seen in a repetition."""
        more = self.moves.T @ self.moves / len(self.moves)
        return replace(uncertainty, covariance=uncertainty.covariance + more)

    def widened_springs(
        self,
        springs: tuple[SpringResult, ...],
        values: FloatArray,
        uncertainty: Uncertainty,
        unknown_zero: Sequence[str],
        effects: Sequence[JointEffect],
    ) -> tuple[SpringResult, ...]:
        """The springs with the changes of their laws in their covariances.

        Args:
            springs: m, found with the uncertainty of the base parameters before it was widened.
            values: (b,) base parameters by which they were found.
            uncertainty: of these, not widened.
            unknown_zero: joints with unknown zeros.
            effects: what else is in the springs.
        """
        if not springs:
            return springs
        runs = [
            springs_from(observations, values + move, uncertainty, unknown_zero, effects)
            for observations, move in zip(self.again, self.moves, strict=True)
        ]
        return tuple(
            _widened(spring, np.array([_law(run[k]) for run in runs]) - _law(spring))
            for k, spring in enumerate(springs)
        )


def repeated_steps(observations: Observations, how: Estimator) -> RepeatedSteps | None:
    """Estimate again with other errors of the encoders.

    Args:
        observations: the data.
        how: the estimator.

    Returns:
        What changes; None where all steps average out.

    References:
        Cook, Stefanski, Simulation-extrapolation estimation in parametric measurement error models, Journal of the
        American Statistical Association, 1994.
    """
    steps, period = observations.processed.encoder_steps, observations.processed.period
    if steps is None or period is None:
        return None
    rng = np.random.default_rng(SEED)
    few = _few_periods(observations.processed)
    again = tuple(replace(observations, processed=_with_error(few, period, rng)) for _ in range(DRAWS))
    without = how.estimate(replace(observations, processed=few)).values
    moves = np.stack([how.estimate(each).values - without for each in again])
    text = (
        f"{observations.processed.source}: encoder steps do not average out, as they repeat in every period: "
        f"{steps.words(observations.robot.joint_names)}. Standard deviations count what such errors change. Finer "
        "encoders, or motion that differs a little from period to period, make them smaller"
    )
    return RepeatedSteps(again, moves, text)


def _few_periods(processed: ProcessedRecording) -> ProcessedRecording:
    """The recording with its mean as it is, and beside it some periods alone, spread over it."""
    if processed.periods <= FEW:
        return processed
    kept = np.linspace(0, processed.periods - 1, FEW).astype(int)
    return replace(
        processed,
        periods=FEW,
        period_motions=tuple(processed.period_motions[p] for p in kept),
        period_tau_motor=processed.period_tau_motor[kept],
        places=tuple(processed.places[p] for p in kept),
    )


def _with_error(processed: ProcessedRecording, period: float, rng: np.random.Generator) -> ProcessedRecording:
    """The recording with one more error of the encoders, the same in every period."""
    steps = processed.encoder_steps
    if steps is None:
        return processed
    errors = steps.another(processed.motion, period, (processed.link_harmonics, processed.motor_harmonics), rng)
    return replace(
        processed,
        motion=processed.motion.plus(errors),
        period_motions=tuple(motion.plus(errors) for motion in processed.period_motions),
    )


def _law(spring: SpringResult) -> FloatArray:
    """(3 + k,) K1, K3, D and the values of all terms."""
    more = [value for term in spring.terms for value in term.values]
    return np.array([spring.stiffness, spring.cubic_stiffness, spring.damping, *more])


def _widened(spring: SpringResult, moves: FloatArray) -> SpringResult:
    """The spring with changes (K, 3 + k) of its law in its covariance."""
    known = np.array(spring.full_covariance if spring.full_covariance else spring.covariance)
    full = known + moves.T @ moves / len(moves)
    std = np.sqrt(np.maximum(np.diag(full), 0.0))
    terms: list[SpringTerm] = []
    start = 3
    for term in spring.terms:
        stop = start + len(term.values)
        terms.append(replace(term, stds=tuple(map(float, std[start:stop]))))
        start = stop
    table = tuple(tuple(float(v) for v in row) for row in full)
    return replace(
        spring,
        stiffness_std=float(std[0]),
        cubic_stiffness_std=float(std[1]),
        damping_std=float(std[2]),
        covariance=tuple(row[:3] for row in table[:3]),
        terms=tuple(terms),
        full_covariance=table if spring.full_covariance else (),
    )
