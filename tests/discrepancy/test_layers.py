"""The parts of the diagnosis use each other one way, in the order in which the package tells them."""

import ast
import re
from pathlib import Path

import sea_ident.discrepancy

ROOT = Path(sea_ident.discrepancy.__file__).parent
ORDER = re.findall(r"^- `(\w+)`", str(sea_ident.discrepancy.__doc__), re.MULTILINE)


def used(file: Path) -> set[str]:
    """Parts of the diagnosis, and modules that put them together, that a file imports."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("sea_ident.discrepancy"):
            inner = str(node.module).split(".")[2:]
            names |= {inner[0]} if inner else {alias.name for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {
                alias.name.split(".")[2]
                for alias in node.names
                if alias.name.count(".") > 1 and "discrepancy" in alias.name
            }
    return names


def test_every_folder_is_told():
    assert sorted(ORDER) == sorted(part.name for part in ROOT.iterdir() if (part / "__init__.py").is_file())


def test_a_part_uses_those_before_it_alone():
    wrong = [
        f"{file.relative_to(ROOT)} imports {name}"
        for position, part in enumerate(ORDER)
        for file in sorted((ROOT / part).rglob("*.py"))
        for name in sorted(used(file) - set(ORDER[: position + 1]))
    ]
    assert wrong == []
    # what puts them together does use them: the imports above are read at all
    assert used(ROOT / "diagnose.py") >= {"measured", "bench", "search", "evidence"}
