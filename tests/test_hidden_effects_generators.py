"""The generators of the hidden-effect benchmark: an independent engine obeys the equations of the library."""

import sys
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

pytest.importorskip("mujoco", reason="the independent engine of the benchmark is MuJoCo")
sys.path.insert(0, str(Path(__file__).parents[1]))

from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import (
    Anchor,
    Contribution,
    Effect,
    State,
    base_effects,
    corrected_motion,
    make_effect,
    spring_effects,
)
from sea_ident.effects.signal import SignalEffect
from sea_ident.motion import Motion
from sea_ident.regressor import build_regressor
from tests.benchmarks.hidden_effects import catalogue, forms, gap, generate, project_engine, sensors
from tests.benchmarks.hidden_effects.case import Case, Planted, generator
from tests.benchmarks.hidden_effects.draw import draw_case, trajectories_of, truth_of
from tests.benchmarks.hidden_effects.drawn_robots import MOST_JOINTS, drawn_name, drawn_robot
from tests.benchmarks.hidden_effects.engine import STEP, Exact, Friction, share_of_step, simulate_mujoco
from tests.benchmarks.hidden_effects.mjcf import COUPLED_SHARE, Coupling, Stages, build_mjcf
from tests.benchmarks.hidden_effects.plants import Truth, drawn_truth, nominal_robot, nominal_truth
from tests.benchmarks.hidden_effects.project_engine import planted_effects
from tests.benchmarks.hidden_effects.sizes import OTHERWISE_BUILT, size_errors
from tests.benchmarks.hidden_effects.sizes import true_parameters as told_parameters
from tests.benchmarks.hidden_effects.trajectories import draw_trajectory

SMOOTHING = 0.02


@pytest.fixture(scope="module")
def leg() -> gap.Gauge:
    rng = generator(9, 10)
    truth = drawn_truth("exo_leg", rng)
    series = draw_trajectory("exo_leg", 4.0, rng, candidates=6)
    return gap.Gauge(truth, series, Friction("tanh", SMOOTHING), 1)


def truth_and_run(name: str, planted: tuple[Planted, ...] = ()) -> tuple[Truth, Exact]:
    rng = generator(5, 6)
    truth = drawn_truth(name, rng)
    series = draw_trajectory(name, 4.0, rng, candidates=4)
    friction = Friction("tanh", SMOOTHING)
    return truth, simulate_mujoco(truth, series, 1, planted=planted, friction=friction, step=5e-4)


def sum_model(truth: Truth) -> tuple[Effect, ...]:
    return tuple(
        make_effect(e.name, e.joint, smoothing=SMOOTHING) if e.name == "coulomb_friction" else e
        for e in base_effects(truth.robot)
    )


def true_parameters(truth: Truth, effects: tuple[Effect, ...]) -> np.ndarray:
    robot, values = truth.robot, []
    for effect in effects:
        i = 0 if effect.joint is None else robot.index(effect.joint)
        numbers = {
            "viscous_friction": truth.viscous,
            "coulomb_friction": truth.coulomb,
            "spring_stiffness": truth.stiffness,
            "spring_stiffening": truth.cubic,
            "spring_damping": truth.damping,
        }
        values.append(numbers[effect.name][i : i + 1] if effect.name in numbers else effect.prior(robot))
    return np.concatenate(values)


@pytest.mark.parametrize("name", ["exo_leg", "baxter", "prosthesis"])
def test_mujoco_plant_obeys_link_and_motor_rows(name: str) -> None:
    """Rotors are bodies of MuJoCo's, so the coupling terms of the library are checked by another engine."""
    truth, exact = truth_and_run(name)
    effects = (*sum_model(truth), *spring_effects(truth.robot))
    regressor = build_regressor(truth.robot, effects, exact.motion)
    parameters = true_parameters(truth, effects)
    torque = np.sqrt(np.mean(exact.tau_motor**2, axis=0))
    link = regressor.link @ parameters / torque
    motor = (regressor.motor @ parameters - exact.tau_motor) / torque
    assert np.sqrt(np.mean(link**2, axis=0)).max() < 1e-4
    assert np.sqrt(np.mean(motor**2, axis=0)).max() < 1e-4


@pytest.mark.parametrize("name", ["exo_leg", "ur5", "oblique_arm", "torso"])
def test_regression_on_mujoco_states_recovers_base_parameters(name: str) -> None:
    truth, exact = truth_and_run(name)
    effects = sum_model(truth)
    base = find_base_parameters(truth.robot, effects)
    rows = build_regressor(truth.robot, effects, exact.motion).sum[:, :, base.independent]
    matrix = rows.reshape(-1, base.rank)
    norms = np.linalg.norm(matrix, axis=0)
    estimate = np.linalg.lstsq(matrix / norms, exact.tau_motor.ravel(), rcond=None)[0] / norms
    expected = base.project(true_parameters(truth, effects))
    contribution = norms / np.linalg.norm(exact.tau_motor)
    assert np.all(np.abs(estimate - expected) * contribution < 3e-3)
    friction = [k for k, name in enumerate(base.names) if "friction" in name]
    np.testing.assert_allclose(estimate[friction], expected[friction], rtol=0.05)


@pytest.mark.parametrize(("begin", "end"), [(0.3002, 0.4007), (0.3004, 0.3006), (0.0, 0.5), (3.99, 4.0)])
def test_a_push_lasts_as_long_as_it_is_told_to(begin: float, end: float) -> None:
    """Not a whole number of steps: when it begins and ends is told to a tenth of one."""
    times = STEP * np.arange(4000)
    again = np.array([share_of_step(time, STEP, begin, end, 4.0) for time in times])
    assert again.sum() * STEP == pytest.approx(end - begin, abs=1e-9)
    assert share_of_step(times[301] + 4.0, STEP, begin, end, 4.0) == pytest.approx(again[301])
    once = [share_of_step(time, STEP, begin, end) for time in STEP * np.arange(-1.0, 5000.0)]
    assert sum(once) * STEP == pytest.approx(end - begin, abs=1e-9)


def test_a_push_that_ends_within_a_step_is_another_one() -> None:
    """The engine asks for the share of the step."""
    step = 5e-4  # that of `truth_and_run`, in a period of 4 s
    ends = (0.3, 0.3 + 0.3 * step / 4.0, 0.3 + 0.6 * step / 4.0)
    shape = {"x": 0.0, "y": 0.6, "z": 0.8, "begin": 0.2, "every_period": 1.0}
    positions = [
        truth_and_run("exo_leg", (Planted("external_force", "knee", "library", 40.0, {**shape, "end": end}),))[
            1
        ].motion.q
        for end in ends
    ]
    first, second = (np.abs(positions[k + 1] - positions[k]).max() for k in range(2))
    assert first == pytest.approx(second, rel=0.05)
    assert first > 1e-6


def test_without_its_rotor_coupling_the_plant_is_another_one() -> None:
    """The check above can fail: the rotors of the elastic arm matter in the link rows."""
    truth, exact = truth_and_run("baxter")
    effects = (*sum_model(truth), *spring_effects(truth.robot))
    parameters = true_parameters(truth, effects)
    columns = build_regressor(truth.robot, effects, exact.motion)
    rotors = ["rotor_inertia" in name for name in columns.names]
    torque = np.sqrt(np.mean(exact.tau_motor**2, axis=0))
    link = np.abs(columns.link @ np.where(rotors, 0.0, parameters)) / torque
    assert np.median(link, axis=0).max() > 1e-3


@pytest.mark.parametrize(("joint", "other"), [("knee", "hip"), ("ankle", "knee"), ("knee", "ankle")])
def test_a_coupled_rotor_feels_its_carrier_as_before(joint: str, other: str) -> None:
    """One effect is hidden, not two: a rotor that lost its carrier would be a `rotor_coupling` besides."""
    import mujoco

    robot = drawn_truth("exo_leg", generator(3)).robot

    def inertia(*couplings: Coupling) -> np.ndarray:
        model = build_mjcf(robot, 1e-3, couplings=couplings)
        data = mujoco.MjData(model)
        data.qpos[:] = generator(4).uniform(-1.0, 1.0, model.nq)
        mujoco.mj_forward(model, data)
        return Stages(robot, model, couplings).inertia(data)

    np.testing.assert_allclose(inertia(Coupling(joint, other, 0.0)), inertia(), rtol=1e-9, atol=1e-12)
    assert not np.allclose(inertia(Coupling(joint, other, 0.1)), inertia(), rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize(("joint", "other"), [("hip", "knee"), ("knee", "hip"), ("ankle", "knee"), ("knee", "ankle")])
def test_a_coupled_motor_feels_the_other_joint_and_the_other_joint_feels_it(joint: str, other: str) -> None:
    """Whichever of them carries the other, or none; and what accelerates is what the matrix of inertias says."""
    import mujoco

    robot = drawn_truth("exo_leg", generator(3)).robot
    couplings = (Coupling(joint, other, 0.5),)
    model = build_mjcf(robot, 1e-3, couplings=couplings)
    data, stages = mujoco.MjData(model), Stages(robot, model, couplings)
    data.qpos[:], data.qvel[:], data.qfrc_applied[:] = generator(4).uniform(-1.0, 1.0, (3, model.nv))
    mujoco.mj_forward(model, data)
    alone = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, alone)
    k, m = (mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in (f"{joint} rotor", other))
    actuator = robot.joints[robot.index(joint)].actuator
    assert actuator is not None
    added = stages.inertia(data) - alone
    assert added[k, m] == pytest.approx(0.5 * COUPLED_SHARE * actuator.rotor_inertia * actuator.gear_ratio, rel=0.05)
    np.testing.assert_allclose(added, added.T, atol=1e-12)
    force = alone @ data.qacc  # with all that depends on the speed
    np.testing.assert_allclose(stages.inertia(data) @ stages.accelerations(data), force, atol=1e-9)


LEFT_OVER = {
    "torque_constant": 0.5,
    "torque_constant_drift": 0.1,
    "backlash": 0.1,
    "link_flexibility": 0.1,
    "spring_hysteresis": 0.4,
}
"""Part that a formula of the library may leave: first order only, or a memory of what was before; else 0.03."""


@pytest.mark.scenario
@pytest.mark.parametrize("entry", catalogue.LIBRARY, ids=lambda entry: entry.effect)
def test_formulas_of_the_library_agree_with_independent_laws(entry: catalogue.Entry, leg: gap.Gauge) -> None:
    """An effect acts in MuJoCo by a law of the benchmark's own; the library's columns explain what it does."""
    rng, truth, series, friction = generator(9, 12), leg.truth, leg.series, leg.friction
    robot, joint = truth.robot, 1
    size, _, shape = entry.draw(catalogue.Place(leg, joint, rng))
    name = None if entry.whole else robot.joint_names[joint]
    planted = Planted(entry.effect, name, entry.form, 0.5 * size, shape)
    exact = simulate_mujoco(truth, series, 1, planted=(planted,), friction=friction, step=5e-4)
    seen = sensors.signals(exact, truth, (planted,))
    motion = sensed_motion(exact, seen) if entry.effect in gap.SENSOR_EFFECTS else exact.motion
    model = (*sum_model(truth), *spring_effects(robot))
    parameters = true_parameters(truth, model)
    names = [column.name for effect in model for column in effect.columns(robot)]
    # a model that does without the effect has the springs before the encoders
    anchor = Anchor(robot, model, dict(zip(names, map(float, parameters), strict=True)))
    if entry.effect == "link_flexibility":  # the model's spring is the whole of both compliances
        whole = 1.0 / (1.0 / truth.stiffness[joint] + planted.size)
        parameters[names.index(f"{name}.spring_stiffness")] = whole
        parameters[names.index(f"{name}.spring_stiffening")] *= (whole / truth.stiffness[joint]) ** 4
    added = [
        (p.effect.anchored(anchor), p.values) for p in planted_effects(planted, truth, SMOOTHING, series.period, 1)
    ]
    if entry.effect == "transmission_coupling":  # with the friction of the true motor, and most of its inertia
        friction_of_motor = planted.size * np.array([truth.viscous[joint], truth.coulomb[joint]])
        added = [(e, np.concatenate([COUPLED_SHARE * values[:1], friction_of_motor])) for e, values in added]
    signals = [effect for effect, _ in added if isinstance(effect, SignalEffect)]
    columns = [(effect, values) for effect, values in added if not isinstance(effect, SignalEffect)]
    scale = np.sqrt(np.mean(exact.tau_motor**2, axis=0))

    def residual(corrected: Motion, more: list[tuple[Effect, np.ndarray]], shift: list[SignalEffect]) -> np.ndarray:
        state = State(robot, corrected, {"temperature": seen["temperature"]})
        link, motor = np.zeros_like(exact.tau_motor), -seen["tau_motor"]
        regressor = build_regressor(robot, model, corrected)
        parts = [(Contribution(regressor.link, regressor.motor), parameters)]
        parts += [(effect.evaluate(state), values) for effect, values in more]
        for part, values in parts:
            for signal in shift:
                part = signal.shifted(robot, corrected.time, part)
            link, motor = link + part.link @ values, motor + part.motor @ values
        calm = np.all(np.abs(exact.motion.dtheta) > 4 * SMOOTHING, axis=1)
        calm[: len(calm) // 2] = False  # memories are settled by then
        return (np.concatenate([link, motor], axis=1) / np.tile(scale, 2))[calm]

    before = np.sqrt(np.mean(residual(motion, [], []) ** 2))
    after = np.sqrt(np.mean(residual(corrected_motion(robot, signals, motion), columns, signals) ** 2))
    assert before > 5e-4
    assert after < LEFT_OVER.get(entry.effect, 0.03) * before


@pytest.mark.parametrize("effect", [e.effect for e in catalogue.LIBRARY if e.effect not in OTHERWISE_BUILT])
def test_every_size_of_the_library_is_scored(effect: str, leg: gap.Gauge) -> None:
    """What the project would plant has no error, by the names that a diagnosis tells; and each number counts."""
    entry, robot, joint = catalogue.ENTRIES[(effect, "library")], leg.truth.robot, 1
    _, size, shape = entry.draw(catalogue.Place(leg, joint, generator(9, 12)))
    planted = Planted(effect, None if entry.whole else robot.joint_names[joint], "library", size, shape)
    case = replace(draw_case(1, "none", 0), robot="exo_leg", friction_smoothing=SMOOTHING, engine="project")
    (there, *_) = planted_effects(planted, leg.truth, SMOOTHING, case.period, case.periods)
    told = {column.name: value for column, value in zip(there.effect.columns(robot), there.values, strict=True)}
    told |= {there.effect.parameter_name(s.name): getattr(there.effect, s.name) for s in there.effect.ranges}
    told |= {name: v for name, v in told_parameters(planted, case, leg.truth).items() if "_point_" in name}
    entries = [{"name": name, "value": float(value), "std": 0.5} for name, value in told.items()]
    errors = size_errors(planted, {"parameters": entries}, case, leg.truth)
    assert errors
    assert errors == pytest.approx(np.zeros(len(errors)), abs=1e-12)
    off = [{**each, "value": each["value"] + 1.0} for each in entries]
    assert size_errors(planted, {"parameters": off}, case, leg.truth) == pytest.approx(np.full(len(errors), 2.0))


@pytest.mark.scenario
@pytest.mark.parametrize("form", ["library", "lugre"])
def test_friction_with_a_memory_is_right_to_the_second_order_of_the_step(form: str, leg: gap.Gauge) -> None:
    """As all else is: a bristle that is half a step ahead of its motor bends over a distance that nobody planted."""
    entry, joint = catalogue.ENTRIES[("presliding_friction", form)], 1
    planted = catalogue.draw_effect(entry, leg, joint, 0.03, generator(3))
    assert planted is not None
    coarse, middle, fine = (
        simulate_mujoco(leg.truth, leg.series, 1, planted=(planted,), friction=leg.friction, step=step).tau_motor
        for step in (1e-3, 5e-4, 2.5e-4)
    )
    # of the first order the ratio is 3, of the second 5
    assert np.linalg.norm((coarse - fine)[:, joint]) > 4.0 * np.linalg.norm((middle - fine)[:, joint])


def sensed_motion(exact: Exact, seen: dict[str, np.ndarray]) -> Motion:
    """Motion as the sensors show it, q differentiated within its band."""
    samples = len(exact.motion)
    w = 2j * np.pi * np.fft.rfftfreq(samples, exact.period / samples)
    spectrum = np.fft.rfft(seen["q"], axis=0) * (np.abs(w) < 2 * np.pi * 40.0)[:, None]
    q = [np.fft.irfft(spectrum * (w**k)[:, None], samples, axis=0) for k in range(3)]
    motion = exact.motion
    return Motion(motion.time, *q, motion.theta, motion.dtheta, motion.ddtheta)


def test_a_stuck_motor_does_not_creep() -> None:
    """True stiction: below the Coulomb torque the speed is zero, not small."""
    rng = generator(1)
    truth = drawn_truth("exo_leg", rng)
    series = draw_trajectory("exo_leg", 4.0, rng, weak=True)
    hold = tuple(
        Planted("stribeck_friction", name, "library", 80.0, {"speed": 1e3, "exponent": 1.0})
        for name in truth.robot.joint_names
    )
    exact = simulate_mujoco(truth, series, 1, planted=hold, friction=Friction("ramp", 0.0))
    late = exact.motion.dtheta[len(exact.motion) // 2 :]
    assert np.abs(late).max() < 1e-6
    assert np.ptp(exact.tau_motor, axis=0).min() > 0.1


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("effect", "form", "joint"),
    [
        ("stribeck_friction", "lorentz", 1),
        ("spring_hysteresis", "bouc_wen", 1),
        ("torque_ripple", "two_orders", 0),
        ("encoder_eccentricity", "library", 0),
        ("transmission_coupling", "library", 1),
    ],
)
def test_planted_sizes_leave_the_wanted_gap(effect: str, form: str, joint: int, leg: gap.Gauge) -> None:
    entry = catalogue.ENTRIES[(effect, form)]
    planted = catalogue.draw_effect(entry, leg, joint, 0.03, generator(3))
    assert planted is not None
    assert leg.measure(planted).gap == pytest.approx(0.03, rel=0.36)
    assert leg.measure(replace(planted, size=1e-9)).gap < 0.01


@pytest.mark.scenario
def test_every_form_has_a_law_and_every_entry_a_place(leg: gap.Gauge) -> None:
    rng, plain = generator(4), sensors.signals(leg.exact, leg.truth, ())
    for entry in (*catalogue.OTHER_FORMS, *catalogue.UNKNOWN, *catalogue.REFERENCE):
        joint = catalogue.places(entry, leg)[0]
        size, largest, shape = entry.draw(catalogue.Place(leg, joint, rng))
        assert 0.0 < abs(size) <= largest
        name = None if entry.whole else leg.truth.robot.joint_names[joint]
        planted = Planted(entry.effect, name, entry.form, size, shape)
        exact = simulate_mujoco(leg.truth, leg.series, 1, planted=(planted,), rate=50.0, friction=leg.friction)
        seen = sensors.signals(exact, leg.truth, (planted,))
        assert any(not np.allclose(seen[k], plain[k][::4], rtol=0.0, atol=1e-7) for k in ("q", "theta", "tau_motor"))


def test_a_saturation_never_delivers_less_for_more(leg: gap.Gauge) -> None:
    """u - c u^3 as the library has it, and flat where that would turn round: else what is unsettled runs away."""
    hooks = [forms.Hooks() for _ in leg.truth.robot.joints]
    planted = Planted("torque_saturation", leg.truth.robot.joint_names[1], "library", 0.01)
    forms.bind(planted, leg.truth, hooks, [], 1e-3, 1.0)
    drive = hooks[1].drive
    assert drive is not None
    asked = np.linspace(-50.0, 50.0, 1001)
    delivered = np.array([drive(forms.JointState(), float(u)) for u in asked])
    assert np.all(np.diff(delivered) >= 0.0)
    usual = np.abs(asked) < 5.0
    np.testing.assert_allclose(delivered[usual], asked[usual] - 0.01 * asked[usual] ** 3, atol=1e-12)


def test_cases_follow_from_their_seed_and_survive_json() -> None:
    case = draw_case(11, "none", 2)
    assert case == draw_case(11, "none", 2)
    assert case != draw_case(12, "none", 2)
    assert Case.from_dict(case.to_dict()) == case


@pytest.mark.scenario
def test_a_small_effect_that_the_engine_cannot_follow_is_drawn_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = draw_case(11, "one_small", 0).planted[0]
    measure, asked = gap.Gauge.measure, list[Planted]()

    def diverges_once(gauge: gap.Gauge, planted: Planted) -> Planted:
        # the last size that is measured is the small one
        if planted.effect == usual.effect and planted.size == usual.size and not asked:
            asked.append(planted)
            raise FloatingPointError
        return measure(gauge, planted)

    monkeypatch.setattr(gap.Gauge, "measure", diverges_once)
    other = draw_case(11, "one_small", 0).planted[0]
    assert asked
    assert (other.effect, other.joint, other.size) != (usual.effect, usual.joint, usual.size)


@pytest.mark.scenario
def test_coarse_encoders_have_steps_far_above_their_noise_and_half_the_cases_hide_nothing() -> None:
    cases = [draw_case(11, "coarse", k) for k in range(6)]
    assert [len(case.planted) for case in cases] == [0, 1, 0, 1, 0, 1]
    for case in cases:
        bits = [np.log2(2.0 * np.pi / step) for step in (case.noise.link_step, case.noise.motor_step)]
        assert bits == pytest.approx(np.round(bits))
        assert 12 <= bits[0] <= 16
        assert 15 <= bits[1] <= 18
        assert case.noise.link_step > 2.0 * case.noise.link_encoder
    # what is drawn in the other rows does not depend on it
    fine = draw_case(11, "one", 1).noise
    assert fine.link_step < 2.0 * fine.link_encoder


@pytest.mark.scenario
def test_rows_that_go_beyond_the_usual_do_so_and_leave_the_others_as_they_are() -> None:
    large = draw_case(11, "large", 0).planted[0]
    assert large.gap * 1.01 >= 0.05
    assert large.gap <= 0.2 * 1.01
    quiet = [draw_case(11, "quiet", 2 * k).noise for k in range(3)]
    assert not any(getattr(quiet[0], f.name) for f in fields(quiet[0]) if f.name != "jitter_speed")
    assert quiet[1].torque < 2e-4 < quiet[2].torque < 2e-3
    assert all(noise.jitter_speed >= 0.03 for noise in quiet)
    assert [draw_case(11, row, 0).periods for row in ("few", "none", "large")] == [5, 20, 20]
    slippery, usual = (truth_of(replace(draw_case(11, "frictionless", 0), row=row)) for row in ("frictionless", "few"))
    assert np.all(slippery.coulomb < 0.01 * usual.coulomb)
    assert np.all(slippery.viscous < 0.01 * usual.viscous)
    assert np.all(usual.stiffness > 0.0)


@pytest.mark.scenario
def test_other_robots_take_turns_with_and_without_something_hidden() -> None:
    cases = [draw_case(11, "others", k) for k in range(6)]
    assert [(case.robot, len(case.planted)) for case in cases] == [
        ("prosthesis", 0), ("oblique_arm", 1), ("torso", 0), ("prosthesis", 1), ("oblique_arm", 0), ("torso", 1),
    ]  # fmt: skip


@pytest.mark.scenario
def test_robots_that_exist_are_driven_within_their_limits() -> None:
    for index, name in enumerate(("anymal", "icub", "centauro", "panda", "talos")):
        case = draw_case(11, "existing", 2 * index)
        assert case.robot == ("anymal", "centauro", "talos", "icub", "panda")[index]
        assert not case.planted
        robot, limits = nominal_robot(name), nominal_robot(name).limits
        motion = draw_trajectory(name, 4.0, generator(11, index)).motion(np.linspace(0.0, 4.0, 400))
        assert np.all((motion.q > limits.lower) & (motion.q < limits.upper))
        assert np.all(np.abs(motion.dq) < limits.velocity)
        assert np.all(nominal_truth(name).coulomb > 0.0)
        assert robot.n == len(nominal_truth(name).viscous)


def test_another_joint_is_one_of_the_same_chain() -> None:
    rng = generator(9, 11)
    torso = gap.Gauge(drawn_truth("torso", rng), draw_trajectory("torso", 4.0, rng, candidates=2),
                      Friction("tanh", SMOOTHING), 2)  # fmt: skip
    names = torso.truth.robot.joint_names
    others = {name: names[catalogue.Place(torso, k, rng).other] for k, name in enumerate(names)}
    assert others == {"waist": "r_shoulder", "l_shoulder": "l_elbow", "l_elbow": "l_shoulder",
                      "r_shoulder": "r_elbow", "r_elbow": "r_shoulder"}  # fmt: skip


@pytest.mark.parametrize("index", range(8))
def test_robots_that_are_drawn_are_robots(index: int) -> None:
    """Every link weighs something, springs bend a little under it, and the same name is the same robot."""
    name = drawn_name(3, index)
    assert drawn_robot(name) == drawn_robot(name)
    robot, truth = nominal_robot(name), nominal_truth(name)
    assert 1 <= robot.n <= MOST_JOINTS
    gravity = np.abs([pin.computeGeneralizedGravity(robot.model, robot.model.createData(), q)
                      for q in np.random.default_rng(0).uniform(-1.0, 1.0, (200, robot.n))])  # fmt: skip
    for i in robot.elastic_indices:
        assert gravity[:, i].max() < 0.25 * truth.stiffness[i]
    assert np.all(truth.coulomb > 0.0)
    assert np.all(truth.viscous > 0.0)


class _Asked(Exception):
    """What a simulator was asked for."""


@pytest.mark.parametrize("engine", ["mujoco", "project"])
def test_what_drifts_does_so_by_the_clock_however_long_a_recording_is(monkeypatch, engine):
    """It is one robot: in the shorter recording it has not come as far."""
    drift = Planted("friction_drift", "knee", "library", 0.5, {"kind": 1.0}, 0.01, 0.01)
    case = replace(draw_case(11, "none", 0), robot="exo_leg", engine=engine, planted=(drift,))
    assert case.holdout_periods < case.periods

    def mujoco(*given, course=None, **options):
        if course is None:  # without noise, for the size of the torque
            return SimpleNamespace(tau_motor=np.ones((4, 3)))
        raise _Asked(course)

    def project(*given, effects, **options):
        raise _Asked(tuple((e.effect, tuple(e.values)) for e in effects))

    monkeypatch.setattr(generate, "simulate_mujoco", mujoco)
    monkeypatch.setattr(project_engine, "simulate", project)
    truth, (series, _) = truth_of(case), trajectories_of(case)
    asked = []
    for number, periods in enumerate((case.periods, case.holdout_periods)):
        with pytest.raises(_Asked) as found:
            generate._recording(case, truth, series, periods, case.planted, number, "")
        asked.append(found.value.args[0])
    assert asked[0] == asked[1]
    if engine == "mujoco":
        assert asked[0] == case.periods * case.period


def test_what_drifts_in_the_record_does_so_by_the_clock_too(leg: gap.Gauge) -> None:
    """Torque constants of a motor are no torque of it: its sensors have them."""
    drift = Planted("torque_constant_drift", "knee", "library", 0.5, {"kind": 0.0}, 0.01, 0.01)
    whole = leg.exact
    half = len(whole.motion) // 2
    course = 2.0 * float(whole.motion.time[-1])
    names, series = ("q", "dq", "ddq", "theta", "dtheta", "ddtheta"), whole.motion
    part = replace(
        whole,
        motion=Motion(series.time[:half], *(getattr(series, name)[:half] for name in names)),
        tau_motor=whole.tau_motor[:half],
        course=course,
    )
    told = [sensors.signals(each, leg.truth, (drift,))["tau_motor"] for each in (replace(whole, course=course), part)]
    np.testing.assert_array_equal(told[0][:half], told[1])
    # half of the way
    assert whole.tau_motor[-1, 1] / told[0][-1, 1] == pytest.approx(1.25, abs=0.01)


@pytest.mark.scenario
def test_a_link_that_swings_fast_on_its_spring_is_followed() -> None:
    truth, series = nominal_truth("centauro"), draw_trajectory("centauro", 5.0, generator(9, 12))
    exact = simulate_mujoco(truth, series, 1, settle=0, rate=50.0)
    again = simulate_mujoco(truth, series, 1, settle=0, rate=50.0, step=STEP / 8.0)
    assert np.max(np.abs(exact.motion.q - again.motion.q)) < 2e-4
