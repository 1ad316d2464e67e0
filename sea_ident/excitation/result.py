"""The exciting trajectory that a design returns, and its file."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.arguments import as_path
from sea_ident.atomic import atomic_file
from sea_ident.exceptions import ExcitationError, OutputError
from sea_ident.excitation.ramp import RampMotion
from sea_ident.motion import FourierSeries

FORMAT = "sea_ident excitation"
VERSION = 1
_EXACT = ("position", "velocity", "acceleration")
"""Limits whose margins are the smallest distances themselves; those of others are proven."""

_DISTANCES = 5
"""Distances between links that a summary shows."""


@dataclass(frozen=True, eq=False)
class Excitation:
    """A periodic trajectory that excites a robot inside its limits.

    Attributes:
        series: the trajectory.
        joint_names: (n,) joints, in the order of the series.
        robot: what `load_robot` was given.
        criterion: name of the criterion that was raised.
        value: the criterion; larger is better.
        log_det: natural log of det(F' F) over the samples of one period.
        condition_number: of F with its columns divided by their norms (paper, section II-B).
        raw_condition_number: of F as it is.
        parameters: (p,) names of the columns of F.
        samples: samples per period in F.
        margins: smallest distance to every limit over all t, in the unit of the limit; >= 0 is inside. That of torques,
            deflections and distances between bodies is proven, so it is more in truth where it is large. Links go where
            motors go (theta = q), unless the design was made for links on springs: it then is that of whichever is
            nearer, with torques of the motion on springs.
        limits: lower and upper value of every limit.
        starts: number of random starts that were climbed from.
        start_values: criterion that each start reached.
        seed: of the random starts.
        seconds: time that the design took [s].
        ramp_in: motion from rest into the periodic one, None where none was asked for.
        ramp_out: motion from the periodic one to rest.
        link_margins: the same for links that follow on springs of the stiffness that the description gives, negative
            where they leave a limit while the motors play the trajectory; empty where no stiffness is given.
        warnings: what a user should know.
    """

    series: FourierSeries
    joint_names: tuple[str, ...]
    robot: str
    criterion: str
    value: float
    log_det: float
    condition_number: float
    raw_condition_number: float
    parameters: tuple[str, ...]
    samples: int
    margins: dict[str, float]
    limits: dict[str, tuple[float, float]]
    starts: int
    start_values: tuple[float, ...]
    seed: int
    seconds: float
    ramp_in: RampMotion | None = None
    ramp_out: RampMotion | None = None
    link_margins: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def base_frequency(self) -> float:
        """[Hz]."""
        return self.series.base_frequency

    @property
    def period(self) -> float:
        """[s]."""
        return self.series.period

    def summary(self) -> str:
        """Criterion and margins as text."""
        how = f"best of {self.starts} starts" if self.starts else "the trajectory as it was given, or moved inside,"
        lines = [
            f"excitation of {self.robot}: {len(self.joint_names)} joints, {self.series.harmonics} harmonics of "
            f"{self.base_frequency:g} Hz, {len(self.parameters)} parameters",
            f"  criterion {self.criterion}: {self.value:.4f}; {how} in {self.seconds:.1f} s",
            f"  log det {self.log_det:.4f}, condition number {self.condition_number:.4g} "
            f"({self.raw_condition_number:.4g} without normalisation), {self.samples} samples",
        ]
        lines.extend(self._margin_lines())
        if self.ramp_in is not None and self.ramp_out is not None:
            lines.append(f"  ramps: {self.ramp_in.duration:g} s in, {self.ramp_out.duration:g} s out")
        lines.extend(f"  warning: {text}" for text in self.warnings)
        return "\n".join(lines)

    def _margin_lines(self) -> list[str]:
        """One line for every limit; of the distances between links those with the least room."""
        apart = sorted(
            (name for name in self.margins if name.endswith(".distance")), key=lambda name: self.margins[name]
        )
        left_out = apart[_DISTANCES:]
        shown = [name for name in self.margins if name not in left_out]
        width = max((len(name) for name in shown), default=0)
        lines = []
        for name in shown:
            lower, upper = self.limits[name]
            exact = name.rpartition(".")[2] in _EXACT or self.link_margins.get(name) == self.margins[name]
            proven = "" if exact else "at least "
            lines.append(f"  {name:<{width}}  [{lower:.5g}, {upper:.5g}]  margin {proven}{self.margins[name]:.3g}")
        if left_out:
            least = self.margins[left_out[0]]
            lines.append(f"  {len(left_out)} more pairs of links  margin at least {least:.3g}")
        return lines

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can hold; `read_excitation` reads it."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "robot": self.robot,
            "joints": list(self.joint_names),
            "base_frequency": self.base_frequency,
            "harmonics": self.series.harmonics,
            "offset": self.series.offset.tolist(),
            "a": self.series.a.tolist(),
            "b": self.series.b.tolist(),
            "criterion": self.criterion,
            "value": self.value,
            "log_det": self.log_det,
            "condition_number": self.condition_number,
            "raw_condition_number": self.raw_condition_number,
            "parameters": list(self.parameters),
            "samples": self.samples,
            "margins": self.margins,
            "link_margins": self.link_margins,
            "limits": {name: [_finite(lower), _finite(upper)] for name, (lower, upper) in self.limits.items()},
            "starts": self.starts,
            "start_values": list(self.start_values),
            "seed": self.seed,
            "seconds": self.seconds,
            "ramp_in": None if self.ramp_in is None else self.ramp_in.to_dict(),
            "ramp_out": None if self.ramp_out is None else self.ramp_out.to_dict(),
            "warnings": list(self.warnings),
        }

    def save(self, path: str | Path) -> None:
        """Write it as JSON; the file is complete or is not there.

        Raises:
            ExcitationError: the file cannot be written.
        """
        text = json.dumps(self.to_dict(), indent=1, allow_nan=False)
        try:
            with atomic_file(path) as temporary:
                temporary.write_text(text + "\n", encoding="utf-8")
        except OutputError as error:
            raise ExcitationError(str(error)) from error


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def read_excitation(path: str | Path) -> Excitation:
    """Read what `Excitation.save` wrote.

    Args:
        path: of the JSON file.

    Returns:
        The excitation.

    Raises:
        ExcitationError: not such a file, or one that is incomplete or damaged.
    """
    try:
        record = json.loads(as_path(path, "read_excitation: path").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ExcitationError(f"{path}: cannot be read as an excitation: {error}") from None
    if not isinstance(record, Mapping) or record.get("format") != FORMAT:
        raise ExcitationError(f"{path}: is not an excitation; write one with design_excitation(...).save(path)")
    if record.get("version") != VERSION:
        raise ExcitationError(f"{path}: has version {record.get('version')!r}; this program reads version {VERSION}")
    try:
        return _from_record(record, path)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ExcitationError(f"{path}: the excitation is damaged: {type(error).__name__}: {error}") from None


def _array(record: Mapping[str, Any], key: str, shape: tuple[int, ...]) -> FloatArray:
    values = np.asarray(record[key], dtype=np.float64)
    if values.shape != shape or not np.all(np.isfinite(values)):
        raise ValueError(f"{key} must hold {shape} finite numbers")
    return values


def _from_record(record: Mapping[str, Any], path: str | Path) -> Excitation:
    joints = tuple(str(name) for name in record["joints"])
    n, harmonics = len(joints), int(record["harmonics"])
    frequency = float(record["base_frequency"])
    if not (np.isfinite(frequency) and frequency > 0.0):
        raise ValueError(f"base_frequency is {frequency}")
    if set(record["limits"]) != set(record["margins"]):
        raise ValueError("limits and margins name different limits")
    # files of earlier versions have none
    link_margins = {str(name): float(value) for name, value in record.get("link_margins", {}).items()}
    if not set(link_margins) <= set(record["limits"]):
        raise ValueError("link_margins names limits that are not among the limits")
    return Excitation(
        series=FourierSeries(
            frequency,
            _array(record, "offset", (n,)),
            _array(record, "a", (n, harmonics)),
            _array(record, "b", (n, harmonics)),
        ),
        joint_names=joints,
        robot=str(record["robot"]),
        criterion=str(record["criterion"]),
        value=float(record["value"]),
        log_det=float(record["log_det"]),
        condition_number=float(record["condition_number"]),
        raw_condition_number=float(record["raw_condition_number"]),
        parameters=tuple(str(name) for name in record["parameters"]),
        samples=int(record["samples"]),
        margins={str(name): float(value) for name, value in record["margins"].items()},
        limits={
            str(name): (-np.inf if low is None else float(low), np.inf if high is None else float(high))
            for name, (low, high) in record["limits"].items()
        },
        starts=int(record["starts"]),
        start_values=tuple(float(value) for value in record["start_values"]),
        seed=int(record["seed"]),
        seconds=float(record["seconds"]),
        ramp_in=None if record["ramp_in"] is None else RampMotion.from_dict(record["ramp_in"], n),
        ramp_out=None if record["ramp_out"] is None else RampMotion.from_dict(record["ramp_out"], n),
        link_margins=link_margins,
        warnings=tuple(str(text) for text in record["warnings"]),
    )
