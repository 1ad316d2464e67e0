"""A model identified from a short simulation, for all tests of the report."""

import warnings

import pytest

from sea_ident import FourierSeries, load_robot
from sea_ident.demo import gait
from sea_ident.estimation import Model, identify
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.simulation import simulate


@pytest.fixture(scope="session")
def leg_motion() -> FourierSeries:
    return gait()


@pytest.fixture(scope="session")
def leg_model(leg_motion) -> Model:
    robot = load_robot("exo_leg")
    recording = simulate(robot, leg_motion, periods=7, seed=3).recording
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return identify(robot, recording, period=leg_motion.period)
