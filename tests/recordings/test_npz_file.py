import io
import zipfile

import numpy as np
import pytest

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import ColumnSource, read_recording
from sea_ident.recordings.columns import as_source

TIME = np.arange(4) * 0.1


def save(path, **arrays):
    np.savez(path, **arrays)
    return path


def test_tables_are_split_and_single_numbers_and_texts_left_out(tmp_path):
    positions = np.arange(8.0).reshape(4, 2)
    path = save(tmp_path / "x.npz", time=TIME[:, None], pos=positions, turned=positions.T, rate=100.0, names=["hip"])
    leg = read_recording(path, columns={"q_hip": "pos[0]", "q_knee": "turned[1]"})
    assert leg.columns["q_hip"].tolist() == [0.0, 2.0, 4.0, 6.0]
    assert leg.columns["q_knee"].tolist() == [1.0, 3.0, 5.0, 7.0]
    (note,) = [note for note in leg.notes if note.startswith("left out")]
    assert "rate (is a single number)" in note
    assert "names (holds text)" in note
    assert "pos[1]" in note


@pytest.mark.parametrize("dtype", [np.float32, np.int16, np.uint64, np.bool_, ">f8"])
def test_any_real_numbers_are_read(tmp_path, dtype):
    leg = read_recording(save(tmp_path / "x.npz", time=TIME, q_hip=np.array([0, 1, 1, 0], dtype=dtype)))
    assert leg.columns["q_hip"].dtype == np.float64
    assert leg.columns["q_hip"].tolist() == [0.0, 1.0, 1.0, 0.0]


@pytest.mark.parametrize(
    ("arrays", "part"),
    [
        ({"time": TIME, "q_hip": np.array([1, None, 2, 3], dtype=object)}, "never unpickled"),
        ({"time": TIME, "notes": np.array([{}], dtype=object)}, "never unpickled"),
        ({"time": TIME, "q_hip": np.array(["a"] * 4)}, "q_hip' holds text"),
        ({"time": TIME, "q_hip": 1.0}, "q_hip' is a single number"),
        ({"time": TIME, "q_hip": np.ones(3)}, "3 samples, but time has 4"),
        ({"time": TIME, "q_hip": np.zeros((2, 2, 2))}, "shape"),
        ({"q_hip": TIME}, "no column 'time'"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path, arrays, part):
    with pytest.raises(RecordingError, match=part):
        read_recording(save(tmp_path / "x.npz", **arrays))


class Bomb:
    """Runs code on being unpickled."""

    def __reduce__(self):
        return exec, ("raise SystemExit('unpickled')",)


def test_nothing_is_ever_unpickled(tmp_path):
    with pytest.raises(RecordingError, match="never unpickled"):
        read_recording(save(tmp_path / "x.npz", time=TIME, q_hip=np.array([Bomb()] * 4, dtype=object)))


def npy(shape, dtype="<f8", data=b""):
    head = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\x01\x00" + (len(head) + 1).to_bytes(2, "little") + head + b"\n" + data


@pytest.mark.parametrize(
    ("member", "part"),
    [
        (npy((10**12,)), "claims 8000000000000 bytes"),
        (npy((2**40, 2**40)), "claims"),
        (npy((-5,)), "damaged"),
        (npy((5,), data=bytes(16)), "damaged"),
        (b"\x93NUMPY\x09\x00", "version"),
        (b"no array", "magic"),
        (b"\x93NUMPY\x01\x00\xff\xff" + b"(" * 65535, "damaged"),
    ],
)
def test_headers_that_lie_are_refused_before_anything_is_allocated(tmp_path, member, part):
    with zipfile.ZipFile(tmp_path / "x.npz", "w") as archive:
        archive.writestr("time.npy", member)
    with pytest.raises(RecordingError, match=part):
        read_recording(tmp_path / "x.npz")


def test_a_zip_bomb_is_refused_by_its_size(tmp_path):
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.zeros(2_000_000))
    with zipfile.ZipFile(tmp_path / "x.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("time.npy", buffer.getvalue())
    assert (tmp_path / "x.npz").stat().st_size < 20_000
    with pytest.raises(RecordingError, match="over the limit of 1000000"):
        read_recording(tmp_path / "x.npz", memory_limit=1_000_000)


def test_an_array_that_appears_twice_is_refused(tmp_path):
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, TIME)
    with zipfile.ZipFile(tmp_path / "x.npz", "w") as archive:
        archive.writestr("time.npy", buffer.getvalue())
        with pytest.warns(UserWarning, match="Duplicate"):
            archive.writestr("time.npy", buffer.getvalue())
    with pytest.raises(RecordingError, match="'time' appears twice"):
        read_recording(tmp_path / "x.npz")


def test_a_plain_name_is_a_source_in_si_units():
    assert as_source("pos") == ColumnSource("pos")


def test_what_is_no_signal_and_bears_no_name_of_the_project_stops_nothing(tmp_path):
    time = np.arange(5) * 0.01
    path = tmp_path / "log.npz"
    np.savez(path, time=time, q_a=time, gains=np.ones(3), gps=np.array([1.0, np.nan, 2.0, 3.0, np.nan]))
    recording = read_recording(path)
    assert set(recording.columns) == {"q_a"}
    (note,) = (note for note in recording.notes if note.startswith("left out"))
    assert "gains (3 values, where time has 5)" in note
    assert "gps (nan at sample 1, and 2 times in all)" in note
    np.savez(path, time=time, q_a=np.array([1.0, np.nan, 2.0, 3.0, np.nan]))
    with pytest.raises(RecordingError, match="q_a is nan at sample 1"):
        read_recording(path)
