import pytest
from urdfs import build, joint, link, sea

from sea_ident.exceptions import RobotError
from sea_ident.robot import load_robot


def test_summary_tells_every_number_that_was_read() -> None:
    text = load_robot("exo_leg").summary()
    robot = load_robot("exo_leg")
    for one in robot.joints:
        assert one.actuator is not None
        assert f"{one.actuator.torque_constant:g} N m/A" in text
        assert f"{robot.spring(one.name).stiffness:g} N m/rad" in text
    assert f"{robot.limits.velocity[0]:g} rad/s" in text


def test_one_is_no_plural() -> None:
    one = build(link("base") + link("a") + joint("one", "base", "a") + sea("one"))
    two = build(link("base") + link("a") + link("b") + joint("one", "base", "a") + joint("two", "a", "b"))
    assert ": 1 joint, 1 motor, 1 spring\n" in one.summary()
    assert ": 2 joints, 0 motors, 0 springs\n" in two.summary()


def test_what_is_not_stated_is_not_invented() -> None:
    bare = build(link("base") + link("a") + joint("one", "base", "a") + sea("one"))
    text = bare.summary()
    assert "N m/A" not in text
    assert "friction" not in text


def test_names_of_double_width_do_not_shift_the_table() -> None:
    bare = build(link("base") + link("a") + link("b") + joint("手腕", "base", "a") + joint("elbow", "a", "b"))
    first, second = (line for line in bare.summary().splitlines() if "revolute" in line)
    assert first.index("revolute") + 2 == second.index("revolute")  # two letters fill two columns more


def test_limits_in_degrees_are_noticed() -> None:
    degrees = build(link("base"), link("a"), joint("one", "base", "a", limit='lower="-120" upper="120" velocity="3"'))
    assert any("'one' is -120 to 120 rad, 38.2 turns" in text for text in degrees.warnings)
    unlimited = build(
        link("base"), link("a"), joint("one", "base", "a", limit='lower="-1e16" upper="1e16" velocity="3"')
    )
    radians = build(link("base"), link("a"), joint("one", "base", "a"))
    assert not any("turns" in text for text in (*unlimited.warnings, *radians.warnings))


def test_what_xacro_has_not_expanded_is_recognised() -> None:
    for part in (link("a", mass="${m}"), '<link name="a"/>' + joint("b", "base", "a", axis="${x} 0 1")):
        with pytest.raises(RobotError, match=r"\$\{.*expand the file with xacro first"):
            build(link("base"), part)
