"""Diagnoses that took too long side by side with others, once more with all cores of the machine."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.benchmarks.hidden_effects.diagnose_case import RESULT, diagnose_case
from tests.benchmarks.hidden_effects.table import LONGEST


def alone(root: Path) -> Iterator[str]:
    """Diagnose kept cases that took longer than they may again, one at a time; `alone.json` is written beside them.

    Args:
        root: of a run with `--keep`.

    Yields:
        A line about each of them, and one about each robot.
    """
    os.environ.pop("LOKY_MAX_CPU_COUNT", None)
    seconds: dict[str, list[float]] = {}
    counts: dict[str, int] = {}
    for truth in sorted((root / "truth").glob("*.json")):
        robot, folder = json.loads(truth.read_text())["robot"], root / "cases" / truth.stem
        before = json.loads((folder / RESULT).read_text())
        counts[robot] = counts.get(robot, 0) + 1
        if before.get("seconds", 0.0) <= LONGEST[robot]:
            continue
        after = diagnose_case(folder)
        (folder / "alone.json").write_text(json.dumps(after))
        seconds.setdefault(robot, []).append(after["seconds"])
        same = "" if said(before) == said(after) else f"; {said(before)} became {said(after)}"
        yield f"{truth.stem} {robot}: {before['seconds']:.1f} s -> {after['seconds']:.1f} s{same}"
    for robot, found in seconds.items():
        longer = sum(s > LONGEST[robot] for s in found)
        yield f"{robot}: {longer} of {counts[robot]} longer than {LONGEST[robot]:g} s, the longest {max(found):.1f} s"


def said(record: dict[str, Any]) -> tuple[str, list[tuple[str, str | None]]]:
    """Verdict and names."""
    return record["verdict"], [(m["effect"], m["joint"]) for m in record["missing"]]
