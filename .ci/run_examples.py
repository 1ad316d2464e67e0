"""Run every example script of a folder as a notebook, in a fresh kernel and an empty folder.

    python .ci/run_examples.py EXAMPLES OUT

Scripts in percent format become notebooks; one that raises fails the run. The environment variable
SEA_IDENT_REDUCED asks the scripts for less data.
"""

import sys
import time
from pathlib import Path

import jupytext
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError


def main(source: Path, out: Path) -> int:
    """Number of scripts that failed."""
    failed = 0
    scripts = sorted(source.glob("*.py"))
    if not scripts:
        print(f"no scripts in {source}")
    for script in scripts:
        folder = out / script.stem
        folder.mkdir(parents=True)
        notebook = jupytext.read(script)
        start = time.perf_counter()
        try:
            NotebookClient(
                notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
            ).execute()
        except CellExecutionError as error:
            failed += 1
            print(f"{script}: FAILED\n{error}")
        else:
            print(f"{script}: done in {time.perf_counter() - start:.0f} s")
    return failed


if __name__ == "__main__":
    sys.exit(1 if main(Path(sys.argv[1]), Path(sys.argv[2])) else 0)
