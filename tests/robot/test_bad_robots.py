"""Bad robot descriptions: each a clear error that says what to do."""

import warnings
from pathlib import Path

import pytest
from urdfs import ARM, build, joint, link, sea, urdf

from sea_ident.exceptions import RobotError, SeaIdentError, SeaIdentWarning
from sea_ident.robot import load_robot, robot_from_text, robots_folder
from sea_ident.robot.xml import parse_xml

BOMB = (
    '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">'
    '<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]><robot name="&c;"><link name="base"/></robot>'
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "malformed XML"),
        ("   ", "malformed XML"),
        ("hello", "malformed XML"),
        ("<robot name='r'><link name='a'></robot>", "malformed XML"),
        ("<robot/><robot/>", "malformed XML"),
        ("\x00\x01\x02", "malformed XML"),
        ("<html/>", "root element is <html>, not <robot>"),
        ('<xacro:robot xmlns:xacro="http://ros.org/wiki/xacro"/>', "expand it with xacro first"),
        (BOMB, "DOCTYPE"),
        ('<!DOCTYPE r SYSTEM "file:///etc/passwd"><robot name="r"/>', "DOCTYPE"),
        ("<robot/>", "has no <link>"),
        (urdf(sea("knee")), "it is an annotation; give it with its robot"),
    ],
)
def test_text_that_is_no_urdf(text: str, message: str) -> None:
    with pytest.raises(RobotError, match=message) as caught:
        robot_from_text(text, "some.urdf")
    assert str(caught.value).startswith("some.urdf: ")


LOOP = (*ARM, link("rod"), joint("crank", "upper", "rod"), joint("close", "rod", "lower"))
FREE = (*ARM, link("car"), joint("road", "car", "base", "floating", limit=None))


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (LOOP, r"link 'lower' is the child of two joints, 'elbow' and 'close': a closed loop\. Cut the loop"),
        ((*ARM, joint("back", "lower", "base")), "no link is a root: the joints form a closed loop"),
        (
            (*ARM, link("c"), link("d"), joint("cd", "c", "d"), joint("dc", "d", "c")),
            "the links c, d form a closed loop",
        ),
        (FREE, r"'road' is floating.*--joints a,b,c.*joints that can move: shoulder, elbow"),
        (
            (*ARM, link("car"), joint("road", "car", "base", "planar", limit=None)),
            "'road' is planar, which cannot be identified",
        ),
        ((*ARM, link("ball"), joint("socket", "lower", "ball", "ball")), "'socket' is ball"),
        ((*ARM, link("x"), joint("odd", "lower", "x", "hinge")), "unknown type 'hinge'; use revolute"),
        ((*ARM, link("alone")), "several root links: base, alone"),
        ((*ARM, joint("more", "lower", "nowhere")), "names the link 'nowhere', which does not exist"),
        ((*ARM, link("upper")), "two links are named 'upper'"),
        ((*ARM, link("x"), joint("elbow", "lower", "x")), "two joints are named 'elbow'"),
        ((*ARM, link("x"), joint("wrist", "lower", "x", axis="0 2 0")), r"axis \[0.0, 2.0, 0.0\] has length 2, not 1"),
        ((*ARM, link("x"), joint("wrist", "lower", "x", axis="0 0 0")), "has length 0, not 1; give a unit axis"),
        ((*ARM, link("x"), joint("wrist", "lower", "x", axis="0 1")), "is not three finite numbers"),
        ((*ARM, link("x"), joint("wrist", "lower", "x", axis="0 nan 1")), "is not three finite numbers"),
        ((*ARM, link("x"), joint("wrist", "lower", "x", axis="a b c")), "is not three numbers"),
        ((*ARM, link("x"), joint("w", "lower", "x", limit='lower="2" upper="1"')), "lower limit 2.0 is above upper"),
        (
            (*ARM, link("x"), joint("w", "lower", "x", limit='lower="1" upper="1"')),
            "both 1.0; widen them, or make it f",
        ),
        ((*ARM, link("x"), joint("w", "lower", "x", limit='lower="nan"')), "is not finite"),
        (
            (*ARM, link("x"), joint("w", "lower", "x", more='<dynamics damping="-1"/>')),
            "damping is -1.0; it cannot be n",
        ),
        ((*ARM, link("x"), joint("w", "lower", "x", more='<mimic joint="no"/>')), "mimics 'no', which does not exist"),
        ((*ARM, link("x"), joint("w", "lower", "x", more='<mimic joint="w"/>')), "mimic each other in a circle"),
        ((link("base"), link("x"), joint("w", "base", "x", "fixed")), "all its joints are fixed"),
        ((link("base"),), "all its joints are fixed"),
    ],
)
def test_kinematics_that_cannot_be_used(parts: tuple[str, ...], message: str) -> None:
    with pytest.raises(RobotError, match=message) as caught:
        build(*parts)
    assert str(caught.value).startswith("test.urdf: ")


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (link("lower", -1.0), "mass is -1.0 kg; a mass cannot be negative"),
        (link("lower", "heavy"), "value='heavy' of <mass> is not a number"),
        (link("lower", "nan"), "is not finite"),
        (link("lower", 0.0), "'lower': its mass is 0 kg, and joint 'elbow' moves it; give its mass"),
        (link("lower", None), "joint 'elbow' moves no mass: link 'lower' and what it carries have zero mass"),
        (link("lower", 1.0, 'ixx="-0.1" iyy="0.1" izz="0.1"'), "ixx is -0.1 kg m2; a moment of inertia cannot be neg"),
        (link("lower", 1.0, 'ixx="0.1" iyy="0.1"'), "<inertia> has no attribute 'izz'"),
        ('<link name="lower"><inertial><mass value="1"/></inertial></link>', "<inertial> has no <inertia>; add it"),
        ('<link name="lower"><inertial/></link>', "<inertial> has no <mass>; add it"),
        (link("lower").replace('ixy="0"', 'ixy="0.5"'), "negative principal moment -0.4 kg m2; correct its <inertia>"),
    ],
)
def test_body_that_cannot_be(body: str, message: str) -> None:
    parts = (link("base"), link("upper"), body, joint("shoulder", "base", "upper"), joint("elbow", "upper", "lower"))
    with pytest.raises(RobotError, match=message) as caught:
        build(*parts)
    assert "lower" in str(caught.value)


def test_shank_without_mass_is_told() -> None:
    text = (robots_folder() / "exo_leg" / "exo_leg.urdf").read_text()
    assert text.count('<mass value="3.6"/>') == 1
    with pytest.raises(RobotError, match="link 'shank': its mass is 0 kg, and joint 'knee' moves it; give its mass"):
        robot_from_text(text.replace('<mass value="3.6"/>', '<mass value="0"/>'), "exo_leg.urdf")


@pytest.mark.parametrize(
    ("transmissions", "message"),
    [
        (
            sea("knee"),
            "transmission 'knee_sea': names the joint 'knee', which is not in .*; its joints: shoulder, elbow",
        ),
        (sea("elbow") + sea("elbow"), "joint 'elbow' already has the transmission of 'elbow_motor'"),
        (sea("mount"), "'mount', which is fixed; a motor needs a joint that moves"),
        (sea("elbow", ratio="0"), "the gear ratio <mechanicalReduction> is 0"),
        (sea("elbow", ratio="many"), "holds 'many', not a number"),
        (sea("elbow", ratio="inf"), "must be finite"),
        (sea("elbow").replace("<mechanicalReduction>50</mechanicalReduction>", ""), "no <mechanicalReduction>"),
        (sea("elbow", '<rotorAxis link="nowhere" xyz="0 1 0"/>'), "names the link 'nowhere', which does not exist"),
        (
            sea("elbow", '<rotorAxis link="lower" xyz="0 1 0"/>'),
            "on link 'lower', which does not carry the joint 'elbow'; use one of upper, base",
        ),
        (sea("elbow", '<rotorAxis link="upper" xyz="0 2 0"/>'), "has length 2, not 1; give a unit axis"),
        (sea("elbow", '<rotorAxis link="upper"/>'), "<rotorAxis> has no xyz"),
        (sea("elbow", "<efficiency>1.2</efficiency>"), r"<efficiency> is 1.2; it must be in \(0, 1\]"),
        (sea("elbow", "<efficiency>0</efficiency>"), r"must be in \(0, 1\]"),
        (sea("elbow", "<torqueConstant>0</torqueConstant>"), "<torqueConstant> is 0 N m/A"),
        (sea("elbow", "<rotorInertia>-1</rotorInertia>"), "<rotorInertia> is -1; it must be finite and not negative"),
        (sea("elbow", spring='stiffness="0"'), "stiffness of the spring is 0.0; it must be positive"),
        (sea("elbow", spring='stiffness="stiff"'), "stiffness='stiff' of <seriesElastic> is not a number"),
        (sea("elbow", limit='<limit acceleration="0"/>'), "the acceleration limit is 0.0; it must be positive"),
        (sea("elbow").replace("SeriesElastic", "Magic", 1), "unknown type 'sea_ident/Magic'; use sea_ident/SeriesE"),
        ('<transmission name="t" type="sea_ident/SeriesElastic"/>', "has 0 <joint>; exactly one is read"),
        (
            '<transmission name="t" type="sea_ident/LinearLimit"><joint name="elbow"/><joint name="elbow"/>'
            '<limit lower="0"/></transmission>',
            "names the joint 'elbow' twice",
        ),
        (
            '<transmission name="t" type="sea_ident/LinearLimit"><joint name="elbow"/></transmission>',
            "needs <joint> elements and a <limit",
        ),
    ],
)
def test_annotation_that_cannot_be_used(transmissions: str, message: str) -> None:
    parts = (*ARM, link("tool"), joint("mount", "lower", "tool", "fixed"))
    with pytest.raises(RobotError, match=message):
        build(*parts, transmissions)
    with pytest.raises(RobotError, match=message) as caught:  # the same in a fragment
        build(*parts, annotation=urdf(transmissions))
    assert str(caught.value).startswith("annotation: transmission ")


@pytest.mark.parametrize(
    ("annotation", "message"),
    [
        ("<robot/>", "has no <transmission>; is it an annotation"),
        ("<urdf/>", "root element is <urdf>, not <robot>"),
        ("<robot>", "annotation: malformed XML"),
    ],
)
def test_fragment_that_is_none(annotation: str, message: str) -> None:
    with pytest.raises(RobotError, match=message):
        build(*ARM, annotation=annotation)


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        (("shoulder", "knee"), "has no joint 'knee'; joints that can move: shoulder, elbow"),
        (("elbow", "elbow"), "joint 'elbow' is named twice"),
        (("mount",), "joint 'mount' is fixed; it cannot be chosen to move"),
        (("finger",), "joint 'finger' mimics 'elbow'; choose that one"),
        ((), "no joint was chosen to move"),
        ("elbow", "joints must be a list of names, not 'elbow'"),
    ],
)
def test_joints_that_cannot_be_chosen(joints: tuple[str, ...], message: str) -> None:
    extra = (
        link("tool"),
        joint("mount", "lower", "tool", "fixed"),
        link("tip"),
        joint("finger", "lower", "tip", more='<mimic joint="elbow"/>'),
    )
    with pytest.raises(RobotError, match=message):
        build(*ARM, *extra, joints=joints)


def test_floating_base_is_held_fixed_where_joints_are_named() -> None:
    assert build(*FREE, joints=("shoulder", "elbow")).joint_names == ("shoulder", "elbow")


def test_chain_that_would_overflow_the_parsers_stack_is_refused() -> None:
    links = [link(f"l{k}") for k in range(2501)]
    joints = [joint(f"j{k}", f"l{k}", f"l{k + 1}", "fixed", limit=None) for k in range(2500)]
    with pytest.raises(RobotError, match="2500 joints follow each other in a chain; at most 1000"):
        build(*links, *joints)
    with pytest.raises(RobotError, match="has 10001 links; at most 10000"):
        build(*(f'<link name="l{k}"/>' for k in range(10001)))


@pytest.mark.parametrize(
    "name", ["nowhere.urdf", "no_such_robot", "", "a\x00b", "x" * 5000, "example:", "example:../../x"]
)
def test_source_that_does_not_exist(name: str) -> None:
    with pytest.raises(RobotError):
        load_robot(name)


def test_folder_and_unreadable_files(tmp_path: Path) -> None:
    (tmp_path / "leg.urdf").write_bytes(bytes(range(256)))
    with pytest.raises(RobotError, match=r"is a folder, not a URDF; it holds .*leg\.urdf"):
        load_robot(tmp_path)
    with pytest.raises(RobotError, match="is not text in utf-8-sig; is it a URDF"):
        load_robot(tmp_path / "leg.urdf")
    huge = tmp_path / "huge.urdf"
    with huge.open("wb") as file:  # sparse: takes no space
        file.truncate(2**40)
    with pytest.raises(RobotError, match="1099511627776 bytes is too large for a URDF"):
        load_robot(huge)


def test_shipped_names_are_listed() -> None:
    with pytest.raises(RobotError, match=r"shipped robots: .*exo_leg.*shipped annotations: .*baxter_sea"):
        load_robot("exo_arm")
    with pytest.raises(RobotError, match="it is an annotation; give it with its robot"):
        load_robot("baxter_sea")


def test_warnings_are_heard_and_kept() -> None:
    with pytest.warns(SeaIdentWarning, match="rigid robot without motor inertia"):
        robot = robot_from_text(urdf(*ARM), "arm.urdf")
    assert any("rigid robot" in text for text in robot.warnings)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_robot("exo_leg").warnings == ()


@pytest.mark.parametrize(
    ("axis", "end"), [("1 1 0.3", "a unit axis: 0.691714464 0.691714464 0.207514339"), ("0 0 0", "a unit axis")]
)
def test_an_axis_that_is_no_unit_axis_is_told_with_the_one_that_is(axis: str, end: str) -> None:
    text = (robots_folder() / "exo_leg" / "exo_leg.urdf").read_text()
    with pytest.raises(RobotError) as caught:
        robot_from_text(text.replace('<axis xyz="0 -1 0"/>', f'<axis xyz="{axis}"/>', 1), "exo_leg.urdf")
    assert str(caught.value).endswith(end)


def test_every_error_is_of_one_family() -> None:
    assert issubclass(RobotError, SeaIdentError)


def test_entities_of_other_files_are_not_opened(tmp_path):
    other = tmp_path / "other.xml"
    other.write_text("<unclosed")  # were it read, the text would be malformed
    text = f'<!DOCTYPE r [<!ENTITY other SYSTEM "{other.as_uri()}">]><robot name="r">&other;</robot>'
    with pytest.raises(RobotError, match="DOCTYPE"):
        parse_xml(text, "test")
