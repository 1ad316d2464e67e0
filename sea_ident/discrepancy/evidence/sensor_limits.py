"""Where the sensors of a robot, and not a missing effect, may be what a model disagrees with."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.gap import gap_of
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.measured.data import PeriodData
from sea_ident.plain import plain
from sea_ident.processing.encoder_steps import EncoderSteps, repeated_errors, step_of

MOST = 0.5
"""Share of the noise floor that steps of encoders make up from which on nothing is told of what they can explain."""

COVERED = 1.5
"""Times what repeats of the steps of a torque up to which all that a model leaves may be that [-]."""

FAST = 0.2
"""Share of its rms speed from which on it is known which way a motor turns [-]."""

WORTH_A_WORD = 0.1
"""And the share from which on a user is told."""

HARDLY = 5.0
"""Times its noise that a deflection must change by (rms) for the torque of its spring to be known."""


def steps_cover(bench: Bench, settled: Settled) -> bool:
    """Whether all that a model leaves may be what steps of encoders do to every period alike.

    They are no noise: their form follows the motion, and an effect of nearly that form can be far beyond what is
    usual by chance.

    Args:
        bench: the recording.
        settled: the model and its noise floor.
    """
    if bench.share_of_steps(settled.fit, settled.noise) <= MOST:
        return False
    return lack_of_fit(bench, settled)[2] >= LACK_LEVEL


def limits(bench: Bench, settled: Settled, steps: EncoderSteps | None, final: Settled) -> tuple[tuple[str, ...], bool]:
    """What the sensors leave open.

    Args:
        bench: the recording.
        settled: the model and its noise floor.
        steps: steps of encoders that do not average out.
        final: the model with what was found.

    Returns:
        What a user should know, and whether what has no name may be that.
    """
    found, springs = list[str](), hardly_deflected(bench.data)
    share = bench.share_of_steps(settled.fit, settled.noise)
    if steps is not None and share > WORTH_A_WORD:
        found.append(
            f"{bench.data.source}: encoder steps do not average out, as they repeat in every period: "
            f"{steps.words(bench.robot.joint_names)}. What they may do to the torques counts as noise and is "
            f"{100.0 * min(share, 1.0):.0f} % of it; smaller effects are not seen. Finer encoders, or motion that "
            "differs a little from period to period, make it less"
        )
    of_torque, covered = torque_steps(bench, final)
    return (*found, *springs, *of_torque), share > MOST or bool(springs) or covered


def torque_steps(bench: Bench, final: Settled) -> tuple[tuple[str, ...], bool]:
    """Steps of torque sensors that do not average out, and whether they may be all that a model leaves.

    Args:
        bench: the recording.
        final: the model with what was found.

    Returns:
        Sentences, and whether no joint is left with more than its steps may be.
    """
    data = bench.data
    if data.periods < 2:
        return (), False
    steps = _steps_of_torque(data)
    errors = repeated_errors(data.period_tau_motor, steps)
    if not np.any(errors > 0.0):
        return (), False
    gap, joints = gap_of(bench, final.fit, final.fit, final.noise), data.robot.joints
    # what is less than the noise of the mean is not in the way of anything
    matter = errors > np.array([gap.noise[joint.name] for joint in joints])
    if not np.any(matter):
        return (), False
    said = ", ".join(
        f"{joint.name} {step:.3g} {joint.torque_unit} ({error:.2g} rms)"
        for joint, step, error, told in zip(joints, steps, errors, matter, strict=True)
        if told
    )
    text = (
        f"{data.source}: the torque or current is read in steps that do not average out, as they repeat in every "
        f"period: {said}. Smaller effects are not seen. A finer sensor, or motion that differs a little from period to "
        "period, makes it less"
    )
    return (text,), all(gap.after[j.name] <= COVERED * error for j, error in zip(joints, errors, strict=True))


def _steps_of_torque(data: PeriodData) -> FloatArray:
    """(n,) steps of the torques or currents [N m] or [N]; 0 where there are none.

    The efficiency of a gear makes two steps of one: that is looked for where the motor drives.
    """
    torque, speed = data.period_tau_motor, np.stack([motion.dtheta for motion in data.period_motions])
    driving = (torque * speed > 0.0) & (np.abs(speed) > FAST * np.std(speed, axis=(0, 1)))
    columns = ((torque[:, :, i], driving[:, :, i]) for i in range(torque.shape[2]))
    return np.array([step_of(values.ravel()) or step_of(values[there]) for values, there in columns])


def hardly_deflected(data: PeriodData) -> tuple[str, ...]:
    """Sentences about springs whose deflection hardly changes beside its noise: their torque is not known."""
    if data.periods < 2:
        return ()
    each = np.stack([motion.deflection for motion in data.period_motions])
    noise = np.sqrt(np.mean(np.var(each, axis=0, ddof=1), axis=0) / data.averaged)
    mean = data.motion.deflection
    rms = np.sqrt(np.mean((mean - mean.mean(axis=0)) ** 2, axis=0))
    return tuple(
        f"{data.source}: the spring of {joint.name} changes its deflection by {rms[i]:.2g} {joint.position_unit} (rms) "
        f"only, {plain(rms[i] / noise[i])} times the noise of its mean: what it carries is not known. Load it more, or "
        "measure it better"
        for i, joint in enumerate(data.robot.joints)
        if joint.elastic and rms[i] < HARDLY * noise[i]
    )
