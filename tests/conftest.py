"""What all tests share: one thread for each of the processes that pytest starts, and the command line without one."""

import os
import sys
import warnings
from dataclasses import dataclass

import pytest

# threads would compete for the cores with the processes
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
if "PYTEST_XDIST_WORKER" in os.environ:
    # and so would a second process of each of them
    os.environ.setdefault("LOKY_MAX_CPU_COUNT", "1")


LONG = ("test_readme.py", "test_cli.py", "test_cli_excite.py", "test_distributed.py", "test_demo.py")
"""Files that go first: one that takes long and comes last leaves all processes but its own without work."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files first, the others as they are."""
    items.sort(key=lambda item: item.path.name not in LONG)


@dataclass(frozen=True)
class Answer:
    """What a command line said, and how it ended."""

    returncode: int
    stdout: str
    stderr: str


@pytest.fixture
def call_here(monkeypatch, capsys):
    """Calls the command line in this process, for a process of its own spends a second on its imports."""
    from sea_ident.cli import main

    def call(*arguments: object, cwd) -> Answer:
        monkeypatch.setattr(sys, "argv", ["sea-ident", *map(str, arguments)])
        monkeypatch.chdir(cwd)
        with warnings.catch_warnings(), pytest.raises(SystemExit) as ended:
            main()
        code = ended.value.code
        return Answer(code if isinstance(code, int) else int(code is not None), *capsys.readouterr())

    return call
