"""The table of figures to reach, with Wilson intervals, and the confusion matrix."""

import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.hidden_effects.draw import ROWS
from tests.benchmarks.hidden_effects.scoring import Score, score_run

LONGEST = {"exo_leg": 10.0, "baxter": 60.0, "ur5": 60.0, "prosthesis": 10.0, "oblique_arm": 20.0, "torso": 35.0}
"""Seconds that a diagnosis of a robot may take: 10 with three joints, 60 with seven, and between these by their number;
with six they are those of seven."""


def wilson(successes: int, trials: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """Wilson's 95 % interval of a share."""
    if trials == 0:
        return 0.0, 1.0
    share, square = successes / trials, z * z
    centre = (share + square / (2 * trials)) / (1 + square / trials)
    half = z / (1 + square / trials) * math.sqrt(share * (1 - share) / trials + square / (4 * trials**2))
    return max(0.0, centre - half), min(1.0, centre + half)


@dataclass(frozen=True)
class Line:
    """One figure of the table.

    Attributes:
        row: row of the table.
        what: what is measured.
        goal: as text.
        successes: how often.
        trials: of how many.
        value: a number that is no share.
        met: whether the goal is met by the measured share itself.
    """

    row: str
    what: str
    goal: str
    successes: int = 0
    trials: int = 0
    value: float | None = None
    met: bool = False

    def text(self) -> str:
        """One line."""
        if self.value is not None:
            figure = f"{self.value:.3g}"
        else:
            low, high = wilson(self.successes, self.trials)
            share = 100.0 * self.successes / max(self.trials, 1)
            figure = f"{self.successes}/{self.trials} = {share:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
        mark = "ok  " if self.met else "MISS"
        return f"  {mark} {self.what:<58} {figure:<34} goal {self.goal}"


def _share(row: str, what: str, goal: str, flags: Iterable[bool], test: Callable[[float], bool]) -> Line:
    values = [bool(f) for f in flags]
    successes = sum(values)
    return Line(row, what, goal, successes, len(values), None, bool(values) and test(successes / len(values)))


def _number(row: str, what: str, goal: str, values: Iterable[float], test: Callable[[float], bool]) -> Line:
    known = [v for v in values if math.isfinite(v)]
    value = float(np.median(known)) if known else float("nan")
    return Line(row, what, goal, value=value, met=bool(known) and test(value))


def lines_of(scores: list[Score]) -> list[Line]:
    """All lines of the table for which there are cases."""
    by_row = {name: [s for s in scores if s.case.row == name and s.verdict != "error"] for name in ROWS}
    lines: list[Line] = []

    def add(line: Line) -> None:
        if line.trials or (line.value is not None and math.isfinite(line.value)):
            lines.append(line)

    for periods in (20, 10):
        none = [s for s in by_row["none"] if s.case.periods == periods]
        add(_share("none", f"something named, P = {periods}", "<= 1 %", (s.named for s in none), lambda x: x <= 0.01))
        add(_share("none", f"any name, suspect or ambiguous included, P = {periods}", "<= 1 %",
                   (bool(s.found) for s in none), lambda x: x <= 0.01))  # fmt: skip
        add(_share("none", f"lack of fit at nominal 5 %, P = {periods}", "3-8 %",
                   (s.lack_of_fit_p < 0.05 for s in none if math.isfinite(s.lack_of_fit_p)),
                   lambda x: 0.03 <= x <= 0.08))  # fmt: skip
        ratios = [s.lack_of_fit_ratio for s in none if math.isfinite(s.lack_of_fit_ratio)]
        if ratios:
            mean = float(np.mean(ratios))
            add(Line("none", f"statistic over degrees of freedom, mean, P = {periods}", "-", value=mean, met=True))
        add(_share("none", f"verdict none, P = {periods}", "-", (s.verdict == "none" for s in none), lambda x: True))
    half = [name for name, row in ROWS.items() if row.half]
    for row in ("one", "one_small", "other_form", "weak", "large", "zeros", "whole", *half):
        _single(row, [s for s in by_row[row] if s.case.planted], add)
    for row in half:
        nothing = [s for s in by_row[row] if not s.case.planted]
        add(_share(row, "nothing missing, something named", "<= 1 %", (s.named for s in nothing), lambda x: x <= 0.01))
        add(_share(row, "nothing missing, any name, suspect or ambiguous included", "<= 1 %",
                   (bool(s.found) for s in nothing), lambda x: x <= 0.01))  # fmt: skip
        add(_share(row, "nothing missing, verdict none", "-", (s.verdict == "none" for s in nothing), lambda x: True))
    for row in ("two", "same_joint"):
        two = by_row[row]
        add(_share(row, "recall", ">= 85 %", (s.finder(p) is not None for s in two for p in s.case.planted),
                   lambda x: x >= 0.85))  # fmt: skip
        add(_share(row, "recall within the declared sets", "-",
                   (s.coverer(p) is not None for s in two for p in s.case.planted), lambda x: True))  # fmt: skip
        add(_share(row, "precision", ">= 95 %", (f not in s.false() for s in two for f in s.found),
                   lambda x: x >= 0.95))  # fmt: skip
    many = by_row["main_small"]
    add(_share("main_small", "main effect found", ">= 90 %", (s.finder(s.main) is not None for s in many),
               lambda x: x >= 0.9))  # fmt: skip
    add(_share("main_small", "main effect within the declared sets", "-", (s.coverer(s.main) is not None for s in many),
               lambda x: True))  # fmt: skip
    add(_share("main_small", "precision", ">= 90 %", (f not in s.false() for s in many for f in s.found),
               lambda x: x >= 0.9))  # fmt: skip
    unknown = by_row["unknown"]
    add(_share("unknown", "a unique wrong name", "<= 5 %",
               (s.named and any(not f.alternatives for f in s.found) for s in unknown),
               lambda x: x <= 0.05))  # fmt: skip
    add(_share("unknown", "named with confidence, alternatives or not", "-", (s.named for s in unknown),
               lambda x: True))  # fmt: skip
    add(_share("unknown", "said not_in_library", "-", (s.verdict == "not_in_library" for s in unknown), lambda x: True))
    _removed(by_row["removed"], by_row, add)
    reference = by_row["reference"]
    add(_share("reference", "effect and joint by reference", ">= 95 %",
               (s.finder(s.main) is not None for s in reference), lambda x: x >= 0.95))  # fmt: skip
    add(_share("reference", "precision", "-", (f not in s.false() for s in reference for f in s.found),
               lambda x: True))  # fmt: skip
    for row in ("one", "two", "same_joint", "main_small"):
        right = [s for s in by_row[row] if s.finder(s.main) is not None and not s.false()]
        add(_number(row, "held-out gap shrink, median where named rightly", ">= 0.8", (s.shrink_holdout for s in right),
                    lambda x: x >= 0.8))  # fmt: skip
        add(_number(row, "forward simulation of q, shrink, median", ">= 0.9", (s.shrink_simulation for s in right),
                    lambda x: x >= 0.9))  # fmt: skip
    for row in ("one", "one_small", "two", "same_joint", "main_small", "large", "zeros", "whole", *half):
        errors = [abs(error) for s in by_row[row] for error in s.size_errors()]
        add(_share(row, "sizes within two standard deviations of the truth", ">= 95 %", (e < 2.0 for e in errors),
                   lambda x: x >= 0.95))  # fmt: skip
        add(_number(row, "errors of sizes in standard deviations, median", "<= 0.8", errors, lambda x: x <= 0.8))
    for robot, limit in LONGEST.items():
        timed = [s for s in scores if s.case.robot == robot and math.isfinite(s.seconds)]
        _seconds(robot, limit, [s.seconds for s in timed], add)
        _seconds(f"{robot}, missing", limit, [s.seconds for s in timed if s.case.row != "none"], add)
        for row in ROWS:
            own = [s.seconds for s in timed if s.case.row == row]
            for label, value in (("median", np.median(own)), ("longest", max(own))) if own else ():
                what = f"seconds on {robot}, {label} of {len(own)}"
                add(Line(row, what, f"<= {limit:g}", value=float(value), met=bool(value <= limit)))
    errors = [s for s in scores if s.verdict == "error"]
    add(_share("all", "errors", "0", (s.verdict == "error" for s in scores), lambda x: not errors))
    return lines


def _seconds(robot: str, limit: float, seconds: list[float], add: Callable[[Line], None]) -> None:
    if not seconds:
        return
    what, goal = f"seconds of a diagnosis, {robot}", f"<= {limit:g}"
    for label, share in (("median", 0.5), ("90th percentile", 0.9), ("largest", 1.0)):
        value = float(np.quantile(seconds, share))
        add(Line("all", f"{what}, {label}", goal, value=value, met=value <= limit))
    add(_share("all", f"{what}, more than {limit:g}", "0", (s > limit for s in seconds), lambda x: x == 0.0))


def _single(row: str, cases: list[Score], add: Callable[[Line], None]) -> None:
    goals = {
        "one": (">= 95 %", 0.95, ">= 99 %", 0.99),
        "one_small": (">= 81 %", 0.81, "-", 0.0),
        "other_form": (">= 85 %", 0.85, "-", 0.0),
        "weak": ("-", 0.0, "-", 0.0),
        "coarse": ("-", 0.0, "-", 0.0),
        "few": ("-", 0.0, "-", 0.0),
    }
    named, named_limit, declared, declared_limit = goals.get(row, goals["one"])
    add(_share(row, "seen", {"one_small": ">= 85 %", "weak": ">= 83 %"}.get(row, "-"), (s.seen for s in cases),
               lambda x: x >= {"one_small": 0.85, "weak": 0.83}.get(row, 0.0)))  # fmt: skip
    add(_share(row, "effect and joint named", named, (s.finder(s.main) is not None for s in cases),
               lambda x: x >= named_limit))  # fmt: skip
    add(_share(row, "within the declared alias set", declared, (s.coverer(s.main) is not None for s in cases),
               lambda x: x >= declared_limit))  # fmt: skip
    covered = [c for s in cases if (c := s.coverer(s.main)) is not None]
    if covered:
        mean = float(np.mean([len(c.declared) for c in covered]))
        add(Line(row, "mean size of the declared set", "<= 1.5", value=mean, met=mean <= 1.5))
    add(
        _share(
            row, "false names with confidence", "0", (s.named and bool(s.false()) for s in cases), lambda x: x == 0.0
        )
    )
    add(_share(row, "false names with confidence, outside declared sets", "0",
               (s.named and bool(s.false_beyond_sets()) for s in cases), lambda x: x == 0.0))  # fmt: skip


def _removed(cases: list[Score], by_row: dict[str, list[Score]], add: Callable[[Line], None]) -> None:
    if not cases:
        return
    clusters = alias_clusters([s for row in ("one", "one_small") for s in by_row[row]])

    def outside(score: Score) -> bool:
        cluster = clusters.get(score.main.effect, set())
        return score.named and any(f.name[0] not in cluster for f in score.found)

    add(_share("removed", "named something else with confidence", "-", (s.named for s in cases), lambda x: True))
    add(_share("removed", "the same, outside the alias cluster", "<= 5 %", map(outside, cases), lambda x: x <= 0.05))


EASILY_TAKEN_FOR = {
    "stribeck_friction": ("nonlinear_viscous_friction",),
    "nonlinear_viscous_friction": ("stribeck_friction",),
    "presliding_friction": ("torque_delay",),
    "load_dependent_friction": ("directional_efficiency", "position_dependent_friction"),
    "directional_efficiency": ("load_dependent_friction",),
    "position_dependent_friction": ("load_dependent_friction",),
    "torque_ripple": ("torque_offset",),
    "torque_offset": ("spring_offset", "encoder_offset"),
    "torque_saturation": ("load_dependent_friction",),
    "torque_constant": (),
    "spring_stiffening": ("asymmetric_spring", "backlash"),
    "asymmetric_spring": ("backlash", "spring_offset"),
    "spring_hysteresis": ("backlash",),
    "backlash": ("spring_offset",),
    "spring_offset": ("encoder_offset",),
    "encoder_offset": ("spring_offset",),
    "encoder_eccentricity": ("parallel_spring", "base_tilt"),
    "base_tilt": ("encoder_offset", "spring_offset"),
    "position_delay": ("torque_delay",),
    "torque_delay": ("presliding_friction",),
    "friction_drift": ("torque_constant_drift", "stiffness_drift"),
    "torque_constant_drift": ("friction_drift", "stiffness_drift"),
    "stiffness_drift": ("friction_drift", "torque_constant_drift"),
    "temperature_friction": ("friction_drift",),
}
"""The column `easily taken for` in the description of the effects; stated before any run."""


def either_way(taken_for: Mapping[str, Iterable[str]]) -> dict[str, set[str]]:
    """What each effect can be taken for where one that is like another is so both ways."""
    clusters: dict[str, set[str]] = {effect: set() for effect in taken_for}
    for effect, others in taken_for.items():
        for other in others:
            clusters[effect].add(other)
            clusters.setdefault(other, set()).add(effect)
    return clusters


def alias_clusters(cases: list[Score]) -> dict[str, set[str]]:
    """Names that each effect can be taken for: by its nature, and by what diagnoses with the whole library declared."""
    clusters = either_way(EASILY_TAKEN_FOR)
    for score in cases:
        found = score.finder(score.main)
        if found is not None:
            clusters.setdefault(score.main.effect, set()).update(name for name, _ in found.alternatives)
    return clusters


def table_text(scores: list[Score]) -> str:
    """The whole table."""
    lines, text = lines_of(scores), []
    for row in (*ROWS, "all"):
        own = [line for line in lines if line.row == row]
        if own:
            count = len([s for s in scores if s.case.row == row]) if row != "all" else len(scores)
            text.append(f"{ROWS[row].title if row in ROWS else 'all cases'} ({count} cases)")
            text.extend(line.text() for line in own)
    return "\n".join(text)


def misses_text(scores: list[Score]) -> str:
    """Every case whose truth was not named, or that named something else."""
    text = []
    for s in scores:
        if s.case.row in ("unknown", "removed"):
            bad = s.named
        elif not s.case.planted:
            bad = s.verdict != "none"
        else:
            bad = s.finder(s.main) is None or bool(s.false()) or s.verdict == "error"
        if not bad:
            continue
        truth = ", ".join(
            f"{p.effect} @ {p.joint} ({p.form}, gap {100 * p.gap:.2g} %)" for p in s.case.planted if not p.small
        )
        said = ", ".join(
            f"{f.name[0]} @ {f.name[1]}" + (f" (or {'; '.join(f'{a} @ {j}' for a, j in f.alternatives)})"
                                            if f.alternatives else "")
            for f in s.found
        )  # fmt: skip
        error = s.record.get("error", "")
        text.append(
            f"{s.case.label} {s.case.robot} {s.case.engine}: {truth or 'nothing'} -> {s.verdict}: {said}{error}"
        )
    return "\n".join(text)


def write_report(root: Path) -> str:
    """Table, misses and confusion matrix of a run, as files beside it.

    Returns:
        The table as text.
    """
    scores = score_run(root)
    text = table_text(scores)
    (root / "table.txt").write_text(text + "\n")
    (root / "misses.txt").write_text(misses_text(scores) + "\n")
    rows = [
        {"row": line.row, "what": line.what, "goal": line.goal, "successes": line.successes, "trials": line.trials,
         "value": line.value, "met": line.met, "interval": wilson(line.successes, line.trials)}
        for line in lines_of(scores)
    ]  # fmt: skip
    (root / "table.json").write_text(json.dumps(rows, indent=1))
    singles = [s for s in scores if s.case.row in ("one", "other_form", "one_small") and len(s.case.planted) == 1]
    if singles:
        draw_confusion(singles, root / "confusion.png")
    return text


def draw_confusion(scores: list[Score], path: Path) -> None:
    """Confusion matrix: what was planted against what was said first."""
    from matplotlib.figure import Figure

    counts: Counter[tuple[str, str]] = Counter()
    for s in scores:
        right = s.finder(s.main)
        said = right or (s.found[0] if s.found else None)
        if said is None:
            name = s.verdict
        elif said.name[0] == s.main.effect and not s.accepts(s.main, said.name):
            name = "wrong joint"
        else:
            name = said.name[0]
        counts[(s.main.effect, name)] += 1
    planted = sorted({a for a, _ in counts})
    others = sorted({b for _, b in counts} - set(planted))
    named = planted + others
    matrix = np.zeros((len(planted), len(named)))
    for (a, b), number in counts.items():
        matrix[planted.index(a), named.index(b)] = number
    figure = Figure(figsize=(2.5 + 0.33 * len(named), 2.5 + 0.3 * len(planted)), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1.0), cmap="Blues", vmin=0.0, vmax=1.0)
    for a in range(len(planted)):
        for b in range(len(named)):
            if matrix[a, b]:
                dark = matrix[a, b] / matrix[a].sum() > 0.5
                axes.text(b, a, f"{int(matrix[a, b])}", ha="center", va="center", color="white" if dark else "black")
    axes.set_xticks(range(len(named)), named, rotation=90)
    axes.set_yticks(range(len(planted)), planted)
    axes.set_xlabel("named")
    axes.set_ylabel("planted")
    axes.set_title(f"{len(scores)} recordings with one hidden effect")
    figure.savefig(path, dpi=130)
