import csv
import gzip

import numpy as np
import pytest
from damage import sample_recording
from hypothesis import given, settings
from hypothesis import strategies as st

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import ColumnSource, Recording, csv_file, read_recording, write_recording

FINE = "time,q_hip,current_hip\n0,1,2\n0.5e-1,-3.5,4\n0.1,5,6\n"


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "leg.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_recording(path, **options)

    return read


@pytest.mark.parametrize(
    "text",
    [
        FINE,
        FINE.replace("\n", "\r\n"),
        FINE.replace("\n", "\r"),
        "\ufeff" + FINE,
        "\ufeff" + FINE.replace("\n", "\r\n"),
        "# made by hand\n\n#\n" + FINE,
        FINE + "\n\n",
        FINE.rstrip("\n"),
        FINE.replace("\n0.1", "\n\n0.1"),
        FINE.replace(",", " , "),
        FINE.replace("q_hip", '"q_hip"').replace("-3.5", '"-3.5"'),
    ],
)
def test_harmless_variants_read_the_same(read, text):
    leg = read(text)
    assert leg.time.tolist() == [0.0, 0.05, 0.1]
    assert leg.columns["q_hip"].tolist() == [1.0, -3.5, 5.0]
    assert leg.columns["current_hip"].tolist() == [2.0, 4.0, 6.0]


def test_a_packed_file_reads_as_its_contents(tmp_path, read):
    plain = sample_recording()
    write_recording(plain, tmp_path / "leg.csv")
    packed = tmp_path / "Leg.CSV.gz"
    packed.write_bytes(gzip.compress((tmp_path / "leg.csv").read_bytes()))
    again = read_recording(packed)
    np.testing.assert_array_equal(again.time, plain.time)
    assert again.columns.keys() == plain.columns.keys()
    for name, values in plain.columns.items():
        np.testing.assert_array_equal(again.columns[name], values)


def test_packed_files_that_are_none_are_refused(tmp_path):
    path = tmp_path / "leg.csv.gz"
    whole = gzip.compress(FINE.encode() * 50)
    for data, expected in (
        (FINE.encode(), "cannot be unpacked"),
        (whole[:-12], "cannot be unpacked"),
        (whole[:20] + b"\xff\xff" + whole[22:], "cannot be unpacked"),
        (gzip.compress(b"\0\1\2"), "binary data"),
        (gzip.compress(b""), "the file is empty"),
    ):
        path.write_bytes(data)
        with pytest.raises(RecordingError, match=rf"leg.csv.gz.*{expected}"):
            read_recording(path)
    # a megabyte of one number out of a kilobyte: no more is unpacked than may be held
    path.write_bytes(gzip.compress(b"time,q_hip\n" + b"0,0\n" * 250_000))
    with pytest.raises(RecordingError, match="raise memory_limit"):
        read_recording(path, memory_limit=100_000)
    with pytest.raises(RecordingError, match=r"'\.gz' is a packed file"):
        write_recording(sample_recording(), path)


def test_clean_files_are_parsed_by_numpy_alone(read, monkeypatch):
    monkeypatch.setattr(csv_file, "_parse_slowly", None)
    assert read("\ufeff# made by hand\r\n\r\n" + FINE.replace("\n", "\r\n")).samples == 3
    assert read(FINE.replace(",2", ",idle").replace("current_hip", "mode"), columns={"q_a": "q_hip"}).samples == 3


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ["empty"]),
        ("\n\n", ["no header row"]),
        ("# only a comment", ["no header row"]),
        ("time,q_hip", ["no rows"]),
        ("time,q_hip\n \n", ["no rows"]),
        ("0,1\n1,2\n", ["line 1", "numbers instead of column names"]),
        ("time;q_hip\n0;1\n", ["line 1", "semicolons", "commas are needed"]),
        ("time\tq_hip\n0\t1\n", ["tabs"]),
        ("time\n0\n1\n", ["only one column, 'time'"]),
        ("time,q_hip\n0,1\n1,x1\n", ["line 3", "column q_hip", "'x1' instead of a number"]),
        ("\n#\ntime,q_hip\n\n0,1\n1,x1\n", ["line 6", "column q_hip"]),
        ("time,q_hip\r\n0,1\r\n1,x1\r\n", ["line 3"]),
        ("time,q_hip\n0,1\n1,\n2,3\n", ["line 3", "column q_hip is empty", "Nothing is filled in"]),
        ("time,q_hip\n0,1\n1\n", ["line 3", "1 cells", "2 columns", "cut off"]),
        ("time,q_hip\n0,1\n1,2,5\n", ["line 3", "3 cells", "decimal commas"]),
        ("time,q_hip\n0,1,1\n1\n", ["line 2", "3 cells"]),
        ("time,q_hip\n0,1_0\n1,2\n", ["'1_0'"]),
        ("time,q_hip\n0,\u0661\n1,2\n", ["instead of a number"]),
        ("time,q_hip,q_hip\n0,1,2\n", ["'q_hip' twice", "2 and 3"]),
        ("time,q_hip,\n0,1,\n", ["column 3 of 3 has no name"]),
        ("time,q_hip,\n0,1,\n", ["column 3 of 3 has no name", "comma at the end of every line"]),
        (",time,q_hip\n0,0,1\n", ["column 1 of 3 has no name", "index=False"]),
        ("time,q_hip\n0,1,\n1,2,\n", ["line 2", "comma at the end of the row"]),
        ("time,q_hip\n0,1\n# event\n1,2\n", ["line 3", "comment stands above the header only"]),
        ("# time,q_hip\n0,1\n1,2\n", ["line 2", "take the # away"]),
        ("time q_hip\n0 1\n1 2\n", ["line 1", "separated by blanks"]),
        ("Logger of the lab\ntime,q_hip\n0,1\n", ["line 1", "Start titles with #"]),
        ("time,q_hip\n0,1\n1,NA\n", ["line 3", "column q_hip holds 'NA'", "Nothing is filled in"]),
        ("time,q_hip\n2026-11-26T10:00:00,1\n", ["line 2", "column time", "write seconds"]),
        ("time,q_hip\n10:00:00.002,1\n", ["line 2", "column time", "write seconds"]),
        ("time,q_hip\n0,1\ntime,q_hip\n0,1\n", ["line 3", "several recordings"]),
        ('time,"q_hip\n0,1\n', ["header row cannot be read"]),
        ("t,q_hip\n0,1\n1,2\n", ["no column 'time'", "t, q_hip", "columns={'time': 't'}"]),
        ("time,q_hip\n0,1\n1,nan\n", ["q_hip is nan", "sample 1", "time 1 s", "1 of 2"]),
        ("time,q_hip\n0,1\n1,1e999\n", ["q_hip is inf", "sample 1"]),
        ("time,q_hip\n0,1\n", ["1 samples"]),
        ("time,q_hip\n0,1\n0,2\n", ["repeats", "sample 1"]),
        (b"time,q_hip\n0,1\n1,\xff\n", ["line 3", "0xff", "UTF-8"]),
        (b"time,q_hip\n0,1\n\x001,2\n", ["zero byte at 15"]),
        ("time,q_hip\n0,1\n1,2\n".encode("utf-16"), ["UTF-16"]),
        (b"PK\x03\x04\x00\x00", ["binary"]),
        ("x" * 1_000_001 + ",y\n0,1\n", ["1000003 characters"]),
        (",".join(f"c{i}" for i in range(10_001)) + "\n", ["10001 columns"]),
    ],
)
def test_malformed_files_are_refused_with_line_and_column(read, text, parts):
    with pytest.raises(RecordingError) as caught:
        read(text)
    for part in ["leg.csv", *parts]:
        assert part in str(caught.value)


def test_only_columns_asked_for_are_parsed(read):
    text = "t,mode,pos,q_knee\n0,idle,90,1\n250,run,180,2\n"
    leg = read(text, columns={"time": ColumnSource("t", unit="ms"), "q_hip": ColumnSource("pos", unit="deg")})
    assert leg.time.tolist() == [0.0, 0.25]
    np.testing.assert_allclose(leg.columns["q_hip"], [np.pi / 2, np.pi])
    assert leg.columns["q_knee"].tolist() == [1.0, 2.0]
    assert set(leg.columns) == {"q_hip", "q_knee"}
    assert "left out of the file: mode" in leg.notes
    assert any("'pos', in deg" in note for note in leg.notes)


@pytest.mark.parametrize("mode", [("idle", "run", "run"), ("", "", "run"), ("1", "2", "off")])
def test_foreign_columns_that_hold_no_numbers_are_left_out_as_from_other_formats(read, mode):
    rows = [f"{line},{text},7" for line, text in zip(FINE.splitlines()[1:], mode, strict=True)]
    with pytest.warns(UserWarning, match="kept as they are: battery;"):
        leg = read("\n".join([FINE.splitlines()[0] + ",mode,battery", *rows]))
    assert leg.time.tolist() == [0.0, 0.05, 0.1]
    assert leg.columns["battery"].tolist() == [7.0, 7.0, 7.0]
    assert "mode" not in leg.columns
    assert any("left out of the file: mode (" in note for note in leg.notes)


def test_a_column_of_text_keeps_the_fast_way(read, monkeypatch):
    monkeypatch.setattr(csv_file, "_parse_slowly", lambda *_: pytest.fail("parsed cell by cell"))
    rows = [f"{line},idle" for line in FINE.splitlines()[1:]]
    assert set(read("\n".join([FINE.splitlines()[0] + ",mode", *rows])).columns) == {"q_hip", "current_hip"}


def test_ragged_rows_are_seen_even_where_the_commas_balance(read):
    text = "time,q_hip,note\n0,1,a\n1,2,b,c\n2,3\n3,4,d\n"
    with pytest.raises(RecordingError, match=r"line 3: 4 cells"):
        read(text, columns={"time": "time"})


def test_unknown_columns_raise_a_warning_that_is_kept(read):
    with pytest.warns(UserWarning, match="battery"):
        leg = read("time,q_hip,battery\n0,1,2\n1e-2,2,3\n")
    assert "battery" in leg.warnings[0]


def test_a_file_over_the_limit_is_not_read(read):
    with pytest.raises(RecordingError, match="memory_limit"):
        read(FINE, memory_limit=100)


def test_numbers_come_back_exactly_and_other_readers_agree(tmp_path):
    leg = sample_recording(1000)
    path = tmp_path / "out.csv"
    write_recording(leg, path)
    again = read_recording(path)
    assert list(again.columns) == list(leg.columns)
    assert np.array_equal(again.time, leg.time)
    for name, values in leg.columns.items():
        assert np.array_equal(again.columns[name], values)
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][:2] == ["time", "q_hip"]
    assert float(rows[-1][1]) == leg.columns["q_hip"][-1]


@settings(deadline=None)
@given(
    st.lists(st.floats(-1e11, 1e11), min_size=2, max_size=20),
    st.text(st.characters(exclude_categories=("C", "Z")), min_size=1, max_size=8),
)
def test_any_finite_numbers_and_joint_names_survive(tmp_path_factory, values, joint):
    leg = Recording(0.01 * np.arange(len(values)), {f"q_{joint}": values}, "x")
    path = tmp_path_factory.mktemp("csv") / "x.csv"
    write_recording(leg, path)
    assert read_recording(path).columns[f"q_{joint}"].tolist() == [float(value) for value in values]
