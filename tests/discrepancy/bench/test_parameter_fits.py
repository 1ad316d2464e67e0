"""Parameters of a model fitted with its shapes held."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.fit import Known
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.measured.data import EquationKind
from sea_ident.discrepancy.search.possible_springs import without_cubic
from sea_ident.effects import make_effect


def test_columns_are_the_derivative_of_the_whitened_residual(rippled):
    """That of a link too, whose scale follows the stiffness that is fitted."""
    bench, _, now = rippled
    fit, flat = now.fit, bench.whitening(now.noise).flat
    for name in ("hip.spring_stiffness", "knee.spring_stiffness", "knee.coulomb_friction", "foot.mass"):
        column = next((k for k, c in enumerate(fit.columns) if c.name == name), None)
        if column is None:
            continue
        step = 1e-4 * abs(fit.values[column])
        ends = []
        for sign in (-1.0, 1.0):
            there = bench.predicted(fit.effects, {**fit.parameters, name: fit.values[column] + sign * step})
            ends.append(flat(there.residual * there.scale))
        slope = (ends[0] - ends[1]) / (2.0 * step)
        np.testing.assert_allclose(slope, fit.flat[:, column], atol=1e-5 * np.abs(slope).max())


def test_a_fit_stands_where_no_parameter_brings_the_statistic_down(rippled):
    fit = rippled[2].fit
    columns = fit.flat[:, : len(fit.columns)]
    lengths = np.linalg.norm(columns, axis=0)
    slope = columns.T @ fit.whitened / np.where(lengths > 0.0, lengths, 1.0)
    # a standard deviation is one
    assert np.abs(slope).max() < 0.05


@pytest.mark.scenario
def test_a_fit_gets_there_from_far_away_whatever_else_is_wrong(laboratory):
    """A spring four times too stiff beside another zero of its encoder: ten steps ended 47 times above the minimum."""
    bench = laboratory.bench(laboratory.record([("encoder_offset", "knee", [], {"offset": -0.1})], periods=8))
    less = without_cubic(bench, ["knee"])
    right = settle(less, (*less.effects, make_effect("encoder_offset", "knee", offset=-0.1)))
    start = {**right.fit.parameters, "knee.spring_stiffness": 4.0 * right.fit.parameters["knee.spring_stiffness"]}
    fits = [less.fit(less.effects, right.noise, start=each) for each in (start, right.fit.parameters)]
    assert fits[0].statistic == pytest.approx(fits[1].statistic, rel=1e-3)


def test_a_planted_effect_is_fitted_within_its_own_standard_errors(rippled):
    fit = rippled[2].fit
    found = [k for k, c in enumerate(fit.columns) if "torque_ripple" in c.name]
    assert len(found) == 2
    for k, planted in zip(found, (1.0, 0.5), strict=True):
        assert fit.values[k] == pytest.approx(planted, abs=4.0 * fit.std(k))
        assert fit.std(k) < 0.06


def test_a_fit_comes_again_from_what_it_came_to(rippled):
    """To the last digit, whatever process it was found in, with and without free shapes."""
    bench, _, now = rippled
    # fitted here: what others try on the same bench may have released samples since
    free, held = (
        bench.fit(now.fit.effects, now.noise, start=now.fit.parameters, tangents=tangents) for tangents in (True, False)
    )
    for fit in (free, bench.again(held.solution, now.noise)):
        again = bench.again(pickle.loads(pickle.dumps(fit.solution)), now.noise)
        assert again.effects == fit.effects
        assert (again.statistic, again.dof, again.parameters) == (fit.statistic, fit.dof, fit.parameters)
        for name in ("values", "residual", "scale", "whitened", "flat", "basis", "covariance_factor"):
            np.testing.assert_array_equal(getattr(again, name), getattr(fit, name), err_msg=name)


@pytest.mark.scenario
def test_a_shape_is_refined_beside_what_is_known(laboratory):
    """With the other ripple known it ends where it does with that in the model."""
    planted = [("torque_ripple", joint, [1.0, 0.5], {"order": 4.0}) for joint in ("hip", "knee")]
    bench = laboratory.bench(laboratory.record(planted, periods=5))
    ripples = {joint: make_effect("torque_ripple", joint, order=4.2) for joint in ("hip", "knee")}
    start = settle(bench, (*bench.effects, *ripples.values()))
    whole = bench.refine(start.fit.effects, start.noise, start=start.fit.parameters, only=len(bench.effects))
    amounts = np.array([whole.parameters[f"knee.torque_ripple_{part}"] for part in ("sine", "cosine")])
    torque = bench.column_spectra(whole.effects[-1], whole.effects) @ amounts
    known = Known(torque, np.zeros(len(bench.data.equations)))
    model = (*whole.effects[: len(bench.effects)], ripples["hip"])
    found = bench.refine(model, start.noise, start=whole.parameters, only=len(bench.effects), known=known)
    assert found.known is known
    assert found.effects[-1].order == pytest.approx(whole.effects[-2].order, abs=1e-3)
    assert found.statistic == pytest.approx(whole.statistic, rel=1e-4)


def test_next_to_nothing_that_is_known_at_a_spring_is_no_measure_of_its_equation(rippled):
    """Weighted by that, the first fit would do without the spring."""
    bench = rippled[0]
    known = np.zeros((bench.data.samples, len(bench.data.equations)))
    known[:, list(bench.links)] = 1e-7 * np.sin(bench.data.motion.time)[:, None]
    more = bench.comparing(replace(bench.data, known=known)).first_fit
    for joint in bench.robot.joint_names:
        name = f"{joint}.spring_stiffness"
        assert more.parameters[name] == pytest.approx(bench.first_fit.parameters[name], rel=1e-3)


def test_samples_of_the_joints_are_left_out_at_which_friction_jumps_elsewhere(laboratory):
    """Those in which a torque that comes late passes a reversal, at its joint or at all of them; no link equation."""
    for joint, joints in (("knee", {"knee"}), (None, {"hip", "knee", "ankle"})):
        bench = laboratory.bench(laboratory.record())
        before = bench._left_out.copy()
        bench.release([make_effect("torque_delay", joint, delay=0.02)])
        more = np.any(bench._left_out & ~before, axis=0)
        equations = bench.data.equations
        assert {equations[e].joint for e in np.flatnonzero(more)} == joints
        assert all(equations[e].kind is not EquationKind.LINK for e in np.flatnonzero(more))
