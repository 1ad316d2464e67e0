"""Links on springs: their periodic motion is that of a simulation, and its slopes are those of differences."""

import numpy as np
import pytest
from soft_arms import soft_arm

from sea_ident.excitation.elastic_response import Springs, _Balance, elastic_response, padded, response_slopes
from sea_ident.excitation.springs import PredictedMotors
from sea_ident.motion import FourierSeries
from sea_ident.simulation import SensorNoise, Settling, simulate


def small_series(n, harmonics=4, size=0.3, base_frequency=0.2):
    coefficients = size * np.random.default_rng(3).normal(size=(n, 2 * harmonics + 1))
    return FourierSeries.from_coefficients(coefficients, base_frequency)


@pytest.mark.scenario
def test_links_go_where_a_simulation_takes_them():
    """The motors of a simulation are not quite where they should be, so that theirs are followed."""
    arm = soft_arm()
    run = simulate(arm, small_series(2), periods=1, sensors=SensorNoise.none(), settling=Settling(1e-7, 30), rate=100.0)
    motors = FourierSeries.fit(run.motion.time, run.motion.theta, 0.2, 20)
    found = elastic_response(Springs.of(arm), motors)
    assert np.abs(run.motion.q - run.motion.theta).max() > 0.1
    np.testing.assert_allclose(found.links.evaluate(run.motion.time), run.motion.q, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize("name", ["exo_leg", "baxter wrist"])
def test_link_rows_hold_between_the_samples_too(robot_of, name):
    robot = robot_of(name)
    springs = Springs.of(robot)
    response = elastic_response(springs, small_series(robot.n, size=0.1))
    missing, _, _ = springs.missing(response.motion(np.linspace(0.0, 5.0, 997)))
    assert (
        np.abs(missing).max() < 1e-3 * springs.stiffness.min() * np.abs(response.motion(np.zeros(1)).deflection).max()
    )


def test_a_large_motion_is_reached_by_growing():
    """Newton's method fails from theta = q: links swing by half a radian on their springs."""
    arm, series = soft_arm(40.0), small_series(2)
    springs = Springs.of(arm)
    balance = _Balance(springs, series, 12)
    assert balance.solve(1.0, balance.start) is None
    motion = elastic_response(springs, series).motion(np.linspace(0.0, 5.0, 200))
    bent = np.abs(motion.deflection).max()
    assert bent > 0.5
    assert np.abs(springs.missing(motion)[0]).max() < 0.02 * 40.0 * bent


def test_slopes_are_differences():
    springs = Springs.of(soft_arm())
    series = small_series(2)
    slopes = response_slopes(springs, elastic_response(springs, series))
    change = 1e-5 * np.random.default_rng(0).normal(size=series.coefficients.shape)
    there, back = (
        elastic_response(springs, FourierSeries.from_coefficients(series.coefficients + sign * change, 0.2)).links
        for sign in (1.0, -1.0)
    )
    difference = (there.coefficients - back.coefficients) / 2.0
    along = np.einsum("iwjv,jv->iw", slopes, change)
    np.testing.assert_allclose(along, difference, rtol=0.0, atol=1e-6 * np.abs(difference).max())


def test_links_on_unknown_springs_go_with_their_motors():
    arm = soft_arm(None)
    series = small_series(2)
    assert not len(Springs.of(arm).joints)
    np.testing.assert_array_equal(
        elastic_response(Springs.of(arm), series).links.coefficients, padded(series, 12).coefficients
    )
    given = PredictedMotors(stiffness={"shoulder": 80.0, "elbow": 20.0}).springs(arm)
    np.testing.assert_array_equal(Springs.of(arm, given).stiffness, [80.0, 20.0])


def test_lowest_frequency_is_that_of_a_pendulum_on_its_spring(robot_of):
    robot = robot_of("exo_leg")
    springs = Springs.of(robot)
    assert springs.lowest_frequency(np.array([0.3, -0.2, 0.5])) == pytest.approx(1.97, abs=0.1)
    softer = Springs.of(soft_arm(20.0)).lowest_frequency(np.zeros(2))
    assert Springs.of(soft_arm(80.0)).lowest_frequency(np.zeros(2)) == pytest.approx(2.0 * softer, rel=1e-9)
    assert Springs.of(soft_arm(None)).lowest_frequency(np.zeros(2)) == np.inf
