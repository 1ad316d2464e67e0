"""Springs on a recording that was not used to find them: their law beside the torque that the dynamic model gives."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.effects import JointEffect, corrected_motion
from sea_ident.estimation.observations import Observations, SpringSide
from sea_ident.estimation.spring_result import SpringResult, Verdict
from sea_ident.estimation.springs import spring_columns
from sea_ident.motion import Motion
from sea_ident.plain import plain
from sea_ident.processing.doubt import DoubtKind, texts_of

WRONG = 0.1
"""Share of the torque of a spring that its law leaves from which on a user is warned [-], ..."""

BEYOND_NOISE = 3.0
"""... where that is so many times its noise."""

ALREADY = 0.5
"""Part of what a law leaves that it left where it was found, from which on another recording is not to blame [-]."""


@dataclass(frozen=True)
class SpringAgreement:
    """The law of a spring on a recording.

    Attributes:
        joint: its joint.
        rms: of its torque by the dynamic model less that by its law [N m] or [N].
        noise_std: standard deviation of the noise of that difference by the scatter of the periods; None without
            periods [N m] or [N].
        rms_torque: of its torque by the dynamic model [N m] or [N].
        unit: of these.
        warning: what a user should know; empty where the law holds.
    """

    joint: str
    rms: float
    noise_std: float | None
    rms_torque: float
    unit: str
    warning: str = ""

    @property
    def nrms(self) -> float:
        """`rms` over `rms_torque` [-]."""
        return self.rms / self.rms_torque if self.rms_torque > 0.0 else float("inf")

    def summary(self) -> str:
        """One line."""
        noise = "" if self.noise_std is None else f", noise {self.noise_std:.3g}"
        return (
            f"spring of {self.joint} [{self.unit}]: rms {self.rms:.4g} of {self.rms_torque:.4g} "
            f"({100 * self.nrms:.2f} %){noise}"
        )

    def to_dict(self) -> dict[str, float | None]:
        """rms, noise_std, rms_torque and nrms, for `sea-ident validate --json`."""
        nrms = self.nrms if np.isfinite(self.nrms) else None
        return {"rms": self.rms, "noise_std": self.noise_std, "rms_torque": self.rms_torque, "nrms": nrms}


def spring_agreement(
    observations: Observations, values: FloatArray, springs: Sequence[SpringResult], used: NDArray[np.bool_]
) -> tuple[SpringAgreement, ...]:
    """Compare every spring's law with the torque that the dynamic model gives the spring.

    Both are predictions of the model: what is wrong is the law, the zero of an encoder, or the dynamic model, which the
    motor torque tests by itself.

    Args:
        observations: the recording.
        values: (b,) base parameters.
        springs: their laws.
        used: (N,) samples that count.

    Returns:
        One for every spring with a law; none where the dynamic model does not tell the torque of springs.
    """
    robot, processed = observations.robot, observations.processed
    if observations.spring_side is SpringSide.NONE:
        return ()
    places = {int(joint): k for k, joint in enumerate(robot.elastic_indices)}

    def left(motion: Motion, torque: FloatArray) -> FloatArray:
        """(N, m) what the laws leave of the torques (N, m)."""
        seen, out = corrected_motion(robot, observations.effects, motion), torque.copy()
        for spring in springs:
            joint = robot.index(spring.joint)
            out[:, places[joint]] -= _by_law(spring, seen, joint)
        return out

    torque = observations.spring_torque(observations.mean, processed.tau_motor, values)
    mean = left(processed.motion, torque)[used]
    noise = None
    if processed.period_motions:
        each = [left(motion, own)[used] for motion, own in observations.spring_torque_of_periods(values)]
        noise = np.sqrt(np.var(each, axis=0, ddof=1).mean(axis=0) / len(each))
    found = []
    # what follows from positions in another unit is no fault of a spring
    doubted = texts_of(processed.doubts, DoubtKind.POSITION)
    for spring in springs:
        joint = robot.index(spring.joint)
        k = places[joint]
        plain = SpringAgreement(
            spring.joint,
            float(np.sqrt(np.mean(mean[:, k] ** 2))),
            None if noise is None else float(noise[k]),
            float(np.sqrt(np.mean(torque[used, k] ** 2))),
            robot.joints[joint].torque_unit,
        )
        before = spring.rms_residual / spring.rms_torque if spring.rms_torque > 0.0 else 0.0
        found.append(plain if doubted else _with_warning(plain, spring.verdict, before))
    return tuple(found)


def _by_law(spring: SpringResult, motion: Motion, joint: int) -> FloatArray:
    """(N,) torque of a spring by its law and what else was found in it."""
    inside = [(term.effect, term.values) for term in spring.terms if isinstance(term.effect, JointEffect)]
    columns = spring_columns(motion, joint, spring.zero, [effect for effect, _ in inside])
    torque: FloatArray = columns @ np.concatenate([spring.law, *(values for _, values in inside)])
    return torque


def _with_warning(found: SpringAgreement, verdict: Verdict, before: float = 0.0) -> SpringAgreement:
    """With what is to be said of it; `before` is the share that the law left where it was found [-]."""
    beyond = found.noise_std is None or found.rms > BEYOND_NOISE * found.noise_std
    if not (found.nrms > WRONG and beyond):
        return found
    why = "this motion may load it more than the one it was found on; record more of both"
    if before > max(WRONG, ALREADY * found.nrms):
        # on the same motion it would be so again: neither an encoder nor this motion has to differ
        why = (
            f"on the recording that it was found on it left {plain(100 * before, 3)} %: it lacks something, or the "
            "dynamic model that gives this torque does, or does not tell it; see the warnings of the model"
        )
    elif verdict is not Verdict.NOT_EXCITED:
        why = (
            "has an encoder another zero than before, or the spring a part that the first motion did not show? "
            "`diagnose` looks for it"
        )
    text = (
        f"the law of the spring of {found.joint!r} leaves {plain(100 * found.nrms, 3)} % of its torque "
        f"({found.rms:.3g} of {found.rms_torque:.3g} {found.unit} rms): {why}"
    )
    return replace(found, warning=text)
