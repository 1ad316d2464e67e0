"""The README's Python runs as written, and prints what it says it prints."""

import contextlib
import io
import os
import re
import warnings
from pathlib import Path

import pytest

from sea_ident.exceptions import SeaIdentWarning

README = Path(__file__).parents[1] / "README.md"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def blocks() -> list[tuple[str, str | None]]:
    """Python blocks in order, each with the text block that follows it at once, if one does."""
    found = re.findall(r"```(\w+)\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    pairs = []
    for k, (kind, text) in enumerate(found):
        if kind == "python":
            printed = found[k + 1][1] if k + 1 < len(found) and found[k + 1][0] == "text" else None
            pairs.append((text, printed))
    return pairs


@pytest.mark.scenario
def test_every_block_prints_what_stands_under_it(tmp_path):
    scope: dict[str, object] = {"__name__": "readme"}
    before = Path.cwd()
    os.chdir(tmp_path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            for source, printed in blocks():
                out = io.StringIO()
                with contextlib.redirect_stdout(out):
                    exec(compile(source, str(README), "exec"), scope)
                if printed is not None:
                    same(out.getvalue(), printed)
    finally:
        os.chdir(before)


def same(got: str, said: str) -> None:
    """The same words, and numbers that agree to the few per cent by which another machine's optimum may differ."""
    assert NUMBER.sub("#", got).split() == NUMBER.sub("#", said).split()
    numbers = [[float(text) for text in NUMBER.findall(part)] for part in (got, said)]
    assert numbers[0] == pytest.approx(numbers[1], rel=0.1)


def test_the_files_that_it_names_are_there():
    text = README.read_text(encoding="utf-8")
    root = README.parent
    named = re.findall(r"\]\(([\w/.]+)\)", text) + re.findall(r"`?(tests/benchmarks/\w+\.py)", text)
    assert named
    assert [name for name in named if not (root / name).is_file()] == []


def test_every_verb_that_exists_is_in_the_list():
    from sea_ident.cli.verbs import VERBS

    text = README.read_text(encoding="utf-8")
    assert [verb.__name__ for verb in VERBS if f"sea-ident {verb.__name__}" not in text] == []
