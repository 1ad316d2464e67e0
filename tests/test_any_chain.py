"""Whatever tree of joints and drives: the identities hold, and exact data give the parameters back."""

import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sea_ident.base_parameters import find_base_parameters, random_motion
from sea_ident.effects import base_effects
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.regressor import build_regressor, inverse_dynamics, prior_parameters
from sea_ident.robot import Robot, robot_from_text

AXES = ("1 0 0", "0 1 0", "0 0 1", "0.6 0 0.8", "-0.48 0.6 0.64")
NEARLY_RIGHT = "1.5707963"
POSES = ("0 0 0", "0.1 0.2 -0.3", f"{NEARLY_RIGHT} 0 0", "0 -2.1 0.4")
LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="50"/>'


@st.composite
def bodies(draw: st.DrawFn) -> str:
    """Inertial parameters of a few point masses and a ball: always possible physically."""
    mass = draw(st.floats(0.05, 20.0))
    center = [draw(st.floats(-0.5, 0.5)) for _ in range(3)]
    spread = [draw(st.floats(0.01, 0.4)) for _ in range(3)]  # standard deviations of the mass along three axes [m]
    xx, yy, zz = (mass * value**2 for value in spread)
    return (
        f'<inertial><origin xyz="{center[0]} {center[1]} {center[2]}" rpy="{draw(st.sampled_from(POSES))}"/>'
        f'<mass value="{mass}"/><inertia ixx="{yy + zz}" iyy="{xx + zz}" izz="{xx + yy}" ixy="0" ixz="0" iyz="0"/>'
        "</inertial>"
    )


@st.composite
def drives(draw: st.DrawFn, joint: str, links: list[str]) -> str:
    """No transmission, a rigid one, or one with a spring."""
    kind = draw(st.sampled_from(("none", "rigid", "elastic", "elastic")))
    if kind == "none":
        return ""
    ratio = draw(st.floats(5.0, 200.0)) * draw(st.sampled_from((1, 1, -1)))
    parts = [f"<mechanicalReduction>{ratio}</mechanicalReduction>"]
    optional = {
        "torqueConstant": "0.05",
        "rotorInertia": "2e-5",
        "efficiency": "0.8",
        "viscousFriction": "0.7",
        "coulombFriction": "0.9",
    }
    parts += [f"<{tag}>{value}</{tag}>" for tag, value in optional.items() if draw(st.booleans())]
    if draw(st.booleans()):
        parts.append(f'<rotorAxis link="{draw(st.sampled_from(links))}" xyz="{draw(st.sampled_from(AXES))}"/>')
    spring = ""
    if kind == "elastic":
        extra = draw(st.sampled_from(("", ' damping="0.5"', ' cubicStiffness="900"')))
        spring = f'<seriesElastic stiffness="{draw(st.floats(10.0, 5000.0))}"{extra}/>'
    name = "sea_ident/SeriesElastic" if spring else "transmission_interface/SimpleTransmission"
    return (
        f'<transmission name="{joint}_drive" type="{name}"><joint name="{joint}"/>'
        f'<actuator name="{joint}_motor">{"".join(parts)}</actuator>{spring}</transmission>'
    )


@st.composite
def robots(draw: st.DrawFn) -> str:
    """URDF of a random tree of up to five joints."""
    count = draw(st.integers(1, 5))
    parts = ['<link name="base"/>']
    links = ["base"]
    for k in range(count):
        parent = draw(st.sampled_from(links[-2:] if draw(st.booleans()) else links))
        kind = draw(st.sampled_from(("revolute", "revolute", "continuous", "prismatic", "fixed")))
        shift = " ".join(f"{draw(st.floats(-0.5, 0.5)):.3f}" for _ in range(3))
        parts.append(f'<link name="l{k}">{draw(bodies())}</link>')
        parts.append(
            f'<joint name="j{k}" type="{kind}"><origin xyz="{shift}" rpy="{draw(st.sampled_from(POSES))}"/>'
            f'<parent link="{parent}"/><child link="l{k}"/><axis xyz="{draw(st.sampled_from(AXES))}"/>'
            f"{LIMIT if kind in ('revolute', 'prismatic') else ''}</joint>"
        )
        # the carrier of a rotor lies between root and joint: parents so far are candidates, others are refused
        if kind != "fixed":
            parts.append(draw(drives(f"j{k}", [parent, draw(st.sampled_from(links))])))
        links.append(f"l{k}")
    return f'<robot name="any">{"".join(parts)}</robot>'


def read(text: str) -> Robot | None:
    """The robot, None where it was refused with a reason."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        try:
            return robot_from_text(text, "any.urdf")
        except SeaIdentError as error:
            reason = str(error)
    assert reason.startswith("any.urdf")
    assert len(reason) > 30
    return None


def relative(error: np.ndarray, scale: np.ndarray) -> float:
    return float(np.abs(error).max() / max(np.abs(scale).max(), 1e-12))


QUICK = settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
LONG = settings(max_examples=1000, deadline=None, suppress_health_check=list(HealthCheck))


def identities(text: str) -> None:
    robot = read(text)
    if robot is None:
        return
    motion = random_motion(robot, 4, seed=3)
    effects = base_effects(robot)
    bodies_only = tuple(effect for effect in effects if effect.name in ("rigid_bodies", "rotor_inertia"))
    regressor = build_regressor(robot, bodies_only, motion)
    psi = np.nan_to_num(prior_parameters(robot, bodies_only))
    known = np.array([np.isfinite(rotor.rotor_inertia or np.nan) for rotor in robot.rotors], dtype=bool)
    link, motor = inverse_dynamics(robot, motion) if known.all() else (regressor.link @ psi, regressor.motor @ psi)
    # two ways to the same torque
    assert relative(regressor.link @ psi - link, link) < 1e-9
    assert relative(regressor.motor @ psi - motor, motor) < 1e-9
    # the energy of motion is positive and symmetric
    inertia = robot.inertia(motion.q[0])
    assert relative(inertia - inertia.T, inertia) < 1e-12
    assert np.linalg.eigvalsh(inertia).min() > 0.0
    # base parameters say as much as all parameters, on motions that they were not found from
    with warnings.catch_warnings():
        if NEARLY_RIGHT in text:  # how many parameters there are may hang on the digits of that angle, and is said to
            warnings.filterwarnings("ignore", message="the rank .* hangs on the tolerance", category=SeaIdentWarning)
        base = find_base_parameters(robot, effects)
    rows = build_regressor(robot, effects, random_motion(robot, 6, seed=11)).sum
    values = np.random.default_rng(0).normal(size=len(base.columns))
    whole = rows @ values
    assert relative(rows[:, :, base.independent] @ base.project(values) - whole, whole) < 1e-7


@QUICK
@given(robots())
def test_identities_on_any_tree(text: str) -> None:
    identities(text)


@pytest.mark.slow
@LONG
@given(robots())
def test_identities_on_many_trees(text: str) -> None:
    identities(text)


def test_most_of_these_trees_are_robots() -> None:
    # a generator whose robots are all refused would prove nothing
    seen: list[bool] = []

    @settings(max_examples=40, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
    @given(robots())
    def count(text: str) -> None:
        seen.append(read(text) is not None)

    count()
    assert sum(seen) > 0.3 * len(seen)
