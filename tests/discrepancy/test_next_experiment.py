"""Excite, record, diagnose: what a first, small motion leaves open, the motion that it proposes settles."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy import Diagnosis, LackOfFit, Verdict, next_experiment
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.findings import Alternative, MissingEffect
from sea_ident.discrepancy.next_experiment import _data_of, _identified, with_next_experiment
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.simulation import PlantedEffect, simulate

PERIOD = 5.0
CASES = (("spring_offset", (0.5,), {}), ("backlash", (200.0,), {"half_width": 0.004}))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "values", "shape"), CASES)
def test_an_ambiguous_pair_is_settled_by_the_proposed_motion(leg, series, name, values, shape):
    motion = replace(series[0], a=0.3 * series[0].a, b=0.3 * series[0].b)
    hidden = PlantedEffect(make_effect(name, "knee", **shape), np.array(values))
    verdicts = []
    for number in range(3):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            recording = simulate(leg, motion, periods=10, seed=1 + number, effects=[hidden]).recording
            found = sea_ident.diagnose(sea_ident.identify(leg, recording, period=PERIOD), recording)
        verdicts.append(found.verdict)
        if found.next_experiment is None:
            break
        record = found.next_experiment.excitation
        assert min(record["margins"].values()) >= 0.0
        assert found.next_experiment.gain > 1.1
        coefficients = (np.array(record[key]) for key in ("offset", "a", "b"))
        motion = FourierSeries(record["base_frequency"], *coefficients)
    assert verdicts[0] is Verdict.AMBIGUOUS
    assert verdicts[-1] in (Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER)
    assert [(m.effect, m.joint) for m in found.missing] == [(name, "knee")]


def test_a_stiffness_below_zero_predicts_no_deflection():
    leg = sea_ident.load_robot("exo_leg")
    series = sea_ident.design_excitation(leg, base_frequency=0.2, harmonics=5, starts=1, seed=0).series
    recording = simulate(leg, series, periods=4, seed=1).recording
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = sea_ident.identify(leg, recording, period=5.0)
    bad = tuple(replace(spring, stiffness=-5.0) if spring.joint == "knee" else spring for spring in model.springs)
    motors = _identified(replace(model, springs=bad))[1]
    # what the annotation says stands in for it
    assert motors.stiffness["knee"] == leg.spring("knee").stiffness
    assert motors.stiffness["hip"] == pytest.approx(model.springs[0].stiffness)
    assert "knee" not in motors.cubic_stiffness


def test_what_belongs_to_the_periods_of_the_recording_is_not_in_the_proposed_motion(nothing_missing, laboratory):
    """It has other samples, no torque of its own, no periods, and no steps of encoders."""
    bench = nothing_missing[0]
    samples, n = bench.data.motion.q.shape
    known, errors = np.ones((samples, 6)), np.full((4, 6, samples, n), 1e-4)
    data = replace(bench.data, known=known, step_errors=errors, places=tuple(range(1, 1 + bench.data.periods)))
    proposed = _data_of(data, laboratory.leg, laboratory.motions[1], None)
    assert proposed.samples < data.samples
    np.testing.assert_array_equal(proposed.target(proposed.tau_motor), 0.0)
    assert len(proposed.starts) == proposed.periods == 0
    assert np.all(np.isfinite(Bench(proposed, laboratory.effects).design(laboratory.effects)))


@pytest.mark.parametrize(
    ("pairs", "why"),
    [
        (
            [SimpleNamespace(names=("a at knee", "b at knee"))],
            "a at knee against b at knee: there is no repaired model",
        ),
        ([], "friction_drift at knee: one is for what the mean of the periods shows"),
    ],
)
def test_where_none_is_designed_the_reason_is_said(monkeypatch, pairs, why):
    monkeypatch.setattr(next_experiment, "ambiguous_pairs", lambda *_: pairs)
    others = (Alternative("temperature_friction", "knee", 1.0),)
    missing = (MissingEffect("friction_drift", "knee", (), 0.1, 1e-9, others),)
    found = Diagnosis(Verdict.AMBIGUOUS, "", LackOfFit(0.0, 1, 1.0, 1.0, {}), missing=missing)
    told = with_next_experiment(found, None, None, {})
    assert told.warnings == (f"no next experiment was designed for {why}",)
