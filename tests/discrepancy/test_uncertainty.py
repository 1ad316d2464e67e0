"""Standard deviations that a diagnosis tells are those of estimates from one recording to the next."""

import numpy as np
import pytest

import sea_ident.discrepancy.uncertainty as module
from sea_ident.discrepancy.settle import Settled, settle
from sea_ident.discrepancy.uncertainty import uncertainties
from sea_ident.effects import make_effect
from sea_ident.simulation import FrictionJitter


@pytest.mark.scenario
def test_estimates_of_other_recordings_scatter_as_is_told(laboratory):
    """Ten recordings of a leg whose friction differs from pass to pass: a tenth more than noise is told there."""
    values, told = [], []
    for seed in range(10):
        recording = laboratory.recorded_anew((), periods=12, jitter=FrictionJitter(0.1, 0.05), seed=100 + seed)
        bench = laboratory.bench(recording)
        now = settle(bench, bench.effects)
        values.append(now.fit.values)
        told.append(uncertainties(bench, now)[: len(now.fit.values)])
    known = [k for k, c in enumerate(now.fit.columns) if "friction" in c.name or "spring" in c.name]
    ratio = np.mean(told, axis=0)[known] / np.std(values, axis=0, ddof=1)[known]
    # nine degrees of freedom each: a factor of 1.8 once in twenty
    assert len(ratio) == 15
    assert 0.9 < np.exp(np.mean(np.log(ratio))) < 1.4
    assert np.all(ratio > 0.6)


def test_periods_that_scatter_along_a_parameter_make_it_less_sure(nothing_missing, monkeypatch):
    bench, now = nothing_missing
    fit, factor = now.fit, now.fit.covariance_factor
    noise = np.linalg.norm(factor, axis=1)
    one = [c.name for c in fit.columns].index("knee.coulomb_friction")
    along = fit.basis @ factor[one] / noise[one]
    monkeypatch.setattr(module, "flat_steps", lambda *given: 3.0 * np.outer([1.0, -1.0] * 5, along))
    told = uncertainties(bench, now)
    assert told[one] == pytest.approx(3.0 * noise[one] * fit.unit**0.5)
    assert np.all(told >= noise * fit.unit**0.5 * (1.0 - 1e-12))
    few = uncertainties_of_few(bench, now, along, monkeypatch)
    assert few[one] == pytest.approx(noise[one] * fit.unit**0.5)


def uncertainties_of_few(bench, now, along, monkeypatch):
    monkeypatch.setattr(module, "flat_steps", lambda *given: 3.0 * np.outer([1.0, -1.0], along))
    return uncertainties(bench, now)


def test_what_a_model_leaves_makes_it_less_sure(rippled, monkeypatch):
    """A hip that cogs, told as a constant torque."""
    bench, start, _ = rippled
    monkeypatch.setattr(module, "flat_steps", lambda *given: np.zeros((0, 0)))
    fit = bench.fit((*start.fit.effects, make_effect("torque_offset", "hip")), start.noise)
    ratio = fit.statistic / fit.dof
    assert ratio > 2.0
    told = uncertainties(bench, Settled(fit, start.noise))
    np.testing.assert_allclose(told, ratio**0.5 * np.linalg.norm(fit.covariance_factor, axis=1))
