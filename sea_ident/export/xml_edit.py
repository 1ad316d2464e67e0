"""Editing XML as text: what is not edited keeps every byte, layout and comments included."""

import re
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

_ATTRIBUTE = r"(\s{name}\s*=\s*)(\"[^\"]*\"|'[^']*')"


@dataclass(eq=False)
class Node:
    """An element and where it stands in the text, as byte offsets.

    Attributes:
        tag: name as written, prefix included.
        attributes: attributes as read.
        parent: the element around it.
        children: elements inside, in order.
        start: of the start tag.
        inner: end of the start tag.
        close: start of the end tag; `inner` where the element is empty (`<a/>`).
        end: end of the element.
        content: text directly inside.
    """

    tag: str
    attributes: dict[str, str]
    parent: "Node | None"
    children: list["Node"] = field(default_factory=list)
    start: int = 0
    inner: int = 0
    close: int = 0
    end: int = 0
    content: str = ""

    def all(self, tag: str) -> list["Node"]:
        """Its children of this name."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> "Node | None":
        """Its first child of this name."""
        return next(iter(self.all(tag)), None)


class XmlText:
    """An XML text with edits pending; `text` gives the result.

    Args:
        text: well-formed XML without a document type.
    """

    def __init__(self, text: str) -> None:
        self._data = text.encode()
        self._edits: list[tuple[int, int, bytes]] = []
        self._attributes: dict[Node, dict[str, str]] = {}
        self._added: dict[tuple[Node, bool], list[str]] = {}
        self.root = self._parse()

    def _parse(self) -> Node:
        parser = expat.ParserCreate("utf-8")
        stack: list[Node] = []
        roots: list[Node] = []

        def start(tag: str, attributes: dict[str, str]) -> None:
            at = parser.CurrentByteIndex
            node = Node(tag, attributes, stack[-1] if stack else None, start=at, inner=self._tag_end(at))
            (stack[-1].children if stack else roots).append(node)
            stack.append(node)

        def end(tag: str) -> None:
            node, at = stack.pop(), parser.CurrentByteIndex
            empty = self._data[node.inner - 2 : node.inner] == b"/>"
            node.close = node.inner if empty else at
            node.end = node.inner if empty else self._tag_end(at)

        def characters(text: str) -> None:
            stack[-1].content += text

        parser.StartElementHandler, parser.EndElementHandler = start, end
        parser.CharacterDataHandler = characters
        parser.Parse(self._data, True)
        return roots[0]

    def _tag_end(self, at: int) -> int:
        """Offset behind the tag that starts at `at`; a > within quotes does not end it."""
        match = re.compile(rb"<(?:[^>\"']|\"[^\"]*\"|'[^']*')*>").match(self._data, at)
        return at if match is None else match.end()

    def source(self, node: Node) -> str:
        """The element as it stands in the text."""
        return self._data[node.start : node.end].decode()

    def set(self, node: Node, name: str, value: str) -> None:
        """Give an attribute a value."""
        self._attributes.setdefault(node, {})[name] = value

    def set_content(self, node: Node, text: str) -> None:
        """Replace what is inside an element by text."""
        if node.close == node.inner and self._is_empty(node):
            self._edits.append((node.inner - 2, node.inner, f">{text}</{node.tag}>".encode()))
        else:
            self._edits.append((node.inner, node.close, text.encode()))

    def add(self, parent: Node, element: str, *, first: bool = False) -> None:
        """Put a new element into another one, laid out like its siblings.

        Args:
            parent: where it goes.
            element: its XML; further lines are indented like the first.
            first: before the other children rather than after them.
        """
        self._added.setdefault((parent, first), []).append(element)

    def remove(self, node: Node) -> None:
        """Take an element out, with the blanks before it."""
        start = node.start
        while start > 0 and self._data[start - 1 : start] in (b" ", b"\t", b"\n", b"\r"):
            start -= 1
        self._edits.append((start, node.end, b""))

    def text(self) -> str:
        """The text with all edits made."""
        edits = [*self._edits, *(self._insertion(*place, new) for place, new in self._added.items())]
        for node, attributes in self._attributes.items():
            tag = self._data[node.start : node.inner].decode()
            for name, value in attributes.items():
                tag = _with_attribute(tag, name, value)
            # an edit of the inside of an empty element replaces its "/>" and so must not be undone here
            tail = 2 if self._is_empty(node) else 1
            edits.append((node.start, node.inner - tail, tag[:-tail].encode()))
        data = self._data
        for start, end, new in sorted(edits, key=lambda edit: (edit[0], edit[1]), reverse=True):
            data = data[:start] + new + data[end:]
        return data.decode()

    def _insertion(self, parent: Node, first: bool, elements: list[str]) -> tuple[int, int, bytes]:
        """The edit that puts new elements into a parent."""
        if self._is_empty(parent):
            outer = self._indent(parent)
            inside = "".join(self._laid_out(element, outer + "  ") for element in elements) + "\n" + outer
            return parent.inner - 2, parent.inner, f">{inside}</{parent.tag}>".encode()
        indent = self._indent(parent.children[0]) if parent.children else self._indent(parent) + "  "
        at = parent.inner
        if parent.children and not first:
            at = parent.children[-1].end
            remark = re.match(rb"[ \t]*<!--.*?-->", self._data[at : parent.close], re.DOTALL)
            at += 0 if remark is None else remark.end()
        laid_out = "".join(self._laid_out(element, indent) for element in elements)
        if b"\n" not in self._data[at : parent.close].partition(b"<")[0]:
            laid_out += "\n" + (indent if first and parent.children else self._indent(parent))
        return at, at, laid_out.encode()

    def _is_empty(self, node: Node) -> bool:
        return self._data[node.inner - 2 : node.inner] == b"/>"

    def _indent(self, node: Node) -> str:
        """Blanks before an element that starts its line."""
        line = self._data.rfind(b"\n", 0, node.start) + 1
        before = self._data[line : node.start]
        return before[: len(before) - len(before.lstrip())].decode()

    @staticmethod
    def _laid_out(element: str, indent: str) -> str:
        return "".join(f"\n{indent}{line}" for line in element.splitlines())


def _with_attribute(tag: str, name: str, value: str) -> str:
    pattern = re.compile(_ATTRIBUTE.format(name=re.escape(name)))
    if pattern.search(tag):
        return pattern.sub(lambda match: match.group(1) + quoteattr(value), tag, count=1)
    body, end = (tag[:-2], "/>") if tag.endswith("/>") else (tag[:-1], ">")
    return f"{body.rstrip()} {name}={quoteattr(value)}{end}"
