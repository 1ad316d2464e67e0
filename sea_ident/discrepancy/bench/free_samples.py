"""Columns that take up what happens in the samples that are left out."""

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.bench.linear import span
from sea_ident.discrepancy.measured.data import ALIKE
from sea_ident.singular_values import svd


def free_samples(left_out: NDArray[np.bool_], harmonics: int, alike: float = ALIKE) -> NDArray[np.complex128]:
    """Columns that take up whatever happens in the samples left out.

    A sample with a free value of its own says nothing about any other parameter. Unlike a weight of zero this leaves
    the noise of the other samples as it is, harmonic by harmonic.

    Args:
        left_out: (N, E).
        harmonics: H.
        alike: combinations that are weaker than this within the band are not freed [-].

    Returns:
        (H + 1, E, m) orthonormal spectra, each in one equation; neighbouring samples that look alike within the band
        share one.
    """
    samples, equations = left_out.shape
    columns = [np.zeros((harmonics + 1, equations, 0), dtype=np.complex128)]
    for e in range(equations):
        own = [_alike_once(group, samples, harmonics, alike) for group in _groups(left_out[:, e])]
        if own:
            # once here, not in every noise floor: groups nearby are nearly dependent within the band
            basis = span(np.concatenate(own, axis=1))
            column = np.zeros((harmonics + 1, equations, basis.shape[1]), dtype=np.complex128)
            column[:, e] = basis[: harmonics + 1] + 1j * basis[harmonics + 1 :]
            columns.append(column)
    return np.concatenate(columns, axis=2)


def _alike_once(group: IntArray, samples: int, harmonics: int, alike: float) -> FloatArray:
    """(2 H + 2, m) real and imaginary parts of what is within the band of a run of samples, alike ones once."""
    phase = np.exp(-2j * np.pi * np.outer(np.arange(harmonics + 1), group) / samples) / samples
    phase[1:] *= np.sqrt(2.0)
    left, strength, _ = svd(np.concatenate([phase.real, phase.imag]))
    return np.asarray(left[:, strength > alike * strength[0]], dtype=np.float64)


def _groups(chosen: NDArray[np.bool_]) -> list[IntArray]:
    """Runs of neighbouring indices, round the end of the period."""
    indices = np.flatnonzero(chosen)
    if not len(indices):
        return []
    runs = np.split(indices, np.flatnonzero(np.diff(indices) > 1) + 1)
    if len(runs) > 1 and indices[0] == 0 and indices[-1] == len(chosen) - 1:
        runs[0] = np.concatenate([runs.pop(), runs[0]])
    return runs
