"""The words of a diagnosis."""

from sea_ident.discrepancy.findings import Gap
from sea_ident.discrepancy.words import _gap_sentence


def test_the_gap_of_a_slide_is_a_force():
    gap = Gap({"lift": 2.0, "turn": 0.5}, {"lift": 0.0, "turn": 0.1}, {"lift": 0.3, "turn": 0.2})
    units = {"lift": "N", "turn": "N m"}
    assert "(0.3 N) at lift" in _gap_sentence(gap, units)
    turned = Gap({"lift": 0.1, "turn": 0.5}, {"lift": 0.0, "turn": 0.1}, gap.noise)
    assert "to 0.1 N m at turn" in _gap_sentence(turned, units)
