"""The next experiment: the motion that tells apart two effects that this one does not.

What tells effect A from effect B is the part of the torque of A that the model with B, its parameters and shapes
free, cannot follow (the noncentrality of the test between them; Atkinson and Fedorov, The design of experiments for
discriminating between two rival models, Biometrika 62, 1975). A motion is designed for that part of the columns of A;
where that is not enough, motions for all parameters stand beside it. All are judged by that part of the whole effect
of each in the noise of the recording, the worse of both counting.
"""

import warnings as python_warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.evidence.pairs import Pair, ambiguous_pairs, hardest, separation
from sea_ident.discrepancy.measured.data import PeriodData, around_reversals
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.discrepancy.result.findings import Alternative, NextExperiment
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Effect, Side
from sea_ident.estimation import Model
from sea_ident.exceptions import SeaIdentError
from sea_ident.excitation import (
    Criterion,
    Discrimination,
    DOptimality,
    Excitation,
    LinksAsPlanned,
    LinksInside,
    PredictedMotors,
    design_excitation,
)
from sea_ident.motion import FourierSeries, Motion
from sea_ident.plain import plain
from sea_ident.robot import Robot
from sea_ident.side_by_side import side_by_side
from sea_ident.simulation import plant_from_identified

HARMONICS = 6
"""Harmonics of a proposed motion."""

STARTS = 1
"""Random starts of a design."""

SEEDS = (1, 2, 3, 4)
"""Of the random starts."""

TOLERANCE_FACTOR = 300.0
"""Gains too small to go on for, in units of the usual ones: what is told apart is told by far more."""

SAMPLES_PER_HARMONIC = 5
"""Samples of a proposed motion, per harmonic that is compared."""

PLENTY = 100.0
"""Energy, in units of the noise, beyond which no further motion is looked for."""

SMALLEST_ENERGY = 10.0
"""In units of the noise: less tells nothing apart."""

WORTHWHILE = 1.1
"""Gain below which a motion is no better than the one that was recorded."""


def propose(
    bench: Bench, noise: NoiseFloor, pairs: Sequence[Pair], model: Model
) -> tuple[NextExperiment | None, tuple[str, ...]]:
    """Design the motion that tells an effect from its alternatives best, inside all limits of the robot.

    Args:
        bench: the recording that does not tell them apart.
        noise: its noise floor.
        pairs: the effect with each alternative.
        model: the repaired model, for bodies and springs.

    Returns:
        The experiment, None where no better motion was found, and warnings.
    """
    now = [separation(bench, noise, pair) for pair in pairs]
    first, second = pairs[0].names
    forms = [(pair, hardest(bench, noise, pair)) for pair in pairs]
    design = _Design(bench, noise, forms, *_identified(model))
    plans = _plans(model.robot, forms[0][1])
    shown, reasons = _shown(design, plans, lambda each: min(each.told_by) > PLENTY)
    if shown and model.robot.elastic_indices.size:
        # to keep links inside where their springs take them takes longer than a design: the best alone, as long as it
        # still tells what one of them did
        untried = plans[len(shown) + len(reasons) :]
        shown.sort(key=lambda each: -each.score)
        most = max(len(each.told(now)) for each in shown)
        plans = [replace(each.plan, kept=True, begun=each.excitation) for each in shown]
        plans += [replace(plan, kept=True) for plan in untried]
        shown, reasons = _shown(design, plans, lambda each: len(each.told(now)) >= most)
    if not shown:
        return None, (f"no next experiment was designed for {first} against {second}: {'; '.join(reasons)}",)
    best = max(shown, key=lambda each: (len(each.told(now)), each.score))
    told = best.told(now)
    untold = [pairs[k].names[1] for k in range(len(pairs)) if k not in told]
    notes = (f"of the motions that were tried inside the limits none tells {first} from {', '.join(untold)}",)
    if not told:
        return None, notes
    gain = best.gains(now)[told[0]]
    return NextExperiment(pairs[told[0]].names, best.excitation.to_dict(), gain), notes if untold else ()


@dataclass(frozen=True, eq=False)
class _Plan:
    """What a motion is to be designed for.

    Attributes:
        criterion: what it is to bring.
        effects: whose columns it is to show; all usual ones where None.
        springs: whether springs are among them.
        seed: of the starts.
        kept: whether links are to be kept inside where their springs take them.
        begun: a design for links as planned to begin with; None for a new one.
    """

    criterion: Criterion
    effects: tuple[Effect, ...] | None
    springs: bool
    seed: int
    kept: bool = False
    begun: Excitation | None = None


@dataclass(frozen=True, eq=False)
class _Shown:
    """What a motion shows of every pair.

    Attributes:
        plan: what it was designed for.
        excitation: the motion.
        energies: what every effect leaves of its rival, in units of the noise: as found, and in the hardest form.
    """

    plan: _Plan
    excitation: Excitation
    energies: list[tuple[float, float]]

    @property
    def score(self) -> float:
        """Larger is better: of the forms that were found, as what is hardest is often told by none."""
        return float(sum(np.log(max(found, 1.0)) for found, _ in self.energies))

    @property
    def told_by(self) -> list[float]:
        """What tells every pair in any form, in units of the noise."""
        return [min(forms) for forms in self.energies]

    def gains(self, now: Sequence[float]) -> list[float]:
        """How much more it shows of every pair than a recording of which the same is known [-]."""
        return [float(np.sqrt(new / max(old, 1.0))) for new, old in zip(self.told_by, now, strict=True)]

    def told(self, now: Sequence[float]) -> list[int]:
        """Which pairs it tells apart, and better than that recording."""
        better = enumerate(zip(self.told_by, self.gains(now), strict=True))
        return [k for k, (energy, gain) in better if energy >= SMALLEST_ENERGY and gain >= WORTHWHILE]


def _shown(
    design: "_Design", plans: Sequence[_Plan], enough: Callable[[_Shown], bool]
) -> tuple[list[_Shown], list[str]]:
    """What the motions of plans show, until one is enough, and why there is none where there is none."""
    shown: list[_Shown] = []
    reasons: list[str] = []
    attempts = side_by_side(design, plans)
    for attempt in attempts:
        if isinstance(attempt, str):
            reasons.append(attempt)
            continue
        shown.append(attempt)
        if enough(attempt):
            break
    attempts.close()
    return shown, reasons


def _plans(robot: Robot, pair: Pair) -> list[_Plan]:
    """Motions for the columns of a pair first, then motions that are wide in all.

    Effects that show only beyond some border (play, the end of a range) have no slope to follow where a design starts.
    """
    plans = [_Plan(DOptimality(), None, False, seed) for seed in SEEDS]
    own, rival = pair.own.effects[pair.own_position], pair.rival.effects[pair.rival_position]
    if own.columns(robot) and rival.columns(robot):
        known = tuple(e for k, e in enumerate(pair.own.effects) if k != pair.own_position and e.columns(robot))
        springs = any(e.side is Side.SPRING for e in (*known, own, rival))
        plans.insert(0, _Plan(Discrimination(own, (rival,)), known, springs, SEEDS[0]))
    return plans


@dataclass(frozen=True, eq=False)
class _Design:
    """Designs motions and asks them to tell effects from each other.

    Attributes:
        bench: the recording that does not.
        noise: its noise floor.
        pairs: the effect with each alternative, as found and in the hardest form.
        robot: with the bodies that were identified.
        motors: where they are, in a motion of the links.
    """

    bench: Bench
    noise: NoiseFloor
    pairs: Sequence[tuple[Pair, Pair]]
    robot: Robot
    motors: PredictedMotors | None

    @property
    def links(self) -> LinksInside | None:
        """Links are to be kept inside wherever it can be computed where the springs take them.

        Without a reserve, as in other designs: what tells effects apart is often at the end of a range.
        """
        joints = (self.robot.joint_names[int(i)] for i in self.robot.elastic_indices)
        return LinksInside(reserve=0.0) if all(self.robot.spring(joint).stiffness for joint in joints) else None

    def __call__(self, plan: _Plan) -> _Shown | str:
        """The motion of a plan and what it shows of every pair; why there is none, where there is none."""
        bench = self.bench
        try:
            with python_warnings.catch_warnings():
                python_warnings.simplefilter("ignore")
                excitation = design_excitation(
                    self.robot,
                    base_frequency=1.0 / bench.data.period,
                    harmonics=HARMONICS,
                    starts=STARTS if plan.begun is None else 0,
                    start=None if plan.begun is None else plan.begun.series.coefficients,
                    seed=plan.seed,
                    criterion=plan.criterion,
                    effects=plan.effects,
                    motors=self.motors if plan.springs else None,
                    links=self.links if plan.kept else LinksAsPlanned(),
                    tolerance_factor=TOLERANCE_FACTOR,
                    noise=_row_noise(bench, self.noise) if plan.springs else None,
                    rate=_rate(bench),
                    jobs=1,
                )
        except (SeaIdentError, np.linalg.LinAlgError) as error:
            return str(error)
        if plan.begun is not None:
            excitation = replace(excitation, starts=plan.begun.starts, start_values=plan.begun.start_values)
        there = Bench(_data_of(bench.data, self.robot, excitation.series, self.motors), bench.effects)
        energies = []
        for found, hard in self.pairs:
            energy = separation(there, self.noise, found)
            energies.append((energy, energy if hard is found else separation(there, self.noise, hard)))
        return _Shown(plan, excitation, energies)


def _rate(bench: Bench) -> float:
    """Samples per second that are enough for a design [Hz]."""
    return max(200.0, 25.0 * HARMONICS) / bench.data.period


def _row_noise(bench: Bench, noise: NoiseFloor) -> FloatArray:
    """(2 n,) noise of link rows, then of motor rows, where both are compared [N m]."""
    n = bench.robot.n
    out = np.full(2 * n, float(np.max(noise.std)))
    for equation, std in zip(bench.data.equations, noise.std, strict=True):
        if equation.kind == "link":
            out[equation.index] = std
        else:
            out[n + equation.index] = std
    return out


def _identified(model: Model) -> tuple[Robot, PredictedMotors | None]:
    """The robot with the bodies and the springs of a model."""
    robot = model.robot
    with suppress(SeaIdentError):
        robot = plant_from_identified(model).plant.robot
    if not model.springs:
        return robot, None
    laws = {spring.joint: spring.law for spring in model.springs}
    # a joint that was not moved enough may come out with a stiffness below zero, which predicts no deflection
    told = {j: law for j, law in laws.items() if law[0] > 0.0}
    known = {j: robot.spring(j).stiffness for j in laws if j not in told}
    if any(stiffness is None or stiffness <= 0.0 for stiffness in known.values()):
        return robot, None
    stiffness = {j: law[0] for j, law in told.items()} | {j: float(s) for j, s in known.items() if s is not None}
    return robot, PredictedMotors(stiffness, {j: max(law[1], 0.0) for j, law in told.items()})


def _data_of(data: PeriodData, robot: Robot, series: FourierSeries, motors: PredictedMotors | None) -> PeriodData:
    """A motion in the place of the recorded one, without torques: columns are all that is asked of it."""
    samples = min(data.samples, SAMPLES_PER_HARMONIC * data.harmonics)
    motion = series.sample(samples=samples)
    if motors is not None:
        deflection = motors.springs(robot).predict(motion)[0]
        harmonics = min(10 * series.harmonics, (samples - 1) // 2)
        theta = FourierSeries.fit(motion.time, motion.q + deflection, series.base_frequency, harmonics).motion(
            motion.time
        )
        motion = Motion(motion.time, motion.q, motion.dq, motion.ddq, theta.q, theta.dq, theta.ddq)
    return replace(
        data,
        motion=motion,
        tau_motor=np.zeros_like(motion.q),
        period_motions=(),
        period_tau_motor=np.zeros((0, *motion.q.shape)),
        channels={},
        left_out=around_reversals(motion, data.equations),
        known=None,
        places=(),
        step_errors=None,
    )


def with_next_experiment(
    diagnosis: Diagnosis, bench: Bench, selection: Selection, alternatives: dict[int, tuple[Alternative, ...]]
) -> Diagnosis:
    """An ambiguous diagnosis with the experiment that would tell, and what to do in its text."""
    pairs = ambiguous_pairs(selection, alternatives)
    if not pairs:
        unlike = ", ".join(m.title for m in diagnosis.missing if m.alternatives)
        why = f"no next experiment was designed for {unlike}: one is for what the mean of the periods shows"
        return replace(diagnosis, warnings=(*diagnosis.warnings, why))
    if diagnosis.model is None:
        own, other = pairs[0].names
        why = f"no next experiment was designed for {own} against {other}: there is no repaired model"
        return replace(diagnosis, warnings=(*diagnosis.warnings, why))
    found, notes = propose(bench, selection.final.noise, pairs, diagnosis.model)
    first, second = pairs[0].names if found is None else found.separates
    if found is None:
        advice = (
            f"None of the motions that were tried inside the limits of the robot tells {first} from {second}: look at "
            "the joint itself, or change its load or its limits."
        )
    else:
        advice = (
            f"To tell {first} from {second}, record the motion of the next experiment: it shows the difference "
            f"{plain(found.gain)} times as "
            "clearly."
        )
    return replace(
        diagnosis, next_experiment=found, text=f"{diagnosis.text} {advice}", warnings=(*diagnosis.warnings, *notes)
    )
