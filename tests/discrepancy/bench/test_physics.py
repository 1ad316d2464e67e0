"""What physics allows of an effect in a fit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from sea_ident.discrepancy.bench.judge import own_torque
from sea_ident.discrepancy.bench.physics import (
    LARGEST_OF_A_SENSOR,
    LARGEST_TIMES_TORQUE,
    WRONG_PART,
    bends_another,
    builds_up,
    dissipates,
    physical,
    possible,
    pushes_back,
)
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.effects import make_effect


@pytest.mark.parametrize("element", [0, 1])
@pytest.mark.parametrize("share", [0.1, 0.3, 0.6])
def test_a_spring_with_dry_friction_is_one_where_it_takes_energy_out(nothing_missing, element, share):
    bench, start = nothing_missing
    motion, hip = bench.data.motion, bench.robot.index("hip")
    effect = make_effect("spring_hysteresis", "hip", slip=share * float(np.ptp(motion.deflection[:, hip])))
    torque = effect.evaluate(bench.state(start.fit.effects)).motor[:, hip, element]
    speed = (motion.dtheta - motion.dq)[:, hip]
    # elastic torque takes nothing, but for the rounding of a sum over samples
    taken = float(np.mean(torque * speed)) / float(np.mean(np.abs(speed)))
    assert dissipates(bench, effect, np.eye(2)[element]) == (taken > 0.01)


@pytest.mark.parametrize(("stiffer", "always"), [(1.0, True), (3.0, False)])
@pytest.mark.parametrize(("times", "possible_one"), [(0.9, True), (1.1, False)])
@pytest.mark.parametrize(
    ("name", "amount", "zero"), [("encoder_offset", "offset", True), ("encoder_eccentricity", "sine", False)]
)
def test_an_error_of_an_encoder_does_not_change_the_torque_by_many_times_what_there_is(
    nothing_missing, name, amount, zero, times, possible_one, stiffer, always
):
    """It does where a spring hardly moves, and its stiffness comes out as anything: then it explains whatever is.

    The zero of an encoder may be off by anything where the spring is about the one that is described.
    """
    bench, start = nothing_missing
    parameters = {**start.fit.parameters, "hip.spring_stiffness": stiffer * bench.robot.spring("hip").stiffness}

    def with_error(size):
        effects = (*start.fit.effects, make_effect(name, "hip", **{amount: size}))
        return bench.predicted(effects, parameters)

    size = times * LARGEST_OF_A_SENSOR
    error = brentq(lambda value: own_torque(bench, with_error(value), -1) - size, 1e-3, 10.0)
    assert physical(bench, with_error(error), -1) == (possible_one or (zero and always))


def test_a_spring_that_takes_next_to_no_energy_out_is_not_accepted(nothing_missing):
    bench, start = nothing_missing
    # the first element slips to and fro, the second does not
    effect = make_effect("spring_hysteresis", "hip", slip=0.3 * float(np.ptp(bench.data.motion.deflection[:, 0])))
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    for narrow, accepted in ((0.05, False), (0.3, True)):
        values = fit.values.copy()
        values[-2:] = narrow, 1.0
        assert physical(bench, replace(fit, values=values), -1) == accepted
    assert dissipates(bench, make_effect("torque_offset", "hip"), np.ones(1))


@pytest.mark.parametrize(
    ("share", "wide", "accepted"),
    [
        (0.3, -0.3, True),  # sticks all the time: a part of the elastic law, which it makes a little softer
        (0.3, -9.0, False),  # by more than its stiffness is worth
        (0.1, -0.3, False),  # slips, and would give energy
    ],
)
def test_dry_friction_in_a_spring_has_no_sign_where_it_sticks(nothing_missing, share, wide, accepted):
    bench, start = nothing_missing
    effect = make_effect("spring_hysteresis", "hip", slip=share * float(np.ptp(bench.data.motion.deflection[:, 0])))
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    values = fit.values.copy()
    values[-2:] = 1.5, wide
    assert physical(bench, replace(fit, values=values), -1) == accepted


@pytest.mark.parametrize("exponent", [1.0, 1.1, 2.0])
def test_a_spring_with_two_sides_is_stiff_to_either_side(nothing_missing, exponent):
    bench, start = nothing_missing
    effect = make_effect("asymmetric_spring", "knee", exponent=exponent, kink=0.002)
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    names = [c.name for c in fit.columns]
    law = [names.index(f"knee.{name}") for name in ("spring_stiffness", "spring_stiffening", "asymmetric_spring")]
    # the limit by the torque itself: it must grow with the deflection
    farthest = float(np.max(np.abs(bench.data.motion.deflection[:, 1])))
    d = np.linspace(-farthest, farthest, 2001)
    rows = np.stack([d, d**3, np.abs(d - effect.kink) ** exponent - effect.kink**exponent], axis=1)
    seen = set()
    for amount in (-9000.0, -900.0, -250.0, -50.0, 0.0, 50.0, 250.0, 900.0, 9000.0):
        values = fit.values.copy()
        values[law[-1]] = amount
        grows = bool(np.all(np.diff(rows @ values[law]) > 0.0))
        assert pushes_back(bench, replace(fit, values=values), -1) == grows, amount
        seen.add(grows)
    assert seen == {True, False}


@pytest.mark.parametrize(("exponent", "accepted"), [(0.3, False), (0.5, True), (3.0, True)])
def test_friction_that_hardly_grows_with_the_speed_is_none_of_its_own(nothing_missing, exponent, accepted):
    """Wherever it ends beside what came after it: it is dry friction by another name."""
    bench, start = nothing_missing
    effect = make_effect("nonlinear_viscous_friction", "knee", exponent=exponent)
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    values = fit.values.copy()
    values[-1] = 0.1
    values[[c.name for c in fit.columns].index("knee.coulomb_friction")] = 1.0
    assert physical(bench, replace(fit, values=values), -1) == accepted


@pytest.mark.parametrize("exponent", [2.0, 5.0])
def test_a_spring_of_another_power_is_stiff_however_its_terms_cancel(nothing_missing, exponent):
    """Only the whole law is a torque: a term of it may be larger than all torque there is, beside another as large."""
    bench, start = nothing_missing
    effect = make_effect("spring_stiffening", "knee", exponent=exponent)
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    names = [c.name for c in fit.columns]
    terms = ("spring_stiffness", "spring_stiffening", "spring_stiffening_power")
    law = [names.index(f"knee.{name}") for name in terms]
    farthest = float(np.max(np.abs(bench.data.motion.deflection[:, 1])))
    d = np.linspace(0.0, farthest, 2001)[1:]
    rows = np.stack([d, d**3, d**exponent], axis=1)
    seen = set()
    for stiffness in (50.0, 2000.0):
        for share in (-1.0, -0.6, -0.1, 0.1, 2.0):
            values = fit.values.copy()
            # its torque where the spring is bent most, as a share of that of the linear term
            values[law] = stiffness, 0.0, share * stiffness * farthest ** (1.0 - exponent)
            grows = bool(np.all(np.diff(rows @ values[law]) > 0.0))
            law_of = replace(fit, values=values)
            assert pushes_back(bench, law_of, -1) == grows
            assert physical(bench, law_of, -1) == grows
            seen.add(grows)
    assert seen == {True, False}


@pytest.mark.parametrize("name", ["stribeck_friction", "nonlinear_viscous_friction"])
def test_friction_of_another_law_leaves_dry_friction_that_brakes(nothing_missing, name):
    bench, start = nothing_missing
    effect = make_effect(name, "knee")
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    names = [c.name for c in fit.columns]
    largest = float(np.max(np.abs(effect.evaluate(bench.state(fit.effects)).motor)))
    for dry, accepted in ((0.5, True), (-0.05, True), (-0.5, False)):
        values = fit.values.copy()
        values[names.index("knee.coulomb_friction")] = dry
        values[names.index(f"knee.{name}")] = 1.0 / largest
        assert physical(bench, replace(fit, values=values), -1) == accepted


@pytest.mark.parametrize(("viscous", "accepted"), [(-0.9, True), (-1.3, False)])
def test_a_power_of_the_speed_may_be_larger_than_all_torque_beside_viscous_friction_that_it_cancels(
    nothing_missing, viscous, accepted
):
    """As long as both together brake at every speed: ten times the torque here, of which a tenth is left, or less."""
    bench, start = nothing_missing
    effect = make_effect("nonlinear_viscous_friction", "knee", exponent=0.8)
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    names, i = [c.name for c in fit.columns], bench.robot.index("knee")
    fastest = float(np.max(np.abs(bench.data.motion.dtheta[:, i])))
    size = 10.0 * float(np.max(np.abs(bench.data.tau_motor[:, i])))
    values = fit.values.copy()
    values[names.index("knee.coulomb_friction")] = 0.0
    values[names.index("knee.nonlinear_viscous_friction")] = size / fastest**0.8
    values[names.index("knee.viscous_friction")] = viscous * size / fastest
    law = replace(fit, values=values)
    assert own_torque(bench, law, -1) > LARGEST_TIMES_TORQUE
    assert physical(bench, law, -1) == accepted


@pytest.mark.parametrize(("share", "accepted"), [(0.05, False), (0.3, True), (1.0, True), (1.8, True), (8.0, False)])
def test_friction_that_builds_up_is_about_the_dry_friction_that_it_replaces(nothing_missing, share, accepted):
    bench, start = nothing_missing
    effect = make_effect("presliding_friction", "knee", displacement=0.002)
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    values = fit.values.copy()
    values[-1] = share * fit.parameters["knee.coulomb_friction"]
    assert physical(bench, replace(fit, values=values), -1) == accepted
    # where the model has no dry friction there is nothing to hold it against
    kept = [k for k, c in enumerate(fit.columns) if c.name != "knee.coulomb_friction"]
    effects = tuple(e for e in fit.effects if (e.name, e.joint) != ("coulomb_friction", "knee"))
    columns = tuple(fit.columns[k] for k in kept)
    assert builds_up(replace(fit, effects=effects, columns=columns, values=values[kept]), len(effects) - 1)


def test_of_two_frictions_over_one_speed_none_without_an_amount_is_its_own(nothing_missing):
    bench, start = nothing_missing
    stribeck, viscous = make_effect("stribeck_friction", "knee"), make_effect("nonlinear_viscous_friction", "knee")
    other = make_effect("nonlinear_viscous_friction", "hip")

    def bent(*effects):
        fit = bench.fit((*start.fit.effects, *effects), start.noise, start=start.fit.parameters)
        return [bends_another(bench, fit, k - len(effects)) for k in range(len(effects))]

    assert bent(stribeck, viscous) == [True, True]
    assert bent(stribeck, other) == [False, False]
    assert bent(stribeck) == [False]
    assert bent(viscous, make_effect("torque_offset", "knee")) == [False, False]


@pytest.mark.scenario
@pytest.mark.parametrize(("orders", "bends"), [((20.0, 20.4), True), ((5.0, 20.0), False)])
def test_of_two_waves_of_nearly_the_same_length_none_is_its_own(laboratory, orders, bends):
    """A wave that grows and fades along the way is no sum of two that are there all the way."""
    amount = [[1.0, 0.0], [-0.95, 0.0]]
    planted = [("torque_ripple", "hip", own, {"order": order}) for own, order in zip(amount, orders, strict=True)]
    bench = laboratory.bench(laboratory.record(planted))
    start = settle(bench, bench.effects)
    waves = [replace(make_effect("torque_ripple", "hip", order=o), number=k + 1) for k, o in enumerate(orders)]
    model = (*start.fit.effects, *waves)
    fit = bench.refine(model, start.noise, start=start.fit.parameters, only=len(bench.effects))
    assert [bends_another(bench, fit, k) for k in (-2, -1)] == [bends, bends]
    alone = bench.fit((*start.fit.effects, waves[0]), start.noise, start=start.fit.parameters)
    assert not bends_another(bench, alone, -1)


@pytest.mark.scenario
def test_two_frictions_that_are_there_have_their_amounts(laboratory):
    laws = [("stribeck_friction", "knee", [5.0], {"speed": 0.1}), ("nonlinear_viscous_friction", "knee", [9.0], {})]
    bench = laboratory.bench(laboratory.record(laws, periods=24))
    effects = [make_effect(name, joint, **shape) for name, joint, _, shape in laws]
    start = settle(bench, bench.effects)
    fit = bench.refine((*start.fit.effects, *effects), start.noise, start=start.fit.parameters, only=len(bench.effects))
    assert [bends_another(bench, fit, k) for k in (-2, -1)] == [False, False]


@pytest.mark.scenario
def test_a_small_part_of_the_wrong_sign_is_excused_while_others_are_missing(laboratory):
    """By what holding it at zero would cost, as a share of what the whole effect explains."""
    bench = laboratory.bench(laboratory.record([("link_friction", "knee", [0.0, 0.2], {})], periods=5))
    start = settle(bench, bench.effects)
    friction = make_effect("link_friction", "knee")
    fit = bench.fit((*start.fit.effects, friction), start.noise, start=start.fit.parameters)
    less = bench.fit(start.fit.effects, start.noise, start=fit.parameters, tangents=False)
    viscous = [c.name for c in fit.columns].index("knee.link_friction_viscous")
    for share, accepted in ((0.5, True), (2.0, False)):
        cost = share * WRONG_PART * (less.statistic - fit.statistic)
        values = fit.values.copy()
        values[viscous] = -np.sqrt(cost) * fit.std(viscous)
        bent = replace(fit, values=values)
        assert not physical(bench, bent, -1)
        assert possible(bench, bent, start.noise, -1) is accepted
    assert possible(bench, fit, start.noise, -1)


@pytest.mark.scenario
@pytest.mark.parametrize(("times", "accepted"), [(0.9, True), (1.1, False)])
def test_no_effect_is_much_larger_than_what_is_there_and_what_the_bodies_weigh(prosthesis, times, accepted):
    """A constant torque that bears the leg leaves its motor hardly any."""
    bench = prosthesis.bench(prosthesis.record([("torque_offset", "knee", [3.0], {})], periods=10))
    knee = next(k for k, equation in enumerate(bench.data.equations) if equation.joint == "knee")
    weight = bench.described_rms[knee]
    assert weight > 4.0 * bench.torque_rms[knee]
    effects = (*bench.effects, make_effect("torque_offset", "knee"))
    first = bench.first_fit
    offset = {"knee.torque_offset": times * LARGEST_TIMES_TORQUE * weight}
    assert physical(bench, bench.predicted(effects, {**first.parameters, **offset}), -1) == accepted
