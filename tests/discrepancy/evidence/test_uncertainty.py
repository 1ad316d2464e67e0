"""Standard deviations that a diagnosis tells are those of estimates from one recording to the next."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import sea_ident.discrepancy.evidence.uncertainty as module
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.evidence.named import named_effect
from sea_ident.discrepancy.evidence.uncertainty import uncertainties
from sea_ident.discrepancy.result.repair import repaired_model
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
    monkeypatch.setattr(module, "by_what_is_held", lambda *given: 0.0)
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
    monkeypatch.setattr(module, "by_what_is_held", lambda *given: 0.0)
    fit = bench.fit((*start.fit.effects, make_effect("torque_offset", "hip")), start.noise)
    ratio = fit.statistic / fit.dof
    assert ratio > 2.0
    told = uncertainties(bench, Settled(fit, start.noise))
    np.testing.assert_allclose(told, ratio**0.5 * np.linalg.norm(fit.covariance_factor, axis=1))


@pytest.mark.scenario
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


@pytest.mark.scenario
def test_friction_that_turns_in_another_form_is_told_as_unsure_as_it_is_off(laboratory):
    """Half of a friction of the link turns at a quarter of the speed of the other half: no single turn is right."""
    speeds, values = (0.015, 0.06), np.array([0.4, 1.0])
    planted = [(make_effect("link_friction", "knee", smoothing=speed), 0.5 * values) for speed in speeds]
    quiet = {"jitter": FrictionJitter.none()}
    twofold, single = (
        laboratory.bench(laboratory.record(effects, periods=12, **quiet))
        for effects in (planted, [(make_effect("link_friction", "knee", smoothing=0.03), values)])
    )
    off, told = [], []
    for bench in (twofold, single):
        start = settle(bench, bench.effects)
        friction = make_effect("link_friction", "knee", smoothing=0.03)
        fit = bench.refine((*start.fit.effects, friction), start.noise, start=start.fit.parameters)
        now = settle_again(bench, fit)
        at = [column.name for column in now.fit.columns].index("knee.link_friction_viscous")
        off.append(now.fit.values[at : at + 2] - values)
        told.append(
            (np.linalg.norm(now.fit.covariance_factor[at : at + 2], axis=1), uncertainties(bench, now)[at : at + 2])
        )
    plain, whole = told[0]
    assert np.all(np.abs(off[0]) > 4.0 * np.sqrt(2.0) * plain)
    assert np.all(np.abs(off[0]) < 2.0 * whole)
    # where it turns as the library has it, the recording says so
    plain, whole = told[1]
    assert np.all(np.abs(off[1]) < 3.0 * whole)
    assert np.all(whole < 3.0 * plain)


@pytest.mark.parametrize("name", ["knee.viscous_friction", "hip.spring_damping", "shank.mx"])
def test_what_looks_like_a_column_is_that_parameter_and_no_more(nothing_missing, monkeypatch, name):
    """Of what no recording tells from a parameter, that is as unsure as it is held to be."""
    bench, now = nothing_missing
    fit = now.fit
    column = [each.name for each in fit.columns].index(name)
    torque = 0.1 * bench.design(fit.effects)[:, :, column]
    monkeypatch.setattr(module, "_turned", lambda *given: [torque])
    shift = module.by_what_is_held(bench, now)
    assert shift[column] == pytest.approx(0.1, rel=1e-5)
    friction = [k for k, each in enumerate(fit.columns) if "friction" in each.name and k != column]
    assert np.all(shift[friction] < 1e-6)


@pytest.mark.scenario
def test_a_push_whose_end_is_off_by_most_of_a_sample_is_told_as_unsure_as_it_is_off(laboratory):
    push, force = make_effect("external_force", "knee", start=1.0, stop=1.1, period=PERIOD), np.array([40.0, 0.0, 0.0])
    bench = laboratory.bench(laboratory.record([(push, force)], periods=12, jitter=FrictionJitter.none()))
    start = settle(bench, bench.effects)
    later = replace(push, stop=push.stop + 0.8 * bench.data.period / bench.data.samples)
    fit = bench.fit((*start.fit.effects, later), start.noise, start=start.fit.parameters)
    now = Settled(fit, start.noise)
    at = [column.name for column in fit.columns].index("knee.external_force_x")
    off = abs(fit.values[at] - force[0])
    assert off > 4.0 * np.linalg.norm(fit.covariance_factor[at]) * fit.unit**0.5
    assert off < 2.0 * uncertainties(bench, now)[at]
