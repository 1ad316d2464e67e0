"""What processing makes of a recording."""

from collections.abc import Mapping
from dataclasses import dataclass

from sea_ident._typing import FloatArray
from sea_ident.motion import Motion
from sea_ident.processing.doubt import Doubt
from sea_ident.processing.encoder_steps import EncoderSteps
from sea_ident.recordings import Recording


@dataclass(frozen=True, eq=False)
class ProcessedRecording:
    """Motion with analytic derivatives, motor torque and its variance, averaged over the periods.

    Attributes:
        source: where the recording came from.
        joint_names: (n,) joints, in the order of the robot.
        motion: (N, n) mean motion over one period; the whole filtered recording where it is not periodic.
        tau_motor: (N, n) mean motor torque at the joint side, efficiency applied [N m] or [N].
        tau_variance: (N, n) variance of the torque of ONE period at every sample, smoothed over about half a second
            of phase [(N m)^2] (paper, eq. 20). That of the mean is smaller by `periods`.
        raw_tau_variance: (N, n) the same without smoothing; equal to `tau_variance` where one period stands alone.
        periods: number P of periods that were averaged; 1 where the recording is not periodic.
        period: length of a period [s], None where the recording is not periodic.
        period_motions: (P,) motion of every period, filtered as the mean; empty where only one is there.
        period_tau_motor: (P, N, n) motor torque of every period [N m] or [N].
        channels: further signals (N, n) by kind, averaged alike: current, tau_spring, temperature, ...; `deflection` is
            theta - q as it was measured, without the Fourier fit.
        places: (P,) number of every period in the recording, from 0: some may have been left out between others.
        link_harmonics: harmonics kept in q, 0 where the recording is not periodic.
        motor_harmonics: harmonics kept in theta, 0 where the recording is not periodic.
        encoder_steps: steps of encoders that do not average out, None where all do.
        extent: times of the first and the last sample that periods were cut from, where the robot rests before or after
            [s]; None where the whole recording was used.
        notes: what was done.
        warnings: what a user should know before trusting the result.
        doubts: those of the warnings that what is concluded depends on.
    """

    source: str
    joint_names: tuple[str, ...]
    motion: Motion
    tau_motor: FloatArray
    tau_variance: FloatArray
    raw_tau_variance: FloatArray
    periods: int
    period: float | None
    period_motions: tuple[Motion, ...]
    period_tau_motor: FloatArray
    channels: Mapping[str, FloatArray]
    places: tuple[int, ...]
    link_harmonics: int
    motor_harmonics: int
    encoder_steps: EncoderSteps | None = None
    extent: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()

    @property
    def samples(self) -> int:
        """Number of samples N of the mean motion."""
        return len(self.motion)

    @property
    def interval(self) -> float:
        """Time between two samples [s]."""
        time = self.motion.time
        return float((time[-1] - time[0]) / (len(time) - 1))

    @property
    def periodic(self) -> bool:
        """Whether the recording was cut into periods."""
        return self.period is not None

    def used_of(self, recording: "Recording | ProcessedRecording") -> "Recording | ProcessedRecording":
        """The part of the recording it comes from that periods were cut from: they are the last ones of it."""
        if self.extent is None or isinstance(recording, ProcessedRecording):
            return recording
        return recording.crop(*self.extent)

    def summary(self) -> str:
        """What came out, in a few lines."""
        if self.period is None:
            head = f"{self.source}: not periodic, {self.samples} samples, zero-phase filtered"
        else:
            head = (
                f"{self.source}: {self.periods} periods of {self.period:g} s, {self.samples} samples each; "
                f"{self.link_harmonics} harmonics of q, {self.motor_harmonics} of theta"
            )
        lines = [head]
        for i, name in enumerate(self.joint_names):
            spread = float(self.tau_variance[:, i].mean()) ** 0.5
            lines.append(
                f"  {name}: torque {self.tau_motor[:, i].min():.4g} .. {self.tau_motor[:, i].max():.4g}, "
                f"scatter between periods {spread:.3g}"
            )
        lines.extend(f"  note: {text}" for text in self.notes)
        lines.extend(f"  warning: {text}" for text in self.warnings)
        return "\n".join(lines)
