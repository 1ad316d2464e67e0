"""Hidden-effect benchmark: is what is missing from a model found, and named rightly?

    python -m tests.benchmarks.hidden_effects run --cases N --seed S --out DIR [--row ROW] [--jobs 2]
    python -m tests.benchmarks.hidden_effects table DIR
    python -m tests.benchmarks.hidden_effects alone DIR [--all] [--row ROW]
    python -m tests.benchmarks.hidden_effects identified DIR [--row ROW]

Robot, true parameters, trajectory, noise, effects, places and sizes of a case follow from the seed, the row and the
number of the case. Two engines make the recordings: MuJoCo with forces and time stepping of the benchmark's own, and
the project's simulator. The diagnosis runs in a process of its own that gets the folder `cases/<case>` with the
recordings and the nominal description; the truth is in `truth/<case>.json`, read by the scores alone. A run that was
stopped goes on where it was. `table.txt`, `misses.txt` and `confusion.png` are written beside the cases. `alone` times
those again that took too long side by side with others (of a run with `--keep`), or all, and tells which say
something else than before. `identified` tells how far `identify` alone is off: in all that it tells where nothing is
hidden, in springs everywhere.
"""

import argparse
from pathlib import Path

from tests.benchmarks.hidden_effects.alone import alone
from tests.benchmarks.hidden_effects.draw import ROWS
from tests.benchmarks.hidden_effects.identified import identified
from tests.benchmarks.hidden_effects.runner import Task, run
from tests.benchmarks.hidden_effects.table import write_report


def main() -> None:
    """Run cases or print the table of a run."""
    parser = argparse.ArgumentParser(
        prog="hidden_effects", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    verbs = parser.add_subparsers(dest="verb", required=True)
    runs = verbs.add_parser("run", help="draw, simulate and diagnose cases; goes on where it was stopped")
    runs.add_argument("--cases", type=int, default=10, help="cases per row")
    runs.add_argument("--first", type=int, default=0, help="number of the first case")
    runs.add_argument("--seed", type=int, required=True)
    runs.add_argument("--out", type=Path, required=True)
    runs.add_argument("--row", action="append", choices=list(ROWS), help="may be given more than once; default all")
    runs.add_argument("--jobs", type=int, default=2)
    runs.add_argument("--keep", action="store_true", help="keep the recordings of diagnosed cases")
    runs.add_argument("--generate-only", action="store_true", help="do not diagnose")
    shown = verbs.add_parser("table", help="print the table of a run")
    shown.add_argument("out", type=Path)
    again = verbs.add_parser("alone", help="time the longest again, one at a time with all cores")
    again.add_argument("out", type=Path)
    again.add_argument("--all", action="store_true", help="all cases")
    again.add_argument("--row", action="append", choices=list(ROWS), help="may be given more than once; default all")
    off = verbs.add_parser("identified", help="how far identify alone is off in kept cases")
    off.add_argument("out", type=Path)
    off.add_argument("--row", action="append", choices=list(ROWS), help="default all")
    arguments = parser.parse_args()
    if arguments.verb == "identified":
        for line in identified(arguments.out, arguments.row or ()):
            print(line, flush=True)
        return
    if arguments.verb == "alone":
        for line in alone(arguments.out, not arguments.all, arguments.row or ()):
            print(line, flush=True)
        return
    if arguments.verb == "run":
        arguments.out.mkdir(parents=True, exist_ok=True)
        rows = arguments.row or list(ROWS)
        numbers = range(arguments.first, arguments.first + arguments.cases)
        tasks = [
            Task(arguments.out, arguments.seed, row, index, arguments.keep, arguments.generate_only)
            for index in numbers
            for row in rows
        ]
        run(tasks, arguments.jobs)
    print(write_report(arguments.out))


if __name__ == "__main__":
    main()
