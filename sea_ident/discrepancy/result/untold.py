"""What the sum of both equations of a joint does not tell, and the fit of a diagnosis to each of them does.

Where Coulomb friction is modelled, that of a motor and that of its link are the same column in the sum as soon as the
sign turns sharply: with their torques only the sum of both is seen.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray, IntArray
from sea_ident.base_parameters import BaseParameters
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.estimation import Model
from sea_ident.estimation.estimators import Estimate, Estimator
from sea_ident.estimation.estimators.weights import steady
from sea_ident.estimation.observations import Observations
from sea_ident.exceptions import IdentificationError

UNTOLD = 1e-7
"""Singular values of the column-normalised regressor below this share of the largest tell nothing."""

TAKES_PART = 0.3
"""Share of the largest component of a combination that tells nothing from which on a parameter may be held for it."""

UNKNOWN = 1e3
"""Standard deviations in the fit that are as good as no knowledge: what the sum knows of a parameter that was held."""

LEAST_TOLD = 0.5
"""Standard deviation in the fit times the information along a combination below which the fit does not tell it either
[-]; at least one where it does."""


@dataclass(frozen=True, eq=False)
class Untold:
    """Base parameters that can be anything in the sum of both equations, if others follow.

    Attributes:
        held: (h,) their indices; none where the sum tells all.
        follows: (b, h) by how much every base parameter changes with each of them while the sum stays as it is.
    """

    held: IntArray
    follows: FloatArray


def untold(observations: Observations, certain: FloatArray) -> Untold:
    """Find what the samples that count in an estimate leave open.

    Args:
        observations: the equations.
        certain: (b,) standard deviations of the base parameters elsewhere: of what only acts together, the parameter
            that is best known there is held.

    Returns:
        As few parameters as it takes for the others to be told.
    """
    count = observations.base.rank
    counted = np.sqrt(observations.valid * steady(observations))
    triangle = scipy.linalg.qr((observations.rows * counted[:, :, None]).reshape(-1, count), mode="r")[0][:count]
    norms = np.linalg.norm(triangle, axis=0)
    scaled = triangle / np.where(norms > 0.0, norms, 1.0)
    held: list[int] = []
    while len(held) < count:
        kept = np.setdiff1d(np.arange(count), held)
        _, strength, combinations = np.linalg.svd(scaled[:, kept])
        if strength[-1] > UNTOLD * strength[0]:
            break
        part = np.abs(combinations[-1])
        open_to = kept[part > TAKES_PART * part.max()]
        held.append(int(open_to[np.argmin(certain[open_to] * norms[open_to])]))
    held.sort()
    follows = np.zeros((count, len(held)))
    follows[held, np.arange(len(held))] = 1.0
    if held:
        size = np.where(norms > 0.0, norms, 1.0)
        relation = np.linalg.lstsq(scaled[:, kept], scaled[:, held], rcond=None)[0]
        follows[kept] = -relation * size[held] / size[kept][:, None]
    return Untold(np.array(held, dtype=np.intp), follows)


def in_base(fit: Fit, base: BaseParameters) -> tuple[FloatArray, FloatArray] | None:
    """Base parameters by a fit: (b,) values, and (b, r) factor of their covariance; None where it has others."""
    columns, names = [column.name for column in fit.columns], [column.name for column in base.columns]
    if not set(names) <= set(columns):
        return None
    rows = [columns.index(name) for name in names]
    return base.grouping @ fit.values[rows], base.grouping @ fit.covariance_factor[rows]


@dataclass(frozen=True, eq=False)
class BesideFit(Estimator):
    """An estimator of what the torques of the motors tell; the rest is held at what a fit to both equations tells.

    What is held has no variance here: `widened` gives it.

    Attributes:
        like: the estimator.
        fit: to link and motor equations of the same recording, with the same parameters.
    """

    like: Estimator
    fit: Fit

    name: ClassVar[str] = "beside_fit"

    def estimate(self, observations: Observations) -> Estimate:
        """Estimate; see `Estimator.estimate`."""
        known = in_base(self.fit, observations.base)
        if known is None:
            return self.like.estimate(observations)
        values, factor = known
        found = untold(observations, np.linalg.norm(factor, axis=1))
        if not found.held.size:
            return self.like.estimate(observations)
        _told_by(self.fit, observations.base, found, factor)
        estimate = self.like.estimate(_less(observations, found.held, values))
        count = observations.base.rank
        kept = np.setdiff1d(np.arange(count), found.held)
        whole, instruments = values.copy(), np.zeros(observations.rows.shape)
        inverse, covariance = np.zeros((count, count)), np.zeros((count, count))
        whole[kept], instruments[:, :, kept] = estimate.values, estimate.instruments
        inverse[np.ix_(kept, kept)], covariance[np.ix_(kept, kept)] = estimate.inverse, estimate.covariance
        names = ", ".join(observations.base.names[k] for k in found.held)
        note = f"{names}: from the equations of link and motor apart; their sum tells it together with others only"
        return replace(
            estimate,
            values=whole,
            instruments=instruments,
            inverse=inverse,
            covariance=covariance,
            notes=(*estimate.notes, note),
        )


def widened(model: Model, observations: Observations, fit: Fit) -> Model:
    """A model by `BesideFit` that says of what was held that its own equations do not tell it.

    Args:
        model: the model.
        observations: the equations that it was identified from.
        fit: that what was held came from.

    Returns:
        The model; as it is where nothing was held.
    """
    known = in_base(fit, observations.base)
    if known is None:
        return model
    _, factor = known
    found = untold(observations, np.linalg.norm(factor, axis=1))
    if not found.held.size:
        return model
    moves = UNKNOWN * found.follows @ factor[found.held]
    more = moves @ moves.T
    own = model.uncertainty
    return replace(
        model,
        model_covariance=model.model_covariance + more,
        uncertainty=replace(own, covariance=own.covariance + more, repeatability=own.repeatability + more),
    )


def _told_by(fit: Fit, base: BaseParameters, found: Untold, factor: FloatArray) -> None:
    """Check that a fit tells what is held.

    Raises:
        IdentificationError: it does not tell all of it from the others.
    """
    columns = [column.name for column in fit.columns]
    rows = [columns.index(base.columns[k].name) for k in base.independent]
    moves = np.zeros((fit.flat.shape[1], found.held.size))
    moves[rows] = found.follows
    told = np.linalg.norm(fit.flat @ moves, axis=0) * np.linalg.norm(factor[found.held], axis=1)
    # what a fit does not tell is as near to the priors as it lets, with a standard deviation that does not say so
    if np.any(told < LEAST_TOLD):
        names = ", ".join(base.names[k] for k in found.held[told < LEAST_TOLD])
        raise IdentificationError(f"neither the motor torques nor the link equations tell {names} from the others")


def _less(observations: Observations, held: IntArray, values: FloatArray) -> Observations:
    """Observations without some base parameters, with the torques less what these explain by values (b,)."""
    base, processed = observations.base, observations.processed
    each = zip(processed.period_tau_motor, observations.each_period(), strict=True)
    return replace(
        observations,
        base=replace(
            base, independent=np.delete(base.independent, held), grouping=np.delete(base.grouping, held, axis=0)
        ),
        processed=replace(
            processed,
            tau_motor=processed.tau_motor - observations.rows[:, :, held] @ values[held],
            period_tau_motor=np.stack([torque - rows.total[:, :, held] @ values[held] for torque, rows in each]),
        ),
    )
