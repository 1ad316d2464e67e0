import pickle
from dataclasses import replace

import numpy as np
import pytest
from plants import Wave, from_parts, joint, link, modest_series, motor, quietly, ur10

from sea_ident import FourierSeries, Motion, SeaIdentError, design_excitation, load_robot
from sea_ident.effects import make_effect
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.exceptions import DivergenceError, SimulationError
from sea_ident.regressor import inverse_dynamics
from sea_ident.simulation import (
    ComputedTorque,
    FrictionJitter,
    PlantedEffect,
    SensorNoise,
    Settling,
    SmoothCoulomb,
    VelocityController,
    plant_from_robot,
    simulate,
)


def test_settled_motion_repeats(exact):
    samples = len(exact.motion) // 2
    first, second = exact.motion[:samples], exact.motion[samples:]
    assert exact.settled < 1e-8
    for name in ("q", "theta"):
        np.testing.assert_allclose(getattr(first, name), getattr(second, name), atol=1e-8)
    assert np.array_equal(exact.motion.time, exact.recording.time)
    assert exact.motion.time[samples] == pytest.approx(exact.period)


def test_unsettled_motion_is_said(leg, leg_series, quiet):
    run = simulate(leg, leg_series, periods=1, settling=Settling(tolerance=1e-30, longest=2), **quiet)
    assert run.settling_periods == 2
    assert any("still changes" in text for text in run.warnings)
    assert "still changes" in run.summary()


def test_motors_track_the_reference_and_the_links_do_not(exact):
    motor_error = np.sqrt(np.mean((exact.motion.theta - exact.reference.theta) ** 2, axis=0))
    link_error = np.sqrt(np.mean((exact.motion.q - exact.reference.theta) ** 2, axis=0))
    assert np.all(motor_error < 0.02)
    assert np.all(link_error[:2] > 3.0 * motor_error[:2])


def test_equal_seeds_give_equal_recordings_and_others_do_not(leg, leg_series, exact):
    one, two, three = (simulate(leg, leg_series, periods=1, seed=seed, start=exact.motion) for seed in (7, 7, 8))
    for name, values in one.recording.columns.items():
        assert np.array_equal(values, two.recording.columns[name])
        if not name.split("_")[1].startswith("reference"):
            assert not np.array_equal(values, three.recording.columns[name])
    assert np.array_equal(one.motion.ddq, two.motion.ddq)


def test_jitter_of_one_seed_does_not_depend_on_the_sensors(leg, leg_series, exact):
    noisy = simulate(leg, leg_series, periods=1, seed=4, start=exact.motion)
    clean = simulate(leg, leg_series, periods=1, seed=4, start=exact.motion, sensors=SensorNoise.none())
    assert np.array_equal(noisy.motion.q, clean.motion.q)


def test_recording_holds_what_identification_needs(leg, exact):
    recording = exact.recording
    kinds = ("q", "theta", "current", "theta_reference")
    assert set(recording.columns) == {f"{kind}_{name}" for kind in kinds for name in leg.joint_names}
    assert recording.joints == leg.joint_names
    assert recording.sample_rate == pytest.approx(200.0)


def test_rigid_robot_without_annotation(quiet):
    robot = ur10()
    run = simulate(robot, modest_series(robot), periods=1, **quiet)
    assert np.array_equal(run.motion.theta, run.motion.q)
    assert not np.any(run.tau_spring)
    assert run.recording.has("tau_motor", "elbow_joint")
    assert not run.recording.has("theta", "elbow_joint")
    assert run.recording.has("q_reference", "elbow_joint")


def test_single_pass_starts_in_equilibrium_and_ends_with_the_reference(leg, quiet):
    time = np.linspace(2.0, 3.5, 301)
    share = (time - 2.0) / 1.5
    start, end = np.array([0.3, -0.1, 0.2]), np.array([0.5, -0.2, 0.6])
    smooth = (10 * share**3 - 15 * share**4 + 6 * share**5)[:, None]
    rate = (30 * share**2 - 60 * share**3 + 30 * share**4)[:, None] / 1.5
    acceleration = (60 * share - 180 * share**2 + 120 * share**3)[:, None] / 1.5**2
    reach = end - start
    reference = Motion.rigid(time, start + reach * smooth, reach * rate, reach * acceleration)
    run = simulate(leg, reference, **quiet)
    assert run.period is None
    assert np.isnan(run.settled)
    np.testing.assert_allclose(run.motion.time, time, atol=1e-12)
    np.testing.assert_allclose(run.reference.theta, reference.q, atol=1e-9)
    assert np.abs(run.motion.ddq[0]).max() < 0.5
    assert np.abs(run.motion.theta[-1] - end).max() < 0.02


def test_started_in_its_own_state_a_simulation_goes_on_as_before(leg, leg_series, quiet, exact):
    again = simulate(leg, leg_series, periods=1, start=exact.motion[0:1], **quiet)
    assert again.settling_periods == 0
    assert np.array_equal(again.motion.q, exact.motion.q[: len(again.motion)])


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_what_leads_to_the_recording_is_not_recorded(leg, leg_series, quiet, exact, share):
    samples = len(exact.motion) // exact.periods
    first = samples - round(share * samples)
    lead = (samples - first) * exact.period / samples
    again = simulate(leg, leg_series, periods=1, start=exact.motion[first : first + 1], lead=lead, **quiet)
    assert len(again.motion) == samples
    assert again.motion.time[0] == exact.motion.time[0]
    assert np.array_equal(again.motion.q, exact.motion.q[samples:])
    assert np.array_equal(again.tau_motor, exact.tau_motor[samples:])


@pytest.mark.parametrize("lead", [-1.0, 1e-4, 1e3, np.nan, np.inf])
def test_a_lead_that_is_none_is_refused(leg, leg_series, exact, lead):
    with pytest.raises(SimulationError, match=r"lead is .* s at most"):
        simulate(leg, leg_series, periods=1, start=exact.motion[0:1], lead=lead)


def test_a_lead_from_nowhere_is_refused(leg, leg_series):
    with pytest.raises(SimulationError, match="give `start`"):
        simulate(leg, leg_series, periods=1, lead=1.0)


def test_controller_knows_the_description_and_not_the_plant(leg, leg_series, quiet, exact):
    truth = plant_from_robot(leg)
    heavier = truth.replace(viscous_friction=3.0 * truth.viscous_friction)
    other = simulate(leg, leg_series, periods=1, plant=heavier, **quiet)
    samples = len(other.motion)
    assert np.array_equal(exact.reference.theta[:samples], other.reference.theta)
    assert np.abs(exact.motion.theta[:samples] - other.motion.theta).max() > 1e-3


def test_computed_torque_brings_the_links_where_they_are_wanted(leg, quiet):
    series = modest_series(leg, base_frequency=0.4, seed=4)
    plain, computed = (
        simulate(leg, series, periods=1, controller=controller, **quiet)
        for controller in (VelocityController(), ComputedTorque())
    )
    error = [np.sqrt(np.mean((run.motion.q - series.evaluate(run.motion.time)) ** 2)) for run in (plain, computed)]
    assert error[1] < 1e-3
    assert error[1] < 0.1 * error[0]


def test_diverging_motion_names_joint_and_time():
    robot = from_parts(
        '<link name="base"/>', link("bob"), joint("swing", "base", "bob", "0 1 0"),
        motor("swing", 'stiffness="100" damping="0.1"'),
    )  # fmt: skip
    pushing = Wave((1.0,), 1.0, (-4000.0,), (-50.0,))
    with pytest.raises(DivergenceError, match=r"diverged at -?\d+\.\d+ s.*'swing'.*; take a shorter step") as raised:
        simulate(robot, modest_series(robot), controller=pushing)
    sent = pickle.loads(pickle.dumps(raised.value))  # as between processes
    assert (str(sent), sent.what) == (str(raised.value), raised.value.what)
    assert "step" not in sent.what


@pytest.mark.parametrize("friction", [-1e6, -1e150])
def test_motion_that_overflows_is_told_and_numpy_says_nothing(leg, friction):
    pushed = PlantedEffect(make_effect("link_friction", "ankle"), np.array([0.0, friction]))
    with pytest.raises(SimulationError, match="the simulation diverged at"):
        simulate(leg, modest_series(leg), periods=1, seed=0, effects=[pushed])


def test_a_spring_that_softens_until_it_pushes_the_wrong_way_is_named_as_what_diverged():
    """No shorter step would help: its law is that of small deflections."""
    with pytest.raises(SimulationError, match=r"'swing'.*its spring \(K1 60 N m/rad, .* by more than 0.05 rad"):
        simulate(softening(60.0), modest_series(softening(60.0)), periods=1)


def test_one_that_cannot_carry_the_link_at_rest_is_refused():
    with pytest.raises(SimulationError, match="joint 'swing': its softening spring cannot carry"):
        simulate(softening(2.0), modest_series(softening(2.0)), periods=1)


def softening(stiffness):
    """A pendulum whose spring pulls less and less, and not at all at 0.05 rad."""
    law = f'stiffness="{stiffness}" cubicStiffness="{-400.0 * stiffness}" damping="0.01"'
    return from_parts('<link name="base"/>', link("bob"), joint("swing", "base", "bob", "0 1 0"), motor("swing", law))


def test_missing_stiffness_is_named():
    robot = from_parts(
        '<link name="base"/>', link("bob"), joint("swing", "base", "bob", "0 1 0"), motor("swing", 'damping="1"')
    )
    with pytest.raises(SeaIdentError, match="swing: stiffness"):
        simulate(robot, modest_series(robot), periods=1)


def test_missing_rotor_inertia_is_named():
    with pytest.raises(SeaIdentError, match="output: <rotorInertia>"):
        plant_from_robot(load_robot("hebi_x5"))


def test_a_rotor_without_inertia_is_not_called_left_out():
    parts = '<link name="base"/>', link("bob"), joint("swing", "base", "bob", "0 1 0")
    robot = from_parts(*parts, motor("swing", 'stiffness="100"').replace(">3e-5<", ">0<"))
    with pytest.raises(SeaIdentError, match="states none, or zero, of swing: <rotorInertia>"):
        plant_from_robot(robot)


def test_friction_of_a_rigid_joint_is_not_called_absent_where_the_joint_states_it():
    """As the exported URDF of an identified robot does; the motor of a spring has a friction of its own."""
    dynamics = '<dynamics damping="0.06" friction="0.08"/>'
    parts = '<link name="base"/>', link("bob"), joint("swing", "base", "bob", "0 1 0", dynamics)
    plant = plant_from_robot(from_parts(*parts, motor("swing", None, "<!-- nothing -->")))
    assert plant.viscous_friction == pytest.approx([0.06])
    assert plant.coulomb_friction == pytest.approx([0.08])
    assert not any("Friction" in note for note in plant.notes)
    elastic = plant_from_robot(from_parts(*parts, motor("swing", 'stiffness="100"', "<!-- nothing -->")))
    assert sum("Friction" in note for note in elastic.notes) == 2


def test_what_is_not_stated_is_absent_and_said():
    """Only gear, rotor and stiffness: no motor of an annotated robot needs more to be simulated than a bare one."""
    robot = from_parts(
        '<link name="base"/>', link("bob"), joint("swing", "base", "bob", "0 1 0"),
        motor("swing", 'stiffness="100"', "<!-- nothing -->"),
    )  # fmt: skip
    run = simulate(robot, modest_series(robot), periods=1, sensors=SensorNoise.none(), jitter=FrictionJitter.none())
    for tag in ("viscousFriction", "coulombFriction", "damping", "cubicStiffness", "efficiency"):
        assert f"no {tag}," in run.summary()
    # the spring alone carries the link, and the motor torque is that of bodies and rotor
    link_torque, motor_torque = inverse_dynamics(robot, run.motion)
    assert run.tau_motor == pytest.approx(link_torque + motor_torque, abs=1e-3)
    assert run.tau_spring == pytest.approx(100.0 * run.motion.deflection, abs=1e-9)


@pytest.mark.scenario
def test_friction_does_not_hold_a_small_slide_back():
    """A gripper: centimetres of motion, little inertia, and friction that outweighs what the usual gains give."""
    robot = from_parts(
        '<link name="base"/>', link("finger", mass=0.2),
        '<joint name="grip" type="prismatic"><parent link="base"/><child link="finger"/><axis xyz="1 0 0"/>'
        '<limit lower="0" upper="0.04" velocity="0.2" effort="50"/></joint>',
        motor("grip", None, "<coulombFriction>5</coulombFriction>").replace("3e-5", "1e-5"),
    )  # fmt: skip
    series = FourierSeries(0.1, np.array([0.02]), np.array([[0.003, 0.002]]), np.array([[0.0, 0.005]]))
    run = simulate(robot, series, periods=1, sensors=SensorNoise.none(), jitter=FrictionJitter.none())
    error = run.motion.theta - run.reference.theta
    assert np.sqrt(np.mean(error**2)) < 0.25 * run.reference.theta.std()


def test_stiffness_of_a_slide_has_its_unit():
    plant = plant_from_robot(slide())
    with pytest.raises(SimulationError, match="'grip': the stiffness of its spring is -5 N/m; it must be positive"):
        plant.replace(stiffness=np.array([-5.0]))


def slide():
    """One elastic slide."""
    return from_parts(
        '<link name="base"/>', link("finger", mass=0.2),
        '<joint name="grip" type="prismatic"><parent link="base"/><child link="finger"/><axis xyz="1 0 0"/>'
        '<limit lower="0" upper="0.04" velocity="0.2" effort="50"/></joint>',
        motor("grip", 'stiffness="100" damping="0.1"'),
    )  # fmt: skip


def test_friction_of_a_slide_turns_over_at_slide_speeds():
    """By default the model of a slide smooths at 1 mm/s; a simulation that smoothed as at a hinge would differ."""
    robot = quietly(load_robot, "emps")
    (model,) = CoulombFriction.instances(robot)
    (law,) = SmoothCoulomb.usual(robot)
    assert law.smoothing == pytest.approx(model.smoothing, rel=0.3)
    (hinge, *_) = SmoothCoulomb.usual(load_robot("exo_leg"))
    assert hinge == SmoothCoulomb()
    (jitter,) = FrictionJitter.usual(robot)
    assert jitter.speed == pytest.approx(0.1 * FrictionJitter().speed)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"periods": 0}, "periods 0"),
        ({"rate": -1.0}, "rate -1"),
        ({"step": 0.0}, "step 0"),
        ({"friction": [SmoothCoulomb()]}, "1 friction laws for 3 joints"),
    ],
)
def test_impossible_requests_are_refused(leg, leg_series, options, match):
    with pytest.raises(SeaIdentError, match=match):
        simulate(leg, leg_series, **options)


def test_reference_of_another_robot_is_refused(leg):
    with pytest.raises(SeaIdentError, match="2 joints"):
        simulate(leg, FourierSeries(0.1, np.zeros(2), np.zeros((2, 1)), np.zeros((2, 1))))
    with pytest.raises(SeaIdentError, match="give a FourierSeries"):
        simulate(leg, np.zeros((10, 3)))


def test_overload_is_said(leg, quiet):
    fast = modest_series(leg, base_frequency=2.5, share=0.9)
    run = simulate(leg, fast, periods=1, **quiet)
    assert any("its limit is" in text for text in run.warnings)


def test_friction_jitters_by_default(leg, leg_series, exact):
    options = {"periods": 1, "sensors": SensorNoise.none(), "start": exact.motion}
    varied = simulate(leg, leg_series, **options)
    alike = simulate(leg, leg_series, jitter=FrictionJitter.none(), **options)
    assert np.abs(varied.motion.theta - alike.motion.theta).max() > 1e-5


def test_an_excitation_of_another_robot_is_refused(leg):
    """As many joints, other names: its limits and its meaning are those of the other robot."""
    other = from_parts(
        '<link name="base"/>', link("one"), link("two"), link("three"),
        joint("a", "base", "one", "0 1 0"), joint("b", "one", "two", "0 1 0"), joint("c", "two", "three", "0 1 0"),
    )  # fmt: skip
    excitation = design_excitation(leg, starts=1, harmonics=2)
    with pytest.raises(SeaIdentError, match=r"designed for the joints hip, knee, ankle; test has a, b, c"):
        simulate(other, excitation, periods=1)
    assert simulate(leg, excitation, periods=1).periods == 1


def test_steps_too_long_for_a_spring_that_swings_freely_are_told():
    """Let go where it is bent by 0.3 rad: steps of a seventh of its period do not follow it, much shorter ones do."""
    swinging = from_parts(
        '<link name="base"/>', link("bob"), joint("swing", "base", "bob", "0 1 0"), motor("swing", 'stiffness="2000"')
    )
    series = modest_series(swinging)
    bent = series.motion(np.zeros(1))
    bent = replace(bent, q=bent.q + 0.3)
    long, short = (
        simulate(swinging, series, periods=1, rate=50.0, step=step, start=bent, sensors=SensorNoise.none())
        for step in (0.02, 0.00125)
    )
    (told,) = (text for text in long.warnings if "is long for" in text)
    assert told.startswith("a step of 0.02 s is long for the motor of joint 'swing': it errs by up to ")
    assert "as 0.005 s" in told
    assert not [text for text in short.warnings if "is long for" in text]
