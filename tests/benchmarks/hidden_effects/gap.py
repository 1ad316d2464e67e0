"""How much of a planted effect the base model leaves unexplained: sizes are set by it."""

from dataclasses import replace

import numpy as np

from sea_ident.effects import Effect, base_effects, spring_effects
from sea_ident.motion import FourierSeries, Motion
from sea_ident.regressor import build_regressor
from sea_ident.robot import Robot
from tests.benchmarks.hidden_effects.case import FloatArray, Planted
from tests.benchmarks.hidden_effects.engine import Exact, Friction, simulate_mujoco
from tests.benchmarks.hidden_effects.plants import Truth
from tests.benchmarks.hidden_effects.sensors import signals

BANDWIDTH = 15.0
AROUND_REVERSALS = 3
TREND_EFFECTS = ("friction_drift", "temperature_friction", "torque_constant_drift", "stiffness_drift")
SENSOR_EFFECTS = (
    "encoder_offset", "motor_encoder_offset", "joint_offset", "encoder_eccentricity", "position_delay",
)  # fmt: skip
ABSORBED_EFFECTS = ("payload", "common_torque_constant", "changed_inertia")


def base_model(robot: Robot, smoothing: float) -> tuple[Effect, ...]:
    """Base model with the true smoothing of the friction."""
    effects = (*base_effects(robot), *spring_effects(robot))
    return tuple(
        replace(e, smoothing=max(smoothing, 5e-4)) if e.name == "coulomb_friction" else e  # type: ignore[call-arg]
        for e in effects
    )


def base_residual(
    robot: Robot, clean: dict[str, FloatArray], exact: Motion, sensed: bool, period: float, smoothing: float
) -> tuple[FloatArray, FloatArray]:
    """What the base model leaves of one noise-free period, reversals of the motors left out.

    What an effect does within a few samples of a reversal cannot be seen in a recording, so it does not count.

    Args:
        robot: the robot; its numbers are not used.
        clean: signals (N, n) of one period.
        exact: motion.
        sensed: whether the model sees the motion of the signals, band-limited and differentiated, not the exact one.
        period: [s].
        smoothing: of the friction [rad/s].

    Returns:
        Residual rms of the link and of the motor rows (n,) each, over the joint's torque rms; rigid joints have
        their whole residual in the motor row.
    """
    samples = len(clean["q"])

    def smooth(values: FloatArray, order: int = 0) -> FloatArray:
        w = 2j * np.pi * np.arange(samples // 2 + 1) / period
        window = ((np.abs(w) <= 2.0 * np.pi * BANDWIDTH) * w**order).reshape(-1, *([1] * (values.ndim - 1)))
        return np.fft.irfft(np.fft.rfft(values, axis=0) * window, samples, axis=0)

    motion = exact
    if sensed:
        time = np.arange(samples) * (period / samples)
        q, theta = ([smooth(clean[name], d) for d in range(3)] for name in ("q", "theta"))
        motion = Motion(time, *q, *theta)
    regressor = build_regressor(robot, base_model(robot, smoothing), motion)
    tau = clean["tau_motor"]
    scale = np.sqrt(np.mean(tau**2, axis=0))
    elastic = np.array(robot.elastic, dtype=bool)
    motor = np.where(elastic[None, :, None], regressor.motor, regressor.sum)
    rows = np.concatenate([motor / scale[:, None], (regressor.link / scale[:, None])[:, elastic]], axis=1)
    target = np.concatenate([tau / scale, np.zeros((samples, int(elastic.sum())))], axis=1)
    if sensed:
        rows, target = smooth(rows), smooth(target)
    turning = np.sign(exact.dtheta) != np.sign(np.roll(exact.dtheta, 1, axis=0))
    near = np.any([np.roll(turning, k, axis=0) for k in range(-AROUND_REVERSALS, AROUND_REVERSALS)], axis=0)
    used = ~np.concatenate([near, near[:, elastic]], axis=1)
    matrix, wanted = rows[used], target[used]
    norms = np.maximum(np.linalg.norm(matrix, axis=0), 1e-12)
    solution = np.linalg.lstsq(matrix / norms, wanted, rcond=1e-9)[0]
    residual = np.where(used, target - rows @ (solution / norms), 0.0)
    rms = np.sqrt(np.sum(residual**2, axis=0) / used.sum(axis=0))
    links = np.zeros(robot.n)
    links[elastic] = rms[robot.n :]
    return links, rms[: robot.n]


class Gauge:
    """Measures gaps on one truth and one trajectory by short noise-free simulations.

    Attributes:
        truth: the robot.
        series: trajectory.
        friction: base friction, without jitter.
    """

    def __init__(self, truth: Truth, series: FourierSeries, friction: Friction, settle: int) -> None:
        self.truth, self.series, self.settle = truth, series, settle
        self.friction = replace(friction, jitter=0.0)
        self.exact = self._simulate(())
        self.clean = signals(self.exact, truth, ())
        self.floors = {sensed: self._residual(self.clean, self.exact, sensed) for sensed in (False, True)}

    def _simulate(self, planted: tuple[Planted, ...]) -> Exact:
        return simulate_mujoco(self.truth, self.series, 1, planted=planted, friction=self.friction, settle=self.settle)

    def _residual(self, clean: dict[str, FloatArray], exact: Exact, sensed: bool) -> FloatArray:
        smoothing, robot = self.friction.smoothing, self.truth.robot
        return np.stack(base_residual(robot, clean, exact.motion, sensed, self.series.period, smoothing))

    def torque_rms(self) -> FloatArray:
        """(n,) rms of the motor torques [N m]."""
        return np.sqrt(np.mean(self.exact.tau_motor**2, axis=0))

    def measure(self, planted: Planted) -> Planted:
        """The effect with its gap and torque share filled in.

        The gap is that of the joint and equation where it is largest, beyond what is there without the effect.
        Effects that drift are measured by the size of their trend, those that a refit absorbs by their torque.
        """
        if planted.effect in TREND_EFFECTS:
            share = self._trend_share(planted)
            return replace(planted, gap=share, torque_share=share)
        exact = self._simulate((planted,))
        clean = signals(exact, self.truth, (planted,))
        change = np.sqrt(np.mean((clean["tau_motor"] - self.clean["tau_motor"]) ** 2, axis=0)) / self.torque_rms()
        share = float(change.max())
        sensed = planted.effect in SENSOR_EFFECTS
        excess = np.sqrt(np.maximum(self._residual(clean, exact, sensed) ** 2 - self.floors[sensed] ** 2, 0.0))
        gap = share if planted.effect in ABSORBED_EFFECTS else float(excess.max())
        return replace(planted, gap=gap, torque_share=share)

    def _trend_share(self, planted: Planted) -> float:
        truth, motion = self.truth, self.exact.motion
        i = truth.robot.index(str(planted.joint))
        if planted.effect in ("friction_drift", "temperature_friction"):
            wave = truth.coulomb[i] * np.sign(motion.dtheta[:, i]) + truth.viscous[i] * motion.dtheta[:, i]
        elif planted.effect == "stiffness_drift":
            wave = truth.stiffness[i] * (motion.deflection[:, i])
        else:
            wave = self.exact.tau_motor[:, i]
        size = float(np.sqrt(np.mean(wave**2)) / self.torque_rms()[i])
        return float(abs(planted.size) * size / np.sqrt(12.0))

    def scaled_to(self, planted: Planted, target: float, largest: float) -> Planted | None:
        """The effect with the size that leaves a wanted gap.

        Args:
            planted: with a first guess of its size.
            target: gap as a share of torque.
            largest: largest size that makes sense.

        Returns:
            The effect, within 15 % of the target; None where no size up to the largest gets there.
        """
        best = self.measure(planted)
        for _ in range(4):
            if best.gap > 0.0 and abs(best.gap / target - 1.0) < 0.15:
                return best
            factor = float(np.clip(target / max(best.gap, 1e-6), 0.02, 25.0))
            size = float(np.sign(best.size) * min(abs(best.size) * factor, largest))
            if abs(size) == abs(best.size):
                return None
            try:
                best = self.measure(replace(best, size=size))
            except ArithmeticError:
                return None
        return best if 0.75 < best.gap / target < 1.35 else None
