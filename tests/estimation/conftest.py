import warnings

import pytest

from estimation.synthetic import Truth, leg_series, truth_of
from sea_ident.robot import Robot, load_robot


@pytest.fixture(scope="session")
def leg() -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load_robot("exo_leg")


@pytest.fixture(scope="session")
def truth(leg: Robot) -> Truth:
    return truth_of(leg, leg_series())


@pytest.fixture(scope="session")
def coarse(leg: Robot) -> Truth:
    """The same motion with fewer samples, for tests that need many recordings."""
    return truth_of(leg, leg_series(), samples=500)
