"""One stretch: what a model leaves of it is its noise, and an effect is one that predicts blocks from other blocks."""

import warnings

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.bench.stretch import BLOCKS, StretchBench, block_errors, full_residual, stretch_data
from sea_ident.discrepancy.measured.data import spectrum
from sea_ident.discrepancy.measured.pushes import find_pushes
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.processing import filter_recording

pytestmark = pytest.mark.filterwarnings("ignore:.*no period.*:sea_ident.exceptions.SeaIdentWarning")

FORCE = 12.0
BEGIN, END = 11.0, 11.3


def stretch(laboratory, recording):
    return StretchBench(stretch_data(filter_recording(recording, laboratory.leg), laboratory.leg), laboratory.effects)


@pytest.fixture(scope="module")
def clean(laboratory):
    bench = stretch(laboratory, laboratory.record(periods=4))
    return bench, bench.fit(bench.effects, None, tangents=False)


@pytest.fixture(scope="module")
def cogging(laboratory):
    bench = stretch(laboratory, laboratory.record([("torque_ripple", "hip", [2.0, 1.0], {"order": 4.0})], periods=4))
    return bench, bench.fit(bench.effects, None, tangents=False)


@pytest.mark.scenario
def test_what_is_left_is_the_noise_and_never_too_large(clean, cogging):
    for bench, fit in (clean, cogging):
        again = bench.fit(fit.effects, bench.noise(fit), start=fit.parameters)
        assert 0.3 < again.statistic / again.dof < 1.15


@pytest.mark.scenario
def test_the_residual_in_time_is_what_the_equations_of_a_joint_sum_up_to(clean):
    bench, fit = clean
    whole = spectrum(full_residual(bench, fit), bench.data.harmonics)
    for i, joint in enumerate(bench.robot.joint_names):
        own = [e for e, equation in enumerate(bench.data.equations) if equation.joint == joint]
        np.testing.assert_allclose(whole[:, i], fit.residual[:, own].sum(axis=1), atol=1e-9)


@pytest.mark.scenario
def test_an_effect_that_is_there_predicts_blocks_that_were_not_used(cogging):
    bench, fit = cogging
    noise = bench.noise(fit)
    without = block_errors(bench, fit.effects, noise)
    with_it = block_errors(bench, (*fit.effects, make_effect("torque_ripple", "hip", order=4.0)), noise)
    assert len(without) == BLOCKS
    assert np.count_nonzero(with_it < without) >= 10
    assert with_it.sum() < 0.8 * without.sum()


@pytest.mark.scenario
def test_an_effect_that_is_not_there_predicts_no_better(clean):
    bench, fit = clean
    noise = bench.noise(fit)
    without = block_errors(bench, fit.effects, noise)
    with_it = block_errors(bench, (*fit.effects, make_effect("torque_ripple", "hip", order=4.0)), noise)
    assert with_it.sum() > 0.97 * without.sum()
    # blocks tell of the others: an effect that is fitted is paid for where it was not
    assert np.count_nonzero(with_it < without) < 10


@pytest.mark.scenario
def test_every_block_counts_what_is_in_it(clean):
    """A torque that the model does not have, in one block alone."""
    bench, fit = clean
    noise = bench.noise(fit)
    samples = bench.data.samples
    edges = np.linspace(0, samples, BLOCKS + 1).astype(int)
    rows = np.zeros((samples, len(bench.data.equations)))
    middle = slice(edges[7] + (edges[8] - edges[7]) // 4, edges[8] - (edges[8] - edges[7]) // 4)
    rows[middle, 0] = 5.0 * np.sin(np.linspace(0.0, 12.0 * np.pi, middle.stop - middle.start))
    before = block_errors(bench, fit.effects, noise)
    target = bench._target
    try:
        bench._target = target + spectrum(rows, bench.data.harmonics)
        after = block_errors(bench, fit.effects, noise)
    finally:
        bench._target = target
    assert np.argmax(after - before) == 7
    assert after[7] > 10.0 * before[7]


@pytest.mark.scenario
def test_a_planted_push_is_found_and_a_clean_stretch_has_none(laboratory, clean):
    bench, fit = clean
    motion = bench.data.motion
    passes = round(5.0 / (motion.time[1] - motion.time[0]))
    # friction at one reversal of four may differ for a sample; nothing pushes for longer
    assert all(p.start == p.stop for p in find_pushes(motion.time, full_residual(bench, fit), motion.dtheta, passes))
    push = ("external_force", "knee", [FORCE, 0.0, FORCE], {"start": BEGIN, "stop": END})
    spoiled = stretch(laboratory, laboratory.record([push], periods=4))
    found = find_pushes(
        spoiled.data.motion.time,
        full_residual(spoiled, spoiled.fit(spoiled.effects, None, tangents=False)),
        spoiled.data.motion.dtheta,
        passes,
    )
    found = [p for p in found if p.stop > p.start]
    assert found
    # filtered differentiation spreads an edge over some samples
    assert all(BEGIN - 0.1 < p.start < END + 0.1 for p in found)
    assert min(p.start for p in found) == pytest.approx(BEGIN, abs=0.05)


@pytest.mark.scenario
def test_sizes_and_shapes_from_one_stretch_have_standard_deviations_that_hold(laboratory):
    recording = laboratory.record([("torque_ripple", "hip", [2.0, 1.0], {"order": 4.0})], periods=1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = sea_ident.diagnose(sea_ident.identify(laboratory.leg, recording), recording)
    assert [(m.effect, m.joint) for m in found.missing] == [("torque_ripple", "hip")]
    parameters = {p.name.rpartition("_")[2]: p for p in found.missing[0].parameters}
    for name, truth in (("sine", 2.0), ("cosine", 1.0), ("order", 4.0)):
        assert 0.0 < parameters[name].std < 0.2
        assert abs(parameters[name].value - truth) < 4.0 * parameters[name].std
