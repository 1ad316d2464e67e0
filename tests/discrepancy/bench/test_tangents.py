"""Derivatives with respect to shapes and sensor errors agree with differences of the residual."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.free_shapes import free_shapes, moved, moved_within
from sea_ident.effects import corrected_motion, effect_classes, make_effect
from sea_ident.effects.drift import TrendEffect
from sea_ident.effects.signal import SignalEffect

STEP = 5e-5
"""Of the differences, in the coordinates of `moved`; not the one that the analytic side uses."""

WITH_SHAPES = sorted(
    name
    for name, kind in effect_classes().items()
    if not issubclass(kind, TrendEffect)
    and (issubclass(kind, SignalEffect) or kind.shapes)
    and free_shapes((kind(joint="knee"),))
)

TOGETHER = {
    "an offset after an eccentricity": (
        make_effect("encoder_eccentricity", "knee", sine=0.01, cosine=0.02),
        make_effect("encoder_offset", "knee", offset=0.03),
    ),
    "a filtered encoder of another zero": (
        make_effect("position_delay", "knee", delay=0.01, lag=0.008),
        make_effect("motor_encoder_offset", "knee", offset=0.05),
        make_effect("joint_offset", "knee", offset=0.1),
    ),
    "a late encoder before a flexible link": (
        make_effect("position_delay", "knee", delay=0.003),
        make_effect("link_flexibility", "knee", compliance=1e-4),
    ),
    "an offset, and signals that come late": (
        make_effect("encoder_offset", "knee", offset=0.03),
        make_effect("torque_delay", "hip", delay=0.003),
        make_effect("position_delay", "knee", delay=0.002),
    ),
    "all torques late, and all link encoders filtered": (
        make_effect("torque_delay", delay=0.003),
        make_effect("position_delay", delay=0.008, lag=0.005),
    ),
    "a torque that comes late, of which one is a ripple": (
        make_effect("torque_ripple", "knee", order=4.0),
        make_effect("torque_delay", "knee", delay=0.003),
    ),
}


def scale_of(bench, fit):
    """(E,) factor of the residual: the stiffness of the first fit over that of this one, one beside links."""
    first = bench.first_stiffness
    return np.where(first > 0.0, first / np.where(first > 0.0, bench.stiffness_of(fit), 1.0), 1.0)


def scaled_residual(bench, effects, parameters):
    fit = bench.predicted(effects, parameters)
    return scale_of(bench, fit)[:, None].T * fit.residual


def far_off(bench, added):
    """A model that is wrong enough for its residual to count: the knee stiffer by a third, all else by some percent."""
    base = bench.first_fit
    effects = [e for e in base.effects if (e.name, e.joint) not in {(a.name, a.joint) for a in added}]
    rng = np.random.default_rng(0)
    parameters = {k: v * (1.0 + 0.05 * rng.standard_normal()) for k, v in base.parameters.items()}
    parameters["knee.spring_stiffness"] *= 1.3
    for effect in added:
        for column in effect.columns(bench.robot):
            parameters.setdefault(column.name, 0.5)
    effects = list(bench.anchored((*effects, *added), parameters))
    return effects, parameters, len(effects) - len(added)


def compare(bench, added, tolerance=2e-4):
    effects, parameters, first = far_off(bench, added)
    fit = bench.predicted(effects, parameters)
    shapes = [(k, shape) for k, shape in free_shapes(effects) if k >= first]
    assert shapes
    parts = bench.tangents(tuple(effects), fit.columns, fit.values, shapes)
    tangents = bench.scaled(*parts, fit.residual, scale_of(bench, fit), bench.stiffness_of(fit))
    for k, (position, shape) in enumerate(shapes):
        ends = []
        for step in (STEP, -STEP):
            changed = list(effects)
            changed[position] = moved(effects[position], shape, step)
            ends.append(scaled_residual(bench, changed, parameters))
        decrease = (ends[1] - ends[0]) / (2.0 * STEP)
        if shape.name == "point_y":
            # along the axis of the joints it changes no moment about them
            assert np.linalg.norm(decrease) == np.linalg.norm(tangents[:, :, k]) == 0.0
            continue
        error = np.linalg.norm(decrease - tangents[:, :, k]) / np.linalg.norm(decrease)
        assert np.linalg.norm(decrease) > 0.0
        assert error < tolerance, (effects[position].name, shape.name, error)


@pytest.mark.parametrize("name", WITH_SHAPES)
def test_every_shape_of_every_effect(nothing_missing, name):
    kind = effect_classes()[name]
    effect = next(e for e in kind.instances(nothing_missing[0].robot) if e.joint == "knee")
    if isinstance(effect, SignalEffect):
        effect = replace(effect, **{amount.name: 0.03 * amount.upper for amount in effect.amounts})
    for _, shape in free_shapes((effect,)):
        if not shape.logarithmic:  # away from the ends of its range
            effect = replace(effect, **{shape.name: 0.7 * shape.upper + 0.3 * shape.lower})
    # where an element of a hysteresis slips or sticks its torque has a kink: two steps of different size see two slopes
    # so has that of a play, but at few samples of a period
    compare(nothing_missing[0], [effect], {"spring_hysteresis": 0.02, "backlash": 1e-3}.get(name, 2e-4))


@pytest.mark.parametrize("exponent", [0.3, 0.5, 2.0])
def test_at_the_end_of_its_range_or_beyond_a_shape_has_the_slope_from_within(nothing_missing, exponent):
    bench, _ = nothing_missing
    effects, parameters, first = far_off(bench, [make_effect("stribeck_friction", "knee", exponent=exponent)])
    fit = bench.predicted(effects, parameters)
    pair = next((k, shape) for k, shape in free_shapes(effects) if k >= first and shape.name == "exponent")
    parts = bench.tangents(tuple(effects), fit.columns, fit.values, [pair])
    tangent = bench.scaled(*parts, fit.residual, scale_of(bench, fit), bench.stiffness_of(fit))[:, :, 0]
    step = STEP if exponent < 1.0 else -STEP
    changed = [*effects[:-1], moved(effects[-1], pair[1], step)]
    decrease = (scaled_residual(bench, effects, parameters) - scaled_residual(bench, changed, parameters)) / step
    assert np.linalg.norm(decrease - tangent) < 0.01 * np.linalg.norm(decrease)


@pytest.mark.parametrize("name", ["stribeck_friction", "load_dependent_friction", "position_dependent_friction"])
def test_what_turns_over_with_the_friction_moves_with_it(nothing_missing, name):
    bench, _ = nothing_missing
    effects, parameters, _ = far_off(bench, [make_effect(name, "knee")])
    fit = bench.predicted(effects, parameters)
    position = next(k for k, e in enumerate(effects) if (e.name, e.joint) == ("coulomb_friction", "knee"))
    shape = effects[position].shapes[0]
    parts = bench.tangents(tuple(effects), fit.columns, fit.values, [(position, shape)])
    tangent = bench.scaled(*parts, fit.residual, scale_of(bench, fit), bench.stiffness_of(fit))[:, :, 0]
    low, high = (moved_within(effects, position, shape, step) for step in (-STEP, STEP))
    assert [one.name for one, other in zip(low, high, strict=True) if one != other] == ["coulomb_friction", name]
    decrease = (scaled_residual(bench, low, parameters) - scaled_residual(bench, high, parameters)) / (2.0 * STEP)
    assert np.linalg.norm(decrease - tangent) < 2e-4 * np.linalg.norm(decrease)


@pytest.mark.parametrize("case", TOGETHER)
def test_corrections_that_follow_each_other(nothing_missing, case):
    compare(nothing_missing[0], TOGETHER[case])


def test_a_candidate_at_zero_is_seen_as_one_of_the_model(nothing_missing):
    """The search asks before the effect is in the model, with the same answer."""
    bench, _ = nothing_missing
    known = make_effect("encoder_eccentricity", "knee", sine=0.01, cosine=0.02)
    effects, parameters, _ = far_off(bench, [known])
    offset = make_effect("encoder_offset", "knee")
    before = bench.signal_tangent(offset, offset.amounts[0], effects, parameters)
    after = bench.signal_tangent(offset, offset.amounts[0], [*effects, offset], parameters)
    for one, other in zip(before, after, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9 * np.abs(other).max())


def test_every_parameter(nothing_missing):
    """`Fit.directions` is the decrease of the scaled residual with every parameter, a stiffness included."""
    bench, now = nothing_missing
    fit = now.fit
    for k, column in enumerate(fit.columns):
        power = np.linalg.norm(fit.directions[:, :, k])
        if power == 0.0:
            continue
        step = 1e-4 * np.linalg.norm(bench.data.tau_motor) / power / len(bench.data.tau_motor)
        ends = [
            scaled_residual(bench, fit.effects, {**fit.parameters, column.name: fit.parameters[column.name] + s * step})
            for s in (1.0, -1.0)
        ]
        decrease = (ends[1] - ends[0]) / (2.0 * step)
        assert np.linalg.norm(decrease - fit.directions[:, :, k]) < 1e-3 * power, column.name


def test_moved_counts_factors_and_ranges():
    stribeck = make_effect("stribeck_friction", "knee", speed=0.1, exponent=1.0)
    speed, exponent = stribeck.shapes
    assert moved(stribeck, speed, 0.5).speed == pytest.approx(0.1 * np.exp(0.5))
    assert moved(stribeck, exponent, 0.2).exponent == pytest.approx(1.0 + 0.2 * (exponent.upper - exponent.lower))
    assert moved(stribeck, speed, 50.0).speed == speed.upper


@pytest.mark.parametrize(
    "signal",
    [
        make_effect("position_delay", "ankle", delay=0.002),
        make_effect("encoder_eccentricity", "ankle", sine=0.004, cosine=-0.003),
        make_effect("link_flexibility", "ankle", compliance=1e-3, stiffness=120.0),
    ],
    ids=lambda e: e.name,
)
def test_stiffness_of_a_link_is_that_of_the_spring_before_its_encoder(nothing_missing, signal):
    """What an encoder shows late or wrongly is no deflection; what bends behind it makes no spring before it softer."""
    bench, _ = nothing_missing
    effects = (*bench.effects, signal)
    whole = 120.0 / (1.0 + getattr(signal, "compliance", 0.0) * 120.0)
    fit = bench.predicted(effects, {"ankle.spring_stiffness": whole})
    ankle = next(e for e in bench.links if bench.data.equations[e].joint == "ankle")
    assert bench.stiffness_of(fit)[ankle] == pytest.approx(120.0, rel=1e-6)
    assert fit.scale[ankle] == pytest.approx(bench.first_stiffness[ankle] / 120.0, rel=1e-6)


def test_a_model_as_it_is_has_the_scale_that_its_fit_has(nothing_missing):
    bench, now = nothing_missing
    fit = now.fit
    np.testing.assert_allclose(bench.predicted(fit.effects, fit.parameters).scale, fit.scale, rtol=1e-12)


@pytest.mark.parametrize("less", ["a mass", "a mass that has a moment", "a rotor"])
def test_bodies_without_mass_and_rotors_without_inertia(nothing_missing, less):
    bench, now = nothing_missing
    robot, parameters = bench.robot, now.fit.parameters
    body, rotor = robot.inertial_names[10].removesuffix(".m"), f"{robot.rotors[0].rotor_group}.rotor_inertia"
    zero = {
        "a mass": [f"{body}.{part}" for part in ("m", "mx", "my", "mz")],
        "a mass that has a moment": [f"{body}.m"],
        "a rotor": [rotor],
    }[less]
    waves = (make_effect("encoder_eccentricity", "knee", sine=size, cosine=size) for size in (-1e-4, 1e-4))
    ends = [corrected_motion(robot, (wave,), bench.data.motion) for wave in waves]
    rest, own, whole = (
        bench._bodies_tangent(bench.state(()), *ends, known)
        for known in (
            {**parameters, **dict.fromkeys(zero, 0.0)},
            {name: parameters[name] for name in zero},
            parameters,
        )
    )
    # the torque is linear in these parameters, however each of the three is computed
    assert np.abs(own).max() > 0.0
    np.testing.assert_allclose(rest + own, whole, atol=1e-10 * np.abs(whole).max())


def test_bodies_that_have_together_less_than_no_mass(nothing_missing):
    """A fit of what lacks much may say so; the torque is linear in a mass all the same."""
    bench, now = nothing_missing
    robot, parameters = bench.robot, now.fit.parameters
    name = robot.inertial_names[10]
    waves = (make_effect("encoder_eccentricity", "knee", sine=size, cosine=size) for size in (-1e-4, 1e-4))
    ends = [corrected_motion(robot, (wave,), bench.data.motion) for wave in waves]
    known = ({name: 1.0}, parameters, {**parameters, name: parameters[name] - 100.0})
    of_one, whole, without = (bench._bodies_tangent(bench.state(()), *ends, each) for each in known)
    np.testing.assert_allclose(without, whole - 100.0 * of_one, atol=1e-10 * np.abs(100.0 * of_one).max())


def test_a_motion_without_torques_has_residuals_of_no_scale(nothing_missing):
    bench, now = nothing_missing
    data = replace(bench.data, tau_motor=np.zeros_like(bench.data.tau_motor))
    fit = Bench(data, bench.effects).predicted(now.fit.effects, now.fit.parameters)
    np.testing.assert_array_equal(fit.scale, 1.0)
    assert np.all(np.isfinite(fit.residual))
