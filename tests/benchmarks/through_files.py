"""Cases that go the way of a user: tables in files, and `sea-ident` on the command line."""

import csv
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Case = TypeVar("Case")


@dataclass(frozen=True)
class Ran:
    """What came of a command.

    Attributes:
        refused: what it wrote to standard error where it did not do it, else nothing.
        seconds: that it took.
    """

    refused: str
    seconds: float


def sea_ident(*arguments: str | Path) -> Ran:
    """Run `sea-ident`."""
    begin = time.perf_counter()
    done = subprocess.run(["sea-ident", *map(str, arguments)], capture_output=True, text=True, check=False)
    return Ran(done.stderr if done.returncode else "", time.perf_counter() - begin)


def write(file: Path, table: Mapping[str, NDArray[np.float64]]) -> None:
    """Columns of a recording as CSV."""
    with file.open("w", newline="") as opened:
        writer = csv.writer(opened)
        writer.writerow(table)
        writer.writerows(np.column_stack(list(table.values())).tolist())


def in_words(missing: Mapping[str, Any]) -> str:
    """What is named in a diagnosis, with its first sizes."""
    sizes = (f"{p['name']} {p['value']:.4g} +- {p['std']:.2g} {p['unit']}" for p in missing["parameters"][:3])
    where = missing["effect"] if missing["joint"] is None else f"{missing['effect']} at {missing['joint']}"
    return f"{where}: {', '.join(sizes)}" + (" (or others)" if missing["alternatives"] else "")


def run_cases(cases: Mapping[str, Case], told: Callable[[str, Case, Path], bool]) -> None:
    """All cases, or those that are asked for, each in a folder of its own, and how many of them are right."""
    names = sys.argv[1:] or list(cases)
    unknown = [name for name in names if name not in cases]
    if unknown:
        raise SystemExit(f"no case {', '.join(unknown)}; there are {', '.join(cases)}")
    right = 0
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            right += told(name, cases[name], Path(folder))
    print(f"{right} of {len(names)} right")
