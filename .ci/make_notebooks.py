"""Write examples/*.ipynb with outputs from the percent scripts beside them.

    python .ci/make_notebooks.py [NAME ...]

Every notebook runs in an empty folder. Outputs are what the code prints and draws; standard error is left out, as are
paths of the machine.
"""

import os
import re
import sys
import tempfile
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
LARGEST = 1_500_000


def clean(notebook: nbformat.NotebookNode, folder: str) -> None:
    """Leave what a reader wants to see."""
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    prefixes = {folder, os.path.realpath(folder), str(EXAMPLES.parent), sys.prefix}
    pattern = re.compile("|".join(re.escape(prefix) + "/?" for prefix in sorted(prefixes, key=len, reverse=True)))
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number}"
        cell.metadata = {}
        if cell.cell_type != "code":
            continue
        kept = [out for out in cell.outputs if out.output_type != "stream" or out.name != "stderr"]
        for out in kept:
            out.pop("metadata", None)
            if out.output_type == "stream":
                out.text = pattern.sub("", out.text)
            else:
                out.metadata = {}
                if "text/plain" in out.data:
                    out.data["text/plain"] = pattern.sub("", out.data["text/plain"])
                    if "image/png" in out.data:
                        out.data["text/plain"] = "<Figure>"
        cell.outputs = kept


def main(names: list[str]) -> int:
    """Number of notebooks that are too large."""
    too_large = 0
    os.environ.setdefault("SEA_IDENT_DATA", str(EXAMPLES.parents[1] / "shared" / "data"))
    for script in sorted(EXAMPLES.glob("*.py")):
        if names and script.stem not in names:
            continue
        notebook = jupytext.read(script)
        with tempfile.TemporaryDirectory() as folder:
            NotebookClient(
                notebook, timeout=1800, kernel_name="python3", resources={"metadata": {"path": folder}}
            ).execute()
            clean(notebook, folder)
        text = nbformat.writes(notebook) + "\n"
        script.with_suffix(".ipynb").write_text(text, encoding="utf-8")
        too_large += len(text) > LARGEST
        print(f"{script.stem}: {len(text) / 1e3:.0f} kB")
    return too_large


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
