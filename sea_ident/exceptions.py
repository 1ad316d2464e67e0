"""Errors and warnings of sea_ident.

Every message says what is wrong, where (file, joint, column, sample), the numbers with their units, and what to do.
"""


class SeaIdentError(Exception):
    """Base of every error raised on purpose by sea_ident."""


class RobotError(SeaIdentError):
    """A robot description (URDF or annotation) cannot be used."""


class RecordingError(SeaIdentError):
    """A recording cannot be read, or does not hold what is needed."""


class ExcitationError(SeaIdentError):
    """An exciting trajectory cannot be designed or read as asked."""


class InfeasibleError(ExcitationError):
    """The limits exclude each other: no trajectory satisfies them all."""


class SimulationError(SeaIdentError):
    """A simulation cannot be run, or diverged."""


class DivergenceError(SimulationError):
    """A simulation diverged, which another step or another controller may mend.

    Args:
        what: what diverged, where and when.
        remedy: what to do where it was called; who calls it for another purpose tells another one.
    """

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(f"{what}; {remedy}")
        self.what = what
        self._parts = (what, remedy)

    def __reduce__(self) -> tuple[type["DivergenceError"], tuple[str, str]]:
        # By default only the message would travel between processes, which is not what the constructor takes.
        return DivergenceError, self._parts


class IdentificationError(SeaIdentError):
    """Parameters cannot be estimated from this data."""


class ModelFileError(SeaIdentError):
    """A saved model, excitation or diagnosis cannot be read."""


class ExportError(SeaIdentError):
    """A model cannot be written in the format asked for."""


class DiagnosisError(SeaIdentError):
    """A model and a recording cannot be compared as asked."""


class EffectError(SeaIdentError):
    """An effect is unknown, malformed or does not fit the robot."""


class OutputError(SeaIdentError):
    """A file or folder cannot be written."""


class MissingExtraError(SeaIdentError):
    """An optional dependency is not installed."""

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        super().__init__(f"{purpose} needs {package}: pip install 'sea-ident[{extra}]'")
        self._parts = (package, extra, purpose)

    def __reduce__(self) -> tuple[type["MissingExtraError"], tuple[str, str, str]]:
        # By default only the message would travel between processes, which is not what the constructor takes.
        return MissingExtraError, self._parts


class SeaIdentWarning(UserWarning):
    """Base of the warnings of sea_ident; each is also kept in the result that it concerns."""
