"""What holds for every effect, whoever wrote it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sea_ident.base_parameters import random_motion
from sea_ident.effects import (
    Anchor,
    Effect,
    JointEffect,
    Side,
    SimulationState,
    State,
    base_effects,
    corrected_motion,
    effect_classes,
    effect_from_dict,
    make_effect,
    measured_signals,
    spring_effects,
)
from sea_ident.effects.signal import SignalEffect
from sea_ident.exceptions import EffectError
from sea_ident.regressor import model_columns, prior_parameters
from sea_ident.robot import load_robot

NAMES = [
    "stribeck_friction",
    "nonlinear_viscous_friction",
    "presliding_friction",
    "load_dependent_friction",
    "directional_efficiency",
    "position_dependent_friction",
    "torque_ripple",
    "torque_offset",
    "torque_saturation",
    "torque_constant",
    "spring_stiffening",
    "asymmetric_spring",
    "spring_hysteresis",
    "backlash",
    "spring_offset",
    "link_friction",
    "parallel_spring",
    "base_tilt",
    "link_flexibility",
    "rotor_coupling",
    "transmission_coupling",
    "encoder_offset",
    "motor_encoder_offset",
    "joint_offset",
    "joint_placement",
    "encoder_eccentricity",
    "position_delay",
    "torque_delay",
    "friction_drift",
    "torque_constant_drift",
    "stiffness_drift",
    "temperature_friction",
    "payload",
    "external_force",
]


@pytest.fixture(scope="module")
def leg():
    return load_robot("exo_leg")


def anchored(effect, robot):
    effects = (*base_effects(robot), *spring_effects(robot))
    names = [column.name for column in model_columns(robot, effects)]
    parameters = dict(zip(names, np.nan_to_num(prior_parameters(robot, effects)), strict=True))
    return effect.anchored(Anchor(robot, effects, parameters))


def everywhere(robot):
    for name, cls in effect_classes().items():
        for effect in cls.instances(robot)[:2]:
            yield name, effect


def smooth_motion(robot):
    """A periodic motion with temperature, as effects with memory and drifts need it."""
    time = np.arange(400) / 100.0
    phase = 2.0 * np.pi * time / 4.0
    motion = random_motion(robot, len(time), 1)
    amplitude = np.array([0.2, 0.15, 0.3])[: robot.n]
    q = np.sin(phase)[:, None] * amplitude + 0.3
    dq = np.cos(phase)[:, None] * amplitude * np.pi / 2.0
    ddq = -np.sin(phase)[:, None] * amplitude * (np.pi / 2.0) ** 2
    return type(motion)(
        time, q, dq, ddq, q + 0.05 * np.sin(phase)[:, None], dq + 0.05 * np.pi / 2 * np.cos(phase)[:, None], ddq
    )


def test_the_library_holds_every_effect():
    assert set(NAMES) <= set(effect_classes())


@pytest.mark.parametrize("name", sorted(effect_classes()))
def test_columns_match_what_is_computed(name, leg):
    cls = effect_classes()[name]
    assert cls.name == name
    assert cls.source
    motion = smooth_motion(leg)
    channels = {"temperature": np.full((len(motion), leg.n), 30.0), "tau_spring": 100.0 * motion.deflection}
    for effect in cls.instances(leg)[:2]:
        ready = anchored(effect, leg)
        columns = ready.columns(leg)
        rows = ready.evaluate(State(leg, motion, channels))
        assert columns or isinstance(effect, SignalEffect) or hasattr(effect, "amounts")
        assert len({c.name for c in columns}) == len(columns)
        assert all(c.effect == name and c.unit for c in columns)
        assert rows.link.shape == rows.motor.shape == (len(motion), leg.n, len(columns))
        assert np.all(np.isfinite(rows.link))
        assert np.all(np.isfinite(rows.motor))


@pytest.mark.parametrize("name", [name for name, e in effect_classes().items() if e.depends_on != Effect.depends_on])
def test_columns_depend_on_nothing_else_of_the_motion(name, leg):
    motion, rng = smooth_motion(leg), np.random.default_rng(5)
    for effect in effect_classes()[name].instances(leg):
        ready = anchored(effect, leg)
        rest = set(Effect.depends_on) - set(ready.depends_on)
        moved = replace(motion, **{part: rng.normal(size=motion.q.shape) for part in sorted(rest)})
        before, after = (ready.evaluate(State(leg, each)) for each in (motion, moved))
        assert np.any(before.motor if ready.side is Side.MOTOR else before.link)
        np.testing.assert_array_equal(before.link, after.link)
        np.testing.assert_array_equal(before.motor, after.motor)


@pytest.mark.parametrize("name", sorted(effect_classes()))
def test_an_effect_survives_json(name, leg):
    for effect in effect_classes()[name].instances(leg)[:2]:
        again = effect_from_dict(json.loads(json.dumps(effect.to_dict())))
        assert type(again) is type(effect)
        assert again.joint == effect.joint
        assert again.shape_values == effect.shape_values


@pytest.mark.parametrize("name", sorted(effect_classes()))
def test_shapes_lie_inside_their_ranges(name, leg):
    for effect in effect_classes()[name].instances(leg)[:1]:
        for shape in effect.shapes:
            assert shape.lower <= getattr(effect, shape.name) <= shape.upper
            grid = shape.grid()
            assert grid.min() >= shape.lower - 1e-12 * abs(shape.lower)
            assert grid.max() <= shape.upper + 1e-12 * abs(shape.upper)


def test_the_torque_in_a_simulation_is_that_of_the_columns(leg):
    """A friction with the wrong sign, or a spring that pushes the wrong body, would fail here."""
    motion = random_motion(leg, 30, 2)
    rng = np.random.default_rng(3)
    checked, nothing = 0, np.zeros(leg.n)
    for _, effect in everywhere(leg):
        if not isinstance(effect, JointEffect) or effect.name == "temperature_friction":  # warms by itself
            continue
        values = rng.uniform(0.5, 2.0, len(effect.columns(leg)))
        rows = effect.evaluate(State(leg, motion, {"temperature": np.zeros((len(motion), leg.n))}))
        action = effect.torque(leg, values)
        if hasattr(action, "accept"):
            continue
        for k in range(len(motion)):
            link, motor = np.zeros(leg.n), np.zeros(leg.n)
            action(
                SimulationState(
                    motion.time[k], motion.q[k], motion.dq[k], motion.theta[k], motion.dtheta[k], nothing, nothing
                ),
                link,
                motor,
            )
            np.testing.assert_allclose(link, rows.link[k] @ values, atol=1e-12)
            np.testing.assert_allclose(motor, rows.motor[k] @ values, atol=1e-12)
        checked += 1
    assert checked > 10


@pytest.mark.parametrize(
    "name",
    [
        "encoder_offset",
        "motor_encoder_offset",
        "joint_offset",
        "encoder_eccentricity",
        "position_delay",
        "torque_delay",
    ],
)
def test_a_sensor_effect_changes_what_is_seen_and_can_be_taken_out(name, leg):
    motion = smooth_motion(leg)
    signals = {"q": motion.q, "theta": motion.theta, "tau_motor": motion.q, "tau_spring": motion.q}
    effect = make_effect(name, "knee")
    nothing = {amount.name: 0.0 for amount in effect.amounts}
    something = {amount.name: 0.01 for amount in effect.amounts}
    seen = replace(effect, **nothing).measured(leg, motion.time, signals)
    assert all(np.array_equal(seen[kind], signals[kind]) for kind in signals)
    seen = replace(effect, **something).measured(leg, motion.time, signals)
    changed = {kind for kind in signals if not np.allclose(seen[kind], signals[kind], atol=1e-6)}
    assert changed
    assert all(np.array_equal(seen[kind][:, 0], signals[kind][:, 0]) for kind in signals)
    if "q" in changed:
        shown = replace(motion, q=seen["q"], theta=seen["theta"])
        again = replace(effect, **something).corrected(leg, shown)
        np.testing.assert_allclose(again.q[20:-20], motion.q[20:-20], atol=2e-4)
    if "theta" in changed:
        shown = replace(motion, q=seen["q"], theta=seen["theta"])
        again = replace(effect, **something).corrected(leg, shown)
        np.testing.assert_allclose(again.theta, motion.theta, atol=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-4, 0.2])
def test_an_error_once_per_turn_is_taken_out_to_the_last_digit(leg, size):
    """Up to the ends of its range, with the rates of what is shown by the chain rule."""
    motion = smooth_motion(leg)
    effect = make_effect("encoder_eccentricity", "knee", sine=size, cosine=-size)
    q, dq, ddq = (each[:, 1] for each in (motion.q, motion.dq, motion.ddq))
    slope, bend = 1.0 + size * (np.cos(q) + np.sin(q)), size * (np.cos(q) - np.sin(q))
    shown, rate, acceleration = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    shown[:, 1] = q + size * (np.sin(q) - np.cos(q))
    rate[:, 1] = slope * dq
    acceleration[:, 1] = slope * ddq + bend * dq**2
    again = effect.corrected(leg, replace(motion, q=shown, dq=rate, ddq=acceleration))
    np.testing.assert_allclose(again.q, motion.q, rtol=0.0, atol=1e-14 * (1.0 + np.abs(q).max()))
    np.testing.assert_allclose(again.dq, motion.dq, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(again.ddq, motion.ddq, rtol=1e-12, atol=1e-12 * (1.0 + np.abs(ddq).max()))


@pytest.mark.parametrize("way", [1, -1])
def test_an_encoder_errs_before_the_link_bends_behind_it(leg, way):
    """In whatever order a model lists them: else the error would count as a deflection, and bend the link."""
    motion, stiffness = smooth_motion(leg), 150.0
    load = 20.0 * np.sin(motion.time)[:, None] * np.ones(leg.n)
    theta = motion.q + load / stiffness + 0.004 * load
    signals = {"q": motion.q, "theta": theta, "tau_motor": load, "tau_spring": load}
    link = make_effect("link_flexibility", "knee", compliance=0.004, stiffness=stiffness)
    encoder = make_effect("encoder_offset", "knee", offset=0.02)
    pair = [link, encoder][::way]
    seen = measured_signals(leg, pair, motion.time, signals)
    np.testing.assert_allclose(seen["q"][:, 1], motion.q[:, 1] + 0.004 * load[:, 1] + 0.02, atol=1e-12)
    again = corrected_motion(leg, pair, replace(motion, q=seen["q"], theta=theta))
    np.testing.assert_allclose(again.q[:, 1], motion.q[:, 1], atol=1e-12)


def test_a_spring_effect_cancels_in_the_sum(leg):
    motion = smooth_motion(leg)
    for name in ("spring_stiffness", "spring_stiffening", "asymmetric_spring", "spring_offset", "spring_hysteresis"):
        rows = anchored(make_effect(name, "knee"), leg).evaluate(State(leg, motion))
        np.testing.assert_allclose(rows.link + rows.motor, 0.0, atol=1e-12)
        assert np.abs(rows.motor).max() > 0.0


@pytest.mark.filterwarnings("ignore:.*no transmission")
@pytest.mark.parametrize(("robot", "joint", "told"), [
    ("exo_leg", "knee", {"rad/(N m)", "1/(N m)^2", "rad/s", "1/rad"}),
    ("emps", "slider", {"m/N", "1/N^2", "m/s", "1/m"}),
])  # fmt: skip
def test_units_are_those_of_the_joint_without_needless_brackets(robot, joint, told):
    robot = load_robot(robot)
    found = set()
    for name in ("link_flexibility", "torque_saturation", "stribeck_friction", "torque_ripple"):
        effect = make_effect(name, joint)
        shapes = (*effect.shapes, *getattr(effect, "amounts", ()))
        found |= {effect.shape_unit(s, robot) for s in shapes} | {c.unit for c in effect.columns(robot)}
    assert found == told | {"-", robot.joints[robot.index(joint)].torque_unit}


def test_an_unknown_joint_is_told(leg):
    with pytest.raises(Exception, match="its joints are hip, knee, ankle"):
        make_effect("stribeck_friction", "elbow").columns(leg)


def test_an_unknown_effect_lists_what_exists():
    with pytest.raises(EffectError, match="stribeck_friction"):
        make_effect("stribek")


def test_an_unknown_shape_is_told():
    with pytest.raises(EffectError, match="colour"):
        make_effect("stribeck_friction", "knee", colour=1.0)


@pytest.mark.parametrize("value", [0.0, -0.01, float("nan"), float("inf"), "wide", None])
def test_a_shape_that_cannot_be_is_refused_with_its_range(value):
    with pytest.raises(
        EffectError, match=r"'backlash' at 'knee': half_width = .* rad is not a positive number.*0\.5 rad"
    ):
        make_effect("backlash", "knee", half_width=value)


@pytest.mark.parametrize("values", [None, "1", [1.0, "x"]])
def test_what_is_in_a_load_without_numbers_is_refused(values):
    term = {"effect": "spring_offset", "joint": "knee", "shape": {}} | ({} if values is None else {"values": values})
    with pytest.raises(EffectError, match=r"spring_offset at knee.* in the load of another: values .* is not a list"):
        effect_from_dict({"effect": "directional_efficiency", "joint": "knee", "shape": {"terms": [term]}})


@pytest.mark.parametrize("terms", [None, {"effect": "spring_offset"}, "spring_offset"])
def test_what_is_in_a_load_is_a_list(terms):
    with pytest.raises(EffectError, match=r"'directional_efficiency': terms .* is not a list of effects"):
        effect_from_dict({"effect": "directional_efficiency", "joint": "knee", "shape": {"terms": terms}})
