import datetime

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from damage import sample_recording

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import read_recording, write_recording

TIME = np.arange(5) * 0.1


def write(path, **columns):
    pq.write_table(pa.table(columns), path)
    return path


def test_other_tools_read_what_is_written(tmp_path):
    leg = sample_recording()
    write_recording(leg, tmp_path / "x.parquet")
    table = pq.read_table(tmp_path / "x.parquet")
    assert table.column_names == ["time", *leg.columns]
    assert table.column("q_hip").to_pylist() == leg.columns["q_hip"].tolist()


def test_numbers_and_times_of_any_type(tmp_path):
    start = datetime.datetime(2024, 5, 1, tzinfo=datetime.UTC)
    stamps = [start + datetime.timedelta(milliseconds=10 * k) for k in range(5)]
    path = write(
        tmp_path / "x.parquet",
        time=pa.array(stamps, pa.timestamp("us", tz="UTC")),
        q_hip=pa.array(range(5), pa.int16()),
        dq_hip=pa.array(TIME, pa.float32()),
        label=["a"] * 5,
        lap=pa.array([datetime.timedelta(milliseconds=k) for k in range(5)], pa.duration("ms")),
    )
    leg = read_recording(path, columns={"current_hip": "lap"})
    np.testing.assert_allclose(leg.time - start.timestamp(), 0.01 * np.arange(5), atol=1e-6)
    assert leg.columns["q_hip"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    np.testing.assert_allclose(leg.columns["current_hip"], 1e-3 * np.arange(5))
    assert "label (holds string)" in leg.notes[-1]


@pytest.mark.parametrize(
    ("columns", "part"),
    [
        ({"q_hip": pa.array([1, 2, None, None, 5])}, "q_hip is empty at sample 2; 2 of 5"),
        ({"q_hip": pa.array([1.0, 2.0, float("nan"), 4.0, 5.0])}, "q_hip is nan at sample 2"),
        ({"q_hip": ["a"] * 5}, "'q_hip' holds string"),
        ({"q_hip": [[1.0]] * 5}, "'q_hip' holds list"),
    ],
)
def test_what_is_missing_or_no_number_is_refused(tmp_path, columns, part):
    with pytest.raises(RecordingError, match=part):
        read_recording(write(tmp_path / "x.parquet", time=TIME, **columns))


def test_two_columns_of_the_same_name_are_refused(tmp_path):
    table = pa.Table.from_arrays([pa.array(TIME), pa.array(TIME), pa.array(TIME)], ["time", "q_a", "q_a"])
    pq.write_table(table, tmp_path / "x.parquet")
    with pytest.raises(RecordingError, match="two columns have the same name"):
        read_recording(tmp_path / "x.parquet")


def test_a_small_file_of_many_equal_rows_is_refused_by_its_size(tmp_path):
    many = pa.array(np.zeros(5_000_000))
    pq.write_table(pa.table({"time": many}), tmp_path / "x.parquet", compression="zstd")
    assert (tmp_path / "x.parquet").stat().st_size < 50_000
    with pytest.raises(RecordingError, match="over the limit of 10000000"):
        read_recording(tmp_path / "x.parquet", memory_limit=10_000_000)


def test_changed_data_is_noticed(tmp_path):
    leg = sample_recording()
    write_recording(leg, tmp_path / "x.parquet")
    data = bytearray((tmp_path / "x.parquet").read_bytes())
    at = data.find(leg.columns["q_hip"][7].tobytes())
    assert at > 0
    data[at] ^= 1
    (tmp_path / "x.parquet").write_bytes(data)
    with pytest.raises(RecordingError):
        read_recording(tmp_path / "x.parquet")
