"""A spring with dry friction in it rests anywhere: a constant and the friction of one spring are no one effect."""

import pytest

from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.nameless.unnamed import unnamed
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import make_effect


@pytest.mark.scenario
@pytest.mark.parametrize("joint", ["hip", "ankle"])
def test_a_constant_beside_dry_friction_is_no_effect_without_a_name(laboratory, joint):
    """Either of them under a load of one sign alone does what both do."""
    friction = {"slip": 0.0025}
    planted = [("spring_offset", joint, [-0.4], {}), ("spring_hysteresis", joint, [0.0, 0.05], friction)]
    bench = laboratory.bench(laboratory.record(planted, periods=8))
    start = settle(bench, bench.effects)
    both = make_effect("spring_offset", joint), make_effect("spring_hysteresis", joint, **friction)
    final = settle_again(bench, bench.fit((*start.fit.effects, *both), start.noise, start=start.fit.parameters))
    assert final.fit.statistic < 1.2 * final.fit.dof
    assert unnamed(bench, Selection(start, final, 2, (1e-9, 1e-9)), None) == ()
