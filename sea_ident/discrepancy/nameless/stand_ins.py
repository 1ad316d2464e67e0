"""Effects that were found without what makes them what they are: then they stand in for something else.

Where the true effect is not in the library, the nearest that is there bends to it, and often fits well. It then has
parameters that its own cause could not have:

- A ripple of which the motion sees but a part ends as a wave much longer than a turn of the joint, though nothing in a
  joint turns so slowly. Where a motion does not show the length of a wave such a length says nothing, and the wave
  fits; where something is left beside it, the length is what came nearest to something else.
- The longest wave, with its zero where the encoder has its own, is a straight line: what grows evenly along the path,
  or is measured with another scale.
- Friction of a link that is viscous alone, without any dry friction of the bearings and seals that it is in, is what an
  encoder does that is late. A damper fits; where something is left, it is none.
- A parallel spring without stiffness is a constant torque.
- A play that is closed and whose spring is not the one that it is in carries torque where it should carry none: that is
  a spring with another law.
"""

from dataclasses import dataclass

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import never_closed, slowest
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.nameless.unnamed import Unnamed
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Effect
from sea_ident.effects.backlash import Backlash
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.effects.parallel_spring import ParallelSpring
from sea_ident.effects.torque_ripple import TorqueRipple
from sea_ident.robot import Robot

NO_DRY_FRICTION = 0.01
"""Share of the power of a friction up to which it has no dry part [-]: a tenth of its torque."""

ANOTHER = 0.25
"""Share of the stiffness of a spring by which that of a play in it may differ: other effects bend the two [-], ..."""

CERTAIN = 5.0
"""... and standard deviations of the difference."""

NOTHING = 3.0
"""Standard deviations within which a parameter is nothing."""

NO_SPRING = 0.2
"""Share of the torque of a spring (rms) below which the part that changes is, at most, where it is but a constant."""


@dataclass(frozen=True)
class StandIn(Unnamed):
    """An effect that was found, and that is not what its name says."""

    @property
    def sentence(self) -> str:
        """What it is not."""
        return f"The {self.effect} at {self.joint} came out {self.relative}, so it stands in for something else."


def stand_ins(bench: Bench, selection: Selection) -> tuple[StandIn, ...]:
    """Effects that were found without what makes them what they are.

    Args:
        bench: the recording.
        selection: what was found.

    Returns:
        One entry for every such effect.
    """
    fit, found = selection.final.fit, []
    fits = not selection.added or lack_of_fit(bench, selection.final)[2] >= LACK_LEVEL
    for position in range(len(fit.effects) - selection.added, len(fit.effects)):
        effect, words = fit.effects[position], ""
        if isinstance(effect, ParallelSpring) and _is_constant(bench, fit, position, effect):
            words = "without any stiffness"
        elif slowest(effect) and not fits:
            words = too_slow(bench.robot, effect)
        elif isinstance(effect, TorqueRipple) and _is_line(bench, fit, position, effect):
            words = (
                "as a straight line through the zero of the joint, as a wrong gear ratio, an encoder of another scale "
                "or a spring beside the motor makes it"
            )
        elif isinstance(effect, LinkFriction) and not fits and _is_viscous(bench, fit, position):
            words = "as viscous alone, as if its encoder were late, and leaves more than noise"
        elif isinstance(effect, Backlash) and not never_closed(bench, fit.effects, position):
            words = _in_another_spring(bench, fit, position, effect)
        if words:
            found.append(StandIn(effect.name, effect.joint, words, 1.0, fit.solution))
    return tuple(found)


def too_slow(robot: Robot, effect: Effect) -> str:
    """How the longest wave that there is came out, in words; a slide has no turns."""
    if effect.joint is not None and robot.joints[robot.index(effect.joint)].prismatic:
        return "as hardly more than a straight line over the way of the joint"
    return "as less than a wave in a turn of the joint, and nothing in it turns so slowly"


def _is_line(bench: Bench, fit: Fit, position: int, ripple: TorqueRipple) -> bool:
    """Whether less than a wave in a turn has a sine alone: one of any cause is zero elsewhere than its encoder is."""
    if ripple.order >= 2.0 * ripple.least:  # the least that counts is half a wave in a turn
        return False
    index = sum(bench.counts(fit.effects)[:position]) + 1
    return bool(abs(fit.values[index]) < NOTHING * fit.std(index))


def _is_constant(bench: Bench, fit: Fit, position: int, spring: ParallelSpring) -> bool:
    """Whether a spring has no stiffness as far as the data tell, and would show one that made it more than a constant.

    Where the joint moves next to nothing, any stiffness is zero within its uncertainty.
    """
    first = sum(bench.counts(fit.effects)[:position])
    stiffness, std, i = fit.values[first], fit.std(first), bench.robot.index(spring.required_joint)
    if not abs(stiffness) < NOTHING * std:
        return False
    state = bench.state(fit.effects)
    columns = spring.evaluate(state).link[:, i]
    whole = columns @ fit.values[first : first + columns.shape[1]]
    most = (abs(stiffness) + NOTHING * std) * float(np.std(columns[:, 0]))
    return bool(most < NO_SPRING * np.sqrt(np.mean(whole**2)))


def _in_another_spring(bench: Bench, fit: Fit, position: int, play: Backlash) -> str:
    """The stiffness of a play where it is not that of the spring that it is in, in words."""
    names = [column.name for column in fit.columns]
    spring = f"{play.joint}.spring_stiffness"
    if spring not in names:
        return ""
    own, whole = sum(bench.counts(fit.effects)[:position]), names.index(spring)
    taken, stiffness = float(fit.values[own]), float(fit.values[whole])
    std = float(np.linalg.norm(fit.covariance_factor[own] - fit.covariance_factor[whole]))
    if abs(taken - stiffness) < max(ANOTHER * stiffness, CERTAIN * std):
        return ""
    unit = fit.columns[own].unit
    return (
        f"in a spring of {stiffness:.4g} {unit} with {taken:.4g} {unit}, where a play takes up just what its spring has"
    )


def _is_viscous(bench: Bench, fit: Fit, position: int) -> bool:
    """Whether nearly all power of a friction is in its viscous part, the first of its columns."""
    start, effect = sum(bench.counts(fit.effects)[:position]), fit.effects[position]
    spectra = bench.column_spectra(effect, fit.effects)
    power = np.sum(np.abs(spectra * fit.values[start : start + spectra.shape[2]]) ** 2, axis=(0, 1))
    return bool(np.sum(power[1:]) < NO_DRY_FRICTION * np.sum(power))
