"""Friction of links that was described, but is not in the model, is pointed at where springs fit badly."""

import pytest

from estimation.synthetic import leg_series, record, truth_of
from sea_ident.effects import base_effects, make_effect
from sea_ident.estimation import identify
from sea_ident.robot import load_robot

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
NOISE = {"torque_noise": 0.2, "encoder_noise": 1e-5}


def told(model):
    return [text for text in model.warnings if "--add link_friction" in text]


def test_described_friction_that_the_model_lacks_is_told_and_what_is_modelled_is_not():
    leg = load_robot("exo_leg_link_friction")
    effects = (*base_effects(leg), *(make_effect("link_friction", name) for name in leg.joint_names))
    recording = record(leg, truth_of(leg, leg_series(), effects=effects), 8, **NOISE)
    (said,) = told(identify(leg, recording, period=10.0))
    assert "hip (damping 0.35, friction 0.5)" in said
    assert told(identify(leg, recording, period=10.0, effects=effects)) == []


def test_a_leg_without_described_friction_of_links_is_told_nothing(leg, truth):
    recording = record(leg, truth, 8, **NOISE)
    moved = recording.replace_columns({"theta_knee": recording.columns["theta_knee"] + 0.05})
    assert told(identify(leg, moved, period=10.0)) == []
