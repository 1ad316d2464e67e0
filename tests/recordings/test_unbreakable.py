"""Whatever is in a file: a reader gives a Recording or an error of the project, soon and in little memory."""

import resource
import warnings

import numpy as np
import pytest
from damage import ISOLATED, SUFFIXES, damage, damaged, sample_recording, write_sample
from hypothesis import given, settings
from hypothesis import strategies as st

from sea_ident.exceptions import SeaIdentError
from sea_ident.recordings import ColumnSource, Recording, isolated, read_recording, write_recording

MAGIC = {
    ".csv": b"time,q_hip\n",
    ".npz": b"PK\x03\x04",
    ".mat": b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM",
    ".inner.npz": b"PK\x05\x06",
    ".plain.mat": b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI",
    ".4.mat": bytes(4) + (5).to_bytes(4, "little") + (1).to_bytes(4, "little") + bytes(4),
    ".73.mat": b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n",
    ".parquet": b"PAR1",
    ".h5": b"\x89HDF\r\n\x1a\n",
    ".bag": b"#ROSBAG V2.0\n",
    ".mcap": b"\x89MCAP0\r\n",
    ".db3": b"SQLite format 3\x00",
}


def outcome(path, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = read_recording(path, memory_limit=2**26, **options)
        except SeaIdentError as error:
            message = str(error)
            found = None
    if found is None:
        assert path.name in message
        return "refused"
    assert isinstance(found, Recording)
    assert np.all(np.isfinite(found.time))
    assert np.all(np.diff(found.time) > 0.0)
    assert all(np.all(np.isfinite(values)) for values in found.columns.values())
    assert found.sample_rate > 0.0
    assert found.summary()
    return "read"


@pytest.mark.scenario
@pytest.mark.parametrize("suffix", [suffix for suffix in SUFFIXES if suffix not in ISOLATED])
@settings(deadline=None, max_examples=60)
@given(data=st.binary(max_size=600), with_magic=st.booleans())
def test_any_bytes(tmp_path_factory, suffix, data, with_magic):
    path = tmp_path_factory.mktemp("any") / f"x{suffix}"
    path.write_bytes(MAGIC[suffix] * with_magic + data)
    outcome(path)


@settings(deadline=None, max_examples=200)
@given(
    st.lists(
        st.lists(
            st.one_of(
                st.floats(allow_nan=True).map(repr),
                st.sampled_from(["", " ", '"', "1_0", "0x1", "1;2", "#", "\r", "\ufeff", "--", "1e", "\u0663"]),
            ),
            max_size=4,
        ).map(",".join),
        max_size=8,
    ),
    st.sampled_from(["time,q_a,q_b\n", "time,q_a\r\n", "t;q\n", "#c\ntime,x\n", '"time","q_a"\n', "time,time\n", ""]),
)
def test_any_text_with_commas(tmp_path_factory, rows, header):
    path = tmp_path_factory.mktemp("text") / "x.csv"
    path.write_text(header + "\n".join(rows), newline="")
    outcome(path)


@pytest.mark.parametrize("suffix", [suffix for suffix in SUFFIXES if suffix not in ISOLATED])
def test_damaged_files(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    valid = write_sample(suffix, path)
    assert outcome(path) == "read"
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seen = set()
    for seed in range(150 if suffix in (".csv", ".npz", ".inner.npz", ".parquet") else 50):
        path.write_bytes(damaged(suffix, valid, seed))
        seen.add(outcome(path))
    assert "refused" in seen
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kB


@pytest.mark.scenario
@pytest.mark.parametrize("suffix", ISOLATED)
def test_damaged_files_of_libraries_that_crash(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    valid = write_sample(suffix, path)
    path.write_bytes(MAGIC[suffix] + np.random.default_rng(0).bytes(300))
    assert outcome(path) == "refused"
    path.write_bytes(damaged(suffix, valid, 1))
    outcome(path)


def test_a_crash_inside_a_library_is_an_error_like_any_other(tmp_path):
    path = tmp_path / "x.plain.mat"
    data = bytearray(write_sample(".plain.mat", path))
    # The type of the first variable's samples: 9 is float64, 0x14 is none, which scipy does not look at.
    at = data.index(sample_recording().time.tobytes()) - 8
    assert data[at] == 9
    data[at] = 0x14
    path.write_bytes(data)
    with pytest.raises(SeaIdentError, match=r"x.plain.mat: .*damaged"):
        read_recording(path)


def test_a_reader_that_ends_its_process_is_told_from_one_that_refuses(tmp_path, monkeypatch):
    write_recording(sample_recording(), tmp_path / "x.h5")
    monkeypatch.setattr(isolated, "_START", "import sys; sys.exit('no way')")
    with pytest.raises(SeaIdentError, match="ended with status 1: no way"):
        read_recording(tmp_path / "x.h5")


def test_a_reader_that_hangs_is_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr(isolated, "_SECONDS", 0.0)
    write_recording(sample_recording(), tmp_path / "x.h5")
    with pytest.raises(SeaIdentError, match="took longer"):
        read_recording(tmp_path / "x.h5")


def test_damaged_bag_folders(tmp_path):
    write_recording(sample_recording(), tmp_path / "bag")
    for entry in sorted((tmp_path / "bag").iterdir()):
        valid = entry.read_bytes()
        for seed in range(15):
            entry.write_bytes(damage(valid, np.random.default_rng(seed)))
            outcome(tmp_path / "bag")
        entry.write_bytes(valid)
    (tmp_path / "bag" / "bag.mcap").unlink()
    assert outcome(tmp_path / "bag") == "refused"


@settings(deadline=None, max_examples=150)
@given(
    st.dictionaries(st.text(max_size=12), st.text(max_size=12), max_size=3),
    st.sampled_from(["deg", "rpm", "counts", "ms", "", None]),
    st.floats(),
    st.floats(),
)
def test_any_translation(tmp_path_factory, columns, unit, scale, gear):
    path = tmp_path_factory.mktemp("map") / "x.csv"
    path.write_text("time,pos,vel\n0,1,2\n0.1,2,3\n0.2,3,4\n")
    try:
        source = ColumnSource("pos", unit=unit, scale=scale, gear_ratio=gear)
    except SeaIdentError:
        source = "pos"
    try:
        leg = read_recording(path, columns={"q_hip": source, **columns})
    except SeaIdentError:
        return
    assert "q_hip" in leg.columns or "time" in columns
