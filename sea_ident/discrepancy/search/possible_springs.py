"""Springs whose stiffness comes out below zero are searched without their cubic term.

Where the deflection stays on one side of zero and varies little, a negative stiffness and a huge cubic one bend to
anything smooth: what the model lacks there, as another zero of an encoder, then seems to be nothing.

They are searched with another zero of each motor encoder, and so are springs whose misfit goes with that. Without, a
zero that is far off leaves so little of such a spring that nothing in it promises anything. A constant torque at the
motor that is large beside its load does the same, and stands in the place of the zero where it explains more.
"""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.search.search import NOT_ASKED, Selection
from sea_ident.effects import Effect
from sea_ident.effects.motor_encoder_offset import MotorEncoderOffset
from sea_ident.effects.offset import Offset
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.effects.spring_stiffening import SpringStiffening
from sea_ident.effects.torque_offset import TorqueOffset
from sea_ident.robot import Robot

CERTAIN = 5.0
"""Standard deviations by which a stiffness must be below zero."""


def impossible_springs(bench: Bench, fit: Fit) -> dict[str, float]:
    """Stiffness of the springs with a cubic term of which it is below zero beyond doubt, by joint [N m/rad]."""
    names = [column.name for column in fit.columns]
    stds: dict[str, float] = dict(zip(names, np.linalg.norm(fit.covariance_factor, axis=1), strict=False))
    found = {}
    for effect in bench.effects:
        if _is_cubic(effect):
            name = f"{effect.joint}.spring_stiffness"
            if fit.parameters.get(name, 0.0) < -CERTAIN * stds.get(name, 0.0):
                found[str(effect.joint)] = fit.parameters[name]
    return found


def without_cubic(bench: Bench, joints: Collection[str]) -> Bench:
    """The same recording and a model without the cubic terms of some springs."""
    return bench.modelling([e for e in bench.effects if not (_is_cubic(e) and e.joint in joints)])


def with_fitted_zeros(bench: Bench, joints: Collection[str]) -> Selection:
    """A model with other zeros of some motor encoders, as if found, by the constants in their springs."""
    start = settle(bench, bench.effects)
    constants = [SpringOffset(joint) for joint in sorted(joints)]
    fit = bench.fit((*start.fit.effects, *constants), None, tangents=False)
    values = settle_again(bench, fit).fit.parameters
    zeros = {j: -values[f"{j}.spring_offset"] / values[f"{j}.spring_stiffness"] for j in joints}
    return begun_with_zeros(
        bench, [MotorEncoderOffset(joint, offset=zero) for joint, zero in sorted(zeros.items())], start
    )


def begun_with_zeros(bench: Bench, zeros: Sequence[Offset], start: Settled | None = None) -> Selection:
    """A model with wrong zeros, or constant torques that explain more, as if found: from where a search goes on.

    Args:
        bench: the recording.
        zeros: about as large as they are.
        start: the model without, settled, where that was done already.
    """
    start = settle(bench, bench.effects) if start is None else start
    first = len(start.fit.effects)
    final = _begun(bench, (*start.fit.effects, *zeros))
    for k, zero in enumerate(zeros):
        if isinstance(zero, MotorEncoderOffset):
            effects = final.fit.effects
            constant = TorqueOffset(str(zero.joint))
            other = _begun(bench, (*effects[: first + k], constant, *effects[first + k + 1 :]))
            there = settle_again(bench, other.fit, final.noise).fit
            if there.statistic < final.fit.statistic - EQUALLY_GOOD * final.fit.unit:
                final = other
    return Selection(start, final, len(zeros), (NOT_ASKED,) * len(zeros))


def _begun(bench: Bench, effects: Sequence[Effect]) -> Settled:
    """A model fitted from nothing, its springs with it."""
    fit = bench.fit(effects, None, tangents=False)
    return settle_again(bench, settle_again(bench, fit).fit)


def left_without_cubic(robot: Robot, stiffness: Mapping[str, float]) -> tuple[str, ...]:
    """What was left out, in words: stiffness by joint, as it comes out with the cubic term [N m/rad]."""
    notes = []
    for name, value in stiffness.items():
        joint = robot.joints[robot.index(name)]
        notes.append(
            f"spring of {name}: with its cubic term its stiffness comes out as {value:.3g} {joint.torque_unit}/"
            f"{joint.position_unit}, which no spring has; it was compared without. The deflection varies too little to "
            "tell such a term, and it stood in for what the model lacks"
        )
    return tuple(notes)


def _is_cubic(effect: Effect) -> bool:
    return isinstance(effect, SpringStiffening)
