"""Limits hold where springs take the links, or it is said by how much they do not."""

import re

import numpy as np
import pytest
from soft_arms import soft_arm

from sea_ident.exceptions import ExcitationError, SeaIdentWarning
from sea_ident.excitation import LinksAsPlanned, LinksInside, design_excitation, read_excitation
from sea_ident.excitation.elastic_response import Springs, elastic_response
from sea_ident.excitation.linear_limits import linear_limits
from sea_ident.simulation import SensorNoise, VelocityController, simulate

SMALL = {"base_frequency": 0.2, "harmonics": 5, "starts": 1, "rate": 50.0}


@pytest.fixture(scope="module")
def arm():
    return soft_arm()


@pytest.fixture(scope="module")
def kept(arm):
    with pytest.warns(SeaIdentWarning, match="come near the 0.8561 Hz at which links swing"):
        return design_excitation(arm, **SMALL)


@pytest.mark.scenario
def test_limits_of_a_soft_arm_hold_in_simulation(arm, kept):
    """Between the samples of the design too, with motors that follow closely.

    A design for theta = q breaks the limits of accelerations many times over.
    """
    close = VelocityController(bandwidth=400.0, correction=40.0)
    run = simulate(arm, kept, periods=1, sensors=SensorNoise.none(), controller=close, rate=1000.0)
    limits = arm.limits
    assert np.all(run.motion.q >= limits.lower)
    assert np.all(run.motion.q <= limits.upper)
    assert np.all(np.abs(run.motion.dq) <= limits.velocity)
    assert np.all(np.abs(run.motion.ddq) <= limits.acceleration)
    assert np.all(np.abs(run.tau_motor) <= limits.torque)
    assert not any("limit is" in text for text in run.warnings)
    rigid = design_excitation(soft_arm(None), **SMALL)
    broken = simulate(arm, rigid.series, periods=1, sensors=SensorNoise.none(), controller=close)
    assert np.abs(broken.motion.ddq).max() > 3.0 * limits.acceleration.max()


@pytest.mark.scenario
def test_margins_told_are_those_of_links_and_motors(arm, kept):
    assert min(kept.margins.values()) >= 0.0
    response = elastic_response(Springs.of(arm), kept.series)
    limits, motion = linear_limits(arm, arm.limits), response.motion(np.linspace(0.0, 5.0, 50_001))
    for k, name in enumerate(limits.names):
        order = int(limits.derivative[k])
        links, motors = (
            (motion.q, motion.dq, motion.ddq)[order] @ limits.joints[k],
            (motion.theta, motion.dtheta, motion.ddtheta)[order] @ limits.joints[k],
        )
        both = np.concatenate([links, motors])
        nearest = min(both.min() - limits.lower[k], limits.upper[k] - both.max())
        assert kept.margins[name] == pytest.approx(nearest, abs=1e-5)
        assert kept.link_margins[name] >= kept.margins[name] - 1e-12
    assert kept.margins["shoulder.torque"] == kept.link_margins["shoulder.torque"]
    assert "shoulder.torque        [-60, 60]  margin at least" not in kept.summary()


def test_stiff_springs_change_nothing_and_nothing_is_said():
    rigid, stiff = (design_excitation(soft_arm(stiffness), **SMALL) for stiffness in (None, 20_000.0))
    np.testing.assert_array_equal(stiff.series.coefficients, rigid.series.coefficients)
    assert stiff.margins == rigid.margins
    assert stiff.warnings == rigid.warnings == ()
    assert rigid.link_margins == {}
    assert stiff.link_margins["elbow.acceleration"] == pytest.approx(rigid.margins["elbow.acceleration"], abs=0.05)


@pytest.mark.scenario
def test_links_that_sag_are_told_and_kept_where_that_is_asked_for(robot_of, tmp_path):
    """The harmonics stay away from the resonance: the design is the one for theta = q, and what it costs is said."""
    leg = robot_of("exo_leg")
    told = design_excitation(leg, harmonics=4, starts=2, rate=50.0)
    assert min(told.margins.values()) >= 0.0
    text = next(text for text in told.warnings if "springs take the links beyond" in text)
    missing = -told.link_margins["hip_knee_sum"]
    assert missing > 0.01
    assert f"hip_knee_sum by {missing:.3g} rad (limits 0.1 to inf)" in text
    assert "links=LinksInside()" in text
    told.save(tmp_path / "told.json")
    assert read_excitation(tmp_path / "told.json").link_margins == told.link_margins
    inside = design_excitation(leg, harmonics=4, starts=2, rate=50.0, links=LinksInside(reserve=0.0))
    assert min(*inside.margins.values(), *inside.link_margins.values()) >= 0.0
    assert inside.warnings == ()
    assert told.log_det - 3.0 < inside.log_det < told.log_det
    spare = design_excitation(leg, harmonics=4, starts=2, rate=50.0, links=LinksInside(reserve=0.1))
    assert spare.link_margins["hip.acceleration"] >= 0.1 * np.pi
    assert spare.log_det < inside.log_det


@pytest.mark.scenario
def test_links_that_would_leave_a_limit_far_are_kept_inside():
    """The harmonics stay away from the resonance, but the elbow would be accelerated half as much again."""
    arm = soft_arm(260.0)
    with pytest.warns(SeaIdentWarning, match=r"go with their motors, .* stay inside") as told:
        found = design_excitation(arm, **{**SMALL, "harmonics": 4})
    assert min(*found.margins.values(), *found.link_margins.values()) >= 0.0
    planned = design_excitation(arm, links=LinksAsPlanned(), **{**SMALL, "harmonics": 4})
    # how far hangs on that design, which is another one where numbers are rounded otherwise
    (beyond,) = re.findall(r"elbow.acceleration by (\S+) rad/s2", str(told[0].message))
    swings = elastic_response(Springs.of(arm), planned.series).motion(np.linspace(0.0, 5.0, 50_001)).ddq[:, 1]
    assert float(beyond) == pytest.approx(np.abs(swings).max() - arm.limits.acceleration[1], abs=0.01)
    assert float(beyond) > 0.4 * arm.limits.acceleration[1]
    assert planned.log_det - 3.0 < found.log_det < planned.log_det


@pytest.mark.scenario
def test_links_that_a_controller_moves_as_planned_are_not_asked_where_springs_take_them(arm):
    """The design is that for theta = q, also where links would swing, and nothing is said of springs."""
    planned = design_excitation(arm, links=LinksAsPlanned(), **SMALL)
    rigid = design_excitation(soft_arm(None), **SMALL)
    np.testing.assert_array_equal(planned.series.coefficients, rigid.series.coefficients)
    assert planned.link_margins == {}
    assert planned.warnings == ()


@pytest.mark.scenario
def test_links_that_cannot_be_kept_inside_are_said(arm):
    """At rest already the first spring lets its link sag by more than is left of the range."""
    with pytest.warns(SeaIdentWarning, match=r"no trajectory was found .* shoulder.position by .* Take wider limits"):
        found = design_excitation(arm, links=LinksInside(reserve=0.97), **SMALL)
    assert min(found.link_margins.values()) < 0.0


def test_requests_that_cannot_be_met(robot_of):
    with pytest.raises(ExcitationError, match=r"the reserve of the limits is 1.5; it must be from 0"):
        LinksInside(reserve=1.5)
    with pytest.raises(ExcitationError, match="links of shoulder, elbow go on their springs takes a stiffness"):
        design_excitation(soft_arm(None), links=LinksInside(), **SMALL)
    with pytest.raises(ExcitationError, match=r"no elastic joint; leave out links=LinksInside\(\)"):
        design_excitation(robot_of("ur10"), links=LinksInside(), **SMALL)
