"""What is known of a spring."""

from dataclasses import dataclass
from enum import StrEnum

from sea_ident.effects import Effect
from sea_ident.estimation.uncertainty import student_factor
from sea_ident.plain import plain


@dataclass(frozen=True)
class SpringTerm:
    """An effect in a spring beyond its law: hysteresis, play, an offset.

    Attributes:
        effect: the effect, with its shape.
        values: (k,) values of its columns.
        stds: (k,) their standard deviations, its shape held.
        by_rest: whether only where it is at rest tells some of it from the law of the spring, as of dry friction that
            never slips: the standard deviations of both count all of that.
    """

    effect: Effect
    values: tuple[float, ...]
    stds: tuple[float, ...]
    by_rest: bool = False


@dataclass(frozen=True)
class SpringLack:
    """What would take most of what the law of a spring leaves beyond noise.

    It need not be what is missing: others have the same form. How far the law is from its own beside it is counted in
    the standard deviations.

    Attributes:
        effects: names of effects at the joint, what takes the most first.
        rms_residual: of the spring torque beside them [N m] or [N].
        stiffness: K1 beside them [N m/rad] or [N/m].
    """

    effects: tuple[str, ...]
    rms_residual: float
    stiffness: float


class Verdict(StrEnum):
    """What the data say about the law of a spring."""

    LINEAR = "linear"
    STIFFENING = "stiffening"
    HYSTERETIC = "hysteretic"
    NOT_EXCITED = "not_excited"
    CIRCULAR = "circular"


@dataclass(frozen=True)
class SpringResult:
    """Spring of one joint: ``tau = K1 d + K3 d^3 + D d'`` with d = theta - q (paper, eq. 21).

    Values and standard deviations are those of the full law whatever the verdict, so that the intervals mean what they
    say; `law` gives the values that the data support.

    Attributes:
        joint: its joint.
        stiffness: K1 [N m/rad].
        stiffness_std: [N m/rad].
        cubic_stiffness: K3 [N m/rad3].
        cubic_stiffness_std: [N m/rad3].
        damping: D [N m s/rad].
        damping_std: [N m s/rad].
        verdict: which terms held-out data support.
        covariance: (3, 3) of K1, K3, D, with the uncertainty of the dynamic model in it.
        degrees_of_freedom: of the variances.
        linear_stiffness: K1 of the law without K3 [N m/rad].
        linear_damping: D of the law without K3 [N m s/rad].
        zero: difference of the zeros of theta and q that was fitted [rad]; 0 where both were taken as known.
        rms_residual: of the spring torque [N m].
        rms_torque: of the spring torque itself [N m].
        largest_deflection: [rad].
        held_out: rms on held-out pieces of the period by law [N m].
        note: reason of the verdict, in words.
        terms: further effects in the spring, fitted together with the law.
        full_covariance: (3 + k, 3 + k) of K1, K3, D and the values of all terms; empty without terms.
        noise: rms of the noise of the mean spring torque less the law, by the scatter of the periods; None without
            periods [N m] or [N].
        misfit: (3, 3) part of `covariance` that counts what the law leaves beyond its noise: as random, and how far off
            what would take most of it puts the law; empty where it leaves no more than noise.
        lack: what would take most of that; None where nothing simple does, or nothing is left.
    """

    joint: str
    stiffness: float
    stiffness_std: float
    cubic_stiffness: float
    cubic_stiffness_std: float
    damping: float
    damping_std: float
    verdict: Verdict
    covariance: tuple[tuple[float, ...], ...]
    degrees_of_freedom: float
    linear_stiffness: float
    linear_damping: float
    zero: float
    rms_residual: float
    rms_torque: float
    largest_deflection: float
    held_out: dict[str, float]
    note: str
    terms: tuple[SpringTerm, ...] = ()
    full_covariance: tuple[tuple[float, ...], ...] = ()
    noise: float | None = None
    misfit: tuple[tuple[float, ...], ...] = ()
    lack: SpringLack | None = None

    @property
    def law(self) -> tuple[float, float, float]:
        """K1, K3, D that the data support: K3 is zero unless it is supported.

        Beside other terms all three are as they were fitted together with them.
        """
        if self.verdict is Verdict.LINEAR and not self.terms:
            return self.linear_stiffness, 0.0, max(self.linear_damping, 0.0)
        return self.stiffness, self.cubic_stiffness, max(self.damping, 0.0)

    @property
    def stiffness_noise_std(self) -> float:
        """Standard deviation of K1 by noise alone, without what the law lacks [N m/rad]."""
        own = self.covariance[0][0] - (self.misfit[0][0] if self.misfit else 0.0)
        return float(max(own, 0.0) ** 0.5)

    def half_width(self, level: float = 0.95) -> tuple[float, float, float]:
        """Half widths of the intervals of K1, K3, D."""
        factor = student_factor(self.degrees_of_freedom, level)
        return factor * self.stiffness_std, factor * self.cubic_stiffness_std, factor * self.damping_std

    def summary(self) -> str:
        """One line."""
        more = "".join(
            f", {term.effect.name} "
            + " ".join(f"{v:.4g} +- {s:.2g}" for v, s in zip(term.values, term.stds, strict=True))
            for term in self.terms
        )
        supported = ""
        if self.verdict is Verdict.LINEAR and not self.terms:
            stiffness, _, damping = self.law
            supported = f" (K1 {stiffness:.5g}, D {damping:.4g} without K3)"
        return (
            f"{self.joint}: K1 {self.stiffness:.5g} +- {self.stiffness_std:.2g}, K3 {self.cubic_stiffness:.4g} +- "
            f"{self.cubic_stiffness_std:.2g}, D {self.damping:.4g} +- {self.damping_std:.2g}{more}; "
            f"{self.verdict}{supported}: {self.note}"
        )

    def doubt(self) -> str | None:
        """A sentence where the law leaves more than noise; None where it does not.

        The torque is that of the dynamic model: where this lacks something, the law cannot fit either.
        """
        if not self.misfit or self.noise is None:
            return None
        times = self.rms_residual / max(self.noise, 1e-300)
        counted = "Standard deviations count this as random"
        if self.lack is not None:
            counted = (
                f"Beside something of the form of {' and '.join(self.lack.effects)} it would leave "
                f"{self.lack.rms_residual:.3g}, and its stiffness be {self.lack.stiffness:.4g} instead of "
                f"{self.stiffness:.4g}: standard deviations count how far that is"
            )
        return (
            f"spring of {self.joint}: its law leaves {plain(times)} times the noise of its torque "
            f"({self.rms_residual:.3g} of {self.rms_torque:.3g}): it lacks something, or the dynamic model that gives "
            f"this torque does. {counted}; diagnose tells what it is"
        )
