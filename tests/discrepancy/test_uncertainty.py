"""Standard deviations that a diagnosis tells are those of estimates from one recording to the next."""

import warnings

import numpy as np
import pytest

import sea_ident.discrepancy.uncertainty as module
from sea_ident.discrepancy.named import named_effect
from sea_ident.discrepancy.repair import repaired_model
from sea_ident.discrepancy.settle import Settled, settle
from sea_ident.discrepancy.uncertainty import uncertainties
from sea_ident.effects import make_effect
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.processing import process
from sea_ident.simulation import FrictionJitter

PERIOD = 5.0


@pytest.fixture(scope="module")
def ten_recordings(laboratory):
    """Of a leg whose friction differs from pass to pass, each with its bench and the usual model, settled."""
    found = []
    for seed in range(10):
        recording = laboratory.recorded_anew((), periods=12, jitter=FrictionJitter(0.1, 0.05), seed=100 + seed)
        bench = laboratory.bench(recording)
        found.append((recording, bench, settle(bench, bench.effects)))
    return found


@pytest.mark.scenario
def test_estimates_of_other_recordings_scatter_as_is_told(ten_recordings):
    """A tenth more than noise is told where friction differs from pass to pass."""
    values = [now.fit.values for _, _, now in ten_recordings]
    told = [uncertainties(bench, now)[: len(now.fit.values)] for _, bench, now in ten_recordings]
    known = [k for k, c in enumerate(ten_recordings[0][2].fit.columns) if "friction" in c.name or "spring" in c.name]
    ratio = np.mean(told, axis=0)[known] / np.std(values, axis=0, ddof=1)[known]
    # nine degrees of freedom each: a factor of 1.8 once in twenty
    assert len(ratio) == 15
    assert 0.9 < np.exp(np.mean(np.log(ratio))) < 1.4
    assert np.all(ratio > 0.6)


@pytest.mark.scenario
def test_repaired_models_are_off_by_what_they_tell(ten_recordings, leg):
    """Springs and motors of the model that a user goes on with, from one recording to the next."""
    errors = []
    for recording, _, now in ten_recordings:
        processed = process(recording, leg, period=PERIOD)
        model = repaired_model(identified(leg, processed), processed, now.fit)
        of_motors = {p.name: p for p in model.parameters}
        own = []
        for spring, joint in zip(model.springs, leg.joints, strict=True):
            true, friction = leg.spring(joint.name), of_motors[f"{joint.name}.viscous_friction"]
            own.append((spring.stiffness - true.stiffness) / spring.stiffness_std)
            own.append((spring.cubic_stiffness - (true.cubic_stiffness or 0.0)) / spring.cubic_stiffness_std)
            own.append((friction.value - joint.actuator.viscous_friction) / friction.std)
        errors.append(own)
    squares = np.mean(np.square(errors), axis=0)
    # ten of each, thirty of a kind: correlated, so that a kind is taken at its word within a half
    assert np.all(np.sqrt(squares.reshape(3, 3).mean(axis=0)) < 1.5)
    assert np.sqrt(squares.mean()) > 0.6


def identified(leg, processed):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return identify(leg, processed)


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


def test_along_a_shape_that_is_hardly_known_values_are_as_unsure_as_they_go(laboratory, monkeypatch):
    """Friction that hardly varies over the turn of a joint fits with any order, and with amounts that follow it."""
    planted = {"sine": 0.2, "cosine": -0.15, "order": 1.0}
    name = "position_dependent_friction"
    amounts = [planted["sine"], planted["cosine"]]
    bench = laboratory.bench(laboratory.record([(name, "knee", amounts, {"order": planted["order"]})]))
    start = settle(bench, bench.effects)
    model = bench.anchored((*start.fit.effects, make_effect(name, "knee", order=5.0)), start.fit.parameters)
    now = Settled(bench.fit(model, start.noise, start=start.fit.parameters), start.noise)
    straight, profile = [], []
    for bends, told in ((np.inf, straight), (module.BENDS, profile)):
        monkeypatch.setattr(module, "BENDS", bends)
        found = named_effect(bench, now.fit, len(model) - 1, uncertainties(bench, now), 0.0, ())
        parameters = {p.name.removeprefix(f"knee.{name}_"): p for p in found.parameters}
        told.extend(abs(parameters[key].value - value) / parameters[key].std for key, value in planted.items())
    assert max(straight) > 5.0
    assert max(profile) < 2.0
    assert profile[-1] < 0.7 * straight[-1]
    # none of them counts where it is not possible
    monkeypatch.setattr(module, "physical", lambda *_: False)
    possible = uncertainties(bench, now)
    monkeypatch.setattr(module, "BENDS", np.inf)
    np.testing.assert_array_equal(possible, uncertainties(bench, now))
    assert now.fit.statistic < 1.2 * now.fit.dof
