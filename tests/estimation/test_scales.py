"""Torques of another scale than the description: told from the springs, whatever else is identified."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

import sea_ident
from sea_ident.estimation.scales import doubts_of_springs, other_scale
from sea_ident.simulation import simulate


@pytest.fixture(scope="module")
def leg():
    return sea_ident.load_robot("exo_leg")


def springs(leg, factors):
    return [
        SimpleNamespace(joint=name, linear_stiffness=leg.spring(name).stiffness * factor)
        for name, factor in zip(leg.joint_names, factors, strict=True)
    ]


def test_a_negative_stiffness_is_told_with_units_and_where_an_unknown_zero_is_given(leg):
    spring = SimpleNamespace(
        joint="knee", stiffness=-40.0, stiffness_std=1.0, stiffness_noise_std=1.0, largest_deflection=0.02,
        linear_stiffness=-40.0,
    )  # fmt: skip
    (text,) = doubts_of_springs(leg, [spring])
    assert "(-40 +- 1 N m/rad, deflection 0.02 rad at most)" in text
    assert "identify with unknown_zero" in text  # a diagnosis relays it, and has no such argument


@pytest.mark.parametrize(
    ("factors", "said"),
    [
        ((1.1, 1.2, 0.9), ()),
        ((1.0, 1.0, 0.1), ()),  # one that is described wrong
        ((10.0, 10.0, 0.1), ()),
        ((-0.1, 0.1, 0.1), ()),  # that is another warning
        ((1 / 120, 1 / 100, 1.1 / 80), ("gear ratio",)),
        ((1.0, 1.1 / 100, 0.9), ("gear_ratio=100)",)),
        ((0.1, 0.1, 0.1), ("another unit",)),
        ((1000.0, 1000.0, 1000.0), ("another unit",)),
    ],
)
def test_all_springs_that_differ_in_one_direction_tell_of_the_torque(leg, factors, said):
    found = other_scale(leg, springs(leg, factors))
    assert len(found) == len(said)
    assert all(words in text for words, text in zip(said, found, strict=True))


def test_no_springs_say_nothing(leg):
    assert other_scale(leg, []) == []


@pytest.mark.scenario
def test_torques_before_the_gear_are_told(leg):
    series = sea_ident.design_excitation(leg, base_frequency=0.2, harmonics=3, starts=1, seed=0).series
    recording = simulate(leg, series, periods=3, seed=0).recording
    columns = dict(recording.columns)
    for name in leg.joint_names:
        columns[f"current_{name}"] = columns[f"current_{name}"] / leg.spring(name).gear_ratio
    shaft = replace(recording, columns=columns)
    with pytest.warns(sea_ident.SeaIdentWarning) as warned:
        model = sea_ident.identify(leg, shaft)
    text = next(w for w in model.warnings if "no spring has the stiffness that is described" in w)
    assert "softer by the gear ratio" in text
    assert text in [str(w.message) for w in warned]
