"""Every format: what is written comes back, nothing is half-written, and the border gives clear errors."""

import os
import pickle
import re
import subprocess
import sys
import time

import numpy as np
import pytest
from damage import sample_recording, write_mat73

from sea_ident.exceptions import MissingExtraError, OutputError, RecordingError
from sea_ident.recordings import ColumnSource, Recording, read_recording, write_recording

SUFFIXES = [".csv", ".npz", ".mat", ".parquet", ".h5", ".hdf5", ".bag", ".mcap", ".db3", ""]
BAGS = [".bag", ".mcap", ".db3", ""]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_round_trip_is_exact(tmp_path, suffix):
    leg = sample_recording(200)
    path = tmp_path / f"leg{suffix}"
    write_recording(leg, path)
    again = read_recording(path)
    assert set(again.columns) == set(leg.columns)
    assert again.joints == leg.joints
    assert again.source == str(path)
    for name, values in leg.columns.items():
        assert np.array_equal(again.columns[name], values), name
    # Stamps of bags count nanoseconds.
    np.testing.assert_allclose(again.time, leg.time, rtol=0.0, atol=1e-9 if suffix in BAGS else 0.0)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("suffix", [suffix for suffix in SUFFIXES if suffix not in BAGS])
def test_order_of_columns_and_unknown_columns_survive(tmp_path, suffix):
    leg = sample_recording(10).replace_columns({"battery": np.arange(10.0)})
    write_recording(leg, tmp_path / f"leg{suffix}")
    with pytest.warns(UserWarning, match="battery"):
        again = read_recording(tmp_path / f"leg{suffix}")
    assert list(again.columns) == list(leg.columns)


@pytest.mark.parametrize("suffix", [suffix for suffix in SUFFIXES if suffix])
def test_a_file_is_replaced_as_a_whole(tmp_path, suffix):
    path = tmp_path / f"leg{suffix}"
    write_recording(sample_recording(10), path)
    write_recording(sample_recording(20), path)
    assert read_recording(path).samples == 20
    broken = Recording([-1.0, 2.0], {"q_a/b": np.array([1.0, 2.0])}, "x")
    if suffix in (".mat", ".h5", ".hdf5", *BAGS):
        with pytest.raises(RecordingError, match=rf"^{re.escape(str(path))}: "):
            write_recording(broken, path)
        assert read_recording(path).samples == 20
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_a_bag_folder_that_exists_is_never_touched(tmp_path):
    write_recording(sample_recording(10), tmp_path / "leg")
    with pytest.raises(OutputError, match="exists already"):
        write_recording(sample_recording(20), tmp_path / "leg")
    assert read_recording(tmp_path / "leg").samples == 10


@pytest.mark.scenario
@pytest.mark.parametrize("suffix", [".csv", ".mcap"])
def test_a_killed_writer_leaves_the_old_file_or_the_new_one(tmp_path, suffix):
    path = tmp_path / f"leg{suffix}"
    program = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from damage import sample_recording\n"
        "from sea_ident.recordings import write_recording\n"
        "legs = [sample_recording(n) for n in (1000, 2000)]\n"
        "write_recording(legs[0], sys.argv[2]); print('ready', flush=True)\n"
        "while True:\n    [write_recording(leg, sys.argv[2]) for leg in legs]\n"
    )
    here = os.path.dirname(__file__)
    for delay in (0.0, 0.03):
        writer = subprocess.Popen([sys.executable, "-c", program, here, path], stdout=subprocess.PIPE)
        with writer:
            assert writer.stdout.readline() == b"ready\n"
            time.sleep(delay)
            writer.kill()
        assert read_recording(path).samples in (1000, 2000)


@pytest.mark.parametrize(
    ("suffix", "module", "extra"),
    [
        (".parquet", "pyarrow", "parquet"),
        (".h5", "h5py", "hdf5"),
        (".73.mat", "h5py", "hdf5"),
        (".bag", "rosbags.typesys", "bags"),
        (".mcap", "rosbags.typesys", "bags"),
        ("", "rosbags.typesys", "bags"),
    ],
)
def test_a_missing_extra_says_what_to_install(tmp_path, monkeypatch, suffix, module, extra):
    path = tmp_path / f"leg{suffix}"
    if suffix == ".73.mat":
        write_mat73(sample_recording(), path)
    else:
        write_recording(sample_recording(), path)
    for name in [name for name in sys.modules if name == module or name.startswith(f"{module}.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError, match=rf"pip install 'sea-ident\[{extra}\]'"):
        read_recording(path)
    if suffix != ".73.mat":
        with pytest.raises(MissingExtraError, match=rf"pip install 'sea-ident\[{extra}\]'"):
            write_recording(sample_recording(), tmp_path / f"new{suffix}")
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_a_missing_extra_travels_between_processes():
    error = MissingExtraError("h5py", "hdf5", "reading HDF5")
    again = pickle.loads(pickle.dumps(error))
    assert isinstance(again, MissingExtraError)
    assert str(again) == str(error)


def test_importing_the_package_imports_no_extra():
    program = (
        "import sys, sea_ident.recordings\n"
        "print({'h5py', 'pyarrow', 'rosbags', 'scipy.io', 'scipy.optimize'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_paths_that_are_no_recording(tmp_path):
    (tmp_path / "leg.csv").write_text("time,q_hip\n0,1\n")
    with pytest.raises(RecordingError, match=r"leg.cvs: no such file; that folder has leg.csv"):
        read_recording(tmp_path / "leg.cvs")
    with pytest.raises(RecordingError, match=r"is a folder, and no ROS 2 bag"):
        read_recording(tmp_path)
    (tmp_path / "leg.txt").write_text("time,q_hip\n0,1\n")
    with pytest.raises(RecordingError, match=r"suffix '.txt' is not known; there are .csv, .npz"):
        read_recording(tmp_path / "leg.txt")
    with pytest.raises(RecordingError, match=r"suffix '.xls' is not known"):
        write_recording(sample_recording(), tmp_path / "leg.xls")
    with pytest.raises(OutputError, match=r"folder .*nowhere does not exist"):
        write_recording(sample_recording(), tmp_path / "nowhere" / "leg.csv")
    for suffix in SUFFIXES[:-1]:
        (tmp_path / f"empty{suffix}").touch()
        with pytest.raises(RecordingError, match="empty"):
            read_recording(tmp_path / f"empty{suffix}")
    assert not [entry for entry in tmp_path.iterdir() if entry.name.startswith(".")]


def test_wildcards_translate_all_joints_at_once(tmp_path):
    path = tmp_path / "log.npz"
    turns = np.arange(5.0)
    np.savez(path, t=turns * 10, **{"pos_hip_deg": turns * 180, "pos_knee_deg": turns * 90, "battery": turns})
    leg = read_recording(
        path, columns={"time": ColumnSource("t", unit="ms"), "q_*": ColumnSource("pos_*_deg", unit="deg")}
    )
    assert leg.joints == ("hip", "knee")
    np.testing.assert_allclose(leg.columns["q_knee"], turns * np.pi / 2)
    np.testing.assert_allclose(leg.time, turns / 100)
    assert "left out of the file: battery" in leg.notes
    with pytest.raises(RecordingError, match=r"no column 'vel_\*'.*There are: t, pos_hip_deg"):
        read_recording(path, columns={"time": "t", "dq_*": "vel_*"})
    with pytest.raises(RecordingError, match=r"one \* is needed on both sides"):
        read_recording(path, columns={"time": "t", "q_*": "pos_hip_deg"})


def test_a_column_that_is_absent_is_named_with_its_neighbours(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, time=np.arange(3.0) * 0.1, hip_pos=np.arange(3.0))
    with pytest.raises(RecordingError, match=r"no column 'hip_poss' \(wanted for q_hip\). Did you mean 'hip_pos'"):
        read_recording(path, columns={"q_hip": "hip_poss"})
    with pytest.raises(RecordingError, match=r"'tau_hip' is not a column of a recording"):
        read_recording(path, columns={"tau_hip": "hip_pos"})


def test_a_mapped_column_wins_over_one_of_the_same_name(tmp_path):
    path = tmp_path / "log.npz"
    ramp = np.arange(3.0)
    np.savez(path, time=ramp * 0.1, q_hip=ramp, pos=-ramp, dq_hip=10 * ramp)
    leg = read_recording(path, columns={"q_hip": "pos", "dq_hip": ColumnSource("dq_hip", unit="rpm")})
    assert leg.columns["q_hip"].tolist() == [0.0, -1.0, -2.0]
    np.testing.assert_allclose(leg.columns["dq_hip"], 10 * ramp * 2 * np.pi / 60)


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are any bytes on Linux")
def test_a_name_that_is_no_text_can_be_quoted(tmp_path):
    path = tmp_path / os.fsdecode(b"r\xff.csv")
    path.write_text("time,q_a\n0,1\n0.01,2\n")
    recording = read_recording(path)
    assert recording.source.endswith(r"r\udcff.csv")
    recording.source.encode("utf-8")
