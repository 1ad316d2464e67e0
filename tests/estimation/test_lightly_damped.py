"""A leg whose links swing on springs with hardly any damping: what reversals leave in every period biases nothing."""

import numpy as np
import pytest

from estimation.legs import SWINGING
from sea_ident.estimation import identify
from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording
from sea_ident.regressor import prior_parameters
from sea_ident.robot import load_robot
from sea_ident.simulation import FrictionJitter, SensorNoise, VelocityController, simulate

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
PERIODS, PERIOD, RATE = 7, 4.0, 500.0
SEEDS = range(12)
ENCODER, TORQUE = 1e-5, 0.02
"""Standard deviations of the noise [rad] and [N m]."""


@pytest.fixture(scope="module")
def leg(tmp_path_factory):
    file = tmp_path_factory.mktemp("leg") / "leg.urdf"
    file.write_text(SWINGING)
    return load_robot(file)


def repeated(leg, velocity_loop):
    """Recordings of one exact period again and again, each with other noise of the sensors."""
    rng, orders = np.random.default_rng(3), np.arange(1, 9)
    a, b = rng.standard_normal((2, leg.n, len(orders)))
    size = np.array([0.6, 0.7]) * 2.0 * np.pi / PERIOD / np.sqrt((a**2 + b**2).sum(axis=1))
    series = FourierSeries(1.0 / PERIOD, np.zeros(leg.n), a * orders * size[:, None], b * orders * size[:, None])
    exact = simulate(
        leg,
        series,
        periods=1,
        sensors=SensorNoise.none(),
        jitter=FrictionJitter.none(),
        controller=VelocityController(bandwidth=velocity_loop),
        rate=RATE,
    ).recording
    time = np.arange(PERIODS * len(exact.time)) / RATE
    found = []
    for seed in SEEDS:
        noise, columns = np.random.default_rng(seed), {}
        for joint in leg.joint_names:
            for kind, std in (("q", ENCODER), ("theta", ENCODER), ("tau_motor", TORQUE)):
                signal = np.tile(exact.columns[f"{kind}_{joint}"], PERIODS)
                columns[f"{kind}_{joint}"] = signal + std * noise.standard_normal(len(signal))
        found.append(Recording(time, columns, "simulated"))
    return found


@pytest.mark.scenario
@pytest.mark.parametrize("velocity_loop", [60.0, 200.0], ids=["slow drives", "fast drives"])
def test_values_are_off_by_no_more_than_they_say(leg, velocity_loop):
    models = [identify(leg, recording, period=PERIOD) for recording in repeated(leg, velocity_loop)]
    truth = models[0].base.project(np.nan_to_num(prior_parameters(leg, models[0].effects)))
    error, std = np.array([m.values - truth for m in models]), np.array([m.std for m in models])
    springs = np.array(
        [[(s.stiffness - leg.spring(s.joint).stiffness) / s.stiffness_std for s in m.springs] for m in models]
    )
    # of seven periods a standard deviation has six degrees of freedom, so that this is 1.22 where all is right
    assert np.sqrt(np.mean((error / std) ** 2)) < 1.45
    assert np.sqrt(np.mean(springs**2)) < 1.6
    # the mean of twelve is known to 0.29
    assert np.sqrt(np.mean((error.mean(axis=0) / std.mean(axis=0)) ** 2)) < 0.6
    # and they are as large as they have to be, not larger
    assert np.sqrt(np.mean(error**2 / np.mean(std**2, axis=0))) > 0.7
    assert not any("the model lacks something" in text for m in models for text in m.warnings)
