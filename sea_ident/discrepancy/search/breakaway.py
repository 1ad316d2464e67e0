"""Breakaway: the torque at which friction lets a motor go, pass by pass, against the friction in which it slides.

A motor that stands is held by whatever friction it takes, so what stands is compared nowhere; and where stiction lets
go at another instant in every pass, what it did is gone from their mean. The torque at which it lets go is not: no
friction that only starts to slide exceeds there what it is when it slides.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import moving, signal_effects
from sea_ident.discrepancy.bench.periods import model_torque, torques_of
from sea_ident.discrepancy.measured.data import EquationKind, PeriodData
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.discrepancy.measured.standing import known_speed
from sea_ident.effects import Contribution, Effect, State, corrected_motion
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.stribeck_friction import StribeckFriction
from sea_ident.motion import Motion
from sea_ident.side_by_side import side_by_side

MOVES_ON = 0.02
"""Time for which a motor must keep moving to have been let go [s]."""

SLIDES = 5.0
"""Times the speed up to which a friction only starts to slide at which it slides: tanh 5 is 0.9999."""

LEAST_EXCESS = 0.1
"""Share of the sliding friction by which the breakaway torque must exceed it: a torque of limited bandwidth overshoots
by nearly as much where friction turns."""

FEWEST_PASSES = 4
"""Passes in which a motor must be let go for a test of their mean."""

LEVEL = 1e-5
"""Probability that a breakaway torque must not exceed to show stiction."""


@dataclass(frozen=True)
class Breakaway:
    """How much later than it slides friction lets a motor go.

    Attributes:
        joint: of the motor.
        excess: torque beyond the sliding friction, the mean over passes [N m] or [N].
        std: standard deviation of it, by the scatter of the passes.
        passes: in which the motor is let go.
    """

    joint: str
    excess: float
    std: float
    passes: int


def stiction(bench: Bench, fit: Fit, position: int, noise: NoiseFloor) -> Breakaway | None:
    """By how much an effect of a model lets its motor go late, None where that is nothing that the passes show.

    A friction that still falls at speeds at which it slides has that in its law already: late is what lets go above
    the law, too.

    Args:
        bench: the recording.
        fit: the model with the effect.
        position: of the effect in it.
        noise: noise floor.
    """
    effect = fit.effects[position]
    if not isinstance(effect, StribeckFriction):
        return None
    if not lets_go_late(bench, fit, effect):
        return None
    others = [e for k, e in enumerate(fit.effects) if k != position]
    rest = bench.fit(others, noise, start=fit.parameters, tangents=False)
    if not lets_go_late(bench, rest, effect):
        return None
    excess = breakaway_excess(bench, rest, effect.required_joint)
    std = float(np.std(excess, ddof=1)) / np.sqrt(len(excess))
    return Breakaway(effect.required_joint, float(np.mean(excess)), std, len(excess))


def lets_go_late(bench: Bench, fit: Fit, effect: Effect) -> bool:
    """Whether an effect is stiction that its motor shows pass by pass where it is let go.

    Args:
        bench: the recording.
        fit: the model without the effect.
        effect: any effect.
    """
    return isinstance(effect, StribeckFriction) and breakaway_p(bench, fit, effect.required_joint) <= LEVEL


def breakaway_p(bench: Bench, fit: Fit, joint: str) -> float:
    """Probability by chance that friction lets a motor go later than it slides.

    Args:
        bench: the recording.
        fit: the model without stiction.
        joint: of the motor.

    Returns:
        By Student's t of the passes; 1 where the excess is small beside the sliding friction, the model has none to
        compare with, or too few passes show any.
    """
    sliding = fit.parameters.get(f"{joint}.coulomb_friction", 0.0)
    if sliding <= 0.0:
        return 1.0
    excess = breakaway_excess(bench, fit, joint)
    if len(excess) < FEWEST_PASSES or float(np.mean(excess)) < LEAST_EXCESS * sliding:
        return 1.0
    scatter = float(np.std(excess, ddof=1)) / np.sqrt(len(excess))
    return float(stats.t.sf(float(np.mean(excess)) / max(scatter, 1e-300), len(excess) - 1))


def breakaway_excess(bench: Bench, fit: Fit, joint: str) -> FloatArray:
    """(P',) torque beyond the sliding friction at which a motor is let go, the mean of every pass that has any.

    Raises:
        ValueError: the joint has no motor that is measured.
    """
    data, robot = bench.data, bench.robot
    row = _motor_row(data, joint)
    index = data.equations[row].index
    signals = signal_effects(fit.effects)
    motions = [corrected_motion(robot, moving(signals), motion) for motion in data.period_motions]
    acting = torques_of(fit.effects, fit.parameters, robot)
    nothing = Contribution(*np.zeros((2, data.samples, robot.n)))
    known = known_speed(data, index)
    smoothing = max(
        (e.smoothing for e in fit.effects if isinstance(e, CoulombFriction) and e.joint == joint), default=0.0
    )
    interval = data.period / data.samples
    # as long as the torque takes to follow: a quarter of the shortest period that it has
    window = int(data.period / (4.0 * data.reach) / interval)
    lasts = max(window + 1, round(MOVES_ON / interval))

    def of_pass(period: int) -> float | None:
        events = let_go(motions[period].dtheta[:, index], known, lasts)
        if not events:
            return None
        state = State(robot, _sliding(motions[period], index, events, lasts, SLIDES * smoothing), data.channels)
        torque = data.target(data.period_tau_motor[period])[:, row]
        left = torque - data.rows(model_torque(nothing, acting, signals, state))[:, row]
        at = [(np.arange(k, k + window + 1) % len(left), direction) for k, direction in events]
        return float(np.mean([direction * np.mean(left[rows]) for rows, direction in at]))

    return np.array([found for found in side_by_side(of_pass, range(data.periods)) if found is not None])


def let_go(speed: FloatArray, known: float, lasts: int) -> list[tuple[int, int]]:
    """Samples of a period at which what stood moves on, and the direction in which it does.

    Args:
        speed: (N,) of the motor, periodic [rad/s] or [m/s].
        known: speed above which its sign is known.
        lasts: samples for which it must keep moving.
    """
    direction = np.where(np.abs(speed) > known, np.sign(speed), 0.0).astype(int)
    kept = np.all([np.roll(direction, -k) == direction for k in range(1, lasts + 1)], axis=0)
    starts = np.flatnonzero((direction != 0) & (np.roll(direction, 1) == 0) & kept)
    return [(int(k), int(direction[k])) for k in starts]


def _motor_row(data: PeriodData, joint: str) -> int:
    for row, equation in enumerate(data.equations):
        if equation.joint == joint and equation.kind is not EquationKind.LINK:
            return row
    raise ValueError(f"no equation with the motor of joint {joint!r}")


def _sliding(motion: Motion, index: int, events: Sequence[tuple[int, int]], around: int, speed: float) -> Motion:
    """A motion in which a motor slides already where it is let go, so that friction has its sliding value there."""
    dtheta = motion.dtheta.copy()
    for k, direction in events:
        rows = np.arange(k - around, k + around + 1) % len(dtheta)
        dtheta[rows, index] = direction * np.maximum(np.abs(dtheta[rows, index]), speed)
    return replace(motion, dtheta=dtheta)
