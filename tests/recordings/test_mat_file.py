import zlib

import h5py
import numpy as np
import pytest
import scipy.io
from damage import sample_recording, write_mat73

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import Recording, read_recording, write_recording

TIME = np.arange(5) * 0.1


@pytest.mark.parametrize("options", [{"format": "5"}, {"format": "5", "do_compression": True}, {"format": "4"}])
@pytest.mark.parametrize("oned_as", ["row", "column"])
def test_vectors_of_all_versions_that_scipy_writes(tmp_path, options, oned_as):
    scipy.io.savemat(tmp_path / "x.mat", {"time": TIME, "q_hip": 2 * TIME}, oned_as=oned_as, **options)
    leg = read_recording(tmp_path / "x.mat")
    assert np.array_equal(leg.time, TIME)
    assert np.array_equal(leg.columns["q_hip"], 2 * TIME)


def test_structures_tables_and_integers(tmp_path):
    log = {"t": TIME, "pos": np.arange(10).reshape(5, 2), "inner": {"cur": np.arange(5, dtype=np.int16)}}
    scipy.io.savemat(tmp_path / "x.mat", {"log": log, "title": "run 1", "fs": 100.0})
    columns = {"time": "log.t", "q_hip": "log.pos[1]", "current_hip": "log.inner.cur"}
    leg = read_recording(tmp_path / "x.mat", columns=columns)
    assert leg.columns["q_hip"].tolist() == [1.0, 3.0, 5.0, 7.0, 9.0]
    assert leg.columns["current_hip"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert "title (is a char)" in leg.notes[-1]
    again = read_recording(tmp_path / "x.mat", columns={"time": "log.t", "current_*": "log.inner.*"})
    assert list(again.columns) == ["current_cur"]


@pytest.mark.scenario
def test_cells_and_objects_are_never_interpreted(tmp_path):
    cell = np.array([TIME, "text"], dtype=object)
    scipy.io.savemat(tmp_path / "x.mat", {"time": TIME, "q_hip": TIME, "extra": cell, "s": {"c": cell}})
    leg = read_recording(tmp_path / "x.mat")
    assert "extra (is a cell)" in leg.notes[0]
    assert "s.c (is a cell or object)" in leg.notes[0]
    scipy.io.savemat(tmp_path / "y.mat", {"time": TIME, "q_hip": cell})
    with pytest.raises(RecordingError, match=r"array 'q_hip' is a cell"):
        read_recording(tmp_path / "y.mat")
    scipy.io.savemat(tmp_path / "z.mat", {"time": TIME, "q_hip": TIME + 1j})
    with pytest.raises(RecordingError, match="complex"):
        read_recording(tmp_path / "z.mat")


def test_version_73(tmp_path):
    leg = sample_recording()
    write_mat73(leg, tmp_path / "x.mat")
    again = read_recording(tmp_path / "x.mat")
    assert np.array_equal(again.time, leg.time)
    for name, values in leg.columns.items():
        assert np.array_equal(again.columns[name], values)


def test_version_73_with_texts_structures_tables_and_references(tmp_path):
    path = tmp_path / "x.mat"
    write_mat73(Recording(TIME, {"q_hip": TIME}, "x"), path)
    with h5py.File(path, "r+") as file:
        text = file.create_dataset("title", data=np.array([[114], [117]], dtype=np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_("char")
        empty = file.create_dataset("nothing", data=np.array([0, 0], dtype=np.uint64))
        empty.attrs["MATLAB_class"] = np.bytes_("double")
        empty.attrs["MATLAB_empty"] = np.uint8(1)
        file.create_group("log").create_dataset("pos", data=np.arange(10.0).reshape(2, 5))
        hidden = file.create_group("#refs#").create_dataset("a", data=np.arange(5.0))
        cell = file.create_dataset("cells", (1, 1), dtype=h5py.ref_dtype)
        cell[0, 0] = hidden.ref
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
    leg = read_recording(path, columns={"q_knee": "log.pos[1]"})
    assert leg.columns["q_knee"].tolist() == [5.0, 6.0, 7.0, 8.0, 9.0]
    assert list(leg.columns) == ["q_knee", "q_hip"]
    for part in ("title (is a char)", "nothing (is empty)", "cells (is a cell)"):
        assert part in leg.notes[-1]
    assert "#refs#" not in leg.notes[-1]


def test_matlab_can_load_what_is_written(tmp_path):
    leg = sample_recording()
    write_recording(leg, tmp_path / "x.mat")
    with open(tmp_path / "x.mat", "rb") as file:
        assert file.read(19) == b"MATLAB 5.0 MAT-file"
    variables = scipy.io.loadmat(tmp_path / "x.mat")
    assert variables["q_hip"].shape == (leg.samples, 1)


@pytest.mark.parametrize("name", ["q_left-hip", "q_" + "x" * 62, "q_hüfte"])
def test_names_that_matlab_cannot_have_are_refused(tmp_path, name):
    with pytest.raises(RecordingError, match="no name for a MATLAB variable"):
        write_recording(Recording(TIME, {name: TIME}, "x"), tmp_path / "x.mat")
    assert list(tmp_path.iterdir()) == []


def test_a_compressed_bomb_is_found_piece_by_piece(tmp_path):
    scipy.io.savemat(tmp_path / "x.mat", {"time": np.zeros(3_000_000)}, do_compression=True)
    assert (tmp_path / "x.mat").stat().st_size < 40_000
    with pytest.raises(RecordingError, match="over the limit of 1000000"):
        read_recording(tmp_path / "x.mat", memory_limit=1_000_000)


def test_an_element_that_hides_its_size_is_found_as_well(tmp_path):
    scipy.io.savemat(tmp_path / "x.mat", {"time": TIME}, do_compression=True)
    head = (tmp_path / "x.mat").read_bytes()[:128]
    packed = zlib.compress(bytes(50_000_000))
    element = (15).to_bytes(4, "little") + len(packed).to_bytes(4, "little") + packed
    (tmp_path / "x.mat").write_bytes(head + element)
    with pytest.raises(RecordingError, match="over the limit"):
        read_recording(tmp_path / "x.mat", memory_limit=10_000_000)


def test_a_version_4_header_that_claims_too_much(tmp_path):
    head = np.array([0, 2**30, 2**30, 0, 5], dtype="<i4").tobytes() + b"time\0"
    (tmp_path / "x.mat").write_bytes(head + bytes(100))
    with pytest.raises(RecordingError):
        read_recording(tmp_path / "x.mat")
