"""What a gear loses follows the load of the links, without the inertia of the rotor that turns before it."""

import json
import warnings

import numpy as np
import pytest
from chains import rigid_chain

from sea_ident import build_regressor, identify
from sea_ident.discrepancy import diagnose
from sea_ident.effects import Anchor, State, base_effects, effect_from_dict, make_effect
from sea_ident.effects.gear_loss import links_for_rotor
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording
from sea_ident.regressor import model_columns, prior_parameters

RATIO, ROTOR, PERIOD = 50.0, 8e-5, 5.0

UPRIGHT, LEVEL = "0 0 1", "0 -1 0"


def built(axes, rotor=True, kind="revolute"):
    """A chain of rigid joints, with the inertia of the rotors in its description or not."""
    inertia = f"<rotorInertia>{ROTOR}</rotorInertia>" if rotor else ""
    count = range(len(axes))
    return rigid_chain(
        axes,
        [f"0.02 0.01 {-0.14 + 0.02 * k}" for k in count],
        [2.0 - 0.7 * k for k in count],
        'ixx="0.02" iyy="0.021" izz="0.004"',
        [f"0 0 {-0.3 if k else 1}" for k in count],
        f"<mechanicalReduction>{RATIO}</mechanicalReduction>{inertia}"
        "<viscousFriction>0.4</viscousFriction><coulombFriction>0.4</coulombFriction>",
        kind,
    )


def moving(n, seed=1):
    """A motion of n joints that is fast enough for their inertia to be much of the load."""
    a, b = np.random.default_rng(seed).normal(0.0, 0.6, (2, n, 4)) / np.arange(1, 5) ** 0.7
    return FourierSeries(1.0 / PERIOD, 0.3 * np.ones(n), a, b)


def parameters_of(robot):
    effects = base_effects(robot)
    names = [column.name for column in model_columns(robot, effects)]
    return effects, dict(zip(names, np.nan_to_num(prior_parameters(robot, effects)), strict=True))


@pytest.mark.parametrize(
    ("axes", "kind", "hidden"),
    [
        ((LEVEL,), "revolute", (True,)),
        ((LEVEL, LEVEL), "revolute", (True, False)),
        ((UPRIGHT, LEVEL, LEVEL), "revolute", (True, True, False)),
        (("1 0 0", "0 1 0"), "prismatic", (True, True)),
        # its weight tells the mass of what slides up and down
        (("0 0 1",), "prismatic", (False,)),
    ],
    ids=["pendulum", "two in a plane", "arm", "gantry", "lift"],
)
def test_links_stand_in_for_a_rotor_where_a_motion_does_not_tell_them_apart(axes, kind, hidden):
    robot = built(axes, rotor=False, kind=kind)
    motion = moving(robot.n).sample(20.0)
    regressor = build_regressor(robot, base_effects(robot), motion)
    names = [column.name for column in regressor.columns]
    bodies = [names.index(name) for name in robot.inertial_names]
    for joint, expected in zip(robot.joint_names, hidden, strict=True):
        links = links_for_rotor(robot, joint)
        assert (links is not None) == expected
        if links is not None:
            rotor = regressor.sum[:, :, names.index(f"{joint}.rotor_inertia")]
            np.testing.assert_allclose(regressor.sum[:, :, bodies] @ links, rotor, atol=1e-9 * np.abs(rotor).max())


def anchored_on(robot, effect, motion):
    """The effect in the usual model of a robot, on a motion."""
    effects, parameters = parameters_of(robot)
    anchor = Anchor(robot, (*effects, effect), parameters)
    return effect.anchored(anchor).on(State(robot, motion)), anchor


@pytest.mark.parametrize("name", ["load_dependent_friction", "directional_efficiency"])
def test_with_the_inertia_of_the_rotor_the_load_is_that_of_the_links(name):
    """Whatever the model has of the two, in sum it is what the torque shows."""
    true, described = built((UPRIGHT, LEVEL)), built((UPRIGHT, LEVEL), rotor=False)
    motion, plain, links = moving(2).sample(50.0), make_effect(name, "j1"), links_for_rotor(described, "j1")
    given = described.with_inertial_parameters(described.inertial_parameters + ROTOR * links, [0.0, 0.0])
    effects, parameters = parameters_of(given)
    own = plain.anchored(Anchor(described, effects, parameters)).on(State(described, motion))
    assert [shape.name for shape in own.ranges] == ["reflected_inertia"]
    assert 0.0 < ROTOR * RATIO**2 < own.most
    right = type(own)(**{**vars(own), "reflected_inertia": ROTOR * RATIO**2})
    expected = plain.evaluate(State(true, motion))
    np.testing.assert_allclose(right.evaluate(State(given, motion)).motor, expected.motor, atol=1e-9)
    assert effect_from_dict(json.loads(json.dumps(right.to_dict()))) == right
    # a simulation gets the load from its bodies
    there = right.modified(given, np.array([0.1]))
    np.testing.assert_allclose(there.rotor_inertias(), [0.0, ROTOR], atol=1e-15)
    np.testing.assert_allclose(there.inertial_parameters, true.inertial_parameters, atol=1e-9)


@pytest.mark.parametrize(
    ("robot", "joint"), [(built((LEVEL, LEVEL)), "j0"), (built((LEVEL, LEVEL), rotor=False), "j1")],
    ids=["described", "told by the motion"],
)  # fmt: skip
def test_an_inertia_that_is_known_is_not_free(robot, joint):
    own, _ = anchored_on(robot, make_effect("load_dependent_friction", joint), moving(2).sample(50.0))
    assert own.most is None
    assert own.ranges == ()
    assert own.reservation is None
    assert own.modified(robot, np.array([0.1])) is robot


def test_where_all_the_load_is_inertia_that_is_said():
    """Then a loss shows the product of its share and what the links have of the inertia."""
    robot = built(("1 0 0", "0 1 0"), rotor=False, kind="prismatic")
    own, _ = anchored_on(robot, make_effect("load_dependent_friction", "j1"), moving(2).sample(50.0))
    assert own.ranges == ()
    assert "the true share is larger" in own.reservation
    pendulum, loss = built((LEVEL,), rotor=False), make_effect("load_dependent_friction", "j0")
    free, _ = anchored_on(pendulum, loss, moving(1).sample(50.0))
    assert free.ranges
    assert free.reservation is None
    (shape,) = free.ranges
    assert free.shape_unit(shape, robot) == "kg"


def recorded(robot, effect, value, seed):
    """Periods of a motion with a little noise, and the torques that it takes."""
    motion, periods, rng = moving(robot.n, seed).sample(200.0), 12, np.random.default_rng(seed)
    effects, parameters = parameters_of(robot)
    regressor = build_regressor(robot, (*effects, effect), motion)
    torque = regressor.sum @ np.append(list(parameters.values()), value)
    shown = {"q": (motion.q, 1e-6), "tau_motor": (torque, 0.02)}
    columns = {
        f"{kind}_{joint}": np.tile(signal[:, i], periods) + size * rng.standard_normal(periods * len(motion))
        for kind, (signal, size) in shown.items()
        for i, joint in enumerate(robot.joint_names)
    }
    return Recording(np.arange(periods * len(motion)) / 200.0, columns, "chain")


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "axes", "joint", "value"),
    [
        ("load_dependent_friction", (LEVEL, LEVEL), "j0", 0.05),
        ("directional_efficiency", (LEVEL, LEVEL), "j0", 0.08),
        ("load_dependent_friction", (UPRIGHT, LEVEL, LEVEL), "j1", 0.05),
    ],
)
def test_a_loss_is_found_with_its_size_and_by_no_other_name_where_the_rotor_is_not_known(name, axes, joint, value):
    true, given = built(axes), built(axes, rotor=False)
    one, other = (recorded(true, make_effect(name, joint), value, seed) for seed in (1, 2))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(given, one, period=PERIOD), one, holdout=other, period=PERIOD)
    assert [(effect.effect, effect.joint) for effect in found.missing] == [(name, joint)]
    assert found.verdict == "named"
    size, *shapes = found.missing[0].parameters
    assert abs(size.value - value) < 3.0 * size.std
    (inertia,) = shapes
    assert inertia.name == f"{joint}.{name}_reflected_inertia"
    assert abs(inertia.value - ROTOR * RATIO**2) < 3.0 * inertia.std
    assert found.holdout.shrink > 0.95
    assert all(gap.shrink > 0.9 for gap in found.simulation_gap.values())
