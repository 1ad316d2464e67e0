"""The notebooks in examples/ are those of the scripts beside them, whole and fit to be shown.

Continuous integration executes every script on reduced data as a notebook (`.ci/run_examples.py`); no test here does
it again. What a notebook has and a script has not is asked of their text.
"""

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
NAMES = [path.stem for path in SCRIPTS]
PROMISED = {"exoskeleton_leg", "bring_your_own_urdf", "planar_to_3d", "find_the_missing_effect", "real_data"}
LARGEST = 1_500_000
MACHINE_PATH = re.compile(r"(?<![\w.])/(home|root|tmp|work|opt|usr|Users|var)/|[A-Z]:\\")


def cells(script: Path) -> list[tuple[str, str]]:
    """Kind and text of every cell of a percent script, without its header."""
    body = re.sub(r"\A# ---\n.*?\n# ---\n", "", script.read_text(encoding="utf-8"), flags=re.DOTALL)
    found = []
    for part in re.split(r"^# %%", body, flags=re.MULTILINE)[1:]:
        head, _, text = part.partition("\n")
        if head.strip() == "[markdown]":
            text = re.sub(r"^# ?", "", text, flags=re.MULTILINE)
            found.append(("markdown", text.strip()))
        else:
            found.append(("code", text.strip()))
    return found


def notebook(script: Path) -> dict:
    return json.loads(script.with_suffix(".ipynb").read_text(encoding="utf-8"))


def source(cell: dict) -> str:
    return "".join(cell["source"]).strip()


def texts(output: dict) -> str:
    data = output.get("data", {})
    return "".join([*output.get("text", []), *data.get("text/plain", []), *data.get("text/html", [])])


def test_all_examples_are_there() -> None:
    assert set(NAMES) >= PROMISED


@pytest.mark.parametrize("script", SCRIPTS, ids=NAMES)
def test_notebook_is_that_of_the_script(script: Path) -> None:
    made = [(cell["cell_type"], source(cell)) for cell in notebook(script)["cells"]]
    assert made == cells(script), "make it again: python .ci/make_notebooks.py " + script.stem


@pytest.mark.parametrize("script", SCRIPTS, ids=NAMES)
def test_notebook_ran_to_its_end_and_shows_nothing_of_the_machine(script: Path) -> None:
    path = script.with_suffix(".ipynb")
    assert path.stat().st_size < LARGEST
    code = [cell for cell in notebook(script)["cells"] if cell["cell_type"] == "code" and source(cell)]
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    outputs = [output for cell in code for output in cell["outputs"]]
    assert outputs
    for output in outputs:
        assert output["output_type"] != "error"
        assert output.get("name") != "stderr"
        assert not MACHINE_PATH.search(texts(output))


@pytest.mark.parametrize("script", SCRIPTS, ids=NAMES)
def test_every_example_explains(script: Path) -> None:
    found = cells(script)
    assert found[0][0] == "markdown"
    assert found[0][1].startswith("# ")
    words = sum(len(text.split()) for kind, text in found if kind == "markdown")
    assert words > 100


@pytest.mark.parametrize("script", SCRIPTS, ids=NAMES)
def test_a_script_asks_for_nothing_that_only_a_notebook_has(script: Path) -> None:
    """No lines for the kernel, which are no Python, and no names that only it defines."""
    tree = ast.parse(script.read_text(encoding="utf-8"))
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert not names & {"display", "get_ipython", "In", "Out"}


@pytest.mark.scenario
def test_real_data_says_what_is_absent(tmp_path: Path) -> None:
    environment = {**os.environ, "SEA_IDENT_DATA": str(tmp_path), "MPLBACKEND": "Agg"}
    script = EXAMPLES / "real_data.py"
    done = subprocess.run([sys.executable, str(script)], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    lines = done.stdout.splitlines()
    assert len(lines) == 4
    assert all(line.endswith("is not on this machine: this part is skipped") for line in lines)
