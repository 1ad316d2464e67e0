"""What becomes of a design for theta = q when its motors play it and the links follow on their springs."""

from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.elastic_limits import ElasticLimits
from sea_ident.excitation.elastic_response import Springs
from sea_ident.excitation.links_ascent import keep_links_inside
from sea_ident.excitation.problem import Problem
from sea_ident.robot import Robot

NEAR = 0.6
"""Part of the lowest frequency of the links on their springs from which on a harmonic makes them swing: an undamped one
then follows with 1.6 times the amplitude."""

FAR_BEYOND = 0.2
"""Part of the range of a limit by which links that leave it are kept inside though they do not swing."""

# limits that a note names, and the part of its range by which links on stiff springs may leave a limit untold
_NAMED = 6
_UNTOLD = 0.01


@dataclass(frozen=True)
class LinksInside:
    """Ask for a design whose limits hold where the links go on their springs.

    Attributes:
        reserve: part of the limits on motion and torque that is left free, for what a controller, or springs other than
            those of the description, add [-].
    """

    reserve: float = 0.05

    def __post_init__(self) -> None:
        if not 0.0 <= self.reserve < 1.0:
            raise ExcitationError(f"the reserve of the limits is {self.reserve}; it must be from 0 to below 1")


@dataclass(frozen=True)
class LinksAsPlanned:
    """Ask for a design for theta = q: a controller moves the links themselves along the trajectory.

    Where the springs would take them while the motors play it is then not computed.
    """


@dataclass(frozen=True, eq=False)
class OnSprings:
    """A design, and where its links go on their springs.

    Attributes:
        coefficients: (n, 2 L + 1) of the motors.
        margins: smallest distance of the links to every limit; empty where no spring is known or no response was found.
        kept: margins of motors and links together where links were kept inside, else empty.
        beyond: what is to be said of limits that the links leave; empty if there are none.
    """

    coefficients: FloatArray
    margins: dict[str, float]
    kept: dict[str, float]
    beyond: str


def check_stiffness(robot: Robot) -> None:
    """Refuse to keep links inside whose springs are not known.

    Raises:
        ExcitationError: no spring, or one of unknown stiffness.
    """
    unknown = [
        robot.joint_names[int(i)]
        for i in robot.elastic_indices
        if not robot.spring(robot.joint_names[int(i)]).stiffness
    ]
    if unknown:
        raise ExcitationError(
            f"where the links of {', '.join(unknown)} go on their springs takes a stiffness; give it in the annotation "
            f"(stiffness=...)"
        )
    if not len(robot.elastic_indices):
        raise ExcitationError(f"{robot.name} has no elastic joint; leave out links=LinksInside()")


def look_at_links(
    problem: Problem,
    coefficients: FloatArray,
    wanted: LinksInside | LinksAsPlanned | None,
    notes: list[str],
    *,
    hurry: bool,
) -> OnSprings:
    """Find out where links go on their springs, and keep them inside where that is asked for or they would swing.

    Args:
        problem: what was raised, inside what.
        coefficients: (n, 2 L + 1) design, inside for theta = q.
        wanted: asks for links that are kept inside in any case, or that go where they are planned.
        notes: a change of the design, or that none was found, is added here.
        hurry: whether a change is to take as little time as it can.
    """
    springs = Springs.of(problem.robot, problem.model.springs)
    if isinstance(wanted, LinksAsPlanned) or not len(springs.joints):
        return OnSprings(coefficients, {}, {}, "")
    limits = ElasticLimits(springs, problem.limits, problem.dynamic, problem.space)
    lowest = springs.lowest_frequency(problem.centre[:, -1])
    highest = problem.harmonics * problem.base_frequency
    chosen: FloatArray | None = coefficients
    why = ""
    if highest > NEAR * lowest:
        why = (
            f"harmonics up to {highest:.4g} Hz come near the {lowest:.4g} Hz at which links swing on their springs: "
            "the trajectory"
        )
    elif wanted is None:
        planned = limits.margins(problem.series(coefficients))
        if planned is not None and float((planned / limits.sizes).min(initial=0.0)) < -FAR_BEYOND:
            why = f"of the trajectory for links that go with their motors, {_beyond(limits, planned, _UNTOLD)}: this"
    looked_after = wanted is not None or bool(why)
    if looked_after:
        inner = limits.tightened((wanted or LinksInside()).reserve)
        chosen = keep_links_inside(problem, inner, coefficients, hurry=hurry)
        if chosen is not None and chosen is not coefficients and wanted is None:
            notes.append(
                f"{why} is one with which the links stay inside the limits, and tells less "
                f"({problem.reported(chosen):.4g} instead of {problem.reported(coefficients):.4g}); fewer harmonics or "
                f"a lower base frequency may tell more. What a controller misses makes links swing too: a reserve "
                f"above {LinksInside().reserve:g} (links=LinksInside(reserve=...), --links-inside) leaves room for it. "
                "With a controller that moves the links themselves, links=LinksAsPlanned() (--links-as-planned)"
            )
    series = problem.series(coefficients if chosen is None else chosen)
    margins = limits.margins(series)
    if margins is None:
        notes.append(
            "where the springs take the links was not found; simulate the motion before it is played, or take fewer "
            "harmonics"
        )
        return OnSprings(series.coefficients, {}, {}, "")
    told = dict(zip(limits.names, margins.tolist(), strict=True))
    if chosen is None:
        beyond = _beyond(limits, margins, 0.0)
        notes.append(
            f"no trajectory was found with which the links stay inside all limits; {beyond}. Take wider limits, fewer "
            f"harmonics, a lower base frequency or stiffer springs"
        )
        return OnSprings(series.coefficients, told, {}, "")
    if looked_after:
        motors = dict(zip(problem.limits.names, problem.limits.margins(series).tolist(), strict=True))
        kept = {name: min(value, motors.get(name, value)) for name, value in told.items()}
        return OnSprings(series.coefficients, told, kept, "")
    beyond = _beyond(limits, margins, _UNTOLD)
    if beyond:
        beyond += (
            "; links=LinksInside() (--links-inside 0.05) keeps them inside, and so does a controller that moves the "
            "links themselves along the trajectory (links=LinksAsPlanned(), --links-as-planned)"
        )
    return OnSprings(series.coefficients, told, {}, beyond)


def _beyond(limits: ElasticLimits, margins: FloatArray, untold: float) -> str:
    """Which limits the links leave by more than a part of their range, the furthest first; empty if none."""
    lower = np.concatenate([limits.linear.lower, -limits.dynamic.bound, limits.space.lower])
    upper = np.concatenate([limits.linear.upper, limits.dynamic.bound, limits.space.upper])
    share = margins / limits.sizes
    told = [
        f"{limits.names[k]} by {-margins[k]:.3g} {limits.units[k]} (limits {lower[k]:.4g} to {upper[k]:.4g})"
        for k in np.argsort(share, kind="stable")
        if share[k] < -untold
    ]
    if len(told) > _NAMED:
        told[_NAMED:] = [f"{len(told) - _NAMED} more"]
    return f"played by the motors, the springs take the links beyond {', '.join(told)}" if told else ""
