"""Whether the torque of a joint is in another unit than the model, or on the other side of the gear."""

from sea_ident.estimation.model import Model
from sea_ident.estimation.observations import base_rows
from sea_ident.processing import ProcessedRecording
from sea_ident.robot import Joint

RECOGNISED = 0.15
"""Deviation from a factor up to which it is recognised [-]."""

ALIKE = 0.9
"""Correlation of the torque with that of the model from which on there is a factor between them [-]."""


def other_torque_units(model: Model, processed: ProcessedRecording) -> tuple[str, ...]:
    """Sentences about joints whose torque is that of the model but for the factor of a unit or of the gear.

    No effect makes a torque a thousand times as large and leaves its course.

    Args:
        model: of the robot, identified from a recording in which torques are right.
        processed: the recording.

    Returns:
        One for each such joint; none where all torques may be as they say.
    """
    predicted = base_rows(model.robot, model.effects, model.base, processed.motion, processed.channels) @ model.values
    found = []
    for joint, own, measured in zip(model.robot.joints, predicted.T, processed.tau_motor.T, strict=True):
        power, product = float(own @ own) * float(measured @ measured), float(own @ measured)
        if not product > ALIKE * power**0.5:
            continue
        factor = product / float(own @ own)
        found += [
            f"{processed.source}: the torque of joint {joint.name!r} is {factor:.4g} times that of the model, and runs "
            f"like it: {cause}"
            for known, cause in _causes(joint).items()
            if abs(factor / known - 1.0) <= RECOGNISED
        ]
    return tuple(found)


def _causes(joint: Joint) -> dict[float, str]:
    """What may be wrong with a torque that is off by a factor, and what to do."""
    torque, current = f"tau_motor_{joint.name}", f"current_{joint.name}"
    milli = f"m{joint.torque_unit}"
    causes = {
        1e3: f"is it in {milli}, or the current in mA? Then say ColumnSource({torque!r}, unit={milli!r}) or "
        f"ColumnSource({current!r}, unit='mA'), on the command line --column '{current}={current},unit=mA'",
    }
    if joint.actuator is not None and abs(joint.actuator.gear_ratio) > 1.0 + 2.0 * RECOGNISED:
        ratio = abs(joint.actuator.gear_ratio)
        causes[1.0 / ratio] = (
            f"is it that of the motor before the gear? Then say ColumnSource({torque!r}, gear_ratio={ratio:g}), on the "
            f"command line --column '{torque}={torque},gear_ratio={ratio:g}'"
        )
    return causes
