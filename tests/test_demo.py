"""The demo: the paper's experiment comes out right, and nothing that it writes is ever half a file."""

import json
import signal
import subprocess
import sys
import time
import warnings
from itertools import pairwise

import numpy as np
import pytest

from sea_ident import load_robot
from sea_ident.demo import STEPS, gait, run_demo
from sea_ident.estimation import read_model
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.excitation import design_excitation, read_excitation
from sea_ident.recordings import read_recording

FILES = {
    "excitation.json", "recording.csv", "gait.csv", "MODEL.json", "tables.md", "tables.json", "figure_1a_torque.png",
    "figure_1b_variance.png", "figure_3_angles.png", "leg.png", "report.html",
}  # fmt: skip
PERIODS = 20


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    told: list[int] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        result = run_demo(
            folder, seed=5, starts=1, periods=PERIODS, jobs=1, progress=lambda done, what: told.append(done)
        )
    return result, folder, told


def test_all_files_are_written_and_no_other(demo):
    result, folder, _ = demo
    assert {path.name for path in folder.iterdir()} == FILES
    assert {path.name for path in result.files} == FILES
    assert all(path.stat().st_size > 500 for path in result.files)


def test_table_one_compares_with_the_leg_that_was_simulated(demo):
    result = demo[0]
    assert len(result.parameters) == 16 + 9
    rows = {row.name: row for row in result.parameters}
    # a foot that hangs from the ankle: mass 1.5 kg at (0.0213, -0.0543) m
    assert rows["foot.mx"].cad == pytest.approx(1.5 * 0.021333333, rel=1e-6)
    assert rows["foot.mz"].cad == pytest.approx(1.5 * -0.054266667, rel=1e-6)
    assert rows["hip.K3"].cad == 15000.0
    errors = np.array([(row.estimate - row.cad) / row.std for row in result.parameters])
    # with 20 periods: Student's t with 19 degrees of freedom stays within 5 in 99.99 % of cases
    assert np.all(np.abs(errors) < 5.0)
    inertial = [row for row in result.parameters[:10] if row.name not in ("thigh.mx", "foot.Iyy")]
    assert all(row.std < 0.03 * abs(row.cad) for row in inertial)
    assert all(abs(row.estimate - row.cad) < 0.03 * abs(row.cad) for row in inertial)


def test_table_two_says_what_each_column_means(demo):
    result = demo[0]
    rows = {row.criterion: row for row in result.performance}
    log_det = rows["log det(F'F), reduced model"]
    assert log_det.planned == result.excitation.log_det
    # the springs take the links a little elsewhere, which changes the information little (paper, section IV)
    assert abs(log_det.measured - log_det.planned) < 3.0
    condition = rows["condition number of F, reduced model"]
    assert 0.7 < condition.measured / condition.planned < 1.4
    gait_rms = rows["gait torque rms, all joints [N m]"]
    exact = rows["the same against the exact torque [N m]"]
    assert 0.0 < exact.sample_weighting < gait_rms.sample_weighting < 0.3
    numbers = json.loads((demo[1] / "tables.json").read_text())
    assert len(numbers["performance"]) == len(result.performance)
    assert all(f"| {row.criterion}" in (demo[1] / "tables.md").read_text() for row in result.performance)


def test_what_is_written_can_be_read_back(demo):
    result, folder, _ = demo
    model = read_model(folder / "MODEL.json")
    np.testing.assert_allclose(model.values, result.model.values)
    excitation = read_excitation(folder / "excitation.json")
    recording = read_recording(folder / "recording.csv")
    assert recording.samples == PERIODS * round(excitation.period * 200)
    assert recording.joints == ("hip", "knee", "ankle")


def test_progress_rises_to_the_end(demo):
    told = demo[2]
    assert all(a <= b for a, b in pairwise(told))
    assert told[-1] == STEPS


def test_the_gait_stays_inside_the_limits_of_the_leg():
    limits = load_robot("exo_leg").limits
    motion = gait().sample(samples=2000)
    assert np.all(motion.q > limits.lower)
    assert np.all(motion.q < limits.upper)
    assert np.all(np.abs(motion.dq) < limits.velocity)
    assert np.all(np.abs(motion.ddq) < limits.acceleration)
    assert np.all(motion.q @ limits.combinations.T > limits.combination_lower)
    # a step: the knee bends most in swing, after the hip was furthest back
    assert np.argmin(motion.q[:, 1]) > np.argmin(motion.q[:, 0])


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(SeaIdentError, match="cannot be made"):
        run_demo(tmp_path / "file" / "demo")


PROGRAM = """
import sys
from sea_ident.demo import run
from sea_ident.excitation import read_excitation
designed = read_excitation(sys.argv[1])
run.design_excitation = lambda *_, **__: designed
run.run_demo(sys.argv[2], periods=3)
"""


@pytest.fixture(scope="module")
def designed(tmp_path_factory):
    """An excitation to begin with: when a file is whole does not hang on which motion it tells of."""
    file = tmp_path_factory.mktemp("designed") / "excitation.json"
    design_excitation(load_robot("exo_leg"), harmonics=4, starts=1, rate=50.0, jobs=1).save(file)
    return file


@pytest.mark.scenario
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
@pytest.mark.parametrize(
    "last_seen",
    [
        "MODEL.json",
        pytest.param("recording.csv", marks=pytest.mark.slow),
        pytest.param("figure_1a_torque.png", marks=pytest.mark.slow),
    ],
)
def test_a_kill_leaves_whole_files_or_none(designed, tmp_path, last_seen):
    command = [sys.executable, "-c", PROGRAM, str(designed), str(tmp_path)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    # the kill comes while the file after this one is being made: recordings take longest to write
    while not list(tmp_path.glob(f"*{last_seen}")) and process.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.kill()
    process.wait()
    assert process.returncode == -signal.SIGKILL, "the demo ended before the kill"
    present = {path.name for path in tmp_path.iterdir() if path.name[0] != "."}
    assert present <= FILES
    for name in present:
        if name.endswith(".json"):
            json.loads((tmp_path / name).read_text())
        if name == "recording.csv":
            assert read_recording(tmp_path / name).samples == 3 * 2000
        if name == "gait.csv":
            assert read_recording(tmp_path / name).samples == 3 * 500
        if name.endswith(".png"):
            assert (tmp_path / name).read_bytes()[-8:-4] == b"IEND"
        if name == "MODEL.json":
            read_model(tmp_path / name)
