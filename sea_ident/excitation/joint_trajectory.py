"""An excitation as a ROS 2 `trajectory_msgs/JointTrajectory`: as YAML and in a bag."""

import json
import os
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from sea_ident.arguments import as_path
from sea_ident.atomic import atomic_directory, atomic_file, scratch_folder
from sea_ident.exceptions import ExcitationError, MissingExtraError, OutputError
from sea_ident.excitation.result import Excitation
from sea_ident.excitation.trajectory import sample_trajectory
from sea_ident.motion import Motion

JOINT_TRAJECTORY: Final = "trajectory_msgs/msg/JointTrajectory"
TOPIC: Final = "/joint_trajectory_controller/joint_trajectory"
"""Where the joint_trajectory_controller of ros2_control listens under its usual name."""

RATE: Final = 100.0
"""Samples per second [Hz]; controllers interpolate between them with position, velocity and acceleration."""

Storage = Literal["mcap", "sqlite3"]

_POINT: Final = "trajectory_msgs/msg/JointTrajectoryPoint"
_LATEST: Final = 2**31 - 1


def write_trajectory_yaml(excitation: Excitation, path: str | Path, rate: float = RATE, periods: int = 1) -> None:
    """Write the message as YAML, as `ros2 topic pub` takes it.

    ``ros2 topic pub --once TOPIC trajectory_msgs/msg/JointTrajectory "$(cat FILE)"`` sends it. The stamp is zero:
    controllers begin at once. Without ramps it ends in motion, which most controllers refuse.

    Args:
        excitation: the excitation.
        path: of the file; it is complete or is not there.
        rate: samples per second [Hz].
        periods: whole periods.

    Raises:
        ExcitationError: as `sample_trajectory`, or the file cannot be written.
    """
    motion = sample_trajectory(excitation, rate, periods)
    lines = [
        "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}",
        f"joint_names: [{', '.join(json.dumps(name, ensure_ascii=False) for name in excitation.joint_names)}]",
        "points:",
    ]
    for (sec, nanosec), q, dq, ddq in zip(_durations(motion), motion.q, motion.dq, motion.ddq, strict=True):
        lines += [
            f"- positions: {_sequence(q)}",
            f"  velocities: {_sequence(dq)}",
            f"  accelerations: {_sequence(ddq)}",
            "  effort: []",
            f"  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}",
        ]
    try:
        with atomic_file(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OutputError as error:
        raise ExcitationError(str(error)) from error


def write_trajectory_bag(
    excitation: Excitation,
    path: str | Path,
    rate: float = RATE,
    periods: int = 1,
    *,
    storage: Storage = "mcap",
    topic: str = TOPIC,
) -> None:
    """Write the message into a ROS 2 bag, as `ros2 bag play` takes it.

    Args:
        excitation: the excitation.
        path: a file with the suffix `.mcap` or `.db3`; any other name is that of a folder, the bag with its
            `metadata.yaml`, which must not exist yet. It is complete or is not there.
        rate: samples per second [Hz].
        periods: whole periods.
        storage: format of the file in a folder.
        topic: of the message.

    Raises:
        ExcitationError: as `sample_trajectory`, or it cannot be written.
        MissingExtraError: rosbags is not installed.
    """
    path, store = as_path(path, "the bag to write"), bag_types()
    motion = sample_trajectory(excitation, rate, periods)
    message = _message(store, excitation.joint_names, motion)
    single: dict[str, Storage] = {".mcap": "mcap", ".db3": "sqlite3"}
    kind = single.get(path.suffix.lower())
    try:
        if kind is None:
            with atomic_directory(path) as folder:
                _write_bag(folder, storage, topic, store, message)
            return
        with atomic_file(path) as temporary, scratch_folder(path) as folder:
            bag = folder / "bag"
            _write_bag(bag, kind, topic, store, message)
            os.replace(bag / f"bag{path.suffix.lower()}", temporary)
    except OutputError as error:
        raise ExcitationError(str(error)) from error


def bag_types() -> Any:
    """The types of ROS 2 messages.

    Raises:
        MissingExtraError: rosbags is not installed.
    """
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise MissingExtraError("rosbags", "bags", "writing ROS bags") from error
    return get_typestore(Stores.ROS2_HUMBLE)


def _message(store: Any, joint_names: tuple[str, ...], motion: Motion) -> Any:
    types, nothing = store.types, np.zeros(0)
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    duration, point = types["builtin_interfaces/msg/Duration"], types[_POINT]
    points = [
        point(
            positions=q,
            velocities=dq,
            accelerations=ddq,
            effort=nothing,
            time_from_start=duration(sec=sec, nanosec=nanosec),
        )
        for (sec, nanosec), q, dq, ddq in zip(_durations(motion), motion.q, motion.dq, motion.ddq, strict=True)
    ]
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    return types[JOINT_TRAJECTORY](header=header, joint_names=list(joint_names), points=points)


def _write_bag(folder: Path, storage: Storage, topic: str, store: Any, message: Any) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer

    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(folder, version=8, storage_plugin=plugin) as writer:
        connection = writer.add_connection(topic, JOINT_TRAJECTORY, typestore=store)
        writer.write(connection, 0, store.serialize_cdr(message, JOINT_TRAJECTORY))


def _durations(motion: Motion) -> list[tuple[int, int]]:
    """Seconds and nanoseconds of every sample.

    Raises:
        ExcitationError: longer than the message can say.
    """
    if float(motion.time[-1]) >= _LATEST:
        raise ExcitationError(f"the motion takes {motion.time[-1]:g} s; a message holds less than {_LATEST} s")
    stamps = np.round(motion.time * 1e9).astype(np.int64)
    return [(int(stamp) // 10**9, int(stamp) % 10**9) for stamp in stamps]


def _sequence(values: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    """Numbers as YAML, none of which may look like an integer or, as 1e-05 does to YAML 1.1, like a word."""
    return f"[{', '.join(_number(float(value)) for value in values)}]"


def _number(value: float) -> str:
    text = repr(value)
    mantissa, mark, exponent = text.partition("e")
    return f"{mantissa}.0e{exponent}" if mark and "." not in mantissa else text
