"""Motor torque at the joint side: measured, or from the current (paper, eqs. 6-7)."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.plain import plain
from sea_ident.recordings import Recording
from sea_ident.robot import Joint, Robot
from sea_ident.robot.describe import counted

SATURATED_SHARE = 0.005
"""Share of the samples at the very extreme of a current from which on it is called saturated."""

SAME = 0.03
"""Deviation of a measured torque from that by current without a word [-]."""

ALIKE = 0.9
"""Likeness of the two from which on there is a factor between them [-]."""

SPIKE = 20.0
"""Distance from the median of five samples, over that of 99 % of the samples, from which on one is a spike [-]. A push
makes a controller answer by ten."""

FEWEST_FOR_SPIKES = 200
"""Samples from which on spikes are looked for."""

COARSE = 50
"""Different values of a torque below which every top is flat, cut or not."""


@dataclass(frozen=True, eq=False)
class TorqueSource:
    """Where the torque of every joint comes from, before the efficiency.

    Attributes:
        values: (M, n) torque at the joint side without losses of the transmission [N m] or [N].
        columns: (n,) columns they come from.
        efficiency: (n,) eta where the torque comes from a current, 1 where it was measured [-].
        notes: what was used.
        warnings: saturation and the like.
    """

    values: FloatArray
    columns: tuple[str, ...]
    efficiency: FloatArray
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def torque_source(recording: Recording, robot: Robot) -> TorqueSource:
    """Measured torques where there are, else currents times torque constant and gear ratio.

    Args:
        recording: the recording.
        robot: the robot.

    Returns:
        The torques.

    Raises:
        RecordingError: a joint has neither, or a current without a torque constant.
    """
    values = np.empty((recording.samples, robot.n))
    efficiency = np.ones(robot.n)
    columns: list[str] = []
    notes, warnings = [], []
    for i, joint in enumerate(robot.joints):
        if recording.has("tau_motor", joint.name):
            values[:, i] = recording.channel("tau_motor", [joint.name])[:, 0]
            if recording.has("current", joint.name):
                notes.append(f"{joint.name}: tau_motor_{joint.name} is used, current_{joint.name} is not")
                warnings += _disagreement(recording, joint, values[:, i])
            kind = "tau_motor"
        elif recording.has("current", joint.name):
            actuator = joint.actuator
            if actuator is None or actuator.torque_constant is None:
                raise RecordingError(
                    f"{recording.source}: joint {joint.name!r} has only current_{joint.name}, and the annotation of "
                    f"{robot.name} gives no <torqueConstant> for it; add it, or record tau_motor_{joint.name}"
                )
            current = recording.channel("current", [joint.name])[:, 0]
            values[:, i] = actuator.gear_ratio * actuator.torque_constant * current
            efficiency[i] = 1.0 if actuator.efficiency is None else actuator.efficiency
            kind = "current"
        else:
            raise RecordingError(
                f"{recording.source}: joint {joint.name!r} has neither tau_motor_{joint.name} nor "
                f"current_{joint.name}; without a motor torque nothing can be identified. "
                f"There are: time, {', '.join(recording.columns)}"
            )
        columns.append(f"{kind}_{joint.name}")
        warnings += filter(None, (_saturation(values[:, i], columns[-1], recording.source),))
        warnings += _spikes(recording, values[:, i], columns[-1])
    return TorqueSource(values, tuple(columns), efficiency, tuple(notes), tuple(warnings))


def transmitted(torque: FloatArray, efficiency: FloatArray, direction: FloatArray) -> FloatArray:
    """Factor of the transmission, eta where the motor drives and 1 / eta where it is driven (paper, eq. 7).

    Args:
        torque: (N, n) mean torque without losses, which decides the direction so that noise is not rectified.
        efficiency: (n,) eta [-].
        direction: (N, n) motor velocity.

    Returns:
        (N, n) factor [-].
    """
    sign = np.sign(torque * direction)
    return efficiency**sign


def _disagreement(recording: Recording, joint: Joint, torque: FloatArray) -> list[str]:
    """Whether a measured torque is not what the current gives, by more than losses of the transmission."""
    actuator = joint.actuator
    if actuator is None or actuator.torque_constant is None:
        return []
    by_current = actuator.gear_ratio * actuator.torque_constant * recording.channel("current", [joint.name])[:, 0]
    power = float(by_current @ by_current)
    if power == 0.0 or np.ptp(torque) == 0.0:
        return []
    factor = float(by_current @ torque) / power
    lost = 1.0 if actuator.efficiency is None else actuator.efficiency
    alike = factor * power**0.5 / float(torque @ torque) ** 0.5
    if alike > ALIKE and lost * (1.0 - SAME) <= factor <= (1.0 + SAME) / lost:
        return []
    what = f"is {factor:.4g} times" if alike > ALIKE else f"does not run like (likeness {alike:.2f})"
    return [
        f"{recording.source}: tau_motor_{joint.name} {what} what current_{joint.name} gives by the torque constant "
        f"{actuator.torque_constant:.4g} N m/A and the gear ratio {actuator.gear_ratio:g}. tau_motor_{joint.name} is "
        "used: if the current is right, leave the torque out of the file; else correct what is described"
    ]


def _spikes(recording: Recording, values: FloatArray, column: str) -> list[str]:
    """Whether single samples of a torque are far from their neighbours: a few of them outweigh all others."""
    if len(values) < FEWEST_FOR_SPIKES:
        return []
    beside = np.abs(values - median_filter(values, 5, mode="nearest"))
    usual = max(float(np.percentile(beside, 99.0)), 1e-12 * float(np.ptp(values)))
    spikes = np.flatnonzero(beside > max(SPIKE * usual, float(np.std(values))))
    if not spikes.size:
        return []
    k = int(spikes[0])
    return [
        f"{recording.source}: column {column} has {counted(spikes.size, 'spike')}, the first at sample {k} (time "
        f"{recording.time[k]:g} s), {plain(beside[k] / usual, 3)} times as far from its neighbours as 99 % of the "
        "samples: a few such samples outweigh the others. Look at the sensor and its wiring, or identify with the "
        "robust estimator"
    ]


def _saturation(values: FloatArray, column: str, source: str) -> str:
    if 1 < len(np.unique(values)) < COARSE:
        return ""
    for extreme, side in ((values.max(), "highest"), (values.min(), "lowest")):
        if values.max() == values.min():
            return (
                f"{source}: column {column} is constant, {values[0]:g}: it is no measured torque, and spoils what is "
                "identified of all joints. Record it, or leave the joint out (joints, on the command line --joints)"
            )
        at = np.isclose(values, extreme, rtol=1e-9, atol=0.0)
        # a sampled signal has a flat top only where something cuts it
        flat = at[1:] & at[:-1]
        if flat.mean() > SATURATED_SHARE and abs(extreme) > 0.5 * np.abs(values).max():
            return (
                f"{source}: column {column} stays at its {side} value in {100.0 * at.mean():.1f} % of the samples: "
                "it is saturated, and torque beyond it is missing. Leave out that part or excite less"
            )
    return ""
