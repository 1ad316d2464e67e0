"""A joint whose motor is held tells nothing of itself, and spoils nothing of what is told of the others."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy import Verdict
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.measured.data import EquationKind, period_data
from sea_ident.discrepancy.measured.standing import held_still, not_compared_at
from sea_ident.effects import make_effect
from sea_ident.estimation.observations import stands
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.regressor import prior_parameters
from sea_ident.simulation import PlantedEffect

PERIOD = 5.0


def holding(motion, joint):
    """A motion in which one joint is to stay where it is."""
    moves = np.ones((motion.n, 1))
    moves[joint] = 0.0
    return FourierSeries(motion.base_frequency, motion.offset, motion.a * moves, motion.b * moves)


@pytest.fixture(scope="module")
def holding_laboratory(laboratory):
    """The first motion with the hip held, the second, and both with the ankle held."""
    first, second = laboratory.motions
    return replace(laboratory, motions=(holding(first, 0), second, holding(first, 2), holding(second, 2)))


def diagnosed(laboratory, recording, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = sea_ident.identify(laboratory.leg, recording, period=PERIOD)
        return sea_ident.diagnose(model, recording, period=PERIOD, **options)


@pytest.mark.scenario
def test_nothing_is_missing_where_the_last_joint_is_held(holding_laboratory):
    """None of its samples is compared, and what is left of the columns of its friction is rounding."""
    found = diagnosed(holding_laboratory, holding_laboratory.record(motion=2, periods=10))
    assert found.verdict is Verdict.NONE
    assert "The motor of ankle stood in every sample, or nearly: nothing is told" in found.text
    assert not [text for text in found.warnings if "wrong sign" in text or "is that the period" in text]


@pytest.mark.scenario
def test_what_is_missing_beside_a_joint_that_is_held_is_told_by_the_others_alone(holding_laboratory):
    """On another motion that joint moves: what was not told of it there is no test of what was."""
    planted = [("torque_offset", "knee", [1.0], {})]
    recording, other = (holding_laboratory.record(planted, motion=k, periods=10 - 2 * k) for k in (0, 1))
    found = diagnosed(holding_laboratory, recording, holdout=other)
    assert [(m.effect, m.joint) for m in found.missing] == [("torque_offset", "knee")]
    (offset,) = found.missing[0].parameters
    assert abs(offset.value - 1.0) < 3.0 * offset.std < 0.1
    assert found.missing[0].transfer > 0.95
    assert found.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    assert "The motor of hip stood in every sample, or nearly" in found.text
    assert "nor tested on data that were held out" in found.text
    assert any("Move every joint, or leave those out" in text for text in found.warnings)


@pytest.mark.scenario
def test_what_acts_in_no_sample_that_is_compared_stays_as_it_is_described(holding_laboratory):
    laboratory = holding_laboratory
    with pytest.warns(SeaIdentWarning, match="is the motor held"):
        bench = laboratory.bench(laboratory.record(motion=2, periods=10))
    assert held_still(bench.data) == ("ankle",)
    now = settle(bench, bench.effects)
    actuator = laboratory.leg.joints[2].actuator
    described = {"viscous": actuator.viscous_friction, "coulomb": actuator.coulomb_friction}
    for kind, value in described.items():
        assert now.fit.parameters[f"ankle.{kind}_friction"] == value
        assert now.fit.parameters[f"knee.{kind}_friction"] > 0.0
    # the spring bends, and its link moves with that: both are told
    assert now.fit.parameters["ankle.spring_stiffness"] == pytest.approx(120.0, rel=0.05)


def test_a_joint_is_taken_out_of_a_comparison_as_a_whole(laboratory):
    data = laboratory.data(laboratory.record())
    assert held_still(data) == ()
    assert not_compared_at(data, ()) is data
    without = not_compared_at(data, ("knee",))
    for e, equation in enumerate(data.equations):
        assert np.all(without.left_out[:, e]) == (equation.joint == "knee")
        if equation.joint != "knee":
            assert np.array_equal(without.left_out[:, e], data.left_out[:, e])
    bench = Bench(without, laboratory.effects)
    now = settle(bench, bench.effects)
    assert now.fit.statistic < 1.3 * now.fit.dof


@pytest.mark.scenario
def test_of_a_motor_that_is_held_no_friction_is_identified_and_the_others_are_as_sure(holding_laboratory):
    """A friction that follows the noise of its encoder would be of any size, and the others unsure with it."""
    laboratory, leg = holding_laboratory, holding_laboratory.leg
    recording = laboratory.record(motion=2, periods=10)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model, moving = (sea_ident.identify(leg, each, period=PERIOD) for each in (recording, laboratory.record()))
    told = dict(zip(model.names, zip(model.values, model.std, strict=True), strict=True))
    frictions = {"ankle.viscous_friction", "ankle.coulomb_friction"}
    assert set(moving.names) - set(told) >= frictions
    assert any("not told, or told only in sum" in text and "ankle.coulomb_friction" in text for text in model.warnings)
    usual = dict(zip(moving.names, moving.std, strict=True))
    for name in (*(name for name in told if name.startswith("thigh")), "motor.rotor_inertia"):
        assert told[name][1] < 2.0 * usual[name]
    for joint in ("hip", "knee"):
        actuator = leg.joints[leg.index(joint)].actuator
        for kind in ("viscous", "coulomb"):
            value, std = told[f"{joint}.{kind}_friction"]
            assert abs(value - getattr(actuator, f"{kind}_friction")) < 4.0 * std < 0.2


@pytest.mark.scenario
def test_motors_that_are_slow_are_not_held(holding_laboratory):
    """A hundredth of the usual speed is slower than friction turns over, and yet far beyond the noise of an encoder."""
    laboratory = holding_laboratory
    first = laboratory.motions[1]
    slow = FourierSeries(0.1 * first.base_frequency, first.offset, 0.1 * first.a, 0.1 * first.b)
    other = replace(laboratory, motions=(slow,))
    recording = other.record(periods=4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        fast, still = (
            stands(laboratory.leg, sea_ident.process(each, laboratory.leg, period=period))
            for each, period in ((recording, 10.0 * PERIOD), (laboratory.record(motion=0, periods=10), PERIOD))
        )
    assert fast.tolist() == [False, False, False]
    assert still.tolist() == [True, False, False]


@pytest.mark.scenario
def test_what_only_a_motor_that_is_held_tells_is_as_unsure_as_the_friction_that_holds_it(holding_laboratory):
    """It may go along with the inertia of the thigh, and is one error all along; the others do not know of it."""
    laboratory, leg = holding_laboratory, holding_laboratory.leg
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        held, moving = (
            sea_ident.identify(leg, laboratory.record(motion=motion, periods=10), period=PERIOD) for motion in (0, 1)
        )
    truth = dict(zip(moving.names, moving.base.project(prior_parameters(leg, moving.effects)), strict=True))
    errors = {n: (v - truth[n]) / s for n, v, s in zip(held.names, held.values, held.std, strict=True)}
    assert np.sqrt(np.mean(np.square(list(errors.values())))) < 1.6
    assert max(map(abs, errors.values())) < 4.0
    std = dict(zip(held.names, held.std, strict=True))
    assert std["thigh.Iyy*"] > 1.0
    assert std["shank.mz*"] < 0.01
    assert std["shank.Iyy*"] < 0.01


@pytest.fixture(scope="module")
def arm():
    """A rigid arm, a wide motion of it, and one in which friction holds its wrists, which the others push about."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        robot = sea_ident.load_robot("example:ur_description/urdf/ur5_robot.urdf")
    rng = np.random.default_rng(8)
    a, b = 0.25 * rng.standard_normal((2, 6, 3))
    offset = np.array([0.0, -1.2, 0.8, 0.2, 0.3, 0.0])
    wrists = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])[:, None]
    return robot, FourierSeries(0.2, offset, a, b), FourierSeries(0.2, offset, a * wrists, b * wrists)


@pytest.mark.scenario
def test_wrists_that_friction_holds_hide_nothing_of_the_joints_that_carry_them(arm):
    """Where they move, all torques are other ones, for what they carry was told as one body: no fault of the name."""
    robot, wide, held = arm
    planted = [PlantedEffect(make_effect("torque_constant", "elbow_joint"), np.array([0.2]))]
    recording, other = (
        sea_ident.simulate(robot, series, periods=10, seed=seed, effects=planted).recording
        for series, seed in ((held, 3), (wide, 4))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = sea_ident.identify(robot, recording, period=PERIOD)
        found = sea_ident.diagnose(model, recording, holdout=other, period=PERIOD)
    assert [(m.effect, m.joint) for m in found.missing] == [("torque_constant", "elbow_joint")]
    assert found.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    (constant,) = found.missing[0].parameters
    assert abs(constant.value - 0.2) < 4.0 * constant.std < 0.05
    assert "The motors of wrist_1_joint, wrist_2_joint, wrist_3_joint stood in every sample, or nearly" in found.text
    assert found.simulation_gap["q"].shrink > 0.9


@pytest.mark.scenario
@pytest.mark.parametrize(("joint", "always", "tested"), [(0, False, False), (0, True, True), (5, False, True)])
def test_a_recording_is_not_given_up_for_the_noise_of_a_joint_that_is_held(arm, joint, always, tested):
    """Of its torque there is less than of the noise of its acceleration, and nothing of it is compared."""
    robot = arm[0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        designed, wide = (sea_ident.design_excitation(robot, starts=1, seed=seed).series for seed in (1, 2))
        held = holding(designed, joint)
        heldout = holding(wide, joint) if always else wide
        recording, other = (
            sea_ident.simulate(robot, series, periods=10, seed=seed).recording
            for series, seed in ((held, 3), (heldout, 4))
        )
        model = sea_ident.identify(robot, recording, period=held.period)
        found = sea_ident.diagnose(model, recording, holdout=other, period=held.period)
    assert found.verdict is Verdict.NONE
    assert f"The motor of {robot.joint_names[joint]} stood" in found.text
    drowned = [text for text in found.warnings if "comes out larger than the torque" in text]
    # what the first joint would have told of the others is missing for all of these where it moves
    assert (drowned == [] and found.holdout is not None) if tested else all(t.startswith("held-out") for t in drowned)


def test_a_slide_is_not_held_for_being_slow_beside_what_turns(laboratory):
    """A millimetre a second is a slow slide, and a milliradian a second beside a radian no motion at all."""
    robot = sea_ident.load_robot("exo_leg")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        processed = sea_ident.process(laboratory.record(periods=8), robot, period=PERIOD)
    slower = np.array([1.0, 1e-3, 1.0])
    slow = replace(
        processed,
        motion=replace(processed.motion, dtheta=processed.motion.dtheta * slower),
        period_motions=tuple(replace(m, dtheta=m.dtheta * slower) for m in processed.period_motions),
    )
    assert stands(robot, slow).tolist() == [False, True, False]
    # what its motor does is compared nowhere then, and its link as before
    usual, data = (period_data(each, robot) for each in (processed, slow))
    for e, equation in enumerate(data.equations):
        stood = equation.joint == "knee" and equation.kind is EquationKind.MOTOR
        assert np.all(data.left_out[:, e]) == stood
        assert stood or np.array_equal(data.left_out[:, e], usual.left_out[:, e])
    sliding = SimpleNamespace(
        joints=[replace(j, type="prismatic" if j.name == "knee" else j.type) for j in robot.joints]
    )
    assert stands(sliding, slow).tolist() == [False, False, False]
