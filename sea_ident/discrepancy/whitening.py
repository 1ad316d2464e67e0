"""Torques in units of the noise, without the samples that are left out; what was computed once is kept.

The residual of a link equation is scaled by the stiffness of its spring, which every step of a fit changes. So the
columns are kept in parts, one for all equations that are never scaled and one for each link, and a step costs a sum.
"""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.columns import Columns
from sea_ident.discrepancy.data import EquationKind
from sea_ident.discrepancy.free_shapes import signal_effects
from sea_ident.discrepancy.linear import off, solve, whiten
from sea_ident.discrepancy.noise import ComplexArray
from sea_ident.effects import Effect

PARTS_KEPT = 2e8
"""Bytes of columns that are kept."""


class Whitening:
    """One noise floor applied to columns and residuals.

    Args:
        columns: of the recording.
        whitener: (H + 1, E, E).
        free: (H + 1, E, m) spectra of the samples that are left out.

    Attributes:
        whitener: (H + 1, E, E).
        free: (M, m) orthonormal basis of the samples that are left out, whitened.
        parts: (E,) part that each equation belongs to; the first is that of the equations without a spring.
        target: (G, M) measured torques in parts, once they were asked for.
    """

    def __init__(self, columns: Columns, whitener: ComplexArray, free: ComplexArray) -> None:
        self.whitener = whitener
        flat = whiten(whitener, free)
        self.free = solve(flat, np.zeros(len(flat)))[1]
        self.target: FloatArray | None = None
        self._columns = columns
        links = [equation.kind is EquationKind.LINK for equation in columns.data.equations]
        self.parts: IntArray = np.where(links, np.cumsum(links), 0)
        self._kept: dict[tuple[Effect, tuple[Effect, ...]], FloatArray] = {}
        self._bytes = 0

    def flat(self, values: ComplexArray) -> FloatArray:
        """(M, ...) whitened real numbers from coefficients (H + 1, E, ...), without the samples that are left out."""
        return off(self.free, whiten(self.whitener, values))

    def in_parts(self, values: ComplexArray) -> FloatArray:
        """(G, M, ...) the same, in parts that add up."""
        count = int(self.parts.max()) + 1
        out = np.zeros((count, len(self.free), *values.shape[2:]))
        for part in range(count):
            own = np.where(self.parts[:, None] == part, values.reshape(*values.shape[:2], -1), 0.0)
            if np.any(own):
                out[part] = self.flat(own.reshape(values.shape))
        return out

    def design(self, effects: Sequence[Effect]) -> FloatArray:
        """(G, M, p) columns of a model in parts."""
        signals = signal_effects(effects)
        return np.concatenate([self._of(effect, effects, signals) for effect in effects], axis=2)

    def scaled(self, parts: FloatArray, scale: FloatArray) -> FloatArray:
        """(M, ...) sum of parts (G, M, ...), each in the scale (E,) of its equations."""
        factors = np.ones(len(parts))
        factors[self.parts] = scale
        return np.tensordot(factors, parts, axes=1)

    def _of(self, effect: Effect, effects: Sequence[Effect], signals: tuple[Effect, ...]) -> FloatArray:
        key = (effect, signals)
        if key not in self._kept:
            if self._bytes > PARTS_KEPT:
                self._kept.clear()
                self._bytes = 0
            self._kept[key] = self.in_parts(self._columns.column_spectra(effect, effects))
            self._bytes += self._kept[key].nbytes
        return self._kept[key]
