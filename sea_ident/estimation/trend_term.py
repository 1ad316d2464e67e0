"""What changes in the course of a recording, beside the model of its mean."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, State, corrected_motion, effect_from_dict
from sea_ident.effects.drift import TrendEffect
from sea_ident.exceptions import ModelFileError
from sea_ident.motion import Motion
from sea_ident.processing import ProcessedRecording
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TrendTerm:
    """An effect that changes in the course of a recording, as a comparison of its periods shows it.

    Attributes:
        effect: the effect, none at the moment of which the other parameters of the model are.
        values: (k,) values of its columns.
        stds: (k,) their standard deviations.
    """

    effect: TrendEffect
    values: tuple[float, ...]
    stds: tuple[float, ...]

    def summary(self, robot: Robot) -> str:
        """One line."""
        names = [f"{column.name} {{}} +- {{}} {column.unit}" for column in self.effect.columns(robot)]
        numbers = zip(names, self.values, self.stds, strict=True)
        parts = [name.format(f"{value:.6g}", f"{std:.3g}") for name, value, std in numbers]
        return f"{self.effect.title}: {', '.join(parts)}; none {self.effect.moment}"

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can hold."""
        return {"effect": self.effect.to_dict(), "values": list(self.values), "stds": list(self.stds)}

    @classmethod
    def from_dict(cls, record: Mapping[str, Any], robot: Robot) -> "TrendTerm":
        """What `to_dict` wrote.

        Raises:
            ModelFileError: an effect that does not change in time, or numbers that are not those of its columns.
        """
        effect = effect_from_dict(record["effect"])
        if not isinstance(effect, TrendEffect):
            raise ModelFileError(f"the trend {effect.title} is an effect that does not change in a recording")
        values, stds = (tuple(float(number) for number in record[key]) for key in ("values", "stds"))
        count = len(effect.columns(robot))
        if not (len(values) == len(stds) == count and np.all(np.isfinite([*values, *stds]))):
            raise ModelFileError(f"the trend {effect.title} needs {count} finite values and standard deviations")
        return cls(effect, values, stds)


def trend_torque(
    robot: Robot,
    effects: Sequence[Effect],
    trends: Sequence[TrendTerm],
    motion: Motion,
    channels: Mapping[str, FloatArray] | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Motor torque of trends on a motion.

    Args:
        robot: the robot.
        effects: effects of the model beside them.
        trends: the trends.
        motion: (N, n), its times those since the recording began.
        channels: further measured signals (N, n) by kind, for effects that need them.

    Returns:
        (N, n) torque, and (N, n) its variance by the standard deviations of the values [N m] or [N].

    Raises:
        EffectError: a signal that a trend follows is not among the channels.
    """
    torque, variance = np.zeros((2, len(motion), robot.n))
    state = State(robot, corrected_motion(robot, effects, motion), channels)
    for trend in trends:
        part = trend.effect.evaluate(state)
        rows = part.link + part.motor
        torque += rows @ np.array(trend.values)
        variance += rows**2 @ np.array(trend.stds) ** 2
    return torque, variance


def trend_torques(
    robot: Robot, effects: Sequence[Effect], trends: Sequence[TrendTerm], processed: ProcessedRecording
) -> tuple[FloatArray, FloatArray]:
    """Motor torque of trends in a recording.

    Args:
        robot: the robot.
        effects: effects of the model beside them.
        trends: the trends.
        processed: the recording.

    Returns:
        (N, n) in the mean of the periods and (P, N, n) in each, none of these where there is one stretch [N m] or [N].

    Raises:
        EffectError: a signal that a trend follows was not recorded.
    """
    motion, channels = processed.motion, processed.channels
    since = motion.time - motion.time[0]
    if processed.period is None or not processed.period_motions:
        alone = trend_torque(robot, effects, trends, replace(motion, time=since), channels)[0]
        return alone, np.zeros((0, *alone.shape))
    starts = np.array(processed.places or range(processed.periods)) * processed.period
    each = [
        trend_torque(robot, effects, trends, replace(own, time=since + start), channels)[0]
        for own, start in zip(processed.period_motions, starts, strict=True)
    ]
    return np.asarray(np.mean(each, axis=0), dtype=np.float64), np.stack(each)
