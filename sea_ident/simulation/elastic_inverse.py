"""Inverse dynamics through the springs: which motor motion and torque move the links as asked."""

import numpy as np
from scipy.interpolate import make_interp_spline

from sea_ident._typing import FloatArray
from sea_ident.exceptions import SimulationError
from sea_ident.motion import FourierSeries, Motion
from sea_ident.regressor import inverse_dynamics
from sea_ident.simulation.plant import Plant
from sea_ident.simulation.reference import Reference

HARMONIC_RATE = 6.0
"""Highest frequency of the deflection that is followed [Hz]: above it a motor would have to shake its spring."""

ROUNDS = 8
"""The deflection feeds back into the spring torque through S and D only: a few rounds reach round-off."""


def deflection_of(plant: Plant, tau_spring: FloatArray) -> FloatArray:
    """Deflection that gives a spring torque at rest, K1 d + K3 d^3 = tau (paper, eq. 21).

    Args:
        plant: the springs.
        tau_spring: (N, n) [N m].

    Returns:
        (N, n) [rad], 0 at rigid joints.

    Raises:
        SimulationError: a softening spring cannot carry the torque.
    """
    elastic = plant.robot.elastic_indices
    k1, k3 = plant.stiffness[elastic], plant.cubic_stiffness[elastic]
    torque: FloatArray = tau_spring[:, elastic]
    d: FloatArray = np.zeros_like(torque)
    # From zero, Newton on a stiffening spring may overshoot once and then falls monotonically.
    with np.errstate(over="ignore", invalid="ignore"):  # of a softening one it may leave for good
        for _ in range(60):
            d = d - (k1 * d + k3 * d**3 - torque) / np.maximum(k1 + 3.0 * k3 * d * d, 1e-3 * k1)
        error = np.abs(k1 * d + k3 * d**3 - torque)
    bad = np.argwhere(~(error <= 1e-9 * (np.abs(torque) + k1)))
    if len(bad):
        row, column = bad[0]
        name = plant.robot.joint_names[int(elastic[column])]
        raise SimulationError(f"joint {name!r}: its softening spring cannot carry {torque[row, column]:.4g} N m")
    result: FloatArray = np.zeros_like(tau_spring)
    result[:, elastic] = d
    return result


def link_position_at_rest(plant: Plant, theta: FloatArray) -> FloatArray:
    """(n,) link positions in static equilibrium with the motors held at theta (n,)."""
    q = theta.copy()
    nothing = np.zeros((1, len(theta)))
    for _ in range(200):
        motion = Motion.rigid(np.zeros(1), q[None], nothing, nothing)
        link, _ = inverse_dynamics(plant.robot, motion)
        updated = theta - deflection_of(plant, link)[0]
        if float(np.max(np.abs(updated - q))) < 1e-12:
            return np.asarray(updated, dtype=np.float64)
        q = 0.5 * (q + updated)
    return q


def _derivatives(reference: Reference, time: FloatArray, values: FloatArray, at: FloatArray) -> list[FloatArray]:
    """Values and two derivatives at other times of a smooth curve through samples (N, n)."""
    if reference.period is not None:
        harmonics = min(round(HARMONIC_RATE * reference.period), (len(time) - 1) // 4)
        series = FourierSeries.fit(time, values, 1.0 / reference.period, max(harmonics, 1))
        return [series.evaluate(at, order) for order in range(3)]
    curve = make_interp_spline(time, values, k=5)
    return [np.asarray(curve(at, order), dtype=np.float64) for order in range(3)]


def elastic_inverse(
    plant: Plant, reference: Reference, time: FloatArray, smoothing: float
) -> tuple[Motion, FloatArray]:
    """Motor motion and torque for a link motion.

    Args:
        plant: the model.
        reference: link motion.
        time: (N,) times at which they are wanted [s].
        smoothing: v_off of the Coulomb friction [rad/s].

    Returns:
        (N, n) motion of links and motors, and (N, n) motor torque [N m].
    """
    samples = max(64, round(200.0 * reference.duration))
    periodic = reference.period is not None
    grid = np.arange(samples + (0 if periodic else 1), dtype=np.float64) * (reference.duration / samples)
    link_motion = reference.motion(grid)
    deflection = np.zeros_like(link_motion.q)
    if len(plant.robot.elastic_indices):
        for _ in range(ROUNDS):
            d, rate, acceleration = _derivatives(reference, grid, deflection, grid)
            motion = _deflected(link_motion, d, rate, acceleration)
            link, _ = inverse_dynamics(plant.robot, motion)
            deflection = deflection_of(
                plant, link + _link_friction(plant, motion, smoothing) - plant.spring_damping * rate
            )
    d, rate, acceleration = _derivatives(reference, grid, deflection, time)
    motion = _deflected(reference.motion(time), d, rate, acceleration)
    link, motor = inverse_dynamics(plant.robot, motion)
    friction = plant.viscous_friction * motion.dtheta + plant.coulomb_friction * np.tanh(motion.dtheta / smoothing)
    return motion, link + _link_friction(plant, motion, smoothing) + motor + friction


def _deflected(link: Motion, d: FloatArray, rate: FloatArray, acceleration: FloatArray) -> Motion:
    return Motion(link.time, link.q, link.dq, link.ddq, link.q + d, link.dq + rate, link.ddq + acceleration)


def _link_friction(plant: Plant, motion: Motion, smoothing: float) -> FloatArray:
    viscous: FloatArray = plant.link_viscous_friction * motion.dq
    return viscous + plant.link_coulomb_friction * np.tanh(motion.dq / smoothing)
