"""`design_excitation` as a user calls it: inside all limits at all times, repeatable, better than chance."""

import threading
import warnings

import joblib
import numpy as np
import pytest

from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.exceptions import ExcitationError, InfeasibleError, SeaIdentWarning
from sea_ident.excitation import (
    AOptimality,
    ConditionNumber,
    Discrimination,
    DOptimality,
    EOptimality,
    PredictedMotors,
    design_excitation,
    reduced_effects,
)
from sea_ident.excitation.design_model import design_model
from sea_ident.excitation.feasibility import at_rest, inner_position, random_start
from sea_ident.excitation.linear_limits import linear_limits
from sea_ident.motion import FourierSeries
from sea_ident.regressor import build_regressor, inverse_dynamics

SMALL = {"harmonics": 4, "starts": 2, "rate": 50.0}
THOROUGH = {**SMALL, "starts": 6}


@pytest.fixture(scope="module")
def exo(robot_of):
    return robot_of("exo_leg")


@pytest.fixture(scope="module")
def designed(exo):
    return design_excitation(exo, starts=3, seed=1)


@pytest.fixture(scope="module")
def plain(exo):
    """A small design that others are compared with."""
    return design_excitation(exo, seed=0, **SMALL)


def violations(robot, series, points):
    """Largest excess over every linear limit on a grid, as a part of its range."""
    limits = linear_limits(robot, robot.limits)
    time = np.arange(points) * series.period / points
    worst = 0.0
    for k in range(len(limits)):
        values = series.evaluate(time, int(limits.derivative[k])) @ limits.joints[k]
        excess = max(limits.lower[k] - values.min(), values.max() - limits.upper[k])
        worst = max(worst, float(excess / limits.width[k]))
    return worst


def test_the_papers_problem(exo, designed):
    """63 variables, 2000 samples, 15 parameters; inside all limits on a grid 50 times finer."""
    assert designed.series.coefficients.size == 63
    assert designed.samples == 2000
    assert len(designed.parameters) == 15
    assert violations(exo, designed.series, 100_000) <= 1e-9
    assert all(margin >= 0.0 for margin in designed.margins.values())
    assert designed.log_det > 136.5
    # the paper reports a condition number of 12.6 for its leg
    assert designed.condition_number < 15.0


def test_log_det_is_that_of_the_regressor(exo, designed):
    effects = reduced_effects(exo)
    model, _ = design_model(exo, effects, DOptimality(), None)
    rows = build_regressor(exo, effects, designed.series.sample(200.0)).sum[:, :, model.columns.chosen]
    flat = rows.reshape(-1, 15)
    assert designed.log_det == pytest.approx(np.linalg.slogdet(flat.T @ flat)[1], abs=1e-8)
    assert designed.raw_condition_number == pytest.approx(np.linalg.cond(flat), rel=1e-6)
    assert designed.condition_number == pytest.approx(np.linalg.cond(flat / np.linalg.norm(flat, axis=0)), rel=1e-6)


def test_margins_are_smallest_distances(exo, designed):
    time = np.linspace(0.0, designed.period, 200_001)
    q, acceleration = designed.series.evaluate(time), designed.series.evaluate(time, 2)
    assert designed.margins["hip_knee_sum"] == pytest.approx((q[:, 0] + q[:, 1]).min() - 0.1, abs=1e-6)
    fastest = np.abs(acceleration[:, 2]).max()
    assert designed.margins["ankle.acceleration"] == pytest.approx(2.0 * np.pi - fastest, abs=1e-6)
    links, motors = inverse_dynamics(exo, designed.series.motion(time[::100]))
    # a torque margin is proven for all times, so that it is somewhat below the one at samples; friction is in it
    hip = np.abs((links + motors)[:, 0]).max()
    assert designed.margins["hip.torque"] <= 72.0 - hip
    assert designed.margins["hip.torque"] >= 72.0 - hip - 1.4 - 1.0 * np.pi - 3.6


def test_far_better_than_random_starts(exo, designed):
    limits = linear_limits(exo, exo.limits)
    centre = at_rest(inner_position(limits), 10)
    effects = reduced_effects(exo)
    model, criterion = design_model(exo, effects, DOptimality(), None)
    best = -np.inf
    for seed in range(20):
        point = random_start(limits, 0.1, centre, np.random.default_rng(seed))
        rows = model.columns.at(FourierSeries.from_coefficients(point, 0.1).sample(200.0)).columns()
        best = max(best, criterion.value(np.einsum("rpn,rsn->ps", rows, rows)))
    assert designed.log_det > best + 3.0


@pytest.mark.scenario
def test_same_seed_same_result_whatever_the_jobs(exo):
    first = design_excitation(exo, seed=5, jobs=1, **THOROUGH)
    again = design_excitation(exo, seed=5, jobs=2, **THOROUGH)
    other = design_excitation(exo, seed=6, jobs=2, **THOROUGH)
    np.testing.assert_array_equal(first.series.coefficients, again.series.coefficients)
    assert first.start_values == again.start_values
    assert other.log_det != first.log_det


def test_progress_rises_within_every_start(exo):
    seen = []
    lock = threading.Lock()

    def note(state):
        with lock:
            seen.append(state)

    design_excitation(exo, seed=2, jobs=2, progress=note, **SMALL)
    assert {state.start for state in seen} == {0, 1}
    for start in (0, 1):
        values = [state.value for state in seen if state.start == start]
        # the short climb and the long one count different samples: each of them rises
        drops = [k for k in range(1, len(values)) if values[k] <= values[k - 1]]
        assert len(drops) <= 1
    assert seen[-1].best == max(state.value for state in seen if state.step >= seen[-1].step - 100)


@pytest.mark.scenario
def test_every_criterion_is_best_in_its_own_sense(exo):
    """From no seed is a design worse, by its own criterion, than the D-optimal one; on average it is the best of all.

    The optima are local, and which one a climb ends in is a matter of rounding: of one start or two from one seed a
    design of a third criterion may be the better one.
    """
    criteria = [DOptimality(), AOptimality(), EOptimality(), ConditionNumber()]
    model, _ = design_model(exo, reduced_effects(exo), DOptimality(), None)
    table = np.zeros((4, 4, 4))  # seed, criterion that judges, criterion of the design
    for seed in range(4):
        for k, designed_for in enumerate(criteria):
            found = design_excitation(exo, seed=seed, criterion=designed_for, **THOROUGH)
            rows = model.columns.at(found.series.sample(50.0)).columns()
            matrix = np.einsum("rpn,rsn->ps", rows, rows)
            table[seed, :, k] = [criterion.reported(matrix) for criterion in criteria]
            assert found.value == pytest.approx(table[seed, k, k], rel=1e-9)
    for k, criterion in enumerate(criteria[1:], 1):
        assert np.all(table[:, k, k] >= table[:, k, 0] - 1e-9), (criterion.name, table[:, k])
    mean = table.mean(axis=0)
    np.testing.assert_array_equal(np.argmax(mean, axis=1), np.arange(4))


@pytest.mark.scenario
def test_what_is_raised_is_told_and_an_interrupted_design_is_of_its_criterion(exo, plain):
    """Every design begins with log det; what it then reports is its own criterion, however early it was stopped."""
    told: list[str] = []

    def stop_after(steps):
        def tell(state):
            told.append(state.criterion)
            if len(told) == steps:
                raise KeyboardInterrupt

        return tell

    complete = design_excitation(exo, seed=0, criterion=EOptimality(), progress=stop_after(10**6), jobs=1, **SMALL)
    assert list(dict.fromkeys(told)) == ["D", "E"]
    begun = told.index("E")
    values = []
    for steps in (5, begun + 1, begun + 5):
        told.clear()
        with pytest.warns(SeaIdentWarning, match="interrupted"):
            found = design_excitation(exo, seed=0, criterion=EOptimality(), progress=stop_after(steps), jobs=1, **SMALL)
        assert found.criterion == "E"
        assert all(margin >= 0.0 for margin in found.margins.values())
        values.append(found.value)
    # one that was stopped once the D-optimal one was there is no worse than that
    model, _ = design_model(exo, reduced_effects(exo), DOptimality(), None)
    rows = model.columns.at(plain.series.sample(50.0)).columns()
    least = EOptimality().reported(np.einsum("rpn,rsn->ps", rows, rows))
    assert min(values[1:]) >= least - 1e-9
    assert complete.value >= max(values) - 1e-9


@pytest.mark.scenario
@pytest.mark.parametrize("backend", ["threading", "loky"])
def test_other_processes_find_the_same(exo, backend):
    """By a criterion other than log det, so that both rounds are there."""
    problem = {"base_frequency": 0.2, "harmonics": 3, "starts": 4, "rate": 30.0, "criterion": AOptimality()}
    alone = design_excitation(exo, jobs=1, **problem)
    with joblib.parallel_config(backend=backend, n_jobs=2):
        apart = design_excitation(exo, jobs=2, **problem)
    np.testing.assert_array_equal(apart.series.coefficients, alone.series.coefficients)
    assert apart.start_values == alone.start_values


def test_given_start_inside_is_never_made_worse(exo, plain):
    again = design_excitation(exo, seed=99, start=plain.series.coefficients, harmonics=4, starts=1, rate=50.0)
    assert again.log_det >= plain.log_det - 0.05
    assert len(again.start_values) == 2


def test_a_trajectory_of_ones_own_is_judged_as_it_is(exo, plain):
    found = design_excitation(exo, start=plain.series.coefficients, harmonics=4, starts=0, rate=50.0)
    np.testing.assert_array_equal(found.series.coefficients, plain.series.coefficients)
    assert found.log_det == plain.log_det
    assert found.margins == plain.margins
    assert found.start_values == ()
    assert "as it was given" in found.summary()


def test_a_trajectory_of_ones_own_outside_the_limits_is_moved_inside(exo, plain):
    wide = plain.series.coefficients.copy()
    wide[:, :-1] *= 1.2
    with pytest.warns(SeaIdentWarning, match="start is outside the limits"):
        found = design_excitation(exo, start=wide, harmonics=4, starts=0, rate=50.0)
    assert min(found.margins.values()) >= 0.0
    assert violations(exo, found.series, 20_000) <= 1e-9
    assert found.log_det > plain.log_det - 2.0


def test_larger_gains_that_are_left_save_steps_and_cost_little(exo):
    steps = {}
    for factor in (1.0, 100.0):
        told = []
        found = design_excitation(
            exo, harmonics=4, starts=2, rate=50.0, jobs=1, tolerance_factor=factor, progress=told.append
        )
        steps[factor] = len(told), found.log_det
    assert steps[100.0][0] < 0.7 * steps[1.0][0]
    assert steps[1.0][1] - 1.5 < steps[100.0][1] <= steps[1.0][1]


def test_given_start_outside_is_moved_inside_and_said(exo):
    outside = np.zeros((3, 9))
    outside[:, -1] = 5.0
    with pytest.warns(SeaIdentWarning, match="start is outside the limits"):
        found = design_excitation(exo, start=outside, harmonics=4, starts=1, rate=50.0)
    assert violations(exo, found.series, 20_000) <= 1e-9
    assert any("moved inside" in text for text in found.warnings)


def test_information_that_is_there_already_turns_the_design_to_what_is_missing(exo, plain):
    model, _ = design_model(exo, reduced_effects(exo), DOptimality(), None)
    rows = model.columns.at(plain.series.sample(50.0)).columns()
    own = np.einsum("rpn,rsn->ps", rows, rows)
    # all is known well but the first three parameters
    vectors = np.eye(15)[:, 3:]
    known = 1e4 * vectors @ vectors.T @ own @ vectors @ vectors.T
    sequential = design_excitation(exo, seed=0, information=known, **SMALL)
    rows = model.columns.at(sequential.series.sample(50.0)).columns()
    new = np.einsum("rpn,rsn->ps", rows, rows)
    assert np.linalg.slogdet(known + new)[1] > np.linalg.slogdet(known + own)[1] + 0.2
    assert sequential.log_det == pytest.approx(np.linalg.slogdet(known + new)[1], abs=1e-6)


@pytest.mark.scenario
def test_noise_weights_count(exo, plain):
    """Twice the noise is a quarter of the information about each parameter; one noisy joint counts less."""
    double = design_excitation(exo, seed=0, noise=np.full(3, 2.0), **SMALL)
    assert double.log_det == pytest.approx(plain.log_det - 15.0 * np.log(4.0), abs=1e-3)
    noise = np.array([1.0, 1.0, 100.0])
    noisy = design_excitation(exo, seed=0, noise=noise, **SMALL)
    model, _ = design_model(exo, reduced_effects(exo), DOptimality(), None)

    def value(excitation):
        rows = model.columns.at(excitation.series.sample(50.0)).columns() / noise[:, None, None]
        return np.linalg.slogdet(np.einsum("rpn,rsn->ps", rows, rows))[1]

    assert noisy.log_det == pytest.approx(value(noisy), abs=1e-6)
    assert value(noisy) >= value(plain) - 0.3


@pytest.mark.scenario
def test_spring_columns_gain_from_a_design_that_includes_them(exo, plain):
    """The ankle of the paper: its spring is hardly loaded by a design for the rigid model."""
    effects = (*base_effects(exo), *spring_effects(exo))
    model, _ = design_model(exo, effects, DOptimality(), PredictedMotors())
    with_springs = design_excitation(exo, seed=0, effects=effects, motors=PredictedMotors(), **SMALL)
    assert len(with_springs.parameters) == 16 + 9
    from sea_ident.excitation.states import Sampling

    def spring_information(excitation):
        states = Sampling(0.1, 4, 500).elastic(excitation.series.coefficients, model.springs)
        rows = model.columns.at(states.motion).columns()
        covariance = np.linalg.inv(np.einsum("rpn,rsn->ps", rows, rows))
        ankle = [k for k, name in enumerate(model.names) if name.startswith("ankle.spring")]
        return -np.linalg.slogdet(covariance[np.ix_(ankle, ankle)])[1]

    assert spring_information(with_springs) > spring_information(plain) + 0.1


@pytest.mark.scenario
def test_discrimination_raises_what_tells_two_effects_apart(exo, plain):
    target, other = make_effect("stribeck_friction", "knee"), make_effect("nonlinear_viscous_friction", "knee")
    criterion = Discrimination(target, (other,))
    found = design_excitation(exo, seed=0, criterion=criterion, harmonics=4, starts=4, rate=50.0)
    assert found.criterion == "discrimination of knee.stribeck_friction from knee.nonlinear_viscous_friction"

    def left(excitation):
        motion = excitation.series.sample(50.0)
        rest = build_regressor(exo, (*reduced_effects(exo), other), motion).sum.reshape(-1, 37)
        column = build_regressor(exo, (target,), motion).sum.reshape(-1, 1)
        return float(np.linalg.norm(column - rest @ np.linalg.lstsq(rest, column, rcond=1e-10)[0]) ** 2)

    assert np.exp(found.value) == pytest.approx(left(found), rel=1e-3)
    assert left(found) > 1.1 * left(plain)


def test_discrimination_of_what_cannot_be_told_apart_is_refused(exo):
    """In the sum of link and motor row, friction of the link is friction of the motor: theta = q."""
    target = make_effect("link_friction", "knee")
    with pytest.raises(ExcitationError, match=r"no motion tells knee.link_friction from the model"):
        design_excitation(exo, criterion=Discrimination(target), **SMALL)
    with pytest.raises(ExcitationError, match=r"is part of the model already"):
        design_excitation(exo, criterion=Discrimination(make_effect("viscous_friction", "knee")), **SMALL)


def test_torque_limits_hold_between_samples(exo):
    """With limits a third above what gravity alone needs, torque decides; it is checked with the model's own RNEA."""
    bound = np.array([24.0, 9.0, 4.0])
    found = design_excitation(exo, seed=0, limits=exo.limits.replace(torque=bound), **SMALL)
    assert min(found.margins[f"{name}.torque"] for name in exo.joint_names) >= 0.0
    motion = found.series.motion(np.linspace(0.0, 10.0, 30_001))
    links, motors = inverse_dynamics(exo, motion)
    viscous, coulomb = np.array([1.0, 0.9, 0.6]), np.array([1.4, 1.2, 0.8])
    torque = links + motors + viscous * motion.dq + coulomb * np.tanh(motion.dq / 0.01)
    assert np.all(np.abs(torque) <= bound)
    # and it is used: the limit is active somewhere
    assert np.any(np.abs(torque).max(axis=0) > 0.97 * bound)


def test_deflection_limits(exo):
    found = design_excitation(exo, seed=0, limits=exo.limits.replace(deflection=np.array([0.025, 0.03, 0.02])), **SMALL)
    springs = PredictedMotors().springs(exo)
    motion = found.series.motion(np.linspace(0.0, 10.0, 20_001))
    deflection = springs.predict(motion)[0]
    assert np.all(np.abs(deflection).max(axis=0) <= np.array([0.025, 0.03, 0.02]) + 1e-12)
    assert "knee.spring_torque" in found.margins


@pytest.mark.scenario
def test_torque_that_gravity_alone_exceeds(exo):
    with pytest.raises(
        InfeasibleError, match=r"no position was found .* hip.torque: [\d.]+ N m, at most 0.5 N m. Widen"
    ):
        design_excitation(exo, limits=exo.limits.replace(torque=np.array([0.5, 50.0, 50.0])), **SMALL)


def test_joints_without_limits_get_stated_defaults(robot_of):
    robot = robot_of("exo_leg")
    free = np.full(3, np.inf)
    limits = robot.limits.replace(lower=-free, upper=free, velocity=free)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = design_excitation(robot, limits=limits, **SMALL)
    text = "\n".join(found.warnings)
    assert "joint 'hip' has no position limits; it is kept within +-3.142 rad" in text
    assert "joint 'ankle' has no velocity limit; it is kept within +-3.142 rad/s" in text
    # where springs take the links is told with the result alone
    assert len(caught) == 6
    assert [str(warning.message) for warning in caught] == list(found.warnings[:6])


@pytest.mark.parametrize("name", ["emps", "quanser_2dof", "baxter wrist"])
def test_other_robots(robot_of, name):
    robot = robot_of(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = design_excitation(robot, **SMALL)
    assert np.isfinite(found.log_det)
    assert all(margin >= 0.0 for margin in found.margins.values())


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"base_frequency": 0.0}, "base_frequency is 0.0 Hz"),
        ({"base_frequency": np.nan}, "base_frequency is nan Hz"),
        ({"harmonics": 0}, "at least 1"),
        ({"starts": 0}, "starts is 0"),
        ({"rate": 0.5}, "not below half the sampling rate"),
        ({"rate": np.nan}, "rate is nan"),
        ({"information": np.eye(3)}, r"it must be a finite \(15, 15\) matrix"),
        ({"information": -np.eye(15)}, "negative eigenvalue"),
        ({"noise": np.array([1.0, 0.0, 1.0])}, "3 positive standard deviations"),
        ({"start": np.zeros((2, 9))}, r"must hold \(3, 9\) finite coefficients"),
        ({"start": np.full((3, 9), np.nan)}, "finite coefficients"),
        ({"start": "home"}, "start is 'home'; give an array of numbers"),
        ({"noise": "low"}, "noise is 'low'"),
        ({"information": "much"}, "information is 'much'"),
        ({"harmonics": 2.5}, "harmonics is 2.5; it must be a whole number"),
        ({"harmonics": 1000}, "1000 harmonics of 0.1 Hz reach 100 Hz, which is not below half the sampling rate"),
        ({"seed": -1}, "seed is -1"),
        ({"tolerance_factor": 0.0}, "tolerance_factor is 0.0; it must be a positive number"),
        ({"tolerance_factor": np.inf}, "tolerance_factor is inf"),
        ({"effects": ()}, "effects is empty"),
    ],
)
def test_bad_input(exo, changes, says):
    with pytest.raises(ExcitationError, match=says):
        design_excitation(exo, **{"harmonics": 4, "starts": 1, **changes})


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"lower": np.zeros(2)}, r"limits.lower: has shape \(2,\); it must be \(3,\)"),
        ({"velocity": 2.0}, r"limits.velocity: has shape \(\)"),
        ({"torque": "strong"}, "limits.torque is 'strong'"),
        ({"velocity": np.array([np.nan, 1.0, 1.0])}, "hip.velocity: is NaN"),
        ({"torque": np.array([1.0, np.nan, 1.0])}, "knee.torque: is nan"),
        ({"deflection": np.array([1.0, 1.0, -1.0])}, "ankle.deflection: is -1"),
        ({"velocity": np.array([0.0, 1.0, 1.0])}, "hip.velocity: the range is zero"),
        ({"upper": np.array([1e-12, 0.0, 1.0])}, "hip.position: the range is zero"),
        ({"upper": np.array([-1.0, 0.0, 1.0])}, "hip.position: lower limit 0 rad is above upper limit -1 rad"),
        ({"upper": np.full(3, 1e300)}, "limits.upper: .* is larger than any robot"),
        ({"combinations": np.eye(3)}, r"limits.combinations: has shape \(3, 3\); it must be \(1, 3\) \(1 names"),
        ({"combinations": np.full((1, 3), np.nan)}, "not finite"),
        ({"combination_lower": np.zeros(0)}, "limits.combination_lower: has shape"),
    ],
)
def test_limits_that_make_no_sense(exo, changes, says):
    with pytest.raises(ExcitationError, match=says):
        design_excitation(exo, limits=exo.limits.replace(**changes), **SMALL)


def test_springs_without_predicted_motors(exo):
    with pytest.raises(ExcitationError, match=r"give motors=PredictedMotors\(\)"):
        design_excitation(exo, effects=(*base_effects(exo), *spring_effects(exo)), **SMALL)


def test_predicted_motors_without_stiffness(robot_of):
    with pytest.raises(ExcitationError, match="no elastic joint"):
        design_excitation(robot_of("ur10"), motors=PredictedMotors(), **SMALL)


def test_interruption_returns_the_best_so_far(exo):
    calls = []

    def interrupt(state):
        calls.append(state)
        if len(calls) == 12:
            raise KeyboardInterrupt

    with pytest.warns(SeaIdentWarning, match="interrupted"):
        found = design_excitation(exo, harmonics=4, starts=6, rate=50.0, jobs=1, progress=interrupt)
    assert len(found.start_values) < 6
    assert violations(exo, found.series, 20_000) <= 1e-9
    assert found.log_det > 0.0


@pytest.mark.scenario
def test_very_many_harmonics_are_begun_at_once_and_can_be_interrupted(exo):
    """1023 coefficients: said before the first step, the first step comes soon, and what is there then is inside."""
    values = []

    def interrupt(state):
        values.append(state.value)
        if len(values) == 3:
            raise KeyboardInterrupt

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = design_excitation(exo, harmonics=170, starts=2, rate=50.0, jobs=1, progress=interrupt)
    texts = [str(warning.message) for warning in caught]
    assert len(texts) == len(set(texts)) == len(found.warnings) == 3
    assert "170 harmonics of 3 joints are 1023 coefficients, up to 17 Hz" in texts[0]
    assert "interrupted" in texts[1]
    assert "harmonics up to 17 Hz come near the" in texts[2]
    assert values == sorted(values)
    assert all(margin >= 0.0 for margin in found.margins.values())
    assert violations(exo, found.series, 20_000) <= 1e-9
