"""A motor whose transmission passes another joint: where its friction turns says by how much."""

import warnings

import pytest

import sea_ident
from sea_ident.discrepancy import Verdict
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.simulation import FrictionJitter, SmoothCoulomb

PERIOD = 5.0


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("joint", "other", "ratio"), [("hip", "knee", -0.22), ("knee", "ankle", 0.4), ("ankle", "knee", 1.0)]
)
def test_a_large_ratio_is_told_by_where_the_friction_of_the_motor_turns(laboratory, joint, other, ratio):
    """Not by how large its friction is there: followed from fit to fit, that led a fifth of the coupling astray."""
    leg = laboratory.leg
    effect = make_effect("transmission_coupling", joint, other=other, smoothing=0.004)
    coupled = [(effect, effect.planted(leg, ratio))]
    law, jitter = SmoothCoulomb(0.004), FrictionJitter(0.05, 0.05)
    recording, holdout = (
        laboratory.record(coupled, seed=seed, motion=motion, friction=law, jitter=jitter)
        for seed, motion in ((3, 0), (4, 1))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = sea_ident.identify(leg, recording, period=PERIOD)
        found = sea_ident.diagnose(model, recording, holdout=holdout, period=PERIOD)
    assert [(m.effect, m.joint) for m in found.missing] == [("transmission_coupling", joint)]
    assert found.verdict is Verdict.NAMED
    told = {p.name: p for p in found.missing[0].parameters}
    turns = told[f"{joint}.transmission_coupling_ratio"]
    assert turns.unit == "-"
    assert abs(turns.value - ratio) < 4.0 * turns.std < 0.05
    actuator = leg.joints[leg.index(joint)].actuator
    friction = told[f"{joint}.transmission_coupling_coulomb_from_{other}"]
    assert abs(friction.value - ratio * actuator.coulomb_friction) < 4.0 * friction.std
