"""What the samples that are left out could take up, in units of the noise.

The columns that take it up are each in one equation, and the noise floor mixes the equations of a harmonic only. So a
projection that goes through these columns as they are is a fraction of the work of one by an orthonormal basis of what
the noise floor makes of them, and so is what has to be done once for every noise floor.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.linear import FAR_FROM_LOSS, off, span, whiten
from sea_ident.discrepancy.measured.noise import ComplexArray, leverage_of, stacked, unstacked

FAR_FROM_DEPENDENT = 1e-5
"""Reciprocal condition number of normalised columns from which on two projections by their products have all digits."""


@dataclass(frozen=True, eq=False)
class FreeColumns:
    """Columns that take up whatever happens in the samples that are left out.

    Attributes:
        spectra: (H + 1, E, m), each column in one equation.
        blocks: of every equation that has some, its index, the first of its columns, and these (2 H + 2, m'): real and
            imaginary parts.
    """

    spectra: ComplexArray
    blocks: tuple[tuple[int, int, FloatArray], ...]

    @classmethod
    def of(cls, spectra: ComplexArray) -> "FreeColumns":
        """Columns (H + 1, E, m), those of an equation next to each other, equations in their order."""
        blocks = []
        for equation in range(spectra.shape[1]):
            own = np.flatnonzero(np.any(spectra[:, equation], axis=0))
            if len(own):
                columns = spectra[:, equation, own[0] : own[-1] + 1]
                blocks.append((equation, int(own[0]), np.concatenate([columns.real, columns.imag])))
        return cls(spectra, tuple(blocks))

    @property
    def count(self) -> int:
        """Number of columns."""
        return int(self.spectra.shape[2])


class Freed:
    """The span of such columns in one noise floor.

    Args:
        whitener: (H + 1, E, E).
        columns: the columns.
    """

    def __init__(self, whitener: ComplexArray, columns: FreeColumns) -> None:
        self._columns = columns
        self._whitener = whitener
        self._equations = [equation for equation, _, _ in columns.blocks]
        touched = whitener[:, :, self._equations]
        self._forth, self._back = touched, np.ascontiguousarray(touched.conj().transpose(0, 2, 1))
        self._inverse, self._digits = self._products_inverted()

    @property
    def count(self) -> int:
        """Its dimension."""
        return self._columns.count if self._inverse is not None else int(self.basis.shape[1])

    @cached_property
    def basis(self) -> FloatArray:
        """(M, m) orthonormal basis."""
        return span(whiten(self._whitener, self._columns.spectra))

    @cached_property
    def leverage(self) -> FloatArray:
        """(H + 1, E) share of the noise of every coefficient that it takes up [-]."""
        equations = self._whitener.shape[1]
        if self._inverse is None:
            return leverage_of(self.basis, equations)
        blocks, half = self._columns.blocks, len(self._whitener)
        inside = np.zeros((half, len(blocks), len(blocks)), dtype=np.complex128)
        for i, (_, first, one) in enumerate(blocks):
            for j, (_, begin, two) in enumerate(blocks[: i + 1]):
                turned = one @ self._inverse[first : first + one.shape[1], begin : begin + two.shape[1]]
                left, right = (part[:half] + 1j * part[half:] for part in (turned, two))
                inside[:, i, j] = np.sum(left * right.conj(), axis=1)
                inside[:, j, i] = inside[:, i, j].conj()
        share = np.real(np.einsum("hei,hij,hej->he", self._forth, inside, self._forth.conj(), optimize=True))
        share[1:] /= 2.0
        return np.asarray(share, dtype=np.float64)

    def off(self, columns: FloatArray) -> FloatArray:
        """Whitened columns (M, ...) without what it takes up of them."""
        if self._columns.count == 0:
            return columns.copy()
        if self._inverse is None:
            return off(self.basis, columns)
        left = self._off(columns.reshape(len(columns), -1), self._inverse)
        return (left if self._digits > FAR_FROM_LOSS else self._off(left, self._inverse)).reshape(columns.shape)

    def _off(self, flat: FloatArray, inverse: FloatArray) -> FloatArray:
        half = len(self._whitener)
        back = np.matmul(self._back, unstacked(flat, self._whitener.shape[1]))
        parts = [np.concatenate([back[:, i].real, back[:, i].imag]) for i in range(len(self._equations))]
        blocks = [block for _, _, block in self._columns.blocks]
        amounts = inverse @ np.concatenate([b.T @ part for b, part in zip(blocks, parts, strict=True)])
        taken = np.empty_like(back)
        for i, (_, first, block) in enumerate(self._columns.blocks):
            own = block @ amounts[first : first + block.shape[1]]
            taken[:, i].real, taken[:, i].imag = own[:half], own[half:]
        return flat - stacked(np.matmul(self._forth, taken))

    def _products_inverted(self) -> tuple[FloatArray | None, float]:
        """(m, m) inverse of the products of the whitened columns; None where these nearly depend on each other.

        And the reciprocal condition number of the columns. Where it is small, a second projection has all the digits
        that the first one lost.
        """
        columns = self._columns
        if not columns.count:
            return np.zeros((0, 0)), 1.0
        products = np.empty((columns.count, columns.count))
        weights = np.matmul(self._back, self._forth)
        half = len(weights)
        for i, (_, first, one) in enumerate(columns.blocks):
            for j, (_, begin, two) in enumerate(columns.blocks[: i + 1]):
                weight = weights[:, i, j, None]
                real = weight.real * two[:half] - weight.imag * two[half:]
                imaginary = weight.imag * two[:half] + weight.real * two[half:]
                block = one.T @ np.concatenate([real, imaginary])
                products[first : first + one.shape[1], begin : begin + two.shape[1]] = block
                products[begin : begin + two.shape[1], first : first + one.shape[1]] = block.T
        scale = 1.0 / np.sqrt(np.maximum(np.diagonal(products), 1e-300))
        triangle, failed = scipy.linalg.lapack.dpotrf(products * scale * scale[:, None], lower=1)
        digits = 0.0 if failed else float(scipy.linalg.lapack.dtrcon(triangle, uplo="L")[0])
        if digits < FAR_FROM_DEPENDENT:
            return None, digits
        inverse, _ = scipy.linalg.lapack.dpotri(triangle, lower=1)
        inverse = np.tril(inverse) + np.tril(inverse, -1).T
        return np.asarray(inverse * scale * scale[:, None], dtype=np.float64), digits
