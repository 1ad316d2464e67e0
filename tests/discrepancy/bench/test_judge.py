"""What speaks against an effect."""

from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.judge import BEHIND_LAWS, COMPLETE, at_a_bound, comes_first, never_closed
from sea_ident.discrepancy.diagnose import _out
from sea_ident.effects import make_effect


@pytest.mark.parametrize(
    ("shares", "drifting", "at_rest", "out"),
    [
        ([0.9, 0.8], 0, (), []),
        ([0.9, 0.2, -1.0], 0, (), [1, 2]),  # the form of what holds
        ([0.15, -2.5, -0.4], 0, (), [1]),  # nothing holds: the worst spoils the others
        ([0.15, -0.4], 1, (), [0, 1]),  # what drifts is left
        ([-0.4], 0, (), []),  # nothing would be left
        ([0.9, -4.0, 0.2], 0, (1,), [2]),  # dry friction rests elsewhere
        ([-0.4, -4.0], 0, (1,), []),  # nothing that has a name would be left
    ],
)
def test_what_does_not_hold_goes_and_where_nothing_holds_the_worst(shares, drifting, at_rest, out):
    transfers = [SimpleNamespace(share=share, ruled_out=share <= 0.5) for share in shares]
    assert _out(SimpleNamespace(transfers=transfers), drifting, at_rest) == out


@pytest.mark.parametrize(
    ("name", "shapes", "ended"),
    [
        ("backlash", {"half_width": 1e-5}, True),
        # hard ends, and ends as soft as there are, are play all the same
        ("backlash", {"softness": 0.01}, False),
        ("backlash", {"softness": 1.5}, False),
        ("presliding_friction", {"displacement": 1e-6}, True),
        ("presliding_friction", {"displacement": 3e-5}, False),
        ("nonlinear_viscous_friction", {"exponent": 0.3}, True),
        ("nonlinear_viscous_friction", {"exponent": 0.45}, False),
        ("nonlinear_viscous_friction", {"exponent": 3.0}, False),
        ("torque_saturation", {"exponent": 9.0}, True),
        # dry friction as sharp as there is, and one that no speed of the motion is beyond
        ("link_friction", {"smoothing": 1e-4}, False),
        ("link_friction", {"smoothing": 0.3}, True),
        # an error of a sensor as large as any, to either side, and one that is none
        ("encoder_eccentricity", {"sine": -0.2}, True),
        ("encoder_eccentricity", {"sine": -0.15, "cosine": 0.15}, False),
        ("encoder_eccentricity", {"cosine": 0.2}, True),
        ("link_flexibility", {"compliance": 0.0}, False),
        ("link_flexibility", {"compliance": 0.01}, True),
        # beside a soft spring a link may give way by more
        ("link_flexibility", {"compliance": 0.01, "stiffness": 20.0}, False),
        ("link_flexibility", {"compliance": 0.05, "stiffness": 20.0}, True),
    ],
)
def test_a_width_that_ended_at_the_end_of_its_range_is_something_else(name, shapes, ended):
    assert at_a_bound(make_effect(name, "knee", **shapes)) is ended


@pytest.mark.parametrize(
    ("share", "by_law", "first"),
    [
        (0.6, BEHIND_LAWS + 0.05, False),  # most of the excess, and a law explains more than half as much
        (0.6, BEHIND_LAWS - 0.05, True),
        (COMPLETE + 0.05, 1.0, True),
    ],
)
def test_what_acts_by_a_law_comes_before_a_push_that_does_not_explain_nearly_all(rippled, share, by_law, first):
    fit = rippled[1].fit
    gain = share * fit.excess
    assert comes_first(gain, by_law * gain, fit) is first


@pytest.mark.parametrize(
    ("joint", "share", "softness", "open_to_one_side"),
    [
        ("hip", 0.9, 0.05, True),
        ("hip", 1.1, 0.05, False),
        ("hip", 0.9, 0.5, False),  # its soft end is met
        ("knee", 0.5, 0.05, False),  # to one side, then to the other: no constant, however narrow
    ],
)
def test_play_is_never_closed_where_the_motion_stays_beyond_one_of_its_ends(
    nothing_missing, joint, share, softness, open_to_one_side
):
    bench, start = nothing_missing
    deflection = bench.data.motion.deflection[:, bench.robot.index(joint)]
    assert bool(np.ptp(np.sign(deflection))) == (joint == "knee")
    play = make_effect("backlash", joint, half_width=share * float(np.min(np.abs(deflection))), softness=softness)
    effects = (*start.fit.effects, play)
    assert never_closed(bench, effects, -1) == open_to_one_side
    assert not never_closed(bench, effects, 0)
