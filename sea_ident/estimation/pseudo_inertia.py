"""Pseudo-inertia: ten inertial parameters as a 4 x 4 matrix that is positive definite for every real body.

P = [[S, h], [h', m]] with S = tr(I) / 2 - I the second moments, h the first moments and m the mass, all about the joint
frame.

References:
    Wensing, Kim, Slotine, Linear matrix inequalities for physically consistent inertial parameter identification, 2018.
"""

import numpy as np

from sea_ident._typing import FloatArray

# order of the parameters: m mx my mz Ixx Ixy Iyy Ixz Iyz Izz
_BASIS = np.zeros((10, 4, 4))
_BASIS[0, 3, 3] = 1.0
for _k in range(3):
    _BASIS[1 + _k, _k, 3] = _BASIS[1 + _k, 3, _k] = 1.0
for _index, _axis in ((4, 0), (6, 1), (9, 2)):
    for _k in range(3):
        _BASIS[_index, _k, _k] = -0.5 if _k == _axis else 0.5
for _index, (_a, _b) in ((5, (0, 1)), (7, (0, 2)), (8, (1, 2))):
    _BASIS[_index, _a, _b] = _BASIS[_index, _b, _a] = -1.0


def pseudo_inertia_basis() -> FloatArray:
    """(10, 4, 4) matrices so that ``P = sum_k parameter_k basis_k``."""
    return _BASIS.copy()


def pseudo_inertia(parameters: FloatArray) -> FloatArray:
    """(4, 4) pseudo-inertia of ten parameters [kg, kg m, kg m2]."""
    return np.asarray(np.einsum("k,kij->ij", parameters, _BASIS), dtype=np.float64)


def inertial_parameters(matrix: FloatArray) -> FloatArray:
    """(10,) parameters of a (4, 4) pseudo-inertia."""
    second, first, mass = matrix[:3, :3], matrix[:3, 3], matrix[3, 3]
    inertia = np.trace(second) * np.eye(3) - second
    return np.array(
        [mass, *first, inertia[0, 0], inertia[0, 1], inertia[1, 1], inertia[0, 2], inertia[1, 2], inertia[2, 2]]
    )


def reference_pseudo_inertia(parameters: FloatArray, mass_scale: float, length: float) -> FloatArray:
    """A positive definite pseudo-inertia near that of a description, which may be flat, a point or nothing at all.

    Args:
        parameters: (10,) of the description.
        mass_scale: mass of the whole robot [kg], sets how small a mass can be.
        length: size of the robot [m], sets how small a body can be.

    Returns:
        (4, 4) positive definite: at least a thousandth of the robot's mass, spread over a hundredth of its size.
    """
    mass = max(float(parameters[0]), 1e-3 * mass_scale)
    smallest = np.array([1.0, 1.0, 1.0]) * mass * (0.01 * length) ** 2
    matrix = pseudo_inertia(parameters)
    matrix[3, 3] = mass
    centre = matrix[:3, 3] / mass
    about_centre = matrix[:3, :3] - mass * np.outer(centre, centre)
    values, vectors = np.linalg.eigh(about_centre)
    about_centre = (vectors * np.maximum(values, smallest)) @ vectors.T
    matrix[:3, :3] = about_centre + mass * np.outer(centre, centre)
    return matrix
