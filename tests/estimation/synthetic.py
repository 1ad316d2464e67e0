"""Recordings whose truth is known exactly: inverse dynamics of a periodic motion, springs inverted."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from sea_ident.effects import base_effects
from sea_ident.motion import FourierSeries, Motion
from sea_ident.processing.harmonics import differentiate
from sea_ident.recordings import Recording
from sea_ident.regressor import build_regressor, prior_parameters
from sea_ident.robot import Robot


@dataclass(frozen=True, eq=False)
class Truth:
    motion: Motion
    tau_motor: np.ndarray
    tau_spring: np.ndarray
    parameters: np.ndarray


def truth_of(robot: Robot, series: FourierSeries, samples: int = 2000, effects=None) -> Truth:
    """Exactly periodic motion of links and motors that obeys the link rows with the springs of the annotation."""
    effects = base_effects(robot) if effects is None else effects
    parameters = np.nan_to_num(prior_parameters(robot, effects))
    link = series.sample(samples=samples)
    elastic = robot.elastic_indices
    springs = [robot.spring(robot.joint_names[i]) for i in elastic]
    k1 = np.array([s.stiffness for s in springs])
    k3 = np.array([s.cubic_stiffness or 0.0 for s in springs])
    damping = np.array([s.damping or 0.0 for s in springs])
    motion, spring = link, np.zeros((samples, len(elastic)))
    deflection = np.zeros((samples, len(elastic)))
    rate = np.zeros_like(deflection)
    for _ in range(60 if elastic.size else 0):
        before = deflection
        spring = (build_regressor(robot, effects, motion).link @ parameters)[:, elastic]
        target = spring - damping * rate
        for _ in range(60):
            deflection = deflection - (k1 * deflection + k3 * deflection**3 - target) / (k1 + 3 * k3 * deflection**2)
        deflection, rate, curvature = differentiate(deflection, series.period, min(80, samples // 4))
        parts = [link.q.copy(), link.dq.copy(), link.ddq.copy()]
        for whole, part in zip(parts, (deflection, rate, curvature), strict=True):
            whole[:, elastic] += part
        motion = Motion(link.time, link.q, link.dq, link.ddq, *parts)
        if np.abs(deflection - before).max() < 1e-15:
            break
    regressor = build_regressor(robot, effects, motion)
    return Truth(motion, regressor.sum @ parameters, (regressor.link @ parameters)[:, elastic], parameters)


def record(
    robot: Robot,
    truth: Truth,
    periods: int,
    *,
    seed: int = 0,
    torque_noise: float = 0.0,
    reversal_noise: float = 0.0,
    encoder_noise: float = 0.0,
    correlation: float = 0.0,
) -> Recording:
    """What sensors see of P periods: noise on angles and torque, more of it near velocity reversals.

    The torque noise has the one-step correlation given; all else is white.
    """
    rng = np.random.default_rng(seed)
    samples = len(truth.motion)
    step = truth.motion.time[1] - truth.motion.time[0]
    time = np.arange(periods * samples) * step
    columns = {}
    shape = (periods, samples)
    for i, name in enumerate(robot.joint_names):
        near = np.exp(-((truth.motion.dtheta[:, i] / 0.1) ** 2))
        white = rng.standard_normal(periods * samples)
        coloured = lfilter([np.sqrt(1.0 - correlation**2)], [1.0, -correlation], white).reshape(shape)
        noise = torque_noise * coloured + reversal_noise * near * rng.standard_normal(shape)
        columns[f"q_{name}"] = (truth.motion.q[:, i] + encoder_noise * rng.standard_normal(shape)).ravel()
        columns[f"theta_{name}"] = (truth.motion.theta[:, i] + encoder_noise * rng.standard_normal(shape)).ravel()
        columns[f"tau_motor_{name}"] = (truth.tau_motor[:, i] + noise).ravel()
    return Recording(time, columns, "synthetic")


def leg_series(seed: int = 3, harmonics: int = 5) -> FourierSeries:
    """A motion of three joints within about half a radian."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(0.0, 0.25, (2, 3, harmonics))
    return FourierSeries(0.1, np.array([0.5, -0.3, 0.4]), a, b)
