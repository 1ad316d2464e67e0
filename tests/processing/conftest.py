"""A leg and its motion: shared by the tests of the processing."""

import pytest
from estimation.synthetic import leg_series, truth_of

from sea_ident.robot import load_robot


@pytest.fixture(scope="session")
def leg():
    return load_robot("exo_leg")


@pytest.fixture(scope="session")
def truth(leg):
    return truth_of(leg, leg_series())
