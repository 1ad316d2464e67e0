"""What a model leaves of another motion, and whether it could have told it: some parameters show only there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.contribution import torque_factor
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.gap import Gap, per_joint, torque_by_joint
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.compared.heldout import HeldOut, Kind
from sea_ident.discrepancy.evidence.uncertainty import uncertainties

FAR_BEYOND = 3.0
"""Times the noise from which on a gap on other data counts, ..."""

BEYOND_THE_MOTION = 0.05
"""... with this share of the torque there [-]: a model that is well identified leaves one percent of another motion at
most."""

AS_UNSURE = 2.0
"""Standard deviations of the torque that is foretold within which what is left says nothing of what is missing [-]."""


@dataclass(frozen=True)
class Left:
    """What a model leaves of the torque of a joint in another recording.

    Attributes:
        size: rms beyond the noise [N m] or [N].
        share: of the torque there [-].
        std: rms standard deviation of the torque that the model foretells there, by its own parameters [N m] or [N].
        least_known: the effect that most of that comes from.
    """

    size: float
    share: float
    std: float
    least_known: str

    @property
    def as_unsure(self) -> bool:
        """Whether it is no more than the parameters are unsure by: then the recording does not tell these."""
        return self.size <= AS_UNSURE * self.std


def left_of(bench: Bench, now: Settled, held: HeldOut, gap: Gap) -> dict[str, Left]:
    """What a model leaves of the torque of another recording, by joint, where that is far beyond noise.

    Args:
        bench: the recording that it was found on.
        now: the model.
        held: the other recording.
        gap: there.
    """
    if held.kind is Kind.OTHER_PERIODS:
        return {}
    torque = torque_by_joint(held.bench)
    shares = {joint: size / max(torque[joint], 1e-300) for joint, size in gap.after.items()}
    far = [joint for joint, size in gap.after.items() if size > FAR_BEYOND * gap.noise[joint]]
    far = [joint for joint in far if shares[joint] > BEYOND_THE_MOTION]
    if not far:
        return {}
    fit, wider = now.fit, _wider(bench, now)
    whole = foretold_std(held.bench, fit, range(len(fit.effects)), wider)
    each = [foretold_std(held.bench, fit, [position], wider) for position in range(len(fit.effects))]
    found = {}
    for joint in far:
        most = int(np.argmax([stds[joint] for stds in each]))
        found[joint] = Left(gap.after[joint], shares[joint], whole[joint], fit.effects[most].title)
    return found


def foretold_std(bench: Bench, fit: Fit, positions: Sequence[int], wider: FloatArray | None = None) -> dict[str, float]:
    """Rms standard deviation of the torque of some effects of a fit on another motion, by joint [N m] or [N].

    By the covariance of their parameters and shapes, to first order in these; `wider` as in `torque_factor`.
    """
    factor = torque_factor(bench, fit, positions, wider)
    return per_joint(bench, np.sum(np.abs(factor) ** 2, axis=(0, 2)))


def _wider(bench: Bench, now: Settled) -> FloatArray:
    """(p + s,) by how much more than noise alone would have it the parameters and shapes of a model are unsure [-]."""
    told, plain = uncertainties(bench, now), np.linalg.norm(now.fit.covariance_factor, axis=1) * now.fit.unit**0.5
    known = np.isfinite(told) & (plain > 0.0)
    return np.asarray(np.divide(told, plain, out=np.ones_like(plain), where=known), dtype=np.float64)
