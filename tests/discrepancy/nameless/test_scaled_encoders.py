"""An encoder that reads in proportion too much is none with an error once per turn."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident import simulate
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.nameless.scaled_encoders import ScaledEncoder, scaled_encoders
from sea_ident.discrepancy.nameless.unnamed import unnamed
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import corrected_motion, effect_classes, make_effect


def found_in(bench, *effects):
    """The bench's model with some effects, as a search would have found them."""
    start = settle(bench, bench.effects)
    begun = bench.anchored((*start.fit.effects, *effects), start.fit.parameters)
    now = settle_again(bench, bench.refine(begun, start.noise, start=start.fit.parameters))
    return Selection(start, now, len(effects), (1e-9,) * len(effects))


@pytest.fixture
def bench_with(laboratory):
    def build(column=None, factor=1.0, planted=()):
        recording = laboratory.record(planted, periods=8)
        columns = dict(recording.columns)
        if column is not None:
            columns[column] = factor * columns[column]
        return laboratory.bench(replace(recording, columns=columns))

    return build


@pytest.mark.scenario
@pytest.mark.parametrize(("kind", "whose"), [("q", "link"), ("theta", "motor")])
def test_a_scale_is_told_with_its_factor(bench_with, kind, whose):
    """61 teeth taken for 60; the nearest with a name is an error once per turn."""
    factor = 61.0 / 60.0
    bench = bench_with(f"{kind}_knee", factor)
    nearest = (make_effect("encoder_offset", "knee"), make_effect("encoder_eccentricity", "knee"))
    found = unnamed(bench, found_in(bench, *nearest), None)
    assert found
    assert {(each.effect, each.joint) for each in found} <= {(e.name, "knee") for e in nearest}
    for each in found:
        assert each.share < 0.1
        assert f"number of counts of the {whose} encoder makes it ({factor:.4f} times)" in each.sentence


@pytest.mark.scenario
def test_an_error_once_per_turn_keeps_its_name(bench_with):
    planted = [(make_effect("encoder_eccentricity", "knee", sine=0.004, cosine=0.003), [])]
    bench = bench_with(planted=planted)
    assert unnamed(bench, found_in(bench, make_effect("encoder_eccentricity", "knee")), None) == ()


@pytest.mark.scenario
@pytest.mark.parametrize("of_motor", [False, True])
@pytest.mark.parametrize("joint", ["hip", "knee"])
def test_what_is_shown_is_corrected(leg, series, joint, of_motor):
    motion = simulate(leg, series[0], periods=1, seed=0).motion
    effect = ScaledEncoder(joint, scale=0.02, of_motor=of_motor)
    shown = effect.measured(leg, motion.time, {"q": motion.q, "theta": motion.theta})
    scaled = "theta" if of_motor else "q"
    i = leg.index(joint)
    np.testing.assert_allclose(shown[scaled][:, i], 1.02 * getattr(motion, scaled)[:, i])
    back = corrected_motion(leg, [effect], replace(motion, **shown))
    np.testing.assert_allclose(back.q, motion.q, atol=1e-15)
    np.testing.assert_allclose(back.theta, motion.theta, atol=1e-15)


def test_it_is_tried_for_what_errs_along_the_path_and_has_no_name(leg):
    assert scaled_encoders(leg, make_effect("stribeck_friction", "knee")) == ()
    assert len(scaled_encoders(leg, make_effect("encoder_offset", "knee"))) == 2
    assert "scaled_encoder" not in effect_classes()
