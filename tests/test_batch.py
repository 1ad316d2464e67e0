"""A folder of recordings: past bad ones, on after a kill, into one table."""

import csv
import gzip
import json
import os
import signal
import subprocess
import sys
import time
import warnings

import joblib
import numpy as np
import pytest

from sea_ident import load_robot
from sea_ident.batch import _one, identify_batch
from sea_ident.exceptions import RecordingError, SeaIdentError
from sea_ident.motion import FourierSeries
from sea_ident.recordings import ColumnSource, Recording, write_recording

pytestmark = pytest.mark.filterwarnings("ignore:.*no transmission:sea_ident.exceptions.SeaIdentWarning")
PERIOD = 2.0
MASSES = (80.0, 95.0, 110.0, 125.0)


@pytest.fixture(scope="module")
def robot():
    return load_robot("emps")


def recording(mass: float, seed: int) -> Recording:
    """A slider of a known mass with viscous and Coulomb friction, pushed along a periodic path."""
    series = FourierSeries(1.0 / PERIOD, np.array([0.1]), np.array([[0.08, 0.05]]), np.array([[0.03, -0.06]]))
    time_ = np.arange(8 * 400) * (PERIOD / 400)
    q, dq, ddq = (series.evaluate(time_, k)[:, 0] for k in range(3))
    force = mass * ddq + 200.0 * dq + 20.0 * np.tanh(dq / 0.005)
    noise = np.random.default_rng(seed)
    columns = {"q_slider": q + 1e-7 * noise.normal(size=len(q)), "tau_motor_slider": force + noise.normal(size=len(q))}
    return Recording(time_, columns, f"mass {mass}")


@pytest.fixture
def fleet(tmp_path):
    for k, mass in enumerate(MASSES):
        write_recording(recording(mass, k), tmp_path / f"robot{k}.csv")
    (tmp_path / "broken.csv").write_text("time,q_slider\n0,0\n1,nan\n")
    (tmp_path / "notes.txt").write_text("not a recording")
    return tmp_path


def test_every_recording_is_a_row_and_a_bad_one_says_why(robot, fleet):
    result = identify_batch(robot, fleet, period=PERIOD, jobs=1)
    assert [row.recording for row in result.rows] == ["broken.csv", *(f"robot{k}.csv" for k in range(4))]
    assert [row.recording for row in result.failed] == ["broken.csv"]
    assert "nan at sample 1" in result.failed[0].message
    with open(result.table, newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["status"] for row in table] == ["failed", *["done"] * 4]
    mass = next(key for key in table[1] if key.startswith("carriage") or key.endswith(".m") or key.endswith(".m*"))
    for row, true in zip(table[1:], MASSES, strict=True):
        assert float(row[mass]) == pytest.approx(true, rel=0.01)
        assert abs(float(row[mass]) - true) < 5 * float(row[f"{mass} std"])


@pytest.mark.scenario
def test_parallel_and_serial_give_the_same_models(robot, fleet):
    serial = identify_batch(robot, fleet, fleet / "serial", period=PERIOD, jobs=1)
    parallel = identify_batch(robot, fleet, fleet / "parallel", period=PERIOD, jobs=2)
    assert serial.table.read_text() == parallel.table.read_text()
    for k in range(4):
        name = f"models/robot{k}.csv.json"
        assert (fleet / "serial" / name).read_text() == (fleet / "parallel" / name).read_text()


def test_a_second_run_does_only_what_is_missing_changed_or_failed(robot, fleet, monkeypatch):
    first = identify_batch(robot, fleet, period=PERIOD, jobs=1)
    write_recording(recording(MASSES[1], 99), fleet / "robot1.csv")
    (fleet / "identified" / "models" / "robot2.csv.json").unlink()
    (fleet / "identified" / "rows" / "robot3.csv.json").write_text('{"cut off')
    second = identify_batch(robot, fleet, period=PERIOD, jobs=1)
    assert [row.resumed for row in second.rows] == [False, True, False, False, False]
    kept = [k for k in range(len(first.rows)) if k != 2]
    assert [second.rows[k].values for k in kept] == [first.rows[k].values for k in kept]
    other_settings = identify_batch(robot, fleet, period=2 * PERIOD, jobs=1)
    assert not any(row.resumed for row in other_settings.rows)


PROGRAM = """
import sys, time
from sea_ident import load_robot, batch
def slow(task, work=batch._one):
    time.sleep(0.3)
    return work(task)
batch._one = slow
batch.identify_batch(load_robot("emps"), sys.argv[1], period=2.0, jobs=1)
"""


@pytest.mark.scenario
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_after_a_kill_the_rest_is_done_and_the_table_is_that_of_one_run(robot, fleet):
    process = subprocess.Popen([sys.executable, "-c", PROGRAM, str(fleet)], stderr=subprocess.DEVNULL)
    rows = fleet / "identified" / "rows"
    deadline = time.monotonic() + 60
    while len(list(rows.glob("robot*.json"))) < 2 and process.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert not (fleet / "identified" / "table.csv").exists()
    for path in fleet.glob("identified/*/robot*.json"):
        json.loads(path.read_text())
    resumed = identify_batch(robot, fleet, period=PERIOD, jobs=1)
    assert 2 <= sum(row.resumed for row in resumed.rows) < 4
    whole = identify_batch(robot, fleet, fleet / "other", period=PERIOD, jobs=1)
    assert resumed.table.read_text() == whole.table.read_text()


WORKER = """
import os, time
from sea_ident.batch import _end_with
_end_with(os.getppid())
print("at work", flush=True)
time.sleep(120)
"""
RUN = "import subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1]])"


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_workers_of_a_killed_run_end():
    run = subprocess.Popen([sys.executable, "-c", RUN, WORKER], stdout=subprocess.PIPE)
    assert run.stdout.readline() == b"at work\n"
    run.kill()
    run.wait()
    # the pipe ends with the last process that could write to it
    killed = time.monotonic()
    assert run.stdout.read() == b""
    run.stdout.close()
    assert time.monotonic() - killed < 60.0


def kill_worker(task):
    """A recording that brings its worker down, as the system does when memory ends."""
    if "robot1" in task.path:
        os.kill(os.getpid(), signal.SIGKILL)
    return _one(task)


@pytest.mark.scenario
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_a_recording_that_kills_its_worker_is_a_row_like_any_other(robot, fleet, monkeypatch):
    monkeypatch.setattr("sea_ident.batch._one", kill_worker)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # joblib tells of the lost worker
        result = identify_batch(robot, fleet, period=PERIOD, jobs=2)
    assert {row.recording for row in result.failed} == {"broken.csv", "robot1.csv"}
    assert "worker process ended" in next(row.message for row in result.failed if row.recording == "robot1.csv")


def test_another_backend_of_joblib_takes_the_work_over(robot, fleet):
    with joblib.parallel_config(backend="threading"):
        result = identify_batch(robot, fleet, period=PERIOD, jobs=2)
    assert len(result.failed) == 1


def test_foreign_columns_of_a_whole_fleet_are_named_once(robot, fleet):
    header = "time,q_slider,tau_motor_slider"
    for path in fleet.glob("robot*.csv"):
        text = path.read_text()
        assert text.startswith(header)
        rows = np.loadtxt(path, delimiter=",", skiprows=1)
        (fleet / "foreign").mkdir(exist_ok=True)
        np.savetxt(
            fleet / "foreign" / path.name,
            rows * [1.0, 1000.0, 1.0],
            fmt="%.17g",
            delimiter=",",
            header="time,carriage_mm,force",
            comments="",
        )
    columns = {"q_slider": ColumnSource("carriage_mm", unit="mm"), "tau_motor_slider": "force"}
    plain = identify_batch(robot, fleet, period=PERIOD, jobs=1)
    foreign = identify_batch(robot, fleet / "foreign", period=PERIOD, columns=columns, jobs=1)
    assert len(foreign.rows) == len(MASSES)
    for row, other in zip(foreign.rows, plain.rows[1:], strict=True):
        assert row.values == pytest.approx(other.values, rel=1e-6)
    again = identify_batch(robot, fleet / "foreign", period=PERIOD, columns=columns, jobs=1)
    assert all(row.resumed for row in again.rows)
    columns["q_slider"] = ColumnSource("carriage_mm", unit="mm", sign=-1)
    turned = identify_batch(robot, fleet / "foreign", period=PERIOD, columns=columns, jobs=1)
    assert not any(row.resumed for row in turned.rows)


def test_no_jobs_is_an_error(robot, fleet):
    with pytest.raises(SeaIdentError, match="jobs is 0"):
        identify_batch(robot, fleet, jobs=0)


def test_a_folder_without_recordings_is_an_error(robot, tmp_path):
    with pytest.raises(RecordingError, match="holds no recording"):
        identify_batch(robot, tmp_path)
    with pytest.raises(RecordingError, match="no such folder"):
        identify_batch(robot, tmp_path / "nowhere")


def test_packed_files_and_bags_are_recordings_and_what_is_none_is_told(robot, tmp_path):
    write_recording(recording(80.0, 0), tmp_path / "plain.csv")
    (tmp_path / "packed.csv.gz").write_bytes(gzip.compress((tmp_path / "plain.csv").read_bytes()))
    write_recording(recording(80.0, 0), tmp_path / "bag")
    (tmp_path / "sub").mkdir()
    (tmp_path / "notes.txt").write_text("no recording")
    result = identify_batch(robot, tmp_path, period=PERIOD, jobs=1)
    assert [row.recording for row in result.rows] == ["bag", "packed.csv.gz", "plain.csv"]
    assert not result.failed
    assert result.left_out == ("notes.txt",)
    assert "notes.txt" in result.summary()
    again = identify_batch(robot, tmp_path, period=PERIOD, jobs=1)
    assert all(row.resumed for row in again.rows)


def test_the_table_of_an_earlier_run_is_no_recording(robot, tmp_path):
    write_recording(recording(80.0, 0), tmp_path / "plain.csv")
    for _ in range(2):
        result = identify_batch(robot, tmp_path, tmp_path, period=PERIOD, jobs=1)
        assert [row.recording for row in result.rows] == ["plain.csv"]


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are any bytes on Linux")
def test_a_name_that_is_no_text_is_a_row_like_any_other(robot, tmp_path):
    write_recording(recording(80.0, 0), tmp_path / "plain.csv")
    (tmp_path / "plain.csv").rename(tmp_path / os.fsdecode(b"r\xff.csv"))
    result = identify_batch(robot, tmp_path, period=PERIOD, jobs=1)
    assert not result.failed
    assert r"r\udcff.csv" in result.table.read_text(encoding="utf-8")
