from dataclasses import replace

import numpy as np
import pytest

from estimation.synthetic import leg_series, record, truth_of
from sea_ident.effects import base_effects, make_effect
from sea_ident.effects.friction_drift import FrictionDrift
from sea_ident.estimation import TrendTerm, identify, read_model
from sea_ident.exceptions import IdentificationError

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
NOISE = {"torque_noise": 0.3, "encoder_noise": 1e-5}


@pytest.fixture(scope="module")
def campaign(leg, coarse):
    return identify(leg, record(leg, coarse, 20, **NOISE), period=10.0)


@pytest.fixture(scope="module")
def heavier(leg):
    """The same leg with a heavier shoe."""
    inertial = leg.inertial_parameters.copy()
    inertial[20:30] *= 1.3
    return truth_of(leg.with_inertial_parameters(inertial, leg.rotor_inertias()), leg_series(), samples=500)


def test_three_periods_and_the_earlier_model_are_worth_a_campaign(leg, heavier, campaign):
    recording = record(leg, heavier, 3, seed=5, **NOISE)
    alone = identify(leg, recording, period=10.0)
    model = identify(leg, recording, period=10.0, prior=campaign)
    exact = model.base.project(heavier.parameters)
    assert np.median(alone.std / campaign.std) > 1.8
    assert np.median(model.std / campaign.std) < 1.4
    error = (model.values - exact) / model.std
    assert np.sqrt(np.mean(error**2)) < 1.8
    # the shoe shows in the moments of the leg, not in rotors or friction
    assert "foot.mz" in model.update.changed
    assert "shank.mz*" in model.update.changed
    assert not any("friction" in name or "rotor" in name for name in model.update.changed)


def test_nothing_changed(leg, coarse, campaign):
    changed = 0
    for seed in range(10, 16):
        model = identify(leg, record(leg, coarse, 4, seed=seed, **NOISE), period=10.0, prior=campaign)
        changed += len(model.update.changed)
    assert changed <= 1


def test_the_update_is_saved(leg, heavier, campaign, tmp_path):
    model = identify(leg, record(leg, heavier, 3, seed=5, **NOISE), period=10.0, prior=campaign)
    model.save(tmp_path / "model.json")
    assert read_model(tmp_path / "model.json").update == model.update
    assert "changed" in model.summary()


def test_models_with_other_parameters_are_refused(leg, coarse, campaign):
    effects = (*base_effects(leg), make_effect("torque_offset", "hip"))
    with pytest.raises(IdentificationError, match="same robot and effects"):
        identify(leg, record(leg, coarse, 4, **NOISE), period=10.0, prior=campaign, effects=effects)


def test_what_drifts_in_an_earlier_model_is_not_taken_over_and_that_is_said(leg, coarse, campaign):
    term = TrendTerm(FrictionDrift("knee", reference=20.0), (0.0, 0.1), (0.0, 0.01))
    told = "friction_drift at knee of the earlier model changes in the course of a recording"
    recording = record(leg, coarse, 4, **NOISE)
    model = identify(leg, recording, period=10.0, prior=replace(campaign, trends=(term,)))
    assert model.trends == ()
    assert [text for text in model.notes if told in text]
    assert not [text for text in identify(leg, recording, period=10.0, prior=campaign).notes if told in text]
