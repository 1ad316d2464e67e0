"""Half-spaces and self-collision as the barrier method sees them."""

from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.excitation.space_limits import SpaceLimits
from sea_ident.excitation.space_proof import TOLERANCE
from sea_ident.excitation.walls import DynamicTangent, parabolic_overshoot
from sea_ident.motion import fourier_basis


@dataclass(frozen=True, eq=False)
class SpaceWall:
    """Limits in space on an equidistant grid: 1 - room / reach stays below what the proof leaves of 1.

    Attributes:
        limits: the limits.
        basis: (M, 2 L + 1) of position.
    """

    limits: SpaceLimits
    basis: FloatArray

    @staticmethod
    def of(limits: SpaceLimits, base_frequency: float, harmonics: int, points: int) -> "SpaceWall":
        """On `points` times of a period."""
        time = np.arange(points) / (points * base_frequency)
        return SpaceWall(limits, fourier_basis(time, base_frequency, harmonics, 0))

    @property
    def lower(self) -> FloatArray:
        """(r, 1)."""
        return np.full((len(self.limits), 1), -np.inf)

    @property
    def upper(self) -> FloatArray:
        """(r, 1)."""
        spent = TOLERANCE * self.limits.size / self.limits.reach
        return np.full((len(self.limits), 1), 1.0 - spent)

    def _positions(self, coefficients: FloatArray) -> FloatArray:
        """(M, n); (1, n) at rest, where all times are the same."""
        basis = self.basis if np.any(coefficients[:, :-1]) else self.basis[:1]
        positions: FloatArray = basis @ coefficients.T
        return positions

    def values(self, coefficients: FloatArray) -> FloatArray:
        """(r, M)."""
        rooms = self.limits.rooms(self._positions(coefficients))
        values: FloatArray = 1.0 - rooms.T / self.limits.reach
        return np.broadcast_to(values, (len(self.limits), len(self.basis)))

    def tangent(self, coefficients: FloatArray) -> DynamicTangent:
        """Slopes of all rooms by all coefficients."""
        slopes = self.limits.slopes(self._positions(coefficients)) / -self.limits.reach
        samples, r = len(self.basis), len(self.limits)
        slopes = np.broadcast_to(slopes, (samples, *slopes.shape[1:]))
        rows = np.einsum("mrn,mw->rmnw", slopes, self.basis, optimize=True)
        return DynamicTangent(np.ascontiguousarray(rows.reshape(r, samples, -1)))

    def overshoot(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """By parabolas through neighbouring points."""
        return parabolic_overshoot(values)
