"""Excitations as ROS 2 JointTrajectory messages, read back by other programs' readers."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from sea_ident.exceptions import ExcitationError, MissingExtraError
from sea_ident.excitation import (
    Ramp,
    design_excitation,
    sample_trajectory,
    write_trajectory_bag,
    write_trajectory_yaml,
)

JOINT_TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"


@pytest.fixture(scope="module")
def designed(robot_of):
    found = design_excitation(robot_of("exo_leg"), harmonics=3, starts=1, rate=50.0, ramp=Ramp(duration=2.0))
    return replace(found, joint_names=("hip", "knee: left", 'the "ankle" \u00e4'))


@pytest.fixture(params=[True, False], ids=["ramps", "no ramps"])
def excitation(request, designed):
    return designed if request.param else replace(designed, ramp_in=None, ramp_out=None)


def same_motion(points, names, excitation, rate, periods):
    """Values to the last digit, times to the nanosecond."""
    motion = sample_trajectory(excitation, rate, periods)
    assert tuple(names) == excitation.joint_names
    assert len(points) == len(motion)
    for field, values in (("positions", motion.q), ("velocities", motion.dq), ("accelerations", motion.ddq)):
        np.testing.assert_array_equal([point[field] for point in points], values)
    for k, point in enumerate(points):
        assert len(point["effort"]) == 0
        stamp = point["time_from_start"]
        assert 0 <= stamp["nanosec"] < 10**9
        assert stamp["sec"] * 10**9 + stamp["nanosec"] == round(k * 1e9 / rate)


def test_yaml_is_the_message(excitation, tmp_path):
    path = tmp_path / "trajectory.yaml"
    write_trajectory_yaml(excitation, path, rate=30.0, periods=2)
    message = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert list(message) == ["header", "joint_names", "points"]
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    # rclpy refuses an integer or a word where a float64 is meant
    assert all(type(v) is float for point in message["points"] for v in (*point["positions"], *point["velocities"]))
    same_motion(message["points"], message["joint_names"], excitation, 30.0, 2)
    assert [p.name for p in tmp_path.iterdir()] == ["trajectory.yaml"]


def as_records(message):
    fields = ("positions", "velocities", "accelerations", "effort")
    return [
        {field: getattr(point, field) for field in fields}
        | {"time_from_start": {"sec": point.time_from_start.sec, "nanosec": point.time_from_start.nanosec}}
        for point in message.points
    ]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_bag_holds_the_message(excitation, tmp_path, storage):
    path = tmp_path / "bag"
    write_trajectory_bag(excitation, path, rate=30.0, periods=2, storage=storage, topic="/leg/trajectory")
    suffix = {"mcap": ".mcap", "sqlite3": ".db3"}[storage]
    assert sorted(p.name for p in path.iterdir()) == [f"bag{suffix}", "metadata.yaml"]
    about = yaml.safe_load((path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert about["storage_identifier"] == storage
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(path) as reader:
        ((connection, time, raw),) = reader.messages()
        assert (connection.topic, connection.msgtype, time) == ("/leg/trajectory", JOINT_TRAJECTORY, 0)
        message = store.deserialize_cdr(raw, connection.msgtype)
    assert (message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id) == (0, 0, "")
    same_motion(as_records(message), message.joint_names, excitation, 30.0, 2)
    assert [p.name for p in tmp_path.iterdir()] == ["bag"]


@pytest.mark.parametrize("suffix", [".mcap", ".db3"])
def test_single_file(designed, tmp_path, suffix):
    path = tmp_path / f"trajectory{suffix}"
    write_trajectory_bag(designed, path, rate=30.0)
    write_trajectory_bag(designed, path, rate=40.0)  # a file is replaced
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        ((connection, _, raw),) = reader.messages()
        message = reader.deserialize(raw, connection.msgtype)
        assert connection.topic == "/joint_trajectory_controller/joint_trajectory"
    same_motion(as_records(message), message.joint_names, designed, 40.0, 1)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.scenario
def test_ends_at_rest_with_ramps(designed, tmp_path):
    write_trajectory_yaml(designed, tmp_path / "t.yaml")
    points = yaml.safe_load((tmp_path / "t.yaml").read_text(encoding="utf-8"))["points"]
    for end in (points[0], points[-1]):
        np.testing.assert_allclose(end["velocities"], 0.0, atol=1e-12)
        np.testing.assert_allclose(end["accelerations"], 0.0, atol=1e-9)


def test_bad_input_leaves_nothing(designed, tmp_path):
    for write in (write_trajectory_yaml, write_trajectory_bag):
        with pytest.raises(ExcitationError, match="needs more than"):
            write(designed, tmp_path / "t", rate=0.5)
        with pytest.raises(ExcitationError, match="periods is 0"):
            write(designed, tmp_path / "t", periods=0)
        with pytest.raises(ExcitationError, match="does not exist"):
            write(designed, tmp_path / "nowhere" / "t")
    assert not list(tmp_path.iterdir())
    (tmp_path / "bag").mkdir()
    with pytest.raises(ExcitationError, match="exists already"):
        write_trajectory_bag(designed, tmp_path / "bag")
    assert not list((tmp_path / "bag").iterdir())


def test_rosbags_is_asked_for_where_it_is_needed_only(designed, tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "rosbags"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'sea-ident\[bags\]'"):
        write_trajectory_bag(designed, tmp_path / "bag")
    write_trajectory_yaml(designed, tmp_path / "t.yaml")
    assert [p.name for p in tmp_path.iterdir()] == ["t.yaml"]
