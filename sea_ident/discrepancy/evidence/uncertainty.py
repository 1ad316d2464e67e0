"""Standard deviations of what a diagnosis tells of an effect."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import distance, moved_within
from sea_ident.discrepancy.bench.judge import flat_steps
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.measured.noise import ComplexArray
from sea_ident.effects import Effect
from sea_ident.effects.external_force import WHEN, ExternalForce

FEWEST_STEPS = 5
"""Steps between periods from which on their own scatter says something."""

BENDS = 0.2
"""Standard deviation of a shape, of its logarithm or as a share of its range, from which on what the other values are
along it is no straight line any more [-]."""

OTHERWISE = float(np.log(2.0))
"""Logarithm of the factors between the speeds at which halves of a friction may turn that turns as no library knows."""

MOST_DOUBLINGS = 4
"""How often the way along such a shape is made twice as long while the fit stays as good."""


def uncertainties(bench: Bench, now: Settled) -> FloatArray:
    """(p + s,) standard deviations of the parameters of a model, and of its shapes in the order of `free_shapes`.

    By the noise floor, which is one for all phases of a period, or by how the periods themselves scatter along a
    parameter, where that is more: friction that differs from pass to pass gathers at reversals, and there is friction
    found. Along a shape of what was found that is hardly known, how far values go while the fit stays as good (the
    profile of the likelihood). What the model leaves beyond noise makes all of it larger in proportion (Birge, The
    calculation of errors by the method of least squares, Physical Review 40, 1932).

    Args:
        bench: the recording.
        now: the model.
    """
    fit, steps = now.fit, flat_steps(bench, now)
    plain = np.linalg.norm(fit.covariance_factor, axis=1)
    stds = plain.copy()
    if len(steps) >= FEWEST_STEPS:
        scatter = np.sqrt(np.mean((steps @ fit.basis @ fit.step_factor.T) ** 2, axis=0))
        noise = np.linalg.norm(fit.step_factor, axis=1)
        stds *= np.maximum(np.divide(scatter, noise, out=np.ones_like(noise), where=noise > 0.0), 1.0)
    count, unit = len(fit.columns), fit.unit
    told = np.asarray(np.sqrt(unit) * stds, dtype=np.float64)
    for k, (position, _) in enumerate(fit.free_shapes, start=count):
        if position < len(bench.effects) or not BENDS < told[k] < np.inf:
            continue
        for way, other in _as_good(bench, now, k - count, told[k], unit * (stds[k] / plain[k]) ** 2):
            told[:count] = np.maximum(told[:count], np.abs(other.values - fit.values))
            told[k] = max(told[k], way)
    told = np.hypot(told, by_what_is_held(bench, now))
    told[:count] *= np.concatenate([effect.std_factors(bench.robot) for effect in fit.effects])
    return np.asarray(told, dtype=np.float64)


def by_what_is_held(bench: Bench, now: Settled) -> FloatArray:
    """(p + s,) standard deviations of parameters and shapes by what no fit has for a parameter.

    How friction turns: as a hyperbolic tangent it is held to be, but it may as well do so with a sharper core and
    longer tails, or the other way round, as half of it twice as fast and half of it twice as slowly does. And when a
    push begins and ends, to a sample. How much of each there is, is one more parameter, about zero with a standard
    deviation of one, and known better where the recording tells.

    Args:
        bench: the recording.
        now: the model.
    """
    fit = now.fit
    power = np.zeros(len(fit.columns) + len(fit.free_shapes))
    for change in (*_turned(bench, fit), *_pushed(bench, fit)):
        flat = bench.whitening(now.noise).flat(change * fit.scale)
        along = fit.basis.T @ flat
        beyond = flat - fit.basis @ along
        weight = fit.unit + float(beyond @ beyond)
        amount = float(beyond @ fit.whitened) / weight
        power += (fit.step_factor @ along) ** 2 * (amount**2 + fit.unit / weight)
    return np.sqrt(power)


def _turned(bench: Bench, fit: Fit) -> Iterator[ComplexArray]:
    """(H + 1, E) change of the torque by every friction that turns otherwise, with what turns as it does."""
    for position, effect in enumerate(fit.effects):
        for shape in effect.shapes:
            if shape.name == "smoothing":
                ways = (moved_within(fit.effects, position, shape, step) for step in (-OTHERWISE, OTHERWISE))
                yield sum((0.5 * _change(bench, fit, way) for way in ways), np.zeros_like(fit.residual))


def _pushed(bench: Bench, fit: Fit) -> Iterator[ComplexArray]:
    """(H + 1, E) change of the torque by every push that begins or ends a sample later."""
    sample = bench.data.period / bench.data.samples
    for position, effect in enumerate(fit.effects):
        if not isinstance(effect, ExternalForce):
            continue
        for name in WHEN:
            moved = [replace(effect, **{name: getattr(effect, name) + step * sample}) for step in (-0.5, 0.5)]
            ways = [[push if k == position else e for k, e in enumerate(fit.effects)] for push in moved]
            yield _change(bench, fit, ways[1]) - _change(bench, fit, ways[0])


def _change(bench: Bench, fit: Fit, effects: Sequence[Effect]) -> ComplexArray:
    """(H + 1, E) change of the torque of a fit with other shapes of its effects, none in the chain of signals."""
    begins, change = np.cumsum([0, *bench.counts(fit.effects)]), np.zeros_like(fit.residual)
    for k, (one, other) in enumerate(zip(fit.effects, effects, strict=True)):
        if one is not other:
            spectra = bench.column_spectra(other, effects) - bench.column_spectra(one, fit.effects)
            change += spectra @ fit.values[begins[k] : begins[k + 1]]
    return change


def _as_good(bench: Bench, now: Settled, number: int, step: float, rise: float) -> Iterator[tuple[float, Fit]]:
    """Models with a shape elsewhere that are possible and fit as well, both ways, and how far away it is.

    Args:
        bench: the recording.
        now: the model.
        number: of the shape among those that are free.
        step: to begin with, a standard deviation of the shape.
        rise: of the statistic up to which a model fits as well.
    """
    fit, (position, shape) = now.fit, now.fit.free_shapes[number]
    for sign in (-1.0, 1.0):
        last = fit.effects
        for doubling in range(MOST_DOUBLINGS):
            way = 2.0**doubling * step
            effects = moved_within(fit.effects, position, shape, sign * way)
            if effects == last:  # the end of its range
                break
            last, other = effects, bench.fit(effects, now.noise, start=fit.parameters, tangents=False, known=fit.known)
            if other.statistic - fit.statistic > rise or not physical(bench, other, position):
                break
            yield abs(distance(fit.effects[position], effects[position], shape)), other
