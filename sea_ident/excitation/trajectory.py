"""The trajectory that a controller plays: ramp in, whole periods, ramp out."""

import csv
from pathlib import Path
from typing import Final

import numpy as np

from sea_ident.atomic import atomic_file
from sea_ident.exceptions import ExcitationError, OutputError
from sea_ident.excitation.result import Excitation
from sea_ident.motion import Motion

CSV_RATE: Final = 1000.0
"""Samples per second of a table that a controller plays as it is [Hz]."""


def sample_trajectory(excitation: Excitation, rate: float, periods: int = 1) -> Motion:
    """Sample an excitation, with its ramps where it has them.

    Args:
        excitation: the excitation.
        rate: samples per second [Hz].
        periods: whole periods between the ramps. With ramps the motion goes on from there to the phase at which the
            ramp out begins; without them it starts at the phase 0 of the series.

    Returns:
        The motion from time 0 on; the last sample is the one before the end of the last period, or the rest after the
        ramp out.

    Raises:
        ExcitationError: a rate that cannot show the highest harmonic, or less than one period.
    """
    series = excitation.series
    check_sampling(series.base_frequency, series.harmonics, rate, periods)
    ramp_in, ramp_out = excitation.ramp_in, excitation.ramp_out
    begin, first = (0.0, 0.0) if ramp_in is None else (ramp_in.duration, ramp_in.phase)
    end = begin + periods * series.period
    if ramp_out is not None:
        end += (ramp_out.phase - first) % series.period
    total = end if ramp_out is None else end + ramp_out.duration
    count = int(np.ceil(total * rate - 1e-9)) + (ramp_out is not None)
    time = np.arange(count, dtype=np.float64) / rate
    parts = []
    if ramp_in is not None:
        parts.append(ramp_in.motion(time[time < begin]))
    inside = (time >= begin) & (time < end)
    parts.append(series.motion(time[inside] - begin + first))
    if ramp_out is not None:
        parts.append(ramp_out.motion(np.minimum(time[time >= end] - end, ramp_out.duration)))
    joined = Motion.concatenate(parts)
    return Motion.rigid(time, joined.q, joined.dq, joined.ddq)


def check_sampling(base_frequency: float, harmonics: int, rate: float, periods: int) -> None:
    """Refuse samples that could not show a motion.

    Args:
        base_frequency: of its series [Hz].
        harmonics: L.
        rate: samples per second [Hz].
        periods: whole periods.

    Raises:
        ExcitationError: a rate that cannot show the highest harmonic, or less than one period.
    """
    highest = harmonics * base_frequency
    if not (np.isfinite(rate) and rate > 2.0 * highest):
        raise ExcitationError(
            f"rate is {rate} Hz; the highest harmonic is {highest:g} Hz, which needs more than {2 * highest:g}"
        )
    if periods < 1:
        raise ExcitationError(f"periods is {periods}; give at least 1")


def write_trajectory_csv(excitation: Excitation, path: str | Path, rate: float = CSV_RATE, periods: int = 1) -> None:
    """Write time, positions, velocities and accelerations of all joints as CSV, in SI units.

    The file is complete or is not there. Columns: ``time``, then ``q_<joint>``, ``dq_<joint>``, ``ddq_<joint>``.

    Args:
        excitation: the excitation.
        path: of the file.
        rate: samples per second [Hz].
        periods: whole periods.

    Raises:
        ExcitationError: as `sample_trajectory`, or the file cannot be written.
    """
    motion = sample_trajectory(excitation, rate, periods)
    header = ["time", *(f"{kind}_{name}" for kind in ("q", "dq", "ddq") for name in excitation.joint_names)]
    table = np.column_stack([motion.time, motion.q, motion.dq, motion.ddq])
    try:
        with atomic_file(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(header)
            writer.writerows([repr(float(value)) for value in row] for row in table)
    except OutputError as error:
        raise ExcitationError(str(error)) from error
