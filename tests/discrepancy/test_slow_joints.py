"""A slide that moves at centimetres per second: what is found of it is where it was put, as on any other joint."""

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.evidence.assess import detectability
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.search import search
from sea_ident.effects import make_effect
from sea_ident.estimation.identify import default_effects
from sea_ident.motion import FourierSeries
from sea_ident.simulation import FrictionJitter, PlantedEffect, SensorNoise, SmoothCoulomb, simulate

PERIOD, SMOOTHING = 5.0, 5e-4
AMPLITUDE = 0.03 * PERIOD / (2.0 * np.pi)
"""Of the slowest wave of the motion [m]."""

SIZE = 8.0
"""Of the friction that is found [N]."""

SENSORS = SensorNoise(
    link_position=1e-6, motor_position=1e-6, link_resolution=1e-6, motor_resolution=1e-6, current=0.0, motor_torque=0.1
)


def searched(name, values, **shape):
    """Bench and what is found there, of a slide with dry friction and something else."""
    with pytest.warns(sea_ident.SeaIdentWarning, match="no transmission"):
        axis = sea_ident.load_robot("emps")
    series = FourierSeries(
        1.0 / PERIOD, np.zeros(1), AMPLITUDE * np.array([[1.0, 0.0, 0.5]]), AMPLITUDE * np.array([[0.0, 0.4, 0.0]])
    )
    planted = [
        PlantedEffect(make_effect("coulomb_friction", "slider", smoothing=SMOOTHING), np.array([20.0])),
        PlantedEffect(make_effect("viscous_friction", "slider"), np.array([200.0])),
        PlantedEffect(make_effect(name, "slider", **shape), np.array(values)),
    ]
    recording = simulate(
        axis, series, periods=6, seed=3, sensors=SENSORS, jitter=FrictionJitter.none(), effects=planted,
        friction=(SmoothCoulomb(SMOOTHING),),
    ).recording  # fmt: skip
    processed = wide_processing(recording, axis, PERIOD)
    effects = default_effects(axis, processed)
    bench = Bench(period_data(processed, axis), effects)
    return bench, search(bench, effects)


def std_of(fit, name):
    """Standard deviation of a shape of the last effect, in the coordinates in which it is fitted."""
    shapes = [shape.name for _, shape in fit.free_shapes]
    return fit.std(len(fit.columns) + len(shapes) - 1 - shapes[::-1].index(name))


@pytest.mark.scenario
def test_friction_that_falls_within_millimetres_per_second_is_found():
    """It is over at 3 mm/s, where friction of a turning joint would only begin to be looked for."""
    _, found = searched("stribeck_friction", [SIZE], speed=0.003, smoothing=SMOOTHING)
    (friction,) = found.effects
    fit = found.final.fit
    assert friction.name == "stribeck_friction"
    assert np.log(friction.speed / 0.003) == pytest.approx(0.0, abs=4.0 * std_of(fit, "speed"))
    assert fit.parameters["slider.stribeck_friction"] == pytest.approx(SIZE, rel=0.02)
    assert fit.statistic < 1.5 * fit.dof


@pytest.mark.scenario
def test_a_wave_of_a_fine_screw_is_found_where_it_is():
    """2.4 mm a turn: no turning joint has as many waves in a radian as this has in a metre."""
    order = 2.0 * np.pi / 0.0024
    _, found = searched("torque_ripple", [1.0, 0.0], order=order)
    (ripple,) = found.effects
    fit = found.final.fit
    assert ripple.name == "torque_ripple"
    assert np.log(ripple.order / order) == pytest.approx(0.0, abs=4.0 * std_of(fit, "order"))
    assert fit.parameters["slider.torque_ripple_sine"] == pytest.approx(1.0, abs=0.03)


@pytest.mark.scenario
def test_what_friction_could_be_seen_is_said_of_speeds_that_the_slide_has():
    bench, found = searched("torque_offset", [1.0])
    fit, noise = found.final.fit, found.final.noise
    said = detectability(bench, fit, noise, scan(bench, fit, noise), (bench, found.final))
    friction = next(one for one in said if one.effect == "stribeck_friction")
    fastest = float(np.abs(bench.data.motion.dtheta).max())
    assert friction.shapes == (("speed", pytest.approx(0.1 * fastest, rel=0.02), "m/s"), ("exponent", 2.0, "-"))
    assert friction.smallest < SIZE
