"""How far the periods of a recording differ in its course, before and after what changes in it is known."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.gap import Gap, per_joint
from sea_ident.discrepancy.measured.check import torque_units
from sea_ident.discrepancy.measured.data import spectrum
from sea_ident.discrepancy.measured.noise import ComplexArray, noise_directions
from sea_ident.discrepancy.trends.trend import Trend
from sea_ident.discrepancy.trends.trend_directions import steady_rows
from sea_ident.discrepancy.trends.trend_within import changes
from sea_ident.effects.drift import TrendEffect

FEWEST_TO_DIFFER = 4
"""Periods from which on their course is compared."""


SAME = 0.03
"""Share of the strongest direction of all courses below which another is none [-]."""

SEEN = 3.0
"""Standard deviations of the power of noise by which what periods differ by must exceed it to count [-]."""


def trend_gap(bench: Bench, fit: Fit, trends: Sequence[Trend], temperature: FloatArray | None = None) -> Gap | None:
    """What of the torque goes with the course of trends or straight on from period to period, beyond noise.

    The mean over all periods has no part in it. Noise is that of as many periods, from their successive differences.

    Args:
        bench: the recording, or another one that began as it did.
        fit: the model on it.
        trends: what changes, with the values that it has.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.

    Returns:
        Rms over the periods without the trends and with them; None without any, or where periods are too few.
    """
    data, known = bench.data, [(t.effect, t.values) for t in trends if isinstance(t.effect, TrendEffect)]
    if not known or data.periods < FEWEST_TO_DIFFER:
        return None
    residuals = bench.period_residuals(fit) / fit.scale
    explained, courses = np.zeros_like(residuals), [data.starts]
    for effect, values in known:
        change = changes(data, effect, temperature)
        courses.append(change.mean(axis=1))
        present = effect.referred(values, -float(change.mean()))
        for p in range(data.periods):
            torque = data.rows(steady_rows(bench, fit, effect, p)) @ present
            explained[p] += spectrum((change[p] - change.mean())[:, None] * torque, data.harmonics)
    basis = _apart(np.stack([course - course.mean() for course in courses], axis=1))
    before, after = (
        np.stack([bench.cleaned(one) for one in parts - parts.mean(axis=0)])
        for parts in (residuals, residuals - explained)
    )
    steps = np.diff(after, axis=0) / np.sqrt(2.0)
    noise = basis.shape[1] / data.periods * np.mean(np.sum(np.abs(steps) ** 2, axis=1), axis=0)
    had, left = (_along(basis, parts) - noise for parts in (before, after))
    # what differs from pass to pass at a few reversals is in all harmonics at once
    directions = [noise_directions(np.concatenate([each.real, each.imag], axis=1)) for each in np.moveaxis(steps, 2, 0)]
    seen = np.maximum(had, left) > SEEN * noise * np.sqrt(2.0 / (basis.shape[1] * np.maximum(directions, 1.0)))
    had, left = (per_joint(bench, np.where(seen, np.maximum(power, 0.0), 0.0)) for power in (had, left))
    return Gap(had, left, per_joint(bench, noise), torque_units(bench.robot))


def _apart(courses: FloatArray) -> FloatArray:
    """(P, r) orthonormal basis of courses (P, k), one for all that are nearly the same: each has its share of noise."""
    left, strength, _ = np.linalg.svd(courses / np.linalg.norm(courses, axis=0), full_matrices=False)
    return np.asarray(left[:, strength > SAME * strength[0]], dtype=np.float64)


def _along(basis: FloatArray, parts: ComplexArray) -> FloatArray:
    """(E,) mean square over the periods of what of their residuals (P, H + 1, E) goes with courses (P, r)."""
    along = np.einsum("pr,phe->rhe", basis, parts)
    return np.asarray(np.sum(np.abs(along) ** 2, axis=(0, 1)) / len(parts), dtype=np.float64)
