"""Whatever bytes a robot is read from: a Robot or a SeaIdentError, and no noise."""

import os
import re
import tempfile
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.robot import Robot, load_robot, robot_from_text, robots_folder

LEG = (robots_folder() / "exo_leg" / "exo_leg.urdf").read_text()
LEG_BARE = re.sub(r"<(visual|collision)\b.*?</\1>", "", re.sub(r"<!--.*?-->", "", LEG, flags=re.S), flags=re.S)
NUMBERS = [m.span() for m in re.finditer(r"-?\d+\.?\d*(e-?\d+)?", LEG_BARE)]
NAMES = [m.span(1) for m in re.finditer(r'"([a-z_/A-Z]+)"', LEG_BARE)]
TAGS = [m.span() for m in re.finditer(r"<[^>]*>", LEG_BARE)]
BAD_NUMBERS = ["0", "-1", "nan", "inf", "1e400", "1e-320", "1e300", "", "x", "0x10", "1,5", "  ", "9" * 400, "٣"]
BAD_NAMES = [
    "",
    " ",
    "thigh",
    "hip",
    "universe",
    "root_joint",
    "hip rotor",
    "&lt;",
    "é",
    "a" * 3000,
    "fixed",
    "floating",
]
BUDGET = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def read(text: str, joints: tuple[str, ...] | None = None) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        try:
            robot = robot_from_text(text, "fuzz.urdf", joints=joints)
        except SeaIdentError as error:
            message = str(error)
        else:
            message = "fuzz.urdf"
            assert isinstance(robot, Robot)
            assert np.all(np.isfinite(robot.inertia(np.zeros(robot.n))))
    assert message.startswith("fuzz.urdf")


@pytest.fixture
def silent(capfd: pytest.CaptureFixture[str]):
    yield
    assert capfd.readouterr() == ("", "")


@BUDGET
@given(data=st.binary(max_size=400))
def test_any_bytes(silent: None, data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fuzz.urdf"
        path.write_bytes(data)
        with pytest.raises(SeaIdentError):
            load_robot(path)


@BUDGET
@given(st.text(max_size=300))
def test_any_text_and_any_name(silent: None, text: str) -> None:
    read(text)
    if not os.path.lexists(text.replace("\x00", "")):
        with pytest.raises(SeaIdentError):
            load_robot(text + "\u2603")


@BUDGET
@given(st.lists(st.tuples(st.sampled_from(NUMBERS), st.sampled_from(BAD_NUMBERS)), min_size=1, max_size=3))
def test_any_number_replaced(silent: None, changes: list[tuple[tuple[int, int], str]]) -> None:
    read(edited(changes))


@BUDGET
@given(st.lists(st.tuples(st.sampled_from(NAMES), st.sampled_from(BAD_NAMES)), min_size=1, max_size=3))
def test_any_name_replaced(silent: None, changes: list[tuple[tuple[int, int], str]]) -> None:
    read(edited(changes))


@BUDGET
@given(st.lists(st.tuples(st.sampled_from(TAGS), st.sampled_from(["", "<link/>", "<joint/>", "<mimic/>"])), max_size=2))
def test_any_tag_replaced(silent: None, changes: list[tuple[tuple[int, int], str]]) -> None:
    read(edited(changes))


@BUDGET
@given(st.integers(0, len(LEG_BARE)), st.integers(0, len(LEG_BARE)), st.booleans())
def test_any_part_cut_out_or_doubled(silent: None, one: int, two: int, doubled: bool) -> None:
    start, end = sorted((one, two))
    read(LEG_BARE[:end] + LEG_BARE[start:] if doubled else LEG_BARE[:start] + LEG_BARE[end:])


@BUDGET
@given(st.lists(st.sampled_from(["hip", "knee", "ankle", "toe", "", "universe"]), max_size=4))
def test_any_choice_of_joints(silent: None, joints: list[str]) -> None:
    read(LEG_BARE, tuple(joints))


def edited(changes: list[tuple[tuple[int, int], str]], text: str = LEG_BARE) -> str:
    last = len(text) + 1
    for (start, end), value in sorted(changes, reverse=True):
        if end <= last:
            text, last = text[:start] + value + text[end:], start
    return text


TRANSMISSIONS = "".join(re.findall(r"<transmission.*?</transmission>", LEG_BARE, flags=re.DOTALL))
FRAGMENT = f'<robot name="leg">{TRANSMISSIONS}</robot>'
BARE = re.sub(r"<transmission.*?</transmission>", "", LEG_BARE, flags=re.DOTALL)
WORDS = [m.span() for m in re.finditer(r"[A-Za-z_/0-9.+-]+", FRAGMENT)]


@BUDGET
@given(st.lists(st.tuples(st.sampled_from(WORDS), st.sampled_from([*BAD_NUMBERS, *BAD_NAMES])), max_size=3))
def test_any_word_of_an_annotation_replaced(silent: None, changes: list[tuple[tuple[int, int], str]]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        try:
            robot = robot_from_text(BARE, "fuzz.urdf", edited(changes, FRAGMENT))
        except SeaIdentError as error:
            message = str(error)
        else:
            message = "fuzz.urdf"
            assert np.all(np.isfinite(robot.motor_inertia(np.zeros(robot.n))))
    assert message.startswith(("fuzz.urdf", "annotation"))
