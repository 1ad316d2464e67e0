"""What else an effect could be: what gives the same torque is declared, what does not is not, however it is written."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import sea_ident
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD, penalty, torque_changes
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.compared.decide import decide, declared, simplest_first
from sea_ident.discrepancy.compared.heldout import tried
from sea_ident.discrepancy.compared.transfer import transfer
from sea_ident.discrepancy.evidence.assess import _size_for, _without, detectability, no_worse, rivals
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.discrepancy.result.findings import Alternative
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.next_effect import SCATTER_LEVEL
from sea_ident.discrepancy.search.search import Selection, search
from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.motion import FourierSeries
from sea_ident.simulation import PlantedEffect, Settling, simulate

OFFSETS = [("spring_offset", "hip", [-1.2], {}), ("spring_offset", "knee", [-0.4], {})]
"""As much as the play of 2 mrad would take from the spring of the hip, whose deflection keeps its sign in both motions;
that of the knee passes zero."""


@pytest.fixture(scope="module")
def preloaded(laboratory):
    """A leg with loaded springs on the bench, what its model lacks, and another motion of it."""
    bench = laboratory.bench(laboratory.record(OFFSETS, periods=8, settling=Settling()))
    other = Bench(laboratory.data(laboratory.record(OFFSETS, periods=4, seed=9, motion=1)), bench.effects)
    start = settle(bench, bench.effects)
    effects = (*start.fit.effects, *(make_effect(name, joint) for name, joint, _, _ in OFFSETS))
    final = settle_again(bench, bench.fit(effects, start.noise, start=start.fit.parameters))
    return bench, other, Selection(start, final, 2, (1e-9, 1e-9))


def written_as(preloaded, effect):
    """The model with the offset of the hip written as another effect."""
    bench, _, selection = preloaded
    final, first = selection.final, len(selection.start.fit.effects)
    effects = list(final.fit.effects)
    effects[first] = effect
    return bench.fit(effects, final.noise, start=final.fit.parameters)


SAME_TORQUE = [
    make_effect("backlash", "hip", half_width=0.0011),
    make_effect("asymmetric_spring", "hip", kink=0.001),
    make_effect("asymmetric_spring", "hip", kink=0.003),
]


@pytest.mark.scenario
def test_what_is_a_little_behind_is_kept_for_another_motion_and_declared_by_none(preloaded, monkeypatch):
    bench, _, selection = preloaded
    first = len(selection.start.fit.effects)

    def others(odds):
        monkeypatch.setattr("sea_ident.discrepancy.evidence.assess.EQUALLY_GOOD", odds)
        return {(a.effect, a.joint): a for a in rivals(bench, selection)[first + 1]}

    final = selection.final.fit
    alike = others(1e3)
    worse = {
        key: each.fit.statistic - final.statistic
        + final.unit * max(penalty(each.fit.effects[first + 1], bench) - penalty(final.effects[first + 1], bench), 0.0)
        for key, each in alike.items()
        if each.as_likely and each.fit.statistic > final.statistic + 10.0 * final.unit
    }  # fmt: skip
    key = max(worse, key=worse.get)
    odds = 0.75 * worse[key] / final.unit
    behind = others(odds)[key]
    assert behind.behind == pytest.approx(worse[key], rel=0.05)
    assert not behind.as_likely
    assert key not in {(a.effect, a.joint) for a in declared({0: tuple(others(odds).values())})[0]}
    assert key not in others(0.4 * worse[key] / final.unit)


@pytest.mark.scenario
def test_a_kink_never_passed_is_declared_beside_an_offset_and_play_before_a_stiffening_spring_is_not(
    preloaded,
):
    bench, _, selection = preloaded
    first = len(selection.start.fit.effects)
    found = declared(rivals(bench, selection))
    hip, knee = ({a.effect for a in found[position] if a.joint == joint} for position, joint in
                 ((first, "hip"), (first + 1, "knee")))  # fmt: skip
    assert "asymmetric_spring" in hip
    assert "backlash" not in hip
    assert not {"backlash", "asymmetric_spring"} & knee


@pytest.mark.scenario
@pytest.mark.parametrize(
    "planted",
    [("spring_offset", "hip", [-1.2], {}), ("backlash", "hip", [600.0], {"half_width": 0.002, "softness": 0.05})],
    ids=lambda planted: planted[0],
)
def test_play_that_a_nearly_straight_spring_never_closes_is_an_offset_and_declared_beside_it(laboratory, planted):
    nearly_straight = ("spring_stiffening", "hip", [-13000.0], {"exponent": 3.0})
    bench = laboratory.bench(laboratory.record([planted, nearly_straight], periods=8, settling=Settling()))
    start = settle(bench, bench.effects)
    effects = (*start.fit.effects, make_effect("spring_offset", "hip"))
    final = settle_again(bench, bench.fit(effects, start.noise, start=start.fit.parameters))
    assert final.fit.statistic < 1.2 * final.fit.dof
    found = declared(rivals(bench, Selection(start, final, 1, (1e-9,))))[len(start.fit.effects)]
    play = next(a for a in found if a.effect == "backlash" and a.joint == "hip")
    width, amount = play.fit.effects[-1].half_width, play.fit.parameters["hip.backlash"]
    assert width * amount == pytest.approx(1.2, rel=0.1)


@pytest.mark.scenario
def test_a_spring_that_stiffens_by_any_power_is_declared_beside_one_with_two_sides(laboratory):
    """Bent to one side only, both give the same torque; held to the square, the one that is there looks worse."""
    planted = [("spring_stiffening", "hip", [-2500.0], {"exponent": 1.9})]
    bench = laboratory.bench(laboratory.record(planted, periods=6))
    deflection = bench.data.motion.deflection[:, 0]
    assert np.all(deflection > 0.0) or np.all(deflection < 0.0)
    start = settle(bench, bench.effects)
    effects = (*start.fit.effects, make_effect("asymmetric_spring", "hip", exponent=2.0))
    asymmetric = bench.refine(effects, start.noise, start=start.fit.parameters, only=len(start.fit.effects))
    final = settle_again(bench, asymmetric)
    found = declared(rivals(bench, Selection(start, final, 1, (1e-9,))))[len(start.fit.effects)]
    stiffening = next(a for a in found if (a.effect, a.joint) == ("spring_stiffening", "hip"))
    assert stiffening.fit.effects[-1].exponent == pytest.approx(1.9, abs=0.05)
    assert stiffening.fit.statistic == pytest.approx(final.fit.statistic, rel=1e-3)


@pytest.mark.scenario
def test_what_others_could_take_up_is_looked_for_without_what_they_hold_of_it(laboratory, rippled):
    """A play that never closes beside a slip that was found with it: its size is open, the slip hides what it is."""
    planted = [
        ("encoder_offset", "hip", [], {"offset": 0.002}),
        ("spring_hysteresis", "hip", [0.0, 0.07], {"slip": 0.004}),
    ]
    bench = laboratory.bench(laboratory.record(planted, periods=8))
    start, first = settle(bench, bench.effects), len(bench.effects)
    added = make_effect("backlash", "hip", half_width=0.0013), make_effect("spring_hysteresis", "hip", slip=0.004)
    model = (*start.fit.effects, *added)
    now = settle_again(bench, bench.refine(model, start.noise, start=start.fit.parameters, only=first))
    held, found = (how(bench, now, first) for how in (held_without, _without))
    assert found.statistic < held.statistic - 1e3
    assert found.effects[-1].slip != now.fit.effects[-1].slip
    others = {other.effect: other for other in rivals(bench, Selection(start, now, 2, (1e-9, 1e-9)))[first]}
    assert others["encoder_offset"].fit.effects[first].offset == pytest.approx(0.002, rel=0.05)
    # so little of the link's zero is as well one of the motor's
    assert others.keys() <= {"encoder_offset", "motor_encoder_offset"}
    # an effect whose size is known is told by what is left as it is
    bench, _, now = rippled
    last = len(now.fit.effects) - 1
    assert _without(bench, now, last).statistic == held_without(bench, now, last).statistic


def held_without(bench, now, position):
    """The model without an effect, the shapes of all others held."""
    others = [effect for k, effect in enumerate(now.fit.effects) if k != position]
    return bench.fit(others, now.noise, start=now.fit.parameters)


@pytest.mark.scenario
def test_what_the_model_takes_up_but_for_a_trace_elsewhere_is_an_alternative():
    """A force on a vertical slide is its weight; a mass too large shows before it, as a coupling of its rotor."""
    robot = sea_ident.load_robot(Path(__file__).parents[1] / "scara.urdf")
    a = [[0.76, 0.29, 1.84, -0.55, 0.13], [1.17, 0.32, 2.13, -0.66, 0.37],
         [-0.02, 0.06, -0.01, -0.14, -0.37], [-1.12, -1.63, 3.04, -3.66, 0.76]]  # fmt: skip
    b = [[0.18, -1.31, -1.11, 0.13, 0.36], [0.54, -2.18, -1.84, 0.51, 0.54],
         [0.01, 0.03, -0.11, 0.09, -0.17], [0.05, -3.48, -4.82, 0.02, 1.09]]  # fmt: skip
    series = FourierSeries(0.2, np.array([0.01, 0.15, -0.05, 0.39]), np.array(a), np.array(b))
    force = PlantedEffect(make_effect("torque_offset", "j3"), np.array([5.0]))
    recording = simulate(robot, series, periods=12, seed=3, effects=[force]).recording
    effects = (*base_effects(robot), *spring_effects(robot))
    bench = Bench(period_data(wide_processing(recording, robot, 5.0), robot), effects)
    start = settle(bench, bench.effects)
    coupling = make_effect("rotor_coupling", "j3")
    final = settle_again(bench, bench.fit((*start.fit.effects, coupling), start.noise, start=start.fit.parameters))
    assert final.fit.statistic < 1.1 * final.fit.dof < start.fit.statistic - 10.0 * EQUALLY_GOOD
    found = declared(rivals(bench, Selection(start, final, 1, (1e-9,))))[len(start.fit.effects)]
    assert ("torque_offset", "j3") in {(a.effect, a.joint) for a in found}


@pytest.mark.scenario
def test_what_is_shorter_than_is_compared_is_no_rival(preloaded, monkeypatch):
    """As a push that never pauses, which is a constant by the name of a push."""
    bench, _, selection = preloaded
    asked = []

    def short(where, effect):
        asked.append(where)
        return effect.name == "asymmetric_spring"

    monkeypatch.setattr("sea_ident.discrepancy.evidence.assess.too_short", short)
    found = declared(rivals(bench, selection))
    assert asked
    assert "asymmetric_spring" not in {a.effect for others in found.values() for a in others}


@pytest.mark.scenario
@pytest.mark.parametrize("effect", SAME_TORQUE, ids=lambda e: f"{e.name} {getattr(e, 'kink', '')}")
def test_a_transfer_is_the_same_however_the_same_torque_is_written(preloaded, effect):
    """A kink takes a part of the stiffness along: that part is there too where the effect is held."""
    _, other, selection = preloaded
    fit = written_as(preloaded, effect)
    assert fit.statistic == pytest.approx(selection.final.fit.statistic, rel=1e-3)
    found = []
    for each in (selection.final.fit, fit):
        now = settle_again(other, other.predicted(each.effects, each.parameters))
        found.append(transfer(other, replace(selection, final=Settled(each, selection.final.noise)), now)[0])
    assert found[1].statistic == pytest.approx(found[0].statistic, rel=2e-3)
    assert found[1].holds


@pytest.mark.scenario
def test_a_width_that_the_motion_leaves_open_is_no_reason_to_rule_play_out(preloaded):
    bench, other, selection = preloaded
    first = len(selection.start.fit.effects)
    wide = written_as(preloaded, make_effect("backlash", "hip", half_width=0.007))
    listed = {first: (Alternative("backlash", "hip", 1.0, wide),), first + 1: ()}
    held = tried(other, selection, "another motion")
    as_found = tried(other, replace(selection, final=Settled(wide, selection.final.noise)), "another motion")
    assert as_found.transfers[0].statistic > held.transfers[0].statistic + 50.0
    chosen, left, _ = decide(bench, selection, listed, held)
    assert chosen.effects[0].name == "spring_offset"
    assert [a.effect for a in left[first]] == ["backlash"]
    width = left[first][0].fit.effects[first].half_width
    assert width < np.min(other.data.motion.deflection[:, 0]) * 1.5


@pytest.mark.scenario
def test_of_equals_the_simplest_is_named(preloaded):
    bench, _, selection = preloaded
    first = len(selection.start.fit.effects)
    fit = written_as(preloaded, SAME_TORQUE[1])
    kinked = replace(selection, final=Settled(fit, selection.final.noise))
    listed = {first: (Alternative("spring_offset", "hip", 1.0, selection.final.fit),), first + 1: ()}
    chosen, left = simplest_first(bench, kinked, listed)
    assert [e.name for e in chosen.effects] == ["spring_offset", "spring_offset"]
    assert [(a.effect, a.joint) for a in left[first]] == [("asymmetric_spring", "hip")]
    again, same = simplest_first(bench, chosen, left)
    assert again is chosen
    assert same == left
    # what does not do as well is no equal, however simple
    simple, *_ = listed[first]
    worse = {first: (replace(simple, behind=20.0),), first + 1: ()}
    assert simplest_first(bench, kinked, worse)[0] is kinked


@pytest.mark.scenario
def test_more_parameters_are_no_alternative_unless_another_motion_asks_for_them(preloaded):
    bench, other, selection = preloaded
    first = len(selection.start.fit.effects)
    fit = written_as(preloaded, SAME_TORQUE[0])
    listed = {first: (Alternative("backlash", "hip", 1.0, fit, dearer=True),), first + 1: ()}
    assert declared(listed) == {first: (), first + 1: ()}
    _, left, _ = decide(bench, selection, listed, tried(other, selection, "another motion"))
    assert left[first] == ()


@pytest.mark.scenario
def test_a_shape_that_the_first_motion_leaves_open_is_taken_as_the_other_has_it(preloaded):
    bench, other, selection = preloaded
    first = len(selection.start.fit.effects)
    own = written_as(preloaded, make_effect("backlash", "hip", half_width=0.007))
    wide = replace(selection, final=Settled(own, selection.final.noise))
    before = tried(other, wide, "another motion")
    chosen, _, held = decide(bench, wide, {first: (), first + 1: ()}, before)
    assert chosen.effects[0].half_width < 0.005
    assert held.transfers[0].statistic < before.transfers[0].statistic - 50.0


@pytest.mark.parametrize(
    ("statistic", "gain", "difference"),
    [
        (600.0, 1e5, 13.8),  # right: the odds of a thousand
        (1200.0, 1e5, 2 * 13.8),  # nearly right: in units of what is left
        (3600.0, 1e6, 0.5 * 3000.0),  # nearly all, in a form that is not right: half of what it leaves
        (3600.0, 1e4, 6 * 13.8),  # not nearly all: nothing is said of its form
    ],
)
def test_where_no_form_is_right_what_leaves_little_more_is_no_worse(statistic, gain, difference):
    fit = SimpleNamespace(statistic=statistic, unit=statistic / 600, excess=max(statistic - 600.0, 0.0))
    assert no_worse(fit, gain) == pytest.approx(difference)


@pytest.mark.parametrize("freedom", [5.0, 14.0])
def test_a_size_for_the_scatter_stands_out_of_it_nineteen_times_out_of_twenty(freedom):
    """The scatter is an estimate, too: of few periods often too large."""
    draws, rng = 20_000, np.random.default_rng(0)
    told = (_size_for(freedom) + rng.standard_normal(draws)) / np.sqrt(rng.chisquare(freedom, draws) / freedom)
    share = np.mean(told > stats.t.isf(SCATTER_LEVEL / 2.0, freedom))
    assert share == pytest.approx(0.95, abs=4.0 * np.sqrt(0.95 * 0.05 / draws))


def smallest_offset(bench, joint):
    """The smallest constant torque of a motor that is said to be found."""
    start = settle(bench, bench.effects)
    found = detectability(bench, start.fit, start.noise, scan(bench, start.fit, start.noise), (bench, start))
    return next(d.smallest for d in found if (d.effect, d.joint) == ("torque_offset", joint))


def with_offset(data, joint, size):
    """The same passes with a constant more of the torque of a motor."""
    torque, mean, where = data.period_tau_motor.copy(), data.tau_motor.copy(), data.robot.index(joint)
    torque[:, :, where] += size
    mean[:, where] += size
    return replace(data, period_tau_motor=torque, tau_motor=mean)


def test_the_smallest_size_matters_to_the_torque(laboratory, jittery, monkeypatch):
    """What the model leaves of it at its joint is the share of the torque that is asked for."""
    monkeypatch.setattr("sea_ident.discrepancy.evidence.assess.SMALLEST_SHARE", 0.05)
    size = smallest_offset(Bench(jittery, laboratory.effects), "hip")
    bench = Bench(with_offset(jittery, "hip", size), laboratory.effects)
    before = settle(bench, bench.effects)
    effects = (*before.fit.effects, make_effect("torque_offset", "hip"))
    after = bench.fit(effects, before.noise, start=before.fit.parameters)
    own = [equation.joint == "hip" for equation in jittery.equations]
    # the noise moves the value that is found, and its floor is estimated anew
    share = np.max(torque_changes(bench, before.fit, after)[own]) * size / after.values[-1]
    assert share == pytest.approx(0.05, rel=0.1)


@pytest.mark.scenario
@pytest.mark.parametrize("joint", ["hip", "knee", "ankle"])
def test_an_effect_is_found_about_the_smallest_size_and_not_far_below(laboratory, jittery, joint):
    """Friction that differs from pass to pass: its scatter asks for more than the noise floor does."""
    smallest = smallest_offset(Bench(jittery, laboratory.effects), joint)

    def named(times):
        bench = Bench(with_offset(jittery, joint, times * smallest), laboratory.effects)
        return [effect.joint for effect in search(bench, bench.effects).effects]

    assert named(1.5) == [joint]
    assert named(0.3) == []


@pytest.mark.scenario
def test_a_constant_is_not_taken_for_a_spring_whose_stiffness_the_data_do_not_ask_for():
    """A rigid joint feels a spring across it as the same constant, with a column more: no motion would tell them."""
    robot = sea_ident.robot.robot_from_text(
        '<robot name="turntable"><link name="base"/><link name="table"><inertial><origin xyz="0.03 0.01 0"/>'
        '<mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="pan" type="continuous"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/></joint>'
        '<transmission name="t" type="transmission_interface/SimpleTransmission"><joint name="pan"/><actuator name="m">'
        "<mechanicalReduction>20</mechanicalReduction><rotorInertia>1e-5</rotorInertia>"
        "<viscousFriction>0.1</viscousFriction><coulombFriction>0.2</coulombFriction></actuator></transmission></robot>",
        "turntable.urdf",
    )
    series = FourierSeries(0.2, np.zeros(1), np.array([[0.3, -0.5, 0.2, 0.4]]), np.array([[-0.4, 0.3, 0.5, -0.2]]))

    def found(stiffness, own, seed):
        spring = PlantedEffect(make_effect("parallel_spring", "pan"), np.array([stiffness, 0.15]))
        recording = simulate(robot, series, periods=8, seed=seed, effects=[spring]).recording
        bench = Bench(period_data(wide_processing(recording, robot, 5.0), robot), base_effects(robot))
        start = settle(bench, bench.effects)
        named = make_effect(own, "pan")
        final = settle_again(bench, bench.fit((*start.fit.effects, named), start.noise, start=start.fit.parameters))
        others = rivals(bench, Selection(start, final, 1, (1e-9,)))[len(start.fit.effects)]
        return {a.effect for a in others}

    assert "parallel_spring" not in found(0.0, "torque_offset", 1)
    # where there is a stiffness, the constant alone is behind
    assert "torque_offset" not in found(0.2, "parallel_spring", 1)
