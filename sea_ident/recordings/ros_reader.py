"""Reading recordings from ROS 1 bags, ROS 2 bags (MCAP or SQLite) and single MCAP or SQLite files.

Only `sensor_msgs/JointState` and `control_msgs/DynamicJointState` are read, by the definitions of this project;
those stored in a bag are not compiled. Everything is unpacked within the memory limit only.
"""

import tempfile
from collections.abc import Collection
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from sea_ident.exceptions import RecordingError
from sea_ident.recordings.ros_compression import (
    bound_ros1_chunks,
    check_mcap_chunks,
    unpack_file,
    unpack_message,
)
from sea_ident.recordings.ros_messages import (
    CHANNELS_TOPIC,
    DYNAMIC_JOINT_STATE,
    JOINT_STATE,
    KINDS,
    message_types,
)
from sea_ident.recordings.ros_table import TopicCollector, table_of_topics
from sea_ident.recordings.table import RawTable, check_size

_OWN_TOPICS = frozenset([*KINDS, CHANNELS_TOPIC])
_STORAGE = (".mcap", ".db3")
_PACKED = tuple(suffix + ".zstd" for suffix in _STORAGE)


def read_ros1_bag(path: Path, names: Collection[str] | None, memory_limit: int) -> RawTable:
    """Read a ROS 1 bag.

    Args:
        path: The file.
        names: Columns wanted, `<topic>:<field>:<joint>`; those of this project's own topics if None.
        memory_limit: Bytes that its signals, or one of its chunks, may take.

    Returns:
        The table, with the clock of every column.

    Raises:
        RecordingError: not a bag, no such topics, or too large.
        MissingExtraError: rosbags is not installed.
    """
    store = message_types(1, f"{path}: reading ROS bags")
    from rosbags.rosbag1 import Reader

    collect = _Collection(names, path, memory_limit)
    with Reader(path) as reader:
        bound_ros1_chunks(reader, memory_limit, path)
        collect.add_messages(reader, store.deserialize_ros1)
    return collect.table()


def read_ros2_bag(path: Path, names: Collection[str] | None, memory_limit: int) -> RawTable:
    """Read a ROS 2 bag: a folder with storage files (all of them are read), or one MCAP or SQLite file.

    Args:
        path: The folder or file.
        names: Columns wanted, `<topic>:<field>:<joint>`; those of this project's own topics if None.
        memory_limit: Bytes that its signals, one of its chunks, or a file compressed as a whole may take.

    Returns:
        The table, with the clock of every column.

    Raises:
        RecordingError: not a bag, no such topics, or too large.
        MissingExtraError: rosbags is not installed.
    """
    store = message_types(2, f"{path}: reading ROS bags")
    from rosbags.rosbag2 import Reader

    collect = _Collection(names, path, memory_limit)
    with ExitStack() as stack:
        for file in storage_files(path) if path.is_dir() else [path]:
            if file.name.endswith(_PACKED):
                folder = stack.enter_context(tempfile.TemporaryDirectory())
                unpacked = Path(folder) / file.stem
                unpack_file(file, unpacked, memory_limit)
                file = unpacked
            chunks = check_mcap_chunks(file, memory_limit) if file.suffix == ".mcap" else {}
            with Reader(file) as reader:
                for chunk in getattr(reader.storage, "chunks", []):
                    if chunks.pop(chunk.chunk_start_offset, None) != chunk.compressed_size:
                        raise RecordingError(f"{file}: the index of chunks does not fit the chunks: damaged")
                collect.add_messages(reader, store.deserialize_cdr)
    return collect.table()


def storage_files(path: Path) -> list[Path]:
    """The storage files of a ROS 2 bag in a folder; empty if it is none."""
    return sorted(file for file in path.iterdir() if file.name.endswith((*_STORAGE, *_PACKED)))


class _Collection:
    """The topics of a bag that are wanted, filled from one or more files."""

    def __init__(self, names: Collection[str] | None, path: Path, memory_limit: int) -> None:
        self._names = names
        self._path = path
        self._limit = memory_limit
        self._topics: dict[str, TopicCollector] = {}
        self._others: dict[str, str] = {}

    def add_messages(self, reader: Any, deserialize: Any) -> None:
        """Take all messages of the topics wanted from an open rosbags reader."""
        wanted = []
        for connection in reader.connections:
            topic, kind = connection.topic, connection.msgtype
            if kind in (JOINT_STATE, DYNAMIC_JOINT_STATE) and self._is_wanted(topic):
                wanted.append(connection)
                self._topics.setdefault(topic, TopicCollector(topic, kind, str(self._path)))
            else:
                self._others[topic] = kind
        if not wanted:
            return
        for connection, logged, data in reader.messages(connections=wanted):
            message = deserialize(unpack_message(data, self._limit, self._path), connection.msgtype)
            self._topics[connection.topic].add(message, logged)
            size = sum(topic.bytes for topic in self._topics.values())
            if size > self._limit:
                check_size(size, self._limit, self._path)

    def table(self) -> RawTable:
        """The columns of all topics."""
        if not self._topics:
            there = ", ".join(f"{topic} ({kind})" for topic, kind in self._others.items()) or "none"
            example = next((topic for topic, kind in self._others.items() if kind == JOINT_STATE), "/joint_states")
            raise RecordingError(
                f"{self._path}: none of the topics {', '.join(sorted(_OWN_TOPICS))}; there are: {there}. Say what "
                "the messages of other topics mean, such as "
                f"columns={{'q_*': '{example}:position:*', 'tau_motor_*': '{example}:effort:*'}}"
            )
        left_out = [f"topic {topic} ({kind})" for topic, kind in self._others.items()]
        return table_of_topics(list(self._topics.values()), left_out, str(self._path))

    def _is_wanted(self, topic: str) -> bool:
        if topic in _OWN_TOPICS:
            return True
        heads = [name.split("*")[0] for name in self._names or ()]
        return any(head.startswith(topic + ":") or (topic + ":").startswith(head) for head in heads)
