"""Zeros that are other postures, and chains that changed places, on an arm and on a robot with two of them."""

import re
import warnings

import numpy as np
import pytest

from estimation.synthetic import record, truth_of
from sea_ident.effects import base_effects, make_effect
from sea_ident.effects.joint_offset import JointOffset
from sea_ident.estimation import identify
from sea_ident.estimation.misplaced import misplaced_columns
from sea_ident.estimation.turned_zeros import turned_zeros
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.processing import process
from sea_ident.robot import Robot
from sea_ident.robot.load import robot_from_text

NOISE = {"torque_noise": 0.05, "encoder_noise": 1e-5}
RIGHT = 0.5 * np.pi


def chain(side: str, roll: float, springs: bool) -> str:
    """Three joints, the first two with springs where that is said, and their links."""
    text, parent = "", "base"
    places = (f'xyz="0 {roll} 0.4" rpy="{roll} 0 0"', 'xyz="0.05 0.08 0"', 'xyz="0 0 -0.32"')
    for k, (place, axis) in enumerate(zip(places, ("0 1 0", "1 0 0", "0 1 0"), strict=True)):
        name = f"{side}{k + 1}"
        kind = "sea_ident/SeriesElastic" if springs and k < 2 else "transmission_interface/SimpleTransmission"
        spring = '<seriesElastic stiffness="300"/>' if springs and k < 2 else ""
        text += (
            f'<link name="{name}_link"><inertial><origin xyz="0.02 {0.03 * (k == 0)} -0.14"/>'
            f'<mass value="{2.5 - 0.6 * k}"/>'
            '<inertia ixx="0.03" iyy="0.028" izz="0.006" ixy="0.001" ixz="0.0005" iyz="0"/></inertial></link>'
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{name}_link"/>'
            f'<origin {place}/><axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="6" effort="80"/></joint>'
            f'<transmission name="{name}_drive" type="{kind}"><joint name="{name}"/><actuator name="{name}_motor">'
            f"<mechanicalReduction>80</mechanicalReduction><rotorInertia>3e-5</rotorInertia></actuator>{spring}"
            "</transmission>"
        )
        parent = f"{name}_link"
    return text


def robot(*sides: tuple[str, float], springs: bool = False) -> Robot:
    """A base with some chains."""
    text = '<robot name="some"><link name="base"/>' + "".join(chain(*side, springs) for side in sides) + "</robot>"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return robot_from_text(text, "some.urdf")


@pytest.fixture(scope="module")
def both() -> tuple:
    """A robot with two rigid chains, and a recording of it."""
    two = robot(("l", 0.3), ("r", -0.3))
    a, b = np.random.default_rng(3).normal(0.0, 0.25, (2, two.n, 4))
    truth = truth_of(two, FourierSeries(0.2, np.linspace(-0.2, 0.3, two.n), a, b), samples=500)
    return two, record(two, truth, 4, **NOISE)


def processed_of(which, recording):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return process(recording, which, period=5.0)


@pytest.mark.scenario
@pytest.mark.parametrize(
    "turned",
    [
        {"l1": RIGHT},
        {"r2": 2.0 * RIGHT},
        {"l2": -1.2},
        {"l1": RIGHT, "l2": -RIGHT},
        {"l1": -RIGHT, "l2": RIGHT, "r1": 2.0 * RIGHT, "r2": -RIGHT},
        {"l2": RIGHT, "r1": RIGHT, "r2": 2.0 * RIGHT},
        {"l1": RIGHT, "l2": RIGHT, "r1": RIGHT, "r2": 2.0 * RIGHT},
    ],
)
def test_turned_zeros_are_found_in_whatever_number(both, turned):
    """The nearest right angle of each; the last joints of the chains turn bodies that are free."""
    two, recording = both
    wrong = recording.replace_columns({f"q_{j}": recording.columns[f"q_{j}"] + by for j, by in turned.items()})
    found = turned_zeros(two, base_effects(two), processed_of(two, wrong))
    assert {zero.joint: round(zero.offset / RIGHT) for zero in found} == {
        joint: round(by / RIGHT) for joint, by in turned.items()
    }
    assert {zero.name for zero in found} == {"encoder_offset"}
    assert turned_zeros(two, (*base_effects(two), *found), processed_of(two, wrong)) == ()
    # what the model has is its business, whatever its size
    known = tuple(make_effect("encoder_offset", joint) for joint in turned)
    again = turned_zeros(two, (*base_effects(two), *known), processed_of(two, wrong))
    assert not turned.keys() & {zero.joint for zero in again}


def test_nothing_is_turned_where_the_model_fits_or_lacks_something_else(both):
    two, recording = both
    assert turned_zeros(two, base_effects(two), processed_of(two, recording)) == ()
    bent = recording.replace_columns(
        {"tau_motor_l1": recording.columns["tau_motor_l1"] + 5.0 * np.sin(7.0 * recording.columns["q_l1"])}
    )
    assert turned_zeros(two, base_effects(two), processed_of(two, bent)) == ()


def test_chains_that_changed_places_are_told(both):
    """They are as alike as legs are: with all six columns exchanged the model leaves little, and finds no zero."""
    two, recording = both
    kinds = ("q", "tau_motor")
    pairs = [(kind, k, a, b) for kind in kinds for k in "123" for a, b in ("lr", "rl")]
    wrong = recording.replace_columns(
        {f"{kind}_{a}{k}": recording.columns[f"{kind}_{b}{k}"] for kind, k, a, b in pairs}
    )
    said = misplaced_columns(two, base_effects(two), processed_of(two, wrong))
    assert "all columns of the chains l1, l2, l3 and r1, r2, r3 look exchanged" in said
    for kind, k, a, b in pairs:
        assert f"'{kind}_{a}{k}={kind}_{b}{k}'" in said
    assert misplaced_columns(two, base_effects(two), processed_of(two, recording)) is None


def test_a_robot_that_hangs_is_told_by_the_weight_of_its_bodies(both):
    """Bodies that are free, and negative then, leave little of the torque; those described pull the other way."""
    two, recording = both
    hanging = two.with_gravity((0.0, 0.0, 9.81))
    a, b = np.random.default_rng(3).normal(0.0, 0.4, (2, two.n, 4))
    truth = truth_of(hanging, FourierSeries(0.2, np.linspace(-0.2, 0.3, two.n), a, b), samples=500)
    hung = record(hanging, truth, 4, **NOISE)
    said = misplaced_columns(two, base_effects(two), processed_of(two, hung))
    assert "gravity looks like (0, 0, 9.81) m/s2 in the root link, not (0, 0, -9.81)" in said
    assert misplaced_columns(hanging, base_effects(hanging), processed_of(hanging, hung)) is None
    # and where the model lacks something else beside, which leaves more than a tenth of that
    wave = 0.8 * np.sin(9.0 * hung.columns["q_l1"])
    bent = hung.replace_columns({"tau_motor_l1": hung.columns["tau_motor_l1"] + wave})
    assert "gravity looks like (0, 0, 9.81)" in misplaced_columns(two, base_effects(two), processed_of(two, bent))
    # nor where the zero of a joint is what turned the others
    turned = recording.replace_columns({"q_l1": recording.columns["q_l1"] + 2.0 * RIGHT})
    said = misplaced_columns(two, base_effects(two), processed_of(two, turned))
    assert said is None


def test_the_zero_of_a_first_joint_is_a_tilt_only_where_nothing_else_feels_gravity():
    assert [zero.joint for zero in JointOffset.instances(robot(("l", 0.3), springs=True))] == ["l2"]
    two = robot(("l", 0.3), ("r", -0.3), springs=True)
    assert [zero.joint for zero in JointOffset.instances(two)] == ["l1", "l2", "r1", "r2"]


def test_the_range_of_a_zero_is_that_of_its_kind_until_it_is_more():
    """A search takes steps by the range; half a turn is no end of it."""
    for name, most in (("encoder_offset", 0.5), ("joint_offset", 1.5)):
        ranges = {size: make_effect(name, "l2", offset=size).ranges[0] for size in (most, most + 0.1, np.pi)}
        assert (ranges[most].lower, ranges[most].upper) == (-most, most)
        assert all(ranges[size].upper == -ranges[size].lower > 1.1 * np.pi for size in (most + 0.1, np.pi))
        assert {round(e.offset, 2) for e in make_effect(name, "l2").beginnings()} >= {1.57, -1.57, 3.14}


def test_zeros_that_no_motor_could_hold_apart_are_told_whatever_the_model_leaves():
    """A link encoder far off moves all that lies behind it: nothing fits, and the law of its spring is anything."""
    two = robot(("l", 0.3), ("r", -0.3), springs=True)
    a, b = np.random.default_rng(3).normal(0.0, 0.25, (2, two.n, 4))
    truth = truth_of(two, FourierSeries(0.2, np.linspace(-0.2, 0.3, two.n), a, b), samples=500)
    recording = record(two, truth, 4, **NOISE)
    moved = recording.replace_columns({"q_l2": recording.columns["q_l2"] + 1.2})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        right, wrong = (identify(two, each, period=5.0) for each in (recording, moved))
    assert not any("their zeros differ" in text for text in right.warnings)
    (said,) = [text for text in wrong.warnings if "their zeros differ" in text]
    apart = float(re.search(r"theta_l2 and q_l2 are (\S+) rad apart", said)[1])
    assert apart == pytest.approx(-1.2, abs=0.1)
    told_of = re.search(r"of (\S+) N m/rad.*takes (\S+) N m, .* gives (\S+) at", said)
    stiffness, takes, most = map(float, told_of.groups())
    assert stiffness == two.spring("l2").stiffness
    assert takes == pytest.approx(stiffness * abs(apart), rel=1e-2)
    assert most == pytest.approx(abs(recording.columns["tau_motor_l2"]).max(), rel=0.1)
    assert "--unknown-zero l2" in said
