"""A push does the work of a force on the point that it meets."""

import numpy as np
import pinocchio as pin
import pytest

import sea_ident
from sea_ident.effects import SimulationState, State, make_effect
from sea_ident.motion import FourierSeries, Motion
from sea_ident.simulation import FrictionJitter, PlantedEffect, SensorNoise, simulate

FORCE, STEP = np.array([3.0, -1.0, 2.0]), 1e-6


def place(robot, joint, q, point):
    """(3,) of a point of the link that a joint moves, given from its centre of mass."""
    model = robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    index = model.getJointId(joint)
    return data.oMi[index].act(model.inertias[index].lever + point)


@pytest.mark.parametrize("point", [np.zeros(3), np.array([0.1, -0.2, 0.3])], ids=["centre", "elsewhere"])
@pytest.mark.parametrize("joint", ["knee", "ankle"])
def test_its_power_is_that_of_the_force(joint, point):
    robot = sea_ident.load_robot("exo_leg")
    rng = np.random.default_rng(1)
    motion = Motion(np.arange(5) * 0.01, *rng.standard_normal((6, 5, robot.n)))
    effect = make_effect(
        "external_force", joint, **{f"point_{axis}": float(v) for axis, v in zip("xyz", point, strict=True)}
    )
    rows = effect.evaluate(State(robot, motion)).link @ FORCE
    for k, (q, dq) in enumerate(zip(motion.q, motion.dq, strict=True)):
        ahead, behind = (place(robot, joint, q + sign * STEP * dq, point) for sign in (1.0, -1.0))
        power = FORCE @ (ahead - behind) / (2.0 * STEP)
        assert rows[k] @ dq == pytest.approx(-power, rel=1e-6, abs=1e-7)
        link, motor = np.zeros(robot.n), np.zeros(robot.n)
        rest = (dq, motion.theta[k], motion.dtheta[k], link, motor)
        effect.torque(robot, FORCE)(SimulationState(0.0, q, *rest), link, motor)
        np.testing.assert_allclose(link, rows[k], atol=1e-12)


@pytest.mark.parametrize(("start", "stop"), [(1.234, 2.718), (3.9, 0.35), (1.2, 1.2031)])
def test_it_pushes_for_as_long_as_it_does_between_samples_too(start, stop):
    """The sum of the shares is the time that it pushes, and where it pushes all the time they are one."""
    period, samples = 4.0, 400
    time = np.arange(samples) * period / samples
    effect = make_effect("external_force", "knee", start=start, stop=stop, period=period)
    share = effect.share_of(time)
    assert np.sum(share) * period / samples == pytest.approx((stop - start) % period, abs=1e-9)
    inside = effect.pushes(time - 0.5 * period / samples) & effect.pushes(time + 0.5 * period / samples)
    if stop > start + 0.01:
        np.testing.assert_allclose(share[inside], 1.0)
    # the centre of gravity in time is where it should be
    if stop > start:
        assert np.sum(share * time) / np.sum(share) == pytest.approx(0.5 * (start + stop), abs=2e-3)
    np.testing.assert_allclose(make_effect("external_force", "knee").share_of(time), 1.0)


@pytest.mark.parametrize(
    ("start", "stop"), [(0.1236, 0.3043), pytest.param(0.1261, 0.3012, marks=pytest.mark.scenario)]
)
def test_a_simulation_hangs_on_no_step_that_an_edge_falls_into(start, stop):
    """Off by a millisecond, an edge would move the links by 1e-4 rad and more."""
    leg, series = sea_ident.load_robot("exo_leg"), FourierSeries(2.0, np.zeros(3), *np.full((2, 3, 1), 0.05))
    push = PlantedEffect(make_effect("external_force", "knee", start=start, stop=stop, period=0.5), 5.0 * FORCE)
    motions = [
        simulate(
            leg, series, periods=1, effects=[push], sensors=SensorNoise.none(), jitter=FrictionJitter.none(), step=step
        ).motion
        for step in (None, 1e-3)
    ]
    assert np.abs(motions[0].q - motions[1].q).max() < 1e-5


def test_what_pushes_once_pushes_from_the_begin_of_a_recording_to_its_end():
    effect = make_effect("external_force", "knee")
    assert [effect._share_around(time) for time in (-1e-3, 0.0, 1e-3, 1.0)] == [0.0, 1.0, 1.0, 1.0]
    late = make_effect("external_force", "knee", start=1.0, stop=2.0)
    shares = [late._share_around(time) for time in (0.5, 1.0, 1.5, 2.0, 2.5)]
    assert shares == pytest.approx([0.0, 0.5, 1.0, 0.5, 0.0])


@pytest.mark.parametrize("count", [2, 7])
def test_periods_one_after_the_other_have_the_shares_of_each(count):
    """Whichever are looked at together: what would differ between halves of a recording would be a trend in it."""
    period = 4.0
    time = np.arange(400) * period / 400
    effect = make_effect("external_force", "knee", start=1.2345, stop=1.5678, period=period)
    np.testing.assert_allclose(effect.share_of(np.tile(time, count)), np.tile(effect.share_of(time), count))


def test_pushes_are_sums_of_those_from_every_edge_to_the_next():
    period = 4.0
    robot = sea_ident.load_robot("exo_leg")
    rng = np.random.default_rng(2)
    state = State(robot, Motion(np.arange(80) * period / 80, *rng.standard_normal((6, 80, robot.n))))
    windows = [(0.0, 1.0), (0.513, 3.207), (3.2, 0.35), (3.975, 3.975 - 1e-11), (1.0, 1.0), (3.207, 0.513)]
    pushes = [make_effect("external_force", "knee", start=a, stop=b, period=period, point_x=0.1) for a, b in windows]
    pieces, amounts = type(pushes[0]).in_pieces(pushes)
    assert len(pieces) == len({time for window in windows for time in window})
    each = np.stack([piece.evaluate(state).link for piece in pieces])
    whole = np.stack([push.evaluate(state).link for push in pushes])
    np.testing.assert_allclose(np.tensordot(amounts, each, axes=1), whole, atol=1e-12 * np.abs(whole).max())


@pytest.mark.parametrize("other", [{"period": 0.0}, {"point_x": 0.1}])
def test_pushes_that_differ_by_more_than_their_edges_stand_for_themselves(other):
    push = make_effect("external_force", "knee", start=1.0, stop=2.0, period=4.0 * ("point_x" in other))
    pushes = [push, make_effect("external_force", "knee", **(push.shape_values | {"period": push.period} | other))]
    assert type(push).in_pieces(pushes) == (pushes, None)
