"""What the sensors make of the exact motion: effects in the signal chain, noise, quantisation, columns."""

import numpy as np

from sea_ident.recordings import Recording
from tests.benchmarks.hidden_effects.case import FloatArray, Noise, Planted
from tests.benchmarks.hidden_effects.engine import Exact
from tests.benchmarks.hidden_effects.forms import trend
from tests.benchmarks.hidden_effects.plants import Truth


def signals(exact: Exact, truth: Truth, planted: tuple[Planted, ...]) -> dict[str, FloatArray]:
    """Signals (N, n) after the effects of the signal chain, still without noise.

    Args:
        exact: what happened.
        truth: the robot.
        planted: effects; those that are not of the signal chain change nothing here.

    Returns:
        q, theta, tau_motor and temperature.
    """
    time, names = exact.motion.time, truth.robot.joint_names
    q, theta, tau = exact.motion.q.copy(), exact.motion.theta.copy(), exact.tau_motor.copy()
    rigid = ~np.array(truth.robot.elastic, dtype=bool)
    period = round(exact.period / float(time[1] - time[0]))
    for p in planted:
        i = 0 if p.joint is None else names.index(p.joint)
        match p.effect:
            case "encoder_offset":
                q[:, i] += p.size
            case "motor_encoder_offset":
                theta[:, i] += p.size
            case "joint_offset":
                q[:, i] += p.size
                theta[:, i] += p.size
            case "encoder_eccentricity":
                q[:, i] += p.size * np.sin(q[:, i] + p.shape["phase"])
            case "position_delay" | "torque_delay":
                late = q if p.effect == "position_delay" else tau
                for k in range(len(names)) if p.joint is None else (i,):
                    late[:, k] = delayed(time, late[:, k], p.size, period)
            case "torque_constant":
                tau[:, i] /= 1.0 + p.size
            case "common_torque_constant":
                tau /= 1.0 + p.size
            case "torque_constant_drift":
                course = trend(p.shape["kind"], exact.course)
                tau[:, i] /= 1.0 + p.size * np.array([course(float(t)) for t in time])
            case "crosstalk":
                tau[:, i] += p.size * exact.tau_motor[:, int(p.shape["other"])]
            case _:
                pass
    theta[:, rigid] = q[:, rigid]
    return {"q": q, "theta": theta, "tau_motor": tau, "temperature": exact.temperature}


def delayed(time: FloatArray, values: FloatArray, delay: float, period: int) -> FloatArray:
    """A signal of before, by cubic interpolation.

    Args:
        time: (N,) [s].
        values: (N,) the signal.
        delay: [s].
        period: samples of a period; what was before the recording is taken from the end of its first period.

    Returns:
        (N,) the delayed signal.
    """
    step = float(time[1] - time[0])
    ahead = int(np.ceil(delay / step)) + 3
    padded = np.concatenate([values[period - ahead : period], values])
    position = np.arange(len(values)) + ahead - delay / step
    lower = np.floor(position).astype(int)
    lower = np.minimum(lower, len(padded) - 3)
    s = position - lower
    p0, p1, p2, p3 = (padded[lower + k] for k in (-1, 0, 1, 2))
    result: FloatArray = (
        -s * (s - 1) * (s - 2) / 6 * p0
        + (s + 1) * (s - 1) * (s - 2) / 2 * p1
        - (s + 1) * s * (s - 2) / 2 * p2
        + (s + 1) * s * (s - 1) / 6 * p3
    )
    return result


def record(
    exact: Exact,
    truth: Truth,
    planted: tuple[Planted, ...],
    noise: Noise,
    channel: str,
    rng: np.random.Generator,
    source: str,
) -> Recording:
    """The recording that a robot would give.

    Args:
        exact: what happened.
        truth: the robot.
        planted: the hidden effects.
        noise: sensors.
        channel: `tau_motor`, or `current` with the losses of the transmission in it.
        rng: random numbers.
        source: name of the recording.

    Returns:
        The recording.
    """
    robot = truth.robot
    clean = signals(exact, truth, planted)
    shape = clean["q"].shape
    q = _quantised(clean["q"] + noise.link_encoder * rng.standard_normal(shape), noise.link_step)
    theta = _quantised(clean["theta"] + noise.motor_encoder * rng.standard_normal(shape), noise.motor_step)
    level = noise.torque * np.sqrt(np.mean(clean["tau_motor"] ** 2, axis=0))
    columns: dict[str, FloatArray] = {}
    tau = clean["tau_motor"]
    for i, joint in enumerate(robot.joints):
        columns[f"q_{joint.name}"] = q[:, i]
        if joint.elastic:
            columns[f"theta_{joint.name}"] = theta[:, i]
        actuator = joint.actuator
        if channel == "current" and actuator is not None and actuator.torque_constant is not None:
            efficiency = actuator.efficiency or 1.0
            drives = np.sign(tau[:, i] * exact.motion.dtheta[:, i])
            scale = actuator.gear_ratio * actuator.torque_constant
            current = tau[:, i] / efficiency**drives / scale
            columns[f"current_{joint.name}"] = current + level[i] / scale * rng.standard_normal(shape[0])
        else:
            columns[f"tau_motor_{joint.name}"] = tau[:, i] + level[i] * rng.standard_normal(shape[0])
    if any(p.effect == "temperature_friction" for p in planted):
        for i, joint in enumerate(robot.joints):
            degrees = clean["temperature"][:, i] + 0.05 * rng.standard_normal(shape[0])
            columns[f"temperature_{joint.name}"] = degrees
    return Recording(exact.motion.time, columns, source)


def _quantised(values: FloatArray, step: float) -> FloatArray:
    return np.round(values / step) * step if step > 0.0 else values
