"""Gravity of a base that does not stand level, small angle or not."""

import json
import warnings

import numpy as np
import pinocchio as pin
import pytest
from chains import rigid_chain

from sea_ident import build_regressor, identify, load_robot
from sea_ident.discrepancy import diagnose
from sea_ident.effects import Anchor, State, base_effects, effect_from_dict, make_effect, spring_effects
from sea_ident.effects.unfelt_moments import level_axes
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries, Motion
from sea_ident.recordings import Recording
from sea_ident.regressor import inverse_dynamics, model_columns, prior_parameters
from sea_ident.simulation import PlantedEffect, simulate

PERIOD, TILT = 5.0, (0.02, 0.01)


@pytest.mark.parametrize("name", ["exo_leg", "exo_leg_abduction", "hebi_x5"])
@pytest.mark.parametrize("angles", [(0.002, -0.001), (0.12, 0.0), (-0.2, 0.35)])
def test_columns_times_angles_are_what_turned_gravity_does(name, angles):
    robot, generator = load_robot(name), np.random.default_rng(4)
    q, dq, ddq = generator.uniform(-1.0, 1.0, (3, 20, robot.n))
    motion = Motion(np.arange(20) / 100.0, q, dq, ddq, q, dq, ddq)
    plain = make_effect("base_tilt")
    effects = (*base_effects(robot), *spring_effects(robot), plain)
    names = [column.name for column in model_columns(robot, effects)]
    parameters = dict(zip(names, np.nan_to_num(prior_parameters(robot, effects)), strict=True))
    parameters.update(zip([c.name for c in plain.columns(robot)], angles, strict=True))
    ready = plain.anchored(Anchor(robot, effects, parameters))
    found = ready.evaluate(State(robot, motion)).link @ np.array(angles)
    turned = plain.modified(robot, np.array(angles))
    expected = inverse_dynamics(turned, motion)[0] - inverse_dynamics(robot, motion)[0]
    np.testing.assert_allclose(found, expected, atol=1e-9 * (1.0 + np.abs(expected).max()))
    assert effect_from_dict(ready.to_dict()) == ready


def test_a_tilt_that_no_base_has_is_not_followed():
    """Where gravity hardly shows, an estimate may be any; columns that vanish near a right angle would drive it off."""
    robot = load_robot("exo_leg")
    plain = make_effect("base_tilt")
    parameters = {column.name: value for column, value in zip(plain.columns(robot), (3.0, -40.0), strict=True)}
    assert plain.anchored(Anchor(robot, (plain,), parameters)).angles == (1.0, -1.0)


def test_an_axis_in_the_plane_of_a_robot_is_not_felt_however_the_plane_was_given():
    """By 1e-4 rad from upright the column would be all digits, and its angle of a rad or two anything."""
    leg = load_robot("exo_leg")
    axes = level_axes(np.asarray(leg.model.gravity.linear))
    motion = FourierSeries(0.2, np.zeros(leg.n), *np.random.default_rng(1).normal(0.0, 0.3, (2, leg.n, 3))).sample(50.0)
    tilt = make_effect("base_tilt")
    exact = tilt.evaluate(State(leg, motion)).link
    felt = int(np.argmax(np.linalg.norm(exact, axis=(0, 1))))
    # turned about the axis that is felt nothing changes in kind; about the other the plane is no upright one
    for turn, seen in ((1e-4, False), (1e-2, True)):
        leaning = leg.with_gravity(pin.exp3(turn * axes[1 - felt]) @ np.asarray(leg.model.gravity.linear))
        columns = tilt.evaluate(State(leaning, motion)).link
        sizes = np.linalg.norm(columns, axis=(0, 1))
        assert sizes[1 - felt] == 0.0 or seen
        assert sizes[felt] == pytest.approx(np.linalg.norm(exact[:, :, felt]), rel=1e-3)
    assert sizes[1 - felt] > 0.0


def upright(joints, off=0.0):
    """A chain that turns about upright axes, with the centre of mass of its first link further out by a share."""
    out = [0.18 * (1.0 + off * (k == 0)) for k in range(joints)]
    return rigid_chain(
        ["0 0 1"] * joints,
        [f"{x} {0.1 * x} 0.02" for x in out],
        [2.4 - k for k in range(joints)],
        'ixx="0.01" iyy="0.03" izz="0.04"',
        [f"{0.4 if k else 0} 0 0" for k in range(joints)],
        "<mechanicalReduction>80</mechanicalReduction><rotorInertia>4e-5</rotorInertia>"
        "<viscousFriction>0.8</viscousFriction><coulombFriction>0.8</coulombFriction>",
    )


def swinging(n, seed):
    """A motion of n joints."""
    a, b = np.random.default_rng(seed).normal(0.0, 0.3, (2, n, 4)) / np.arange(1, 5) ** 0.7
    return FourierSeries(1.0 / PERIOD, 0.3 * np.ones(n), a, b)


def recorded(robot, seed):
    """Periods of a motion of a robot on a base that is tilted, with a little noise, and the torques that it takes."""
    motion, periods, rng = swinging(robot.n, seed).sample(200.0), 12, np.random.default_rng(seed)
    turned = make_effect("base_tilt").modified(robot, np.array(TILT))
    effects = base_effects(robot)
    torque = build_regressor(turned, effects, motion).sum @ np.nan_to_num(prior_parameters(robot, effects))
    columns = {
        f"{kind}_{joint}": np.tile(signal[:, i], periods) + size * rng.standard_normal(periods * len(motion))
        for kind, signal, size in (("q", motion.q, 1e-6), ("tau_motor", torque, 0.02))
        for i, joint in enumerate(robot.joint_names)
    }
    return Recording(np.arange(periods * len(motion)) / 200.0, columns, "chain")


def diagnosed(joints, off):
    true, given = upright(joints), upright(joints, off)
    one, other = (recorded(true, seed) for seed in (1, 2))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(given, one, period=PERIOD), one, holdout=other, period=PERIOD)
    assert [effect.effect for effect in found.missing] == ["base_tilt"]
    return found, {p.name.removeprefix("robot.base_tilt_"): p for p in found.missing[0].parameters}


@pytest.mark.scenario
@pytest.mark.parametrize("off", [0.2, 0.0, -0.3])
def test_a_tilt_is_found_whatever_the_description_says_of_what_is_not_felt_level(off):
    """As sure as the first moments that are felt, of which the angle is the divisor."""
    found, parameters = diagnosed(2, off)
    for name, angle in zip(("first", "second"), TILT, strict=True):
        assert abs(parameters[name].value - angle) < 2.0 * parameters[name].std
        assert parameters[name].std < 0.2 * angle
    assert [parameters[f"moment_{name}"].unit for name in ("first", "second")] == ["kg m", "kg m"]
    assert not any("upright axes" in text for text in found.warnings)
    assert found.holdout.shrink > 0.95
    assert all(gap.shrink > 0.8 for gap in found.simulation_gap.values())


@pytest.mark.scenario
def test_where_only_the_product_of_a_tilt_and_a_first_moment_is_felt_that_is_said():
    found, parameters = diagnosed(1, 0.2)
    assert list(parameters) == ["first", "second"]
    # the lever is a fifth longer, and the angle as much smaller
    assert parameters["first"].value * 1.2 == pytest.approx(TILT[0], rel=0.05)
    assert any("upright axes" in text for text in found.warnings)


def test_a_simulation_has_the_first_moments_that_a_tilt_was_found_with():
    """However a model shares what is not felt level among its bodies."""
    robot = upright(2, off=0.2)
    motion = swinging(2, 1).sample(50.0)
    free = make_effect("base_tilt").on(State(robot, motion))
    assert [shape.name for shape in free.ranges] == ["moment_first", "moment_second"]
    found = type(free)(**{**vars(free), "inertial": robot.inertial_parameters, "moment_first": -0.1})
    assert effect_from_dict(json.loads(json.dumps(found.to_dict()))) == found
    other = robot.inertial_parameters.reshape(-1, 10).copy()
    moved = 0.3  # [kg], from the axis of the second link to the first one
    other[1, 0] -= moved
    other[0] += moved * pin.Inertia(1.0, np.array([0.4, 0.0, 0.0]), np.zeros((3, 3))).toDynamicParameters()
    other[0, 1] += 0.05
    model = robot.with_inertial_parameters(other.ravel(), robot.rotor_inertias())
    there = found.modified(model, np.array([0.02, 0.01]))
    right = robot.inertial_parameters.copy()
    right[1] -= 0.1
    expected = robot.with_inertial_parameters(right, robot.rotor_inertias())
    expected = expected.with_gravity(np.asarray(there.model.gravity.linear))
    np.testing.assert_allclose(inverse_dynamics(there, motion)[0], inverse_dynamics(expected, motion)[0], atol=1e-9)


def test_a_tilt_follows_the_bodies_that_are_felt():
    """Those that are not are parameters of its own, or the description's."""
    robot, angles = upright(2), np.array([0.02, -0.01])
    motion = swinging(2, 1).sample(50.0)
    state, plain = State(robot, motion), make_effect("base_tilt")
    rows = plain.followed(state, angles)
    own = {name: rows[:, :, k] for k, name in enumerate(robot.inertial_names)}
    for name in ("l1.mx", "l1.my"):
        more = robot.inertial_parameters.copy()
        more[robot.inertial_names.index(name)] += 1.0
        change = type(plain)(inertial=more).evaluate(state).link - plain.evaluate(state).link
        # the second joint is where nothing but this is felt
        np.testing.assert_allclose(own[name][:, 1], (change @ angles)[:, 1], atol=1e-3 * np.abs(change @ angles).max())
    for name in ("l0.mx", "l0.my", "l1.m"):
        assert not np.any(own[name])


def leg_leaning(angles, seed):
    """Periods of the planar leg on a base that is tilted."""
    leg = load_robot("exo_leg")
    a, b = np.random.default_rng(seed).normal(0.0, 0.25, (2, leg.n, 5)) / np.arange(1, 6) ** 0.7
    series = FourierSeries(1.0 / PERIOD, np.array([0.2, 0.5, 0.0]), a, b)
    planted = PlantedEffect(make_effect("base_tilt"), np.array(angles))
    return leg, simulate(leg, series, periods=10, seed=seed, effects=[planted]).recording


@pytest.mark.scenario
@pytest.mark.parametrize("angles", [(0.1, 0.1), (0.2, 0.0)])
def test_a_leg_that_leans_out_of_its_plane_is_told_by_less_gravity_in_it(angles):
    """By half the square of the angle: it was told as other effects, with confidence."""
    leg, recording = leg_leaning(angles, 5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(leg, recording, period=PERIOD), recording)
    (tilt,) = found.missing
    assert tilt.effect == "base_tilt"
    told = {p.name.removeprefix("robot.base_tilt_"): p for p in tilt.parameters}
    for name, angle in zip(("first", "second"), angles, strict=True):
        assert abs(told[name].value - angle) < 3.0 * told[name].std
    assert told["first"].std < 0.1 * told["first"].value
    assert found.training.shrink > 0.9


def test_only_the_square_of_a_small_angle_is_felt_out_of_the_plane():
    leg = load_robot("exo_leg")
    motion = FourierSeries(0.2, np.zeros(leg.n), *np.random.default_rng(1).normal(0.0, 0.3, (2, leg.n, 3))).sample(50.0)
    state, plain = State(leg, motion), make_effect("base_tilt")
    level, leaning = plain.variants(state)
    assert (level.squared, level.angles) == ((False, False), (0.0, 0.0))
    assert sorted(leaning.squared) == [False, True]
    axis = leaning.squared.index(True)
    angles = [0.0, 0.0]
    angles[axis] = 0.17
    effects = (*base_effects(leg), *spring_effects(leg), leaning)
    names = [column.name for column in model_columns(leg, effects)]
    parameters = dict(zip(names, np.nan_to_num(prior_parameters(leg, effects)), strict=True))
    # what is estimated at another angle brings it to the right one at once
    turned = plain.modified(leg, np.array(angles))
    wanted = inverse_dynamics(turned, motion)[0] - inverse_dynamics(leg, motion)[0]
    column = leaning.evaluate(state).link[:, :, axis]
    value = float(np.sum(column * wanted) / np.sum(column**2))
    parameters[plain.columns(leg)[axis].name] = value
    moved = leaning.anchored(Anchor(leg, effects, parameters))
    assert moved.angles[axis] == pytest.approx(0.17, rel=1e-3)
    np.testing.assert_allclose(
        moved.evaluate(state).link @ np.array(angles), wanted, atol=1e-9 + 1e-3 * np.abs(wanted).max()
    )
    assert leaning.plausible(np.array(angles), {})
    assert not leaning.plausible(-np.array(angles), {})
    assert "described too large" in moved.reservation
    np.testing.assert_array_equal(moved.std_factors(leg), np.where(moved.squared, 0.5, 1.0))
    # a robot that moves in space feels both
    arm = load_robot("hebi_x5")
    still = np.random.default_rng(2).uniform(-1.0, 1.0, (3, 20, arm.n))
    everywhere = State(arm, Motion(np.arange(20) / 100.0, *still, *still))
    assert all(not any(tilt.squared) for tilt in plain.variants(everywhere))
