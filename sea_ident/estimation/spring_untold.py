"""What a motion does not tell of the columns of a spring, and what only a rest that it does not show tells."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import IdentificationError

ROUNDING = 1e-14
"""Smallest to largest eigenvalue of normalised products below which columns are the same but for rounding."""

SHARE = 0.1
"""Part of a column in the combination that vanishes from which on it is named as one of the same [-]."""

SAME = 1e-6
"""Part of a column, without its mean, beyond the law of a spring below which only the mean tells the two apart [-]."""


def untold(joint: str, gram: FloatArray, owners: Sequence[str]) -> FloatArray:
    """(c, k) directions in which the columns of one effect are the same but for rounding.

    Args:
        joint: of the spring.
        gram: (c, c) products of columns of unit length.
        owners: what each column belongs to.

    Raises:
        IdentificationError: those of different effects are.
    """
    strength, directions = np.linalg.eigh(gram)
    nothing = np.asarray(directions[:, strength <= ROUNDING * strength[-1]], dtype=np.float64)
    for direction in nothing.T:
        alike = list(dict.fromkeys(owners[k] for k in np.flatnonzero(np.abs(direction) > SHARE).tolist()))
        if len(alike) > 1:
            raise IdentificationError(
                f"joint {joint!r}: this motion does not tell {' and '.join(alike)} of its spring apart; leave one "
                "effect out, or excite this joint more"
            )
    return nothing


def told_by_rest(columns: FloatArray, values: FloatArray) -> FloatArray:
    """(c, k) by how much values (c,) may be off where only a mean tells effects from the law of the spring.

    Dry friction that never slips is a spring that is at rest where it slipped last, before the recording. Where that
    was the motion does not show: all of it may be part of the stiffness.

    Args:
        columns: (N, c) of K1, K3, D and the other effects.
        values: (c,) of them.
    """
    centred = columns - columns.mean(axis=0)
    norms = np.linalg.norm(centred, axis=0)
    unit = centred / np.where(norms > 0.0, norms, 1.0)
    law, rest = unit[:, :3], unit[:, 3:]
    like = np.linalg.lstsq(law, rest, rcond=None)[0]
    same = (np.linalg.norm(rest - law @ like, axis=0) < SAME) & (norms[3:] > ROUNDING * np.linalg.norm(columns[:, 3:]))
    off = np.zeros((len(values), len(same)))
    off[:3] = -like / norms[:3, None] * norms[3:]
    off[3:] = np.eye(len(same))
    return np.asarray(off[:, same] * values[3:][same], dtype=np.float64)
