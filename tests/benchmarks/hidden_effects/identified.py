"""How far `identify` alone is off, in the standard deviations that it tells, while effects are hidden or none is."""

import json
import warnings
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from sea_ident import Model, identify, load_robot, read_recording
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.regressor import prior_parameters
from tests.benchmarks.hidden_effects.case import Case, FloatArray
from tests.benchmarks.hidden_effects.draw import truth_of
from tests.benchmarks.hidden_effects.generate import case_folder
from tests.benchmarks.hidden_effects.plants import Truth


def identified(root: Path, rows: Collection[str] = ()) -> Iterator[str]:
    """Identify the kept cases of a run, without any diagnosis.

    Args:
        root: of a run with `--keep`.
        rows: of the table; all by default.

    Yields:
        A line about the parameters of every case in which nothing is hidden, and about every spring; one about these
        parameters in all, one about springs whose law leaves more than noise and one about the others.
    """
    parameters: dict[str, list[FloatArray]] = {"friction": [], "bodies and rotors": []}
    springs: dict[bool, list[list[float]]] = {True: [], False: []}
    for truth_file in sorted((root / "truth").glob("*.json")):
        case = Case.from_dict(json.loads(truth_file.read_text()))
        if rows and case.row not in rows:
            continue
        folder, truth = case_folder(root, case.label), truth_of(case)
        about, annotation = json.loads((folder / "joints.json").read_text()), folder / "annotation.urdf"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            robot = load_robot(folder / "robot.urdf", annotation if annotation.exists() else None, about["joints"])
            model = identify(robot, read_recording(folder / "train.npz"), period=about["period"])
        if not case.planted:
            off = _errors(model, truth)
            friction = np.array(["friction" in name for name in model.names])
            for kind, which in (("friction", friction), ("bodies and rotors", ~friction)):
                parameters[kind].append(off[which])
            worst = int(np.argmax(np.abs(off)))
            yield f"{case.label}: {_within(off)}; {model.names[worst]} {off[worst]:.1f}"
        for spring in model.springs:
            i = robot.index(spring.joint)
            errors = [
                (spring.stiffness - truth.stiffness[i]) / spring.stiffness_std,
                (spring.cubic_stiffness - truth.cubic[i]) / spring.cubic_stiffness_std,
                (spring.damping - truth.damping[i]) / spring.damping_std,
            ]
            springs[bool(spring.misfit)].append(errors)
            left = "more" if spring.misfit else "no more"
            numbers = ", ".join(f"{name} {error:.1f}" for name, error in zip(("K1", "K3", "D"), errors, strict=True))
            hidden = ", ".join(f"{p.effect} at {p.joint}" for p in case.planted)
            told = f"{numbers} standard deviations off, leaves {left} than noise"
            yield f"{case.label} {spring.joint}: {told}; {hidden or 'nothing hidden'}"
    for kind, of_cases in parameters.items():
        if of_cases:
            yield f"nothing hidden, {kind}: {_within(np.concatenate(of_cases))}"
    for misfit, each in springs.items():
        if each:
            table = np.abs(np.array(each))
            shares = ", ".join(f"{int(n)} of {len(table)}" for n in np.sum(table < 2.0, axis=0))
            worst_each = ", ".join(f"{w:.1f}" for w in table.max(axis=0))
            what = "more than noise" if misfit else "no more than noise"
            yield f"law leaves {what}: K1, K3, D within two standard deviations {shares}; worst {worst_each}"


def _errors(model: Model, truth: Truth) -> FloatArray:
    """(b,) errors of the base parameters over their standard deviations [-]."""
    true, first = np.nan_to_num(prior_parameters(truth.robot, model.effects)), 0
    friction = {"viscous_friction": truth.viscous, "coulomb_friction": truth.coulomb}
    for effect in model.effects:
        if effect.name in friction:
            true[first] = friction[effect.name][truth.robot.index(str(effect.joint))]
        first += len(effect.columns(truth.robot))
    errors: FloatArray = (model.values - model.base.project(true)) / model.std
    return errors


def _within(errors: FloatArray) -> str:
    """How many errors are within two standard deviations, and how large they are in all."""
    within, rms = int(np.sum(np.abs(errors) < 2.0)), float(np.sqrt(np.mean(errors**2)))
    return f"{within} of {len(errors)} within two standard deviations, rms {rms:.2f}, worst {np.abs(errors).max():.1f}"
