"""What the data say of a spring: linear, stiffening, hysteretic, or too little."""

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.estimation.spring_result import Verdict
from sea_ident.motion import Motion

FOLDS = 10
"""Pieces of the period of which each is predicted from the others."""

EXCITED = 0.25
"""Relative standard deviation of the stiffness beyond which a spring counts as not excited."""

SLIPS = (0.15, 0.6)
"""Deflections at which a slipping element that is tried slips, as shares of the rms deflection [-]."""

SUPPORT = 1e-3
"""Significance that a term beyond the linear spring needs."""


def hysteresis_column(deflection: FloatArray, width: float) -> FloatArray:
    """A Maxwell-slip element of unit strength: it follows the deflection and slips at +-width.

    Args:
        deflection: (N,) over one period or a whole recording [rad].
        width: deflection at which it slips [rad].

    Returns:
        (N,) its torque as a share of the slip torque; run twice, so that its start does not count.
    """
    state, out = 0.0, np.empty_like(deflection)
    before = float(deflection[-1])
    for turn in range(2):
        for k, value in enumerate(deflection):
            state = min(max(state + (float(value) - before) / width, -1.0), 1.0)
            before = float(value)
            if turn:
                out[k] = state
    return out


def held_out_rms(columns: FloatArray, motion: Motion, joint: int, zero: float, tau: FloatArray) -> dict[str, float]:
    """Rms [N m] on pieces of the period that were left out of the fit, by law."""
    deflection = motion.deflection[:, joint] - zero
    spread = float(np.std(deflection))
    laws = {"linear": np.delete(columns, 1, axis=1), "cubic": columns}
    for share in SLIPS:
        slip = hysteresis_column(deflection, max(share * spread, 1e-300))
        laws[f"hysteresis {share:g}"] = np.column_stack([columns, slip])
    pieces = np.array_split(np.arange(len(tau)), FOLDS)
    found = {}
    for label, table in laws.items():
        total = 0.0
        norms = np.linalg.norm(table, axis=0)
        norms = np.where(norms > 0.0, norms, 1.0)
        scaled = table / norms
        for piece in pieces:
            train = np.ones(len(tau), dtype=bool)
            train[piece] = False
            values = np.linalg.lstsq(scaled[train], tau[train], rcond=None)[0]
            total += float(((tau[piece] - scaled[piece] @ values) ** 2).sum())
        found[label] = float(np.sqrt(total / len(tau)))
    hysteresis = min((label for label in found if label.startswith("hysteresis")), key=lambda label: found[label])
    return {"linear": found["linear"], "cubic": found["cubic"], "hysteresis": found[hysteresis]}


def verdict_of(
    law: FloatArray, std: FloatArray, freedom: float, held_out: dict[str, float], spread: str, torque: float
) -> tuple[Verdict, str]:
    """Which terms the data support: significant, and better on pieces that were left out.

    Args:
        law: (3,) K1, K3, D.
        std: (3,) their standard deviations.
        freedom: degrees of freedom of these.
        held_out: rms by law on pieces that were left out [N m] or [N].
        spread: standard deviation of the deflection, with its unit.
        torque: standard deviation of the torque [N m] or [N].

    Returns:
        The verdict, and its reason in words.
    """
    relative = std[0] / abs(law[0]) if law[0] != 0.0 else np.inf
    if relative > EXCITED or torque <= 0.0:
        return (
            Verdict.NOT_EXCITED,
            f"stiffness known to {100 * min(relative, 99.0):.0f} % only: deflections of {spread} (rms) are too small "
            "for it, or theta - q is not what bends this spring",
        )
    linear, cubic, hysteresis = held_out["linear"], held_out["cubic"], held_out["hysteresis"]
    limit = stats.norm.ppf(1 - SUPPORT / 2) if not np.isfinite(freedom) else stats.t.ppf(1 - SUPPORT / 2, freedom)
    if hysteresis < 0.7 * cubic and hysteresis < 0.7 * linear and cubic > 0.01 * torque:
        return Verdict.HYSTERETIC, f"held-out rms falls from {_apart(cubic, hysteresis, 'to')} with a slipping element"
    if abs(law[1]) > limit * std[1] and cubic < linear:
        return Verdict.STIFFENING, f"held-out rms falls from {_apart(linear, cubic, 'to')} with the cubic term"
    held = f"held-out rms {linear:.3g} without and {cubic:.3g} with the cubic term"
    if cubic < linear:
        size = abs(law[1]) / std[1] if std[1] > 0.0 else np.inf
        return (
            Verdict.LINEAR,
            f"{held}, but that term is {size:.2g} standard deviations from zero, not the {limit:.2g} that it takes",
        )
    return Verdict.LINEAR, held


def _apart(first: float, second: float, between: str) -> str:
    """Two numbers with as many digits as it takes to tell them apart, three at least: what falls is seen to fall."""
    texts = [(f"{first:.{digits}g}", f"{second:.{digits}g}") for digits in (3, 4, 5, 6, 7)]
    return f" {between} ".join(next((pair for pair in texts if pair[0] != pair[1]), texts[0]))
