"""Whether torques and accelerations have the same sense: found from every joint by itself."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.estimation.observations import Observations, base_rows, stands
from sea_ident.exceptions import IdentificationError
from sea_ident.motion import Motion
from sea_ident.processing.doubt import DoubtKind, texts_of

SURE = 5.0
"""Standard deviations by which an inertia or a work must be negative."""


def check_signs(observations: Observations, misplaced: str | None = None) -> list[str]:
    """Sentences about joints whose inertia comes out negative.

    Args:
        observations: the recording and the model.
        misplaced: what is known to be wrong with the columns; then that is the reason.

    Returns:
        One for each such joint; none where all signs may be right.

    Raises:
        IdentificationError: it does in every joint: the sign of the torque is wrong.
    """
    robot, source = observations.robot, observations.processed.source
    inertia, std = joint_inertias(observations)
    negative = inertia < -SURE * std
    names = [name for name, bad in zip(robot.joint_names, negative, strict=True) if bad]
    if names and len(names) == robot.n:
        raise IdentificationError(
            misplaced
            or f"{source}: the inertia comes out negative in every joint "
            f"({', '.join(f'{name} {value:.3g}' for name, value in zip(names, inertia, strict=True))}): the torque or "
            f"current has the wrong sign; exchange it ({_exchanged(names[0])}, and so on). Or are the columns of "
            f"joints interchanged?{_of_another_period(observations)}"
        )
    if misplaced is not None:
        return [misplaced]
    return [
        f"{source}: the inertia that joint {name!r} moves comes out negative from its own torque: has that torque or "
        f"current the wrong sign? Then exchange it ({_exchanged(name)}). Or is it that of another joint? The other "
        "joints are wrong with it"
        for name in names
    ]


def turned_torques(observations: Observations) -> tuple[str, ...]:
    """Sentences about joints whose torque has the wrong sign beyond doubt.

    A model that lacks much may have a negative inertia with every column as it should be: a spring beside the motor
    asks for less torque the farther the joint is accelerated away from its middle. Yet its motor does work against
    friction in every period. With the other sign of the torque the motor takes up what it gives off.

    Args:
        observations: the recording, of two periods or more, and the model.

    Returns:
        One for each joint with a negative inertia whose motor takes up work; none where all signs may be right.
    """
    processed = observations.processed
    inertia, std = joint_inertias(observations)
    rates = np.stack([motion.dtheta for motion in processed.period_motions])
    works = np.mean(processed.period_tau_motor * rates, axis=1)
    work, spread = works.mean(axis=0), works.std(axis=0, ddof=1) / np.sqrt(len(works))
    turned = (inertia < -SURE * std) & (work < -SURE * spread)
    return tuple(
        f"{processed.source}: the inertia that joint {joint.name!r} moves comes out negative from its own torque, and "
        f"its motor takes up {-power:.3g} W where friction must cost it some: that torque or current has the wrong "
        f"sign. Exchange it ({_exchanged(joint.name)}); or have all positions of that joint the wrong one?"
        for joint, power, bad in zip(observations.robot.joints, work, turned, strict=True)
        if bad
    )


def _of_another_period(observations: Observations) -> str:
    """The doubt about the period, where there is one: a mean over other periods has any sign."""
    doubts = texts_of(observations.processed.doubts, DoubtKind.PERIOD)
    return f" Or is the period another one: {doubts[0]}" if doubts else ""


def _exchanged(joint: str) -> str:
    column = f"tau_motor_{joint}"
    return (
        f"ColumnSource({column!r}, sign=-1), on the command line --column '{column}={column},sign=-1'; likewise "
        f"current_{joint} where there is no torque"
    )


def joint_inertias(observations: Observations) -> tuple[FloatArray, FloatArray]:
    """Torque per acceleration of every joint, each found from the torque of that joint alone.

    Link and motor move together, so this is the diagonal of H + S + S' + B at the mean position of the recording.

    Args:
        observations: the recording and the model.

    Returns:
        (n,) inertias [kg m2] or [kg] and (n,) standard deviations, infinite where nothing is told: by a joint that
        friction holds, too, as its torque is what others ask of it.
    """
    robot = observations.robot
    n = robot.n
    middle = observations.processed.motion.q.mean(axis=0)
    still = np.zeros((n + 1, n))
    push = np.vstack([np.eye(n), np.zeros((1, n))])
    motion = Motion.rigid(np.arange(n + 1.0), still + middle, still, push)
    rows = base_rows(robot, observations.effects, observations.base, motion)
    inertia, std = np.zeros(n), np.full(n, np.inf)
    for i in np.flatnonzero(~stands(robot, observations.processed)):
        own = observations.rows[:, i]
        norms = np.linalg.norm(own, axis=0)
        seen = norms > 0.0
        if not np.any(seen):
            continue
        scaled = own[:, seen] / norms[seen]
        inverse = np.linalg.pinv(scaled, rcond=1e-6)
        response = (rows[i, i] - rows[n, i])[seen] / norms[seen]
        if np.linalg.norm(response - response @ inverse @ scaled) > 1e-3 * np.linalg.norm(response):
            continue  # this joint's torque alone does not tell its inertia
        values = inverse @ observations.torque[:, i]
        spread = float(np.std(observations.torque[:, i] - scaled @ values))
        inertia[i] = response @ values
        std[i] = spread * float(np.linalg.norm(response @ inverse))
    return inertia, std
