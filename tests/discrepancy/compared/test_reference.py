"""Against an earlier model: what changed is found within its uncertainty, and nothing where nothing did."""

import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy import stats

import sea_ident
from sea_ident.discrepancy.compared.reference import LEVEL, SMALLEST_CHANGE, compare_with_reference
from sea_ident.effects import base_effects, make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.simulation import FrictionJitter, SensorNoise

MASS = 1.5
PAYLOAD = [MASS, 0.03, 0.0, 0.15, 0.01, 0.01, 0.004, 0.0, 0.0, 0.0]


def payload(laboratory):
    """A mass on the foot, away from its frame."""
    count = len(make_effect("payload", "ankle").columns(laboratory.leg))
    return ("payload", "ankle", PAYLOAD[:count], {})


@pytest.fixture(scope="module")
def recorded(laboratory):
    """Records six periods, of the leg as it is unless something is planted."""
    return partial(laboratory.record, periods=6)


@pytest.fixture(scope="module")
def compared(laboratory, leg):
    """Compares a recording with the model of another, of usual effects unless others are given."""

    def compare(recording, earlier, effects=None):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            reference = sea_ident.identify(leg, earlier, effects=effects, period=5.0)
            now = sea_ident.identify(leg, recording, effects=effects, period=5.0)
        return compare_with_reference(now, reference, laboratory.data(recording))

    return compare


@pytest.mark.scenario
@pytest.mark.parametrize("pairs", [range(4), pytest.param(range(4, 9), marks=pytest.mark.slow)], ids=["few", "more"])
def test_nothing_changed_at_the_level_that_is_said(recorded, compared, pairs):
    """Over two motions and pairs of recordings; p-values that are too small would show."""
    found = [compared(recorded(seed=2 * k, motion=k % 2), recorded(seed=2 * k + 1, motion=0)) for k in pairs]
    p_values = np.array([each.p_value for each in found])
    assert stats.binomtest(int(np.sum(p_values < 0.05)), len(found), 0.05, "greater").pvalue > 0.01
    assert p_values.min() > LEVEL
    assert not any(each.changed or each.missing for each in found)


@pytest.mark.scenario
def test_both_models_have_the_effects_and_shapes_of_the_earlier_one(recorded, leg, compared):
    """What one of them lacked would bend its parameters, by another motion in another way, and count as a change."""
    ripple = make_effect("torque_ripple", "hip", order=4.0)
    recordings = [
        recorded([("torque_ripple", "hip", [2.0, 1.0], {"order": 4.0})], motion=motion, seed=seed)
        for motion, seed in ((1, 3), (0, 11))
    ]
    found = compared(*recordings, effects=(*base_effects(leg), ripple))
    assert found.p_value > LEVEL
    assert not found.changed


@pytest.mark.scenario
def test_a_change_too_small_to_matter_is_none_however_sure_it_is(laboratory, compared):
    """Friction of 1.5 thousandths of the torque, between recordings with hardly any noise."""
    quiet = {"sensors": SensorNoise.none(), "jitter": FrictionJitter(1e-4, 0.05), "periods": 20}
    for size, matters in ((0.007, False), (0.05, True)):
        rubbed = ("coulomb_friction", "knee", [size], {})
        found = compared(laboratory.record([rubbed], **quiet), laboratory.record(seed=11, **quiet))
        assert found.p_value < LEVEL
        assert (found.torque_change > SMALLEST_CHANGE) is matters
        assert found.changed is matters
        assert [(m.effect, m.joint) for m in found.missing] == [("coulomb_friction", "knee")] * matters


@pytest.mark.scenario
@pytest.mark.parametrize("motion", [0, 1])
def test_a_payload_is_found_within_its_uncertainty_and_alone(laboratory, recorded, compared, motion):
    found = compared(recorded([payload(laboratory)], motion=motion), recorded(seed=11))
    assert [(m.effect, m.joint) for m in found.missing] == [("payload", "ankle")]
    mass = found.missing[0].parameters[0]
    assert mass.unit == "kg"
    assert abs(mass.value - MASS) < 4.0 * mass.std
    assert mass.std < 0.05


@pytest.mark.scenario
def test_two_changes_are_told_apart_each_with_its_own_torque(laboratory, recorded, compared):
    rubbed = ("coulomb_friction", "knee", [1.0], {})
    found = compared(recorded([payload(laboratory), rubbed]), recorded(seed=11))
    by_name = {(m.effect, m.joint): m for m in found.missing}
    assert set(by_name) == {("payload", "ankle"), ("coulomb_friction", "knee")}
    friction = by_name["coulomb_friction", "knee"]
    assert abs(friction.parameters[0].value - 1.0) < 4.0 * friction.parameters[0].std
    assert friction.torque_share != by_name["payload", "ankle"].torque_share


@pytest.mark.scenario
def test_all_torque_constants_have_the_share_of_torque_that_they_changed_by(recorded, compared):
    recording = recorded()
    columns = {name: 1.03 * v if name.startswith("current_") else v for name, v in recording.columns.items()}
    found = compared(replace(recording, columns=columns), recorded(seed=11))
    assert [(m.effect, m.joint) for m in found.missing] == [("torque_constant", None)]
    change = found.missing[0].parameters[0]
    assert abs(change.value - 0.03) < 4.0 * change.std
    assert found.missing[0].torque_share == pytest.approx(0.03, rel=0.05)


@pytest.mark.scenario
def test_what_others_explain_as_well_is_not_listed_beside_them(recorded, compared):
    """A torque constant that both models lack looks like all of them, until what it does is found piece by piece."""
    found = compared(recorded([("torque_constant", "hip", [-0.03], {})]), recorded(seed=11))
    assert found.missing
    assert max(m.p_value for m in found.missing) < LEVEL
