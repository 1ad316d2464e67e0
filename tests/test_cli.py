"""The command line, called as users and other programs call it: as a process of its own."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from sea_ident.cli import output
from sea_ident.recordings import read_recording, write_recording

DATA = Path(__file__).parents[1] / ".." / "shared" / "data"


def call(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from sea_ident.cli import main; main()", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=cwd, check=False)


def call_json(*arguments: object) -> dict:
    done = call(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_inspect_lists_joints_and_the_papers_sixteen_base_parameters():
    record = call_json("inspect", "exo_leg")
    assert [joint["name"] for joint in record["joints"]] == ["hip", "knee", "ankle"]
    assert [joint["gear_ratio"] for joint in record["joints"]] == [120.0, 100.0, 80.0]
    assert all(joint["elastic"] and joint["type"] == "revolute" for joint in record["joints"])
    assert record["rank"] == len(record["base_parameters"]) == 16
    assert record["joints"][1]["limits"]["lower"] == pytest.approx(-3.14159265 / 6)
    known = set(record["parameters"])
    assert all(set(base["combination"]) <= known for base in record["base_parameters"])


def test_inspect_of_chosen_joints_locks_the_others():
    record = call_json("inspect", "exo_leg", "--joints", "hip,knee")
    assert [joint["name"] for joint in record["joints"]] == ["hip", "knee"]


def test_help_answers_without_loading_the_numerical_libraries():
    program = (
        "import sys\nfrom sea_ident.cli import main\nsys.argv = ['sea-ident', '--help']\n"
        "try:\n    main()\nexcept SystemExit as done:\n    assert not done.code\n"
        "heavy = {'numpy', 'scipy', 'pinocchio', 'matplotlib', 'jinja2', 'joblib'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert "inspect" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("inspect", "no_such.urdf"), "no_such.urdf"),
        (("inspect", "exo_leg", "--joints", "hip,elbow"), "elbow"),
        (("inspect",), "ROBOT"),
        (("simulate", "exo_leg", "--excitation", "none.json", "--out", "y.txt"), "'.txt' is not known"),
        (("inspekt", "exo_leg"), "inspekt"),
    ],
)
def test_bad_input_is_a_message_and_exit_code_2(arguments, expected):
    done = call(*arguments)
    assert done.returncode == 2
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_a_defect_is_exit_code_1_with_its_trace():
    program = (
        "import sys, sea_ident.robot as robot\nfrom sea_ident.cli import main\n"
        "def broken(*_): raise ZeroDivisionError('planted')\n"
        "robot.load_robot = broken\nsys.argv = ['sea-ident', 'inspect', 'exo_leg']\nmain()\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert "planted" in done.stderr
    assert "defect" in done.stderr


def test_ctrl_c_ends_with_130_and_no_trace():
    program = (
        "import sys, time, sea_ident.robot as robot\nfrom sea_ident.cli import main\n"
        "def slow(*_):\n    print('started', flush=True)\n    time.sleep(60)\n"
        "robot.load_robot = slow\nsys.argv = ['sea-ident', 'inspect', 'exo_leg']\nmain()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "started\n"
        time.sleep(0.05)
        process.send_signal(2)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in errors


@pytest.fixture(scope="module")
def chain(tmp_path_factory) -> tuple[Path, dict[str, dict]]:
    """The whole chain through the command line, with what every verb answered."""
    folder = tmp_path_factory.mktemp("chain")
    said = {
        "excite": call_json(
            "excite", "exo_leg", "--out", folder / "exc.json", "--starts", 1, "--harmonics", 4, "--base-frequency", 0.2
        ),
        "simulate": call_json(
            "simulate", "exo_leg", "--excitation", folder / "exc.json", "--periods", 7, "--out", folder / "rec.csv"
        ),
        "identify": call_json(
            "identify", "exo_leg", folder / "rec.csv", "--period", 5, "--out", folder / "model.json",
            "--report", folder / "model.html",
        ),
        "validate": call_json("validate", folder / "model.json", folder / "rec.csv"),
        "export": call_json(
            "export", folder / "model.json", "--urdf", folder / "out.urdf", "--mjcf", folder / "out.xml"
        ),
        "report": call_json(
            "report", folder / "model.json", "--out", folder / "again.html", "--excitation", folder / "exc.json"
        ),
    }  # fmt: skip
    return folder, said


def test_excite_answers_with_margins_inside_all_limits(chain):
    folder, said = chain
    record = said["excite"]
    assert {"hip.position", "knee.velocity", "ankle.acceleration", "hip_knee_sum"} <= set(record["margins"])
    assert all(margin >= 0.0 for margin in record["margins"].values())
    assert record["starts"] == 1
    assert record["files"] == [str(folder / "exc.json")]


def test_simulate_writes_the_columns_that_identify_reads(chain):
    folder, said = chain
    header = (folder / "rec.csv").read_text().partition("\n")[0].split(",")
    assert header == said["simulate"]["columns"]
    assert said["simulate"]["samples"] == 7 * 5 * 200
    assert {f"{kind}_{joint}" for kind in ("q", "theta", "current") for joint in ("hip", "knee", "ankle")} <= set(
        header
    )


@pytest.mark.scenario
def test_simulate_takes_a_sampling_rate(chain, tmp_path):
    folder, _ = chain
    begin = ("simulate", "exo_leg", "--excitation", folder / "exc.json", "--periods", 1, "--out", tmp_path / "rec.csv")
    record = call_json(*begin, "--rate", 80)
    assert (record["samples"], record["sample_rate"]) == (5 * 80, pytest.approx(80.0))
    done = call(*begin, "--rate", 0)
    assert done.returncode == 2
    assert "rate 0.0 Hz" in done.stderr


def test_identify_finds_the_leg_that_was_simulated(chain):
    folder, said = chain
    model = json.loads((folder / "model.json").read_text())
    assert {key: said["identify"][key] for key in model} == model
    found = {parameter["name"]: parameter for parameter in model["base_parameters"]}
    shank = found["shank.Iyy*"]
    assert shank["value"] == pytest.approx(0.4052857, rel=0.05)
    assert shank["relative_std_percent"] == pytest.approx(100 * shank["std"] / shank["value"])
    assert {spring["joint"]: spring["verdict"] for spring in model["springs"]}["hip"] == "stiffening"
    assert (folder / "model.html").stat().st_size > 50_000


def test_identify_adds_the_effects_asked_for(chain, tmp_path):
    record = call_json(
        "identify", "exo_leg", chain[0] / "rec.csv", "--period", 5, "--out", tmp_path / "model.json",
        "--add", "torque_offset:knee", "--add", "torque_offset:hip", "--add", "coulomb_friction:hip,smoothing=0.02",
    )  # fmt: skip
    friction = {e["joint"]: e["shape"] for e in record["effects"] if e["effect"] == "coulomb_friction"}
    assert friction["hip"]["smoothing"] == 0.02
    assert friction["knee"]["smoothing"] == 0.01
    offsets = {p["joint"]: p for p in record["parameters"] if p["effect"] == "torque_offset"}
    assert set(offsets) == {"knee", "hip"}
    assert all(abs(p["value"]) < 6 * p["std"] for p in offsets.values())


def test_validate_answers_per_joint(chain):
    record = chain[1]["validate"]
    for key in ("rms", "noise_std", "nrms"):
        assert set(record[key]) == {"hip", "knee", "ankle"}
    assert max(record["nrms"].values()) < 0.2


def test_foreign_columns_are_named_on_the_command_line(chain, tmp_path):
    folder, said = chain
    table = np.genfromtxt(folder / "rec.csv", delimiter=",", names=True)
    names = [f"{name}_foreign" if name.startswith(("q_", "theta_")) else name for name in table.dtype.names]
    rows = np.array(table.tolist())
    rows[:, [name.startswith("q_") for name in names]] *= 180.0 / np.pi
    np.savetxt(tmp_path / "rec.csv", rows, fmt="%.17g", delimiter=",", header=",".join(names), comments="")
    columns = ("--column", "q_*=q_*_foreign,unit=deg", "--column", "theta_*=theta_*_foreign")
    record = call_json("validate", folder / "model.json", tmp_path / "rec.csv", *columns)
    assert record["rms"] == pytest.approx(said["validate"]["rms"], rel=1e-6)


def test_a_part_of_a_recording_is_used_alone(chain, call_here, tmp_path):
    folder, said = chain
    write_recording(read_recording(folder / "rec.csv").crop(10.0, None), tmp_path / "part.csv")
    own, part = (
        json.loads(call_here("validate", "model.json", *which, "--json", cwd=folder).stdout)["rms"]
        for which in ((tmp_path / "part.csv",), ("rec.csv", "--between", "10,"))
    )
    assert part == own != said["validate"]["rms"]


def test_an_exported_robot_is_a_robot_again(chain):
    folder = chain[0]
    record = call_json("inspect", folder / "out.urdf")
    assert [joint["name"] for joint in record["joints"]] == ["hip", "knee", "ankle"]
    assert record["rank"] == 16


def test_an_export_in_two_formats_says_everything_once(chain, tmp_path):
    done = call("export", chain[0] / "model.json", "--urdf", tmp_path / "a.urdf", "--mjcf", tmp_path / "a.xml")
    said = (done.stdout + done.stderr).splitlines()
    assert len(said) == len(set(said))
    assert "what the data leave free" in done.stdout


def test_a_report_needs_the_model_file_only(chain):
    text = (chain[0] / "again.html").read_text()
    assert 'id="excitation"' in text
    assert 'id="torque"' in text


def test_called_by_a_program_it_leaves_the_signals_of_that_as_they_were(call_here, tmp_path):
    """Else a pool of workers that the program forks later does not end when it is told to."""
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    assert call_here("inspect", "nothing.urdf", cwd=tmp_path).returncode == 2
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("identify", "exo_leg", "bad.csv", "--out", "never.json"), "nan"),
        (("identify", "exo_leg", "rec.csv", "--period", "500", "--out", "never.json"), "period"),
        (("identify", "emps", "rec.csv", "--out", "never.json"), "slider"),
        (("identify", "exo_leg", "rec.csv", "--out", "no/never.json"), "does not exist"),
        (("identify", "exo_leg", "rec.csv", "--out", "never.json", "--report", "never.json"), "two outputs"),
        (("identify", "exo_leg", "rec.csv", "--out", "never.json", "--add", "no_such_effect"), "torque_offset"),
        (("identify", "exo_leg", "rec.csv", "--out", "never.json", "--add", "torque_offset:elbow"), "elbow"),
        (("identify", "exo_leg", "rec.csv", "--out", "never.json", "--add", "coulomb_friction,smoothing=x"), "NUMBER"),
        (("identify", "exo_leg", "rec.csv", "--out", "never.json", "--add", "coulomb_friction,sharp=1"), "sharp"),
        (("simulate", "exo_leg", "--excitation", "model.json", "--out", "never.csv"), "not an excitation"),
        (("excite", "exo_leg", "--out", "never.json", "--harmonics", "0"), "harmonics"),
        (("validate", "exc.json", "rec.csv"), "exc.json"),
        (("report", "rec.csv", "--out", "never.html"), "rec.csv"),
        (("export", "model.json"), "--urdf"),
        (("batch", "nowhere", "--robot", "exo_leg"), "no such folder"),
        (("batch", ".", "--robot", "exo_leg", "--jobs", "0"), "--jobs"),
        (("excite", "exo_leg", "--out", "never.json", "--jobs", "0"), "--jobs"),
        (("excite", "exo_leg", "--out", "never.json", "--base-frequency", "1e-9"), "samples"),
        (("identify", "exo_leg", "rec.csv", "--out", "rec.csv"), "would be lost"),
        (("identify", "out.urdf", "rec.csv", "--out", "never.json", "--report", "out.urdf"), "would be lost"),
        (("export", "model.json", "--urdf", "model.json"), "would be lost"),
        (("report", "model.json", "--out", "model.json"), "would be lost"),
        (("diagnose", "model.json", "rec.csv", "--out", "model.json"), "would be lost"),
        (("validate", "model.json", "rec.csv", "--column", "q_hip"), "NAME=SOURCE"),
        (("validate", "model.json", "rec.csv", "--column", "q_hip=q_hip,unit=furlong"), "furlong"),
        (("validate", "model.json", "rec.csv", "--column", "q_hip=q_hip,gear=2"), "gear_ratio"),
        (("validate", "model.json", "rec.csv", "--column", "q_hip=q_hip,zero=north"), "NUMBER"),
        (("validate", "model.json", "rec.csv", "--column", "q_hip=a", "--column", "q_hip=b"), "twice"),
        (("validate", "model.json", "rec.csv", "--between", "5"), "START,STOP"),
        (("validate", "model.json", "rec.csv", "--between", "5,then"), "START,STOP"),
        (("identify", "exo_leg", "rec.csv", "--between", "50,60", "--out", "never.json"), "runs from 0 s to"),
    ],
)
def test_bad_input_names_the_culprit_and_writes_nothing(chain, call_here, arguments, expected):
    folder = chain[0]
    (folder / "bad.csv").write_text("time,q_hip\n0,0\n1,nan\n")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    done = call_here(*arguments, cwd=folder)
    assert done.returncode == 2, done.stderr
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_ctrl_c_while_a_file_is_written_leaves_none(chain, tmp_path):
    program = (
        "import os, time\nfrom sea_ident.cli import main\n"
        "def stuck(*_):\n    print('writing', flush=True)\n    time.sleep(60)\n"
        "os.fsync = stuck\nmain()\n"
    )
    arguments = ["identify", "exo_leg", str(chain[0] / "rec.csv"), "--period", "5", "--out", str(tmp_path / "m.json")]
    with subprocess.Popen(
        [sys.executable, "-c", program, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "writing\n"
        assert len(list(tmp_path.iterdir())) == 1  # the temporary file
        process.send_signal(2)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert list(tmp_path.iterdir()) == []


def test_batch_goes_past_a_bad_recording(chain, tmp_path):
    (tmp_path / "good.csv").write_bytes((chain[0] / "rec.csv").read_bytes())
    (tmp_path / "bad.csv").write_text("time,q_hip\n0,0\n1,nan\n")
    record = call_json("batch", tmp_path, "--robot", "exo_leg", "--period", 5, "--jobs", 1)
    assert record["recordings"] == 2
    assert record["failed"] == 1
    assert [row["done"] for row in record["rows"]] == [False, True]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_offered_for_shells(shell):
    program = f"import os; os.environ['_SEA_IDENT_COMPLETE'] = 'source_{shell}'\nfrom sea_ident.cli import main\nmain()"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert "sea-ident" in done.stdout
    assert "_SEA_IDENT_COMPLETE" in done.stdout


@pytest.mark.skipif(not DATA.is_dir(), reason="measured recordings are not beside this checkout (../shared/data)")
def test_the_emps_axis_comes_out_as_published(tmp_path):
    record = call_json(
        "identify", "emps", DATA / "emps" / "identification.csv", "--out", tmp_path / "model.json",
        "--add", "torque_offset", "--add", "coulomb_friction,smoothing=0.001",
    )  # fmt: skip
    found = {parameter["name"]: parameter["value"] for parameter in record["base_parameters"]}
    # Janot, Gautier, Brunot 2019: M, Fv, Fc, offset
    assert found["carriage.m"] == pytest.approx(95.1089, rel=0.005)
    assert found["slider.viscous_friction"] == pytest.approx(203.5034, rel=0.02)
    assert found["slider.coulomb_friction"] == pytest.approx(20.3935, rel=0.02)
    assert found["slider.torque_offset"] == pytest.approx(-3.1648, rel=0.03)


def test_a_warning_is_told_once(capsys):
    output.hold("the first")
    output.hold("the second")
    output.hold("the second")
    output.emit({}, "result\n  warning: the first", as_json=False)
    output.tell_held()
    told = capsys.readouterr()
    assert (told.out, told.err) == ("result\n  warning: the first\n", "warning: the second\n")
    output.hold("the first")
    output.emit({"warnings": ["the first"]}, "", as_json=True)
    output.tell_held()
    assert capsys.readouterr().err == "warning: the first\n"


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are any bytes on Linux")
def test_names_of_files_that_are_no_text_are_printed(tmp_path):
    (tmp_path / os.fsdecode(b"r\xff.csv")).write_text("nothing\n")
    done = call("batch", tmp_path, "--robot", "emps", "--jobs", 1)
    assert done.returncode == 0, done.stderr
    assert r"r\udcff.csv" in done.stdout
