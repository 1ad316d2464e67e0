"""Torques in units of the noise, without the samples that are left out; what was computed once is kept.

The residual of a link equation is scaled by the stiffness of its spring, which every step of a fit changes. So the
columns are kept in parts, one for all equations that are never scaled and one for each link, and a step costs a sum.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.bench.columns import Columns
from sea_ident.discrepancy.bench.free_shapes import seen_by, signal_effects
from sea_ident.discrepancy.bench.freed import FreeColumns, Freed
from sea_ident.discrepancy.bench.linear import whiten
from sea_ident.discrepancy.measured.data import EquationKind
from sea_ident.discrepancy.measured.noise import ComplexArray
from sea_ident.effects import Effect

PARTS_KEPT = 1e8
"""Bytes of columns that are kept."""

ROUNDING = 1e-10
"""Share of a column below which what the samples that are left out leave of it is rounding [-]. A joint that friction
holds still is in no other sample, and whatever its friction is, it does nothing: of rounding it would be anything."""


@dataclass(frozen=True, eq=False)
class Block:
    """Neighbouring columns of one part.

    Attributes:
        part: which.
        first: position of the first column.
        rows: (k, M) the columns, each a row of memory: sums and factorisations go along columns.
    """

    part: int
    first: int
    rows: FloatArray


@dataclass(frozen=True, eq=False)
class Parts:
    """Whitened columns in parts that add up; most columns are in one or two of them.

    Attributes:
        shape: (G, M, p) parts, rows, columns.
        blocks: what is not zero.
    """

    shape: tuple[int, int, int]
    blocks: tuple[Block, ...]

    def scaled(self, factors: FloatArray) -> FloatArray:
        """(M, p) sum of the parts, each times its factor (G,)."""
        out = np.zeros((self.shape[2], self.shape[1]))
        for block in self.blocks:
            factor = factors[block.part]
            own = out[block.first : block.first + len(block.rows)]
            own += block.rows if factor == 1.0 else factor * block.rows
        return out.T

    def __matmul__(self, values: FloatArray) -> FloatArray:
        """(G, M) torque of every part with parameters (p,)."""
        out = np.zeros(self.shape[:2])
        for block in self.blocks:
            out[block.part] += values[block.first : block.first + len(block.rows)] @ block.rows
        return out


class Whitening:
    """One noise floor applied to columns and residuals.

    Args:
        columns: of the recording.
        whitener: (H + 1, E, E).
        free: columns of the samples that are left out.

    Attributes:
        whitener: (H + 1, E, E).
        free: the samples that are left out, whitened.
        parts: (E,) part that each equation belongs to; the first is that of the equations without a spring.
        target: (G, M) measured torques in parts, once they were asked for.
    """

    def __init__(self, columns: Columns, whitener: ComplexArray, free: FreeColumns) -> None:
        self.whitener = whitener
        self.free = Freed(whitener, free)
        self.target: FloatArray | None = None
        self._columns = columns
        links = [equation.kind is EquationKind.LINK for equation in columns.data.equations]
        self.parts: IntArray = np.where(links, np.cumsum(links), 0)
        self._kept: dict[tuple[Effect, tuple[Effect, ...]], Parts] = {}
        self._bytes = 0

    def flat(self, values: ComplexArray) -> FloatArray:
        """(M, ...) whitened real numbers from coefficients (H + 1, E, ...), without the samples that are left out."""
        return self.free.off(whiten(self.whitener, values))

    def design(self, effects: Sequence[Effect]) -> Parts:
        """Columns of a model in parts."""
        signals = signal_effects(effects)
        seen = {effect: seen_by(effect, signals) for effect in effects}
        missing = [effect for effect in effects if (effect, seen[effect]) not in self._kept]
        if missing and self._bytes > PARTS_KEPT:
            self._kept.clear()
            self._bytes, missing = 0, list(effects)
        for effect in missing:
            # one by one: the last digits of products depend on what is beside them, and an answer must not depend on
            # what was computed before
            parts = self.in_parts(self._columns.columns_behind(effect, seen[effect]))
            self._kept[effect, seen[effect]] = parts
            self._bytes += sum(block.rows.nbytes for block in parts.blocks)
        blocks: list[Block] = []
        width = 0
        for effect in effects:
            parts = self._kept[effect, seen[effect]]
            blocks.extend(replace(block, first=block.first + width) for block in parts.blocks)
            width += parts.shape[2]
        return Parts((self._count, self._length, width), tuple(blocks))

    def factors(self, scale: FloatArray) -> FloatArray:
        """(G,) factor of every part where each equation has its scale (E,)."""
        factors = np.ones(self._count)
        factors[self.parts] = scale
        return factors

    @property
    def _length(self) -> int:
        """M."""
        harmonics, equations = self.whitener.shape[:2]
        return int(equations * (2 * harmonics - 1))

    @property
    def _count(self) -> int:
        return int(self.parts.max()) + 1

    def in_parts(self, values: ComplexArray) -> Parts:
        """Whitened columns from coefficients (H + 1, E, k), in parts that add up."""
        places: list[tuple[int, int, int]] = []
        flat: list[FloatArray] = []
        for part in range(self._count):
            own = np.flatnonzero(self.parts == part)
            begin, end = _filled(values[:, own])
            if end > begin:
                flat.append(whiten(self.whitener[:, :, own], values[:, own, begin:end]))
                places.append((part, begin, end - begin))
        blocks: list[Block] = []
        if flat:
            whole = np.concatenate(flat, axis=1)
            rows, taken = np.ascontiguousarray(self.free.off(whole).T), 0
            rows[np.linalg.norm(rows, axis=1) < ROUNDING * np.linalg.norm(whole, axis=0)] = 0.0
            for part, begin, count in places:
                blocks.append(Block(part, begin, rows[taken : taken + count]))
                taken += count
        return Parts((self._count, self._length, values.shape[2]), tuple(blocks))


def _filled(values: ComplexArray) -> tuple[int, int]:
    """First column of (H + 1, e, k) with anything in it, and the one after the last."""
    filled = np.flatnonzero(np.any(values, axis=(0, 1)))
    return (int(filled[0]), int(filled[-1]) + 1) if len(filled) else (0, 0)
