"""Models on every period: all of them together are what each is by itself."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.free_shapes import moving, signal_effects
from sea_ident.discrepancy.bench.periods import model_torque, torques_of
from sea_ident.discrepancy.measured.data import towards
from sea_ident.effects import Contribution, State, corrected_motion, make_effect
from sea_ident.effects.spring_hysteresis import SpringHysteresis


@pytest.fixture(scope="module")
def bench(laboratory):
    return laboratory.bench(laboratory.record(periods=7))


def of_each(bench, fit):
    """(N', P + 1, E) torque of the mean and of every period, one after the other and effect by effect."""
    data, signals = bench.data, signal_effects(fit.effects)
    acting = torques_of(fit.effects, fit.parameters, bench.robot)
    found = []
    for motion in (data.motion, *towards(data.motion, data.period_motions, 1.0 / np.sqrt(data.periods))):
        thin = corrected_motion(bench.robot, moving(signals), motion)[:: bench._periods._stride]
        channels = {kind: values[:: bench._periods._stride] for kind, values in data.channels.items()}
        nothing = Contribution(*np.zeros((2, len(thin), bench.robot.n)))
        total = model_torque(nothing, acting, signals, State(bench.robot, thin, channels))
        found.append(data.rows(total))
    return np.stack(found, axis=1)


@pytest.mark.scenario
def test_periods_together_are_each_by_itself(bench):
    """Beside errors of sensors and without, with what remembers its path; the first is kept while the next is made."""
    memory = SpringHysteresis("knee", 0.002)
    late = make_effect("position_delay", "hip", delay=0.003), make_effect("torque_delay", "knee", delay=0.004)
    for more in [(), (memory,), late, (memory, *late)]:
        effects = (*bench.effects, *more)
        values = {column.name: bench.first_fit.parameters.get(column.name, 3.0) for column in bench.labels(effects)}
        fit = bench.predicted(effects, values)
        expected = of_each(bench, fit)
        whole = np.concatenate([bench._periods.torque(fit, half) for half in (range(3), range(3, 8))], axis=1)
        np.testing.assert_allclose(whole, expected, atol=1e-6 * np.max(np.abs(expected)))
        # and what is not in the model is seen
        assert not np.allclose(whole, of_each(bench, bench.first_fit), atol=1e-6) or not more
