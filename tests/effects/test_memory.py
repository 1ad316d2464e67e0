"""Effects with memory along a path."""

import numpy as np
import pytest

from sea_ident.effects import effect_from_dict
from sea_ident.effects.memory import MemoryEffect, OneWayEffect
from sea_ident.effects.presliding_friction import PreslidingFriction
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.robot import load_robot


@pytest.mark.parametrize(
    "effect", [SpringHysteresis(joint="knee", slip=0.02), PreslidingFriction(joint="knee", displacement=0.02)]
)
def test_a_path_is_followed_as_step_by_step(effect: OneWayEffect) -> None:
    time = np.linspace(0.0, 1.0, 900, endpoint=False)
    noise = 2e-4 * np.random.default_rng(0).standard_normal(len(time))
    path = 0.1 * np.sin(2.0 * np.pi * time) + 0.03 * np.sin(14.0 * np.pi * time) + noise
    path[300:350] = path[300]  # at rest
    steps, begin = np.diff(path, prepend=path[-1]), (0.3,) * effect.memory_size
    np.testing.assert_allclose(
        effect.trace(begin, steps), MemoryEffect.trace(effect, begin, steps), rtol=0.0, atol=1e-12
    )


def test_hysteresis_goes_round_a_loop_that_closes() -> None:
    time = np.linspace(0.0, 1.0, 400, endpoint=False)
    effect = SpringHysteresis(joint="knee", slip=0.02)
    zeros = np.zeros_like(time)
    columns = effect.local_columns(zeros, zeros, 0.1 * np.sin(2.0 * np.pi * time), zeros)
    np.testing.assert_allclose(columns[200:], -columns[:200], atol=1e-12)
    assert np.ptp(columns, axis=0) == pytest.approx([2.0, 2.0])


def test_an_element_that_is_left_out_changes_nothing_of_the_other() -> None:
    time = np.linspace(0.0, 1.0, 400, endpoint=False)
    both, one = SpringHysteresis(joint="knee", slip=0.02), SpringHysteresis(joint="knee", slip=0.02, elements=1)
    state = np.zeros_like(time), np.zeros_like(time), 0.05 * np.sin(2.0 * np.pi * time), np.zeros_like(time)
    np.testing.assert_array_equal(one.local_columns(*state), both.local_columns(*state)[:, :1])
    leg = load_robot("exo_leg")
    assert [column.name for column in one.columns(leg)] == ["knee.spring_hysteresis_narrow"]
    assert both.slips.tolist() == [0.02, 0.06]
    assert one.slips.tolist() == [0.02]
    assert effect_from_dict(one.to_dict()) == one
    assert effect_from_dict({"effect": "spring_hysteresis", "joint": "knee", "shape": {"slip": 0.02}}) == both
