"""The command line, called as users and other programs call it: as a process of its own."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest


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
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "started\n"
    time.sleep(0.05)
    process.send_signal(2)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in errors
