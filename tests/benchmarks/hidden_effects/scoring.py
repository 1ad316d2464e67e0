"""Scores of the diagnoses against the truth, case by case."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sea_ident.effects.base import AT_ALL_JOINTS
from tests.benchmarks.hidden_effects.case import Case, Planted
from tests.benchmarks.hidden_effects.catalogue import ENTRIES
from tests.benchmarks.hidden_effects.diagnose_case import RESULT
from tests.benchmarks.hidden_effects.draw import truth_of
from tests.benchmarks.hidden_effects.gap import TREND_EFFECTS
from tests.benchmarks.hidden_effects.generate import case_folder
from tests.benchmarks.hidden_effects.plants import nominal_robot
from tests.benchmarks.hidden_effects.sizes import size_errors

Name = tuple[str, str | None]

EQUAL_AT_THE_LAST_JOINT = ("spring_offset", "encoder_offset", "motor_encoder_offset")
"""Effects that give the same data at the last joint, so that no diagnosis could tell them apart."""

CONFIDENT = ("named", "named_with_remainder")


@dataclass(frozen=True)
class Found:
    """One entry of `missing`.

    Attributes:
        name: effect and joint.
        alternatives: effects and joints that the diagnosis declares to be possible in its place.
        torque_share: as said.
    """

    name: Name
    alternatives: tuple[Name, ...]
    torque_share: float

    @property
    def declared(self) -> tuple[Name, ...]:
        """The alias set that is declared, itself included."""
        return (self.name, *self.alternatives)


@dataclass(frozen=True)
class Score:
    """One case, scored.

    Attributes:
        case: the truth.
        verdict: of the diagnosis, `error` where there is none.
        seen: whether it says that something is missing.
        found: entries of `missing`.
        lack_of_fit_p: p-value of the lack of fit.
        lack_of_fit_ratio: its statistic over its degrees of freedom.
        shrink_holdout: share of the held-out gap that is gone; from period to period where all that is hidden drifts.
        shrink_simulation: the same of q in forward simulation; NaN where absent.
        seconds: of the diagnosis.
        record: the whole diagnosis.
    """

    case: Case
    verdict: str
    seen: bool
    found: tuple[Found, ...]
    lack_of_fit_p: float
    lack_of_fit_ratio: float
    shrink_holdout: float
    shrink_simulation: float
    seconds: float
    record: dict[str, Any]

    def accepts(self, planted: Planted, name: Name) -> bool:
        """Whether a name is right: the effect's own, one that its form belongs to as well, or one of equal data."""
        equal = {planted.effect, name[0]} <= set(EQUAL_AT_THE_LAST_JOINT) and name[1] == planted.joint
        if equal and self._is_last(planted.joint):
            return True
        joint_fits = planted.joint is None or name[1] in (planted.joint, None)
        if name[0] in AT_ALL_JOINTS:  # a delay of one joint is none of all, and delays of several are not one
            joint_fits = name[1] == planted.joint
        entry = ENTRIES.get((planted.effect, planted.form))
        accepted = (planted.effect, *(entry.accepted if entry else ()))
        return joint_fits and name[0] in accepted

    def _is_last(self, joint: str | None) -> bool:
        robot = nominal_robot(self.case.robot)
        # of its chain: of its neighbours none comes after it
        return joint is not None and all(k < robot.index(joint) for k in robot.neighbours(robot.index(joint)))

    def finder(self, planted: Planted) -> Found | None:
        """The entry that names a planted effect."""
        return next((f for f in self.found if self.accepts(planted, f.name)), None)

    def coverer(self, planted: Planted) -> Found | None:
        """The entry whose declared set holds a planted effect."""
        exact = self.finder(planted)
        return exact or next((f for f in self.found if any(self.accepts(planted, a) for a in f.declared)), None)

    def false(self) -> tuple[Found, ...]:
        """Entries that name nothing that was planted."""
        return tuple(f for f in self.found if not any(self.accepts(p, f.name) for p in self.case.planted))

    def false_beyond_sets(self) -> tuple[Found, ...]:
        """Entries whose declared set holds nothing that was planted."""
        return tuple(
            f for f in self.found if not any(self.accepts(p, a) for p in self.case.planted for a in f.declared)
        )

    def size_errors(self) -> list[float]:
        """Errors of sizes of what is named rightly, in standard deviations of the diagnosis [-]."""
        entries, truth = self.record.get("missing", []), truth_of(self.case)
        return [
            error
            for planted in self.case.planted
            for entry in entries
            if (entry["effect"], entry.get("joint")) == planted.name
            for error in size_errors(planted, entry, self.case, truth)
        ]

    @property
    def main(self) -> Planted:
        """The main effect."""
        return max(self.case.planted, key=lambda p: p.gap)

    @property
    def named(self) -> bool:
        """Whether an effect is named with confidence."""
        return self.verdict in CONFIDENT and bool(self.found)


def score_case(root: Path, truth: Path) -> Score | None:
    """Score one case; None where it has not been diagnosed."""
    case = Case.from_dict(json.loads(truth.read_text()))
    file = case_folder(root, case.label) / RESULT
    if not file.exists():
        return None
    record = json.loads(file.read_text())
    verdict = str(record.get("verdict", "error"))
    found = tuple(
        Found(
            (m["effect"], m.get("joint")),
            tuple((a["effect"], a.get("joint")) for a in m.get("alternatives", [])),
            float(m.get("torque_share") or 0.0),
        )
        for m in record.get("missing", [])
    )
    lack = record.get("lack_of_fit") or {}
    simulated = (record.get("simulation_gap") or {}).get("q")
    return Score(
        case=case,
        verdict=verdict,
        seen=verdict not in ("none", "cannot_tell", "error"),
        found=found,
        lack_of_fit_p=_number(lack.get("p_value")),
        lack_of_fit_ratio=_number(lack.get("statistic")) / max(_number(lack.get("dof")), 1.0),
        shrink_holdout=_shrink_holdout(case, record),
        shrink_simulation=_shrink(simulated),
        seconds=_number(record.get("seconds")),
        record=record,
    )


def score_run(root: Path) -> list[Score]:
    """All diagnosed cases of a run."""
    scores = (score_case(root, truth) for truth in sorted((root / "truth").glob("*.json")))
    return [score for score in scores if score is not None]


def _shrink_holdout(case: Case, record: dict[str, Any]) -> float:
    """That of what was hidden: what drifts is none of the mean of a recording, but differs from period to period."""
    if case.planted and all(p.effect in TREND_EFFECTS for p in case.planted):
        return _shrink((record.get("trend_gap") or {}).get("holdout"))
    return _number((record.get("gap") or {}).get("shrink_holdout"))


def _shrink(gap: dict[str, Any] | None) -> float:
    if not gap:
        return float("nan")
    before, after = (sum(float(v) ** 2 for v in gap[key].values()) ** 0.5 for key in ("before", "after"))
    return 1.0 - after / before if before > 0.0 else float("nan")


def _number(value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return float("nan")
