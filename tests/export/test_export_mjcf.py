"""The exported MJCF has the same torque in MuJoCo, springs and rotors included."""

import sys

import numpy as np
import pytest
from given import ROBOTS, brisk_motion, effects_of, identified, load, torque, values_of

from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.exceptions import ExportError, MissingExtraError
from sea_ident.export import build_mujoco_robot, collect_values, mjcf_text
from sea_ident.motion import Motion
from sea_ident.regressor import model_columns

mujoco = pytest.importorskip("mujoco", reason="MJCF is judged by MuJoCo: pip install 'sea-ident[mujoco]'")


@pytest.mark.parametrize("name", ROBOTS)
def test_inverse_dynamics_in_mujoco_agrees_to_nine_digits(name: str) -> None:
    robot = load(name)
    values, effects, psi = values_of(robot)
    motion = brisk_motion(robot)
    found = build_mujoco_robot(values).inverse_dynamics(motion)
    expected = torque(robot, effects, psi, motion)
    for one, other in zip(found, expected, strict=True):
        if any(robot.elastic):
            np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9 * max(np.abs(other).max(), 1.0))
    total = sum(expected)
    np.testing.assert_allclose(sum(found), total, rtol=0.0, atol=1e-9 * max(np.abs(total).max(), 1.0))


@pytest.mark.parametrize("name", ["exo_leg", "exo_leg_abduction", "baxter arm, rotors askew"])
def test_forward_dynamics_solve_the_equations_of_motion(name: str) -> None:
    """Accelerations in MuJoCo, put into the regressor, give back the torque that was applied."""
    robot = load(name)
    values, effects, psi = values_of(robot)
    mujoco_robot = build_mujoco_robot(values)
    model = mujoco_robot.model
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS
    data = mujoco.MjData(model)
    coulomb = [k for k, column in enumerate(model_columns(robot, effects)) if "coulomb" in column.name]
    psi[coulomb] = 0.0
    motion = brisk_motion(robot, 5)
    rng = np.random.default_rng(0)
    for k in range(5):
        mujoco_robot.set_state(data, motion.q[k], motion.dq[k], motion.theta[k], motion.dtheta[k])
        data.ctrl[:] = applied = rng.uniform(-10.0, 10.0, robot.n)
        mujoco.mj_forward(model, data)
        links, motors = data.qacc[mujoco_robot.links], data.qacc[mujoco_robot.motors] / robot.gear_ratios
        one = Motion(
            motion.time[:1], motion.q[k : k + 1], motion.dq[k : k + 1], links[None],
            motion.theta[k : k + 1], motion.dtheta[k : k + 1], motors[None],
        )  # fmt: skip
        on_links, on_motors = torque(robot, effects, psi, one)
        size = np.abs(robot.spring(robot.joint_names[0]).stiffness)
        np.testing.assert_allclose(on_links[0], 0.0, atol=1e-8 * size)
        np.testing.assert_allclose(on_motors[0], applied, atol=1e-8 * size)


def test_state_goes_in_and_comes_out() -> None:
    robot = load("exo_leg")
    mujoco_robot = build_mujoco_robot(values_of(robot)[0])
    data = mujoco.MjData(mujoco_robot.model)
    state = [np.arange(3.0) + 10.0 * k for k in range(4)]
    mujoco_robot.set_state(data, *state)
    for one, other in zip(mujoco_robot.get_state(data), state, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-14)


def test_rigid_gear_holds_its_rotor_to_the_joint() -> None:
    robot = load("kinova (rigid, geared)")
    mujoco_robot = build_mujoco_robot(values_of(robot)[0])
    model, data = mujoco_robot.model, mujoco.MjData(mujoco_robot.model)
    still = brisk_motion(robot, 1)
    mujoco_robot.set_state(data, still.q[0], np.zeros(6), still.q[0], np.zeros(6))
    data.ctrl[:] = [5.0, 20.0, 10.0, 1.0, 1.0, 1.0]
    for _ in range(300):
        mujoco.mj_step(model, data)
    q, _, theta, _ = mujoco_robot.get_state(data)
    assert np.abs(q - still.q[0]).max() > 0.01
    np.testing.assert_allclose(theta, q, atol=1e-3)


def test_hanging_leg_rests_where_its_springs_and_gravity_balance() -> None:
    robot = load("exo_leg")
    values, effects, psi = values_of(robot)
    mujoco_robot = build_mujoco_robot(values)
    model, data = mujoco_robot.model, mujoco.MjData(mujoco_robot.model)
    for _ in range(int(8.0 / model.opt.timestep)):
        data.ctrl[:] = 150.0 * (np.array([0.4, -0.3, 0.2]) - mujoco_robot.get_state(data)[2])
        data.ctrl[:] -= 10.0 * mujoco_robot.get_state(data)[3]
        mujoco.mj_step(model, data)
    q, dq, theta, _ = (x[None] for x in mujoco_robot.get_state(data))
    assert np.abs(dq).max() < 1e-3
    zero = np.zeros_like(q)
    on_links, _ = torque(robot, effects, psi, Motion(np.zeros(1), q, zero, zero, theta, zero, zero))
    gravity = np.abs(
        torque(robot, effects[:1], psi[: 10 * len(robot.bodies)], Motion.rigid(np.zeros(1), q, zero, zero))[0]
    )
    # link friction at rest may hold up to its Coulomb torque
    held = [psi[k] for k, c in enumerate(model_columns(robot, effects)) if c.name.endswith("link_friction_coulomb")]
    assert np.all(np.abs(on_links[0]) <= np.array(held) + 1e-3)
    assert gravity.max() > 1.0


def test_shapes_are_drawn_and_weigh_nothing() -> None:
    values, _, _ = values_of(load("exo_leg"))
    model = build_mujoco_robot(values).model
    assert model.ngeom > 10
    assert not np.any(model.geom_contype)
    assert not np.any(model.geom_conaffinity)
    total = sum(values.robot.model.inertias[k].mass for k in range(1, values.robot.model.njoints))
    assert sum(model.body(name).mass[0] for name in values.robot.bodies) == pytest.approx(total, rel=0.05)


def test_offset_works_against_the_motor() -> None:
    robot = load("exo_leg")
    effects = (*base_effects(robot), *spring_effects(robot), make_effect("torque_offset", "knee"))
    psi = identified(robot, effects)
    psi[-1] = 2.5
    motion = brisk_motion(robot)
    found = build_mujoco_robot(collect_values(robot, model_columns(robot, effects), psi)).inverse_dynamics(motion)
    expected = torque(robot, effects, psi, motion)
    np.testing.assert_allclose(found[1], expected[1], atol=1e-9 * np.abs(expected[1]).max())


def test_what_mujoco_cannot_hold_is_told() -> None:
    robot = load("exo_leg")
    effects = base_effects(robot)
    columns, psi = model_columns(robot, effects), identified(robot, effects)
    with pytest.raises(ExportError, match="spring of joint 'hip' has no stiffness; identify the springs first"):
        mjcf_text(collect_values(robot, columns, psi))
    effects = effects_of(robot)
    columns, psi = model_columns(robot, effects), identified(robot, effects)
    index = {column.name: k for k, column in enumerate(columns)}
    heavy = psi.copy()
    heavy[index["motor.rotor_inertia"]] = 1.0
    with pytest.raises(ExportError, match="link 'thigh': its inertia leaves no room for the rotors of 'knee'"):
        mjcf_text(collect_values(robot, columns, heavy))
    psi[index["hip.viscous_friction"]] = -1.0
    _, notes = mjcf_text(collect_values(robot, columns, psi))
    assert notes == ["negative, so that the exported robot gains energy: hip viscous friction"]


def test_how_much_a_link_lacks_for_its_rotor_is_told() -> None:
    robot = load("exo_leg")
    effects = effects_of(robot)
    columns, psi = model_columns(robot, effects), identified(robot, effects)
    psi[[column.name for column in columns].index("motor.rotor_inertia")] = 1.0
    with pytest.raises(ExportError, match=r"it lacks 0\.9\d+ kg m2 .* Count the rotors into the <inertia> of this"):
        mjcf_text(collect_values(robot, columns, psi))


def test_missing_mujoco_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    values, _, _ = values_of(load("exo_leg"))
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'sea-ident\[mujoco\]'"):
        build_mujoco_robot(values)
    assert mjcf_text(values)[0].startswith("<?xml")  # writing needs no MuJoCo
