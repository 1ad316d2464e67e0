"""Recordings without periods: a weaker comparison, without a noise floor and without names."""

from sea_ident.discrepancy.diagnosis import Diagnosis, Gap, LackOfFit, Verdict
from sea_ident.estimation import Model
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording


def diagnose_unrepeated(
    model: Model, processed: ProcessedRecording, recording: Recording | ProcessedRecording
) -> Diagnosis:
    """Say what can still be said of one pass."""
    robot = model.robot
    residual = processed.tau_motor - model.predict(processed.motion, processed.channels)
    rms = {joint: float((residual[:, i] ** 2).mean() ** 0.5) for i, joint in enumerate(robot.joint_names)}
    zero = dict.fromkeys(robot.joint_names, 0.0)
    text = (
        "One pass only, without repetition: there is no noise floor to judge the residual by, so nothing can be named. "
        "Record the same motion ten times or more."
    )
    return Diagnosis(
        verdict=Verdict.CANNOT_TELL,
        text=text,
        lack_of_fit=LackOfFit(0.0, 0, 1.0, 1.0, {joint: {} for joint in robot.joint_names}),
        training=Gap(rms, rms, zero),
        warnings=(*processed.warnings, "no periods: weaker mode, no effect is named"),
        recording=processed.source,
    )
