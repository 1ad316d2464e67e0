import os
import re
import subprocess
import sys

import pytest

from sea_ident.atomic import atomic_directory, atomic_file
from sea_ident.exceptions import OutputError


def test_the_temporary_file_itself_becomes_the_file(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("old")
    with atomic_file(path) as temporary:
        temporary.write_text("new")
        written = temporary.stat().st_ino
        assert path.read_text() == "old"
        assert (temporary.parent, temporary.suffix) == (tmp_path, ".csv")
    assert path.read_text() == "new"
    assert path.stat().st_ino == written
    assert os.listdir(tmp_path) == ["x.csv"]


KILLED = """
import os, signal, sys
from sea_ident.atomic import atomic_directory, atomic_file, scratch_folder
with atomic_file(sys.argv[1] + "/a.csv") as a, atomic_directory(sys.argv[1] + "/b") as b, scratch_folder(sys.argv[1]):
    a.write_text("half")
    b.mkdir()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_next_run_removes_what_a_killed_one_left(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    subprocess.run([sys.executable, "-c", KILLED, str(folder)], check=False)
    left = sorted(os.listdir(folder))
    assert [name.partition(".sea-ident-")[0] for name in left] == [".a", ".b"]
    assert len(os.listdir(tmp_path)) == 2
    # what is not ours, of another machine, of a process that lives, or only looks alike
    ours = re.sub(r"-\d+-([0-9a-f]{12})", rf"-{os.getppid()}-\1", left[0])
    other = re.sub(r"sea-ident-[0-9a-f]{8}", "sea-ident-00000000", left[0])
    kept = {".a.csv", "a.csv.bak", ours, other, f"x{left[0]}"}
    for name in kept:
        (folder / name).write_text("mine")
    with atomic_file(folder / "new.csv") as temporary:
        temporary.write_text("new")
    assert set(os.listdir(folder)) == {"new.csv", *kept}


def test_the_temporary_name_of_a_long_name_is_no_longer(tmp_path):
    path = tmp_path / ("n" * 240 + ".csv")
    with atomic_file(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"


def fail(context, name, error):
    with context as temporary:
        if temporary.suffix:
            temporary.write_text("half")
        else:
            temporary.mkdir()
            (temporary / name).touch()
        raise error


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError):
        fail(atomic_file(path), "half", ZeroDivisionError())
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["x.csv"]


def test_errors_of_the_disk_are_errors_of_the_project(tmp_path):
    full = OSError(28, "No space left on device")
    with pytest.raises(OutputError, match=r"x.csv: cannot be written: No space left"):
        fail(atomic_file(tmp_path / "x.csv"), "half", full)
    with pytest.raises(OutputError, match=r"bag: cannot be written: No space left"):
        fail(atomic_directory(tmp_path / "bag"), "half", full)
    with pytest.raises(OutputError, match="cannot be written"), atomic_file(tmp_path / "x.csv"):
        pass
    assert os.listdir(tmp_path) == []


def test_a_new_file_has_the_usual_permissions(tmp_path):
    (tmp_path / "usual").touch()
    with atomic_file(tmp_path / "x.csv") as temporary:
        temporary.touch()
    assert (tmp_path / "x.csv").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_folder_appears_whole_or_not_at_all(tmp_path):
    path = tmp_path / "bag"
    with pytest.raises(ZeroDivisionError):
        fail(atomic_directory(path), "half", ZeroDivisionError())
    assert os.listdir(tmp_path) == []
    with atomic_directory(path) as temporary:
        assert temporary.name == "bag"
        temporary.mkdir()
        (temporary / "whole").touch()
        assert not path.exists()
    assert os.listdir(path) == ["whole"]
    with pytest.raises(OutputError, match="exists already"), atomic_directory(path):
        pass
    assert os.listdir(tmp_path) == ["bag"]
