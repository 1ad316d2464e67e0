"""Periods that are not like the others: with spikes, or where the motion is another one."""

from dataclasses import dataclass

import numpy as np

from sea_ident.discrepancy.measured.closing import SIGNALS
from sea_ident.discrepancy.measured.data import PeriodData, around_reversals

SPIKE = 8.0
"""How many times farther than the farthest sample of a usual period a sample must lie to count as a spike."""

UNSEEN = 1e-4
"""Share of the rms of a torque or an acceleration up to which a usual period may be taken to be away: a simulation
without noise still settles in its last digits [-]."""

MOST_SENSORS = 3
"""Sensors with spikes that are named, at most."""

SPIKE_DISTANCE = 6
"""Samples around a reversal in which no spike is looked for."""

AWAY = 0.05
"""Share of the rms of a position from which on it is away from that of the other periods [-], ..."""

LASTS = 0.05
"""... and share of a period that it is away more than usual where the motion is another: spikes are shorter [-]."""


@dataclass(frozen=True)
class OddPeriods:
    """Periods that are not like the others.

    Attributes:
        spikes: sensors with samples far outside what the other periods show, by period.
        other: periods whose motion is another.
    """

    spikes: dict[int, set[str]]
    other: set[int]

    @property
    def periods(self) -> set[int]:
        """All of them."""
        return {*self.spikes, *self.other}

    def words(self, data: PeriodData, few: bool) -> list[str]:
        """What is said of them, few enough to be left out or not."""
        sensors = list(dict.fromkeys(sensor for p in sorted(self.spikes) for sensor in sorted(self.spikes[p])))
        shown = ", ".join(sensors[:MOST_SENSORS]) + (" and others" if len(sensors) > MOST_SENSORS else "")
        found = []
        for periods, what, why, remedies in (
            (
                set(self.spikes),
                "spikes",
                f"far outside what the other periods show ({shown})",
                ("Check the wiring of the sensor", "Repair the sensor and record again"),
            ),
            (
                self.other,
                "the motion stops or differs",
                "where its position is away from that of the other periods for long",
                ("Cut the recording to where the motion repeats itself",) * 2,
            ),
        ):
            where = ", ".join(str(p + 1) for p in sorted(periods)[:8])
            if periods and few:
                found.append(
                    f"{data.source}: {what} in period(s) {where} of {data.periods}, {why}; these periods were left "
                    f"out. {remedies[0]}"
                )
            elif periods:
                found.append(
                    f"{data.source}: {what} in {len(periods)} of {data.periods} periods ({where}), {why}: too many to "
                    f"leave out. {remedies[1]}"
                )
        return found


def odd_periods(data: PeriodData) -> OddPeriods:
    """Periods with spikes, and those among them whose motion is another."""
    another = _another_motion(data)
    spikes = _spikes(data, another)
    other = another & set(spikes)
    return OddPeriods({p: sensors for p, sensors in spikes.items() if p not in other}, other)


def _spikes(data: PeriodData, other: set[int]) -> dict[int, set[str]]:
    """Sensors with a sample far from its neighbours, farther than any sample of a usual period, by period.

    Reversals are left aside, those of the mean and those of every pass of the same motion: what happens there differs
    from pass to pass by itself, and what stiction holds may be let go much later in one of them. Where steps of an
    encoder repeat, usual periods may be the same to the last step, and one that falls a sample later is no spike.
    """
    if data.periods < 4:
        return {}
    out: dict[int, set[str]] = {}
    kinds = ("ddq", "ddtheta")
    accelerations = [np.stack([getattr(m, kind) for m in data.period_motions]) for kind in kinds]
    none = np.zeros(data.robot.n)
    steps = [none, none]
    if data.step_errors is not None:
        steps = [np.sqrt(np.mean(data.step_errors[:, SIGNALS.index(kind)] ** 2, axis=(0, 1))) for kind in kinds]
    torque = np.diff(
        data.period_tau_motor, n=2, axis=1, prepend=data.period_tau_motor[:, -1:], append=data.period_tau_motor[:, :1]
    )
    beside = data.left_out.copy()
    for p, motion in enumerate(data.period_motions):
        if p not in other:
            beside |= around_reversals(motion, data.equations)
    sensors = ("torque", "link encoder", "motor encoder")
    sizes = [np.sqrt(np.mean(stack**2, axis=(0, 1))) for stack in (data.period_tau_motor, *accelerations)]
    for sensor, stack, size, step in zip(sensors, (torque, *accelerations), sizes, (none, *steps), strict=True):
        least = np.maximum(step, UNSEEN * size)
        for i in range(data.robot.n):
            away = np.ones(data.samples, dtype=np.bool_)
            for e, equation in enumerate(data.equations):
                if equation.index == i:
                    for shift in range(-SPIKE_DISTANCE, SPIKE_DISTANCE + 1):
                        away &= ~np.roll(beside[:, e], shift)
            if np.count_nonzero(away) < 16:
                continue
            largest = np.max(np.abs(stack[:, away, i] - np.median(stack[:, away, i], axis=0)), axis=1)
            for period in np.flatnonzero(largest > SPIKE * max(np.median(largest), least[i])):
                out.setdefault(int(period), set()).add(f"{sensor} of {data.robot.joint_names[i]}")
    return out


def _another_motion(data: PeriodData) -> set[int]:
    """Periods in which a position is away from that of the others for long, as where the motion stops."""
    out: set[int] = set()
    for kind in ("q", "theta"):
        stack = np.stack([getattr(m, kind) for m in data.period_motions])
        usual = np.median(stack, axis=0)
        share = np.mean(np.abs(stack - usual) > AWAY * usual.std(axis=0), axis=1)
        out |= {int(p) for p in np.flatnonzero(np.any(share > LASTS + np.median(share, axis=0), axis=1))}
    return out
