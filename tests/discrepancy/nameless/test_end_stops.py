"""What pushes back at the end of the range of a joint is no push from outside, though it comes in every period."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.nameless.end_stops import EndStop
from sea_ident.discrepancy.nameless.unnamed import unnamed
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import make_effect

PERIOD = 5.0


def found(bench):
    """What a search would give that found a push at the knee."""
    start = settle(bench, bench.effects)
    push = make_effect("external_force", "knee", start=1.0, stop=2.0, period=PERIOD)
    fit = refitted(bench, start.fit.effects, push, (), start.noise, start.fit.parameters)
    return Selection(start, settle_again(bench, fit), 1, (0.0,))


@pytest.mark.scenario
@pytest.mark.parametrize(("top", "exponent"), [(True, 2.0), pytest.param(False, 1.0, marks=pytest.mark.slow)])
def test_a_soft_stop_is_no_push(laboratory, nothing_missing, top, exponent):
    q = nothing_missing[0].data.motion.q[:, 1]
    end, other = (q.max(), q.min()) if top else (q.min(), q.max())
    stop = EndStop("knee", float(end), float(other - end), 0.3, exponent)
    bench = laboratory.bench(laboratory.record([(stop, [3.0])], periods=6))
    (one,) = unnamed(bench, found(bench), None)
    assert (one.effect, one.joint) == ("external_force", "knee")
    assert one.share < 0.1
    place = float(end + 0.3 * (other - end))
    own = one.solution.effects[-1]
    assert own.joint == "knee"
    assert own.end + own.share * own.travel == pytest.approx(place, abs=0.03 * float(np.ptp(q)))
    assert f"knee is {'above' if top else 'below'}" in one.sentence
    assert " rad, as a soft stop there does" in one.sentence


@pytest.mark.scenario
def test_a_push_while_a_joint_is_at_the_end_of_its_path_is_one(laboratory, nothing_missing):
    motion = nothing_missing[0].data.motion
    there = float(motion.time[np.argmax(motion.q[:, 1])])
    start, stop = (float(np.mod(there + half, PERIOD)) for half in (-0.3, 0.3))
    push = make_effect("external_force", "knee", start=start, stop=stop, period=PERIOD)
    bench = laboratory.bench(laboratory.record([(push, [-4.0, 0.0, 2.0])], periods=6))
    assert unnamed(bench, found(bench), None) == ()
