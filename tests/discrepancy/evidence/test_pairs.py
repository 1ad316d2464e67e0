"""Two effects that a recording does not tell apart, and how well another motion would."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.evidence.next_experiment import _data_of
from sea_ident.discrepancy.evidence.pairs import Pair, hardest, separation
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.effects import make_effect
from sea_ident.effects.asymmetric_spring import OUT_OF_REACH
from sea_ident.excitation import PredictedMotors
from sea_ident.simulation import PlantedEffect, simulate


@pytest.fixture(scope="module")
def one_sided(laboratory):
    """A hip that gravity deflects to one side, whose spring is off or has a kink that the motion does not pass."""
    series = laboratory.motions[0]
    small = replace(series, a=0.3 * series.a, b=0.3 * series.b)
    hidden = PlantedEffect(make_effect("spring_offset", "hip"), np.array([1.0]))
    recording = simulate(laboratory.leg, small, periods=8, seed=3, effects=[hidden]).recording
    bench = Bench(period_data(wide_processing(recording, laboratory.leg, 5.0), laboratory.leg), laboratory.effects)
    settled = settle(bench, bench.effects)
    least = float(np.abs(bench.data.motion.deflection[:, 0]).min())
    rivals = (
        make_effect("spring_offset", "hip"),
        make_effect("asymmetric_spring", "hip", kink=OUT_OF_REACH[0] * least),
    )
    fits = [bench.fit((*bench.effects, effect), settled.noise) for effect in rivals]
    return bench, settled.noise, Pair(fits[0], len(bench.effects), fits[1], len(bench.effects)), least


@pytest.mark.scenario
def test_a_kink_out_of_reach_is_taken_where_other_motions_pass_it_least(one_sided):
    bench, noise, pair, least = one_sided
    found = hardest(bench, noise, pair)
    assert found.own is pair.own
    kink = found.rival.effects[pair.rival_position].kink
    assert kink == pytest.approx(OUT_OF_REACH[-1] * least)
    # on this motion it is the same
    assert found.rival.statistic == pytest.approx(pair.rival.statistic, rel=1e-6)
    assert separation(bench, noise, found) == pytest.approx(separation(bench, noise, pair), abs=1e-3)


@pytest.mark.scenario
def test_a_motion_that_stays_on_one_side_of_rest_is_not_promised_to_tell(one_sided, laboratory):
    """It passes the kink that was found, but not one nearer to rest."""
    bench, noise, pair, least = one_sided
    motors = PredictedMotors({"hip": 600.0, "knee": 200.0, "ankle": 120.0})
    there = Bench(_data_of(bench.data, laboratory.leg, laboratory.motions[0], motors), bench.effects)
    deflection = there.data.motion.deflection[:, 0]
    assert 0.2 * least < deflection.min() < 0.8 * least
    assert separation(there, noise, pair) > 100.0
    assert separation(there, noise, hardest(bench, noise, pair)) < 1.0
