"""The outcome of a diagnosis in a sentence."""

from typing import Any, ClassVar

from sea_ident.discrepancy.bench.lack import LACK_LEVEL
from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.discrepancy.result.findings import Verdict, chance
from sea_ident.report.section import DiagnosisSection

MEANING = {
    Verdict.NONE: ("good", "nothing is missing"),
    Verdict.NAMED: ("warn", "the missing effects are named"),
    Verdict.NAMED_WITH_REMAINDER: ("warn", "the missing effects are named, and something small is left"),
    Verdict.AMBIGUOUS: ("warn", "something is missing that these data cannot tell from something else"),
    Verdict.SUSPECT: ("bad", "a name was found that does not hold on other data"),
    Verdict.NOT_IN_LIBRARY: ("bad", "something is missing that no known effect explains"),
    Verdict.ONLY_AGAINST_REFERENCE: ("warn", "the difference shows against an earlier model only"),
    Verdict.CANNOT_TELL: ("bad", "these data do not allow a verdict"),
}
CLEAR, POSSIBLE = 1e-3, 0.05


class VerdictSection(DiagnosisSection):
    """Verdict, lack of fit per joint and equation, warnings."""

    key: ClassVar[str] = "verdict"
    title: ClassVar[str] = "Verdict"
    needs: ClassVar[str] = "a diagnosis"

    def of_diagnosis(self, diagnosis: Diagnosis) -> dict[str, Any] | None:
        """Sentence, tiles and table."""
        lack = diagnosis.lack_of_fit
        level, meaning = MEANING[diagnosis.verdict]
        if diagnosis.verdict is Verdict.NONE and lack.p_value < LACK_LEVEL:
            level, meaning = "warn", "nothing is named, though model and data disagree beyond the noise"
        tested = lack.dof > 0  # one stretch has no periods to tell noise from what is missing
        if diagnosis.verdict is Verdict.NAMED_WITH_REMAINDER and not tested:
            meaning = "there are hints at what is missing, and no periods to test them by"
        one, several = ("effect missing", "effects missing")
        if diagnosis.verdict is Verdict.ONLY_AGAINST_REFERENCE:
            one, several = ("change against the reference", "changes against the reference")
        tiles = [(str(len(diagnosis.missing)), one if len(diagnosis.missing) == 1 else several)]
        for label, gap, shows in (
            ("the recording", diagnosis.training, diagnosis.adds_to_mean),
            ("held-out data", diagnosis.holdout, diagnosis.adds_to_held_out),
        ):
            if shows and gap is not None and any(value > 0.0 for value in gap.before.values()):
                tiles.append((f"{100 * gap.shrink:.0f} %", f"of the gap closed on {label}"))
        if diagnosis.adds and "training" in diagnosis.trend_gap:
            shrink = diagnosis.trend_gap["training"].shrink
            tiles.append((f"{100 * shrink:.0f} %", "of what changes from period to period explained"))
        if diagnosis.adds_to_held_out and "q" in diagnosis.simulation_gap:
            shrink = diagnosis.simulation_gap["q"].shrink
            tiles.append((f"{100 * shrink:.0f} %", "of the gap closed in forward simulation of q"))
        equations = list(dict.fromkeys(name for parts in lack.per_joint.values() for name in parts))
        return {
            "level": level,
            "meaning": meaning,
            "word": str(diagnosis.verdict).replace("_", " "),
            "text": diagnosis.text,
            "tiles": tiles,
            "lack": lack,
            "tested": tested,
            "equations": equations,
            "fit_level": _level(lack.p_value),
            "fit_chance": chance(lack.p_value).removeprefix("= "),
            "trend_chance": chance(lack.trend_p_value).removeprefix("= "),
            "trend_level": _level(lack.trend_p_value),
            "warnings": diagnosis.warnings,
        }


def _level(p_value: float) -> str:
    return "bad" if p_value < CLEAR else "warn" if p_value < POSSIBLE else "good"
