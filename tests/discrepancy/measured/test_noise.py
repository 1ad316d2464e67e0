"""The noise floor of synthetic scatter is the scatter that was put in, and of a leg that lacks nothing it is right."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from sea_ident.discrepancy.bench.lack import lack_of_fit
from sea_ident.discrepancy.bench.linear import off, whiten
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.measured.closing import closing_weights, successive
from sea_ident.discrepancy.measured.data import spectrum
from sea_ident.discrepancy.measured.noise import (
    closed_freedom_of_many,
    leverage_of,
    noise_beside_model,
    noise_directions,
    noise_from_steps,
    stacked,
    step_freedom,
    unstacked,
)
from sea_ident.effects import make_effect
from sea_ident.effects.base import Effect
from sea_ident.effects.torque_delay import TorqueDelay
from sea_ident.simulation import plant_from_robot

HARMONICS = 150
DRAWS = 400


def beside(steps, plain, each, basis):
    """Noise floor beside what an orthonormal basis takes up."""
    left = off(basis, whiten(plain.whitener(), steps.transpose(1, 2, 0)))
    return noise_beside_model(left, plain, each, leverage_of(basis, plain.equations))


def scatter(rng, periods, mixing, offset=0.0):
    """(P, H + 1, E) coefficients of periods whose real components have the covariance mixing mixing'."""
    count = len(mixing)
    shape = (periods, HARMONICS + 1, count)
    values = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) @ mixing.T
    values[:, 0] = values[:, 0].real
    return values + offset


def steps_of(periods):
    """Differences of successive periods over the root of two."""
    return np.diff(periods, axis=0) / np.sqrt(2.0)


MIXING = np.array([[1.0, 0.0, 0.0], [0.8, 0.5, 0.0], [-0.02, 0.01, 0.03]])


def test_covariance_of_the_mean():
    found = noise_from_steps(steps_of(scatter(np.random.default_rng(1), 12, MIXING)), 12, step_freedom(12))
    middle = np.mean(found.covariance[1:], axis=0)
    np.testing.assert_allclose(middle, MIXING @ MIXING.T / 12, atol=0.15 * np.linalg.norm(MIXING @ MIXING.T) / 12)
    # a real number for the constant, two for every harmonic
    power = (2 * HARMONICS + 1) * np.diag(MIXING @ MIXING.T) / 12
    np.testing.assert_allclose(found.std, np.sqrt(power), rtol=0.1)


def test_a_drift_is_no_noise():
    quiet = scatter(np.random.default_rng(1), 12, MIXING)
    drift = 5.0 * np.linspace(-1.0, 1.0, 12)[:, None, None]
    drifting, plain = (noise_from_steps(steps_of(each), 12, step_freedom(12)) for each in (quiet + drift, quiet))
    # around their mean the periods are spread by three
    assert np.all(drifting.std < 1.6 * plain.std[0] + plain.std)
    assert np.std(drift) > 3.0


@pytest.mark.parametrize("periods", [8, 20])
def test_whitened_means_have_unit_variance(periods):
    rng, values = np.random.default_rng(2), []
    for _ in range(6):
        each = scatter(rng, periods, MIXING)
        whitener = noise_from_steps(steps_of(each), periods, step_freedom(periods)).whitener()
        values.append(stacked(np.matmul(whitener, each.mean(axis=0)[:, :, None])[:, :, 0]))
    assert np.mean(np.concatenate(values) ** 2) == pytest.approx(1.0, abs=0.12)


@pytest.mark.parametrize("equations", [3, 6, 14])
@pytest.mark.parametrize("periods", [8, 10, 20])
def test_what_a_model_leaves_of_means_that_close_has_unit_variance(equations, periods):
    """Many equations and few periods, noise that grows with the harmonics, a floor in two rounds beside a model."""
    rng, harmonics, width, ratios = np.random.default_rng([equations, periods]), 80, 30, []
    rise = 1.0 + (np.arange(harmonics + 1) / (0.3 * harmonics))[:, None, None] ** 2
    mixing = rise * (np.eye(equations) + 0.5 * rng.standard_normal((equations, equations)) / np.sqrt(equations))
    columns = rng.standard_normal((2, harmonics + 1, equations, width)) @ np.diag(np.linspace(0.1, 1.0, width))
    columns = (columns[0] + 1j * columns[1]) / (1.0 + np.arange(harmonics + 1))[:, None, None]
    columns[0] = columns[0].real
    for _ in range(8):
        values = rng.standard_normal((4 * harmonics, periods, equations))
        weights = closing_weights(range(periods), len(values))
        mean = _coloured(mixing, spectrum(np.einsum("tp,tpe->te", weights, values), harmonics))
        steps = np.moveaxis(spectrum(successive(values, range(periods)), harmonics), 1, 0)
        steps = np.stack([_coloured(mixing, step) for step in steps])
        each = closed_freedom_of_many(len(steps))
        noise = noise_from_steps(steps, 1.0 / np.mean(np.sum(weights**2, axis=1)), each)
        for _ in range(2):
            noise = beside(steps, noise, each, np.linalg.qr(whiten(noise.whitener(), columns))[0])
        basis = np.linalg.qr(whiten(noise.whitener(), columns))[0]
        left = off(basis, whiten(noise.whitener(), mean))
        ratios.append(left @ left / (len(left) - width))
    # the mean of eight spreads by 0.025 of three equations, by less of more
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.06 if equations == 3 else 0.035)


@pytest.mark.parametrize("equations", [2, 4, 6])
def test_constants_have_a_real_floor_where_noise_of_equations_is_out_of_phase(equations):
    """A constant has no phase, whatever its neighbours have: what has is counted in none of its numbers."""
    rng, harmonics, periods = np.random.default_rng(equations), 60, 12
    phase = rng.standard_normal((2, equations, equations)) / np.sqrt(equations)
    mixing = np.broadcast_to(np.eye(equations) + phase[0] + 1j * phase[1], (harmonics + 1, equations, equations)).copy()
    mixing[0] = mixing[0].real
    power = []
    for _ in range(40):
        values = rng.standard_normal((periods, 4 * harmonics, equations))
        coloured = np.stack([_coloured(mixing, spectrum(value, harmonics)) for value in values])
        steps = np.diff(coloured, axis=0) / np.sqrt(2.0)
        noise = noise_from_steps(steps, periods, step_freedom(periods))
        nothing = np.zeros((equations * (2 * harmonics + 1), 0))
        for _ in range(2):
            noise = beside(steps, noise, step_freedom(periods), nothing)
        assert not np.any(noise.covariance[0].imag)
        power.append(np.mean(np.abs(_coloured(noise.whitener()[:1], coloured.mean(axis=0)[:1])) ** 2))
    assert np.mean(power) < 1.5


def _coloured(mixing, values):
    return np.matmul(mixing, values[:, :, None])[:, :, 0]


def test_stacked_real_numbers_go_back():
    rng = np.random.default_rng(3)
    values = scatter(rng, 1, MIXING)[0]
    np.testing.assert_array_equal(unstacked(stacked(values), 3), values)
    np.testing.assert_array_equal(stacked(unstacked(stacked(values), 3)), stacked(values))


@pytest.mark.parametrize("periods", [6, 12, 30])
def test_degrees_of_freedom_of_successive_differences(periods):
    """Twice the squared mean over the variance of the estimate, from many draws."""
    steps = np.diff(np.random.default_rng(4).standard_normal((40000, periods)), axis=1)
    estimate = np.mean(steps**2, axis=1) / 2.0
    assert step_freedom(periods) == pytest.approx(2.0 * np.mean(estimate) ** 2 / np.var(estimate), rel=0.05)


def test_a_model_that_takes_up_scatter_does_not_lower_the_floor_of_the_rest():
    """White scatter stays white however many of its directions a model takes: the rest is scaled up for them."""
    rng = np.random.default_rng(5)
    residuals = scatter(rng, 15, np.eye(3))
    plain = noise_from_steps(steps_of(residuals), 15, step_freedom(15))
    size = len(stacked(residuals[0]))
    basis = np.linalg.qr(rng.standard_normal((size, size // 4)))[0]
    rest = beside(steps_of(residuals), plain, step_freedom(15), basis)
    assert np.mean(rest.std / plain.std) == pytest.approx(1.0, abs=0.05)
    assert rest.total_freedom == pytest.approx(0.75 * plain.total_freedom, rel=0.05)


def test_what_the_model_takes_up_altogether_is_not_in_its_floor():
    """A few directions that differ wildly from period to period, all of them free in the model."""
    rng = np.random.default_rng(6)
    quiet = scatter(rng, 15, np.eye(3))
    plain = noise_from_steps(steps_of(quiet), 15, step_freedom(15))
    wild = rng.standard_normal((len(stacked(quiet[0])), 4))
    loud = np.stack([unstacked(stacked(r) + 30.0 * wild @ rng.standard_normal(4), 3) for r in quiet])
    loud_floor = noise_from_steps(steps_of(loud), 15, step_freedom(15))
    whitener = loud_floor.whitener()
    flat = np.stack([stacked(np.matmul(whitener, unstacked(w, 3)[:, :, None])[:, :, 0]) for w in wild.T], axis=1)
    rest = beside(steps_of(loud), loud_floor, step_freedom(15), np.linalg.qr(flat)[0])
    assert np.all(loud_floor.std > 10.0 * plain.std)
    np.testing.assert_allclose(rest.std, plain.std, rtol=0.15)


def test_directions_of_white_scatter_are_all():
    values = np.random.default_rng(7).standard_normal((12, 1500))
    assert noise_directions(steps_of(values)) == pytest.approx(1500, rel=0.4)


@pytest.mark.parametrize("rank", [3, 20, 100])
def test_directions_of_scatter_of_low_rank_are_its_rank(rank):
    rng = np.random.default_rng(8)
    span = np.linalg.qr(rng.standard_normal((1500, rank)))[0]
    found = [noise_directions(steps_of(rng.standard_normal((25, rank)) @ span.T)) for _ in range(20)]
    assert np.median(found) == pytest.approx(rank, rel=0.25)


@pytest.mark.parametrize("periods", [2, 3, 4, 5])
def test_size_of_the_lack_of_fit_where_steps_are_too_few_to_tell_directions(periods):
    """Scatter that fills a ninth of its directions, as that of a leg does: a right mean is rarely rejected."""
    rng, width = np.random.default_rng(9), 400
    size = np.where(np.arange(width) < width // 20, 6.0, 1.0)
    assert np.sum(size**2) ** 2 / np.sum(size**4) / width == pytest.approx(0.115, abs=1e-3)
    rejected = []
    for _ in range(DRAWS):
        flat = size * rng.standard_normal((periods, width))
        ratio = (
            periods * np.sum(np.mean(flat, axis=0) ** 2) / (np.sum(np.diff(flat, axis=0) ** 2) / 2.0 / (periods - 1))
        )
        directions = noise_directions(steps_of(flat))
        rejected.append(stats.f.sf(ratio, directions, directions * step_freedom(periods)) < 0.05)
    assert 0.005 < np.mean(rejected) < 0.09


@pytest.mark.slow
def test_size_of_the_lack_of_fit_of_four_periods(laboratory):
    """Legs that lack nothing, four periods each: about one in twenty is rejected at that level, and hardly more."""
    rejected = []
    for seed in range(20, 34):
        recording = laboratory.record(periods=12, seed=seed)
        for begin in (0.0, 20.0, 40.0):
            first = float(recording.time[0]) + begin
            part = laboratory.bench(recording.crop(first, first + 4 * 5.0))
            assert part.data.periods == 4
            rejected.append(lack_of_fit(part, settle(part, part.effects))[2] < 0.05)
    # 42 draws at a twentieth: two, seven or more in less than one of two hundred
    assert np.sum(rejected) <= 6


@pytest.mark.scenario
def test_a_leg_that_lacks_nothing_leaves_its_noise(laboratory, nothing_missing):
    """Statistic over degrees of freedom near one, in all and for every equation, whatever the noise."""
    found = [nothing_missing]
    for seed in range(4, 11):
        bench = laboratory.bench(laboratory.record(seed=seed))
        found.append((bench, settle(bench, bench.effects)))
    # one draw spreads the ratio by 0.08, the mean of eight by 0.03
    assert np.mean([now.fit.statistic / now.fit.dof for _, now in found]) == pytest.approx(1.0, abs=0.08)
    for bench, now in found:
        statistic, dof, p_value = lack_of_fit(bench, now)
        assert (statistic, dof) == (now.fit.statistic, now.fit.dof)
        assert p_value > 1e-3
        clean = np.sqrt(np.sum(np.abs(bench.clean_residual(now.fit)) ** 2, axis=0))
        np.testing.assert_array_less(clean, 1.5 * now.noise.std)
        np.testing.assert_array_less(0.5 * now.noise.std, clean)
    # and for the low harmonics of the links, of which derived noise has least: 850 numbers, that is to 0.05
    low = [np.abs(unstacked(now.fit.whitened, now.noise.equations))[2:20, 1::2] ** 2 for _, now in found]
    assert [str(equation.kind) for equation in nothing_missing[0].data.equations[1::2]] == ["link"] * 3
    free = np.mean([now.fit.dof / len(now.fit.whitened) for _, now in found])
    assert np.mean(low) == pytest.approx(2.0 * free, rel=0.12)


def test_a_model_that_is_wrong_by_a_twentieth_of_the_torque_is_seen(rippled):
    bench, start, with_it = rippled
    assert lack_of_fit(bench, start)[2] < 1e-6
    assert start.fit.statistic / start.fit.dof > 3.0
    assert with_it.fit.statistic / with_it.fit.dof == pytest.approx(1.0, abs=0.2)
    assert lack_of_fit(bench, with_it)[2] > 1e-3
    # its floor is that of the model without: noise, not misfit
    wrong_scale = replace(start.noise, covariance=start.noise.covariance / 4.0)
    assert bench.statistic(with_it.fit, wrong_scale) == pytest.approx(
        4.0 * bench.statistic(with_it.fit, start.noise), rel=1e-6
    )


@pytest.mark.scenario
def test_what_a_late_torque_leaves_beside_its_jump_is_no_lack_of_the_model(laboratory, monkeypatch):
    """Friction jumps in the record when the recorded torque acts, not when the motor turns."""
    plant = plant_from_robot(laboratory.leg)
    plant = plant.replace(coulomb_friction=6.0 * plant.coulomb_friction)
    late = make_effect("torque_delay", "hip", delay=0.02)
    laws = (TorqueDelay.turning, Effect.turning)
    worse = []
    for seed in range(3, 7):
        recording = laboratory.record([(late, [])], periods=6, seed=seed, plant=plant)
        fits = []
        for turning in laws:
            monkeypatch.setattr(TorqueDelay, "turning", turning)
            bench = laboratory.bench(recording)
            fits.append(settle(bench, (*bench.effects, late)).fit)
        own, other = fits
        worse.append(other.statistic / other.dof - own.statistic / own.dof)
    assert min(worse) > 0.0
    assert np.mean(worse) > 0.05


@pytest.mark.scenario
def test_a_late_torque_is_late_by_as_much_as_its_standard_deviation_says(laboratory):
    late = make_effect("torque_delay", "hip", delay=0.02)
    off, stds = [], []
    for seed in range(3, 7):
        bench = laboratory.bench(laboratory.record([(late, [])], periods=6, seed=seed))
        fit = settle(bench, (*bench.effects, late)).fit
        place = next(k for k, (_, shape) in enumerate(fit.free_shapes) if shape.name == "delay")
        _, shape = fit.free_shapes[place]
        stds.append(fit.std(len(fit.columns) + place) * (shape.upper - shape.lower))
        off.append(fit.effects[-1].delay - late.delay)
    assert np.sqrt(np.mean((np.array(off) / stds) ** 2)) < 1.6
    assert max(stds) < 5e-4
