"""A push is found to the sample, from wherever the search for its edges begins."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy import words
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.linear import whiten
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.compared.decide import simplest_first
from sea_ident.discrepancy.evidence.assess import rivals
from sea_ident.discrepancy.evidence.named import named_effects
from sea_ident.discrepancy.evidence.uncertainty import uncertainties
from sea_ident.discrepancy.search import edges
from sea_ident.discrepancy.search.edges import (
    _best_window,
    _Rest,
    _windows,
    at_centre,
    edge_stds,
    stays_on_the_centre,
    with_sharp_edges,
    without_another,
)
from sea_ident.discrepancy.search.elimination import eliminate
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import Selection, search
from sea_ident.effects import State, make_effect
from sea_ident.effects.external_force import POINT
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.robot import load_robot

PERIOD = 5.0
START, STOP = 4.13, 0.62
"""Of the push: it goes on round the end of the period."""


@pytest.fixture(scope="module")
def pushed(laboratory):
    push = make_effect("external_force", "knee", start=START, stop=STOP, period=PERIOD)
    bench = laboratory.bench(laboratory.record([(push, [4.0, 0.0, 2.0])], periods=5))
    return bench, settle(bench, bench.effects)


@pytest.mark.scenario
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


@pytest.mark.scenario
def test_edges_are_known_to_a_small_part_of_a_sample(laboratory):
    """A sixty-fourth: of a large push on a precise recording that is what stands out of the noise."""
    bench = laboratory.bench(laboratory.record(periods=5))
    sample = PERIOD / bench.data.samples
    push = make_effect("external_force", "knee", start=1.3364, stop=1.9702, period=PERIOD)
    rows = bench.data.rows(push.evaluate(bench.state(bench.effects))) @ np.array([60.0, 0.0, -190.0])
    bench = bench.comparing(replace(bench.data, known=-rows))
    now = settle(bench, bench.effects)
    effect = replace(push, start=push.start + 1.3 * sample, stop=push.stop - 0.7 * sample)
    begun = bench.fit((*now.fit.effects, effect), now.noise, start=now.fit.parameters)
    noise = bench.noise(begun)
    found = with_sharp_edges(
        bench, bench.fit(begun.effects, noise, start=begun.parameters), noise, len(now.fit.effects)
    )
    assert found.effects[-1].start == pytest.approx(push.start, abs=sample / 40.0)
    assert found.effects[-1].stop == pytest.approx(push.stop, abs=sample / 40.0)


@pytest.mark.scenario
@pytest.mark.parametrize(("start", "stop"), [(0.6486, 1.4043), (2.1237, 2.9012)])
def test_a_push_that_was_simulated_begins_and_ends_within_its_own_deviations(laboratory, start, stop):
    """Whatever part of a sample, and of a step of the integrator, it begins and ends in."""
    push = make_effect("external_force", "knee", start=start, stop=stop, period=PERIOD)
    bench = laboratory.bench(laboratory.record([(push, [-1.1, 0.0, -6.4])], periods=12))
    now, sample = settle(bench, bench.effects), PERIOD / bench.data.samples
    effect = replace(push, start=start + 1.3 * sample, stop=stop - 0.7 * sample)
    begun = bench.fit((*now.fit.effects, effect), now.noise, start=now.fit.parameters)
    noise = bench.noise(begun)
    found = with_sharp_edges(
        bench, bench.fit(begun.effects, noise, start=begun.parameters), noise, len(now.fit.effects)
    )
    stds = edge_stds(bench, found, noise, len(now.fit.effects))
    for name, true in (("start", start), ("stop", stop)):
        assert stds[name] < 0.1 * sample
        assert abs(getattr(found.effects[-1], name) - true) < 3.0 * stds[name], name


@pytest.mark.scenario
def test_edges_are_looked_for_beyond_the_next_windows(pushed, monkeypatch):
    """Where samples were left out near an edge there is a minimum on either side, and the worse may be in a window."""
    bench, now = pushed
    sample, stride = PERIOD / bench.data.samples, bench.data.samples // edges.INSTANTS
    effect = make_effect("external_force", "knee", start=START, stop=STOP, period=PERIOD)
    begun = bench.fit((*now.fit.effects, effect), now.noise, start=now.fit.parameters)
    found, looked = edges._best_edges, []

    def best_edges(bench, fit, noise, position, firsts, lasts):
        looked.append(lasts - fit.effects[position].stop)
        return found(bench, fit, noise, position, firsts, lasts)

    monkeypatch.setattr(edges, "_best_window", lambda *_: (START, STOP))
    monkeypatch.setattr(edges, "_best_edges", best_edges)
    with_sharp_edges(bench, begun, now.noise, len(now.fit.effects))
    widest = max(looked, key=np.max)
    assert min(-widest[0], widest[-1]) >= 1.5 * stride * sample
    assert np.diff(widest) == pytest.approx(sample)


@pytest.mark.scenario
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


@pytest.mark.scenario
def test_a_push_away_from_the_centre_of_mass_is_one_push(laboratory):
    """Of what turns the link only the moment about the axis of the joints shows."""
    force, point = np.array([4.0, 0.0, 2.0]), {"point_x": 0.05, "point_z": -0.08}
    push = make_effect("external_force", "ankle", start=START, stop=STOP, period=PERIOD, **point)
    bench = laboratory.bench(laboratory.record([(push, force)]))
    found = search(bench, bench.effects)
    assert [(e.name, e.joint) for e in found.effects] == [("external_force", "ankle")]
    assert not stays_on_the_centre(bench, found.final.fit, -1)
    own, fit, noise = found.effects[0], found.final.fit, found.final.noise
    # it explains as much as the truth does
    model = [push if effect is own else effect for effect in fit.effects]
    assert fit.statistic < bench.fit(model, noise, start=fit.parameters).statistic
    x, z = (fit.parameters[f"ankle.external_force_{axis}"] for axis in "xz")
    assert (x, z) == pytest.approx((4.0, 2.0), abs=0.3)
    turned = own.point_z * x - own.point_x * z  # the foot is nearly level throughout
    assert turned == pytest.approx(point["point_z"] * 4.0 - point["point_x"] * 2.0, abs=0.05)


@pytest.mark.scenario
def test_two_pushes_at_once_make_room_for_one_off_the_centre_of_mass(laboratory):
    """What one on the centre of mass leaves is taken for a push on the next link, at the same instants."""
    force, times = np.array([6.0, 0.0, -19.0]), {"start": 1.3364, "stop": 1.6702, "period": PERIOD}
    push = make_effect("external_force", "knee", point_x=0.006, point_z=-0.004, **times)
    bench = laboratory.bench(laboratory.record([(push, force)], periods=10))
    now = settle(bench, bench.effects)
    two = [make_effect("external_force", joint, **times) for joint in ("knee", "hip")]
    begun = bench.fit((*now.fit.effects, *two), now.noise, start=now.fit.parameters)
    now, p_values = eliminate(bench, settle_again(bench, begun), [1e-9, 1e-9], 1000)
    assert len(p_values) == 1
    own, stds = now.fit.effects[-1], uncertainties(bench, now)
    assert (own.name, own.joint) == ("external_force", "knee")
    assert (own.point_x, own.point_z) == pytest.approx((0.006, -0.004), abs=0.004)
    for axis, value in zip("xz", force[[0, 2]], strict=True):
        name = f"knee.external_force_{axis}"
        std = stds[[column.name for column in now.fit.columns].index(name)]
        assert now.fit.parameters[name] == pytest.approx(value, abs=3.0 * std)


@pytest.mark.scenario
@pytest.mark.parametrize("late", [0.6, 1.2])
def test_what_was_found_beside_the_wrong_edges_of_a_push_is_not_needed_for_them(laboratory, late):
    """A link that bends a little makes up for a push that begins too late, and was kept with it."""
    push = make_effect("external_force", "knee", start=1.3, stop=2.0, period=PERIOD)
    bench = laboratory.bench(laboratory.record([(push, [20.0, 0.0, -60.0])], periods=10))
    wrong = replace(push, start=1.3 + late * PERIOD / bench.data.samples)
    now = settle(bench, (*bench.effects, wrong, make_effect("link_flexibility", "knee", compliance=1e-4)))
    left, p_values = eliminate(bench, now, [1e-9, 1e-9], 100)
    assert [effect.name for effect in left.fit.effects[len(bench.effects) :]] == ["external_force"]
    assert len(p_values) == 1
    assert left.fit.statistic < 1.2 * left.fit.dof < 0.2 * now.fit.statistic


@pytest.mark.scenario
def test_the_best_window_is_the_one_that_fits_best(pushed):
    bench, now = pushed
    effect = make_effect("external_force", "knee", start=1.0, stop=2.0, period=PERIOD)
    begun = bench.fit((*now.fit.effects, effect), now.noise, start=now.fit.parameters)
    stride = bench.data.samples // 12
    position = len(now.fit.effects)
    best = _best_window(bench, begun, now.noise, position, stride)
    interval = PERIOD / bench.data.samples

    def statistic(start, stop):
        # each sample stands for half an interval to either side
        own = replace(effect, start=(start - 0.5) % bench.data.samples * interval, stop=(stop - 0.5) * interval)
        return bench.fit((*now.fit.effects, own), now.noise, start=now.fit.parameters, tangents=False).statistic

    places = np.arange(0, bench.data.samples, stride)
    every = {(i, j): statistic(int(i), int(j)) for i in places for j in places if i != j}
    (start, stop), least = min(every.items(), key=lambda item: item[1])
    assert best == pytest.approx(((start - 0.5) * interval, (stop - 0.5) * interval))
    assert least < 0.5 * now.fit.statistic


@pytest.mark.scenario
def test_edges_between_samples_are_compared_as_pushes_are(pushed):
    bench, now = pushed
    effect = make_effect("external_force", "knee", start=1.0, stop=2.0, period=PERIOD, point_z=0.1)
    rest = _Rest(effect, list(now.fit.effects), now.fit.scale, now.fit.whitened, lambda columns: columns)
    interval = PERIOD / bench.data.samples
    wanted = interval * np.array([0.3, 7.5, 7.75, 8.125, bench.data.samples - 1.4])
    instants, columns = _windows(bench, rest, now.noise, wanted)
    np.testing.assert_allclose(instants[1:-1], wanted, rtol=1e-12)
    assert not np.any(columns[:, 0])
    begin = float(instants[0])
    for k, instant in enumerate([*wanted, begin + PERIOD - 1e-11], start=1):
        push = replace(effect, start=begin, stop=float(instant))
        own = bench.column_spectra(push, now.fit.effects) * now.fit.scale[:, None]
        expected = whiten(bench.whitener(now.noise), own)
        np.testing.assert_allclose(columns[:, k], expected, atol=1e-9 * np.abs(expected).max())


@pytest.fixture(scope="module")
def pushed_thigh(laboratory):
    """A push on the centre of mass of the thigh, and one on the shank in its place."""
    push = make_effect("external_force", "hip", start=START, stop=STOP, period=PERIOD)
    bench = laboratory.bench(laboratory.record([(push, np.array([8.0, 0.0, 4.0]))], periods=5))
    now = settle(bench, bench.effects)
    coarse = {"start": START + 0.05, "stop": STOP - 0.05, "period": PERIOD}
    candidates = {joint: make_effect("external_force", joint, **coarse) for joint in ("hip", "knee")}
    fit, noise = now.fit, now.noise
    shank = refitted(bench, fit.effects, candidates["knee"], (), noise, fit.parameters)
    noise = bench.noise(shank)
    shank = bench.fit(shank.effects, noise, start=shank.parameters)
    return bench, now, Settled(shank, noise), candidates


@pytest.mark.scenario
def test_a_push_on_another_link_is_compared_when_its_edges_are_known(pushed_thigh):
    """A window that is a little off leaves of a large push many times what either link leaves in the end."""
    bench, now, shank, candidates = pushed_thigh
    before = shank.fit.effects[: len(now.fit.effects)]
    begun = bench.fit((*before, candidates["hip"]), shank.noise, start=shank.fit.parameters)
    assert begun.statistic > 20.0 * shank.fit.statistic
    beat = shank.fit.statistic + EQUALLY_GOOD
    thigh = refitted(bench, before, candidates["hip"], (), shank.noise, shank.fit.parameters, beat)
    assert thigh.statistic < beat


@pytest.mark.scenario
def test_how_large_a_push_on_a_centre_of_mass_is_depends_on_where_it_is(pushed_thigh):
    bench, now, shank, _ = pushed_thigh
    assert stays_on_the_centre(bench, at_centre(bench, shank.fit, shank.noise, len(now.fit.effects)), -1)
    assert not any(stays_on_the_centre(bench, now.fit, k) for k in range(len(now.fit.effects)))


@pytest.mark.scenario
def test_a_diagnosis_says_where_the_force_that_it_tells_is_thought_to_push(laboratory):
    push = make_effect("external_force", "hip", start=START, stop=STOP, period=PERIOD)
    recording = laboratory.record([(push, np.array([8.0, 0.0, 4.0]))])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = sea_ident.diagnose(sea_ident.identify(laboratory.leg, recording, period=PERIOD), recording)
    assert [(m.effect, m.joint) for m in found.missing] == [("external_force", "hip")]
    assert words.on_the_centre("hip") in found.warnings


@pytest.mark.scenario
def test_pushes_at_different_times_do_not_stand_in_for_each_other(pushed):
    bench, now = pushed
    pushes = [
        make_effect("external_force", "knee", start=a, stop=b, period=PERIOD) for a, b in ((4.13, 0.62), (1.5, 2.0))
    ]
    fit, first = bench.fit((*now.fit.effects, pushes[0]), now.noise, start=now.fit.parameters), len(now.fit.effects)
    assert without_another(bench, fit, now.noise, pushes[1], first) is fit
    assert without_another(bench, fit, now.noise, replace(pushes[0], stop=0.61), first) is not fit


@pytest.mark.filterwarnings("ignore:emps")
@pytest.mark.parametrize(("name", "matters"), [("exo_leg", True), ("emps", False)])
def test_where_a_link_is_pushed_makes_no_difference_where_it_only_slides(name, matters):
    robot = load_robot(name)
    q = np.linspace(-0.1, 0.1, 20)[:, None] * np.ones(robot.n)
    push = make_effect("external_force", robot.joint_names[0])
    motion = Motion(q[:, 0], *[q] * 6)
    bench = SimpleNamespace(column_spectra=lambda effect, _: effect.evaluate(State(robot, motion)).link)
    assert stays_on_the_centre(bench, SimpleNamespace(effects=(push,)), 0) is matters


@pytest.mark.scenario
def test_a_large_push_is_not_given_up_for_half_a_sample(laboratory):
    """Beside the noise that is far more than it leaves in the end."""
    push = make_effect("external_force", "hip", start=1.2012, stop=1.9013, period=PERIOD)
    bench = laboratory.bench(laboratory.record([(push, np.array([400.0, 0.0, 200.0]))], periods=5))
    now = settle(bench, bench.effects)
    begun = bench.fit((*now.fit.effects, push), now.noise, start=now.fit.parameters)
    noise = bench.noise(begun)
    right = bench.fit(begun.effects, noise, start=begun.parameters)
    beat = right.statistic + EQUALLY_GOOD
    half = 0.5 * PERIOD / bench.data.samples
    candidate = replace(push, start=push.start + half, stop=push.stop - half)
    off = bench.fit((*right.effects[:-1], candidate), noise, start=right.parameters)
    assert off.statistic > edges.FAR_ABOVE * beat
    found = refitted(bench, right.effects[:-1], candidate, (), noise, right.parameters, beat)
    assert found.statistic < beat


@pytest.mark.scenario
def test_a_push_on_a_link_is_not_one_on_the_axis_of_the_next_joint(pushed_thigh):
    """There it does the same, but at a place that must be found for that."""
    bench, now, shank, _ = pushed_thigh
    assert any(getattr(shank.fit.effects[-1], name) for name in POINT)
    selection = Selection(now, shank, 1, (0.0,))
    taken, _ = simplest_first(bench, selection, rivals(bench, selection))
    (push,) = taken.effects
    assert (push.name, push.joint) == ("external_force", "hip")
    assert not any(getattr(push, name) for name in POINT)


@pytest.mark.scenario
def test_a_push_on_a_centre_of_mass_needs_no_point(pushed):
    bench, now = pushed
    effect = make_effect("external_force", "knee", start=START, stop=STOP, period=PERIOD, point_x=0.02, point_z=0.01)
    begun = bench.fit((*now.fit.effects, effect), now.noise, start=now.fit.parameters)
    (*_, push) = with_sharp_edges(bench, begun, now.noise, len(now.fit.effects)).effects
    assert not any(getattr(push, name) for name in POINT)


@pytest.mark.scenario
def test_an_edge_among_samples_that_are_left_out_may_be_anywhere_in_these(laboratory):
    """The hip's link reverses while the push on it begins: from a sample before to four samples later all fit alike."""
    push = make_effect("external_force", "hip", start=1.0, stop=1.8, period=PERIOD)
    bench = laboratory.bench(laboratory.record([(push, [40.0, 0.0, 20.0])], periods=10))
    sample = PERIOD / bench.data.samples
    late = replace(push, start=1.0184)
    now = settle(bench, (*bench.effects, late))
    stds = edge_stds(bench, now.fit, now.noise, len(bench.effects))
    assert 1.5 * sample < stds["start"] < 3.0 * sample
    assert stds["stop"] < 0.1 * sample
    # what is told of it says so
    selection = Selection(settle(bench, bench.effects), now, 1, (1e-9,))
    (told,) = named_effects(bench, selection, {}, None)
    std_of = {p.name.removeprefix("hip.external_force_"): p.std for p in told.parameters}
    assert (std_of["start"], std_of["stop"]) == (stds["start"], stds["stop"])
    assert std_of["point_x"] == 0.0
