"""Safe reading of XML, and numbers out of it."""

import re
from math import isinf, isnan

import numpy as np
from lxml import etree

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RobotError

LARGEST_FILE = 64 * 2**20
LARGEST_NUMBER = 1e12
_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")


def parse_xml(text: str | bytes, file: str) -> etree._Element:
    """Parse XML without entities, DTDs or network.

    A default namespace (``<robot xmlns="...">``) is dropped from the names of the elements, as ROS does.

    Args:
        text: the XML; the encoding that a `str` declares does not matter.
        file: where it came from, for messages.

    Returns:
        The root element.

    Raises:
        RobotError: if it is not well-formed, too large, or carries a document type.
    """
    try:
        data = _DECLARATION.sub("", text).encode() if isinstance(text, str) else text
    except UnicodeEncodeError as error:
        raise RobotError(f"{file}: is not text: {error}") from None
    if len(data) > LARGEST_FILE:
        raise RobotError(f"{file}: {len(data)} bytes is too large for a URDF (at most {LARGEST_FILE})")
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False)
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError, LookupError) as error:
        raise RobotError(f"{file}: malformed XML: {error}; correct the file") from None
    if root.getroottree().docinfo.doctype:
        raise RobotError(f"{file}: carries a DOCTYPE, which is not read for safety; remove it")
    namespace = root.nsmap.get(None)
    if namespace is not None:
        for element in root.iter(f"{{{namespace}}}*"):
            element.tag = etree.QName(element).localname
    return root


def number(element: etree._Element, attribute: str, default: float | None, where: str, *, finite: bool = True) -> float:
    """A number from an attribute.

    Args:
        element: the element.
        attribute: name of the attribute.
        default: value where it is missing; None where it must not be missing.
        where: for messages.
        finite: whether infinity and senseless sizes are refused.

    Returns:
        The number, never NaN.

    Raises:
        RobotError: if the attribute is missing without a default, not a number, not finite or senselessly large.
    """
    text = element.get(attribute)
    if text is None:
        if default is None:
            raise RobotError(f"{where}: <{element.tag}> has no attribute {attribute!r}; add it")
        return default
    try:
        value = float(text)
    except ValueError:
        raise RobotError(f"{where}: {attribute}={text!r} of <{element.tag}> is not a number{_hint(text)}") from None
    if isnan(value) or (finite and isinf(value)):
        raise RobotError(f"{where}: {attribute}={text!r} of <{element.tag}> is not finite")
    if finite and abs(value) > LARGEST_NUMBER:
        raise RobotError(f"{where}: {attribute}={text!r} of <{element.tag}> is larger than any robot; check its unit")
    return value


def _hint(text: str) -> str:
    return "; expand the file with xacro first" if "${" in text or "$(" in text else ""


def vector(element: etree._Element | None, attribute: str, default: str, where: str) -> FloatArray:
    """Three finite numbers from an attribute.

    Raises:
        RobotError: if there are not three finite numbers.
    """
    text = default if element is None else element.get(attribute, default)
    try:
        value = np.array([float(part) for part in text.split()])
    except ValueError:
        raise RobotError(f"{where}: {attribute}={text!r} is not three numbers{_hint(text)}") from None
    if value.shape != (3,) or not np.all(np.isfinite(value)):
        raise RobotError(f"{where}: {attribute}={text!r} is not three finite numbers")
    if np.any(np.abs(value) > LARGEST_NUMBER):
        raise RobotError(f"{where}: {attribute}={text!r} is larger than any robot; check its unit")
    return value
