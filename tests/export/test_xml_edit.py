"""Edits of XML text: what is asked for happens, every other byte stays."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml import etree

from sea_ident.export.xml_edit import XmlText

TEXT = """<?xml version="1.0"?>
<!-- a > b -->
<a  one = '1'>  <!-- tail -->
    <b two="x > y"  three='"'/>
\t<b>text &amp; more<c/></b>
  <d><![CDATA[ </d> ]]></d></a>
<!-- end -->
"""


def test_nothing_asked_nothing_changed() -> None:
    assert XmlText(TEXT).text() == TEXT


def test_elements_are_found_where_they_stand() -> None:
    xml = XmlText(TEXT)
    assert [child.tag for child in xml.root.children] == ["b", "b", "d"]
    assert xml.source(xml.root.children[0]) == """<b two="x > y"  three='"'/>"""
    assert xml.root.all("b")[1].content == "text & more"
    assert xml.root.first("none") is None


def test_attribute_keeps_its_place() -> None:
    xml = XmlText(TEXT)
    xml.set(xml.root.children[0], "two", "<2>")
    xml.set(xml.root.children[0], "four", "4")
    xml.set(xml.root, "one", "0")
    expected = TEXT.replace('two="x > y"', 'two="&lt;2&gt;"').replace("'\"'/>", '\'"\' four="4"/>')
    assert xml.text() == expected.replace("one = '1'", 'one = "0"')


def test_content_of_full_and_empty_elements() -> None:
    xml = XmlText(TEXT)
    full = xml.root.children[2]
    empty = xml.root.children[1].children[0]
    xml.set_content(full, "5")
    xml.set_content(empty, "6")
    xml.set(empty, "k", "v")
    assert "<d>5</d></a>" in xml.text()
    assert '<c k="v">6</c>' in xml.text()


def test_new_elements_are_laid_out_like_their_siblings() -> None:
    xml = XmlText("<a>\n    <b/>   <!-- of b -->\n\n</a>\n")
    xml.add(xml.root, "<c>\n  <d/>\n</c>")
    xml.add(xml.root, "<e/>")
    xml.add(xml.root, "<first/>", first=True)
    xml.add(xml.root.children[0], "<inside/>")
    assert xml.text() == (
        "<a>\n    <first/>\n    <b>\n      <inside/>\n    </b>   <!-- of b -->\n"
        "    <c>\n      <d/>\n    </c>\n    <e/>\n\n</a>\n"
    )


def test_new_element_in_a_file_on_one_line() -> None:
    xml = XmlText("<a><b></b></a>")
    xml.add(xml.root, "<c/>")
    xml.add(xml.root.children[0], "<d/>")
    assert [e.tag for e in etree.fromstring(xml.text()).iter()] == ["a", "b", "d", "c"]


def test_element_is_removed_with_the_blanks_before_it() -> None:
    xml = XmlText(TEXT)
    xml.remove(xml.root.children[0])
    assert xml.text() == TEXT.replace("""\n    <b two="x > y"  three='"'/>""", "")


@settings(max_examples=60, deadline=None)
@given(st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), max_size=20), st.integers(0, 5))
def test_any_value_is_read_back(value: str, which: int) -> None:
    xml = XmlText(TEXT)
    first, second, third = xml.root.children
    nodes = [xml.root, first, second, *second.children, third]
    node = nodes[which % len(nodes)]
    xml.set(node, "new", value)
    parsed = list(etree.fromstring(xml.text().encode()).iter(etree.Element))
    assert parsed[which % len(nodes)].get("new") == value


@pytest.mark.parametrize("break_", ["\r\n", "\n"])
def test_line_breaks_stay(break_: str) -> None:
    text = TEXT.replace("\n", break_)
    xml = XmlText(text)
    xml.set(xml.root, "one", "1")
    assert xml.text().count(break_) == text.count(break_)
