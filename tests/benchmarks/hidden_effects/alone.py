"""Diagnoses of a run once more with all cores of the machine: those that took too long side by side, or all."""

import json
import os
import warnings
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sea_ident.exceptions import SeaIdentWarning
from tests.benchmarks.hidden_effects.diagnose_case import RESULT, diagnose_case
from tests.benchmarks.hidden_effects.table import LONGEST


def alone(root: Path, longest_only: bool = True, rows: Collection[str] = ()) -> Iterator[str]:
    """Diagnose kept cases again, one at a time; `alone.json` is written beside them.

    Args:
        root: of a run with `--keep`.
        longest_only: only those that took longer than they may.
        rows: of the table; all by default.

    Yields:
        A line about each of them, and one about each robot.
    """
    os.environ.pop("LOKY_MAX_CPU_COUNT", None)
    seconds: dict[str, list[float]] = {}
    counts: dict[str, int] = {}
    changed = 0
    for truth in sorted((root / "truth").glob("*.json")):
        case, folder = json.loads(truth.read_text()), root / "cases" / truth.stem
        robot = case["robot"]
        if rows and case["row"] not in rows:
            continue
        before = json.loads((folder / RESULT).read_text())
        counts[robot] = counts.get(robot, 0) + 1
        if longest_only and before.get("seconds", 0.0) <= LONGEST.get(robot, np.inf):
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            after = diagnose_case(folder)
        (folder / "alone.json").write_text(json.dumps(after))
        seconds.setdefault(robot, []).append(after["seconds"])
        same = "" if said(before) == said(after) else f"; {said(before)} became {said(after)}"
        changed += bool(same)
        yield f"{truth.stem} {robot}: {before['seconds']:.1f} s -> {after['seconds']:.1f} s{same}"
    for robot, found in seconds.items():
        if robot not in LONGEST:  # one that was drawn has no limit
            continue
        longer = sum(s > LONGEST[robot] for s in found)
        yield f"{robot}: {longer} of {counts[robot]} longer than {LONGEST[robot]:g} s, the longest {max(found):.1f} s"
    yield f"{changed} of {sum(map(len, seconds.values()))} say something else"


def said(record: dict[str, Any]) -> tuple[str, list[tuple[str, str | None, list[tuple[str, str | None]]]]]:
    """Verdict and names, each with its alternatives."""
    names = [
        (m["effect"], m["joint"], [(a["effect"], a["joint"]) for a in m["alternatives"]]) for m in record["missing"]
    ]
    return record["verdict"], names
