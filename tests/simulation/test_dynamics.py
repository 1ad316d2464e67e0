import numpy as np
import pinocchio as pin
import pytest
from plants import Wave, baxter_arm, from_parts, joint, link, mixed_arm, modest_series, motor, ur10
from scipy.integrate import simpson, solve_ivp

from sea_ident import Motion, build_regressor, load_robot
from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.regressor import inverse_dynamics
from sea_ident.simulation import PlantedEffect, PreslidingCoulomb, Settling, SmoothCoulomb, VelocityController, simulate


def full_model(robot):
    link_friction = [make_effect("link_friction", j.name) for j in robot.joints if j.elastic]
    return (*base_effects(robot), *spring_effects(robot), *link_friction)


@pytest.mark.parametrize(
    "build",
    [
        lambda: load_robot("exo_leg"),
        lambda: load_robot("exo_leg_link_friction"),
        lambda: load_robot("exo_leg_abduction"),
        ur10,
        baxter_arm,
        mixed_arm,
    ],
    ids=["leg", "link friction", "axes not parallel", "rigid arm", "seven springs", "mixed"],
)
def test_recorded_states_satisfy_the_regressor(build, quiet):
    robot = build()
    series = modest_series(robot)
    simulation = simulate(robot, series, periods=1, start=series.motion(np.zeros(1)), **quiet)
    model = full_model(robot)
    psi = np.nan_to_num(simulation.plant.values_of(model))
    regressor = build_regressor(robot, model, simulation.motion)
    size = np.abs(simulation.tau_motor).max()
    assert size > 0.1
    np.testing.assert_allclose(regressor.sum @ psi, simulation.tau_motor, atol=1e-10 * max(size, 1.0))
    elastic = robot.elastic_indices
    np.testing.assert_allclose((regressor.link @ psi)[:, elastic], 0.0, atol=1e-10 * max(size, 1.0))


def test_spring_law_and_link_rows_give_the_same_spring_torque(exact):
    plant, motion = exact.plant, exact.motion
    d, rate = motion.deflection, motion.deflection_rate
    law = plant.stiffness * d + plant.cubic_stiffness * d**3 + plant.spring_damping * rate
    link_rows, _ = inverse_dynamics(plant.robot, motion)
    np.testing.assert_allclose(exact.tau_spring, law, atol=1e-12)
    np.testing.assert_allclose(exact.tau_spring, link_rows, atol=1e-11)
    cubic_share = np.abs(plant.cubic_stiffness * d**3).max(axis=0) / np.abs(law).max(axis=0)
    assert cubic_share[0] > 0.01


def pendulum():
    return from_parts(
        '<link name="base"/>',
        link("bob"),
        joint("a", "base", "bob", "0 1 0"),
        motor("a", 'stiffness="150" cubicStiffness="3000" damping="0.7"'),
    )


@pytest.mark.parametrize("error", [0.0, 0.5, -0.5])
def test_elastic_pendulum_against_its_equations_written_by_hand(quiet, error):
    """Also with a motor that gives another torque than it is asked for."""
    robot = pendulum()
    controller = Wave((6.0,), 9.0, (40.0,), (2.0,))
    motion = Motion.rigid(np.linspace(0.0, 2.0, 401), *(np.zeros((401, 1)) for _ in range(3)))
    start = Motion(np.zeros(1), *(np.full((1, 1), v) for v in (0.3, -0.5, 0.0, 0.35, 0.2, 0.0)))
    planted = [PlantedEffect(make_effect("torque_constant", robot.joint_names[0]), np.array([error]))]
    options = {**quiet, "friction": SmoothCoulomb(0.05), "effects": planted}
    simulation = simulate(robot, motion, controller=controller, start=start, step=3.125e-4, **options)

    inertia, moment, reflected = 0.04 + 2.0 * 0.3**2, 2.0 * 0.3, 80.0**2 * 3e-5

    def rates(t, y):
        q, theta, dq, dtheta = y
        spring = 150.0 * (theta - q) + 3000.0 * (theta - q) ** 3 + 0.7 * (dtheta - dq)
        drive = 6.0 * np.cos(9.0 * t) - 40.0 * theta - 2.0 * dtheta
        friction = 0.4 * dtheta + 0.6 * np.tanh(dtheta / 0.05)
        return [
            dq,
            dtheta,
            (spring - moment * 9.81 * np.sin(q)) / inertia,
            ((drive - friction) / (1.0 + error) - spring) / reflected,
        ]

    truth = solve_ivp(
        rates, (0.0, 2.0), [0.3, 0.35, -0.5, 0.2], "LSODA", simulation.motion.time, rtol=1e-10, atol=1e-12
    )
    assert truth.success
    got = np.hstack([simulation.motion.q, simulation.motion.theta, simulation.motion.dq, simulation.motion.dtheta])
    np.testing.assert_allclose(got[:, :2], truth.y[:2].T, atol=2e-6)
    np.testing.assert_allclose(got[:, 2:], truth.y[2:].T, atol=2e-4)


# Presliding friction has a kink at every reversal, so that its order lies between two and three.
@pytest.mark.parametrize(
    ("law", "least"), [(SmoothCoulomb(0.03), 2.6), (PreslidingCoulomb(2e-3), 1.5)], ids=["smooth", "presliding"]
)
def test_error_falls_with_a_power_of_the_step(leg, leg_series, quiet, exact, law, least):
    options = {**quiet, "friction": law, "periods": 1, "start": exact.motion}
    runs = [simulate(leg, leg_series, step=0.005 / n, **options) for n in (1, 4, 16)]
    errors = [np.abs(run.motion.q - runs[-1].motion.q).max() for run in runs[:-1]]
    assert np.log2(errors[0] / errors[1]) / 2.0 > least
    assert errors[0] < 3e-5


@pytest.mark.scenario
@pytest.mark.parametrize("error", [0.5, -0.5])
def test_the_order_stays_where_a_motor_is_asked_for_another_torque(leg, leg_series, quiet, exact, error):
    planted = [PlantedEffect(make_effect("torque_constant", name), np.array([error])) for name in leg.joint_names]
    options = {**quiet, "friction": SmoothCoulomb(0.03), "periods": 1, "start": exact.motion, "effects": planted}
    runs = [simulate(leg, leg_series, step=0.005 / n, **options) for n in (1, 4, 16)]
    errors = [np.abs(run.motion.q - runs[-1].motion.q).max() for run in runs[:-1]]
    assert np.log2(errors[0] / errors[1]) / 2.0 > 2.5


def test_energy_balance(leg, leg_series, quiet, exact):
    simulation = simulate(leg, leg_series, periods=1, rate=800.0, step=6.25e-4, start=exact.motion, **quiet)
    motion, plant = simulation.motion, simulation.plant
    model = leg.extended_model
    data = model.createData()
    x, v = leg.extended_state(motion.q, motion.theta), leg.extended_rate(motion.dq, motion.dtheta)
    d = motion.deflection
    stored = np.sum(plant.stiffness * d**2 / 2.0 + plant.cubic_stiffness * d**4 / 4.0, axis=1)
    energy = stored + [pin.computeMechanicalEnergy(model, data, x[k], v[k]) for k in range(len(motion))]
    friction = plant.viscous_friction * motion.dtheta + plant.coulomb_friction * np.tanh(motion.dtheta / 0.01)
    given = np.sum(simulation.tau_motor * motion.dtheta, axis=1)
    lost = np.sum(friction * motion.dtheta + plant.spring_damping * motion.deflection_rate**2, axis=1)
    whole = slice(0, len(motion) // 2 * 2 - 1)
    change = energy[whole][-1] - energy[0]
    exchanged = simpson(np.abs(given[whole]), x=motion.time[whole])
    assert lost.min() > -1e-12
    assert exchanged > 1.0
    assert abs(change - simpson((given - lost)[whole], x=motion.time[whole])) < 2e-6 * exchanged


def test_momentum_changes_by_gravity_and_the_force_on_the_base(quiet):
    robot = load_robot("exo_leg_abduction")
    series = modest_series(robot)
    begin = series.motion(np.zeros(1))
    simulation = simulate(robot, series, periods=1, rate=800.0, step=6.25e-4, start=begin, **quiet)
    motion, model = simulation.motion, robot.extended_model
    data = model.createData()
    x, v = robot.extended_state(motion.q, motion.theta), robot.extended_rate(motion.dq, motion.dtheta)
    a = robot.extended_rate(motion.ddq, motion.ddtheta)
    on_base = [k for k in range(1, model.njoints) if model.parents[k] == 0]
    momentum, wrench = np.empty((len(motion), 6)), np.empty((len(motion), 6))
    for k in range(len(motion)):
        pin.computeCentroidalMomentum(model, data, x[k], v[k])
        centre, h = data.com[0], data.hg
        momentum[k] = np.r_[h.linear, h.angular + np.cross(centre, h.linear)]
        weight = data.mass[0] * np.array([0.0, 0.0, -9.81])
        pin.rnea(model, data, x[k], v[k], a[k])
        base = sum((data.oMi[j].act(data.f[j]) for j in on_base), start=pin.Force.Zero())
        wrench[k] = np.r_[base.linear + weight, base.angular + np.cross(centre, weight)]
    whole = slice(0, len(motion) // 2 * 2 - 1)
    change = momentum[whole][-1] - momentum[0]
    largest = np.abs(momentum).max(axis=0)
    np.testing.assert_allclose(simpson(wrench[whole], x=motion.time[whole], axis=0), change, atol=1e-5 * largest.max())


def test_angular_momentum_about_a_free_vertical_axis_is_kept(quiet):
    free = joint("turret", "base", "one", "0 0 1")
    robot = from_parts(
        '<link name="base"/>', link("one", "0.1 0.02 -0.1"), link("two", "0.05 0 -0.2"), free,
        joint("elbow", "one", "two", "0.6 0.8 0"), motor("elbow", 'stiffness="200" damping="0.5"'),
    )  # fmt: skip
    samples = 401
    still = Motion.rigid(np.linspace(0.0, 2.0, samples), *(np.zeros((samples, 2)) for _ in range(3)))
    start = Motion(
        np.zeros(1), *(np.array([row]) for row in ([0.1, 0.2], [2.0, 0], [0, 0], [0.1, 0.3], [2.0, 0], [0, 0]))
    )
    wave = Wave((0.0, 8.0), 7.0, (0.0, 30.0), (0.0, 2.0))
    simulation = simulate(robot, still, controller=wave, start=start, step=1.25e-3, **quiet)
    motion, model = simulation.motion, robot.extended_model
    data = model.createData()
    x, v = robot.extended_state(motion.q, motion.theta), robot.extended_rate(motion.dq, motion.dtheta)
    momentum = np.empty(len(motion))
    axis = model.jointPlacements[model.getJointId("turret")].translation
    for k in range(len(motion)):
        pin.computeCentroidalMomentum(model, data, x[k], v[k])
        momentum[k] = data.hg.angular[2] + np.cross(data.com[0] - axis, data.hg.linear)[2]
    assert np.ptp(motion.dq[:, 0]) > 0.3
    np.testing.assert_allclose(momentum, momentum[0], rtol=2e-6)


@pytest.mark.scenario
def test_stiff_friction_and_light_links_stay_stable_at_the_default_step(quiet):
    robot = baxter_arm()
    simulation = simulate(
        robot, modest_series(robot), periods=1, **{**quiet, "friction": SmoothCoulomb(1e-3)},
        controller=VelocityController(bandwidth=150.0, correction=30.0), settling=Settling(longest=2),
    )  # fmt: skip
    assert np.abs(simulation.motion.theta - simulation.reference.theta).max() < 0.02
