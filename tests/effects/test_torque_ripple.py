"""Several orders at one joint."""

import numpy as np
import pytest

from sea_ident.base_parameters import random_motion
from sea_ident.effects import State, base_effects, effect_from_dict, make_effect
from sea_ident.effects.torque_ripple import MOST
from sea_ident.exceptions import EffectError, SeaIdentError
from sea_ident.regressor import model_columns
from sea_ident.robot import load_robot


def chain():
    found = [make_effect("torque_ripple", "hip", order=4.0)]
    while (following := found[-1].beside()) is not None:
        found.append(following)
    return found


def test_those_of_one_joint_stand_side_by_side_under_names_of_their_own():
    leg, ripples = load_robot("exo_leg"), chain()
    assert len(ripples) == MOST
    names = [column.name for ripple in ripples for column in ripple.columns(leg)]
    names += [ripple.parameter_name("order") for ripple in ripples]
    assert len(set(names)) == 3 * MOST
    assert len({ripple.title for ripple in ripples}) == MOST
    assert ripples[0].title == "torque_ripple at hip"
    columns = model_columns(leg, (*base_effects(leg), *ripples))
    assert len({column.name for column in columns}) == len(columns)


def test_the_number_changes_the_names_alone_and_survives_a_file():
    leg = load_robot("exo_leg")
    state = State(leg, random_motion(leg, samples=20, seed=4))
    first = make_effect("torque_ripple", "hip", order=4.0)
    second = make_effect("torque_ripple", "hip", order=4.0, number=2)
    np.testing.assert_array_equal(first.evaluate(state).motor, second.evaluate(state).motor)
    assert effect_from_dict(second.to_dict()) == second
    assert {each.number for each in second.variants(state)} == {2}


@pytest.mark.parametrize("number", [0, -1, 1.5, True, "2"])
def test_a_number_that_is_none_is_refused(number):
    with pytest.raises(EffectError, match=r"torque_ripple.*number"):
        make_effect("torque_ripple", "hip", number=number)


def test_two_of_one_number_are_refused_and_what_to_do_is_said():
    leg = load_robot("exo_leg")
    twice = [make_effect("torque_ripple", "hip", order=order) for order in (4.0, 12.0)]
    with pytest.raises(SeaIdentError, match=r"hip.torque_ripple_sine.*number=2"):
        model_columns(leg, (*base_effects(leg), *twice))
