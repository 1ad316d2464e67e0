"""Files of an excitation, ramps, and the trajectory that a controller plays."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from sea_ident.exceptions import ExcitationError, InfeasibleError
from sea_ident.excitation import (
    Excitation,
    Ramp,
    design_excitation,
    read_excitation,
    sample_trajectory,
    write_trajectory_csv,
)
from sea_ident.excitation.curvature_bounds import MotionBounds, proven_margins, torque_bend
from sea_ident.excitation.dynamic_limits import dynamic_limits
from sea_ident.excitation.linear_limits import linear_limits
from sea_ident.excitation.ramp import design_ramp
from sea_ident.motion import FourierSeries
from sea_ident.regressor import inverse_dynamics


@pytest.fixture(scope="module")
def exo(robot_of):
    return robot_of("exo_leg")


@pytest.fixture(scope="module")
def designed(exo):
    return design_excitation(exo, harmonics=4, starts=1, rate=50.0, ramp=Ramp(duration=2.0))


def test_round_trip(designed, tmp_path):
    path = tmp_path / "excitation.json"
    designed.save(path)
    found = read_excitation(path)
    assert isinstance(found, Excitation)
    assert found.to_dict() == designed.to_dict()
    np.testing.assert_array_equal(found.series.coefficients, designed.series.coefficients)
    np.testing.assert_array_equal(found.ramp_in.points, designed.ramp_in.points)
    assert found.limits["hip_knee_sum"] == (0.1, np.inf)
    assert [p.name for p in tmp_path.iterdir()] == ["excitation.json"]


def test_files_of_earlier_versions_have_no_margins_of_links(designed, tmp_path):
    record = designed.to_dict()
    assert record["link_margins"]["hip.position"] == designed.link_margins["hip.position"]
    del record["link_margins"]
    (tmp_path / "old.json").write_text(json.dumps(record))
    assert read_excitation(tmp_path / "old.json").link_margins == {}
    (tmp_path / "other.json").write_text(json.dumps({**record, "link_margins": {"wing.position": 0.0}}))
    with pytest.raises(ExcitationError, match="link_margins names limits that are not among the limits"):
        read_excitation(tmp_path / "other.json")


def test_without_ramps(designed, tmp_path):
    plain = replace(designed, ramp_in=None, ramp_out=None)
    plain.save(tmp_path / "plain.json")
    assert read_excitation(tmp_path / "plain.json").ramp_in is None
    motion = sample_trajectory(plain, 100.0, periods=2)
    assert len(motion) == 2000
    np.testing.assert_allclose(motion.q, plain.series.evaluate(motion.time), atol=1e-13)


def test_summary_says_what_matters(designed):
    text = designed.summary()
    assert "log det" in text
    assert "hip_knee_sum" in text
    assert "ramps" in text


def _damaged(record):
    yield "not JSON", "{"
    yield "other", json.dumps({"format": "else"})
    yield "version", json.dumps({**record, "version": 99})
    yield "missing", json.dumps({k: v for k, v in record.items() if k != "offset"})
    yield "shape", json.dumps({**record, "a": record["a"][:-1]})
    yield "nan", json.dumps({**record, "offset": [None] * len(record["offset"])})
    yield "frequency", json.dumps({**record, "base_frequency": -1.0})
    yield "limits", json.dumps({**record, "limits": {}})
    yield "ramp", json.dumps({**record, "ramp_in": {"knots": [0, 1], "points": [[0]], "phase": 0}})
    yield "list", json.dumps([1, 2])


def test_damaged_files(designed, tmp_path):
    for name, text in _damaged(designed.to_dict()):
        path = tmp_path / "damaged.json"
        path.write_text(text)
        with pytest.raises(ExcitationError, match=r"damaged\.json"):
            read_excitation(path)
        assert name
    with pytest.raises(ExcitationError, match="cannot be read"):
        read_excitation(tmp_path / "absent.json")


def test_unwritable(designed, tmp_path):
    with pytest.raises(ExcitationError, match="does not exist"):
        designed.save(tmp_path / "nowhere" / "excitation.json")
    with pytest.raises(ExcitationError, match="does not exist"):
        write_trajectory_csv(designed, tmp_path / "nowhere" / "t.csv")


def test_trajectory_starts_and_ends_at_rest_inside_all_limits(exo, designed):
    rate = 2000.0
    motion = sample_trajectory(designed, rate, periods=2)
    np.testing.assert_allclose(motion.dq[[0, -1]], 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.ddq[[0, -1]], 0.0, atol=1e-9)
    limits = linear_limits(exo, exo.limits)
    states = (motion.q, motion.dq, motion.ddq)
    for k in range(len(limits)):
        values = states[int(limits.derivative[k])] @ limits.joints[k]
        assert values.min() >= limits.lower[k] - 1e-9 * limits.width[k]
        assert values.max() <= limits.upper[k] + 1e-9 * limits.width[k]
    # position, velocity and acceleration belong together, across the junctions too
    jerk = np.abs(np.diff(motion.ddq, axis=0)).max() * rate
    predicted = motion.q[:-1] + motion.dq[:-1] / rate + motion.ddq[:-1] / (2.0 * rate**2)
    np.testing.assert_allclose(motion.q[1:], predicted, atol=1.01 * jerk / (6.0 * rate**3) + 1e-12)
    assert motion.time[-1] >= 2.0 * designed.period + 4.0


def test_ramps_keep_torque_limits(exo):
    bound = np.array([26.0, 10.0, 5.0])
    found = design_excitation(
        exo, harmonics=3, starts=1, rate=50.0, limits=exo.limits.replace(torque=bound), ramp=Ramp(duration=1.0)
    )
    motion = sample_trajectory(found, 2000.0)
    links, motors = inverse_dynamics(exo, motion)
    viscous, coulomb = np.array([1.0, 0.9, 0.6]), np.array([1.4, 1.2, 0.8])
    torque = links + motors + viscous * motion.dq + coulomb * np.tanh(motion.dq / 0.01)
    assert np.all(np.abs(torque) <= bound)


def test_impossible_ramp(exo, designed):
    limits = linear_limits(exo, exo.limits)
    with pytest.raises(InfeasibleError, match="ask for a longer one"):
        design_ramp(designed.series, limits, 1.0, designed.series.offset, lambda ramp: False)
    with pytest.raises(ExcitationError, match="duration of the ramp is -1"):
        design_excitation(exo, harmonics=2, starts=1, rate=50.0, ramp=Ramp(duration=-1.0))


def test_csv(designed, tmp_path):
    path = tmp_path / "trajectory.csv"
    write_trajectory_csv(designed, path, rate=50.0)
    with open(path, newline="") as stream:
        rows = list(csv.reader(stream))
    assert rows[0] == ["time", *(f"{k}_{j}" for k in ("q", "dq", "ddq") for j in ("hip", "knee", "ankle"))]
    motion = sample_trajectory(designed, 50.0)
    table = np.array(rows[1:], dtype=float)
    np.testing.assert_array_equal(table, np.column_stack([motion.time, motion.q, motion.dq, motion.ddq]))


def test_csv_bad_input(designed, tmp_path):
    with pytest.raises(ExcitationError, match="needs more than"):
        write_trajectory_csv(designed, tmp_path / "t.csv", rate=0.7)
    with pytest.raises(ExcitationError, match="periods is 0"):
        write_trajectory_csv(designed, tmp_path / "t.csv", periods=0)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["exo_leg", "ur10", "panda", "tiago"])
def test_bend_of_torques_is_bounded(robot_of, name):
    """The bound on the second derivative of torque, against differences of Pinocchio's RNEA."""
    robot = robot_of(name)
    rng = np.random.default_rng(0)
    for size in (0.05, 0.4):
        series = FourierSeries(0.1, rng.normal(size=robot.n) * 0.3, *(size * rng.normal(size=(2, robot.n, 5))))
        step = 2e-3
        links, motors = inverse_dynamics(robot, series.motion(np.arange(0.0, 10.0, step)))
        bend = np.abs(np.diff(links, 2, axis=0)).max(axis=0) / step**2
        bound = torque_bend(robot, MotionBounds.of(series))
        assert np.all(bend <= np.abs(robot.link_map).T @ bound)
        bend = np.abs(np.diff(motors, 2, axis=0)).max(axis=0) / step**2
        assert np.all(bend <= np.abs(robot.motor_map).T @ bound + 1e-3)


def test_proven_margin_is_a_lower_bound_and_not_far_off(exo):
    limits = dynamic_limits(exo, exo.limits, [])
    rng = np.random.default_rng(1)
    series = FourierSeries(0.1, np.array([0.3, -0.2, 0.5]), *(0.1 * rng.normal(size=(2, 3, 5))))
    proven = proven_margins(limits, series.motion, series.period, MotionBounds.of(series))
    torque = np.abs(limits.evaluate(series.motion(np.linspace(0.0, 10.0, 50_001)), derivatives=False)[0])
    seen = limits.bound - torque.max(axis=0)
    assert np.all(proven <= seen)
    assert np.all(proven > 0.0)
    # where a limit is nearly reached the proof takes a thousandth of it
    tight = replace(limits, bound=1.01 * torque.max(axis=0))
    proven = proven_margins(tight, series.motion, series.period, MotionBounds.of(series))
    np.testing.assert_allclose(proven, tight.bound - torque.max(axis=0), atol=1.1e-3 * tight.bound.max())
    assert np.all(proven <= tight.bound - torque.max(axis=0))
