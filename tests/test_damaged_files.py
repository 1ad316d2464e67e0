"""MODEL.json, excitations and diagnoses that were damaged or edited: a result or a SeaIdentError, nothing else."""

import contextlib
import copy
import json
import os
import random
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sea_ident import design_excitation, diagnose, identify, load_robot, simulate
from sea_ident.discrepancy import read_diagnosis
from sea_ident.estimation import read_model
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.excitation import read_excitation
from sea_ident.recordings import write_recording

JUNK = [
    None, True, 0, -1, 3, 10**400, 1e308, -0.0, float("nan"), float("inf"), -float("inf"), "", "nan", "x" * 2000,
    "\x00", "../../etc", [], [[]], [1.0], [[1.0, 2.0]], {}, {"a": 1}, [None], "\ud800",
]  # fmt: skip
READERS = {"model": read_model, "excitation": read_excitation, "diagnosis": read_diagnosis}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """One good file of each kind."""
    folder = tmp_path_factory.mktemp("good")
    leg = load_robot("exo_leg")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        excitation = design_excitation(leg, base_frequency=0.5, harmonics=4, starts=1, jobs=1, rate=50.0)
        recording = simulate(leg, excitation, periods=4, rate=100.0).recording
        model = identify(leg, recording, period=2.0)
        diagnosis = diagnose(model, recording, period=2.0)
    excitation.save(folder / "excitation")
    model.save(folder / "model")
    diagnosis.save(folder / "diagnosis")
    write_recording(recording, folder / "recording.csv")
    return folder


@pytest.fixture(scope="module")
def contents(files):
    return {kind: json.loads((files / kind).read_text()) for kind in READERS}


def outcome(kind: str, path: Path) -> None:
    """Read it and use it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        with contextlib.suppress(SeaIdentError):
            READERS[kind](path).summary()


def places(record, path=()):
    """Every place in a JSON document; of long lists only some."""
    yield path
    if isinstance(record, dict):
        for key, value in record.items():
            yield from places(value, (*path, key))
    elif isinstance(record, list):
        for k in sorted({0, len(record) // 2, len(record) - 1} if record else ()):
            yield from places(record[k], (*path, k))


def changed(record, place, change, junk):
    """A copy with one place replaced, removed, doubled or renamed; what is not on the way there is shared."""
    if not place:
        return junk
    key, *rest = place
    whole = copy.copy(record)
    if rest:
        whole[key] = changed(record[key], rest, change, junk)
    elif change == "replace":
        whole[key] = junk
    elif change == "remove":
        del whole[key]
    elif isinstance(whole, list):
        whole.append(whole[key])
    else:
        whole[f"{key}_"] = whole.pop(key)
    return whole


def edits(kind, files, contents, seed, rounds):
    """One to three edits at random places, again and again."""
    chance = random.Random(seed)
    spots = list(places(contents[kind]))
    path = files / f"edited_{kind}"
    for _ in range(rounds):
        record = contents[kind]
        for _ in range(chance.choice((1, 1, 2, 3))):
            try:
                place = chance.choice(spots)
                record = changed(
                    record, place, chance.choice(("replace", "replace", "remove", "again")), chance.choice(JUNK)
                )
            except (KeyError, IndexError, TypeError, AttributeError):
                continue  # an earlier edit took the place away
        path.write_bytes(json.dumps(record).encode("utf-8", "surrogatepass"))
        outcome(kind, path)


@pytest.mark.parametrize("kind", READERS)
def test_any_edit(kind, files, contents):
    edits(kind, files, contents, seed=1, rounds=40)


@pytest.mark.slow
@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("seed", [2, 3])
def test_many_edits(kind, seed, files, contents):
    edits(kind, files, contents, seed, rounds=600)


@pytest.mark.parametrize("kind", READERS)
def test_every_cut_and_any_byte(kind, files):
    whole = (files / kind).read_bytes()
    chance = random.Random(0)
    path = files / f"cut_{kind}"
    for _ in range(30):
        path.write_bytes(whole[: chance.randrange(len(whole) - 2)])
        with pytest.raises(SeaIdentError):
            READERS[kind](path)
    for _ in range(30):
        damaged = bytearray(whole)
        damaged[chance.randrange(len(whole))] = chance.randrange(256)
        path.write_bytes(damaged)
        outcome(kind, path)


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize(
    "data",
    [b"", b"null", b"[]", b"{}", b"0", b'"x"', b"\xff\xfe", b"[" * 200_000, b'{"a":' * 200_000, b"9" * 5000],
    ids=["empty", "null", "list", "object", "number", "text", "bytes", "nested lists", "nested objects", "digits"],
)
def test_what_is_no_such_file_is_refused(kind, data, tmp_path):
    path = tmp_path / "file.json"
    path.write_bytes(data)
    with pytest.raises(SeaIdentError):
        READERS[kind](path)


@pytest.mark.parametrize("kind", READERS)
@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.binary(max_size=200))
def test_any_bytes_are_refused(kind, data, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / f"bytes_{kind}"
    path.write_bytes(data)
    with pytest.raises(SeaIdentError):
        READERS[kind](path)


@pytest.mark.parametrize("kind", READERS)
def test_a_folder_or_nothing_is_refused(kind, tmp_path):
    for path in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(SeaIdentError):
            READERS[kind](path)


def test_reading_back_changes_nothing(files, contents):
    assert read_excitation(files / "excitation").to_dict() == contents["excitation"]
    assert read_model(files / "model").to_dict() == contents["model"]
    assert np.all(np.isfinite(read_model(files / "model").values))


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_a_kill_during_identify_leaves_a_whole_model_or_none(files, tmp_path):
    out, report = tmp_path / "MODEL.json", tmp_path / "report.html"
    program = "import sys; from sea_ident.cli import main; main()"
    arguments = ["identify", "exo_leg", str(files / "recording.csv"), "--period", "2", "--out", str(out)]
    command = [sys.executable, "-c", program, *arguments, "--report", str(report)]
    begun = time.monotonic()
    assert subprocess.run(command, capture_output=True).returncode == 0
    duration = time.monotonic() - begun
    before = out.read_bytes()
    chance = random.Random(0)
    kills = 0
    for round_ in range(8):
        if round_ % 2:  # over an older file, and where there was none
            out.unlink(missing_ok=True)
            report.unlink(missing_ok=True)
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(duration * chance.uniform(0.3, 1.0))
        kills += process.poll() is None
        process.kill()
        process.wait()
        if out.exists():
            assert read_model(out).to_dict() == json.loads(before)
        if report.exists():
            assert report.read_text().rstrip().endswith("</html>")
        shown = {name for name in os.listdir(tmp_path) if name[0] != "."}
        assert shown <= {"MODEL.json", "report.html"}
    assert kills > 3
