"""What stands in a transmission and would not be read: words misspelt, in the wrong place, or twice.

What is absent is identified, so a misspelt number would go missing without a word.
"""

from difflib import get_close_matches

from lxml import etree

from sea_ident.exceptions import RobotError

PLACES = {
    "joint": ("transmission",),
    "actuator": ("transmission",),
    "seriesElastic": ("transmission",),
    "limit": ("joint",),
    "mechanicalReduction": ("actuator", "joint"),
    "torqueConstant": ("actuator",),
    "rotorInertia": ("actuator",),
    "efficiency": ("actuator",),
    "viscousFriction": ("actuator",),
    "coulombFriction": ("actuator",),
    "rotorAxis": ("actuator",),
}
"""Elements that are read, and in which others."""

ATTRIBUTES = {
    "seriesElastic": ("stiffness", "cubicStiffness", "damping"),
    "limit": ("acceleration", "jerk", "deflection", "torque"),
    "rotorAxis": ("link", "xyz"),
    "rotorInertia": ("group",),
}
"""All attributes of elements that are no others' than this project's."""

FOREIGN = ("type", "hardwareInterface", "mechanicalReduction")
"""Elements that other tools read too, wherever they stand."""

ALIKE = 0.8
"""Likeness to a word that is read from which on another is a misspelling of it [-]."""


def check_spelling(transmission: etree._Element, where: str) -> None:
    """Refuse what looks as if it should be read and is not.

    Args:
        transmission: the element, of a motor with or without a spring.
        where: for messages.

    Raises:
        RobotError: a word that is nearly one that is read, one in the wrong place or twice, or an unknown attribute.
    """
    for element in transmission.iter():
        if element is transmission or not isinstance(element.tag, str):
            continue
        parent = element.getparent()
        inside = str(parent.tag)
        if inside == "seriesElastic":
            raise RobotError(
                f"{where}: <{element.tag}> is inside <seriesElastic>, whose numbers are attributes: "
                f'<seriesElastic stiffness="..." cubicStiffness="..." damping="..."/>'
            )
        if element.tag not in PLACES:
            _refuse_misspelt(str(element.tag), where)
            continue
        _check_place(element, inside, where)
        _check_attributes(element, where)


def _refuse_misspelt(tag: str, where: str) -> None:
    if tag in FOREIGN:
        return
    words = {word.lower(): word for word in PLACES}
    alike = get_close_matches(tag.lower().replace("_", ""), words, n=1, cutoff=ALIKE)
    if alike:
        raise RobotError(f"{where}: <{tag}> is not read; did you mean <{words[alike[0]]}>?")


def _check_place(element: etree._Element, inside: str, where: str) -> None:
    tag = str(element.tag)
    if tag in FOREIGN:
        return
    if inside not in PLACES[tag]:
        places = " or ".join(f"<{place}>" for place in PLACES[tag])
        raise RobotError(f"{where}: <{tag}> is inside <{inside}>, where it is not read; put it into {places}")
    if tag not in ("joint", "actuator") and len(element.getparent().findall(tag)) > 1:
        raise RobotError(f"{where}: <{inside}> has <{tag}> more than once; state it once")


def _check_attributes(element: etree._Element, where: str) -> None:
    known = ATTRIBUTES.get(str(element.tag))
    if known is None:
        return
    for attribute in element.attrib:
        if attribute not in known:
            raise RobotError(
                f"{where}: <{element.tag}> has the attribute {attribute!r}, which is not read there; it has "
                f"{', '.join(known)}"
            )
