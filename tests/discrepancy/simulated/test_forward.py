"""The gap in forward simulation, against truth."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.measured.data import wide_processing
from sea_ident.discrepancy.simulated.command import command_of
from sea_ident.discrepancy.simulated.forward import (
    Present,
    SameDrive,
    ScaledDrive,
    simulated,
    simulation_gap,
    stride_of,
)
from sea_ident.effects import base_effects, make_effect
from sea_ident.estimation import identify
from sea_ident.simulation import Controller, FrictionJitter, PlantedEffect, SensorNoise, VelocityController, simulate
from sea_ident.simulation.reference import PeriodicReference

PERIOD = 5.0
# without noise there is nothing to compare a residual with, and a model that lacks something says so
pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")


def exact(leg, series, planted, periods=2, rate=200.0, **options):
    return simulate(
        leg,
        series,
        periods=periods,
        effects=planted,
        sensors=SensorNoise.none(),
        jitter=FrictionJitter.none(),
        rate=rate,
        **options,
    ).recording


def without_reference(recording):
    columns = {name: values for name, values in recording.columns.items() if "reference" not in name}
    return type(recording)(recording.time, columns, recording.source)


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "amounts"),
    [
        ("encoder_offset", {"offset": 0.02}),
        ("motor_encoder_offset", {"offset": 0.02}),
        ("joint_offset", {"offset": 0.2}),
        ("position_delay", {"delay": 0.004}),
        ("position_delay", {"delay": 0.01, "lag": 0.008}),
        ("torque_delay", {"delay": -0.012}),
    ],
)
def test_a_model_with_the_true_error_of_a_sensor_simulates_what_was_recorded(leg, series, name, amounts):
    effect = make_effect(name, "knee", **amounts)
    training, other = (exact(leg, each, [PlantedEffect(effect, np.zeros(0))]) for each in series)
    models = [
        identify(leg, training, effects=effects, period=PERIOD)
        for effects in (base_effects(leg), (*base_effects(leg), effect))
    ]
    recording = without_reference(other) if name == "torque_delay" else other
    found = simulation_gap(*models, recording, wide_processing(recording, leg, PERIOD))
    assert found.gaps["q"].shrink > 0.85
    assert found.gaps["q"].before["knee"] > 1e-4
    # the leg records currents, of which the torque follows as late as they are
    if name == "torque_delay":
        assert found.gaps["tau"].before["knee"] > 0.02
        assert found.gaps["tau"].after["knee"] < 0.3 * found.gaps["tau"].before["knee"]


@pytest.mark.scenario
@pytest.mark.parametrize("reference", [True, False])
def test_of_many_samples_a_second_as_many_are_simulated_as_are_usual(leg, series, reference):
    """To the same gap as one of the recording taken at that rate."""
    effect = make_effect("stribeck_friction", "knee", speed=0.1)
    gaps = []
    for rate in (200.0, 1000.0):
        training, other = (exact(leg, each, [PlantedEffect(effect, np.array([0.8]))], rate=rate) for each in series)
        models = [
            identify(leg, training, effects=effects, period=PERIOD)
            for effects in (base_effects(leg), (*base_effects(leg), effect))
        ]
        recording = other if reference else without_reference(other)
        processed = wide_processing(recording, leg, PERIOD)
        gaps.append(simulation_gap(*models, recording, processed).gaps["q"])
    assert stride_of(processed) == 5
    run = simulated(models[1], command_of(models[1], recording, processed, None), processed)
    assert {len(values) for values in run.values()} == {processed.samples // 5}
    there, late = (np.linalg.norm(run["q"] - np.roll(processed.motion.q, k, axis=0)[::5]) for k in (0, 5))
    assert there < 0.1 * late
    assert gaps[1].before["knee"] == pytest.approx(gaps[0].before["knee"], rel=0.1)


@pytest.mark.scenario
def test_what_is_within_the_noise_is_no_gap_and_it_is_said(leg, series):
    sensors = SensorNoise(link_position=1e-3)
    recording = simulate(leg, series[0], periods=4, sensors=sensors, jitter=FrictionJitter.none()).recording
    model = identify(leg, exact(leg, series[0], ()), period=PERIOD)
    changed = [replace(c, smoothing=0.011) if c.name == "coulomb_friction" else c for c in model.effects]
    other = replace(model, effects=tuple(changed))
    found = simulation_gap(other, model, recording, wide_processing(recording, leg, PERIOD))
    assert set(found.gaps["q"].before.values()) == {0.0}
    assert found.gaps["q"].summary().count("within the noise") == leg.n
    assert "nothing can be said" in found.notes[-1]


@pytest.mark.scenario
def test_where_a_spring_with_dry_friction_rests_is_no_gap(leg, series):
    """It was loaded otherwise before the recording began: a constant in q that no model of the motion can tell."""
    effect = make_effect("spring_hysteresis", "knee", slip=0.005)
    planted = [PlantedEffect(effect, np.array([0.8, 0.8]))]
    training, other = (exact(leg, each, planted) for each in series)
    models = [
        identify(leg, training, effects=effects, period=PERIOD)
        for effects in (base_effects(leg), (*base_effects(leg), effect))
    ]
    shifted = {f"q_{name}": other.columns[f"q_{name}"] + 5e-4 for name in ("knee", "ankle")}
    moved = replace(other, columns={**other.columns, **shifted})
    gap = simulation_gap(*models, moved, wide_processing(moved, leg, PERIOD)).gaps["q"]
    assert gap.before["knee"] > 1e-4
    assert gap.after["knee"] < 0.2 * gap.before["knee"]
    # at a joint without such a spring it is a gap
    assert gap.after["ankle"] == pytest.approx(5e-4, rel=0.1)


class Counting(Controller):
    """The velocity controller, and how often it was asked."""

    def __init__(self):
        self.asked = 0

    def drive(self, robot, reference, time):
        self.asked += 1
        return VelocityController().drive(robot, reference, time)


def test_a_drive_is_worked_out_once_for_the_same_robot_reference_and_times(leg, series):
    asked, time = Counting(), np.linspace(0.0, 1.0, 20)
    same, reference = SameDrive(asked), PeriodicReference(series[0])
    first = same.drive(leg, reference, time)
    assert same.drive(leg, PeriodicReference(series[0]), time.copy()) is first
    assert asked.asked == 1
    for other, times in ((reference, time + 0.1), (PeriodicReference(series[1]), time)):
        drive = same.drive(leg, other, times)
        np.testing.assert_array_equal(drive.bias, VelocityController().drive(leg, other, times).bias)
    assert asked.asked == 3


@pytest.mark.scenario
@pytest.mark.parametrize("saturates", [False, True])
def test_motors_that_give_less_than_is_recorded_are_simulated_so(leg, series, saturates):
    """The record alone is of another size: what acts by the torque of the motor acts by what it gives."""
    planted = [PlantedEffect(make_effect("torque_saturation", "knee"), np.array([1e-4]))] if saturates else []
    effects = (*base_effects(leg), *(each.effect for each in planted))
    model = identify(leg, exact(leg, series[0], planted), effects=effects, period=PERIOD)
    shares = np.array([1.0, 0.95, 1.0])
    controller = ScaledDrive(VelocityController(), shares)
    weak = exact(leg, series[1], planted, controller=controller)
    columns = {**weak.columns, "current_knee": weak.columns["current_knee"] / shares[1]}
    recording = replace(weak, columns=columns)
    given = (model, model, recording, wide_processing(recording, leg, PERIOD))
    gaps = simulation_gap(*given, VelocityController(), Present((), shares)).gaps
    # beside a saturation a reversal falls on a sample, of whose current nobody knows which way the gear turned
    for kind in ("q", "theta") if saturates else ("q", "theta", "tau"):
        assert gaps[kind].after["knee"] < 0.05 * gaps[kind].before["knee"], kind
