import sys

import numpy as np
import pytest

from estimation.synthetic import record
from sea_ident.base_parameters import find_base_parameters, random_motion
from sea_ident.effects import base_effects
from sea_ident.estimation import JointWLS, LeastSquares, Robust, identify, identify_stream
from sea_ident.estimation.reduction import Reducer, reduce_recording
from sea_ident.estimation.solve import solve_triangle, solve_weighted
from sea_ident.exceptions import IdentificationError
from sea_ident.processing import filter_recording
from sea_ident.regressor import build_total
from sea_ident.robot import load_robot


@pytest.fixture(scope="module")
def arm():
    names = ["left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2"]
    return load_robot("example:baxter_description/urdf/baxter.urdf", "baxter_sea", names)


@pytest.mark.parametrize("block", [1000, 1700])
def test_sequential_equals_dense(arm, block):
    effects = base_effects(arm)
    base = find_base_parameters(arm, effects)
    motion = random_motion(arm, 4321, 7)
    rng = np.random.default_rng(0)
    torque = rng.normal(size=(4321, arm.n))
    valid = (rng.random((4321, arm.n)) > 0.1).astype(float)
    reducer = Reducer(arm, effects, base, block)
    for part in (slice(0, 10), slice(10, 3333), slice(3333, None)):
        reducer.add(motion[part], torque[part], valid[part])
    triangles = reducer.triangles()
    weights = rng.uniform(0.5, 2.0, arm.n)
    rows = build_total(arm, effects, motion, None, base.independent)
    dense = solve_weighted(rows, torque, weights * valid)
    sequential = solve_triangle(triangles.whole(weights))
    np.testing.assert_allclose(sequential.values, dense.values, rtol=1e-9)
    np.testing.assert_allclose(sequential.inverse, dense.inverse, rtol=1e-9, atol=1e-9 * np.abs(dense.inverse).max())
    assert sequential.log_det == pytest.approx(dense.log_det, rel=1e-12)
    residual = (torque - rows @ dense.values) * valid
    np.testing.assert_allclose(triangles.squares(dense.values), (residual**2).sum(axis=0), rtol=1e-9)
    scores = np.einsum("knb,kn,n->b", rows, residual, weights)
    np.testing.assert_allclose(triangles.scores(dense.values, weights).sum(axis=0), scores, atol=1e-6)
    np.testing.assert_array_equal(triangles.samples.sum(axis=0), valid.sum(axis=0))


def test_blocks_are_joined_when_there_are_many(leg):
    effects = base_effects(leg)
    base = find_base_parameters(leg, effects)
    motion = random_motion(leg, 90_000, 3)
    torque = np.random.default_rng(1).normal(size=(90_000, 3))
    cuts = (slice(0, 50_000), slice(50_000, None))
    triangles = reduce_recording(leg, effects, base, ((motion[c], torque[c]) for c in cuts))
    assert len(triangles.blocks) <= 81
    assert triangles.samples.sum() == 3 * 90_000


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
@pytest.mark.parametrize("estimator", [LeastSquares(), JointWLS()], ids=lambda e: e.name)
def test_stream_equals_the_dense_fit(leg, truth, estimator):
    processed = filter_recording(record(leg, truth, 3, torque_noise=0.2), leg, cutoff=20.0)
    dense = identify(leg, processed, estimator=estimator)
    cuts = np.array_split(np.arange(processed.samples), 7)
    chunks = ((processed.motion[c[0] : c[-1] + 1], processed.tau_motor[c[0] : c[-1] + 1]) for c in cuts)
    streamed = identify_stream(leg, chunks, estimator=estimator, base=dense.base)
    np.testing.assert_allclose(streamed.values, dense.values, rtol=1e-6 if estimator.name == "joint_wls" else 1e-9)
    assert streamed.fit.condition_number == pytest.approx(dense.fit.condition_number, rel=0.2)
    np.testing.assert_allclose(streamed.std, dense.std, rtol=1.0)
    assert len(streamed.excerpt.motion) >= 500


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_identify_takes_the_long_way_by_itself(leg, truth, monkeypatch):
    processed = filter_recording(record(leg, truth, 3, torque_noise=0.2), leg, cutoff=20.0)
    dense = identify(leg, processed, estimator=JointWLS())
    monkeypatch.setattr(sys.modules["sea_ident.estimation.identify"], "DENSE", 1)
    long = identify(leg, processed)
    np.testing.assert_allclose(long.values, dense.values, rtol=1e-6)
    assert [s.joint for s in long.springs] == ["hip", "knee", "ankle"]
    np.testing.assert_allclose([s.stiffness for s in long.springs], [s.stiffness for s in dense.springs], rtol=1e-6)


def test_estimators_that_need_everything_are_refused(leg):
    with pytest.raises(IdentificationError, match="robust needs all samples"):
        identify_stream(leg, [], estimator=Robust())
    with pytest.raises(IdentificationError, match="no samples"):
        identify_stream(leg, [])
