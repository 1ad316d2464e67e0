"""What the motors were told to do: believed where it gives what was measured, whatever the noise."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.measured.data import wide_processing
from sea_ident.discrepancy.simulated.command import REPRODUCED, StandIn, command_of
from sea_ident.effects import base_effects, make_effect
from sea_ident.estimation import identify
from sea_ident.simulation import FrictionJitter, PlantedEffect, SensorNoise, VelocityController, simulate
from sea_ident.simulation.reference import PeriodicReference

PERIOD = 5.0
# a model that lacks something says so
pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")


@pytest.fixture(scope="module")
def noisy(leg, series):
    """Recording, model and processed recording of motors whose current is noisy."""
    recording = simulate(
        leg,
        series[0],
        periods=6,
        seed=4,
        sensors=SensorNoise(current=0.1, motor_torque=0.4),
        jitter=FrictionJitter.none(),
    ).recording
    return recording, identify(leg, recording, period=PERIOD), wide_processing(recording, leg, PERIOD)


def off(leg, controller, command, processed):
    """Share of the torque by which the mean of the periods is off."""
    time = np.arange(processed.samples) * (PERIOD / processed.samples)
    drive = controller.drive(leg, PeriodicReference(command.reference), time)
    motion = processed.motion
    torque = drive.bias - drive.position_gain * motion.theta - drive.velocity_gain * motion.dtheta
    wrong = np.sqrt(np.mean((torque - processed.tau_motor) ** 2, axis=0))
    return np.max(wrong / np.sqrt(np.mean(processed.tau_motor**2, axis=0)))


@pytest.mark.scenario
def test_noise_is_no_other_controller(leg, noisy):
    recording, model, processed = noisy
    command = command_of(model, recording, processed, None)
    assert off(leg, VelocityController(), command, processed) > 1.5 * REPRODUCED
    assert command.note == ""
    assert not isinstance(command, StandIn)
    # of one period its noise is not known
    one = replace(processed, period_motions=(processed.motion,), period_tau_motor=processed.tau_motor[None])
    assert "gives a torque that is" in command_of(model, recording, one, None).note


@pytest.mark.scenario
@pytest.mark.parametrize(
    "controller", [VelocityController(bandwidth=20.0, feedforward=0.0), VelocityController(bandwidth=45.0)]
)
def test_a_controller_that_does_not_give_the_measured_torque_is_not_believed(noisy, controller):
    recording, model, processed = noisy
    command = command_of(model, recording, processed, controller)
    assert "the given controller gives a torque that is" in command.note
    assert "stand in for the reference" in command.note
    assert isinstance(command, StandIn)


@pytest.mark.scenario
def test_the_torque_that_motors_gave_is_what_a_controller_must_give(leg, series):
    """Recorded late it is another one, unless the model knows how late."""
    late = make_effect("torque_delay", "hip", delay=0.06)
    planted = [PlantedEffect(late, np.zeros(0))]
    recording = simulate(leg, series[0], periods=4, effects=planted, jitter=FrictionJitter.none()).recording
    processed = wide_processing(recording, leg, PERIOD)
    for effects, believed in ((base_effects(leg), False), ((*base_effects(leg), late), True)):
        model = identify(leg, recording, effects=effects, period=PERIOD)
        assert (command_of(model, recording, processed, None).note == "") is believed
