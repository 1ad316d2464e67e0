"""`sea-ident excite`: the files it writes, what it refuses, and Ctrl-C."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from sea_ident.excitation import read_excitation, sample_trajectory

QUICK = ("--starts", 1, "--harmonics", 3, "--base-frequency", 0.2)


def call(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from sea_ident.cli import main; main()", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=cwd, check=False)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("excite")
    done = call(
        "excite", "exo_leg", "--out", "e.json", *QUICK, "--ramp", 1.5, "--csv", "t.csv", "--yaml", "t.yaml",
        "--bag", "bag", "--bag-storage", "sqlite3", "--periods", 2, "--json", cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)


def test_everything_asked_for_is_there(written):
    folder, record = written
    assert record["files"] == ["e.json", "t.csv", "t.yaml", "bag"]
    assert sorted(p.name for p in folder.iterdir()) == ["bag", "e.json", "t.csv", "t.yaml"]
    assert sorted(p.name for p in (folder / "bag").iterdir()) == ["bag.db3", "metadata.yaml"]


@pytest.mark.scenario
def test_where_springs_take_the_links(written, tmp_path):
    """Told with the result, and kept inside where that is asked for."""
    _, record = written
    assert record["link_margins"]["hip_knee_sum"] < 0.0
    assert any("hip_knee_sum by" in text and "--links-inside" in text for text in record["warnings"])
    done = call("excite", "exo_leg", "--out", "e.json", *QUICK, "--links-inside", 0.05, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    inside = json.loads(done.stdout)
    assert min(*inside["margins"].values(), *inside["link_margins"].values()) >= 0.0
    assert inside["warnings"] == []
    planned = call("excite", "exo_leg", "--out", "p.json", *QUICK, "--links-as-planned", "--json", cwd=tmp_path)
    assert json.loads(planned.stdout)["a"] == record["a"]
    assert json.loads(planned.stdout)["link_margins"] == {}
    refused = call("excite", "exo_leg", "--out", "f.json", *QUICK, "--links-inside", 1, cwd=tmp_path)
    assert refused.returncode == 2
    assert "the reserve of the limits is 1.0" in refused.stderr
    both = call("excite", "exo_leg", "--out", "f.json", *QUICK, "--links-as-planned", "--links-inside", 0, cwd=tmp_path)
    assert both.returncode == 2
    assert "give one of them" in both.stderr


def test_csv_is_the_trajectory_in_full(written):
    folder, _ = written
    excitation = read_excitation(folder / "e.json")
    with open(folder / "t.csv", newline="") as stream:
        header, *rows = list(csv.reader(stream))
    joints = ("hip", "knee", "ankle")
    assert header == ["time", *(f"{kind}_{joint}" for kind in ("q", "dq", "ddq") for joint in joints)]
    table = np.array(rows, dtype=float)
    # 1000 samples per second: two ramps, two periods, and the way on to the phase where the ramp out begins
    ramps = excitation.ramp_in.duration + excitation.ramp_out.duration
    on = (excitation.ramp_out.phase - excitation.ramp_in.phase) % excitation.period
    assert len(table) == pytest.approx(1000.0 * (ramps + 10.0 + on), abs=2)
    np.testing.assert_allclose(np.diff(table[:, 0]), 1e-3, atol=1e-12)
    motion = sample_trajectory(excitation, 1000.0, 2)
    np.testing.assert_array_equal(table, np.column_stack([motion.time, motion.q, motion.dq, motion.ddq]))
    np.testing.assert_allclose(np.gradient(table[:, 3], 1e-3, edge_order=2), table[:, 6], atol=1e-4)


@pytest.mark.scenario
def test_messages_are_the_trajectory_at_a_hundred_points_a_second(written):
    folder, _ = written
    motion = sample_trajectory(read_excitation(folder / "e.json"), 100.0, 2)
    text = yaml.safe_load((folder / "t.yaml").read_text())
    assert text["joint_names"] == ["hip", "knee", "ankle"]
    np.testing.assert_array_equal([point["positions"] for point in text["points"]], motion.q)
    with Reader(folder / "bag") as reader:
        ((connection, _, raw),) = reader.messages()
    message = get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr(raw, connection.msgtype)
    np.testing.assert_array_equal([point.velocities for point in message.points], motion.dq)


@pytest.mark.scenario
def test_a_trajectory_that_ends_in_motion_is_told(tmp_path):
    done = call("excite", "exo_leg", "--out", "e.json", *QUICK, "--yaml", "t.yaml", "--rate", 20, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "without --ramp" in done.stderr
    assert len(yaml.safe_load((tmp_path / "t.yaml").read_text())["points"]) == 100


@pytest.mark.scenario
def test_limits_in_space_are_kept_and_told(tmp_path):
    done = call(
        "excite", "exo_leg", "--out", "e.json", *QUICK, "--half-space", "foot@0,0,-0.05:1,0,0,0.5",
        "--half-space", "shank:0,0,1,2", "--self-collision", 0.02, "--json", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["limits"]["plane 1 (foot)"] == [None, 0.5]
    assert record["limits"]["thigh - foot.distance"] == [0.02, None]
    assert min(record["margins"].values()) >= 0.0
    assert "not watched, because they are neighbours" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("--csv", "t.csv", "--rate", "1"), "needs more than 1.2"),
        (("--yaml", "t.yaml", "--periods", "0"), "periods is 0"),
        (("--bag", "there"), "there: exists already"),
        (("--bag", "nowhere/bag"), "folder nowhere does not exist"),
        (("--csv", "e.json"), "two outputs"),
        (("--bag", "new", "--bag-storage", "zip"), "zip"),
        (("--ramp", "nan"), "duration of the ramp is nan s"),
        (("--harmonics", "500"), "not below half the sampling rate"),
        (("--base-frequency", "nan"), "base_frequency is nan"),
        (("--half-space", "foot:0,0,1"), "write LINK:NX,NY,NZ,D"),
        (("--half-space", "foot@1,2:0,0,1,1"), "write LINK:NX,NY,NZ,D"),
        (("--half-space", "heel:0,0,1,1"), "no link 'heel'; its links: hip_base, thigh, shank, foot"),
        (("--half-space", "foot:0,0,1,-3"), "plane 1 (foot): n . p = "),
        (("--self-collision", "-1"), "distance is -1.0 m"),
    ],
)
def test_bad_input_is_refused_and_nothing_is_written(tmp_path, call_here, arguments, expected):
    (tmp_path / "there").mkdir()
    done = call_here("excite", "exo_leg", "--out", "e.json", *QUICK, *arguments, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert [p.name for p in tmp_path.iterdir()] == ["there"]


# prints a line at a chosen event, for the test to send the signal there
_AT_A_STEP = (
    "from sea_ident.excitation.board import Board\nold = Board.note\n"
    "def note(board, *args):\n"
    "    if board.steps:\n        print('now', flush=True)\n"
    "    return old(board, *args)\n"
    "Board.note = note\n"
)
_BEFORE_ANY = (
    "import time\nfrom sea_ident.excitation import design\n"
    "def slow(*_):\n    print('now', flush=True)\n    time.sleep(60)\n"
    "design.reduced_effects = slow\n"
)


def interrupted(program, *arguments):
    command = [sys.executable, "-c", program + "from sea_ident.cli import main\nmain()\n", *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("now")  # of several threads, perhaps
        process.send_signal(2)
        told, errors = process.communicate(timeout=120)
    assert "Traceback" not in errors
    return process.returncode, told + errors


@pytest.mark.scenario
@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_writes_the_best_so_far(tmp_path, jobs):
    code, told = interrupted(
        _AT_A_STEP, "excite", "exo_leg", "--out", tmp_path / "e.json", "--csv", tmp_path / "t.csv",
        "--starts", 500, "--jobs", jobs, "--ramp", 2,
    )  # fmt: skip
    assert code == 0, told
    assert told.count("interrupted; this is the best so far") == 1
    found = read_excitation(tmp_path / "e.json")
    assert len(found.start_values) < 500
    assert min(found.margins.values()) >= 0.0
    assert found.ramp_in is not None
    assert any("interrupted" in text for text in found.warnings)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["e.json", "t.csv"]


@pytest.mark.scenario
def test_ctrl_c_before_there_is_anything_writes_nothing(tmp_path):
    code, told = interrupted(_BEFORE_ANY, "excite", "exo_leg", "--out", tmp_path / "e.json")
    assert code == 130, told
    assert not list(tmp_path.iterdir())
