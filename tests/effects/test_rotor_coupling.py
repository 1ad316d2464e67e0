"""The coupling of a rotor is seen where a joint before it turns it about its own axis, and only there."""

import numpy as np
import pytest

from sea_ident.base_parameters import random_motion
from sea_ident.effects import Anchor, State, make_effect
from sea_ident.robot import load_robot

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")

BAXTER = "example:baxter_description/urdf/baxter.urdf"


def coupling(robot, joint):
    """Link and motor rows (N, n) of a coupling of 1 kg m2."""
    rows = make_effect("rotor_coupling", joint).evaluate(State(robot, random_motion(robot, samples=40, seed=4)))
    return rows.link[:, :, 0], rows.motor[:, :, 0]


def test_a_rotor_across_the_only_axis_before_it_has_no_coupling():
    """The first joint turns about the vertical, the rotor of the second lies: what rounding leaves is no column."""
    arm = load_robot(BAXTER, "baxter_sea", ("left_s0", "left_s1", "left_e0"))
    for part in coupling(arm, "left_s1"):
        assert np.all(part == 0.0)
    # two axes before it, and the upper arm turns about that of the third where it hangs or stands
    assert np.abs(coupling(arm, "left_e0")[1]).max() > 1e-3


def test_coupling_of_a_planar_rotor_is_its_spin_times_the_acceleration_of_the_links_before_it():
    """All axes parallel, nothing gyroscopic: S q'' on the motor, S^T theta'' and the carried inertia on the links."""
    leg = load_robot("exo_leg")
    motion = random_motion(leg, samples=40, seed=4)
    link, motor = coupling(leg, "ankle")
    (k,) = [k for k, rotor in enumerate(leg.rotors) if rotor.joint == "ankle"]
    column = leg.extended_model.joints[int(leg.rotor_indices[k])].idx_v
    place = leg.index("ankle")
    spin, before = leg.motor_map[column, place], motion.ddq[:, :place].sum(axis=1)
    np.testing.assert_allclose(motor[:, place], spin * before, rtol=1e-9)
    np.testing.assert_allclose(motor[:, :place], 0.0, atol=1e-12)
    whole = before + spin * motion.ddtheta[:, place]
    np.testing.assert_allclose(link[:, :place], np.stack([whole, whole], axis=1), rtol=1e-9)
    np.testing.assert_allclose(link[:, place:], 0.0, atol=1e-12)


def test_a_carrier_turns_its_rotor_no_more_than_a_few_times():
    """What couples two joints by more is a transmission, which has the same columns but for a small one."""
    leg = load_robot("exo_leg")
    free = make_effect("rotor_coupling", "knee")
    assert free.plausible(np.array([1.0]), {})
    found = free.anchored(Anchor(leg, (), {"motor.rotor_inertia": 2.2e-5}))
    # a gear that turns the other way, and a belt that adds a third of another joint after a gear of 100
    assert found.plausible(np.array([-4.4e-5]), {})
    assert not found.plausible(np.array([7e-4]), {})
