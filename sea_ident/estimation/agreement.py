"""How well a model agrees with data, beside the noise of the comparison itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray

WITHIN = 1.2
"""A residual up to this many times its noise is within the noise."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """The mean residual away from reversals of velocity, and its noise.

    At rest friction is anything up to breakaway, and around a reversal it differs from pass to pass: there no model of
    friction as a function of velocity can be right, and no sample counts. What rings beside these is taken out.

    Attributes:
        rms: (n,) rms of the residual of the mean torque away from reversals [N m] or [N].
        noise: (n,) standard deviation of its noise there, from the residuals of the periods, each with its own motion:
            noise of the torque and of the encoders [N m] or [N].
        share: (n,) share of the samples that are away from reversals [-].
    """

    rms: FloatArray
    noise: FloatArray
    share: FloatArray

    @property
    def within_noise(self) -> NDArray[np.bool_]:
        """(n,) whether the residual is no more than its noise."""
        return np.asarray(self.rms <= WITHIN * self.noise, dtype=np.bool_)

    @property
    def gap(self) -> FloatArray:
        """(n,) rms of what is left beyond the noise [N m] or [N]."""
        return np.sqrt(np.maximum(self.rms**2 - self.noise**2, 0.0))

    def around_reversals(self, rms: FloatArray) -> FloatArray:
        """(n,) rms of the residual around reversals, from that of all samples (n,) [N m] or [N]; 0 without any."""
        rest = np.maximum(1.0 - self.share, 0.0)
        power = np.maximum(rms**2 - self.share * self.rms**2, 0.0)
        return np.sqrt(np.divide(power, rest, out=np.zeros_like(power), where=rest > 0.0))

    def words(self) -> tuple[str, ...]:
        """(n,) what to add to a line about a joint."""
        return tuple(
            f"; away from reversals {rms:.4g}, noise of it {noise:.4g}"
            for rms, noise in zip(self.rms, self.noise, strict=True)
        )

    def to_dict(self, joints: Sequence[str]) -> dict[str, dict[str, float]]:
        """Numbers by joint."""
        return {
            key: {joint: float(v) for joint, v in zip(joints, getattr(self, key), strict=True)}
            for key in ("rms", "noise", "share")
        }

    @staticmethod
    def from_dict(record: Mapping[str, Any] | None, joints: Sequence[str]) -> "Agreement | None":
        """What `to_dict` made; None where there was none."""
        if record is None:
            return None
        return Agreement(
            *(np.array([float(record[key][joint]) for joint in joints]) for key in ("rms", "noise", "share"))
        )


def agreement(mean: FloatArray, periods: FloatArray, counted: NDArray[np.bool_]) -> Agreement | None:
    """Compare the mean residual with what the periods say of its noise.

    Args:
        mean: (N, n) residual of the mean torque [N m] or [N].
        periods: (P, N, n) residual of every period, each with its own motion [N m] or [N].
        counted: (N, n) which samples are away from reversals; a joint that never is counts as a whole.

    Returns:
        The agreement; None with fewer than two periods, which say nothing of noise.
    """
    count = len(periods)
    if count < 2:
        return None
    counted = counted | ~np.any(counted, axis=0)
    noise = periods.var(axis=0, ddof=1) / count
    number = np.count_nonzero(counted, axis=0)
    return Agreement(
        rms=np.sqrt((mean**2 * counted).sum(axis=0) / number),
        noise=np.sqrt((noise * counted).sum(axis=0) / number),
        share=number / len(mean),
    )
