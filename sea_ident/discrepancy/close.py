"""Diagnose, add what is missing, diagnose again, until there is nothing more to add."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sea_ident.arguments import expect
from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.diagnose import diagnose
from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.discrepancy.result.findings import MissingEffect, Verdict
from sea_ident.estimation import Model
from sea_ident.exceptions import DiagnosisError
from sea_ident.one_thread import one_thread
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording
from sea_ident.simulation import Controller

NAMED = (Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER)
"""Verdicts after which the named effects are added and the recording is diagnosed again."""


@dataclass(frozen=True)
class Round:
    """One diagnosis in numbers; gaps are rms beyond the noise over all joints, before and after what it added.

    Attributes:
        verdict: its verdict.
        named: effect and joint of what it named.
        torque: on the recording [N m]; None where it was not compared.
        torque_held_out: on data that were held out [N m]; None without these.
        simulation: of forward simulation by signal [rad] or [N m]; empty where nothing was added.
        course: of what changes from period to period [N m]; None where nothing does.
    """

    verdict: Verdict
    named: tuple[tuple[str, str | None], ...]
    torque: tuple[float, float] | None
    torque_held_out: tuple[float, float] | None
    simulation: Mapping[str, tuple[float, float] | None]
    course: tuple[float, float] | None = None

    def summary(self) -> str:
        """One line."""
        parts = {"torque": self.torque, "torque, held out": self.torque_held_out, "from period to period": self.course}
        parts |= {f"simulated {kind}": sizes for kind, sizes in self.simulation.items()}
        found = [f"{label} {sizes[0]:.3g} -> {sizes[1]:.3g}" for label, sizes in parts.items() if sizes is not None]
        return "gap: " + ("; ".join(found) if found else "not compared")


def _sizes(gap: Gap | None) -> tuple[float, float] | None:
    """Before and after over all joints."""
    if gap is None:
        return None
    before, after = (sum(value**2 for value in part.values()) ** 0.5 for part in (gap.before, gap.after))
    return float(before), float(after)


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
        """Effect and joint of everything that was added, in the order in which it was found.

        What is named and no model holds (what differs from a reference) is not among it.
        """
        pairs = [
            (m.effect, m.joint) for d in self.rounds if d.verdict in NAMED for m in d.missing if _holds(d.model, m)
        ]
        return tuple(dict.fromkeys(pairs))

    @property
    def history(self) -> tuple[Round, ...]:
        """What every round found, and how large the gap was before and after it."""
        return tuple(
            Round(
                verdict=d.verdict,
                named=tuple((m.effect, m.joint) for m in d.missing),
                torque=_sizes(d.training),
                torque_held_out=_sizes(d.holdout),
                simulation={kind: _sizes(gap) for kind, gap in d.simulation_gap.items()},
                course=_sizes(d.trend_gap.get("training")),
            )
            for d in self.rounds
        )

    def summary(self) -> str:
        """One paragraph per round."""
        lines = [f"{len(self.rounds)} round(s), then {self.verdict}"]
        for k, (diagnosis, entry) in enumerate(zip(self.rounds, self.history, strict=True), 1):
            lines.append(f"  {k}. {diagnosis.verdict}: {diagnosis.text}")
            lines.append(f"     {entry.summary()}")
        lines.extend(f"  warning: {text}" for text in self.warnings)
        return "\n".join(lines)


def _holds(model: Model | None, missing: MissingEffect) -> bool:
    """Whether a model has what was named among its effects."""
    if model is None:
        return False
    changing = (trend.effect for trend in model.trends)
    return missing.title in {effect.title for effect in (*model.effects, *model.spring_effects, *changing)}


@one_thread
def close_gap(
    model: Model,
    recording: Recording | ProcessedRecording,
    *,
    holdout: Recording | ProcessedRecording | None = None,
    reference: Model | None = None,
    period: float | None = None,
    rounds: int = 4,
    controller: Controller | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> ClosedGap:
    """Add the missing effects to a model, one diagnosis after the other.

    Stops when a diagnosis names nothing (nothing is missing, not in the library, ambiguous, suspect) or nothing that
    the model does not hold already, where no repaired model can be identified, and after `rounds`.

    Args:
        model: the model.
        recording: what was measured.
        holdout: another motion of the same robot, on which what is found must hold.
        reference: an earlier model of the same robot.
        period: [s]; found from the data by default.
        rounds: largest number of diagnoses.
        controller: what drove the motors, as `diagnose` takes it.
        progress: called with what is being done and the share that is done.

    Returns:
        The repaired model and how it came about.

    Raises:
        DiagnosisError: as `diagnose`, and if `rounds` is not positive.
        RecordingError: a recording lacks what is needed.
    """
    expect(model, "close_gap: model", Model)
    expect(recording, "close_gap: recording", Recording, ProcessedRecording)
    if rounds < 1:
        raise DiagnosisError(f"rounds is {rounds}; at least one diagnosis is needed")
    history: list[Diagnosis] = []
    known: set[str] = set()
    notes: list[str] = []
    for number in range(rounds):
        tell = None if progress is None else _share(progress, number, rounds)
        diagnosis = diagnose(
            model, recording, holdout=holdout, reference=reference, period=period, controller=controller, progress=tell
        )
        history.append(diagnosis)
        notes.extend(text for text in diagnosis.warnings if text not in notes)
        found = {m.title for m in diagnosis.missing}
        if diagnosis.verdict is Verdict.AMBIGUOUS and diagnosis.model is not None:
            unsure = ", ".join(sorted(m.title for m in diagnosis.missing if m.alternatives))
            notes.append(
                f"nothing more was added, as other effects explain the data as well as {unsure}; the model of the last "
                "diagnosis, rounds[-1].model, has what it names and predicts such motion as well"
            )
        if diagnosis.verdict not in NAMED or found <= known:
            break
        names = ", ".join(sorted(found))
        if diagnosis.model is None:
            notes.append(f"{names}: named, but not added, for there is no repaired model")
            break
        known |= found
        model = diagnosis.model
    else:
        notes.append(f"stopped after {rounds} diagnoses; the last one still named something")
    return ClosedGap(tuple(history), model, tuple(notes))


def _share(progress: Callable[[str, float], None], number: int, rounds: int) -> Callable[[str, float], None]:
    """Progress of one round as a part of all."""
    return lambda what, share: progress(f"round {number + 1}: {what}", (number + share) / rounds)
