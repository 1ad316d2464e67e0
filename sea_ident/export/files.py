"""An identified model as a file for other tools."""

import warnings as python_warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sea_ident.arguments import expect
from sea_ident.atomic import atomic_file
from sea_ident.effects.joint_placement import JointPlacement
from sea_ident.effects.signal import SignalEffect
from sea_ident.estimation import Model, physical_parameters
from sea_ident.exceptions import ExportError, OutputError, SeaIdentWarning
from sea_ident.export.mjcf import mjcf_text
from sea_ident.export.urdf import urdf_text
from sea_ident.export.values import ExportValues, collect_values
from sea_ident.robot.model import UPRIGHT


@dataclass(frozen=True)
class Export:
    """What was written.

    Attributes:
        path: the file.
        format: urdf or mjcf.
        notes: how the freedom that data leave was filled.
        warnings: what of the model the file does not hold.
    """

    path: Path
    format: str
    notes: tuple[str, ...]
    warnings: tuple[str, ...]

    def summary(self) -> str:
        """The file and what to know about it."""
        lines = [f"{self.path} ({self.format})"]
        lines.extend(f"  {text}" for text in self.notes)
        lines.extend(f"  warning: {text}" for text in self.warnings)
        return "\n".join(lines)


def model_values(model: Model) -> tuple[ExportValues, list[str], list[str]]:
    """Full standard parameters and springs of an identified model.

    Base parameters fix combinations only; what they leave free is filled by the physically consistent values nearest to
    those of the URDF.

    Args:
        model: the identified model.

    Returns:
        The values, notes, and warnings for the user.

    Raises:
        IdentificationError: if no physically consistent parameters are found.
    """
    physical = physical_parameters(model)
    values = collect_values(model.robot, physical.columns, physical.values)
    laws = {spring.joint: spring.law for spring in model.springs}
    warnings: list[str] = []
    joints = []
    for joint in values.joints:
        if joint.joint in laws:
            stiffness, cubic, damping = laws[joint.joint]
            if stiffness <= 0.0:
                # neither load_robot nor a simulator takes such a spring
                warnings.append(
                    f"the stiffness of the spring of {joint.joint!r} came out as {stiffness:.4g}, which no spring has: "
                    "it is left out, and what the description says of this spring stays; see the warnings of the model"
                )
                joints.append(joint)
                continue
            joint = replace(joint, stiffness=stiffness, cubic_stiffness=cubic, damping=damping)
        joints.append(joint)
    notes = ["what the data leave free has the physically consistent values nearest to those of the URDF"]
    if not physical.consistent:
        (notes if physical.within_uncertainty else warnings).append(physical.verdict())
    beside = (*model.spring_effects, *(trend.effect for trend in model.trends))
    inside = [column.name for effect in beside for column in effect.columns(model.robot)]
    moved = [effect for effect in model.effects if isinstance(effect, JointPlacement)]
    ways = {column.name for effect in moved for column in effect.columns(model.robot)}
    warnings += [
        f"{effect.title} is not in the file, whose bodies go with it: correct the <origin> of the joint in the "
        "description, identify again and export that model"
        for effect in moved
    ]
    # what errs in a sensor has amounts and no columns
    sensed = [effect.parameter_name() for effect in model.effects if isinstance(effect, SignalEffect)]
    left_out = (*(name for name in values.left_out if name not in ways), *inside, *sensed)
    return replace(values, joints=tuple(joints), left_out=left_out), notes, warnings


def export_urdf(model: Model, path: str | Path) -> Export:
    """Write an identified model as URDF: the user's own file with the identified values in it.

    Inertials of moving links, friction (`<dynamics>`) and transmissions are replaced; all else is left as it was,
    comments included. `load_robot` of the file gives a robot whose priors are the identified values.

    Args:
        model: the identified model.
        path: the file to be written.

    Returns:
        What was written.

    Raises:
        ExportError: if the model cannot be written as URDF, or the file cannot be written.
        IdentificationError: if no physically consistent parameters are found.
    """
    expect(model, "export_urdf: model", Model)
    values, notes, warnings = model_values(model)
    text, remarks = urdf_text(values)
    if model.robot.locked:
        notes.append(
            f"joints that the model holds are in the URDF as they were ({', '.join(model.robot.locked)}): load it with "
            f"joints, on the command line --joints {','.join(model.robot.joint_names)}, to have the robot of the model"
        )
    if not np.allclose(model.robot.gravity, UPRIGHT):
        gravity = ", ".join(f"{value:.6g}" for value in model.robot.gravity)
        notes.append(
            f"a URDF has no place for gravity, here ({gravity}) m/s2: load it with gravity=({gravity}), on the command "
            f"line --gravity={gravity.replace(' ', '')}"
        )
    return _write(path, "urdf", text, notes, [*warnings, *remarks])


def export_mjcf(model: Model, path: str | Path) -> Export:
    """Write an identified model as MJCF, with rotors as bodies and springs as tendons (see `sea_ident.export.mjcf`).

    Args:
        model: the identified model.
        path: the file to be written.

    Returns:
        What was written.

    Raises:
        ExportError: if MuJoCo could not hold the model, or the file cannot be written.
        IdentificationError: if no physically consistent parameters are found.
    """
    expect(model, "export_mjcf: model", Model)
    values, notes, warnings = model_values(model)
    text, remarks = mjcf_text(values)
    return _write(path, "mjcf", text, notes, [*warnings, *remarks])


def _write(path: str | Path, kind: str, text: str, notes: list[str], warnings: list[str]) -> Export:
    try:
        with atomic_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OutputError as error:
        raise ExportError(str(error)) from None
    for warning in warnings:
        python_warnings.warn(f"{path}: {warning}", SeaIdentWarning, stacklevel=3)
    return Export(Path(path), kind, tuple(notes), tuple(warnings))
