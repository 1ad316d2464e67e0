"""Cases from a seed: rows of the table, effects, places, sizes, noise."""

from contextlib import suppress
from dataclasses import dataclass, fields, replace

import numpy as np

from sea_ident.motion import FourierSeries
from tests.benchmarks.hidden_effects.case import Case, Noise, Planted, generator
from tests.benchmarks.hidden_effects.catalogue import (
    LIBRARY,
    OTHER_FORMS,
    REFERENCE,
    UNKNOWN,
    WHOLE,
    ZEROS,
    Entry,
    draw_effect,
    places,
)
from tests.benchmarks.hidden_effects.drawn_robots import drawn_name
from tests.benchmarks.hidden_effects.engine import Friction
from tests.benchmarks.hidden_effects.gap import TREND_EFFECTS, Gauge
from tests.benchmarks.hidden_effects.plants import Truth, drawn_truth
from tests.benchmarks.hidden_effects.trajectories import draw_trajectory

SMALL_SHARE = 0.15
PROJECT_ENGINE_SHARE = 0.15


@dataclass(frozen=True)
class Row:
    """One row of the table.

    Attributes:
        name: name.
        title: what the table calls it.
        number: stands for the row in seeds.
        entries: what can be hidden.
        weak: whether the excitation is weak.
        half: whether half of the cases hide nothing.
        coarse: whether the steps of the encoders are far above their noise.
        robots: that take turns; the leg most of the time where there are none.
        gap: of a single effect, from the smallest to the largest, as a share of torque [-].
        periods: of the training recording.
        noise: by which all noise, and the jitter of friction, is multiplied: any of these [-].
        friction: by which that of all joints is multiplied [-].
    """

    name: str
    title: str
    number: int
    entries: tuple[Entry, ...] = ()
    weak: bool = False
    half: bool = False
    coarse: bool = False
    robots: tuple[str, ...] = ()
    gap: tuple[float, float] = (0.012, 0.05)
    periods: int = 20
    noise: tuple[float, ...] = (1.0,)
    friction: float = 1.0


ROWS = {
    row.name: row
    for row in (
        Row("none", "nothing missing, P = 20 and 10", 0),
        Row("one", "one effect, gap >= 1 % of torque", 1, LIBRARY),
        Row("one_small", "same at 15 % size", 2, LIBRARY),
        Row("two", "two at once", 3, LIBRARY),
        Row("same_joint", "two at once at one joint", 19, (*LIBRARY, *ZEROS)),
        Row("main_small", "one main effect and up to five small ones", 4, LIBRARY),
        Row("unknown", "effect not in the library", 5, UNKNOWN),
        Row("removed", "true effect taken out of the library", 6, LIBRARY),
        Row("other_form", "form differs from the library", 7, OTHER_FORMS),
        Row("weak", "weak excitation", 8, LIBRARY, weak=True),
        Row("coarse", "encoders of few bits, nothing or one effect", 10, LIBRARY, half=True, coarse=True),
        Row(
            "others",
            "other robots, nothing or one effect",
            11,
            LIBRARY,
            half=True,
            robots=("prosthesis", "oblique_arm", "torso"),
        ),
        Row("drawn", "robots drawn from the seed, nothing or one effect", 12, LIBRARY, half=True),
        Row(
            "existing",
            "robots that exist, nothing or one effect",
            13,
            LIBRARY,
            half=True,
            robots=("anymal", "icub", "centauro", "panda", "talos"),
        ),
        Row("large", "one effect, gap 5 to 20 % of torque", 14, LIBRARY, gap=(0.05, 0.2)),
        Row(
            "quiet",
            "no noise, or a hundredth or tenth of it, nothing or one effect",
            15,
            LIBRARY,
            half=True,
            noise=(0.0, 0.01, 0.1),
        ),
        Row("few", "five periods, nothing or one effect", 16, LIBRARY, half=True, periods=5),
        Row("frictionless", "next to no friction, nothing or one effect", 17, LIBRARY, half=True, friction=1e-3),
        Row("zeros", "zeros of encoders and joints, gap 0.4 to 4 % of torque", 18, ZEROS, gap=(0.004, 0.04)),
        Row("whole", "signals of all joints late by one time", 20, WHOLE, gap=(0.004, 0.04)),
        Row("reference", "payload and other absorbed changes, by reference", 9, REFERENCE),
    )
}


def row_generator(seed: int, row: str, index: int, purpose: int = 0) -> np.random.Generator:
    """Random numbers of one case; one stream per purpose."""
    return generator(seed, ROWS[row].number, index, purpose)


def truth_of(case: Case) -> Truth:
    """The robot of a case."""
    truth = drawn_truth(case.robot, row_generator(case.seed, case.row, case.index, 1))
    share = ROWS[case.row].friction
    return replace(truth, viscous=share * truth.viscous, coulomb=share * truth.coulomb)


def trajectories_of(case: Case) -> tuple[FourierSeries, FourierSeries]:
    """Trajectory of the training and of the held-out recording."""
    rng = row_generator(case.seed, case.row, case.index, 2)
    return (
        draw_trajectory(case.robot, case.period, rng, weak=case.weak),
        draw_trajectory(case.robot, case.period, rng),
    )


def settling(robot: str) -> int:
    """Periods until a robot moves periodically."""
    return 1 if robot in ("exo_leg", "ur5") else 2


def draw_case(seed: int, row: str, index: int) -> Case:
    """Draw a case.

    Args:
        seed: of the run.
        row: name in `ROWS`.
        index: number of the case within the row.

    Returns:
        The case, with sizes that leave the wanted gaps.

    Raises:
        RuntimeError: nothing could be hidden in it.
    """
    what, rng = ROWS[row], row_generator(seed, row, index)
    # one in ten on the arm with springs, one in ten on the rigid arm, in an order of its own for every row
    robot = {3: "baxter", 7: "ur5"}.get((index + 3 * what.number) % 10, "exo_leg")
    if what.robots:
        robot = what.robots[index % len(what.robots)]
    if row == "drawn":
        robot = drawn_name(seed, index)
    case = Case(
        row=row,
        seed=seed,
        index=index,
        robot=robot,
        engine="mujoco",
        period=float(rng.choice([4.0, 5.0, 8.0] if robot == "exo_leg" else [5.0])),
        periods=what.periods if row != "none" or index % 2 == 0 else 10,
        holdout_periods=8,
        weak=what.weak,
        channel="current" if rng.random() < 0.25 else "tau_motor",
        # a ramp, or friction that sticks, is no base model: where a motor stands still for some samples, that shows
        friction_form="tanh",
        friction_smoothing=_log(rng, 0.003, 0.02),
        noise=_quieter(_noise(rng, what.coarse), what.noise[index // 2 % len(what.noise)]),
        planted=(),
        reference=row == "reference",
    )
    if not what.entries or (what.half and index % 2 == 0):
        return replace(case, engine="project" if rng.random() < PROJECT_ENGINE_SHARE else "mujoco")
    gauge = Gauge(truth_of(case), trajectories_of(case)[0], friction_without_jitter(case), settling(robot))
    planted = _hide(case, gauge, rng)
    if row in ("one", "one_small", "two", "removed") and rng.random() < PROJECT_ENGINE_SHARE:
        case = replace(case, engine="project")
    forbidden = tuple(p.effect for p in planted) if row == "removed" else ()
    return replace(case, planted=planted, forbidden=forbidden)


def _noise(rng: np.random.Generator, coarse: bool) -> Noise:
    link, motor = _log(rng, 5e-6, 4e-5), _log(rng, 2e-6, 1.5e-5)
    noise = Noise(
        link_encoder=link,
        motor_encoder=motor,
        link_step=_encoder_step(link),
        motor_step=_encoder_step(motor),
        torque=_log(rng, 0.003, 0.02),
        actuator=_log(rng, 0.0005, 0.003),
        jitter=_log(rng, 0.02, 0.2),
        jitter_speed=_log(rng, 0.03, 0.1),
    )
    if not coarse:
        return noise
    # that of a motor turns many times while its joint turns once
    link_bits, motor_bits = rng.integers(12, 17), rng.integers(15, 19)
    return replace(noise, link_step=float(2.0 * np.pi / 2**link_bits), motor_step=float(2.0 * np.pi / 2**motor_bits))


def _quieter(noise: Noise, share: float) -> Noise:
    """A share of a noise, the range of speeds in which friction differs aside."""
    quieter = {f.name: share * getattr(noise, f.name) for f in fields(noise) if f.name != "jitter_speed"}
    return replace(noise, **quieter)


def _encoder_step(noise: float) -> float:
    """Largest step of a binary encoder that its noise still spreads over neighbouring counts."""
    return float(2.0 * np.pi / 2.0 ** np.ceil(np.log2(2.0 * np.pi / (1.5 * noise))))


def friction_without_jitter(case: Case) -> Friction:
    """Base friction of a case, every pass alike."""
    return Friction(case.friction_form, case.friction_smoothing)


def _hide(case: Case, gauge: Gauge, rng: np.random.Generator) -> tuple[Planted, ...]:
    row, entries = case.row, ROWS[case.row].entries
    if row == "two":
        first = _one(case, gauge, rng, entries, _log(rng, 0.012, 0.05), case.index)
        second = _one(case, gauge, rng, entries, _log(rng, 0.012, 0.05), None, (first,))
        return first, second
    if row == "same_joint":
        entries = tuple(entry for entry in entries if not entry.whole)
        robot = gauge.truth.robot
        joint = int(rng.choice(robot.elastic_indices if len(robot.elastic_indices) else np.arange(robot.n)))
        first = _one(case, gauge, rng, entries, _log(rng, 0.012, 0.05), case.index, at=joint)
        second = _one(case, gauge, rng, entries, _log(rng, 0.012, 0.05), None, (first,), at=joint)
        return first, second
    if row == "main_small":
        found = [_one(case, gauge, rng, entries, _log(rng, 0.025, 0.06), case.index)]
        for _ in range(int(rng.integers(1, 6))):
            target = found[0].gap * rng.uniform(0.05, 0.15)
            small = _one(case, gauge, rng, entries, target, None, tuple(found))
            found.append(replace(small, small=True))
        return tuple(found)
    planted = _one(case, gauge, rng, entries, _log(rng, *ROWS[row].gap), case.index)
    while row == "one_small":
        with suppress(FloatingPointError):
            return (gauge.measure(replace(planted, size=SMALL_SHARE * planted.size)),)
        # a link as stiff as that swings faster than the engine steps: another effect
        planted = _one(case, gauge, rng, entries, _log(rng, 0.012, 0.05), None)
    return (planted,)


def _one(
    case: Case,
    gauge: Gauge,
    rng: np.random.Generator,
    entries: tuple[Entry, ...],
    target: float,
    turn: int | None,
    beside: tuple[Planted, ...] = (),
    at: int | None = None,
) -> Planted:
    """One effect, at any joint or at one: all take turns where a turn is given, in an order that the seed decides."""
    order = generator(case.seed, ROWS[case.row].number, 10**6).permutation(len(entries))
    # whose turn cannot be taken here is replaced by any, so that no effect follows from its neighbour's failure
    others = [int(k) for k in rng.permutation(len(entries))]
    tries = others if turn is None else [int(order[turn % len(entries)]), *others]
    taken = {p.name for p in beside}
    # two effects of one kind or two trends on one joint are one effect to anybody who looks at data
    trending = {p.joint for p in beside if p.effect in TREND_EFFECTS}
    for entry in (entries[k] for k in tries):
        if len(gauge.truth.robot.elastic_indices) == 0 and (entry.springs or entry.effect == "transmission_coupling"):
            continue
        where = (
            rng.permutation(places(entry, gauge))[:3] if at is None else [k for k in places(entry, gauge) if k == at]
        )
        for joint in where:
            name = None if entry.whole else gauge.truth.robot.joint_names[int(joint)]
            if (entry.effect, name) in taken or (entry.effect in TREND_EFFECTS and name in trending):
                continue
            try:
                planted = draw_effect(entry, gauge, int(joint), target, rng)
            except ArithmeticError:
                continue
            if planted is not None:
                return planted
    raise RuntimeError(f"{case.label}: nothing could be hidden")


def _log(rng: np.random.Generator, lower: float, upper: float) -> float:
    return float(np.exp(rng.uniform(np.log(lower), np.log(upper))))
