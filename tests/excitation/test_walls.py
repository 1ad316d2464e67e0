"""Linear limits on a grid: values, gradients and curvature are those of the basis functions."""

import numpy as np
import pytest

from sea_ident.excitation.linear_limits import LinearLimits
from sea_ident.excitation.spectral_wall import SpectralWall
from sea_ident.excitation.walls import LinearWall
from sea_ident.motion import fourier_basis


@pytest.mark.parametrize("harmonics", [1, 2, 7, 40])
@pytest.mark.parametrize("kind", [LinearWall, SpectralWall])
def test_linear_walls_are_those_of_the_basis_functions(kind, harmonics):
    rng = np.random.default_rng(harmonics)
    n, points, frequency = 3, 32 * harmonics, 0.2
    derivative = np.array([0, 1, 2, 3, 0, 1, 2], dtype=np.intp)
    m = len(derivative)
    joints = rng.normal(size=(m, n))
    names = tuple(str(k) for k in range(m))
    limits = LinearLimits(names, joints, derivative, -np.ones(m), np.ones(m), names)
    wall = kind.of(limits, frequency, harmonics, points)
    time = np.arange(points) / (points * frequency)
    # (m, M, v): values of every limit by every coefficient
    rows = np.array(
        [
            np.einsum("i,mw->miw", joint, fourier_basis(time, frequency, harmonics, int(order))).reshape(points, -1)
            for joint, order in zip(joints, derivative, strict=True)
        ]
    )
    coefficients, weight = rng.normal(size=(n, 2 * harmonics + 1)), rng.random((m, points))
    cases = (
        (wall.values(coefficients), rows @ coefficients.ravel()),
        (wall.pull(weight), np.einsum("mp,mpv->v", weight, rows)),
        (wall.curvature(weight), np.einsum("mp,mpv,mpu->vu", weight, rows, rows, optimize=True)),
    )
    for found, expected in cases:
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
