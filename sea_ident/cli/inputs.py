"""What verbs read."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sea_ident.exceptions import RecordingError, RobotError

if TYPE_CHECKING:
    from sea_ident.discrepancy import Diagnosis
    from sea_ident.effects import Effect
    from sea_ident.estimation import Model
    from sea_ident.recordings import ColumnSource, Recording
    from sea_ident.robot import HalfSpace, Limits, Robot


def read_robot(source: str, annotation: str | None, joints: str | None, gravity: str | None) -> "Robot":
    """The robot that the ROBOT argument and its options mean.

    Raises:
        RobotError: gravity is not three numbers.
    """
    from sea_ident.robot import load_robot

    names = None if joints is None else split_names(joints)
    return load_robot(source, annotation, names, None if gravity is None else _gravity(gravity))


def _gravity(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise RobotError(f"--gravity {text}: give three numbers [m/s2], as --gravity 0,0,-9.81") from None


def read_limits(robot: "Robot", half_spaces: Sequence[str] | None, self_collision: float | None) -> "Limits":
    """The limits of a robot with those that --half-space and --self-collision add.

    Raises:
        SeaIdentError: a half-space that is not written as it should be.
    """
    from sea_ident.robot import SelfCollision

    limits = robot.limits
    added = tuple(_half_space(text, f"plane {k}") for k, text in enumerate(half_spaces or (), 1))
    limits = limits.replace(half_spaces=limits.half_spaces + added)
    if self_collision is None:
        return limits
    ignored = () if limits.self_collision is None else limits.self_collision.ignored
    return limits.replace(self_collision=SelfCollision(self_collision, ignored))


def _half_space(text: str, name: str) -> "HalfSpace":
    """What `LINK[@X,Y,Z]:NX,NY,NZ,D` means; names of links may hold colons and @."""
    import numpy as np

    from sea_ident.exceptions import SeaIdentError
    from sea_ident.robot import HalfSpace

    place, _, plane = text.rpartition(":")
    link, point = place, [0.0, 0.0, 0.0]
    try:
        *normal, offset = (float(part) for part in plane.split(","))
        if "@" in place:
            link, _, where = place.rpartition("@")
            point = [float(part) for part in where.split(",")]
    except ValueError:
        normal, offset = [], 0.0
    if not link or len(normal) != 3 or len(point) != 3:
        raise SeaIdentError(
            f"--half-space {text}: write LINK:NX,NY,NZ,D or LINK@X,Y,Z:NX,NY,NZ,D, such as tool:0,0,-1,-0.1 for a tool "
            f"that stays 0.1 m above the ground"
        )
    return HalfSpace(name, link, np.array(normal), offset, np.array(point))


def split_names(text: str | None) -> list[str]:
    """Names separated by commas."""
    return [name.strip() for name in (text or "").split(",") if name.strip()]


def read_effects(robot: "Robot", added: Sequence[str] | None) -> "tuple[Effect, ...]":
    """Bodies, rotors and friction, with the effects that --add names in place of their like or beside them.

    Raises:
        EffectError: an effect is not known, does not fit that joint, or has no such shape.
    """
    from sea_ident.effects import base_effects

    effects = list(base_effects(robot))
    for text in added or ():
        for effect in _effects_of(robot, text):
            same = [k for k, e in enumerate(effects) if e.name == effect.name and e.joint == effect.joint]
            if same:
                effects[same[0]] = effect
            else:
                effects.append(effect)
    return tuple(effects)


def _effects_of(robot: "Robot", text: str) -> "list[Effect]":
    """Effects that `EFFECT[:JOINT][,SHAPE=VALUE...]` means."""
    from sea_ident.effects import effect_classes, make_effect
    from sea_ident.exceptions import EffectError

    place, *settings = text.split(",")
    name, _, joint = place.partition(":")
    if joint:
        robot.index(joint)
    kind = effect_classes().get(name) or type(make_effect(name))  # which says what there is
    shape: dict[str, float] = {}
    for setting in settings:
        key, _, value = setting.partition("=")
        try:
            shape[key.strip()] = float(value)
        except ValueError:
            raise EffectError(f"--add {text}: {setting!r} is not SHAPE=NUMBER") from None
    found = [effect for effect in kind.instances(robot) if not joint or effect.joint == joint]
    if not found:
        where = f"joint {joint!r}" if joint else "any joint"
        raise EffectError(f"the effect {name!r} does not fit {where} of {robot.name}")
    return [
        make_effect(name, effect.joint, **{**effect.shape_values, **shape}) if shape else effect for effect in found
    ]


def read_part(path: Path, columns: "Mapping[str, ColumnSource] | None", between: str | None) -> "Recording":
    """The recording in a file, of which --between keeps a part.

    Raises:
        RecordingError: the file cannot be read, the option is not written as it should be, or nothing is left.
    """
    from sea_ident.recordings import read_recording

    if between is None:
        return read_recording(path, columns=columns)
    parts = [part.strip() for part in between.split(",")]
    try:
        start, stop = (float(part) if part else None for part in parts)
    except ValueError:
        raise RecordingError(f"--between {between}: is not START,STOP in seconds, such as 5,65 or 5, or ,65") from None
    return read_recording(path, columns=columns).crop(start, stop)


def read_columns(texts: Sequence[str] | None) -> "dict[str, ColumnSource] | None":
    """Translation of foreign columns that --column options of the form `NAME=SOURCE[,KEY=VALUE...]` mean.

    Raises:
        RecordingError: one has another form, an unknown key, or a value that is no number.
    """
    if not texts:
        return None
    found: dict[str, ColumnSource] = {}
    for text in texts:
        name, source = _column_of(text)
        if name in found:
            raise RecordingError(f"--column {text}: column {name} is named twice")
        found[name] = source
    return found


def _column_of(text: str) -> "tuple[str, ColumnSource]":
    from sea_ident.recordings import ColumnSource

    place, *settings = text.split(",")
    name, equals, source = (part.strip() for part in place.partition("="))
    if not (name and equals and source):
        raise RecordingError(f"--column {text}: is not NAME=SOURCE, such as q_knee=pos_knee,unit=deg")
    how: dict[str, Any] = {}
    for setting in settings:
        key, _, value = (part.strip() for part in setting.partition("="))
        if key in ("unit", "time"):
            how[key] = value
        elif key in ("zero", "scale", "sign", "gear_ratio", "counts_per_rev", "wraps_at", "interval"):
            try:
                how[key] = float(value)
            except ValueError:
                raise RecordingError(f"--column {text}: {setting!r} is not {key}=NUMBER") from None
        else:
            raise RecordingError(
                f"--column {text}: the key {key!r} is not known; there are unit, zero, scale, sign, gear_ratio, "
                "counts_per_rev, wraps_at, interval, time"
            )
    return name, ColumnSource(source, **how)


def read_result(path: Path, model: Path | None) -> "Model | Diagnosis":
    """A model or a diagnosis, whichever the file holds, the latter with its repaired model if that is given.

    Raises:
        ModelFileError: the file cannot be read, or holds neither.
        SeaIdentError: a model is given for a model, or one of another robot.
    """
    from sea_ident.discrepancy import read_diagnosis
    from sea_ident.estimation import read_model
    from sea_ident.exceptions import ModelFileError, SeaIdentError

    if not path.exists():
        raise ModelFileError(f"{path}: no such file")
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ModelFileError(f"{path}: cannot be read as a model or a diagnosis: {error}") from None
    if not isinstance(record, dict) or "verdict" not in record:
        if model is not None:
            raise SeaIdentError(f"{path}: is no diagnosis; --model goes with a diagnosis only")
        return read_model(path)
    diagnosis = read_diagnosis(path)
    if model is None:
        return diagnosis
    repaired = read_model(model)
    joints = tuple(diagnosis.units or diagnosis.lack_of_fit.per_joint)
    if joints and joints != repaired.robot.joint_names:
        raise SeaIdentError(
            f"{model}: is a model of {repaired.robot.name} ({', '.join(repaired.robot.joint_names)}), {path} is the "
            f"diagnosis of a robot with {', '.join(joints)}; give its repaired model"
        )
    return replace(diagnosis, model=repaired)
