"""Columns of two joints that change places, and signs: told by the model that fits once they are put right."""

import warnings
from itertools import combinations

import numpy as np
import pytest

from estimation.synthetic import record, truth_of
from sea_ident.effects import base_effects
from sea_ident.estimation import identify
from sea_ident.estimation.misplaced import misplaced_columns
from sea_ident.exceptions import IdentificationError, SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.processing import process
from sea_ident.robot import load_robot

NOISE = {"torque_noise": 0.1, "encoder_noise": 1e-5}
POSITIONS = ("q", "theta")


@pytest.fixture(scope="module")
def clean(leg, coarse):
    return record(leg, coarse, 3, **NOISE)


def processed_of(leg, recording):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return process(recording, leg, period=10.0)


def exchanged(recording, kinds, a, b):
    return recording.replace_columns(
        {f"{kind}_{x}": recording.columns[f"{kind}_{y}"] for kind in kinds for x, y in ((a, b), (b, a))}
    )


def reversed_(recording, kinds, joint):
    return recording.replace_columns({f"{kind}_{joint}": -recording.columns[f"{kind}_{joint}"] for kind in kinds})


@pytest.mark.parametrize("kinds", [("q", "theta", "tau_motor"), ("tau_motor",), POSITIONS, ("q",), ("theta",)])
@pytest.mark.parametrize("pair", list(combinations(("hip", "knee", "ankle"), 2)))
def test_joints_that_changed_places_are_named(leg, clean, kinds, pair):
    found = misplaced_columns(leg, base_effects(leg), processed_of(leg, exchanged(clean, kinds, *pair)))
    names = ", ".join(f"'{kind}_{x}={kind}_{y}'" for kind in kinds for x, y in (pair, pair[::-1]))
    assert f"of {pair[0]!r} and {pair[1]!r} look exchanged" in found
    assert f"--column with {names}. With that" in found


def test_a_joint_that_turns_the_other_way_is_named(leg, clean):
    """All of its columns follow another convention than the model."""
    kinds = (*POSITIONS, "tau_motor")
    found = misplaced_columns(leg, base_effects(leg), processed_of(leg, reversed_(clean, kinds, "knee")))
    assert "q_knee, theta_knee and tau_motor_knee have the other sign" in found
    assert "'tau_motor_knee=tau_motor_knee,sign=-1'" in found


@pytest.mark.parametrize(
    ("kinds", "joint"),
    [(("tau_motor",), "hip"), (("tau_motor",), "knee"), (POSITIONS, "hip"), (POSITIONS, "knee"), (POSITIONS, "ankle")],
)
def test_a_joint_with_the_other_sign_is_named(leg, clean, kinds, joint):
    """Turning one joint is turning all others, but for the sign of the inertia."""
    found = misplaced_columns(leg, base_effects(leg), processed_of(leg, reversed_(clean, kinds, joint)))
    columns = " and ".join(f"{kind}_{joint}" for kind in kinds)
    assert f"{columns} ha" in found
    assert "the other sign, by the other joints" in found
    assert ", ".join(f"'{kind}_{joint}={kind}_{joint},sign=-1'" for kind in kinds) in found


def test_the_names_are_those_to_be_given(leg, clean, tmp_path):
    """What the sentence says, done, gives the recording as it was meant."""
    from sea_ident.recordings import ColumnSource, read_recording, write_recording

    wrong = exchanged(clean, ("tau_motor",), "hip", "knee")
    write_recording(wrong, tmp_path / "wrong.csv")
    columns = {"tau_motor_hip": ColumnSource("tau_motor_knee"), "tau_motor_knee": ColumnSource("tau_motor_hip")}
    right = read_recording(tmp_path / "wrong.csv", columns=columns)
    np.testing.assert_array_equal(right.columns["tau_motor_hip"], clean.columns["tau_motor_hip"])
    assert misplaced_columns(leg, base_effects(leg), processed_of(leg, right)) is None


def test_identify_says_it_once(leg, clean):
    wrong = processed_of(leg, exchanged(clean, ("tau_motor",), "hip", "knee"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = identify(leg, wrong)
    told = [text for text in model.warnings if "look exchanged" in text]
    assert told == [misplaced_columns(leg, model.effects, wrong)]
    assert not any("comes out negative from its own torque" in text for text in model.warnings)


def test_all_signs_turned_is_no_matter_of_one_joint(leg, clean):
    wrong = clean
    for joint in leg.joint_names:
        wrong = reversed_(wrong, ("tau_motor",), joint)
    processed = processed_of(leg, wrong)
    with pytest.raises(IdentificationError, match="negative in every joint"):
        identify(leg, processed)


def test_a_model_that_lacks_much_is_no_wrong_column(leg, clean):
    """Bodies alone leave a large share of the torque, and a strong parallel spring turns the sign of an inertia."""
    processed = processed_of(leg, clean)
    bodies = [effect for effect in base_effects(leg) if effect.name == "rigid_bodies"]
    assert misplaced_columns(leg, bodies, processed) is None
    assert misplaced_columns(leg, base_effects(leg), processed) is None
    for joint in leg.joint_names:
        torque = clean.columns[f"tau_motor_{joint}"] + 200.0 * clean.columns[f"q_{joint}"]
        processed = processed_of(leg, clean.replace_columns({f"tau_motor_{joint}": torque}))
        assert misplaced_columns(leg, base_effects(leg), processed) is None


def test_of_two_joints_the_one_that_is_turned_is_named(tmp_path):
    """A torque that is turned is the other one turned, with every parameter negative: the inertias tell which."""
    inertial = (
        '<inertial><origin xyz="0.3 0 0"/><mass value="3"/>'
        '<inertia ixx="0.01" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    joint = '<axis xyz="0 1 0"/><limit lower="-6" upper="6" velocity="20" effort="200"/></joint>'
    (tmp_path / "two.urdf").write_text(
        f'<robot name="two"><link name="base"/><link name="a">{inertial}</link><link name="b">{inertial}</link>'
        f'<joint name="one" type="revolute"><parent link="base"/><child link="a"/>{joint}'
        f'<joint name="two" type="revolute"><origin xyz="0.6 0 0"/><parent link="a"/><child link="b"/>{joint}</robot>'
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        robot = load_robot(tmp_path / "two.urdf")
    clean = record(robot, moved(robot, 0.8), 3, **NOISE)
    for joint in robot.joint_names:
        wrong = reversed_(clean, ("tau_motor",), joint)
        found = misplaced_columns(robot, base_effects(robot), processed_of(robot, wrong))
        assert f"tau_motor_{joint} has the other sign" in found


def test_where_the_exchange_leaves_much_the_columns_may_be_right(leg, clean):
    """A torque that no model has, in every period, large enough to doubt all."""
    wrong = exchanged(clean, ("tau_motor",), "hip", "ankle")
    assert misplaced_columns(leg, base_effects(leg), processed_of(leg, wrong)) is not None
    wave = np.sin(2.0 * np.pi * 1.7 * (wrong.time - wrong.time[0]))
    rms = {joint: np.std(wrong.columns[f"tau_motor_{joint}"]) for joint in leg.joint_names}
    waved = wrong.replace_columns(
        {
            f"tau_motor_{joint}": wrong.columns[f"tau_motor_{joint}"] + 0.3 * rms[joint] * wave
            for joint in leg.joint_names
        }
    )
    assert misplaced_columns(leg, base_effects(leg), processed_of(leg, waved)) is None


def test_rigid_arms_have_no_other_motor_positions():
    """Of a rigid arm there are no theta columns to be named."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        robot = load_robot("example:ur_description/urdf/ur5_robot.urdf")
    a, b = robot.joint_names[1:3]
    wrong = exchanged(record(robot, moved(robot), 2, **NOISE), ("q", "tau_motor"), a, b)
    found = misplaced_columns(robot, base_effects(robot), processed_of(robot, wrong))
    assert f"--column with 'q_{a}=q_{b}', 'q_{b}=q_{a}', 'tau_motor_{a}=tau_motor_{b}'" in found


def test_one_joint_alone_has_no_other():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        robot = load_robot("emps")
    recording = reversed_(record(robot, moved(robot), 2, **NOISE), ("tau_motor",), robot.joint_names[0])
    assert misplaced_columns(robot, base_effects(robot), processed_of(robot, recording)) is None


def moved(robot, amplitude=0.3):
    a, b = np.random.default_rng(2).normal(0.0, amplitude, (2, robot.n, 5))
    return truth_of(robot, FourierSeries(0.1, np.zeros(robot.n), a, b), samples=500)
