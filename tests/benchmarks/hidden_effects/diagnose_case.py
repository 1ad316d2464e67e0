"""Diagnose the recordings of a case from its folder alone.

`python -m tests.benchmarks.hidden_effects.diagnose_case FOLDER...`, or folders on stdin.

The only file of the benchmark that knows the interface of the library's discrepancy workflow. It reads recordings and
the nominal description and writes `diagnosis.json`; it never sees the truth.
"""

import json
import sys
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

import sea_ident.effects as effects_package
from sea_ident.discrepancy.search.one_zero import one_zero
from sea_ident.effects import Effect, effect_classes
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.recordings import read_recording
from sea_ident.robot import load_robot

RESULT = "diagnosis.json"


def diagnose_case(folder: Path) -> dict[str, Any]:
    """Identify the base model and diagnose it.

    Args:
        folder: of the case: robot.urdf, perhaps annotation.urdf, joints.json, train.npz, holdout.npz, perhaps
            reference.npz and forbidden.json.

    Returns:
        DIAGNOSIS.json as a dictionary, with `seconds` of the diagnosis and `identify_seconds`.
    """
    from sea_ident.discrepancy import diagnose

    about = json.loads((folder / "joints.json").read_text())
    annotation = folder / "annotation.urdf"
    robot = load_robot(folder / "robot.urdf", annotation if annotation.exists() else None, about["joints"])
    period = about["period"]
    forbidden_file = folder / "forbidden.json"
    forbidden = json.loads(forbidden_file.read_text()) if forbidden_file.exists() else []
    with without_effects(forbidden):
        started = time.perf_counter()
        train = read_recording(folder / "train.npz")
        model = identify(robot, train, period=period)
        identified = time.perf_counter()
        reference = None
        if (folder / "reference.npz").exists():
            reference = identify(robot, read_recording(folder / "reference.npz"), period=period)
        holdout = read_recording(folder / "holdout.npz")
        begin = time.perf_counter()
        diagnosis = diagnose(model, train, holdout=holdout, reference=reference)
        end = time.perf_counter()
    record: dict[str, Any] = diagnosis.to_dict()
    return {**record, "identify_seconds": identified - started, "seconds": end - begin}


@contextmanager
def without_effects(names: list[str]) -> Iterator[None]:
    """The library without some of its effects, wherever it looks them up."""
    if not names:
        yield
        return
    less = {name: effect for name, effect in effect_classes().items() if name not in names}

    def fewer() -> dict[str, type]:
        return less

    # a module may be known by two names
    known = {id(m): m for m in list(sys.modules.values())}
    places = [m for m in known.values() if getattr(m, "effect_classes", None) is effect_classes]
    patches = [patch.object(module, "effect_classes", fewer) for module in places]
    if "link_friction" in names:  # nor what the description gives of it
        patches.append(patch("sea_ident.discrepancy.search.as_described.left_out", lambda robot, effects: ()))

    def but_these(*given: Any) -> Effect | None:
        zero = one_zero(*given)
        return None if zero is None or zero.name in names else zero

    # two zeros of a joint are made one by their names, whatever the library has
    patches.append(patch("sea_ident.discrepancy.search.one_for_two.one_zero", but_these))
    assert effects_package in places
    for p in patches:
        p.start()
    try:
        yield
    finally:
        for p in patches:
            p.stop()


def write_diagnosis(folder: Path) -> None:
    """Diagnose a case and write what came out, an error included."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            result = diagnose_case(folder)
    except Exception as error:
        result = {"error": f"{type(error).__name__}: {error}", "traceback": traceback.format_exc()}
    text = json.dumps(result, default=_plain, indent=1)
    partial = folder / (RESULT + ".part")
    partial.write_text(text)
    partial.replace(folder / RESULT)


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    return str(value)


def main() -> None:
    """Folders from the command line, or one per line on stdin, answered by a line each."""
    if len(sys.argv) > 1:
        for name in sys.argv[1:]:
            write_diagnosis(Path(name))
        return
    for line in sys.stdin:
        write_diagnosis(Path(line.strip()))
        print(line.strip(), flush=True)


if __name__ == "__main__":
    main()
