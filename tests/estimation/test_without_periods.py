"""A recording that does not repeat itself: noise of encoders in the inertias' columns must not bend the numbers."""

import numpy as np
import pytest

from sea_ident.estimation import identify
from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording
from sea_ident.robot import robot_from_text
from sea_ident.simulation import simulate

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")


def link(name, mass, reach):
    return (
        f'<link name="{name}"><inertial><origin xyz="{reach} 0 0"/><mass value="{mass}"/>'
        '<inertia ixx="0.002" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(name, parent, child, at, gear, rotor, friction, stiffness):
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{at} 0 0"/>'
        '<axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="6" effort="80"/></joint>'
        f'<transmission name="{name}_t" type="sea_ident/SeriesElastic"><joint name="{name}"/><actuator name="{name}_m">'
        f"<mechanicalReduction>{gear}</mechanicalReduction><torqueConstant>0.06</torqueConstant>"
        f"<rotorInertia>{rotor}</rotorInertia><viscousFriction>{friction}</viscousFriction>"
        f'<coulombFriction>{1.4 * friction}</coulombFriction></actuator><seriesElastic stiffness="{stiffness}" '
        'damping="0.7"/></transmission>'
    )


ARM = (
    '<robot name="arm"><link name="base"/>'
    + link("upper", 2.2, 0.15)
    + link("lower", 1.3, 0.12)
    + joint("shoulder", "base", "upper", 0.0, 80, 3e-5, 1.1, 500)
    + joint("elbow", "upper", "lower", 0.3, 60, 2e-5, 0.6, 250)
    + "</robot>"
)


@pytest.fixture(scope="module")
def arm():
    return robot_from_text(ARM, "arm")


@pytest.fixture(scope="module")
def recording(arm):
    rng = np.random.default_rng(2)
    a, b = 0.12 * rng.normal(size=(2, 2, 50))
    series = FourierSeries(0.05, np.array([0.2, -0.3]), a, b)
    whole = simulate(arm, series, periods=1, rate=500.0, seed=0).recording
    return whole.crop(0.0, 19.0)


def with_holes(recording):
    keep = np.ones(recording.samples, dtype=bool)
    keep[3000:3600] = keep[7000:7003] = False
    columns = {name: values[keep] for name, values in recording.columns.items()}
    return Recording(recording.time[keep], columns, "holes")


@pytest.mark.scenario
@pytest.mark.parametrize("change", [lambda whole: whole, with_holes], ids=["whole", "with holes"])
def test_inertias_of_rotors_and_springs_lie_within_their_deviations(arm, recording, change):
    model = identify(arm, change(recording))
    found = dict(zip(model.base.names, zip(model.values, np.sqrt(np.diag(model.covariance)), strict=True), strict=True))
    for name, truth in (("shoulder.rotor_inertia", 3e-5), ("elbow.rotor_inertia", 2e-5)):
        value, std = found[name]
        assert abs(value - truth) < 3.0 * std, name
    for spring, truth in zip(model.springs, (500.0, 250.0), strict=True):
        assert abs(spring.stiffness - truth) < 3.0 * spring.stiffness_std
