"""Models with an effect in the chain of signals: bodies, friction and springs are those of the robot all the same."""

import numpy as np
import pytest

import sea_ident
from sea_ident.effects import base_effects, make_effect
from sea_ident.estimation import identify
from sea_ident.processing import process
from sea_ident.regressor import build_regressor, build_total
from sea_ident.simulation import FrictionJitter, PlantedEffect, SensorNoise, plant_from_robot, simulate

PERIOD = 5.0
# without noise there is nothing to compare a residual with
pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
EFFECTS = (
    ("encoder_offset", {"offset": 0.02}),
    ("encoder_eccentricity", {"sine": 0.02, "cosine": -0.01}),
    ("position_delay", {"delay": 0.004}),
    ("torque_delay", {"delay": -0.012}),
)


@pytest.fixture(scope="module")
def leg():
    return sea_ident.load_robot("exo_leg")


@pytest.fixture(scope="module")
def series(leg):
    return sea_ident.design_excitation(leg, base_frequency=1 / PERIOD, harmonics=5, starts=1, seed=0).series


@pytest.fixture(scope="module", params=EFFECTS, ids=[name for name, _ in EFFECTS])
def case(request, leg, series):
    name, amounts = request.param
    effect = make_effect(name, "knee", **amounts)
    run = simulate(
        leg,
        series,
        periods=2,
        effects=[PlantedEffect(effect, np.zeros(0))],
        sensors=SensorNoise.none(),
        jitter=FrictionJitter.none(),
    )
    return (*base_effects(leg), effect), process(run.recording, leg, period=PERIOD)


@pytest.mark.scenario
def test_springs_are_those_of_the_robot(leg, case):
    effects, processed = case
    truth = plant_from_robot(leg)
    for i, spring in enumerate(identify(leg, processed, effects=effects).springs):
        far = spring.largest_deflection
        torque = truth.stiffness[i] * far + truth.cubic_stiffness[i] * far**3
        assert spring.stiffness * far + spring.cubic_stiffness * far**3 == pytest.approx(torque, rel=5e-3)
        assert spring.stiffness == pytest.approx(truth.stiffness[i], rel=5e-3)
        assert spring.damping == pytest.approx(truth.spring_damping[i], rel=0.05)


@pytest.mark.scenario
def test_friction_is_that_of_the_robot(leg, case):
    effects, processed = case
    truth = plant_from_robot(leg)
    model = identify(leg, processed, effects=effects)
    found = {p.name: p.value for p in model.parameters}
    for i, joint in enumerate(leg.joint_names):
        assert found[f"{joint}.coulomb_friction"] == pytest.approx(truth.coulomb_friction[i], rel=5e-3)
        assert found[f"{joint}.viscous_friction"] == pytest.approx(truth.viscous_friction[i], rel=1e-2)


@pytest.mark.scenario
def test_the_sum_of_both_rows_gives_the_torque_as_it_was_recorded(leg, case):
    effects, processed = case
    truth = plant_from_robot(leg).values_of(effects[:-1])
    regressor = build_regressor(leg, effects, processed.motion)
    np.testing.assert_allclose(regressor.sum, build_total(leg, effects, processed.motion), atol=1e-12)
    rms = np.sqrt(np.mean((regressor.sum @ truth - processed.tau_motor) ** 2, axis=0))
    assert np.all(rms < 0.02 * np.sqrt(np.mean(processed.tau_motor**2, axis=0)))
