"""Motions and Fourier series: derivatives, fits, and errors."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sea_ident.exceptions import SeaIdentError
from sea_ident.motion import FourierSeries, Motion, fourier_basis


def series(joints: int = 3, harmonics: int = 5, frequency: float = 0.1, seed: int = 0) -> FourierSeries:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, joints, harmonics))
    return FourierSeries(frequency, rng.normal(size=joints), a, b)


def test_position_is_the_formula_of_the_paper() -> None:
    s, t = series(), np.array([0.0, 1.7, 23.4])
    w = 2 * np.pi * s.base_frequency
    expected = np.tile(s.offset, (3, 1))
    for k, time in enumerate(t):
        for n in range(1, s.harmonics + 1):
            expected[k] += s.a[:, n - 1] / (w * n) * np.sin(w * n * time) - s.b[:, n - 1] / (w * n) * np.cos(
                w * n * time
            )
    assert_allclose(s.evaluate(t), expected, rtol=1e-12)


@pytest.mark.parametrize("derivative", [1, 2, 3])
def test_each_derivative_is_that_of_the_one_before(derivative: int) -> None:
    s, t, step = series(), np.linspace(0.0, 10.0, 50), 1e-4
    slope = (s.evaluate(t + step, derivative - 1) - s.evaluate(t - step, derivative - 1)) / (2 * step)
    exact = s.evaluate(t, derivative)
    assert_allclose(slope, exact, atol=1e-5 * np.abs(exact).max())


def test_series_is_periodic() -> None:
    s, t = series(frequency=0.25), np.linspace(0.0, 4.0, 30)
    for derivative in range(4):
        assert_allclose(s.evaluate(t, derivative), s.evaluate(t + 3 * s.period, derivative), rtol=1e-9, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 4),
    st.integers(1, 17),
    st.floats(0.02, 5.0),
    st.integers(0, 2**31),
)
def test_fit_gives_back_the_coefficients(joints: int, harmonics: int, frequency: float, seed: int) -> None:
    s = series(joints, harmonics, frequency, seed)
    time = np.arange(8 * harmonics + 10) * s.period / (8 * harmonics + 10)
    again = FourierSeries.fit(time, s.evaluate(time), frequency, harmonics)
    assert_allclose(again.coefficients, s.coefficients, rtol=1e-8, atol=1e-8)


def test_fit_with_harmonics_to_spare_leaves_them_zero() -> None:
    s = series(harmonics=4)
    time = np.linspace(0.0, 30.0, 900)
    again = FourierSeries.fit(time, s.evaluate(time), s.base_frequency, 9)
    assert_allclose(again.a[:, 4:], 0.0, atol=1e-8)
    assert_allclose(again.a[:, :4], s.a, atol=1e-8)


def test_fit_needs_as_many_samples_as_coefficients() -> None:
    with pytest.raises(SeaIdentError, match="10 harmonics need at least 21 samples, not 20"):
        FourierSeries.fit(np.arange(20.0), np.zeros((20, 1)), 0.1, 10)


def test_coefficients_make_the_series_again() -> None:
    s = series()
    again = FourierSeries.from_coefficients(s.coefficients, s.base_frequency)
    assert_allclose(again.evaluate(np.array([1.0, 2.0])), s.evaluate(np.array([1.0, 2.0])), rtol=1e-15)
    assert s.coefficients.shape == (3, 11)


def test_sample_is_one_period_without_its_end() -> None:
    s = series()
    motion = s.sample(rate=200.0)
    assert len(motion) == 2000
    assert motion.time[-1] == pytest.approx(10.0 - 0.005)
    assert s.sample(samples=60).time[1] == pytest.approx(10.0 / 60)
    assert_allclose(motion.deflection, 0.0)
    assert_allclose(motion.deflection_rate, 0.0)


def test_basis_times_coefficients_is_the_value() -> None:
    s, t = series(), np.linspace(0.0, 7.0, 9)
    for derivative in range(4):
        basis = fourier_basis(t, s.base_frequency, s.harmonics, derivative)
        assert_allclose(basis @ s.coefficients.T, s.evaluate(t, derivative))


@pytest.mark.parametrize(
    ("frequency", "offset", "shape", "message"),
    [
        (0.0, 3, (3, 5), "base frequency of a Fourier series is 0.0 Hz; it must be > 0"),
        (-1.0, 3, (3, 5), "must be > 0"),
        (float("nan"), 3, (3, 5), "must be > 0"),
        (0.1, 2, (3, 5), r"offset \(2,\), a \(3, 5\)"),
        (0.1, 3, (3,), r"give \(n,\), \(n, L\), \(n, L\)"),
    ],
)
def test_series_that_is_none(frequency: float, offset: int, shape: tuple[int, ...], message: str) -> None:
    with pytest.raises(SeaIdentError, match=message):
        FourierSeries(frequency, np.zeros(offset), np.zeros(shape), np.zeros(shape))


def test_motion_checks_its_shapes() -> None:
    q = np.zeros((4, 2))
    with pytest.raises(SeaIdentError, match=r"time is \(3,\) and q is \(4, 2\)"):
        Motion.rigid(np.zeros(3), q, q, q)
    with pytest.raises(SeaIdentError, match=r"dtheta is \(4, 3\), q is \(4, 2\)"):
        Motion(np.zeros(4), q, q, q, q, np.zeros((4, 3)), q)


def test_parts_of_a_motion_make_the_whole() -> None:
    motion = series().sample(samples=25)
    parts = list(motion.chunks(10))
    assert [len(part) for part in parts] == [10, 10, 5]
    again = Motion.concatenate(parts)
    for name in ("time", "q", "dq", "ddq", "theta", "dtheta", "ddtheta"):
        np.testing.assert_array_equal(getattr(again, name), getattr(motion, name))
    assert motion[5:7].n == 3
