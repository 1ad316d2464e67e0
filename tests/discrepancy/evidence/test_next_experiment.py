"""Excite, record, diagnose: what a first, small motion leaves open, the motion that it proposes settles."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy import Diagnosis, LackOfFit, Verdict
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.evidence import next_experiment
from sea_ident.discrepancy.evidence.next_experiment import (
    Pair,
    _data_of,
    _identified,
    _Plan,
    _Shown,
    propose,
    with_next_experiment,
)
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.discrepancy.result.findings import Alternative, MissingEffect
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.excitation import DOptimality
from sea_ident.motion import FourierSeries
from sea_ident.simulation import PlantedEffect, simulate

PERIOD = 5.0
CASES = (
    ("spring_offset", "knee", (0.5,), {}, 0.3),
    ("backlash", "knee", (200.0,), {"half_width": 0.004}, 0.3),
    ("torque_constant", "hip", (0.08,), {}, 0.2),
)
"""Effect, joint, values, shape, and how much of a good motion the first one is."""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "joint", "values", "shape", "amplitude"), CASES)
def test_an_ambiguous_pair_is_settled_by_the_proposed_motion(leg, series, name, joint, values, shape, amplitude):
    motion = replace(series[0], a=amplitude * series[0].a, b=amplitude * series[0].b)
    hidden = PlantedEffect(make_effect(name, joint, **shape), np.array(values))
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
    assert [(m.effect, m.joint) for m in found.missing] == [(name, joint)]


@pytest.mark.scenario
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


@pytest.fixture(scope="module")
def offset(laboratory):
    """The bench of a knee that moves little, its spring that is off or its encoder, and the identified model."""
    small = replace(laboratory.motions[0], a=0.3 * laboratory.motions[0].a, b=0.3 * laboratory.motions[0].b)
    hidden = PlantedEffect(make_effect("spring_offset", "knee"), np.array([0.5]))
    recording = simulate(laboratory.leg, small, periods=8, seed=3, effects=[hidden]).recording
    bench = Bench(period_data(wide_processing(recording, laboratory.leg, PERIOD), laboratory.leg), laboratory.effects)
    settled = settle(bench, bench.effects)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = sea_ident.identify(laboratory.leg, recording, period=PERIOD)
    names = ("spring_offset", "encoder_offset")
    own, rival = (bench.refine((*bench.effects, make_effect(name, "knee")), settled.noise) for name in names)
    return bench, settled.noise, Pair(own, len(bench.effects), rival, len(bench.effects)), model


@pytest.mark.scenario
def test_links_of_the_proposed_motion_stay_inside_where_their_springs_take_them(offset, monkeypatch):
    """It is played on a robot whose springs give way: by a usual design, far below resonance, limits would not hold."""
    monkeypatch.setattr(next_experiment, "HARMONICS", 4)
    bench, noise, pair, model = offset
    proposed, _ = propose(bench, noise, [pair], model)
    record = proposed.excitation
    assert min(record["margins"].values()) >= 0.0
    assert min(record["link_margins"].values()) >= 0.0
    assert record["starts"] == 1


# by seed, what a motion shows as it is planned and with its links inside; the seeds whose links are kept, the best, and
# what it shows
KEPT = (
    ({1: (50.0, 40.0), 2: (60.0, 5.0), 3: (70.0, 60.0)}, [3], 3, 60.0),
    ({1: (50.0, 40.0), 2: (60.0, 5.0), 3: (70.0, 5.0)}, [3, 2, 1], 1, 40.0),
    # the first shows plenty as it is planned, and those that were not looked at for that are asked after all
    ({1: (500.0, 5.0), 2: (60.0, 30.0), 3: (70.0, 60.0)}, [1, 2], 2, 30.0),
)


@pytest.mark.scenario
@pytest.mark.parametrize(("energies", "kept", "best", "shows"), KEPT)
def test_links_are_kept_inside_for_the_best_motion_unless_it_then_tells_nothing(
    monkeypatch, offset, energies, kept, best, shows
):
    bench, noise, pair, model = offset
    asked = []

    def designed(plan):
        if plan.kept:
            asked.append(plan.seed)
        excitation = SimpleNamespace(series=None, to_dict=lambda: {"seed": plan.seed})
        return _Shown(plan, excitation, [2 * (energies[plan.seed][plan.kept],)])

    plans = [_Plan(DOptimality(), None, springs=False, seed=seed) for seed in (1, 2, 3)]
    monkeypatch.setattr(next_experiment, "_plans", lambda *_: plans)
    monkeypatch.setattr(next_experiment, "_Design", lambda *_: designed)
    monkeypatch.setattr(next_experiment, "separation", lambda *_: 4.0)
    proposed, notes = propose(bench, noise, [pair], model)
    assert asked == kept
    assert proposed.excitation == {"seed": best}
    assert proposed.gain == pytest.approx(np.sqrt(shows / 4.0))
    assert notes == ()


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
