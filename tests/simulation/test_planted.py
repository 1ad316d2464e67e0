import json
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from plants import modest_series, ur10

from sea_ident import SeaIdentError, build_regressor
from sea_ident.effects import (
    Anchor,
    Column,
    Effect,
    JointEffect,
    Side,
    base_effects,
    effect_from_dict,
    make_effect,
    spring_effects,
)
from sea_ident.regressor import model_columns
from sea_ident.simulation import PlantedEffect, plant_from_robot, simulate
from sea_ident.simulation.planted import PlantedTorques

PLANTED = [
    ("torque_offset", [0.7]),
    ("stribeck_friction", [0.5]),
    ("nonlinear_viscous_friction", [0.4]),
    ("load_dependent_friction", [0.05]),
    ("directional_efficiency", [0.08]),
    ("position_dependent_friction", [0.2, 0.1]),
    ("torque_ripple", [0.2, -0.1]),
    ("asymmetric_spring", [40.0]),
    ("spring_offset", [0.5]),
    ("backlash", [60.0]),
    ("link_friction", [0.3, 0.4]),
    ("parallel_spring", [5.0, 0.4]),
    ("stiffness_drift", [50.0]),
    ("friction_drift", [0.05, 0.1]),
]


@pytest.mark.parametrize(("name", "values"), PLANTED, ids=[name for name, _ in PLANTED])
def test_planted_effect_acts_as_its_columns_say(leg, leg_series, quiet, exact, name, values):
    effect = make_effect(name, "knee")
    planted = [PlantedEffect(effect, np.array(values))]
    run = simulate(leg, leg_series, periods=1, effects=planted, start=exact.motion, **quiet)
    own = (*base_effects(leg), *spring_effects(leg))
    psi = np.concatenate([plant_from_robot(leg).values_of(own), values])
    regressor = build_regressor(leg, (*own, effect), run.motion)
    np.testing.assert_allclose(regressor.motor @ psi, run.tau_motor, atol=1e-10)
    np.testing.assert_allclose(regressor.link @ psi, 0.0, atol=1e-10)
    share = (
        np.abs(regressor.sum[:, :, -len(values) :] @ values).max()
        + np.abs(regressor.link[:, :, -len(values) :] @ values).max()
    )
    assert share > 1e-3


def test_spring_effects_are_part_of_the_spring_torque(leg, leg_series, quiet, exact):
    effect = PlantedEffect(make_effect("spring_offset", "hip"), np.array([2.0]))
    run = simulate(leg, leg_series, periods=1, effects=[effect], start=exact.motion, **quiet)
    d, plant = run.motion.deflection, run.plant
    law = plant.stiffness * d + plant.cubic_stiffness * d**3 + plant.spring_damping * run.motion.deflection_rate
    np.testing.assert_allclose(run.tau_spring - law, np.tile([2.0, 0.0, 0.0], (len(d), 1)), atol=1e-10)


@pytest.mark.scenario
@pytest.mark.parametrize("loaded", [["elbow_joint"], ["shoulder_lift_joint", "elbow_joint", "wrist_1_joint"]])
def test_load_of_a_rigid_joint_is_what_its_bodies_need(quiet, loaded):
    robot = ur10()
    effects = [make_effect("load_dependent_friction", joint) for joint in loaded]
    values = np.array([0.1])
    series = modest_series(robot)
    planted, begin = [PlantedEffect(effect, values) for effect in effects], series.motion(np.zeros(1))
    run = simulate(robot, series, periods=1, effects=planted, start=begin, **quiet)
    own = base_effects(robot)
    psi = np.concatenate([np.nan_to_num(plant_from_robot(robot).values_of(own)), *[values] * len(loaded)])
    regressor = build_regressor(robot, (*own, *effects), run.motion)
    np.testing.assert_allclose(regressor.sum @ psi, run.tau_motor, atol=1e-9)
    assert not np.any(run.tau_spring)


def test_what_acts_on_a_link_behind_a_spring_is_not_in_the_spring(leg, leg_series, quiet, exact):
    effect = PlantedEffect(make_effect("link_friction", "hip"), np.array([1.0, 2.0]))
    run = simulate(leg, leg_series, periods=1, effects=[effect], start=exact.motion, **quiet)
    d, plant = run.motion.deflection, run.plant
    law = plant.stiffness * d + plant.cubic_stiffness * d**3 + plant.spring_damping * run.motion.deflection_rate
    np.testing.assert_allclose(run.tau_spring, law, atol=1e-10)


def test_a_load_has_what_is_there_all_the_time_and_what_follows_it_once(leg):
    """A drift is nothing in the mean, and two that follow the torque of a motor do not follow each other."""
    names = ("torque_saturation", "directional_efficiency", "torque_offset", "spring_offset", "friction_drift")
    planted = [PlantedEffect(make_effect(name, "knee"), np.ones(1 + (name == "friction_drift"))) for name in names]
    parameters = plant_from_robot(leg).values_of((*base_effects(leg), *spring_effects(leg)))
    effects, _ = in_the_model(leg, planted, parameters)
    saturation, loss = effects[-5:-3]
    assert [term.effect.name for term in saturation.terms] == [
        "directional_efficiency",
        "torque_offset",
        "spring_offset",
    ]
    assert [term.effect.name for term in loss.terms] == ["torque_saturation", "torque_offset", "spring_offset"]
    for own in (saturation.terms[0].effect, loss.terms[0].effect):
        assert [term.effect.name for term in own.terms] == ["spring_offset"]


def in_the_model(robot, planted, parameters):
    """Effects that know each other's values, with the parameters of the whole model."""
    own = (*base_effects(robot), *spring_effects(robot))
    values = dict(zip([c.name for c in model_columns(robot, own)], parameters, strict=True))
    for each in planted:
        values |= dict(zip([c.name for c in each.effect.columns(robot)], each.values, strict=True))
    effects = (*own, *(each.effect for each in planted))
    for _ in range(2):  # what follows another must know what that follows
        anchor = Anchor(robot, effects, values)
        effects = tuple(effect.anchored(anchor) for effect in effects)
    return effects, np.array([values[c.name] for c in model_columns(robot, effects)])


BENT_SPRING = [("spring_stiffening", [90.0], {"exponent": 2.0}), ("asymmetric_spring", [30.0], {})]
AT_MOTOR = [("torque_offset", [0.7], {}), ("stribeck_friction", [0.5], {}), ("directional_efficiency", [0.08], {})]


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "value", "others"),
    [
        ("load_dependent_friction", 0.05, [("spring_offset", [2.0], {})]),
        ("directional_efficiency", 0.08, BENT_SPRING),
        ("torque_saturation", 1e-4, [("spring_offset", [2.0], {})]),
        ("torque_saturation", 1e-4, AT_MOTOR),
        ("torque_saturation", 1e-4, [*BENT_SPRING, AT_MOTOR[-1]]),
    ],
)
def test_what_follows_a_load_follows_all_that_the_model_has_there(leg, leg_series, quiet, exact, name, value, others):
    planted = [PlantedEffect(make_effect(name, "knee"), np.array([value]))]
    planted += [PlantedEffect(make_effect(n, "knee", **shape), np.array(values)) for n, values, shape in others]
    run = simulate(leg, leg_series, periods=1, effects=planted, start=exact.motion, **quiet)
    own = (*base_effects(leg), *spring_effects(leg))
    effects, psi = in_the_model(leg, planted, plant_from_robot(leg).values_of(own))
    knows = build_regressor(leg, effects, run.motion)
    np.testing.assert_allclose(knows.motor @ psi, run.tau_motor, atol=1e-8)
    assert tuple(effect_from_dict(json.loads(json.dumps(effect.to_dict()))) for effect in effects) == effects
    without = [replace(effect, terms=()) if hasattr(effect, "terms") else effect for effect in effects]
    assert np.abs(build_regressor(leg, without, run.motion).motor @ psi - run.tau_motor).max() > 1e-3


@pytest.mark.scenario
def test_what_follows_the_load_of_a_rigid_joint_follows_all_that_the_joint_carries(quiet):
    robot = ur10()
    series = modest_series(robot)
    load = np.array([1.5, *([0.0] * 9)])
    planted = [
        PlantedEffect(make_effect("load_dependent_friction", "elbow_joint"), np.array([0.1])),
        PlantedEffect(make_effect("parallel_spring", "elbow_joint"), np.array([20.0, 3.0])),
        PlantedEffect(make_effect("link_friction", "elbow_joint"), np.array([2.0, 4.0])),
        PlantedEffect(make_effect("payload", "wrist_3_joint"), load),
        PlantedEffect(make_effect("external_force", "wrist_1_joint"), np.array([3.0, -2.0, 5.0])),
        PlantedEffect(make_effect("torque_offset", "elbow_joint"), np.array([2.0])),
    ]
    run = simulate(robot, series, periods=1, effects=planted, start=series.motion(np.zeros(1)), **quiet)
    parameters = np.nan_to_num(plant_from_robot(robot).values_of(base_effects(robot)))
    effects, psi = in_the_model(robot, planted, parameters)
    np.testing.assert_allclose(build_regressor(robot, effects, run.motion).sum @ psi, run.tau_motor, atol=1e-8)


def test_memory_moves_on_with_accepted_steps_only(leg, leg_series, quiet, exact):
    effect = make_effect("presliding_friction", "knee", displacement=0.01)
    planted = [PlantedEffect(effect, np.array([1.0]))]
    run = simulate(leg, leg_series, periods=1, step=1.25e-3, effects=planted, start=exact.motion, **quiet)
    speed, lag, path = run.motion.dtheta[:, 1], [0.0], run.motion.theta[:, 1]
    for k in range(1, len(path)):  # Dahl's law in small steps along the recorded path
        for _ in range(200):
            step = (path[k] - path[k - 1]) / 200.0
            lag.append(lag[-1] + step / 0.01 * (1.0 - lag[-1] * np.sign(step)))
    expected = np.array(lag)[::200] - np.tanh(speed / 0.01)
    own = (*base_effects(leg), *spring_effects(leg))
    acting = run.tau_motor - build_regressor(leg, own, run.motion).motor @ plant_from_robot(leg).values_of(own)
    # a reversal between two samples is not in the recorded path
    np.testing.assert_allclose(acting[:, 1], expected, atol=5e-3)
    assert np.ptp(expected) > 0.5


def test_sensor_effects_change_the_recording_and_not_the_robot(leg, leg_series, quiet, exact):
    effect = PlantedEffect(make_effect("encoder_offset", "knee", offset=0.01), np.zeros(0))
    run = simulate(leg, leg_series, periods=2, effects=[effect], **quiet)
    assert np.array_equal(run.motion.q, exact.motion.q)
    shift = run.recording.channel("q", leg.joint_names) - exact.recording.channel("q", leg.joint_names)
    np.testing.assert_allclose(np.abs(shift), np.tile([0.0, 0.01, 0.0], (len(shift), 1)), atol=1e-12)


def test_payload_is_carried(leg, leg_series, quiet, exact):
    effect = make_effect("payload", "ankle")
    values = np.zeros(len(effect.columns(leg)))
    values[0] = 1.0
    planted = [PlantedEffect(effect, values)]
    run = simulate(leg, leg_series, periods=1, effects=planted, start=exact.motion, **quiet)
    more = run.plant.robot.inertial_parameters - leg.inertial_parameters
    assert more[20] == pytest.approx(1.0)
    own = base_effects(run.plant.robot)
    regressor = build_regressor(run.plant.robot, own, run.motion)
    np.testing.assert_allclose(regressor.sum @ run.plant.values_of(own), run.tau_motor, atol=1e-10)


@dataclass(frozen=True)
class Gust(JointEffect):
    """Somebody's own effect: a torque that depends on time."""

    name: ClassVar[str] = "gust"
    side: ClassVar[Side] = Side.LINK
    source: ClassVar[str] = "this test"

    def columns(self, robot):
        return (Column(self.parameter_name(), "N m", self.name, self.joint, self.side),)

    def local_columns(self, q, dq, theta, dtheta):
        raise NotImplementedError

    def torque(self, robot, values):
        i = robot.index(self.joint)
        seen = []

        def act(state, link, motor):
            assert state.time >= 0.0
            seen.append(state.elapsed)
            link[i] -= float(values[0]) * np.sin(3.0 * state.time)

        return act


@pytest.mark.scenario
def test_effects_of_others_see_the_time_of_the_recording(leg, leg_series, quiet):
    run = simulate(leg, leg_series, periods=1, effects=[PlantedEffect(Gust("hip"), np.array([3.0]))], **quiet)
    own = (*base_effects(leg), *spring_effects(leg))
    regressor = build_regressor(leg, own, run.motion)
    push = (regressor.link @ plant_from_robot(leg).values_of(own))[:, 0]
    np.testing.assert_allclose(push, 3.0 * np.sin(3.0 * run.motion.time), atol=1e-10)


@dataclass(frozen=True)
class Weaker(Effect):
    """All motors give less than they are asked for, and nothing else acts."""

    name: ClassVar[str] = "weaker"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "this test"

    def columns(self, robot):
        return (Column(self.parameter_name(), "-", self.name, None, self.side),)

    def evaluate(self, state):
        raise AssertionError("nobody asks for it")

    def demand(self, robot, values):
        return np.full(robot.n, 1.0 + values[0])


def test_motors_that_are_asked_for_more_are_that_by_any_effect(leg, leg_series, quiet, exact):
    """One that only says so acts, as those of the single motors do; what two ask for is multiplied."""
    each = [PlantedEffect(make_effect("torque_constant", name), np.array([0.32])) for name in leg.joint_names]
    all_at_once = [PlantedEffect(Weaker(), np.array([0.2])), PlantedEffect(Weaker(), np.array([0.1]))]
    plain, one, other = (
        simulate(leg, leg_series, periods=1, effects=planted, start=exact.motion, **quiet).tau_motor
        for planted in ([], each, all_at_once)
    )
    np.testing.assert_allclose(one, other, atol=1e-9)
    assert np.abs(one - plain).max() > 0.5


def test_only_what_acts_by_the_load_of_a_rigid_joint_needs_it():
    robot = ur10()
    for name, needed in (("torque_constant", False), ("load_dependent_friction", True)):
        planted = [PlantedEffect(make_effect(name, robot.joint_names[1]), np.array([0.1]))]
        assert PlantedTorques(robot, planted, 0.0).needs_load == needed


def test_wrong_number_of_values_is_refused(leg, leg_series):
    with pytest.raises(SeaIdentError, match=r"link_friction.*2 parameters"):
        simulate(leg, leg_series, effects=[PlantedEffect(make_effect("link_friction", "hip"), np.zeros(1))])


@dataclass(frozen=True)
class Told(JointEffect):
    """An effect at one joint that acts by a function of its own, of the state of the whole robot."""

    of: JointEffect | None = None

    name: ClassVar[str] = "told"
    source: ClassVar[str] = "this test"

    @property
    def side(self):
        return self.of.side

    def columns(self, robot):
        return self.of.columns(robot)

    def local_columns(self, q, dq, theta, dtheta):
        return self.of.local_columns(q, dq, theta, dtheta)

    def torque(self, robot, values):
        action = self.of.torque(robot, values)
        return lambda state, link, motor: action(state, link, motor)


DAMPING = [
    ("viscous_friction", [0.7], {"motor": 0.7}),
    ("link_friction", [0.3, 0.0], {"link": 0.3}),
    ("spring_damping", [1.5], {"link": 1.5, "motor": 1.5}),
    ("torque_offset", [0.7], {}),
    ("viscous_friction", [-0.7], {}),
]


@pytest.mark.parametrize("alone", [True, False], ids=["state of the joint", "state of the robot"])
@pytest.mark.parametrize(("name", "values", "expected"), DAMPING)
def test_slopes_over_the_speeds_are_those_of_what_damps(leg, name, values, expected, alone):
    effect = make_effect(name, "knee")
    planted = PlantedEffect(effect if alone else Told("knee", effect), np.array(values))
    torques = PlantedTorques(leg, [planted], 0.0)
    rng = np.random.default_rng(0)
    damping = [0.5] * 6
    torques.add_damping(0.0, *rng.standard_normal((2, 6)), [0.0] * 3, [0.0] * 3, damping)
    added = np.array([0.0, expected.get("link", 0.0), 0.0, 0.0, expected.get("motor", 0.0), 0.0])
    np.testing.assert_allclose(np.array(damping) - 0.5, added, atol=1e-9)


@dataclass(frozen=True)
class Sloped(Told):
    """An effect of no speed that is asked for its slopes all the same."""

    def torque(self, robot, values):
        action = self.of.torque(robot, values)
        assert not action.of_speed
        action.of_speed = True
        return action


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("torque_offset", [0.7]),
        ("torque_ripple", [2.0, -1.0]),
        ("parallel_spring", [5.0, 0.4]),
        ("spring_offset", [0.5]),
        ("asymmetric_spring", [40.0]),
        ("backlash", [60.0]),
        ("spring_hysteresis", [0.8, 0.6]),
        ("stiffness_drift", [50.0]),
        ("torque_saturation", [1e-4]),
        ("torque_constant_drift", [0.2]),
    ],
)
def test_slopes_of_what_depends_on_no_speed_change_no_bit(leg, leg_series, quiet, exact, name, values):
    effect = make_effect(name, "knee")
    runs = [
        simulate(
            leg, leg_series, periods=1, effects=[PlantedEffect(each, np.array(values))], start=exact.motion, **quiet
        ).recording
        for each in (effect, Sloped("knee", effect))
    ]
    assert runs[0].columns.keys() == runs[1].columns.keys()
    for column, signal in runs[0].columns.items():
        np.testing.assert_array_equal(signal, runs[1].columns[column], column)
    without = exact.recording.columns["q_knee"][: runs[0].samples]
    assert not np.array_equal(runs[0].columns["q_knee"], without)


def test_slopes_of_a_rigid_joint_are_at_its_only_coordinate():
    robot = ur10()
    planted = PlantedEffect(make_effect("viscous_friction", "elbow_joint"), np.array([0.7]))
    damping = [0.0] * 6
    speeds = np.linspace(-1.0, 1.0, 6)
    PlantedTorques(robot, [planted], 0.0).add_damping(0.0, np.zeros(6), speeds, [0.0] * 6, [0.0] * 6, damping)
    np.testing.assert_allclose(damping, 0.7 * (np.arange(6) == robot.index("elbow_joint")), atol=1e-9)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("torque_ripple", [2.0, -1.0]),
        ("asymmetric_spring", [40.0]),
        ("friction_drift", [0.5, 1.0]),
        ("load_dependent_friction", [0.1]),
    ],
)
def test_it_is_the_same_whether_asked_for_by_joint_or_with_the_whole_robot(leg, leg_series, quiet, exact, name, values):
    effect = make_effect(name, "knee")
    runs = [
        simulate(
            leg,
            leg_series,
            periods=1,
            effects=[PlantedEffect(each, np.array(values))],
            start=exact.motion,
            **quiet,
        )
        for each in (effect, Told("knee", effect))
    ]
    np.testing.assert_allclose(runs[0].motion.theta, runs[1].motion.theta, atol=1e-11)
    np.testing.assert_allclose(runs[0].tau_spring, runs[1].tau_spring, atol=1e-8)


COMMAND, SPEED = 12.0, -0.8


@pytest.mark.parametrize(("time", "passed"), [(30.0, 30.0), (-30.0, 0.0)], ids=["recorded", "while it settles"])
@pytest.mark.parametrize(
    ("name", "values", "shape", "expected"),
    [
        ("torque_saturation", [1e-3], {"exponent": 3.0}, lambda t: 1e-3 * COMMAND**3),
        # a rate per minute that falls with the time constant of 60 s
        ("torque_constant_drift", [0.2], {"time_constant": 60.0}, lambda t: 0.2 * COMMAND * (1 - np.exp(-t / 60.0))),
        ("friction_drift", [0.5, 0.1], {"time_constant": 60.0}, lambda t: (0.5 * SPEED - 0.1) * (1 - np.exp(-t / 60))),
        (
            "temperature_friction",
            [0.05, 0.01],
            {"rise": 20.0, "time_constant": 40.0},
            lambda t: (0.05 * SPEED - 0.01) * 20.0 * (1 - np.exp(-t / 40.0)),
        ),
    ],
)
def test_what_depends_on_command_or_time_acts_by_the_command_and_the_time_of_the_recording(
    leg, name, values, shape, expected, time, passed
):
    torques = PlantedTorques(leg, [PlantedEffect(make_effect(name, "knee", **shape), np.array(values))], 0.0)
    out, position, speed = [0.0] * 6, np.zeros(6), np.zeros(6)
    speed[4] = SPEED
    torques.add(time, 0.0, position, speed, [0.0, COMMAND, 0.0], [1.0, 2.0, 3.0], out)
    np.testing.assert_allclose(out, [0.0, 0.0, 0.0, 0.0, -expected(passed), 0.0], rtol=1e-9)
