"""Bars: names come from files and must not become markup."""

import xml.etree.ElementTree as ElementTree

from sea_ident.report.bars import bars


def test_every_name_is_shown_as_it_is():
    names = ["<b>joint</b>", 'a & "b"']
    svg = bars(names, {"<i>before</i>": [1.0, 2.0]}, ["before"], "gap < 1 & more", ["N m <sup>"] * 2)
    root = ElementTree.fromstring(svg)
    shown = ["".join(e.itertext()) for e in root.iter("text")]
    assert {*names, "gap < 1 & more", "N m <sup>"} <= set(shown)
    assert not list(root.iter("b")) + list(root.iter("i")) + list(root.iter("sup"))
    assert [e.text.split(",")[0] for e in root.iter("title")] == names
