"""Diagnose, add what is missing, diagnose again, until there is nothing more to add."""

from collections.abc import Callable
from dataclasses import dataclass

from sea_ident.discrepancy.diagnose import diagnose
from sea_ident.discrepancy.diagnosis import Diagnosis, Verdict
from sea_ident.estimation import Model
from sea_ident.exceptions import DiagnosisError
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording

NAMED = (Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER)
"""Verdicts after which the named effects are added and the recording is diagnosed again."""


@dataclass(frozen=True, eq=False)
class ClosedGap:
    """The history of a model that was repaired.

    Attributes:
        rounds: diagnoses, the first of the model as it was given.
        model: the model after the last round that added something; the given one where nothing was added.
        warnings: of all rounds, and why it stopped early.
    """

    rounds: tuple[Diagnosis, ...]
    model: Model
    warnings: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """What the last round said."""
        return self.rounds[-1].verdict

    @property
    def added(self) -> tuple[tuple[str, str | None], ...]:
        """Effect and joint of everything that was added, in the order in which it was found."""
        pairs = [(m.effect, m.joint) for d in self.rounds if d.verdict in NAMED for m in d.missing]
        return tuple(dict.fromkeys(pairs))

    def summary(self) -> str:
        """One paragraph per round."""
        lines = [f"{len(self.rounds)} round(s), then {self.verdict}"]
        lines.extend(f"  {k}. {diagnosis.verdict}: {diagnosis.text}" for k, diagnosis in enumerate(self.rounds, 1))
        lines.extend(f"  warning: {text}" for text in self.warnings)
        return "\n".join(lines)


def close_gap(
    model: Model,
    recording: Recording | ProcessedRecording,
    *,
    holdout: Recording | ProcessedRecording | None = None,
    reference: Model | None = None,
    period: float | None = None,
    rounds: int = 4,
    progress: Callable[[str, float], None] | None = None,
) -> ClosedGap:
    """Add the missing effects to a model, one diagnosis after the other.

    Stops when a diagnosis names nothing, or nothing that the model does not already hold, and after `rounds`.

    Args:
        model: the model.
        recording: what was measured.
        holdout: another motion of the same robot, on which what is found must hold.
        reference: an earlier model of the same robot.
        period: [s]; found from the data by default.
        rounds: largest number of diagnoses.
        progress: called with what is being done and the share that is done.

    Returns:
        The repaired model and how it came about.

    Raises:
        DiagnosisError: as `diagnose`, and if `rounds` is not positive.
        RecordingError: a recording lacks what is needed.
    """
    if rounds < 1:
        raise DiagnosisError(f"rounds is {rounds}; at least one diagnosis is needed")
    history: list[Diagnosis] = []
    known: set[tuple[str, str | None]] = set()
    notes: list[str] = []
    for number in range(rounds):
        tell = None if progress is None else _share(progress, number, rounds)
        diagnosis = diagnose(model, recording, holdout=holdout, reference=reference, period=period, progress=tell)
        history.append(diagnosis)
        notes.extend(text for text in diagnosis.warnings if text not in notes)
        found = {(m.effect, m.joint) for m in diagnosis.missing}
        if diagnosis.verdict not in NAMED or diagnosis.model is None or found <= known:
            break
        known |= found
        kept = {(effect.name, effect.joint) for effect in diagnosis.model.effects}
        model = diagnosis.model
        if not found & kept:
            names = ", ".join(sorted(f"{effect} at {joint}" for effect, joint in found))
            notes.append(f"{names}: named, but it cancels in the motor torque, which is all that the model predicts")
            break
    else:
        notes.append(f"stopped after {rounds} diagnoses; the last one still named something")
    return ClosedGap(tuple(history), model, tuple(notes))


def _share(progress: Callable[[str, float], None], number: int, rounds: int) -> Callable[[str, float], None]:
    """Progress of one round as a part of all."""
    return lambda what, share: progress(f"round {number + 1}: {what}", (number + share) / rounds)
