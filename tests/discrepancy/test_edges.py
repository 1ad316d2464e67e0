"""A push is found to the sample, from wherever the search for its edges begins."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy import edges
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.data import period_data, wide_processing
from sea_ident.discrepancy.edges import _best_window, with_sharp_edges
from sea_ident.discrepancy.settle import settle
from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.simulation import PlantedEffect, simulate

PERIOD = 5.0
START, STOP = 4.13, 0.62
"""Of the push: it goes on round the end of the period."""


@pytest.fixture(scope="module")
def pushed(leg, series):
    push = make_effect("external_force", "knee", start=START, stop=STOP, period=PERIOD)
    found = simulate(leg, series[0], periods=8, seed=3, effects=(PlantedEffect(push, np.array([4.0, 0.0, 2.0])),))
    data = period_data(wide_processing(found.recording, leg, PERIOD), leg)
    bench = Bench(data, (*base_effects(leg), *spring_effects(leg)))
    return bench, settle(bench, bench.effects)


@pytest.mark.parametrize("window", [(1.0, 2.0), (3.0, 3.4), (4.5, 1.5)])
def test_the_edges_are_found_to_the_sample_from_any_window(pushed, window):
    bench, now = pushed
    effect = make_effect("external_force", "knee", start=window[0], stop=window[1], period=PERIOD)
    begun = bench.fit((*now.fit.effects, effect), now.noise, start=now.fit.parameters)
    found = with_sharp_edges(bench, begun, now.noise, len(now.fit.effects))
    sample = PERIOD / bench.data.samples
    assert abs(found.effects[-1].start - START) <= sample * 1.01
    assert abs(found.effects[-1].stop - STOP) <= sample * 1.01
    # the force along the axis of rotation moves no joint
    assert found.parameters["knee.external_force_x"] == pytest.approx(4.0, abs=0.2)
    assert found.parameters["knee.external_force_z"] == pytest.approx(2.0, abs=0.2)


def test_a_push_is_not_taken_for_one_that_pauses_then(pushed, monkeypatch):
    """What pushes back all the time but then differs by a constant force, of which a model takes up the most."""
    bench, now = pushed
    sample = PERIOD / bench.data.samples
    monkeypatch.setattr(edges, "_best_window", lambda *_: (STOP + sample, START - sample))
    effect = make_effect("external_force", "knee", start=STOP + sample, stop=START - sample, period=PERIOD)
    begun = bench.fit((*now.fit.effects, effect), now.noise, start=now.fit.parameters)
    found = with_sharp_edges(bench, begun, now.noise, len(now.fit.effects))
    assert found.effects[-1].start == pytest.approx(START, abs=1.01 * sample)
    assert found.effects[-1].stop == pytest.approx(STOP, abs=1.01 * sample)


def test_the_best_window_is_the_one_that_fits_best(pushed):
    bench, now = pushed
    effect = make_effect("external_force", "knee", start=1.0, stop=2.0, period=PERIOD)
    begun = bench.fit((*now.fit.effects, effect), now.noise, start=now.fit.parameters)
    stride = bench.data.samples // 12
    position = len(now.fit.effects)
    best = _best_window(bench, begun, now.noise, position, stride)
    interval = PERIOD / bench.data.samples

    def statistic(start, stop):
        own = replace(effect, start=start * interval, stop=(stop - 1) % bench.data.samples * interval)
        return bench.fit((*now.fit.effects, own), now.noise, start=now.fit.parameters, tangents=False).statistic

    places = np.arange(0, bench.data.samples, stride)
    every = {(i, j): statistic(int(i), int(j)) for i in places for j in places if i != j}
    (start, stop), least = min(every.items(), key=lambda item: item[1])
    assert best == pytest.approx((start * interval, (stop - 1) % bench.data.samples * interval))
    assert least < 0.5 * now.fit.statistic
