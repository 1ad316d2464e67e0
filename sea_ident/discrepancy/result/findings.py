"""The parts of a diagnosis."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from sea_ident._typing import FloatArray
from sea_ident.atomic import atomic_file
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.effects import Effect
from sea_ident.effects.base import titled
from sea_ident.effects.signal import SignalEffect
from sea_ident.plain import plain


class Verdict(StrEnum):
    """The outcome in a word."""

    NONE = "none"
    NAMED = "named"
    NAMED_WITH_REMAINDER = "named_with_remainder"
    AMBIGUOUS = "ambiguous"
    SUSPECT = "suspect"
    NOT_IN_LIBRARY = "not_in_library"
    ONLY_AGAINST_REFERENCE = "only_against_reference"
    CANNOT_TELL = "cannot_tell"


SMALLEST = 1e-300
"""Probability that is not told from zero."""


def chance(p_value: float) -> str:
    """A probability, to be read behind the letter p."""
    return f"= {p_value:.2g}" if p_value > SMALLEST else f"< {SMALLEST:g}"


@dataclass(frozen=True)
class LackOfFit:
    """Whether the model leaves more than noise.

    Attributes:
        statistic: weighted sum of squares of the mean residual.
        dof: its degrees of freedom.
        p_value: probability of as much by noise alone.
        trend_p_value: the same for a trend over the periods.
        per_joint: statistic over degrees of freedom by joint and equation, 1 for noise alone.
        remainder: share of the torque that the noise floor had to be raised by for the final model [-].
    """

    statistic: float
    dof: int
    p_value: float
    trend_p_value: float
    per_joint: Mapping[str, Mapping[str, float]]
    remainder: float = 0.0


@dataclass(frozen=True)
class Location:
    """A part of the motion in which model and data disagree.

    Attributes:
        joint: the joint.
        equation: motor, link, sum, or spring where both change with opposite signs.
        regime: which samples.
        excess_rms: rms beyond the noise [N m].
        z: how many standard deviations of the noise.
    """

    joint: str
    equation: str
    regime: str
    excess_rms: float
    z: float


@dataclass(frozen=True)
class MissingParameter:
    """A parameter of an effect that is missing.

    Attributes:
        name: name.
        value: value.
        std: standard deviation; 0 of what was held, as the time constant of a drift that goes straight on.
        unit: unit.
    """

    name: str
    value: float
    std: float
    unit: str

    @property
    def straight(self) -> bool:
        """Whether it is the time constant of a drift that goes straight on: it stands for that, and is no time."""
        return not self.std and self.name.endswith("_drift_time_constant")

    def __str__(self) -> str:
        """Name, value with its standard deviation or that it was held, unit; of a straight course that it is one."""
        if self.straight:
            return f"{self.name} none: the course is straight"
        value = f"{self.value:.4g}"
        sure = f"{value} +- {self.std:.2g}{self._unit}" if self.std else f"{value}{self._unit}, held"
        return f"{self.name} {sure}"

    @property
    def amount(self) -> str:
        """Value with its unit."""
        return f"{self.value:.2g}{self._unit}"

    @property
    def _unit(self) -> str:
        """Unit behind a value; a number without one has nothing behind it."""
        return "" if self.unit in ("-", "1") else f" {self.unit}"


@dataclass(frozen=True)
class Alternative:
    """What an effect could be taken for.

    Attributes:
        effect: name.
        joint: joint.
        cos2: share of the effect that it would explain as well [-].
        fit: the whole model with it in the place of the effect, where that was fitted; not written to files.
        dearer: whether it does as well by more parameters only: then it is what is missing where another motion says
            so, and no alternative where none does; not written to files.
        behind: how much more of the statistic it leaves, and costs by its parameters, where it does not do as well;
            not so much that another motion could not outweigh it: where one does, it is an alternative, or what is
            missing. 0 where it does as well; not written to files.
    """

    effect: str
    joint: str | None
    cos2: float
    fit: Fit | None = field(default=None, compare=False, repr=False)
    dearer: bool = field(default=False, compare=False, repr=False)
    behind: float = field(default=0.0, compare=False, repr=False)

    @property
    def title(self) -> str:
        """Name and joint."""
        return titled(self.effect, self.joint)

    @property
    def as_likely(self) -> bool:
        """Whether it is an alternative where no other motion speaks."""
        return not self.dearer and self.behind == 0.0


@dataclass(frozen=True)
class Unseen:
    """What may be beside an effect at its joint and would hardly show there.

    Attributes:
        effect: name.
        joint: joint.
        parameters: those of the effect that are known much less with it there, with their standard deviations then.
    """

    effect: str
    joint: str | None
    parameters: tuple[MissingParameter, ...]

    @property
    def title(self) -> str:
        """Name and joint."""
        return titled(self.effect, self.joint)

    def __str__(self) -> str:
        """What it is, and how well the parameters are known with it there."""
        known = ", ".join(map(str, self.parameters))
        return f"known so well only without {self.title}, which would hardly show beside it: with one, {known}"


TIMES = 1.0
"""Share of the torque from which on an effect is said to be so many times the torque [-]."""


@dataclass(frozen=True)
class MissingEffect:
    """An effect that the model lacks.

    Attributes:
        effect: name.
        joint: joint.
        parameters: columns and shapes.
        torque_share: rms of its torque over that of the motor [-].
        p_value: probability of finding as much where nothing is missing.
        alternatives: effects that explain the data as well.
        transfer: share of what it explains on the held-out data that it explains with its parameters as they are;
            None where that was not tested.
        detail: the effect itself, with its shape.
        values: values of its columns.
        unseen: what may be beside it and make its parameters others, None where nothing would.
    """

    effect: str
    joint: str | None
    parameters: tuple[MissingParameter, ...]
    torque_share: float
    p_value: float
    alternatives: tuple[Alternative, ...]
    transfer: float | None = None
    detail: Effect | None = None
    values: tuple[float, ...] = ()
    unseen: Unseen | None = None

    @property
    def title(self) -> str:
        """Name and joint; with what tells it from another of its kind at the joint."""
        if self.detail is not None:
            return self.detail.title
        return titled(self.effect, self.joint)

    @property
    def extent(self) -> str:
        """How much there is of it: its amounts where it acts on what is measured, the torque of all others."""
        if isinstance(self.detail, SignalEffect) and self.parameters:
            return ", ".join(p.amount for p in self.parameters)
        if self.torque_share >= TIMES:
            # a term of the law of a spring may be cancelled by others of it
            return f"{plain(self.torque_share)} times the torque"
        return f"{plain(100 * self.torque_share)} % of torque"


@dataclass(frozen=True)
class Detectability:
    """What could have been seen of an effect.

    Attributes:
        effect: name.
        joint: joint.
        smallest: smallest value that would stand out of the noise and of the scatter of the passes 19 times out of 20
            and matter to the torque; a name may ask for twice as much, for it must hold on other data, too.
        unit: its unit.
        absorbed: share of the effect that the other parameters absorb [-].
        confusable_with: effects (`name` or `name at joint`) that look like it in this motion.
        shapes: name, value and unit of the nonlinear parameters that it has there; of others the smallest differs.
        title: name and joint, for people, and what tells it from another of its kind there; these two alone if empty.
    """

    effect: str
    joint: str | None
    smallest: float
    unit: str
    absorbed: float
    confusable_with: tuple[str, ...]
    shapes: tuple[tuple[str, float, str], ...] = ()
    title: str = ""

    @property
    def kind(self) -> str:
        """Name, with what tells it from another of its kind at its joint."""
        return self.title.replace(f" at {self.joint}", "", 1) or self.effect


@dataclass(frozen=True, eq=False)
class NextExperiment:
    """An experiment that tells two effects apart.

    Attributes:
        separates: the two, as `name at joint`.
        excitation: what `Excitation.to_dict` gives.
        gain: how much more of one lies outside the span of the other than in the present motion [-].
    """

    separates: tuple[str, str]
    excitation: Mapping[str, Any]
    gain: float

    def save(self, path: str | Path) -> None:
        """Write the excitation as `excite` does; `read_excitation` reads it.

        Raises:
            OutputError: the file cannot be written.
        """
        with atomic_file(path) as temporary:
            temporary.write_text(json.dumps(dict(self.excitation), indent=1, allow_nan=False) + "\n", encoding="utf-8")


@dataclass(frozen=True, eq=False)
class Waveforms:
    """Mean residuals over a period, for pictures.

    Attributes:
        time: (N,) [s].
        equations: (E,) labels `joint motor`, `joint link`, `joint sum`.
        before: (N, E) residual of the refitted model [N m].
        after: (N, E) residual with the effects [N m].
        noise: (E,) rms of the noise [N m].
        q: (N, n) link positions [rad].
        dtheta: (N, n) motor velocities [rad/s].
        deflection: (N, n) [rad].
        explained: (N, E) torque of each missing effect, by its label [N m].
        bands: (N, E) standard deviation of that torque, from the uncertainty of parameters and shapes [N m].
    """

    time: FloatArray
    equations: tuple[str, ...]
    before: FloatArray
    after: FloatArray
    noise: FloatArray
    q: FloatArray
    dtheta: FloatArray
    deflection: FloatArray
    explained: Mapping[str, FloatArray] = field(default_factory=dict)
    bands: Mapping[str, FloatArray] = field(default_factory=dict)
