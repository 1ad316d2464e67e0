"""The border of the functions for users: an argument of another kind is named with what gives the right one."""

import os
from collections.abc import Collection
from numbers import Integral, Real
from pathlib import Path

from sea_ident.exceptions import SeaIdentError

_GIVEN_BY = {
    "Robot": "load_robot(...)",
    "Recording": "read_recording(...), or simulate(...).recording",
    "Model": "identify(...) or read_model(...)",
    "Diagnosis": "diagnose(...) or read_diagnosis(...)",
    "Effect": "make_effect(name, joint)",
    "Excitation": "design_excitation(...) or read_excitation(...)",
    "Limits": "robot.limits, or robot.limits.replace(...),",
    "Ramp": "Ramp(seconds)",
    "LinksInside": "LinksInside(reserve)",
    "LinksAsPlanned": "LinksAsPlanned()",
    "Criterion": "DOptimality() or another of sea_ident.excitation",
    "Estimator": "InstrumentalVariables() or another of sea_ident.estimation",
    "Controller": "VelocityController() or another of sea_ident.simulation",
    "FrictionLaw": "SmoothCoulomb() or another of sea_ident.simulation",
}


def expect(value: object, where: str, *kinds: type) -> None:
    """Refuse an argument that is of none of these kinds.

    Args:
        value: the argument.
        where: function and name of the argument, for the message.
        kinds: what it may be.

    Raises:
        SeaIdentError: it is something else; the message says what gives the right kind.
    """
    if isinstance(value, kinds):
        return
    names = [kind.__name__ for kind in kinds]
    sources = [_GIVEN_BY[name] for name in names if name in _GIVEN_BY]
    hint = f"; {' or '.join(sources)} gives one" if sources else ""
    raise SeaIdentError(f"{where} must be {' or '.join(map(_with_article, names))}, not {_kind(value)}{hint}")


def expect_optional(value: object, where: str, *kinds: type) -> None:
    """Refuse an argument that is neither None nor of one of these kinds, as `expect`."""
    if value is not None:
        expect(value, where, *kinds)


def as_path(value: object, where: str) -> Path:
    """The path that an argument is.

    Args:
        value: the argument.
        where: function and name of the argument, for the message.

    Returns:
        The path; whether anything is there is for the caller to see.

    Raises:
        SeaIdentError: it is neither a text nor a path.
    """
    # Bytes are no path here: they would have to be decoded by a guess.
    if not isinstance(value, str | os.PathLike) or not isinstance(os.fspath(value), str):
        raise SeaIdentError(f"{where} must be a path, as text or pathlib.Path, not {_kind(value)}, {value!r}")
    return Path(value)


def expect_names(value: object, where: str) -> None:
    """Refuse an argument that is no list of texts.

    Args:
        value: the argument.
        where: function and name of the argument, for the message.

    Raises:
        SeaIdentError: it is one text, no list, or a list of something else.
    """
    if isinstance(value, str) or not isinstance(value, Collection):
        raise SeaIdentError(f"{where} must be a list of names, not {value!r}")
    for name in value:
        if not isinstance(name, str):
            raise SeaIdentError(f"{where} must be a list of names; {name!r} in it is {_kind(name)}")


def expect_whole(value: object, where: str, least: int | None = None) -> None:
    """Refuse an argument that is no whole number, or one that is too small.

    Args:
        value: the argument.
        where: function and name of the argument, for the message.
        least: the smallest that is allowed; any where None.

    Raises:
        SeaIdentError: it is something else, or smaller.
    """
    if not isinstance(value, Integral) or isinstance(value, bool) or (least is not None and value < least):
        bound = "" if least is None else f" of at least {least}"
        raise SeaIdentError(f"{where} must be a whole number{bound}, not {value!r}")


def expect_real(value: object, where: str) -> None:
    """Refuse an argument that is not a number."""
    if not _is_number(value):
        raise SeaIdentError(f"{where} must be a number, not {_kind(value)}, {value!r}")


def expect_number(value: object, where: str, unit: str) -> None:
    """Refuse an argument that is neither a number nor None.

    Args:
        value: the argument.
        where: function and name of the argument, for the message.
        unit: of the number, for the message.

    Raises:
        SeaIdentError: it is something else.
    """
    if value is not None and not _is_number(value):
        raise SeaIdentError(f"{where} must be a number [{unit}] or None, not {_kind(value)}, {value!r}")


def _kind(value: object) -> str:
    """What it is, in words."""
    return "None" if value is None else _with_article(type(value).__name__)


def _with_article(name: str) -> str:
    return f"{'an' if name[0] in 'aeiouAEIOU' else 'a'} {name}"


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)
