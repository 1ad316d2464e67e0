import h5py
import numpy as np
import pytest
from damage import sample_recording

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import Recording, read_recording, write_recording

TIME = np.arange(5) * 0.1


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["time"] = TIME
        file["q_hip"] = 2 * TIME
    return path


def test_units_are_written_beside_the_data(tmp_path):
    write_recording(sample_recording(), tmp_path / "x.h5")
    with h5py.File(tmp_path / "x.h5") as file:
        assert file["current_hip"].attrs["unit"] == "A"
        assert file["time"].attrs["unit"] == "s"


def test_groups_tables_and_texts(path):
    with h5py.File(path, "r+") as file:
        file["motor/side/pos"] = np.arange(10.0).reshape(5, 2)
        file["title"] = "run 1"
        file["labels"] = ["a", "b"]
        file["rate"] = 100.0
    leg = read_recording(path, columns={"theta_hip": "motor/side/pos[1]"})
    assert leg.columns["theta_hip"].tolist() == [1.0, 3.0, 5.0, 7.0, 9.0]
    for part in ("title", "labels", "rate (is a single number)", "motor/side/pos[0]"):
        assert part in leg.notes[-1]


def test_links_to_other_files_are_not_followed(path, tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["secret"] = TIME
    with h5py.File(path, "r+") as file:
        file["q_knee"] = h5py.ExternalLink("other.h5", "secret")
        file["q_ankle"] = h5py.SoftLink("/q_hip")
        file["loop"] = h5py.SoftLink("/")
    assert read_recording(path).joints == ("hip",)


def test_a_group_that_holds_itself_ends(path):
    with h5py.File(path, "r+") as file:
        group = file.create_group("again")
        group["and"] = group
    assert read_recording(path).joints == ("hip",)


def test_data_in_other_files_is_refused(path, tmp_path):
    (tmp_path / "raw.bin").write_bytes(TIME.tobytes())
    with h5py.File(path, "r+") as file:
        file.create_dataset("q_knee", (5,), dtype="f8", external=[(str(tmp_path / "raw.bin"), 0, 40)])
    with pytest.raises(RecordingError, match="'q_knee' keeps its data in another file"):
        read_recording(path)
    with h5py.File(path, "r+") as file:
        del file["q_knee"]
        layout = h5py.VirtualLayout((5,), "f8")
        layout[:] = h5py.VirtualSource("other.h5", "secret", (5,))
        file.create_virtual_dataset("q_knee", layout)
    with pytest.raises(RecordingError, match="'q_knee' keeps its data in another file"):
        read_recording(path)


@pytest.mark.parametrize(("shape", "chunks"), [((2**40,), (1024,)), ((2**20, 2**20), (1, 1024)), ((5,), (2**28,))])
def test_claims_beyond_the_limit_are_refused_before_reading(path, shape, chunks):
    with h5py.File(path, "r+") as file:
        file.create_dataset("q_knee", shape, maxshape=(None,) * len(shape), dtype="f8", chunks=chunks)
    assert path.stat().st_size < 100_000
    with pytest.raises(RecordingError, match="over the limit"):
        read_recording(path, memory_limit=2**30)


def test_changed_data_is_noticed(tmp_path):
    leg = Recording(TIME, {"q_hip": np.sqrt(TIME)}, "x")
    write_recording(leg, tmp_path / "x.h5")
    data = bytearray((tmp_path / "x.h5").read_bytes())
    with h5py.File(tmp_path / "x.h5") as file:
        start = file["q_hip"].id.get_chunk_info(0).byte_offset
    data[start + 15] ^= 4
    (tmp_path / "x.h5").write_bytes(data)
    with pytest.raises(RecordingError, match=r"x.h5"):
        read_recording(tmp_path / "x.h5")


def test_names_that_hdf5_cannot_have_are_refused(tmp_path):
    with pytest.raises(RecordingError, match="cannot name an HDF5 dataset"):
        write_recording(Recording(TIME, {"q_a/b": TIME}, "x"), tmp_path / "x.h5")
