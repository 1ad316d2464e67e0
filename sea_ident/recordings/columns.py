"""Translation of foreign columns into the project's: names, units, gear, encoder counts, signs and zeros."""

import math
import re
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.naming import DIMENSIONS, SI_UNITS, dimension_of
from sea_ident.recordings.stamps import even_stamps

_TURN: Final = 2.0 * math.pi
_ANGLES: Final = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0, "rev": _TURN}
_LENGTHS: Final = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_POSITIONS: Final = {**_ANGLES, **_LENGTHS}

UNITS: Final[dict[str, dict[str, float]]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "position": {**_POSITIONS, "counts": math.nan},
    "velocity": {
        **{f"{unit}/s": factor for unit, factor in _POSITIONS.items()},
        "rpm": _TURN / 60.0,
        "counts/s": math.nan,
    },
    "acceleration": {f"{unit}/s^2": factor for unit, factor in _POSITIONS.items()},
    "effort": {"N m": 1.0, "mN m": 1e-3, "kN m": 1e3, "N": 1.0, "mN": 1e-3, "kN": 1e3},
    "current": {"A": 1.0, "mA": 1e-3},
    "temperature": {"degC": 1.0, "K": 1.0, "degF": 5.0 / 9.0},
}
"""Physical dimension -> unit -> factor to SI (not a number where `counts_per_rev` decides)."""

_UNIT_IN_NAME: Final = re.compile(r"[\[(]([^\[\]()]+)[\])]\s*$")
_TEMPERATURE_ZEROS: Final = {"degC": 0.0, "K": 273.15, "degF": 32.0}


@dataclass(frozen=True)
class ColumnSource:
    """Where a column of a recording comes from, and how it becomes SI units.

    The value is `sign * (raw - zero) * scale * unit factor`, then through the gear: positions, velocities and
    accelerations of the motor shaft divided by `gear_ratio`, torques multiplied by it.

    Attributes:
        name: Column in the file. In files with folders or structures `group/name` or `struct.name`; a column
            of a table `name[k]`, k from 0; in bags `<topic>:<field>:<joint>`.
        unit: Unit in the file, one of `UNITS` for the kind of column; SI by default.
        zero: Reading at the joint's zero [file unit].
        scale: A further factor, for what no unit covers (such as volts to amperes).
        sign: -1 where the file counts the other way round.
        gear_ratio: Motor turns per joint turn, where the file gives the motor shaft before the gear.
        counts_per_rev: Encoder counts per turn, with the unit `counts` or `counts/s`.
        wraps_at: Span [file unit] after which the reading starts again (360 for degrees, 65536 for a 16-bit
            counter); steps of more than half of it are then taken as a wrap and undone.
        interval: For a column of time: samples were taken evenly, this far apart [file unit], and stamped late. Stamps
            are moved to the even grid that is closest to them; samples that were lost leave their places empty.
        time: Time column of this signal, where it has another clock than the rest; with its unit as a
            `ColumnSource`.

    Raises:
        RecordingError: a number is not finite, or zero where it cannot be; `counts` without `counts_per_rev`.
    """

    name: str
    unit: str | None = None
    zero: float = 0.0
    scale: float = 1.0
    sign: Literal[1, -1] = 1
    gear_ratio: float = 1.0
    counts_per_rev: float | None = None
    wraps_at: float | None = None
    interval: float | None = None
    time: "str | ColumnSource | None" = None

    def __post_init__(self) -> None:
        for field in ("zero", "scale", "gear_ratio"):
            value = getattr(self, field)
            if not math.isfinite(value) or (value == 0.0 and field != "zero"):
                raise RecordingError(
                    f"ColumnSource({self.name!r}): {field} is {value}; it must be finite and not 0"
                    if field != "zero"
                    else f"ColumnSource({self.name!r}): zero is {value}; it must be finite"
                )
        for field in ("counts_per_rev", "wraps_at", "interval"):
            value = getattr(self, field)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise RecordingError(f"ColumnSource({self.name!r}): {field} is {value}; it must be positive")
        if self.sign not in (1, -1):
            raise RecordingError(f"ColumnSource({self.name!r}): sign is {self.sign}; it is 1 or -1")
        counts = self.unit in ("counts", "counts/s")
        if counts and self.counts_per_rev is None:
            raise RecordingError(f"ColumnSource({self.name!r}): unit {self.unit!r} needs counts_per_rev")
        if self.counts_per_rev is not None and not counts:
            raise RecordingError(
                f"ColumnSource({self.name!r}): counts_per_rev goes with the unit 'counts' or 'counts/s', "
                f"not {self.unit!r}"
            )


def convert(values: FloatArray, target: str, how: ColumnSource) -> FloatArray:
    """Values of a foreign column in the unit and on the side that the recording's column has.

    Args:
        values: As in the file, shape (N,), [unit of `how`].
        target: Name of the column in the recording, or `time`.
        how: The translation.

    Returns:
        Shape (N,), in SI units.

    Raises:
        RecordingError: the unit does not belong to the kind of column, or a gear ratio is given where none
            applies.
    """
    dimension = dimension_of(target)
    if dimension is None:
        raise RecordingError(
            f"columns: {target!r} is not a column of a recording; there are time and <kind>_<joint> "
            f"with the kinds {', '.join(DIMENSIONS)}"
        )
    known = UNITS[dimension]
    if how.unit is not None and how.unit not in known:
        raise RecordingError(
            f"columns: {target} from {how.name!r} has the unit {how.unit!r}; "
            f"a {dimension} has one of {', '.join(known)}"
        )
    if how.unit is None or how.unit in SI_UNITS[dimension].split(" or "):
        factor = 1.0
    elif how.counts_per_rev is not None:
        factor = _TURN / how.counts_per_rev
    else:
        factor = known[how.unit]
    raw = values
    if how.wraps_at is not None and np.all(np.isfinite(values)):
        raw = np.unwrap(values, period=how.wraps_at)
    if how.interval is not None:
        if dimension != "time":
            raise RecordingError(f"columns: {target} from {how.name!r} has an interval, which goes with time only")
        if np.all(np.isfinite(values)) and len(values) > 1:
            raw = even_stamps(values, how.interval, how.name)
    zero = how.zero + (_TEMPERATURE_ZEROS[how.unit or "degC"] if dimension == "temperature" else 0.0)
    factor *= how.scale * how.sign * _gear(target, dimension, how)
    converted: FloatArray = (raw - zero) * factor if zero != 0.0 else raw * factor
    return converted


def check_unit_in_name(target: str, how: ColumnSource, source: str) -> None:
    """Refuse a unit that is not the one which the name in the file ends with, as `Position (deg)` does.

    Args:
        target: Name of the column in the recording, or `time`.
        how: The translation.
        source: File name for messages.

    Raises:
        RecordingError: the two differ, and no scale explains it.
    """
    match = _UNIT_IN_NAME.search(how.name)
    dimension = dimension_of(target)
    if match is None or dimension is None or how.scale != 1.0:
        return
    spelled = match[1].strip().replace("²", "^2").replace("°", "deg").replace("µ", "u")
    known = {name.replace(" ", "").lower(): name for name in UNITS[dimension]}
    named = known.get(spelled.replace(" ", "").replace("*", "").replace("·", "").lower())
    if named is None or named[:1].lower() != spelled[:1].lower():
        return
    stated = how.unit or ""
    standard = SI_UNITS[dimension].split(" or ")
    if named == stated or (named in standard and (how.unit is None or stated in standard)):
        return
    raise RecordingError(
        f"{source}: column {how.name!r} says that it is in {match[1]}, and {target} is to be read from it in "
        f"{how.unit or SI_UNITS[dimension]}: say unit={named}, or take the unit out of the name of the column"
    )


def describe(target: str, how: ColumnSource) -> str:
    """One line saying what `convert` did."""
    parts = [f"{target} from {how.name!r}"]
    if how.unit is not None:
        parts.append(f"in {how.unit}")
    if how.counts_per_rev is not None:
        parts.append(f"{how.counts_per_rev:g} counts per turn")
    if how.wraps_at is not None:
        parts.append(f"wraps at {how.wraps_at:g} undone")
    if how.interval is not None:
        parts.append(f"stamps put on an even grid of {how.interval:g}")
    if how.zero != 0.0:
        parts.append(f"zero at {how.zero:g}")
    if how.scale != 1.0 or how.sign != 1:
        parts.append(f"times {how.scale * how.sign:g}")
    if how.gear_ratio != 1.0:
        parts.append(f"before a gear of {how.gear_ratio:g}")
    return ", ".join(parts)


def _gear(target: str, dimension: str, how: ColumnSource) -> float:
    if how.gear_ratio == 1.0:
        return 1.0
    if dimension not in ("position", "velocity", "acceleration", "effort"):
        raise RecordingError(f"columns: {target} from {how.name!r} has a gear_ratio, but a {dimension} passes no gear")
    return how.gear_ratio if dimension == "effort" else 1.0 / how.gear_ratio


def as_source(value: "str | ColumnSource") -> ColumnSource:
    """A plain name is a column in SI units."""
    return ColumnSource(value) if isinstance(value, str) else value
