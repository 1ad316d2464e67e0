"""`validate`: how well a model predicts a recording that was not used to find it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from sea_ident._typing import FloatArray
from sea_ident.arguments import expect, expect_number
from sea_ident.estimation import Agreement, Model, TrendTerm
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.spring_agreement import SpringAgreement, spring_agreement
from sea_ident.estimation.trend_term import trend_torque, trend_torques
from sea_ident.exceptions import EffectError, RecordingError
from sea_ident.one_thread import one_thread
from sea_ident.processing import ProcessedRecording, filter_recording, process
from sea_ident.recordings import Recording

AFTER_FORCE = 0.05
"""Time [s] around an external force for which the filtered acceleration is not to be trusted."""


@dataclass(frozen=True, eq=False)
class Validation:
    """Prediction of a recording.

    Attributes:
        recording: where the data came from.
        joint_names: (n,).
        rms: (n,) rms of measured less predicted torque [N m] or [N].
        noise_std: (n,) standard deviation of the noise of that torque [N m] or [N].
        rms_torque: (n,) rms of the measured torque [N m] or [N].
        nrms: (n,) `rms` over `rms_torque` [-].
        samples: number of samples that were compared.
        processed: the recording as it was compared.
        predicted: (N, n) predicted torque [N m] or [N].
        used: (N,) which samples were compared.
        agreement: residual away from reversals beside its noise; None where one period says nothing of noise.
        warnings: what a user should know.
        units: (n,) unit of the torque of each joint.
        springs: the law of every spring beside the torque that the dynamic model gives; empty where it tells none.
    """

    recording: str
    joint_names: tuple[str, ...]
    rms: FloatArray
    noise_std: FloatArray
    rms_torque: FloatArray
    nrms: FloatArray
    samples: int
    processed: ProcessedRecording
    predicted: FloatArray
    used: NDArray[np.bool_]
    agreement: Agreement | None = None
    warnings: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    springs: tuple[SpringAgreement, ...] = ()

    def summary(self) -> str:
        """One line per joint."""
        lines = [f"prediction of {self.recording}, {self.samples} samples"]
        away = None if self.agreement is None else self.agreement.words()
        for i, name in enumerate(self.joint_names):
            joint = f"{name} [{self.units[i]}]" if self.units else name
            lines.append(
                f"  {joint}: rms {self.rms[i]:.4g} of {self.rms_torque[i]:.4g} ({100 * self.nrms[i]:.2f} %), noise "
                f"{self.noise_std[i]:.3g}{'' if away is None else away[i]}"
            )
        lines.extend(f"  {spring.summary()}" for spring in self.springs)
        lines.extend(f"  warning: {text}" for text in self.warnings)
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """rms, noise_std and nrms per joint and spring, for `sea-ident validate --json`."""
        named = {"rms": self.rms, "noise_std": self.noise_std, "rms_torque": self.rms_torque, "nrms": self.nrms}
        record: dict[str, Any] = {
            key: {name: float(v) for name, v in zip(self.joint_names, values, strict=True)}
            for key, values in named.items()
        }
        away = None if self.agreement is None else self.agreement.to_dict(self.joint_names)
        return {
            **record,
            "agreement": away,
            "springs": {spring.joint: spring.to_dict() for spring in self.springs},
            "samples": self.samples,
            "recording": self.recording,
            "warnings": list(self.warnings),
        }


@one_thread
def validate(
    model: Model,
    recording: Recording | ProcessedRecording,
    *,
    period: float | None = None,
    link_harmonics: int | None = None,
    motor_harmonics: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Validation:
    """Compare the torque that a model predicts with the torque that was measured, and its springs with their torque.

    Where a column ``external_force_<joint>`` says that something pushed, those samples are left out.

    Args:
        model: the model.
        recording: a recording that was not used to identify it.
        period: [s]; found from the data where None; a recording without a period is filtered instead.
        link_harmonics: harmonics of q; chosen from the data where None.
        motor_harmonics: harmonics of theta; chosen from the data where None.
        progress: called with what is being done and the share that is done.

    Returns:
        Rms of the difference per joint, beside the noise.

    Raises:
        RecordingError: a column is missing, or an external force acts throughout.
    """
    expect(model, "validate: model", Model)
    expect(recording, "validate: recording", Recording, ProcessedRecording)
    expect_number(period, "validate: period", "s")
    tell = progress or (lambda what, share: None)
    tell("averaging the periods", 0.0)
    if isinstance(recording, ProcessedRecording):
        processed = recording
    elif all(recording.has("external_force", joint) for joint in model.robot.joint_names):
        # what pushes differs from period to period: an average would mix pushed with free samples
        processed = filter_recording(recording, model.robot)
    else:
        processed = process(
            recording, model.robot, period=period, link_harmonics=link_harmonics, motor_harmonics=motor_harmonics
        )
    tell("predicting the torque", 0.2)
    observations = Observations(model.robot, model.effects, model.base, processed)
    trends, untold = _followed(model, processed)
    of_trends, of_each = trend_torques(model.robot, model.effects, trends, processed)
    predicted = observations.rows @ model.values + of_trends
    used = np.ones(processed.samples, dtype=bool)
    found = [*processed.warnings, *untold]
    if "external_force" in processed.channels:
        used = _free(processed)
        if not np.any(used):
            raise RecordingError(f"{processed.source}: an external force acts at every sample; nothing can be compared")
        if not np.all(used):
            found.append(
                f"{processed.source}: {np.count_nonzero(~used)} of {len(used)} samples are left out, where an external "
                f"force acts or did within {AFTER_FORCE:g} s"
            )
    apart = processed.tau_motor - predicted
    difference = apart[used]
    rms = np.sqrt(np.mean(difference**2, axis=0))
    rms_torque = np.sqrt(np.mean(processed.tau_motor[used] ** 2, axis=0))
    each = []
    for p, rows in enumerate(observations.each_period() if processed.period_motions else ()):
        tell(f"predicting period {p + 1} of {processed.periods}", 0.2 + 0.6 * p / processed.periods)
        each.append(processed.period_tau_motor[p] - rows.total @ model.values - of_each[p])
    tell("comparing the springs", 0.8)
    springs = spring_agreement(observations, model.values, model.springs, used)
    found += [spring.warning for spring in springs if spring.warning]
    noise = np.sqrt(processed.raw_tau_variance[used].mean(axis=0) / processed.periods)
    nrms = np.divide(rms, rms_torque, out=np.full_like(rms, np.inf), where=rms_torque > 0.0)
    return Validation(
        recording=processed.source,
        joint_names=processed.joint_names,
        rms=rms,
        noise_std=noise,
        rms_torque=rms_torque,
        nrms=nrms,
        samples=int(np.count_nonzero(used)),
        processed=processed,
        predicted=predicted,
        used=used,
        agreement=observations.agreement(apart, np.array(each), used),
        warnings=tuple(found),
        units=tuple(joint.torque_unit for joint in model.robot.joints),
        springs=springs,
    )


def _followed(model: Model, processed: ProcessedRecording) -> tuple[list[TrendTerm], list[str]]:
    """The trends that a recording has what it takes for, and what is to be said of the others."""
    found, texts = [], []
    some = {kind: values[:2] for kind, values in processed.channels.items()}
    for trend in model.trends:
        try:
            trend_torque(model.robot, model.effects, [trend], processed.motion[:2], some)
        except EffectError as error:
            texts.append(f"{processed.source}: {error}; without it all is taken as {trend.effect.moment}")
        else:
            found.append(trend)
    return found, texts


def _free(processed: ProcessedRecording) -> NDArray[np.bool_]:
    """(N,) where no external force acts nearby."""
    pushed = np.any(processed.channels["external_force"] != 0.0, axis=1)
    reach = int(np.ceil(AFTER_FORCE / processed.interval))
    return ~np.asarray(binary_dilation(pushed, iterations=reach), dtype=bool)
