import pytest
from plants import modest_series

from sea_ident import FourierSeries, Robot, load_robot
from sea_ident.simulation import FrictionJitter, SensorNoise, Simulation, SmoothCoulomb, simulate


@pytest.fixture(scope="session")
def leg() -> Robot:
    return load_robot("exo_leg")


@pytest.fixture(scope="session")
def leg_series(leg) -> FourierSeries:
    return modest_series(leg)


@pytest.fixture(scope="session")
def quiet():
    """Options of a simulation without chance, whose friction is as smooth as the model's."""
    return {"sensors": SensorNoise.none(), "jitter": FrictionJitter.none(), "friction": SmoothCoulomb(0.01)}


@pytest.fixture(scope="session")
def exact(leg, leg_series, quiet) -> Simulation:
    return simulate(leg, leg_series, periods=2, **quiet)
