"""Against an earlier model: what is found beside is no change of what would take it up, be it new or not."""

import warnings
from dataclasses import replace

import pytest

import sea_ident
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.compared import against as module
from sea_ident.discrepancy.compared.against import against, identified_like, smallest_change
from sea_ident.discrepancy.result.repair import repaired_model
from sea_ident.effects import base_effects, make_effect
from sea_ident.exceptions import IdentificationError, SeaIdentWarning
from sea_ident.processing import process

PERIOD = 5.0
MOTOR = ("torque_constant", "knee", [0.05], {})
SPRING = ("asymmetric_spring", "knee", [15.0], {"exponent": 1.0})
CONSTANT = ("torque_offset", "hip", [1.0], {})
RUBBED = ("coulomb_friction", "ankle", [0.5], {})


def quietly(call, *given, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return call(*given, **options)


def effects_of(planted):
    return tuple(make_effect(name, joint, **shape) for name, joint, _, shape in planted)


@pytest.fixture(scope="module")
def changed(laboratory, leg):
    """The change between two recordings where these effects were found in the second, which the first model lacks."""

    def change(before, now, found):
        reference = quietly(sea_ident.identify, leg, laboratory.record(before, seed=11), period=PERIOD)
        recording = laboratory.record(now)
        bench = laboratory.bench(recording)
        settled = settle(bench, (*bench.effects, *effects_of(found)))
        return smallest_change(reference, bench, settled, process(recording, leg, period=PERIOD))

    return change


@pytest.mark.scenario
@pytest.mark.parametrize("new", [MOTOR, CONSTANT], ids=lambda e: e[0])
def test_an_effect_that_is_new_changes_nothing_else(changed, new):
    assert not changed([], [new], [new]).changed


@pytest.mark.scenario
def test_an_effect_that_was_there_before_changes_nothing(changed):
    assert not changed([MOTOR], [MOTOR], [MOTOR]).changed


@pytest.mark.scenario
def test_one_effect_that_is_new_beside_one_that_was_there(changed):
    assert not changed([MOTOR], [MOTOR, CONSTANT], [MOTOR, CONSTANT]).changed


@pytest.mark.scenario
@pytest.mark.parametrize("new", [MOTOR, SPRING, CONSTANT], ids=lambda e: e[0])
@pytest.mark.parametrize("before", [False, True], ids=["new", "old"])
def test_what_changed_is_found_beside_an_effect(changed, new, before):
    found = changed([new] * before, [new, RUBBED], [new])
    assert [(m.effect, m.joint) for m in found.missing] == [("coulomb_friction", "ankle")]
    change = found.missing[0].parameters[0]
    assert abs(change.value - 0.5) < 4.0 * change.std


@pytest.fixture(scope="module")
def again(laboratory, leg):
    """A repaired model of a leg with friction at a link, and the same leg recorded again."""
    planted = [("link_friction", "knee", [0.1, 0.15], {})]
    effects = (*laboratory.effects, *effects_of(planted))
    experiments = []
    for seed in (11, 3):
        recording = laboratory.record(planted, seed=seed)
        bench = laboratory.bench(recording, effects)
        experiments.append((bench, settle(bench, effects), process(recording, leg, period=PERIOD)))
    (_, settled, processed), now = experiments
    usual = quietly(sea_ident.identify, leg, processed, effects=(*base_effects(leg), *effects_of(planted)))
    return repaired_model(usual, processed, settled.fit), now


@pytest.mark.scenario
def test_a_repaired_model_is_a_reference_for_the_same_robot(monkeypatch, again):
    """Noise may carry what the motor torques alone hardly tell: of that the repaired one has the link equations."""
    reference, now = again
    assert not smallest_change(reference, *now).changed

    def carried(*given, **options):
        model = sea_ident.identify(*given, **options)
        return replace(model, values=model.values + 20.0 * model.std)

    monkeypatch.setattr(module, "identify", carried)
    assert not smallest_change(reference, *now).changed


@pytest.mark.scenario
def test_where_link_equations_do_not_help_the_motor_torques_are_compared_alone(monkeypatch, again):
    def refused(*_):
        raise IdentificationError("not told")

    reference, now = again
    monkeypatch.setattr(module, "identified_beside", refused)
    assert len(identified_like(reference, *now)) == 1


def test_without_a_reference_there_is_nothing_to_compare(nothing_missing):
    bench, settled = nothing_missing
    assert against(None, bench, settled, None) == (None, ())
