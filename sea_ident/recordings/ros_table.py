"""Collecting the messages of one topic into columns with a common clock."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.naming import TIME
from sea_ident.recordings.ros_messages import CHANNELS_TOPIC, DYNAMIC_JOINT_STATE, FIELDS, KINDS
from sea_ident.recordings.table import RawTable

_WALL_CLOCK = 10**9 * 10**9
"""Stamps from here on [ns], in the year 2001, are those of a wall clock."""

_BYTES_PER_MESSAGE = 300

Signal = tuple[str, str]
"""Field (position, velocity, effort or the name of an interface) and joint."""


@dataclass
class _Series:
    """Messages of one topic with the same signals in the same order."""

    stamps: list[int] = field(default_factory=list)
    logged: list[int] = field(default_factory=list)
    rows: list[Any] = field(default_factory=list)


class TopicCollector:
    """Takes the messages of one topic one by one, and gives their columns in the end."""

    def __init__(self, topic: str, kind: str, source: str) -> None:
        self.topic = topic
        self._dynamic = kind == DYNAMIC_JOINT_STATE
        self._where = f"{source}, topic {topic}"
        self._series: dict[tuple[Signal, ...], _Series] = {}
        self._known: dict[Any, tuple[Signal, ...]] = {}
        self.bytes = 0

    def add(self, message: Any, logged: int) -> None:
        """Take a message.

        Args:
            message: JointState or DynamicJointState.
            logged: When it was recorded [ns].

        Raises:
            RecordingError: its fields differ in length.
        """
        stamp = message.header.stamp
        signals, row = self._dynamic_row(message) if self._dynamic else self._row(message)
        series = self._series.setdefault(signals, _Series())
        series.stamps.append(stamp.sec * 10**9 + stamp.nanosec)
        series.logged.append(logged)
        series.rows.append(row)
        self.bytes += 8 * row.size + _BYTES_PER_MESSAGE

    def _row(self, message: Any) -> tuple[tuple[Signal, ...], FloatArray]:
        values = [getattr(message, name) for name in FIELDS]
        sizes = tuple(part.size for part in values)
        key = (*message.name, *sizes)
        if key not in self._known:
            joints = tuple(message.name)
            wrong = [name for name, size in zip(FIELDS, sizes, strict=True) if size not in (0, len(joints))]
            if wrong:
                self._refuse(f"{wrong[0]} has {sizes[FIELDS.index(wrong[0])]} values for {len(joints)} joints")
            given = [name for name, size in zip(FIELDS, sizes, strict=True) if size]
            self._known[key] = self._unique(tuple((name, joint) for name in given for joint in joints))
        return self._known[key], np.concatenate(values)

    def _dynamic_row(self, message: Any) -> tuple[tuple[Signal, ...], FloatArray]:
        parts = message.interface_values
        key = (*message.joint_names, *(name for part in parts for name in (None, *part.interface_names)))
        if key not in self._known:
            if len(parts) != len(message.joint_names):
                self._refuse(f"{len(parts)} interface_values for {len(message.joint_names)} joints")
            for part, joint in zip(parts, message.joint_names, strict=True):
                if part.values.size != len(part.interface_names):
                    self._refuse(f"joint {joint!r} has other numbers of names and values")
            self._known[key] = self._unique(
                tuple(
                    (name, joint)
                    for part, joint in zip(parts, message.joint_names, strict=True)
                    for name in part.interface_names
                )
            )
        row = np.concatenate([part.values for part in parts]) if parts else np.empty(0)
        if row.size != len(self._known[key]):
            self._refuse("other numbers of names and values")
        return self._known[key], row

    def _unique(self, signals: tuple[Signal, ...]) -> tuple[Signal, ...]:
        if len(set(signals)) != len(signals):
            self._refuse("a joint appears twice")
        return signals

    def _refuse(self, why: str) -> None:
        count = sum(len(series.rows) for series in self._series.values())
        raise RecordingError(f"{self._where}, message {count}: {why}")

    def clocks(self) -> list[tuple[list[int], tuple[Signal, ...], FloatArray, str]]:
        """Stamps [ns], signals, values of shape (N, signals), and a note, for each set of signals.

        Raises:
            RecordingError: sets of signals overlap without being the same, or only some have stamps.
        """
        merged: dict[frozenset[Signal], tuple[tuple[Signal, ...], list[int], list[FloatArray], bool]] = {}
        for signals, series in self._series.items():
            if not signals:
                continue
            stamped = any(series.stamps)
            stamps = series.stamps if stamped else series.logged
            key = frozenset(signals)
            for other in merged:
                if other != key and other & key:
                    joint = sorted(other & key)[0][1]
                    raise RecordingError(
                        f"{self._where}: joint {joint!r} appears in messages with different sets of joints or fields: "
                        f"{_names(other)}; and {_names(key)}. Record each publisher on a topic of its own"
                    )
            table = np.array(series.rows, dtype=np.float64)
            if key not in merged:
                merged[key] = (signals, list(stamps), [table], stamped)
                continue
            first, times, tables, before = merged[key]
            if before != stamped:
                raise RecordingError(f"{self._where}: some messages have no stamp, but others have one")
            times.extend(stamps)
            tables.append(table[:, [signals.index(signal) for signal in first]])
        found = []
        for signals, times, tables, stamped in merged.values():
            table = np.concatenate(tables)
            if len(tables) > 1:
                order = np.argsort(times, kind="stable")
                times, table = [times[k] for k in order], table[order]
            note = "" if stamped else f"topic {self.topic}: messages have no stamp; the times of recording are used"
            found.append((times, signals, table, note))
        return found


def table_of_topics(topics: list[TopicCollector], left_out: list[str], source: str) -> RawTable:
    """Name the columns of all topics and count time from the same instant.

    Wall-clock stamps are counted from the earliest of all; stamps of before 2001 are taken as they are.

    Args:
        topics: Collectors that have seen all messages.
        left_out: Other topics, for the notes.
        source: File name for messages.

    Returns:
        The table, with the clock of every column.

    Raises:
        RecordingError: a column appears twice.
    """
    parts = [(topic.topic, *clock) for topic in topics for clock in topic.clocks()]
    earliest = min((min(stamps) for _, stamps, *_ in parts), default=0)
    origin = earliest if earliest >= _WALL_CLOCK else 0
    columns: dict[str, FloatArray] = {}
    clocks: dict[str, str] = {}
    notes = [note for *_, note in parts if note]
    if origin:
        notes.append(f"time 0 is the stamp {origin // 10**9}.{origin % 10**9:09d} s")
    count: dict[str, int] = {}
    for topic, stamps, signals, values, _ in parts:
        count[topic] = count.get(topic, 0) + 1
        clock = f"{topic}:{TIME}" if count[topic] == 1 else f"{topic}#{count[topic]}:{TIME}"
        columns[clock] = np.array([stamp - origin for stamp in stamps], dtype=np.float64) / 1e9
        for k, (name, joint) in enumerate(signals):
            column = column_name(topic, name, joint)
            if column in columns:
                raise RecordingError(f"{source}: column {column!r} appears twice")
            columns[column] = values[:, k]
            clocks[column] = clock
    return RawTable(columns, clocks, tuple(left_out), tuple(notes))


def column_name(topic: str, name: str, joint: str) -> str:
    """Name of the column for a field and joint of a topic (see `ros_messages`)."""
    if topic in KINDS and name in FIELDS:
        return f"{KINDS[topic][FIELDS.index(name)]}_{joint}"
    if topic == CHANNELS_TOPIC:
        return f"{name}_{joint}" if joint else name
    return f"{topic}:{name}:{joint}"


def _names(signals: frozenset[Signal]) -> str:
    return ", ".join(f"{name} of {joint}" for name, joint in sorted(signals))
