"""Bags of other programs, as rosbags writes them, and what may be wrong with them."""

import bz2

import numpy as np
import pytest
from backports import zstd
from damage import sample_recording
from rosbags import rosbag1, rosbag2
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import ClockAlignment, ColumnSource, Recording, read_recording, write_recording
from sea_ident.recordings.ros_writer import write_ros2_bag

JOINT_STATE = "sensor_msgs/msg/JointState"
WALL = 1_700_000_000 * 10**9
SAMPLES = 50
BOTH = {
    "q_*": "/joint_states:position:*",
    "theta_*": ColumnSource("/motors:position:*", unit="deg", gear_ratio=100.0),
    "tau_motor_*": ColumnSource("/motors:effort:*", gear_ratio=100.0),
}


def messages(ros, count=SAMPLES, start=WALL):
    """Topic, log time [ns] and message: links at 100 Hz, motors at 200 Hz and 2 ms later; q = t, theta = 2 t."""
    store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)
    header, clock = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]

    def joint_state(stamp, names, position, effort):
        args = {"seq": 0} if ros == 1 else {}
        head = header(stamp=clock(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="", **args)
        position, effort = np.array(position), np.array(effort)
        return store.types[JOINT_STATE](head, names, position, np.empty(0), effort)

    out = []
    for k in range(count):
        stamp = start + 10_000_000 * k
        t = 0.01 * k
        out.append(("/joint_states", stamp + 1000, joint_state(stamp, ["hip", "knee"], [t, 10 * t], [])))
    for k in range(2 * count):
        stamp = start + 5_000_000 * k + 2_000_000
        t = 0.005 * k + 0.002
        angle = 100 * np.rad2deg(2 * t)
        out.append(("/motors", stamp + 1000, joint_state(stamp, ["knee", "hip"], [-angle, angle], [0.05, 0.01 * t])))
    return store, sorted(out, key=lambda item: item[1])


def write_ros1(path, compression=None, items=None, msgdef=None):
    store, found = messages(1) if items is None else items
    writer = rosbag1.Writer(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        connections = {
            topic: writer.add_connection(topic, JOINT_STATE, typestore=store, msgdef=msgdef, md5sum=msgdef and "0" * 32)
            for topic in sorted({topic for topic, _, _ in found})
        }
        for topic, time, message in found:
            writer.write(connections[topic], time, store.serialize_ros1(message, JOINT_STATE))
    return path


def write_ros2(path, storage=rosbag2.StoragePlugin.MCAP, compression=None, items=None, msgdef=None):
    store, found = messages(2) if items is None else items
    writer = rosbag2.Writer(path, version=8, storage_plugin=storage)
    if compression:
        writer.set_compression(compression, rosbag2.CompressionFormat.ZSTD)
    with writer:
        connections = {
            topic: writer.add_connection(topic, JOINT_STATE, typestore=store, msgdef=msgdef, rihs01=msgdef and "x")
            for topic in sorted({topic for topic, _, _ in found})
        }
        for topic, time, message in found:
            writer.write(connections[topic], time, store.serialize_cdr(message, JOINT_STATE))
    return path


MCAP, SQLITE = rosbag2.StoragePlugin.MCAP, rosbag2.StoragePlugin.SQLITE3
MODES = rosbag2.CompressionMode
LAYOUTS = {
    "ros1": lambda path: write_ros1(path.with_suffix(".bag")),
    "ros1 bz2": lambda path: write_ros1(path.with_suffix(".bag"), rosbag1.Writer.CompressionFormat.BZ2),
    "ros1 lz4": lambda path: write_ros1(path.with_suffix(".bag"), rosbag1.Writer.CompressionFormat.LZ4),
    "mcap": write_ros2,
    "mcap chunks": lambda path: write_ros2(path, MCAP, MODES.STORAGE),
    "mcap messages": lambda path: write_ros2(path, MCAP, MODES.MESSAGE),
    "mcap file": lambda path: write_ros2(path, MCAP, MODES.FILE),
    "sqlite": lambda path: write_ros2(path, SQLITE),
    "sqlite messages": lambda path: write_ros2(path, SQLITE, MODES.MESSAGE),
    "sqlite file": lambda path: write_ros2(path, SQLITE, MODES.FILE),
    "single mcap": lambda path: next(write_ros2(path).glob("*.mcap")),
    "single sqlite": lambda path: next(write_ros2(path, SQLITE).glob("*.db3")),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_topics_of_link_and_motor_side_meet_on_one_clock(tmp_path, layout):
    path = LAYOUTS[layout](tmp_path / "bag")
    with pytest.warns(UserWarning, match="folds back"):
        leg = read_recording(path, columns=BOTH)
    # The motors start 2 ms after the links; time counts from the first stamp of all.
    assert leg.joints == ("hip", "knee")
    np.testing.assert_allclose(leg.time, 0.01 * np.arange(1, SAMPLES), atol=1e-9)
    np.testing.assert_allclose(leg.columns["q_hip"], leg.time, atol=1e-9)
    np.testing.assert_allclose(leg.columns["q_knee"], 10 * leg.time, atol=1e-9)
    np.testing.assert_allclose(leg.columns["theta_hip"], 2 * leg.time, atol=1e-9)
    np.testing.assert_allclose(leg.columns["theta_knee"], -2 * leg.time, atol=1e-9)
    np.testing.assert_allclose(leg.columns["tau_motor_hip"], leg.time, atol=1e-9)
    np.testing.assert_allclose(leg.columns["tau_motor_knee"], 5.0)
    assert "time 0 is the stamp 1700000000.000000000 s" in leg.notes


def test_the_clock_that_counts_can_be_chosen(tmp_path):
    path = write_ros2(tmp_path / "bag")
    leg = read_recording(path, columns=BOTH, clocks=ClockAlignment(reference="/motors"))
    assert leg.sample_rate == pytest.approx(200.0)
    assert leg.time[0] == pytest.approx(0.002)
    np.testing.assert_allclose(leg.columns["q_hip"], leg.time, atol=1e-9)
    with pytest.raises(RecordingError, match="say no more than the interval"):
        read_recording(path, columns={"time": "/motors:time", **BOTH})


def test_messages_that_were_stamped_late_go_back_to_an_even_grid(tmp_path):
    """The interval is that of all clocks of the bag, as the message about uneven stamps advises."""
    even = 0.001 * np.arange(2000)
    late = even + np.random.default_rng(0).uniform(0.0, 3e-4, len(even))
    swing = np.sin(3.0 * even)
    write_recording(Recording(late, {"q_hip": swing, "theta_hip": swing + 0.01}, "late"), tmp_path / "bag")
    assert not read_recording(tmp_path / "bag").is_uniform
    leg = read_recording(tmp_path / "bag", columns={"time": ColumnSource("time", interval=0.001)})
    assert leg.is_uniform
    np.testing.assert_allclose(leg.columns["theta_hip"] - leg.columns["q_hip"], 0.01, atol=1e-9)
    with pytest.raises(RecordingError, match="say no more than the interval"):
        read_recording(tmp_path / "bag", columns={"time": ColumnSource("time", unit="ms", interval=1.0)})


@pytest.mark.parametrize("write", [write_ros1, write_ros2])
def test_topics_of_others_are_never_guessed(tmp_path, write):
    path = write(tmp_path / ("x.bag" if write is write_ros1 else "x"))
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    for part in ("/joint_states (sensor_msgs/msg/JointState)", "columns={'q_*': '/joint_states:position:*'"):
        assert part in str(caught.value)
    with pytest.raises(RecordingError, match=r"no column '/joint_states:velocity:hip' .*Did you mean"):
        read_recording(path, columns={"dq_hip": "/joint_states:velocity:hip"})
    with pytest.raises(RecordingError, match=r"none of the topics"):
        read_recording(path, columns={"dq_hip": "/states:velocity:hip"})


def test_a_bag_that_was_split_is_read_as_one(tmp_path):
    store, found = messages(2)
    folder = write_ros2(tmp_path / "bag", items=(store, found[:70]))
    second = write_ros2(tmp_path / "more", items=(store, found[70:]))
    (second / "more.mcap").rename(folder / "bag_1.mcap")
    with pytest.warns(UserWarning, match="folds back"):
        assert read_recording(folder, columns=BOTH).samples == SAMPLES - 1


def test_definitions_inside_a_bag_are_not_compiled(tmp_path):
    text = "import os\nos.abort() bogus\n"
    columns = {"q_hip": "/joint_states:position:hip"}
    for path in (
        write_ros1(tmp_path / "x.bag", msgdef=text),
        write_ros2(tmp_path / "x", msgdef=text),
        write_ros2(tmp_path / "y", SQLITE, msgdef=text),
    ):
        assert read_recording(path, columns=columns).samples == SAMPLES


@pytest.mark.parametrize("suffix", [".bag", ""])
def test_other_tools_read_what_is_written(tmp_path, suffix):
    leg = sample_recording()
    write_recording(leg, tmp_path / f"x{suffix}")
    found = {}
    with AnyReader([tmp_path / f"x{suffix}"]) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(reader.deserialize(raw, connection.msgtype))
    first = found["/sea_ident/link/joint_states"][3]
    assert first.name == ["hip", "knee"]
    assert first.position.tolist() == [leg.columns["q_hip"][3], leg.columns["q_knee"][3]]
    assert first.velocity.tolist() == [leg.columns["dq_hip"][3], leg.columns["dq_knee"][3]]
    assert first.effort.size == 0
    motor = found["/sea_ident/motor/joint_states"][3]
    assert motor.position.tolist() == [leg.columns["theta_hip"][3], leg.columns["theta_knee"][3]]
    assert motor.effort.tolist() == [leg.columns["tau_motor_hip"][3], leg.columns["tau_motor_knee"][3]]
    rest = found["/sea_ident/channels"][3]
    assert rest.joint_names == ["hip", "knee"]
    assert rest.interface_values[0].interface_names == ["current", "q_reference"]
    assert rest.interface_values[1].values.tolist() == [leg.columns["temperature_knee"][3]]
    assert len(found["/sea_ident/channels"]) == leg.samples


def test_a_sqlite_folder_can_be_written_too(tmp_path):
    leg = sample_recording()
    write_ros2_bag(leg, tmp_path / "bag", storage="sqlite3")
    assert sorted(entry.name for entry in (tmp_path / "bag").iterdir()) == ["bag.db3", "metadata.yaml"]
    again = read_recording(tmp_path / "bag")
    assert np.array_equal(again.columns["current_hip"], leg.columns["current_hip"])


def test_columns_of_some_joints_or_of_none_travel_on_the_third_topic(tmp_path):
    time = 0.01 * np.arange(5)
    leg = Recording(time, {"q_a": time, "q_b": time, "dq_a": 2 * time, "theta_b": 3 * time, "odd": 4 * time}, "x")
    write_recording(leg, tmp_path / "x.mcap")
    with pytest.warns(UserWarning, match="odd"):
        again = read_recording(tmp_path / "x.mcap")
    assert set(again.columns) == set(leg.columns)
    for name, values in leg.columns.items():
        assert np.array_equal(again.columns[name], values)


def read_states(tmp_path, change, **options):
    store, found = messages(2)
    items = [(topic, time, message) for topic, time, message in found if topic == "/joint_states"]
    for k, (_, _, message) in enumerate(items):
        change(k, message)
    path = write_ros2(tmp_path / "bag", items=(store, items))
    return read_recording(path, columns={"q_*": "/joint_states:position:*"}, **options)


def test_joints_may_change_their_order(tmp_path):
    def change(k, message):
        if k % 3 == 0:
            message.name.reverse()
            message.position[:] = message.position[::-1].copy()

    leg = read_states(tmp_path, change)
    np.testing.assert_allclose(leg.columns["q_hip"], leg.time, atol=1e-9)
    np.testing.assert_allclose(leg.columns["q_knee"], 10 * leg.time, atol=1e-9)


def test_two_publishers_on_a_topic_have_clocks_of_their_own(tmp_path):
    def change(k, message):
        keep = k % 2
        message.name[:] = [message.name[keep]]
        message.position = message.position[keep : keep + 1]

    leg = read_states(tmp_path, change)
    np.testing.assert_allclose(leg.columns["q_hip"], leg.time, atol=1e-9)
    np.testing.assert_allclose(leg.columns["q_knee"], 10 * leg.time, atol=1e-9)
    assert any("clock '/joint_states#2': 25 samples" in note for note in leg.notes)


def without_stamps(k, message):
    message.header.stamp.sec = message.header.stamp.nanosec = 0


def test_messages_without_stamps_take_the_times_of_recording(tmp_path):
    leg = read_states(tmp_path, without_stamps)
    np.testing.assert_allclose(leg.columns["q_hip"], leg.time, atol=1e-9)
    assert "topic /joint_states: messages have no stamp; the times of recording are used" in leg.notes


def partly(k, message):
    if k == 7:
        message.name.pop()
        message.position = message.position[:1]


def twice(k, message):
    message.name[1] = "hip"


def short(k, message):
    if k == 7:
        message.position = message.position[:1]


def nan(k, message):
    if k == 7:
        message.position[1] = np.nan


def back(k, message):
    if k == 7:
        message.header.stamp.sec -= 1


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (partly, "joint 'hip' appears in messages with different sets"),
        (twice, "message 0: a joint appears twice"),
        (short, "message 7: position has 1 values for 2 joints"),
        (nan, "q_knee is nan at sample 7"),
        (back, "time falls at sample 7"),
    ],
)
def test_messages_that_contradict_each_other_are_refused(tmp_path, change, part):
    with pytest.raises(RecordingError, match=part):
        read_states(tmp_path, change)


@pytest.mark.parametrize("start", [-1.0, 2.0**31])
@pytest.mark.parametrize("name", ["x.bag", "x"])
def test_times_that_stamps_cannot_hold_are_refused(tmp_path, start, name):
    leg = Recording([start, start + 1e-1], {"q_a": [0.0, 1.0]}, "x")
    with pytest.raises(RecordingError, match="stamps run from 0"):
        write_recording(leg, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_times_that_are_no_wall_clock_are_kept(tmp_path):
    leg = Recording([5.3, 5.4, 5.5], {"q_a": [0.0, 1.0, 2.0]}, "x")
    write_recording(leg, tmp_path / "x.mcap")
    assert read_recording(tmp_path / "x.mcap").time.tolist() == [5.3, 5.4, 5.5]


def test_a_ros1_chunk_that_unpacks_without_end_is_refused(tmp_path, monkeypatch):
    path = write_ros1(tmp_path / "x.bag", rosbag1.Writer.CompressionFormat.BZ2)
    data = path.read_bytes()
    start = data.index(b"BZh")
    bomb = bz2.compress(bytes(50_000_000))
    room = int.from_bytes(data[start - 4 : start], "little")
    assert len(bomb) < room
    path.write_bytes(data[:start] + bomb.ljust(room, b"\0") + data[start + room :])
    with pytest.raises(RecordingError, match="unpacks to more than 10000000 bytes"):
        read_recording(path, columns=BOTH, memory_limit=10_000_000)


def mcap_record(kind, *parts):
    body = b"".join(parts)
    return bytes([kind]) + len(body).to_bytes(8, "little") + body


def mcap_text(text):
    return len(text).to_bytes(4, "little") + text


@pytest.mark.parametrize(("claimed", "part"), [(1000, "unpacks to more than 1000"), (10**9, "unpacks to 1000000000")])
def test_an_mcap_chunk_that_unpacks_without_end_is_refused(tmp_path, claimed, part):
    bomb = zstd.compress(bytes(50_000_000))
    magic = b"\x89MCAP0\r\n"
    sizes = bytes(16) + claimed.to_bytes(8, "little") + bytes(4)
    chunk = mcap_record(6, sizes, mcap_text(b"zstd"), len(bomb).to_bytes(8, "little"), bomb)
    header = mcap_record(1, mcap_text(b"ros2"), mcap_text(b""))
    (tmp_path / "x.mcap").write_bytes(magic + header + chunk + mcap_record(2, bytes(20)) + magic)
    with pytest.raises(RecordingError, match=part):
        read_recording(tmp_path / "x.mcap", columns=BOTH, memory_limit=10_000_000)


def test_an_index_that_does_not_fit_the_chunks_is_refused(tmp_path):
    path = next(write_ros2(tmp_path / "bag").glob("*.mcap"))
    data = path.read_bytes()
    offset = (47).to_bytes(8, "little")
    start = data.index(b"\x06")
    index = data.rindex(start.to_bytes(8, "little"))
    path.write_bytes(data[:index] + offset + data[index + 8 :])
    with pytest.raises(RecordingError, match="index of chunks does not fit"):
        read_recording(path, columns=BOTH)


@pytest.mark.parametrize("storage", [MCAP, SQLITE])
def test_a_message_that_unpacks_without_end_is_refused(tmp_path, storage):
    writer = rosbag2.Writer(tmp_path / "bag", version=8, storage_plugin=storage)
    store, _ = messages(2)
    with writer:
        connection = writer.add_connection("/joint_states", JOINT_STATE, typestore=store)
        writer.write(connection, WALL, zstd.compress(bytes(100_000_000)))
    with pytest.raises(RecordingError, match="unpacks to more than 10000000 bytes"):
        read_recording(tmp_path / "bag", columns=BOTH, memory_limit=10_000_000)


def test_a_file_that_unpacks_without_end_is_refused(tmp_path):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "x.db3.zstd").write_bytes(zstd.compress(bytes(100_000_000)))
    with pytest.raises(RecordingError, match="unpacks to more than 10000000 bytes"):
        read_recording(tmp_path / "bag", columns=BOTH, memory_limit=10_000_000)


def test_more_messages_than_the_limit_are_refused(tmp_path):
    write_recording(sample_recording(2000), tmp_path / "x.mcap")
    with pytest.raises(RecordingError, match="over the limit of 900000"):
        read_recording(tmp_path / "x.mcap", memory_limit=900_000)
