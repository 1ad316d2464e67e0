"""What the motor torques leave open is held at what link and motor equations tell apart, and said to be from there."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.discrepancy.result.repair import repaired_model
from sea_ident.discrepancy.result.untold import untold
from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.estimation import identify
from sea_ident.exceptions import IdentificationError, SeaIdentWarning
from sea_ident.processing import process
from sea_ident.simulation import plant_from_robot

PERIOD = 5.0
PAIR = ("knee.coulomb_friction", "knee.link_friction_coulomb")


def sharp(leg):
    """The usual model with a friction of the knee's link, both of whose signs turn between two samples."""
    usual = [
        replace(e, smoothing=0.003) if isinstance(e, CoulombFriction) and e.joint == "knee" else e
        for e in base_effects(leg)
    ]
    return (*usual, make_effect("link_friction", "knee", smoothing=0.0009))


@pytest.fixture(scope="module")
def rubbing(laboratory, leg):
    """A recording of a knee whose link rubs, the model of its motor torques alone, and the fit with that friction."""
    effect = make_effect("link_friction", "knee")
    recording = laboratory.record([(effect, np.array([0.1, 0.15]))], periods=8, seed=70)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = identify(leg, recording, period=PERIOD)
    bench = Bench(period_data(wide_processing(recording, leg, PERIOD), leg), (*sharp(leg), *spring_effects(leg)))
    return model, process(recording, leg, period=PERIOD), settle(bench, bench.effects).fit


def as_sharp(fit, leg):
    """The fit with the friction of the knee as sharp as in the model."""
    known = {(e.name, e.joint): e for e in sharp(leg)}
    return replace(fit, effects=tuple(known.get((e.name, e.joint), e) for e in fit.effects), free_shapes=())


@pytest.mark.scenario
def test_friction_that_the_motor_torques_do_not_split_is_split_in_the_repaired_model(rubbing, leg):
    model, processed, fit = rubbing
    with pytest.raises(IdentificationError, match="depend on each other"):
        identify(leg, processed, effects=sharp(leg))
    repaired = repaired_model(model, processed, as_sharp(fit, leg))
    found = {p.name: p for p in repaired.parameters}
    truth = plant_from_robot(leg)
    for name, value in zip(PAIR, (truth.coulomb_friction[1], 0.15), strict=True):
        assert abs(found[name].value - value) < 5.0 * found[name].std
        assert 0.0 < found[name].std < 0.1 * value
    for i, spring in enumerate(repaired.springs):
        assert spring.stiffness == pytest.approx(truth.stiffness[i], rel=0.01)
    assert repaired.fit.agreement.rms[1] < 1.5 * repaired.fit.agreement.noise[1]
    assert any("from the equations of link and motor apart" in note for note in repaired.notes)
    assert repaired.estimator == model.estimator


@pytest.mark.scenario
def test_what_the_fit_does_not_tell_either_is_the_reason_that_there_is_no_model(rubbing, leg):
    model, processed, fit = rubbing
    names = [column.name for column in fit.columns]
    flat = fit.flat.copy()
    flat[:, names.index(PAIR[1])] = flat[:, names.index(PAIR[0])]
    blind = replace(as_sharp(fit, leg), linear=lambda: (flat, fit.directions), frame=None)
    why = repaired_model(model, processed, blind)
    assert "neither the motor torques nor the link equations tell knee." in why


def equations(columns):
    """Equations of one joint with these columns (N, b), one of whose samples does not count."""
    valid = np.ones((len(columns), 1), dtype=bool)
    valid[-1] = False
    return SimpleNamespace(
        base=SimpleNamespace(rank=columns.shape[1]),
        rows=columns[:, None, :],
        valid=valid,
        effects=(),
        processed=SimpleNamespace(
            motion=SimpleNamespace(dtheta=valid.astype(float)), tau_motor=np.zeros(valid.shape), periods=8
        ),
    )


def test_of_columns_that_act_together_the_one_that_is_known_best_is_held():
    columns = np.random.default_rng(0).normal(size=(30, 4))
    columns[:-1, 3] = 2.0 * columns[:-1, 1]
    found = untold(equations(columns), np.array([1e-9, 0.3, 1e-9, 0.1]))
    assert list(found.held) == [3]
    assert found.follows[:, 0] == pytest.approx([0.0, -2.0, 0.0, 1.0], abs=1e-9)


def test_where_all_is_told_nothing_is_held():
    found = untold(equations(np.random.default_rng(0).normal(size=(30, 4))), np.ones(4))
    assert found.held.size == 0
    assert found.follows.shape == (4, 0)
