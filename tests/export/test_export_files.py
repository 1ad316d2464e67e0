"""From an identified model to files: the same torque, complete files, or an error."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from given import brisk_motion, reload

from sea_ident import Model, export_mjcf, export_urdf, identify, load_robot, process, read_model, simulate
from sea_ident.effects import base_effects, make_effect
from sea_ident.exceptions import ExportError, SeaIdentWarning
from sea_ident.export import build_mujoco_robot, model_values
from sea_ident.motion import FourierSeries
from sea_ident.regressor import build_regressor, prior_parameters


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    """The leg, identified from a simulated recording with noise, written down and read again."""
    robot = load_robot("exo_leg")
    rng = np.random.default_rng(3)
    a, b = 0.06 * rng.normal(size=(2, 3, 5)) * np.array([1.0, 0.8, 1.5])[:, None]
    reference = FourierSeries(0.2, np.array([0.35, -0.2, 0.3]), a, b)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        recording = simulate(robot, reference, periods=4, seed=1).recording
        found = identify(robot, process(recording, robot, period=5.0))
    path = tmp_path_factory.mktemp("model") / "MODEL.json"
    found.save(path)
    return read_model(path)


def exported(model: Model, path: Path) -> tuple[object, tuple[str, ...]]:
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        result = (export_urdf if path.suffix == ".urdf" else export_mjcf)(model, path)
    assert [str(w.message) for w in heard] == [f"{path}: {text}" for text in result.warnings]
    return result


def test_urdf_predicts_what_the_model_predicts(model: Model, tmp_path: Path) -> None:
    result = exported(model, tmp_path / "leg.urdf")
    robot = reload((tmp_path / "leg.urdf").read_text(), model.robot)
    motion = brisk_motion(robot)
    effects = base_effects(robot)
    torque = build_regressor(robot, effects, motion).sum @ prior_parameters(robot, effects)
    expected = reference_torque(model, result.warnings, motion)
    np.testing.assert_allclose(torque, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())
    for spring in model.springs:
        actuator = robot.spring(spring.joint)
        assert (actuator.stiffness, actuator.cubic_stiffness, actuator.damping) == spring.law


def test_a_spring_with_negative_stiffness_is_left_out(model: Model, tmp_path: Path) -> None:
    """The file can be read again, and says of this spring what the description says."""
    hip, *rest = model.springs
    wrong = replace(model, springs=(replace(hip, stiffness=-9.0, linear_stiffness=-9.0), *rest))
    result = exported(wrong, tmp_path / "leg.urdf")
    assert any("spring of 'hip' came out as -9, which no spring has" in text for text in result.warnings)
    again, given = (robot.spring("hip") for robot in (load_robot(tmp_path / "leg.urdf"), model.robot))
    assert (again.stiffness, again.cubic_stiffness) == (given.stiffness, given.cubic_stiffness)
    with pytest.raises(ExportError, match="'hip' has no stiffness; identify the springs first"):
        export_mjcf(wrong, tmp_path / "leg.xml")


def test_joints_that_the_model_holds_are_told(model: Model, tmp_path: Path) -> None:
    held = replace(model, robot=replace(model.robot, locked={"toe": 0.0}))
    (note,) = [text for text in exported(held, tmp_path / "leg.urdf").notes if "(toe)" in text]
    assert "--joints hip,knee,ankle" in note


def test_mjcf_predicts_what_the_model_predicts(model: Model, tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MJCF is judged by MuJoCo: pip install 'sea-ident[mujoco]'")
    result = exported(model, tmp_path / "leg.xml")
    bridge = build_mujoco_robot(model_values(model)[0])
    written = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.xml"))
    np.testing.assert_array_equal(written.body_mass, bridge.model.body_mass)
    motion = brisk_motion(model.robot)
    torque = sum(bridge.inverse_dynamics(motion))
    expected = reference_torque(model, result.warnings, motion)
    np.testing.assert_allclose(torque, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def reference_torque(model: Model, told: tuple[str, ...], motion: object) -> np.ndarray:
    """What the model predicts; where no real bodies have its values, what the nearest that do predict."""
    from sea_ident.estimation import physical_parameters

    physical = physical_parameters(model)
    assert physical.consistent == (told == ())
    return (model if physical.consistent else physical.model).predict(motion)


def test_summary_names_the_file(model: Model, tmp_path: Path) -> None:
    result = exported(model, tmp_path / "leg.urdf")
    assert str(tmp_path / "leg.urdf") in result.summary()
    assert result.format == "urdf"


def test_nothing_half_written(model: Model, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="does not exist; make it first"):
        exported(model, tmp_path / "nowhere" / "leg.urdf")
    (tmp_path / "folder.urdf").mkdir()
    with pytest.raises(ExportError, match="cannot be written"):
        exported(model, tmp_path / "folder.urdf")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.urdf"]


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_what_errs_in_a_sensor_is_named_as_left_out(model: Model, tmp_path: Path) -> None:
    """It has no column, so that no parameter stands for it."""
    late = replace(model, effects=(*model.effects, make_effect("position_delay", "knee", delay=0.002)))
    for export, name in ((export_urdf, "leg.urdf"), (export_mjcf, "leg.xml")):
        told = " ".join((*(written := export(late, tmp_path / name)).notes, *written.warnings))
        assert "no place for" in told
        assert "knee.position_delay" in told


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_joint_that_is_elsewhere_is_to_be_corrected_in_the_description(tmp_path: Path) -> None:
    """A URDF has a place for it, which the export does not write: the bodies beside it are those of the model."""
    robot = load_robot("exo_leg")
    a, b = 0.1 * np.random.default_rng(3).normal(size=(2, 3, 5))
    recording = simulate(robot, FourierSeries(0.2, np.array([0.35, -0.2, 0.3]), a, b), periods=3, seed=1).recording
    model = identify(
        robot, recording, period=5.0, effects=(*base_effects(robot), make_effect("joint_placement", "knee"))
    )
    for name in ("leg.urdf", "leg.xml"):
        written = exported(model, tmp_path / name)
        (said,) = [text for text in written.warnings if "joint_placement" in text]
        assert "correct the <origin> of the joint in the description, identify again" in said
        assert not any("no place for" in text and "joint_placement" in text for text in written.notes)
        assert not any("no place for" in text for text in written.warnings)
