"""What may be beside an effect and would not show: how well the effect is known then."""

from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.evidence.named import WIDER, known_least_with, named_effects
from sea_ident.discrepancy.evidence.unseen import beside_others
from sea_ident.discrepancy.result.diagnosis import Diagnosis, read_diagnosis
from sea_ident.discrepancy.result.findings import (
    Alternative,
    LackOfFit,
    MissingEffect,
    MissingParameter,
    Unseen,
    Verdict,
)
from sea_ident.discrepancy.search.search import Selection, search
from sea_ident.discrepancy.search.taken_up import taken_up
from sea_ident.effects import make_effect
from sea_ident.simulation import FrictionJitter

CONSTANT, ZERO = 0.15, -0.00036


@pytest.fixture(scope="module")
def constant(laboratory):
    """A constant in the spring of the knee, and another zero of its encoder that is too small for a name."""
    planted = [("spring_offset", "knee", [CONSTANT], {}), ("encoder_offset", "knee", [], {"offset": ZERO})]
    bench = laboratory.bench(laboratory.record(planted, periods=12, jitter=FrictionJitter(0.0)))
    start = settle(bench, bench.effects)
    effects = (*start.fit.effects, make_effect("spring_offset", "knee"))
    fit = bench.fit(effects, start.noise, start=start.fit.parameters)
    now = Settled(fit, bench.noise(fit))
    return bench, start, Settled(bench.fit(fit.effects, now.noise, start=fit.parameters), now.noise)


@pytest.fixture(scope="module")
def zeros(constant):
    """What a search finds of both, as it is told."""
    bench, start, now = constant
    return named_effects(bench, Selection(start, now, 1, (0.0,)), {}, None)


@pytest.mark.scenario
def test_to_first_order_it_is_what_a_fit_beside_it_says(constant):
    bench, _, now = constant
    effect = make_effect("encoder_offset", "knee")
    (found,) = (each for each in beside_others(bench, now, "knee") if each.effect == effect)
    whole = bench.refine((*now.fit.effects, effect), now.noise, start=now.fit.parameters, only=len(bench.effects))
    count = len(now.fit.columns)
    plain = np.linalg.norm(now.fit.covariance_factor, axis=1)
    beside = np.linalg.norm(whole.covariance_factor, axis=1)[:count]
    np.testing.assert_allclose(np.hypot(plain, found.stds)[:count], beside, rtol=0.1, atol=1e-9)
    own = [column.name for column in now.fit.columns].index("knee.spring_offset")
    assert beside[own] > WIDER * plain[own]
    assert found.shift[own] == pytest.approx(whole.values[own] - now.fit.values[own], rel=0.05)


@pytest.mark.scenario
def test_an_effect_that_fits_better_beside_what_has_no_name_is_known_no_better_than_that(constant, zeros):
    """The constant alone is half of what it is, ten of the standard deviations that it has alone."""
    now = constant[-1]
    own = [column.name for column in now.fit.columns].index("knee.spring_offset")
    assert abs(now.fit.values[own] - CONSTANT) > 10.0 * now.fit.std(own)
    (found,) = zeros
    (told,) = found.parameters
    assert told.value == pytest.approx(now.fit.values[own])
    assert abs(told.value - CONSTANT) < 2.0 * told.std


@pytest.mark.scenario
def test_what_is_worth_nothing_does_not_make_an_effect_less_known(laboratory):
    bench = laboratory.bench(laboratory.record([("spring_offset", "knee", [CONSTANT], {})], periods=12))
    start = settle(bench, bench.effects)
    fit = bench.fit((*start.fit.effects, make_effect("spring_offset", "knee")), start.noise, start=start.fit.parameters)
    now = Settled(fit, start.noise)
    assert not any(each.better for each in beside_others(bench, now, "knee"))
    (found,) = named_effects(bench, Selection(start, now, 1, (0.0,)), {}, None)
    (told,) = found.parameters
    assert abs(told.value - CONSTANT) < 3.0 * told.std
    assert (found.unseen.effect, found.unseen.joint) == ("encoder_offset", "knee")
    (beside,) = found.unseen.parameters
    assert (beside.name, beside.value) == (told.name, told.value)
    assert beside.std > WIDER * told.std


@pytest.mark.scenario
@pytest.mark.parametrize(("dearer", "covered"), [(False, True), (True, False)])
def test_what_depends_on_what_another_effect_is_covers_all_that_it_may_be(laboratory, dearer, covered):
    """A constant at the motor is one in the spring and one on the link: a preload there is told as of one of them."""
    preload, constant = 0.4, -0.7
    planted = [("torque_offset", "knee", [constant], {}), ("parallel_spring", "knee", [1.3, preload], {})]
    bench = laboratory.bench(laboratory.record(planted, periods=8))
    start = settle(bench, bench.effects)
    fits = [
        bench.fit(
            (*start.fit.effects, make_effect(name, "knee"), make_effect("parallel_spring", "knee")),
            start.noise,
            start=start.fit.parameters,
        )
        for name in ("spring_offset", "torque_offset")
    ]
    assert fits[0].statistic == pytest.approx(fits[1].statistic, rel=1e-3)
    selection = Selection(start, Settled(fits[0], start.noise), 2, (0.0, 0.0))
    other = Alternative("torque_offset", "knee", 1.0, fits[1], dearer=dearer)
    # nothing is told of how well an amount is known beside what is the same altogether
    assert "torque_offset" not in {each.effect.name for each in beside_others(bench, selection.final, "knee")}
    found = named_effects(bench, selection, {len(start.fit.effects): (other,)}, None)
    told = {p.name: p for effect in found for p in effect.parameters}
    rest = told["knee.parallel_spring_preload"]
    assert rest.value - preload == pytest.approx(constant, abs=0.1)
    assert (abs(rest.value - preload) < 2.0 * rest.std) is covered
    # what it is itself is told as of that
    assert told["knee.spring_offset"].std < 0.1 * abs(constant)


def parameter(name, std):
    return MissingParameter(name, 2.0, std, "N m")


def test_the_one_that_makes_it_known_least_is_told_with_what_it_makes_so():
    own = [parameter("a", 1.0), parameter("b", 1.0), parameter("held", 0.0)]
    effects = [make_effect(name, "knee") for name in ("torque_offset", "encoder_offset", "torque_constant")]
    stds = [(0.9 * WIDER, 1.0), (1.0, 3.0 * WIDER), (2.0 * WIDER, 2.0 * WIDER)]
    wider = [
        (e, [parameter("a", a), parameter("b", b), parameter("held", 9.0)])
        for e, (a, b) in zip(effects, stds, strict=True)
    ]
    assert known_least_with(own, wider[:1]) is None
    assert known_least_with(own, wider) == Unseen("encoder_offset", "knee", (parameter("b", 3.0 * WIDER),))


def test_it_is_said_beside_the_effect_and_kept_in_the_file(tmp_path):
    there = Unseen("encoder_offset", "knee", (parameter("knee.spring_offset", 0.5),))
    own = parameter("knee.spring_offset", 0.01)
    effects = tuple(MissingEffect("spring_offset", "knee", (own,), 0.1, 0.0, (), unseen=u) for u in (there, None))
    found = Diagnosis(Verdict.NAMED, "", LackOfFit(0.0, 1, 1.0, 1.0, {}), (), effects)
    told = (
        "    known so well only without encoder_offset at knee, which would hardly show beside it: with one, "
        "knee.spring_offset 2 +- 0.5 N m"
    )
    assert found.summary().splitlines().count(told) == 1
    found.save(tmp_path / "DIAGNOSIS.json")
    assert [effect.unseen for effect in read_diagnosis(tmp_path / "DIAGNOSIS.json").missing] == [there, None]


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("first", "zero"),
    [
        (("encoder_eccentricity", "knee", [], {"sine": 0.00145, "cosine": 0.00125}), 0.00075),
        (("spring_offset", "knee", [0.45], {}), -0.00109),
    ],
)
def test_another_zero_of_an_encoder_is_found_beside_what_takes_it_up(laboratory, first, zero):
    """It changes the torque by less than what matters, and what takes it up by half or more."""
    planted = [first, ("encoder_offset", "knee", [], {"offset": zero})]
    bench = laboratory.bench(laboratory.record(planted, periods=12, jitter=FrictionJitter(0.0)))
    found = search(bench, bench.effects)
    assert {(effect.name, effect.joint) for effect in found.effects} == {(first[0], "knee"), ("encoder_offset", "knee")}
    told = {p.name: p for each in named_effects(bench, found, {}, None) for p in each.parameters}
    true = {"knee.encoder_offset_offset": zero}
    true |= {f"knee.{first[0]}_{name}": value for name, value in first[3].items()}
    true |= {f"knee.{first[0]}": value for value in first[2]}
    for name, value in true.items():
        assert abs(told[name].value - value) < 3.0 * told[name].std


@pytest.mark.parametrize(
    ("joint", "before", "statistic", "expected"),
    [
        ("knee", 0.1, 100.0, True),
        ("hip", 0.1, 100.0, False),  # elsewhere it is no matter of what takes up what
        ("knee", 0.58, 100.0, False),  # the first is about what it was
        ("knee", 0.1, 400.0, False),  # much is left
    ],
)
def test_what_is_taken_up_matters_where_it_explains_the_rest_and_makes_the_other_another(
    monkeypatch, joint, before, statistic, expected
):
    from sea_ident.discrepancy.search import taken_up as module

    first, second = make_effect("spring_offset", "knee"), make_effect("encoder_offset", joint, offset=0.001)
    bench = SimpleNamespace(effects=(), labels_of=lambda effect: effect.columns(robot))
    robot = SimpleNamespace(joints=[SimpleNamespace(torque_unit="N m", position_unit="rad")], index=lambda name: 0)
    less = SimpleNamespace(effects=(first,), parameters={"knee.spring_offset": before}, statistic=1000.0, excess=900.0)
    fit = SimpleNamespace(effects=(first, second), parameters={"knee.spring_offset": 0.6}, statistic=statistic)
    monkeypatch.setattr(module, "lack_of_fit", lambda bench, settled: (statistic, 100, 0.0))
    assert taken_up(bench, less, fit, None, -1) is expected
    push = SimpleNamespace(
        effects=(first, make_effect("external_force", joint)), parameters=fit.parameters, statistic=1.0
    )
    assert not taken_up(bench, less, push, None, -1)
    monkeypatch.setattr(module, "lack_of_fit", lambda bench, settled: (statistic, 100, 0.5))
    assert taken_up(bench, less, fit, None, -1) is (expected or statistic == 400.0)
