"""Errors that are the same in every period: no average takes them away, and no spread between periods shows them."""

import numpy as np
import pytest

from estimation.synthetic import record
from sea_ident.estimation import identify, repeated_steps
from sea_ident.processing import process
from sea_ident.processing.encoder_steps import step_of
from sea_ident.processing.harmonics import within
from sea_ident.recordings import Recording

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")

STEP = 2.0 * np.pi / 2**14


def rounded(leg, truth, seed, step):
    """A recording whose encoders have steps, and hardly any noise that would make them average out."""
    fine = record(leg, truth, 8, seed=seed, torque_noise=0.05, encoder_noise=0.1 * step)
    columns = {
        name: np.round(values / step) * step if name.startswith(("q_", "theta_")) else values
        for name, values in fine.columns.items()
    }
    return Recording(fine.time, columns, "rounded")


def test_steps_are_found_in_counts_and_not_in_noise():
    rng = np.random.default_rng(0)
    values = np.sin(np.linspace(0.0, 40.0, 4000)) + 1e-4 * rng.standard_normal(4000)
    assert step_of(values) == 0.0
    assert step_of(np.round(values / STEP) * STEP) == pytest.approx(STEP)
    assert step_of(np.zeros(10)) == 0.0


def test_steps_that_repeat_are_told_and_counted(leg, truth):
    outside = []
    for seed in range(3):
        recording = rounded(leg, truth, seed, STEP)
        processed = process(recording, leg, period=10.0)
        assert processed.encoder_steps is not None
        np.testing.assert_allclose(processed.encoder_steps.motor, STEP, rtol=1e-9)
        model = identify(leg, processed)
        assert any("encoder steps do not average out" in text for text in model.warnings)
        outside.extend(abs(s.stiffness - leg.spring(s.joint).stiffness) > s.half_width()[0] for s in model.springs)
        # what a repetition does not show counts, too
        assert np.all(model.std > np.sqrt(np.diag(model.uncertainty.repeatability)))
    # nine intervals of 95 %: three or more outside are chance in one case of a hundred
    assert sum(outside) <= 2


def test_what_steps_change_is_seen_in_a_few_periods(leg, truth, monkeypatch):
    """The same errors in all periods change the estimate by the same."""
    processed = process(rounded(leg, truth, 0, STEP), leg, period=10.0)
    assert processed.periods > repeated_steps.FEW
    few = identify(leg, processed)
    monkeypatch.setattr(repeated_steps, "FEW", processed.periods)
    whole = identify(leg, processed)
    more = [np.diag(m.uncertainty.covariance - m.uncertainty.repeatability) for m in (few, whole)]
    assert np.all(more[1] > 0.0)
    np.testing.assert_allclose(np.sqrt(more[0]), np.sqrt(more[1]), rtol=0.1)
    known = [[s.stiffness_std for s in m.springs] for m in (few, whole)]
    np.testing.assert_allclose(*known, rtol=0.1)


def test_steps_below_the_noise_average_out(leg, truth):
    fine = record(leg, truth, 8, seed=1, torque_noise=0.05, encoder_noise=2.0 * STEP)
    columns = {
        name: np.round(values / STEP) * STEP if name.startswith(("q_", "theta_")) else values
        for name, values in fine.columns.items()
    }
    assert process(Recording(fine.time, columns, "dithered"), leg, period=10.0).encoder_steps is None


def test_harmonics_within_are_a_projection():
    rng = np.random.default_rng(2)
    a, b = rng.standard_normal((2, 200, 3))
    once = within(a, 20)
    np.testing.assert_allclose(within(once, 20), once, atol=1e-12)
    assert np.sum(once * b) == pytest.approx(np.sum(a * within(b, 20)))
    assert np.array_equal(within(a, 0), a)
