"""How far `identify` alone is off in springs, in the standard deviations that it tells, while effects are hidden."""

import json
import warnings
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from sea_ident import identify, load_robot, read_recording
from sea_ident.exceptions import SeaIdentWarning
from tests.benchmarks.hidden_effects.case import Case
from tests.benchmarks.hidden_effects.draw import truth_of
from tests.benchmarks.hidden_effects.generate import case_folder


def springs(root: Path, rows: Collection[str] = ()) -> Iterator[str]:
    """Identify the kept cases of a run, without any diagnosis.

    Args:
        root: of a run with `--keep`.
        rows: of the table; all by default.

    Yields:
        A line about every spring, and one about those whose law leaves more than noise and one about the others.
    """
    found: dict[bool, list[list[float]]] = {True: [], False: []}
    for truth_file in sorted((root / "truth").glob("*.json")):
        case = Case.from_dict(json.loads(truth_file.read_text()))
        if rows and case.row not in rows:
            continue
        folder, truth = case_folder(root, case.label), truth_of(case)
        about, annotation = json.loads((folder / "joints.json").read_text()), folder / "annotation.urdf"
        robot = load_robot(folder / "robot.urdf", annotation if annotation.exists() else None, about["joints"])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            model = identify(robot, read_recording(folder / "train.npz"), period=about["period"])
        for spring in model.springs:
            i = robot.index(spring.joint)
            errors = [
                (spring.stiffness - truth.stiffness[i]) / spring.stiffness_std,
                (spring.cubic_stiffness - truth.cubic[i]) / spring.cubic_stiffness_std,
                (spring.damping - truth.damping[i]) / spring.damping_std,
            ]
            found[bool(spring.misfit)].append(errors)
            left = "more" if spring.misfit else "no more"
            numbers = ", ".join(f"{name} {error:.1f}" for name, error in zip(("K1", "K3", "D"), errors, strict=True))
            hidden = ", ".join(f"{p.effect} at {p.joint}" for p in case.planted)
            off = f"{numbers} standard deviations off, leaves {left} than noise"
            yield f"{case.label} {spring.joint}: {off}; {hidden or 'nothing hidden'}"
    for misfit, each in found.items():
        if each:
            table = np.abs(np.array(each))
            shares = ", ".join(f"{int(n)} of {len(table)}" for n in np.sum(table < 2.0, axis=0))
            worst = ", ".join(f"{w:.1f}" for w in table.max(axis=0))
            what = "more than noise" if misfit else "no more than noise"
            yield f"law leaves {what}: K1, K3, D within two standard deviations {shares}; worst {worst}"
