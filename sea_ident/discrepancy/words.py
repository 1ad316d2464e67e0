"""A diagnosis in words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.bench.judge import FEWEST_TO_SEARCH
from sea_ident.discrepancy.bench.lack import LACK_LEVEL
from sea_ident.discrepancy.compared.heldout import Kind
from sea_ident.discrepancy.compared.reference import ParameterChange
from sea_ident.discrepancy.compared.transfer import TRANSFERS, TRANSFERS_ALONE
from sea_ident.discrepancy.evidence.foretold import Left
from sea_ident.discrepancy.measured.data import PeriodData
from sea_ident.discrepancy.measured.standing import Standing
from sea_ident.discrepancy.nameless.unnamed import Unnamed
from sea_ident.discrepancy.result.findings import MissingEffect, Verdict, chance
from sea_ident.discrepancy.search.breakaway import Breakaway
from sea_ident.discrepancy.trends.trend import TrendTest
from sea_ident.effects.base import titled
from sea_ident.robot import Robot

FEW_PERIODS = 10

STANDS_LONG = 0.1
"""Share of the samples of a joint that are not compared from which on a user is warned; usual are 2 to 6 % [-]."""

UNSOUND = "Something is wrong with this recording (the warnings say what), so that nothing can be concluded."
"""What is said of a recording that allows no conclusion."""


@dataclass(frozen=True, eq=False)
class Facts:
    """What the words are made of.

    Attributes:
        verdict: the outcome.
        missing: what is missing, the largest torque first.
        gap: on the recording.
        held: on held-out data.
        remainder: share of the torque that is left [-].
        periods: P.
        p_value: of the lack of fit.
        trend: comparison of periods.
        change: against a reference.
        units: unit of the torque of each joint.
        kind: what data were held out, None where none were.
        nameless: what explains the recording better in the place of an effect that was found, and has no name.
        sound: whether the recording allows a conclusion; warnings say why where it does not.
        standing: what is not compared beside reversals, at the joint where that is most.
        motors_too_fast: joints whose motors turn too fast for the samples to show a ripple of theirs.
        still: joints whose motors stand throughout.
        left_there: what the model leaves of the torque of a held-out recording, by joint, where that is much.
    """

    verdict: Verdict
    missing: tuple[MissingEffect, ...]
    gap: Gap
    held: Gap | None
    remainder: float
    periods: int
    p_value: float
    trend: TrendTest
    change: ParameterChange | None
    units: Mapping[str, str]
    kind: Kind | None = None
    nameless: tuple[Unnamed, ...] = ()
    sound: bool = True
    standing: Standing | None = None
    motors_too_fast: tuple[str, ...] = ()
    still: tuple[str, ...] = ()
    left_there: Mapping[str, Left] = field(default_factory=dict)

    @property
    def added(self) -> tuple[MissingEffect, ...]:
        """What is missing from the model, not from the reference alone."""
        return self.missing if self.change is None else tuple(m for m in self.missing if m not in self.change.missing)


def paragraph(facts: Facts) -> str:
    """One paragraph that a person can act on."""
    parts = [_opening(facts)]
    if facts.added and facts.verdict not in (Verdict.NONE, Verdict.CANNOT_TELL):
        drifting = {(t.effect.name, t.effect.joint) for t in facts.trend.trends}
        if all((m.effect, m.joint) in drifting for m in facts.added):
            parts.append("It shows in the comparison of the periods; the mean over all of them hides it.")
            if facts.held is not None and facts.held.shrink > 0.0:
                parts.append(_held_sentence(facts))
        else:
            parts.append(_gap_sentence(facts.gap, facts.units, [m.joint for m in facts.added if m.joint is not None]))
            if facts.held is not None:
                parts.append(_held_sentence(facts))
        if changed := [m for m in facts.missing if m not in facts.added]:
            parts.append(f"Against the reference, other parameters changed too: {_changed(changed)}.")
    if facts.remainder > 0.0 and facts.verdict is not Verdict.NONE:
        parts.append(f"A remainder of {_percent(facts.remainder)} of the torque has no name.")
    if facts.still:
        parts.append(f"{_still(facts)}.")
    elif facts.verdict is Verdict.NONE and facts.standing is not None and facts.standing.share > 0.0:
        parts.append(f"{_not_compared(facts, facts.standing)}.")
    parts.extend(f"{text}." for text in _left_there(facts))
    if facts.verdict in (Verdict.NONE, Verdict.NOT_IN_LIBRARY) and facts.motors_too_fast:
        parts.append(
            f"Ripple of the turns of the motor of {', '.join(facts.motors_too_fast)} is too fast for these samples and "
            "was not looked for; sample faster or move slower."
        )
    if facts.verdict is Verdict.SUSPECT:
        fully = "" if _part(facts) is None else " as well"
        parts.append(
            f"What explains this recording does not explain the held-out one{fully}: do not use it; excite more."
        )
    return " ".join(parts)


def slow_samples(data: PeriodData) -> str:
    """That samples in which a motor hardly moves were left out, and how many."""
    shares = data.left_out.mean(axis=0)
    worst = int(shares.argmax())
    equation = data.equations[worst]
    return (
        f"samples in which a joint hardly moves were left out, up to {shares[worst]:.0%} ({equation.kind} of "
        f"{equation.joint}): there friction follows from a velocity that is hardly more than its noise, and what is "
        "named does not explain them. Let the joints pass zero velocity faster"
    )


def fitted_zeros(robot: Robot, zeros: Mapping[str, float], held_out: Mapping[str, float]) -> list[str]:
    """With which zeros theta was read where the model does not know them.

    Args:
        robot: the robot.
        zeros: those of the recording, by joint [rad] or [m].
        held_out: those of the held-out recording.
    """
    found = []
    for joint, zero in zeros.items():
        unit = robot.joints[robot.index(joint)].position_unit
        there = f", on the held-out data {held_out[joint]:.4g} {unit}" if joint in held_out else ""
        found.append(
            f"theta_{joint} was read less {zero:.4g} {unit}{there}: the model was identified without knowing its zero, "
            "and every recording is read with its own. A constant torque in that spring would be taken for it"
        )
    return found


def told_by_the_other_motion(joint: str) -> str:
    """That what a spring with dry friction was told by are data that were to test it."""
    return (
        f"dry friction in the spring of {joint!r} is a constant torque on the recording: that it is none, and where it "
        "slips, was read from the motion that was held out. Test the repaired model on a third one"
    )


def at_rest(joint: str) -> str:
    """That a constant in a spring is where its dry friction rests."""
    return (
        f"the spring of {joint!r} has a constant torque beside its dry friction, which may rest anywhere, depending on "
        "how it was loaded before: the repaired model has it as spring_offset, and it is no effect of its own"
    )


def does_not_drift(effect: str, joint: str | None) -> str:
    """That what changes in the model does not do so in the recording."""
    title = titled(effect, joint)
    return (
        f"{title} of the model does not show in this recording, and is not in the repaired model: what warms up does "
        "so from a cold start, in many periods"
    )


def did_not_begin_anew(titles: Sequence[str], source: str) -> str:
    """That what drifts by time does not do so in another recording as it would had it begun there."""
    return (
        f"{' and '.join(titles)}: {source} did not begin where the recording did. What drifts by time is taken there "
        "as in the mean of the recording, and may be what is left of it. Begin both from the same state, as from cold"
    )


def on_the_centre(joint: str) -> str:
    """That how large a push is was told as if on the centre of mass."""
    return (
        f"external_force at {joint} is told as a force on the centre of mass of its link as described, for no other "
        "point fits clearly better: one that meets the link farther from the joint would be as much smaller"
    )


def stiction(found: Breakaway, unit: str) -> str:
    """That the passes show a motor to be let go later than it slides, and by how much."""
    return (
        f"stiction at {found.joint}: in {found.passes} passes friction lets the motor go only at "
        f"{found.excess:.3g} +- {found.std:.2g} {unit} above what it slides in"
    )


def _gap_sentence(gap: Gap, units: Mapping[str, str], named: Sequence[str] = ()) -> str:
    """The gap on the recording: at the joints of what is named, where there was one, and of these where it was largest.

    Where it is below the noise in every joint, what that means.
    """
    there = [joint for joint in gap.before if joint in named and gap.before[joint] > 0.0]
    worst = gap.largest_of(there) if there else gap.largest
    if gap.before[worst] <= 0.0:
        return (
            "It is smaller than the noise of the mean torque in every joint: the pattern over the period shows it, the "
            "size of the residual does not, and no prediction gets much better by it."
        )
    after, unit = gap.after[worst], units[worst]
    to = f"to {after:.3g} {unit}" if after > 0.0 else f"to nothing beyond the noise ({gap.noise[worst]:.2g} {unit})"
    where = ", where it was largest" + (" beside its noise" if gap.mixed else "") if worst == gap.largest else ""
    return f"With it the gap on this recording goes from {gap.before[worst]:.3g} {to} at {worst}{where}."


def _held_sentence(facts: Facts) -> str:
    """The gap on held-out data."""
    held = facts.held
    if held is None:
        return ""
    where = f"On {facts.kind}"
    weaker = "" if facts.kind is Kind.OTHER_MOTION else " (the same motion again, which is a weaker test)"
    if not any(value > 0.0 for value in held.before.values()):
        left = ", and is no longer" if held.opens else ""
        return f"{where}{weaker} the model was within the noise before already{left}."
    if held.shrink < 0.0:
        return f"{where}{weaker} the gap grows by {-100 * held.shrink:.0f} %."
    return f"{where}{weaker} the gap shrinks by {100 * held.shrink:.0f} %."


def reservations(facts: Facts) -> list[str]:
    """What to know before trusting the diagnosis."""
    found = []
    if facts.periods < FEWEST_TO_SEARCH:
        found.append(
            f"{facts.periods} periods only: how they scatter along what an effect does cannot be told, and nothing "
            f"finer than friction that the model does not have at all was looked for; record {FEW_PERIODS} or more"
        )
    elif facts.periods < FEW_PERIODS:
        found.append(
            f"{facts.periods} periods only: the noise floor is uncertain and small effects are not told from it; "
            f"record {FEW_PERIODS} or more"
        )
    if facts.added and facts.kind is Kind.SAME_MOTION:
        found.append(
            "the held-out recording repeats the motion of this one, which is weaker than another motion, as a wrong "
            "name repeats itself with the motion. Record another motion"
        )
    elif facts.added and facts.kind is Kind.OTHER_PERIODS:
        found.append(
            "no held-out motion was given: every other period of this one was held out, which is weaker, as a wrong "
            "name repeats itself in every period. Record another motion"
        )
    elif facts.added and facts.kind is None:
        found.append("no held-out motion was given: what is named was not tested on another motion")
    found.extend(f"{text}. Diagnose that one as well" for text in _left_there(facts))
    if facts.still:
        found.append(f"{_still(facts)}. Move every joint, or leave those out (joints, on the command line --joints)")
    elif facts.standing is not None and facts.standing.share > STANDS_LONG:
        found.append(f"{_not_compared(facts, facts.standing)}. Let the joint pass zero velocity faster")
    if any(
        {m.effect, *(a.effect for a in m.alternatives)} >= {"temperature_friction", "friction_drift"}
        for m in facts.missing
    ):
        found.append(
            "the temperature goes the way that a drift goes by itself: whether friction follows it or the time is not "
            "told. Record the same once more while it goes another way, as in cooling down"
        )
    found.extend(m.detail.reservation for m in facts.missing if m.detail is not None and m.detail.reservation)
    if facts.trend.unnamed:
        found.append("the periods show a trend that no effect of the library explains")
    return found


def _left_there(facts: Facts) -> list[str]:
    """What the model leaves of the held-out recording: where its parameters are as unsure there, and where not."""
    unsure = {joint: left for joint, left in facts.left_there.items() if left.as_unsure}
    wrong = {joint: left for joint, left in facts.left_there.items() if not left.as_unsure}
    found = []
    if wrong:
        found.append(
            f"On the recording that was held out the model leaves {_sizes(facts, wrong)}: that motion shows what this "
            "one does not, or something was changed between the two"
        )
    if unsure:
        least_known = ", ".join(dict.fromkeys(left.least_known for left in unsure.values()))
        found.append(
            f"On the recording that was held out the model leaves {_sizes(facts, unsure)}, which is no more than its "
            f"parameters are unsure by on that motion (most of all {least_known}): this one hardly tells them"
        )
    return found


def _sizes(facts: Facts, left: Mapping[str, Left]) -> str:
    """What is left by joint, and its share of the torque."""
    return ", ".join(
        f"{each.size:.3g} {facts.units[joint]} at {joint} ({_percent(each.share)} of the torque)"
        for joint, each in left.items()
    )


def _still(facts: Facts) -> str:
    """Which motors do not move, and what is not told for that."""
    motors = "motor" if len(facts.still) == 1 else "motors"
    held = "" if facts.held is None else ", nor tested on data that were held out"
    return (
        f"The {motors} of {', '.join(facts.still)} stood in every sample, or nearly: nothing is told of friction, "
        f"inertia and effects there{held}"
    )


def _not_compared(facts: Facts, standing: Standing) -> str:
    """Which samples are not compared, and what could hide there."""
    speed = facts.units[standing.joint].replace("N m", "rad/s").replace("N", "m/s")
    return (
        f"Beside reversals {standing.share:.1%} of the samples of {standing.joint} are not compared (up to "
        f"{standing.speed:.2g} {speed}; no joint has more): friction that acts only there, stiction or presliding, "
        "cannot be excluded"
    )


def _percent(share: float) -> str:
    """A share with two digits, and no power of ten."""
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"


def _part(facts: Facts) -> float | None:
    """Share of what the only effect could explain of other data that it does, where it holds in part there [-]."""
    shares = [m.transfer for m in facts.added]
    alone = shares[0] if len(shares) == 1 else None
    return alone if alone is not None and TRANSFERS < alone <= TRANSFERS_ALONE else None


def _changed(missing: Sequence[MissingEffect]) -> str:
    """What differs from a reference, each with the parameter that tells most."""
    told = [(m, max(m.parameters, key=lambda p: abs(p.value) / p.std if p.std else float("inf"))) for m in missing]
    return "; ".join(f"{m.title}, {parameter} ({m.extent})" for m, parameter in told)


def _opening(facts: Facts) -> str:
    names = ", ".join(f"{m.title} ({m.extent})" for m in facts.added)
    match facts.verdict:
        case Verdict.NONE if facts.remainder > 0.0:
            return (
                f"Nothing is named: model and data disagree beyond the noise (p {chance(facts.p_value)}) by "
                f"{_percent(facts.remainder)} of the torque, and no effect explains enough of that."
            )
        case Verdict.NONE if facts.p_value < LACK_LEVEL:
            return (
                f"Nothing is named: model and data disagree beyond the noise (p {chance(facts.p_value)}), but by less "
                "than the noise of the mean torque in every joint, and no effect explains enough of that."
            )
        case Verdict.NONE:
            return (
                f"Nothing is missing that {facts.periods} periods could show (lack of fit p {chance(facts.p_value)})."
            )
        case Verdict.NAMED | Verdict.NAMED_WITH_REMAINDER if facts.periods < FEW_PERIODS:
            return (
                f"As far as {facts.periods} periods can show, the model lacks {names}; it takes {FEW_PERIODS} periods "
                "to be sure of a name."
            )
        case Verdict.NAMED | Verdict.NAMED_WITH_REMAINDER:
            return f"The model lacks {names}."
        case Verdict.AMBIGUOUS:
            alike = "; nor ".join(
                f"{', '.join([m.title, *(a.title for a in m.alternatives[:-1])])} from {m.alternatives[-1].title}"
                for m in facts.added
                if m.alternatives
            )
            return f"The model lacks {names}; this motion does not tell {alike}."
        case Verdict.SUSPECT if (part := _part(facts)) is not None:
            return (
                f"Something is missing; it looks like {names}, but that holds on other data in part only: as it was "
                f"found, and as unsure as that is, it explains {100 * part:.0f} % of what it could explain there."
            )
        case Verdict.SUSPECT:
            return f"Something is missing; it looks like {names}, but that does not hold on other data."
        case Verdict.NOT_IN_LIBRARY:
            near = f" The nearest is {names}, which is no full explanation." if names else ""
            better = "".join(f" {relative.sentence}" for relative in facts.nameless)
            return f"Something is missing that is not in the library.{near}{better}"
        case Verdict.ONLY_AGAINST_REFERENCE:
            if not facts.missing:
                return "The model fits, but its parameters are not those of the reference, in a way that has no name."
            changed = _changed(facts.missing)
            return f"The model fits, but its parameters are not those of the reference. What changed: {changed}."
        case _ if not facts.sound:
            return UNSOUND
        case _ if facts.p_value < LACK_LEVEL:
            return (
                f"Model and data disagree beyond the noise (p {chance(facts.p_value)}), but {facts.periods} periods of "
                "this recording do not tell by what."
            )
        case _:
            return "This recording does not allow a conclusion."
