"""What is misspelt in an annotation is told, and not taken for absent."""

import pytest

from sea_ident.exceptions import RobotError
from sea_ident.robot import Robot, robot_from_text

NUMBERS = (
    "<mechanicalReduction>30</mechanicalReduction><torqueConstant>0.05</torqueConstant>"
    "<rotorInertia>6e-05</rotorInertia><viscousFriction>0.2</viscousFriction><coulombFriction>0.1</coulombFriction>"
)
SPRING = '<seriesElastic stiffness="120" damping="0.2"/>'
SEA = "sea_ident/SeriesElastic"
RIGID = "transmission_interface/SimpleTransmission"


def robot(
    numbers: str = NUMBERS,
    spring: str = SPRING,
    limit: str = '<limit acceleration="20"/>',
    kind: str = SEA,
    second: str = NUMBERS,
) -> Robot:
    body = (
        '<inertial><origin xyz="0.01 0 -0.2"/><mass value="2"/>'
        '<inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    return robot_from_text(
        f"""<robot name="two"><link name="base"/><link name="upper">{body}</link><link name="lower">{body}</link>
        <joint name="a" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>
        <joint name="b" type="continuous"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/></joint>
        <transmission name="t" type="{kind}"><hardwareInterface>EffortJointInterface</hardwareInterface>
          <joint name="a">{limit}<hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>
          <actuator name="m">{numbers}</actuator>{spring}<!-- a remark --></transmission>
        <transmission name="u" type="{SEA}"><joint name="b"/><actuator name="n">{second}</actuator>{SPRING}
        </transmission></robot>""",
        "two.urdf",
    )


def test_what_other_tools_read_beside_is_left_alone() -> None:
    assert robot().spring("a").stiffness == 120.0


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"spring": SPRING.replace("stiffness", "stifness")}, "<seriesElastic> has the attribute 'stifness'"),
        ({"spring": SPRING.replace("Elastic", "Elastik")}, "<seriesElastik> is not read; did you mean <seriesElastic>"),
        ({"spring": SPRING + SPRING}, "<transmission> has <seriesElastic> more than once"),
        (
            {"spring": "<seriesElastic><stiffness>120</stiffness></seriesElastic>"},
            "<stiffness> is inside <seriesElastic>, whose numbers are attributes",
        ),
        ({"numbers": NUMBERS.replace("rotorInertia", "rotorinertia")}, "did you mean <rotorInertia>"),
        ({"numbers": NUMBERS.replace("viscousFriction", "viscous_friction")}, "did you mean <viscousFriction>"),
        ({"numbers": NUMBERS + "<rotorInertia>1e-5</rotorInertia>"}, "<actuator> has <rotorInertia> more than once"),
        ({"spring": SPRING + "<efficiency>0.8</efficiency>"}, "<efficiency> is inside <transmission>.*<actuator>"),
        ({"limit": '<limit aceleration="20"/>'}, "<limit> has the attribute 'aceleration'.*it has acceleration, jerk"),
        ({"kind": RIGID}, "has a <seriesElastic>, and its type is .*; for a spring use sea_ident/SeriesElastic"),
        (
            {
                "numbers": NUMBERS.replace("<rotorInertia", '<rotorInertia group="g"'),
                "second": NUMBERS.replace("<rotorInertia>6", '<rotorInertia group="g">8'),
            },
            "the motors of 'a' and 'b' are of one group 'g', and state 6e-05 and 8e-05 kg m2",
        ),
    ],
)
def test_what_is_written_and_would_not_be_read_is_told(parts: dict[str, str], message: str) -> None:
    with pytest.raises(RobotError, match=message) as caught:
        robot(**parts)
    assert str(caught.value).startswith("two.urdf: ")
