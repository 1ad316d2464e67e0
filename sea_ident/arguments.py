"""The border of the functions for users: an argument of another kind is named with what gives the right one."""

from numbers import Real

from sea_ident.exceptions import SeaIdentError

_GIVEN_BY = {
    "Robot": "load_robot(...)",
    "Recording": "read_recording(...), or simulate(...).recording",
    "Model": "identify(...) or read_model(...)",
    "Diagnosis": "diagnose(...) or read_diagnosis(...)",
    "Effect": "make_effect(name, joint)",
    "Excitation": "design_excitation(...) or read_excitation(...)",
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
    raise SeaIdentError(f"{where} must be a {' or a '.join(names)}, not a {type(value).__name__}{hint}")


def expect_number(value: object, where: str, unit: str) -> None:
    """Refuse an argument that is neither a number nor None.

    Args:
        value: the argument.
        where: function and name of the argument, for the message.
        unit: of the number, for the message.

    Raises:
        SeaIdentError: it is something else.
    """
    if value is not None and (not isinstance(value, Real) or isinstance(value, bool)):
        raise SeaIdentError(f"{where} must be a number [{unit}] or None, not a {type(value).__name__}, {value!r}")
