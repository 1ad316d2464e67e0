"""Writing recordings as ROS 1 bags, ROS 2 bags (MCAP or SQLite in a folder) and single MCAP or SQLite files."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sea_ident.atomic import scratch_folder
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.naming import split_name
from sea_ident.recordings.recording import Recording
from sea_ident.recordings.ros_messages import (
    CHANNELS_TOPIC,
    DYNAMIC_JOINT_STATE,
    JOINT_STATE,
    KINDS,
    message_types,
)

_LATEST_STAMP = 2**31 - 1

Storage = Literal["mcap", "sqlite3"]


def write_ros1_bag(recording: Recording, path: Path) -> None:
    """Write a ROS 1 bag (topics: see `ros_messages`).

    Args:
        recording: What to write; times from 0 to 2^31 s.
        path: File to be created.

    Raises:
        RecordingError: times that stamps cannot hold.
        MissingExtraError: rosbags is not installed.
    """
    store = message_types(1, "writing ROS bags")
    from rosbags.rosbag1 import Writer

    with Writer(path) as writer:
        _write(recording, writer, store, store.serialize_ros1)


def write_ros2_bag(recording: Recording, path: Path, storage: Storage = "mcap") -> None:
    """Write a ROS 2 bag, a folder (topics: see `ros_messages`).

    Args:
        recording: What to write; times from 0 to 2^31 s.
        path: Folder to be created.
        storage: Format of the file in it.

    Raises:
        RecordingError: times that stamps cannot hold.
        MissingExtraError: rosbags is not installed.
    """
    store = message_types(2, "writing ROS bags")
    from rosbags.rosbag2 import StoragePlugin, Writer

    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(path, version=8, storage_plugin=plugin) as writer:
        _write(recording, writer, store, store.serialize_cdr)


def _write(recording: Recording, writer: Any, store: Any, serialize: Any) -> None:
    stamps = np.round(recording.time * 1e9)
    if recording.time[0] < 0.0 or recording.time[-1] > _LATEST_STAMP:
        raise RecordingError(
            f"time runs from {recording.time[0]:g} s to {recording.time[-1]:g} s, but stamps run from 0 to "
            f"{_LATEST_STAMP} s; write another format, or shift time"
        )
    rest = dict(recording.columns)
    topics = []
    for topic, kinds in KINDS.items():
        joints = [parts[1] for parts in map(split_name, recording.columns) if parts and parts[0] == kinds[0]]
        if joints:
            arrays = [_all_joints(rest, kind, joints) for kind in kinds]
            topics.append((topic, JOINT_STATE, _joint_states(joints, arrays)))
    if rest:
        topics.append((CHANNELS_TOPIC, DYNAMIC_JOINT_STATE, _channels(store, rest)))
    streams = [(writer.add_connection(topic, kind, typestore=store), kind, parts) for topic, kind, parts in topics]
    header, clock = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    counted = "seq" in header.__dataclass_fields__
    for k, stamp in enumerate(stamps.astype(np.int64).tolist()):
        time = clock(sec=stamp // 10**9, nanosec=stamp % 10**9)
        head = header(seq=k, stamp=time, frame_id="") if counted else header(stamp=time, frame_id="")
        for connection, kind, parts in streams:
            message = store.types[kind](head, **next(parts))
            writer.write(connection, stamp, serialize(message, kind))


def _all_joints(rest: dict[str, Any], kind: str, joints: list[str]) -> Any:
    """Take the columns of a kind out of the rest, shape (N, joints); none of them unless all joints have it."""
    names = [f"{kind}_{joint}" for joint in joints]
    if any(name not in rest for name in names):
        return None
    return np.column_stack([rest.pop(name) for name in names])


def _joint_states(joints: list[str], arrays: list[Any]) -> Iterator[dict[str, Any]]:
    empty = np.empty(0)
    position, velocity, effort = arrays
    for k in range(len(position)):
        yield {
            "name": joints,
            "position": position[k],
            "velocity": empty if velocity is None else velocity[k],
            "effort": empty if effort is None else effort[k],
        }


def _channels(store: Any, rest: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Messages with the other columns by joint; those of no joint stand under the empty name."""
    by_joint: dict[str, list[tuple[str, str]]] = {}
    for name in rest:
        kind, joint = split_name(name) or (name, "")
        by_joint.setdefault(joint, []).append((kind, name))
    value = store.types["control_msgs/msg/InterfaceValue"]
    names = list(by_joint)
    kinds = [[kind for kind, _ in pairs] for pairs in by_joint.values()]
    tables = [np.column_stack([rest[name] for _, name in pairs]) for pairs in by_joint.values()]
    for k in range(len(tables[0])):
        values = [value(interface_names=of, values=table[k]) for of, table in zip(kinds, tables, strict=True)]
        yield {"joint_names": names, "interface_values": values}


def write_mcap_file(recording: Recording, path: Path) -> None:
    """Write a single MCAP file, as `write_ros2_bag` puts it into its folder."""
    _write_single(recording, path, "mcap", ".mcap")


def write_sqlite_file(recording: Recording, path: Path) -> None:
    """Write a single SQLite file, as `write_ros2_bag` puts it into its folder."""
    _write_single(recording, path, "sqlite3", ".db3")


def _write_single(recording: Recording, path: Path, storage: Storage, suffix: str) -> None:
    with scratch_folder(path) as folder:
        write_ros2_bag(recording, folder / "bag", storage)
        os.replace(folder / "bag" / f"bag{suffix}", path)
