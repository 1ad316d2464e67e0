"""A model without Coulomb friction and offset is given both where the data ask for them, and neither where not."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.search.base_model import completed, missing_friction
from sea_ident.simulation import plant_from_robot

SMALL = ("rigid_bodies", "rotor_inertia", "viscous_friction", "spring_stiffness", "spring_stiffening", "spring_damping")


def small(laboratory):
    """Bodies, rotors, springs and viscous friction only."""
    return tuple(effect for effect in laboratory.effects if effect.name in SMALL)


@pytest.fixture(scope="module")
def with_offset(laboratory):
    return laboratory.record([("torque_offset", "ankle", [1.5], {})])


def test_coulomb_friction_and_offset_are_named(laboratory, with_offset):
    found = completed(laboratory.bench(with_offset, small(laboratory)))
    added = {(e.name, e.joint) for e in found.selection.effects}
    assert added == {
        ("coulomb_friction", "hip"),
        ("coulomb_friction", "knee"),
        ("coulomb_friction", "ankle"),
        ("torque_offset", "ankle"),
    }
    assert len(found.selection.p_values) == 4
    assert max(found.selection.p_values) < 1e-3
    assert "no coulomb_friction at hip" in found.warnings[0]


def test_with_their_values(laboratory, with_offset):
    fit = completed(laboratory.bench(with_offset, small(laboratory))).selection.final.fit
    for k, joint in enumerate(laboratory.leg.joint_names):
        true = plant_from_robot(laboratory.leg).coulomb_friction[k]
        assert fit.parameters[f"{joint}.coulomb_friction"] == pytest.approx(true, rel=0.1)
    assert fit.parameters["ankle.torque_offset"] == pytest.approx(1.5, abs=0.15)


def test_what_looks_the_same_in_this_motion_is_said(laboratory, with_offset):
    warnings = completed(laboratory.bench(with_offset, small(laboratory))).warnings
    assert all("torque_offset at ankle may as well be" in text for text in warnings[1:])


def test_a_whole_model_is_left_alone(laboratory, with_offset):
    assert completed(laboratory.bench(with_offset)) is None


def test_a_leg_without_friction_asks_for_none(laboratory):
    plant = plant_from_robot(laboratory.leg)
    smooth = plant.replace(coulomb_friction=np.zeros(laboratory.leg.n))
    recording = laboratory.record(plant=smooth)
    assert completed(laboratory.bench(recording, small(laboratory))) is None


def test_only_the_joint_that_lacks_its_friction_gets_one(laboratory, with_offset):
    """Of offsets too: where a joint has its friction, an offset is looked for with all other effects."""
    effects = (
        *small(laboratory),
        *(e for e in laboratory.effects if e.name == "coulomb_friction" and e.joint != "hip"),
    )
    bench = laboratory.bench(with_offset, effects)
    assert missing_friction(bench.effects, laboratory.leg.joint_names) == (("coulomb_friction", "hip"),)
    added = {(e.name, e.joint) for e in completed(bench).selection.effects}
    assert ("coulomb_friction", "hip") in added
    assert {joint for _, joint in added} == {"hip"}


def test_missing_friction_asks_for_both_at_every_joint(laboratory):
    without = tuple(e for e in laboratory.effects if (e.name, e.joint) != ("viscous_friction", "knee"))
    without = tuple(replace(e) for e in without if (e.name, e.joint) != ("coulomb_friction", "ankle"))
    assert missing_friction(without, laboratory.leg.joint_names) == (
        ("viscous_friction", "knee"),
        ("coulomb_friction", "ankle"),
    )
