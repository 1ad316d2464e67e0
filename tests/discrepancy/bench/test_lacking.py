"""What a model may lack."""

from sea_ident.discrepancy.bench.lacking import candidate_effects
from sea_ident.effects import make_effect


def test_beside_a_ripple_another_is_tried_until_there_are_enough(nothing_missing):
    bench, _ = nothing_missing

    def tried(*numbers):
        there = [make_effect("torque_ripple", "hip", order=4.0 * number, number=number) for number in numbers]
        found = candidate_effects(bench, (*bench.effects, *there))
        assert [e.number for e in found if e.name == "torque_ripple" and e.joint == "knee"] == [1]
        return [e.number for e in found if e.name == "torque_ripple" and e.joint == "hip"]

    assert [tried(), tried(1), tried(1, 2), tried(2), tried(1, 2, 3)] == [[1], [2], [3], [1], []]
