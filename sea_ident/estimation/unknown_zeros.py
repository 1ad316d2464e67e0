"""Recordings of a model whose encoders have zeros that are not known: every recording is read with its own.

Encoders of motors that count from where they were switched on have another zero after every start.
"""

import warnings
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import corrected_motion
from sea_ident.estimation.model import Model
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.springs import fit_zero
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.processing import ProcessedRecording, process
from sea_ident.recordings import Recording

Given = Recording | ProcessedRecording

THETA = ("theta", "theta_reference")
"""Columns that are read with another zero."""


def unknown_zeros(model: Model) -> tuple[str, ...]:
    """Joints of which theta and q have different zeros that a model was identified without knowing."""
    return tuple(spring.joint for spring in model.springs if spring.zero != 0.0)


def with_its_zeros(model: Model, recording: Given, period: float | None) -> tuple[Given, dict[str, float]]:
    """A recording whose theta has the zero of q, and how far that was off where a model does not know it.

    Args:
        model: the model.
        recording: any recording of the robot.
        period: [s]; found from the data where None.

    Returns:
        The recording, and the zeros by joint [rad] or [m]; as it is, and none, where all are known.
    """
    if not unknown_zeros(model):
        return recording, {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        given = recording
        processed = given if isinstance(given, ProcessedRecording) else process(given, model.robot, period=period)
    zeros = zeros_of(model, processed)
    return with_common_zeros(recording, zeros), zeros


def zeros_of(model: Model, processed: ProcessedRecording) -> dict[str, float]:
    """How far theta is from the zero of q in a recording, where that is unknown [rad] or [m].

    The dynamic model gives the torque of the spring, and its odd law tells where it is zero.

    Args:
        model: identified with unknown zeros.
        processed: any recording of the robot.
    """
    joints = unknown_zeros(model)
    if not joints:
        return {}
    robot = model.robot
    observations = Observations(robot, model.effects, model.base, processed)
    torque = observations.spring_torque(observations.mean, processed.tau_motor, model.values)
    motion, places = corrected_motion(robot, model.effects, processed.motion), robot.elastic_indices.tolist()
    return {
        name: fit_zero(motion, joint, torque[:, places.index(joint)])
        for name, joint in ((name, robot.index(name)) for name in joints)
    }


def with_common_zeros(recording: Given, zeros: Mapping[str, float]) -> Given:
    """A recording whose theta has the zero of q.

    Args:
        recording: as it was recorded or processed.
        zeros: what theta shows where q is zero and the spring carries nothing, by joint [rad] or [m].
    """
    if not zeros:
        return recording
    if isinstance(recording, Recording):
        moved = {
            name: recording.columns[name] - zero
            for joint, zero in zeros.items()
            for name in (f"{kind}_{joint}" for kind in THETA)
            if name in recording.columns
        }
        return recording.replace_columns(moved)
    shift = np.array([zeros.get(name, 0.0) for name in recording.joint_names])
    channels = dict(recording.channels)
    if "deflection" in channels:
        channels["deflection"] = channels["deflection"] - shift
    return replace(
        recording,
        motion=_moved(recording.motion, shift),
        period_motions=tuple(_moved(motion, shift) for motion in recording.period_motions),
        channels=channels,
    )


def with_zeros(model: Model, zeros: Mapping[str, float]) -> Model:
    """A model of a recording that was read less these zeros, as one of the recording as it is [rad] or [m]."""
    springs = tuple(replace(s, zero=s.zero + zeros.get(s.joint, 0.0)) for s in model.springs)
    return replace(model, springs=springs)


def _moved(motion: Motion, shift: FloatArray) -> Motion:
    return replace(motion, theta=motion.theta - shift)
