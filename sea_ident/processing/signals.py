"""The columns of a recording in the order of a robot, and what is wrong with them at first sight."""

from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.processing import torque
from sea_ident.processing.doubt import Doubt
from sea_ident.processing.late_stamps import late_stamps
from sea_ident.processing.plausible import beyond_limits, doubts, unused
from sea_ident.recordings import Recording
from sea_ident.robot import Robot

OTHER_CHANNELS = ("current", "tau_spring", "temperature", "external_force", "q_reference", "theta_reference")


@dataclass(frozen=True, eq=False)
class Signals:
    """Columns of a recording in the order of the robot.

    Attributes:
        q: (M, n) link positions [rad] or [m].
        theta: (M, n) motor positions, those of the links at rigid joints [rad] or [m].
        torque: motor torques at the joint side [N m] or [N], and where they come from.
        others: (M, n) further channels by kind.
        warnings: what is doubtful.
        doubts: those of them that what is concluded depends on.
        notes: what is worth knowing.
    """

    q: FloatArray
    theta: FloatArray
    torque: torque.TorqueSource
    others: dict[str, FloatArray]
    warnings: list[str]
    doubts: list[Doubt]
    notes: list[str]


def read_signals(recording: Recording, robot: Robot) -> Signals:
    """The columns that identification needs.

    Args:
        recording: where they are.
        robot: the robot; at rigid joints theta is q.

    Returns:
        Positions (M, n) [rad] or [m], torques (M, n) [N m] or [N], and what a user should know of them.

    Raises:
        RecordingError: a column is missing, no joint moves, or no torque differs from a constant.
    """
    names = robot.joint_names
    q = recording.channel("q", names)
    theta = q.copy()
    for i in robot.elastic_indices:
        theta[:, i] = recording.channel("theta", [names[i]])[:, 0]
    found: list[str] = []
    notes: list[str] = []
    still = [name for i, name in enumerate(names) if np.ptp(q[:, i]) == 0.0]
    if len(still) == robot.n:
        raise RecordingError(
            f"{recording.source}: no joint moves: {', '.join(f'q_{name}' for name in still)} "
            f"{'is' if len(still) == 1 else 'are'} constant; nothing can be identified at rest"
        )
    if still:
        found.append(
            f"{recording.source}: {', '.join(f'q_{name}' for name in still)} constant: what only the motion of "
            "these joints shows cannot be told"
        )
    for i in robot.elastic_indices:
        if np.array_equal(theta[:, i], q[:, i]):
            found.append(
                f"{recording.source}: theta_{names[i]} and q_{names[i]} are the same numbers: without a deflection "
                "there is no spring to be identified"
            )
        elif np.ptp(theta[:, i]) == 0.0 < np.ptp(q[:, i]):
            found.append(
                f"{recording.source}: theta_{names[i]} constant while q_{names[i]} moves: is the motor measured? If it "
                "is locked, this recording does not tell its inertia and friction"
            )
    source = torque.torque_source(recording, robot)
    if np.all(np.ptp(source.values, axis=0) == 0.0):
        raise RecordingError(
            f"{recording.source}: the motor torques of all joints are constant ({', '.join(source.columns)}): nothing "
            "was measured that a model could explain. Are the columns the right ones?"
        )
    found.extend(source.warnings)
    found.extend(late_stamps(recording, np.concatenate([q, theta[:, robot.elastic_indices]], axis=1)))
    doubted = doubts(recording, robot, q, theta, source.values)
    found.extend(doubt.text for doubt in doubted)
    notes.extend(source.notes)
    notes.extend([*beyond_limits(recording, robot, q), *unused(recording, robot)])
    others = {
        kind: recording.channel(kind, names) for kind in OTHER_CHANNELS if all(recording.has(kind, j) for j in names)
    }
    if robot.elastic_indices.size:
        others["deflection"] = theta - q
    return Signals(q, theta, source, others, found, doubted, notes)
