"""The exported URDF predicts the same torque, and differs from the user's file in nothing but the values."""

import difflib
import re

import numpy as np
import pytest
from given import ROBOTS, brisk_motion, effects_of, identified, load, reload, torque, values_of
from lxml import etree

from sea_ident.effects import make_effect
from sea_ident.exceptions import ExportError
from sea_ident.export import collect_values, urdf_text
from sea_ident.regressor import model_columns, prior_parameters
from sea_ident.robot import robot_from_text


@pytest.mark.parametrize("name", ROBOTS)
def test_reloaded_robot_has_the_same_torque_to_nine_digits(name: str) -> None:
    robot = load(name)
    values, effects, psi = values_of(robot)
    text, notes = urdf_text(values)
    again = reload(text, robot)
    assert again.joint_names == robot.joint_names
    assert again.elastic == robot.elastic
    motion = brisk_motion(robot)
    expected = torque(robot, effects, psi, motion)
    found = torque(again, effects_of(again), np.nan_to_num(prior_parameters(again, effects_of(again))), motion)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9 * max(np.abs(other).max(), 1.0))
    assert all("multiplied by" in note for note in notes)


@pytest.mark.parametrize("name", ["exo_leg_link_friction", "baxter arm, rotors askew"])
def test_only_values_change(name: str) -> None:
    """Comments, blanks, names and geometry: what is left when the numbers are blotted out is the file itself."""
    robot = load(name)
    text, _ = urdf_text(values_of(robot)[0])

    def blotted(xml: str) -> str:
        xml = re.sub(r"<transmission.*?</transmission>\s*", "", xml, flags=re.DOTALL)
        xml = re.sub(r"<inertial.*?</inertial>", "<inertial/>", xml, flags=re.DOTALL)
        xml = re.sub(r"\s*<dynamics[^>]*/>", "", xml)
        return re.sub(r"\s+(?=</robot>)", "", xml)

    assert blotted(text) == blotted(robot.urdf)
    for comment in re.findall(r"<!--.*?-->", robot.urdf, flags=re.DOTALL):
        assert comment in text
    assert len(text.splitlines()) >= len(robot.urdf.splitlines())


def test_leg_changes_on_lines_with_values_alone() -> None:
    robot = load("exo_leg")
    text, _ = urdf_text(values_of(robot)[0])
    difference = list(difflib.ndiff(robot.urdf.splitlines(), text.splitlines()))
    kinds = "origin|mass|inertia|iyy|rotorInertia|viscousFriction|coulombFriction|seriesElastic|dynamics"
    changed = [line[2:] for line in difference if line[0] in "+-"]
    assert all(re.match(rf"\s*<?({kinds})\b", line) for line in changed)
    assert 40 < len(changed) < 80


def test_links_fixed_to_a_body_stay_as_they_are() -> None:
    robot = load("baxter arm")
    effects = effects_of(robot)
    psi = prior_parameters(robot, effects)
    psi[: 10 * len(robot.bodies)] *= 1.02
    text, _ = urdf_text(collect_values(robot, model_columns(robot, effects), np.nan_to_num(psi)))
    before, after = (etree.fromstring(xml.encode()) for xml in (robot.urdf, text))
    changed = set()
    for old, new in zip(before.findall("link"), after.findall("link"), strict=True):
        if etree.tostring(old) != etree.tostring(new):
            changed.add(old.get("name"))
    assert changed == set(robot.bodies)


HAND = """<robot name="hand"><link name="base"/><link name="wrist"><inertial><mass value="{own}"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial></link><link name="tool"><inertial><origin xyz="0.1 0 0"/>
<mass value="3"/><inertia ixx="0.02" iyy="0.02" izz="0.02"/></inertial></link>
<joint name="turn" type="continuous"><parent link="base"/><child link="wrist"/><axis xyz="0 0 1"/></joint>
<joint name="mount" type="fixed"><parent link="wrist"/><child link="tool"/><origin xyz="0 0 0.2" rpy="1 0 0"/></joint>
</robot>"""


def test_links_that_weigh_more_than_was_identified_are_scaled() -> None:
    with pytest.warns(UserWarning, match="rigid robot"):
        robot = robot_from_text(HAND.format(own=1), "hand.urdf")
    effects = effects_of(robot)
    psi = prior_parameters(robot, effects)
    psi[:10] *= 0.5  # half of 4 kg: less than the tool alone
    psi[10:] = 0.1
    text, notes = urdf_text(collect_values(robot, model_columns(robot, effects), psi))
    assert any("the links fixed to 'wrist' (tool) weigh more" in note for note in notes)
    with pytest.warns(UserWarning, match="rigid robot"):
        again = robot_from_text(text, "hand.urdf")
    np.testing.assert_allclose(again.inertial_parameters, psi[:10], rtol=1e-12, atol=1e-14)
    masses = [float(m.get("value")) for m in etree.fromstring(text.encode()).iter("mass")]
    assert sum(masses) == pytest.approx(2.0)
    assert all(mass > 0.0 for mass in masses)


def test_link_without_inertial_gets_one_where_it_has_mass() -> None:
    text = re.sub(r'(<link name="wrist">)<inertial>.*?</inertial>', r"\1", HAND.format(own=1), flags=re.DOTALL)
    with pytest.warns(UserWarning, match="rigid robot"):
        robot = robot_from_text(text, "hand.urdf")
    effects = effects_of(robot)
    psi = identified(robot, effects)
    psi[0] += 10.0
    psi[[4, 6, 9]] += 10.0
    exported, _ = urdf_text(collect_values(robot, model_columns(robot, effects), psi))
    with pytest.warns(UserWarning, match="rigid robot"):
        again = robot_from_text(exported, "hand.urdf")
    np.testing.assert_allclose(again.inertial_parameters, psi[:10], rtol=1e-11, atol=1e-12)
    unchanged, _ = urdf_text(
        collect_values(robot, model_columns(robot, effects), np.nan_to_num(prior_parameters(robot, effects)))
    )
    assert unchanged == text


def test_fragment_moves_into_the_urdf_and_other_transmissions_stay() -> None:
    robot = load("baxter arm")
    text, _ = urdf_text(values_of(robot)[0])
    names = [t.get("name") for t in etree.fromstring(text.encode()).findall("transmission")]
    own = [t.get("name") for t in etree.fromstring(robot.urdf.encode()).findall("transmission")]
    assert names[: len(own)] == own
    assert set(names[len(own) :]) == {
        f"{side}_{j}_sea" for side in ("left", "right") for j in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")
    }


def test_offsets_and_unknown_effects_are_named_as_left_out() -> None:
    robot = load("exo_leg")
    effects = (*effects_of(robot), make_effect("torque_offset", "hip"))
    psi = identified(robot, effects)
    _, notes = urdf_text(collect_values(robot, model_columns(robot, effects), psi))
    assert notes == ["a URDF has no place for hip.torque_offset: left out"]


def test_values_that_are_no_model() -> None:
    robot = load("exo_leg")
    effects = effects_of(robot)
    columns, psi = model_columns(robot, effects), identified(robot, effects)
    with pytest.raises(ExportError, match=r"parameter thigh\.m is nan; give it a finite value"):
        collect_values(robot, columns, np.where(np.arange(len(psi)) == 0, np.nan, psi))
    with pytest.raises(ExportError, match="have 3 values"):
        collect_values(robot, columns, psi[:3])
    with pytest.raises(ExportError, match=r"no value for thigh\.m"):
        collect_values(robot, columns[10:], psi[10:])


def test_body_that_cannot_be_is_refused() -> None:
    robot = load("exo_leg")
    effects = effects_of(robot)
    psi = identified(robot, effects)
    psi[5] += 10.0  # Ixy of the thigh
    with pytest.raises(ExportError, match="link 'thigh' has inertial parameters that no body has"):
        urdf_text(collect_values(robot, model_columns(robot, effects), psi))


def test_declared_encoding_becomes_that_of_the_text() -> None:
    text = '<?xml version="1.0" encoding="ISO-8859-1"?>\n' + HAND.format(own=1).replace("tool", "Gerät")
    with pytest.warns(UserWarning, match="rigid robot"):
        robot = robot_from_text(text, "hand.urdf")
    effects = effects_of(robot)
    exported, _ = urdf_text(collect_values(robot, model_columns(robot, effects), identified(robot, effects)))
    assert etree.fromstring(exported.encode()).findall("link")[2].get("name") == "Gerät"
