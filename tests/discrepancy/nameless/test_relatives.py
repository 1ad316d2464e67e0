"""Effects that the library does not have, but one that is nearly the same.

Their torque is added to that of a leg that has nothing but what the model has, on its motion as it was measured.
"""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy import Verdict
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.conclude import conclude
from sea_ident.discrepancy.measured.check import Findings
from sea_ident.discrepancy.nameless.relatives import Growth, relatives_of
from sea_ident.discrepancy.nameless.unnamed import unnamed
from sea_ident.discrepancy.search.confirm import Confirmed
from sea_ident.discrepancy.search.search import Selection
from sea_ident.discrepancy.trends.trend import TrendTest
from sea_ident.effects import Effect, make_effect

HIP, KNEE, ANKLE = range(3)


def with_torque(bench: Bench, *torques: tuple[int, np.ndarray]) -> Bench:
    """The same motion with more torque (N,) of some motors."""
    total = bench.data.tau_motor.copy()
    for joint, torque in torques:
        total[:, joint] += torque
    return Bench(replace(bench.data, tau_motor=total), bench.effects)


def found(bench: Bench, *effects: Effect) -> Selection:
    """What a search would give that found these."""
    start = settle(bench, bench.effects)
    begun = bench.anchored((*start.fit.effects, *effects), start.fit.parameters)
    fit = bench.refine(begun, start.noise, start=start.fit.parameters, only=len(bench.effects))
    final = settle_again(bench, settle_again(bench, fit).fit)
    return Selection(start, final, len(effects), (0.0,) * len(effects))


@pytest.fixture(scope="module")
def ripple_found(laboratory):
    """A ripple at the hip that grows with the deflection, found as a ripple, and what that is held against.

    What the ripple leaves is far from noise, by 16 periods, and less than a hundredth of the torque.
    """
    bench = laboratory.bench(laboratory.record(periods=16))
    motion = bench.data.motion
    torque = 18.0 * motion.deflection[:, HIP] * np.sin(12.0 * motion.theta[:, HIP])
    bench = with_torque(bench, (HIP, torque))
    selection = found(bench, make_effect("torque_ripple", "hip", order=12.5))
    return bench, selection, *unnamed(bench, selection, None)


@pytest.mark.scenario
def test_a_ripple_that_grows_with_the_load_is_not_a_ripple(ripple_found):
    bench, selection, one = ripple_found
    assert (one.effect, one.joint, one.relative) == ("torque_ripple", "hip", "growing with the load")
    assert one.share < 0.2
    # it has the order that was planted, and the amplitude
    fit = bench.again(one.solution, selection.final.noise)
    relative = fit.effects[-1]
    assert relative.order == pytest.approx(12.0, abs=0.5)
    amplitude = np.hypot(*(fit.parameters[c.name] for c in relative.columns(bench.robot)))
    assert amplitude * bench.robot.spring("hip").stiffness == pytest.approx(18.0, rel=0.1)


def with_ripple(bench: Bench, growth: float, constant: float) -> Bench:
    """A ripple of the hip, part of which grows with the deflection."""
    motion = bench.data.motion
    return with_torque(
        bench, (HIP, (growth * motion.deflection[:, HIP] + constant) * np.sin(12.0 * motion.theta[:, HIP]))
    )


@pytest.mark.parametrize(("growth", "constant", "nameless"), [(11.0, 0.0, True), (0.0, 0.5, False)])
def test_what_one_leaves_need_not_stand_out_of_noise(nothing_missing, growth, constant, nameless):
    bench = with_ripple(nothing_missing[0], growth, constant)
    selection = found(bench, make_effect("torque_ripple", "hip", order=12.5))
    assert lack_of_fit(bench, selection.final)[2] > LACK_LEVEL
    relatives = unnamed(bench, selection, None)
    assert [one.relative.split()[0] for one in relatives] == ["growing"] * nameless
    for one in relatives:
        assert "with the" in one.relative
        assert "load" in one.relative
        fit = bench.again(one.solution, selection.final.noise)
        assert selection.final.fit.statistic - fit.statistic > EQUALLY_GOOD


@pytest.mark.scenario
def test_it_is_said_in_the_verdict_and_in_words(ripple_found):
    bench, selection, one = ripple_found
    confirmed = Confirmed(selection, bench, selection.start, selection.final)
    nothing = TrendTest(1.0, (), False)
    said = [conclude(bench, confirmed, nothing, {}, None, None, Findings(), found) for found in ((), (one,))]
    assert [diagnosis.verdict for diagnosis in said] == [Verdict.NAMED_WITH_REMAINDER, Verdict.NOT_IN_LIBRARY]
    # the nearest is still told
    assert [(m.effect, m.joint) for m in said[1].missing] == [("torque_ripple", "hip")]
    # where sensors leave that open, no library is blamed
    limited = conclude(bench, confirmed, nothing, {}, None, None, Findings(limited=True), (one,))
    assert limited.verdict is Verdict.CANNOT_TELL
    assert "The same as torque_ripple at hip, but growing with the load, leaves" in said[1].text


@pytest.mark.scenario
@pytest.mark.parametrize("beats", [True, False])
def test_two_waves_that_beat_are_one_that_grows_with_the_load(nothing_missing, beats):
    """Their lengths differ by less than the motion tells; two of lengths of their own are two."""
    bench, motion = nothing_missing[0], nothing_missing[0].data.motion
    theta, deflection = motion.theta[:, HIP], motion.deflection[:, HIP]
    one = deflection / np.abs(deflection).max() * np.sin(12.0 * theta + 0.4)
    two = 0.5 * np.sin(12.0 * theta) + 0.4 * np.sin(29.0 * theta)
    bench = with_torque(bench, (HIP, one if beats else two))
    orders = (10.5, 13.5) if beats else (12.0, 29.0)
    waves = [replace(make_effect("torque_ripple", "hip", order=o), number=k + 1) for k, o in enumerate(orders)]
    selection = found(bench, *waves)
    pairs = [each for each in unnamed(bench, selection, None) if each.second is not None]
    assert [each.relative for each in pairs] == ["torque_ripple growing with the load"] * beats
    for each in pairs:
        assert bench.again(each.solution, selection.final.noise).effects[-1].order == pytest.approx(12.0, abs=0.5)
        assert "are what one effect alone does as well: torque_ripple growing with the load" in each.sentence


def test_what_is_there_keeps_its_name_where_something_else_is_missing(nothing_missing):
    bench, motion = nothing_missing[0], nothing_missing[0].data.motion
    ripple = 0.5 * np.sin(4.0 * motion.theta[:, HIP] + 0.3)
    wave = 0.4 * np.sin(2.0 * np.pi * 7.0 * (motion.time - motion.time[0]) / bench.data.period)
    bench = with_torque(bench, (HIP, ripple), (ANKLE, wave))
    selection = found(bench, make_effect("torque_ripple", "hip", order=4.1))
    assert selection.final.fit.statistic > 2.0 * selection.final.fit.dof
    assert unnamed(bench, selection, None) == ()


def test_torque_of_one_joint_in_the_signal_of_another(nothing_missing):
    """Seven hundredths of the knee's torque in the ankle's signal, inertia and friction of the knee's motor with it."""
    bench = nothing_missing[0]
    bench = with_torque(bench, (ANKLE, 0.07 * bench.data.tau_motor[:, KNEE]))
    selection = found(bench, make_effect("torque_constant", "ankle"))
    (one,) = unnamed(bench, selection, None)
    assert (one.effect, one.joint, one.relative) == ("torque_constant", "ankle", "driven by knee")
    fit = bench.again(one.solution, selection.final.noise)
    (column,) = fit.effects[-1].columns(bench.robot)
    assert fit.parameters[column.name] == pytest.approx(0.07, rel=0.05)


def test_two_effects_that_are_one_in_one_direction(nothing_missing):
    """A fifth of the load is lost where the motor drives: half looks like friction, half like a torque constant."""
    bench, start = nothing_missing
    loss = bench.anchored((*start.fit.effects, make_effect("directional_efficiency", "knee")), start.fit.parameters)[-1]
    bench = with_torque(bench, (KNEE, 0.2 * loss.evaluate(bench.state(start.fit.effects)).motor[:, KNEE, 0]))
    both = [make_effect(name, "knee") for name in ("torque_constant", "load_dependent_friction")]
    selection = found(bench, *both)
    assert [selection.final.fit.parameters[f"knee.{e.name}"] for e in both] == pytest.approx([0.1, 0.1], rel=0.1)
    (one,) = unnamed(bench, selection, None)
    assert {one.effect, one.second} == {e.name for e in both}
    assert one.relative.endswith("only where the motor drives")
    fit = bench.again(one.solution, selection.final.noise)
    column = fit.effects[-1].columns(bench.robot)[0]
    assert fit.parameters[column.name] == pytest.approx(0.2, rel=0.05)
    confirmed = Confirmed(selection, bench, selection.start, selection.final)
    said = conclude(bench, confirmed, TrendTest(1.0, (), False), {}, None, None, Findings(), (one,))
    assert said.verdict is Verdict.NOT_IN_LIBRARY
    assert "are what one effect alone does as well" in said.text


def test_two_effects_that_are_one_whose_sign_turns(nothing_missing):
    """Friction that grows with the load is twice a loss while the motor drives, less a torque constant."""
    bench, start = nothing_missing
    friction = make_effect("load_dependent_friction", "knee")
    friction = bench.anchored((*start.fit.effects, friction), start.fit.parameters)[-1]
    bench = with_torque(bench, (KNEE, 0.15 * friction.evaluate(bench.state(start.fit.effects)).motor[:, KNEE, 0]))
    both = [make_effect(name, "knee") for name in ("torque_constant", "directional_efficiency")]
    selection = found(bench, *both)
    constant, loss = (selection.final.fit.parameters[f"knee.{e.name}"] for e in both)
    assert loss == pytest.approx(0.3, rel=0.1)
    # they turn over at a reversal otherwise than the friction does, and both take a little less of it
    assert constant == pytest.approx(-0.5 * loss, rel=0.1)
    (one,) = unnamed(bench, selection, None)
    assert one.relative == "torque_constant the other way round where the motor is driven"
    fit = bench.again(one.solution, selection.final.noise)
    column = fit.effects[-1].columns(bench.robot)[0]
    assert fit.parameters[column.name] == pytest.approx(0.15, rel=0.05)


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("planted", "said"),
    [
        ([("parallel_spring", "knee", (6.0, 1.0), {})], ["torque_ripple on the link"]),
        pytest.param(
            [("torque_ripple", "knee", (0.8, 0.3), {"order": 9.0}),
             ("encoder_eccentricity", "knee", (), {"sine": 0.01, "cosine": 0.006})],
            [], marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_an_encoder_that_errs_and_a_ripple_are_a_torque_on_the_link(laboratory, planted, said):
    bench = laboratory.bench(laboratory.record(planted))
    order = 9.0 if not said else 1.0
    both = [make_effect("torque_ripple", "knee", order=order), make_effect("encoder_eccentricity", "knee")]
    assert [one.relative for one in unnamed(bench, found(bench, *both), None)] == said


def test_one_for_two_is_told_where_the_sign_of_friction_is_known(nothing_missing):
    """With samples beside reversals the two have sizes of their own, for there friction is not what a model says."""
    bench, start = nothing_missing
    both = [make_effect(name, "knee") for name in ("torque_constant", "load_dependent_friction")]
    constant, friction = bench.anchored((*start.fit.effects, *both), start.fit.parameters)[-2:]
    state = bench.state(start.fit.effects)
    rows = [constant.load(state), friction.evaluate(state).motor[:, KNEE, 0]]
    whole, far = (with_torque(bench, (KNEE, 0.1 * rows[0] + size * rows[1])) for size in (0.2, 0.1))
    selection = found(whole, *both)
    assert unnamed(whole, selection, None) == ()
    (one,) = unnamed(whole, selection, None, (far, settle_again(far, selection.final.fit)))
    assert one.relative.endswith("only where the motor drives")


def test_two_effects_of_sizes_of_their_own_stay_two(nothing_missing):
    bench, start = nothing_missing
    both = [make_effect(name, "knee") for name in ("torque_constant", "load_dependent_friction")]
    anchored = bench.anchored((*start.fit.effects, *both), start.fit.parameters)[-2:]
    rows = [e.evaluate(bench.state(start.fit.effects)).motor[:, KNEE, 0] for e in anchored]
    bench = with_torque(bench, (KNEE, 0.06 * rows[0] + 0.12 * rows[1]))
    assert unnamed(bench, found(bench, *both), None) == ()


@pytest.mark.parametrize(
    ("name", "shape", "growths"),
    [
        ("torque_ripple", {"order": 12.0}, {"load", "magnitude of the load", "speed", "magnitude of the speed"}),
        (
            "position_dependent_friction", {"order": 4.0},
            {"load", "magnitude of the load", "speed", "magnitude of the speed"},
        ),
        ("nonlinear_viscous_friction", {"exponent": 2.0}, {"load", "magnitude of the load", "position"}),
        ("stribeck_friction", {"speed": 0.1}, {"load", "magnitude of the load", "position"}),
        ("load_dependent_friction", {}, {"speed", "magnitude of the speed", "position"}),
        ("asymmetric_spring", {}, {"speed", "magnitude of the speed", "position"}),
        ("torque_offset", {}, set(map(str, Growth))),
    ],
)  # fmt: skip
def test_an_effect_grows_with_nothing_that_it_depends_on(nothing_missing, name, shape, growths):
    """Another power of the speed is another form of friction that grows with the speed, not another effect."""
    bench, start = nothing_missing
    family = relatives_of(bench, start.fit.effects, make_effect(name, "knee", **shape))
    assert {str(one.growth) for one in family if one.growth is not None} == growths


def test_no_relatives_of_what_is_no_torque_of_one_joint(nothing_missing):
    bench, start = nothing_missing
    for effect in (make_effect("position_delay", "knee"), make_effect("external_force", "knee")):
        assert relatives_of(bench, start.fit.effects, effect) == ()
    assert relatives_of(bench, start.fit.effects, make_effect("base_tilt")) == ()
