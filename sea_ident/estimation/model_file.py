"""MODEL.json: a model that stands alone."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.arguments import as_path
from sea_ident.atomic import atomic_file
from sea_ident.base_parameters import BaseParameters
from sea_ident.effects import Side, effect_from_dict
from sea_ident.estimation.agreement import Agreement
from sea_ident.estimation.model import Excerpt, Fit, Model
from sea_ident.estimation.spring_result import SpringLack, SpringResult, SpringTerm, Verdict
from sea_ident.estimation.trend_term import TrendTerm
from sea_ident.estimation.uncertainty import CovarianceKind, Uncertainty
from sea_ident.estimation.update_result import Update
from sea_ident.exceptions import ModelFileError, OutputError, SeaIdentError
from sea_ident.motion import Motion
from sea_ident.regressor import model_columns
from sea_ident.robot import Robot, robot_from_text

FORMAT = "sea_ident model"
VERSION = 1
VERSION_WITH_SPRING_EFFECTS = 2
"""Of models that hold more in a spring than stiffness and damping, ..."""

VERSION_WITH_TRENDS = 3
"""... and of those that hold what changes in the course of a recording; others are written as before."""

VERSIONS = (VERSION, VERSION_WITH_SPRING_EFFECTS, VERSION_WITH_TRENDS)

LARGEST_FILE = 256 * 2**20


def model_to_dict(model: Model) -> dict[str, Any]:
    """The content of MODEL.json; DESIGN names the first keys, the later ones let it stand alone."""
    robot, base, fit = model.robot, model.base, model.fit
    names = robot.joint_names
    relative = model.relative_std_percent
    half = model.uncertainty.half_width()
    return {
        "format": FORMAT,
        "version": _version(model),
        "robot": robot.name,
        "joints": list(names),
        "effects": [effect.to_dict() for effect in (*model.effects, *model.spring_effects)],
        "estimator": model.estimator,
        "recording": model.recording,
        "fit": {
            "rms_residual": _by_joint(names, fit.rms_residual),
            "noise_std": _by_joint(names, fit.noise_std),
            "rms_torque": _by_joint(names, fit.rms_torque),
            "condition_number": fit.condition_number,
            "log_det": fit.log_det,
            "log_det_weighted": fit.log_det_weighted,
            "samples": fit.samples,
            "periods": fit.periods,
            "period": fit.period,
            "agreement": None if fit.agreement is None else fit.agreement.to_dict(names),
        },
        "uncertainty": {
            "kind": str(model.uncertainty.kind),
            "degrees_of_freedom": _number(model.uncertainty.degrees_of_freedom),
            "influences": model.uncertainty.influences.tolist(),
            "repeatability": model.uncertainty.repeatability.tolist(),
        },
        "base_parameters": [
            {
                "name": base.names[k],
                "combination": base.combination(k),
                "value": float(model.values[k]),
                "std": float(model.std[k]),
                "relative_std_percent": _number(float(relative[k])),
                "half_width_95": float(half[k]),
                "unit": base.units[k],
            }
            for k in range(base.rank)
        ],
        "parameters": [
            {
                "name": p.name,
                "joint": p.joint,
                "effect": p.effect,
                "value": p.value,
                "std": p.std,
                "unit": p.unit,
                "prior": p.prior,
            }
            for p in model.parameters
        ],
        "springs": [_spring_to_dict(spring) for spring in model.springs],
        "trends": [trend.to_dict() for trend in model.trends],
        "base": {
            "independent": [base.columns[k].name for k in base.independent],
            "grouping": base.grouping.tolist(),
            "singular_values": base.singular_values.tolist(),
            "tolerance": base.tolerance,
        },
        "covariance": model.covariance.tolist(),
        "model_covariance": model.model_covariance.tolist(),
        "information": model.information.tolist(),
        "excerpt": _excerpt_to_dict(model.excerpt),
        "description": {
            "source": robot.source,
            "urdf": robot.urdf,
            "annotation": robot.annotation,
            "joints": list(names),
            "gravity": robot.gravity.tolist(),
        },
        "update": None if model.update is None else model.update.to_dict(),
        "notes": list(model.notes),
        "warnings": list(model.warnings),
    }


def _version(model: Model) -> int:
    if model.trends:
        return VERSION_WITH_TRENDS
    return VERSION_WITH_SPRING_EFFECTS if model.spring_effects else VERSION


def write_model(model: Model, path: str | Path) -> None:
    """Write MODEL.json; the file is complete or does not appear.

    Raises:
        ModelFileError: if it cannot be written.
    """
    text = json.dumps(model_to_dict(model), indent=1, allow_nan=False)
    try:
        with atomic_file(path) as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")
    except OutputError as error:
        raise ModelFileError(str(error)) from None


def read_model(path: str | Path) -> Model:
    """Read MODEL.json.

    Args:
        path: the file.

    Returns:
        The model; it needs no other file.

    Raises:
        ModelFileError: it is missing, damaged, or no model of a version known here; says what and where.
    """
    path = as_path(path, "read_model: path")
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise ModelFileError(f"{path}: {path.stat().st_size} bytes is too large for a model")
        record = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise ModelFileError(f"{path}: is not JSON: {error}; is it a MODEL.json, whole?") from None
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise ModelFileError(f"{path}: is not a model of sea_ident; identify writes one")
    if record.get("version") not in VERSIONS:
        raise ModelFileError(
            f"{path}: has version {record.get('version')!r}; this version of sea_ident reads {VERSIONS[0]} to "
            f"{VERSIONS[-1]}. Identify again"
        )
    try:
        return model_from_dict(record)
    except ModelFileError as error:
        raise ModelFileError(f"{path}: {error}") from None
    except KeyError as error:
        raise ModelFileError(f"{path}: {error} is missing; the file is damaged or was edited") from None
    except (TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        raise ModelFileError(f"{path}: an entry is malformed: {error}; the file is damaged or was edited") from None
    except SeaIdentError as error:
        raise ModelFileError(f"{path}: {error}") from None


def model_from_dict(record: Mapping[str, Any]) -> Model:
    """The model that `model_to_dict` wrote.

    Raises:
        ModelFileError: entries that contradict each other.
    """
    description = record["description"]
    robot = robot_from_text(
        description["urdf"],
        description["source"],
        description["annotation"],
        description["joints"],
        description.get("gravity"),
    )
    if list(robot.joint_names) != record["joints"]:
        raise ModelFileError(f"joints are {record['joints']}, but the description has {list(robot.joint_names)}")
    springs = tuple(_spring_from_dict(entry, robot) for entry in record["springs"])
    listed = tuple(effect_from_dict(entry) for entry in record["effects"])
    effects = tuple(effect for effect in listed if effect.side is not Side.SPRING)
    in_springs = tuple(effect for effect in listed if effect.side is Side.SPRING)
    if set(in_springs) != {term.effect for spring in springs for term in spring.terms}:
        raise ModelFileError("the effects in springs differ from the terms of the springs")
    columns = model_columns(robot, effects)
    names = [column.name for column in columns]
    saved = record["base"]
    unknown = [name for name in saved["independent"] if name not in names]
    if unknown:
        raise ModelFileError(f"base parameters {', '.join(unknown)} are not among the parameters of the effects")
    rank = len(saved["independent"])
    base = BaseParameters(
        columns=columns,
        independent=np.array([names.index(name) for name in saved["independent"]], dtype=np.intp),
        grouping=_array(saved["grouping"], (rank, len(columns)), "base.grouping"),
        singular_values=_array(saved["singular_values"], (len(columns),), "base.singular_values"),
        tolerance=float(saved["tolerance"]),
    )
    entries = record["base_parameters"]
    values = _array([entry["value"] for entry in entries], (rank,), "base_parameters")
    fit, joints = record["fit"], robot.joint_names
    uncertainty = record["uncertainty"]
    freedom = uncertainty["degrees_of_freedom"]
    influences = np.array(uncertainty["influences"], dtype=np.float64).reshape(-1, rank)
    return Model(
        robot=robot,
        effects=effects,
        base=base,
        values=values,
        model_covariance=_array(record["model_covariance"], (rank, rank), "model_covariance"),
        uncertainty=Uncertainty(
            covariance=_array(record["covariance"], (rank, rank), "covariance"),
            degrees_of_freedom=math.inf if freedom is None else float(freedom),
            kind=CovarianceKind(uncertainty["kind"]),
            influences=influences,
            repeatability=_array(uncertainty["repeatability"], (rank, rank), "uncertainty.repeatability"),
        ),
        information=_array(record["information"], (rank, rank), "information"),
        estimator=str(record["estimator"]),
        springs=springs,
        fit=Fit(
            rms_residual=_from_joints(fit["rms_residual"], robot),
            noise_std=_from_joints(fit["noise_std"], robot),
            rms_torque=np.array([float(fit["rms_torque"][j]) for j in joints]),
            condition_number=float(fit["condition_number"]),
            log_det=float(fit["log_det"]),
            log_det_weighted=float(fit["log_det_weighted"]),
            samples=int(fit["samples"]),
            periods=int(fit["periods"]),
            period=None if fit["period"] is None else float(fit["period"]),
            agreement=Agreement.from_dict(fit.get("agreement"), joints),
        ),
        excerpt=_excerpt_from_dict(record["excerpt"], robot),
        recording=str(record["recording"]),
        update=None if record["update"] is None else Update.from_dict(record["update"]),
        trends=tuple(TrendTerm.from_dict(entry, robot) for entry in record.get("trends", ())),
        notes=tuple(str(text) for text in record["notes"]),
        warnings=tuple(str(text) for text in record["warnings"]),
    )


def _number(value: float) -> float | None:
    """JSON knows no infinity; None stands for it."""
    return float(value) if math.isfinite(value) else None


def _by_joint(names: tuple[str, ...], values: FloatArray) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=True)}


def _from_joints(record: Mapping[str, float], robot: Robot) -> FloatArray:
    return np.array([float(record[name]) for name in robot.joint_names])


def _array(values: Any, shape: tuple[int, ...], where: str) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    if array.shape != shape:
        raise ModelFileError(f"{where} has shape {array.shape}, not {shape}; the file is damaged or was edited")
    if not np.all(np.isfinite(array)):
        raise ModelFileError(f"{where} holds numbers that are not finite; the file is damaged or was edited")
    return array


def _spring_to_dict(spring: SpringResult) -> dict[str, Any]:
    stiffness, cubic, damping = spring.law
    more: dict[str, Any] = {}
    if spring.terms:
        more = {
            "terms": [
                {
                    "effect": term.effect.to_dict(),
                    "values": list(term.values),
                    "stds": list(term.stds),
                    "by_rest": term.by_rest,
                }
                for term in spring.terms
            ],
            "full_covariance": [list(row) for row in spring.full_covariance],
        }
    return {
        **more,
        "joint": spring.joint,
        "stiffness": spring.stiffness,
        "stiffness_std": spring.stiffness_std,
        "cubic_stiffness": spring.cubic_stiffness,
        "cubic_stiffness_std": spring.cubic_stiffness_std,
        "damping": spring.damping,
        "damping_std": spring.damping_std,
        "verdict": str(spring.verdict),
        "note": spring.note,
        "law": {"stiffness": stiffness, "cubic_stiffness": cubic, "damping": damping},
        "covariance": [list(row) for row in spring.covariance],
        "degrees_of_freedom": _number(spring.degrees_of_freedom),
        "linear_stiffness": spring.linear_stiffness,
        "linear_damping": spring.linear_damping,
        "zero": spring.zero,
        "rms_residual": spring.rms_residual,
        "rms_torque": spring.rms_torque,
        "largest_deflection": spring.largest_deflection,
        "held_out": spring.held_out,
        "noise": spring.noise,
        "misfit": [list(row) for row in spring.misfit],
        "lack": None if spring.lack is None else asdict(spring.lack),
    }


def _spring_from_dict(entry: Mapping[str, Any], robot: Robot) -> SpringResult:
    numbers = (
        "stiffness", "stiffness_std", "cubic_stiffness", "cubic_stiffness_std", "damping", "damping_std",
        "linear_stiffness", "linear_damping", "zero", "rms_residual", "rms_torque", "largest_deflection",
    )  # fmt: skip
    freedom = entry["degrees_of_freedom"]
    terms = tuple(_term_from_dict(term, str(entry["joint"]), robot) for term in entry.get("terms", ()))
    size = 3 + sum(len(term.values) for term in terms)
    whole: list[list[float]] = []
    if terms:
        whole = _array(entry["full_covariance"], (size, size), f"springs.{entry['joint']}.full_covariance").tolist()
    return SpringResult(
        **{key: float(entry[key]) for key in numbers},
        joint=str(entry["joint"]),
        note=str(entry["note"]),
        held_out={str(key): float(value) for key, value in entry["held_out"].items()},
        verdict=Verdict(entry["verdict"]),
        covariance=tuple(tuple(float(v) for v in row) for row in entry["covariance"]),
        degrees_of_freedom=math.inf if freedom is None else float(freedom),
        terms=terms,
        full_covariance=tuple(tuple(row) for row in whole),
        noise=None if entry.get("noise") is None else float(entry["noise"]),
        misfit=tuple(tuple(float(v) for v in row) for row in entry.get("misfit", ())),
        lack=_lack_from_dict(entry.get("lack")),
    )


def _lack_from_dict(record: Mapping[str, Any] | None) -> SpringLack | None:
    if record is None:
        return None
    effects = tuple(str(name) for name in record["effects"])
    return SpringLack(effects, float(record["rms_residual"]), float(record["stiffness"]))


def _term_from_dict(record: Mapping[str, Any], joint: str, robot: Robot) -> SpringTerm:
    effect = effect_from_dict(record["effect"])
    if effect.side is not Side.SPRING or effect.joint != joint:
        raise ModelFileError(f"the spring of {joint!r} cannot hold the effect {effect.name!r} at {effect.joint!r}")
    count = len(effect.columns(robot))
    where = f"springs.{joint}.{effect.name}"
    values, stds = (_array(record[key], (count,), f"{where}.{key}") for key in ("values", "stds"))
    return SpringTerm(effect, tuple(values.tolist()), tuple(stds.tolist()), record.get("by_rest") is True)


def _excerpt_to_dict(excerpt: Excerpt) -> dict[str, Any]:
    motion = excerpt.motion
    signals = {
        "time": motion.time, "q": motion.q, "dq": motion.dq, "ddq": motion.ddq, "theta": motion.theta,
        "dtheta": motion.dtheta, "ddtheta": motion.ddtheta, "tau_motor": excerpt.tau_motor,
        "tau_std": excerpt.tau_std, "tau_model": excerpt.tau_model, "tau_spring": excerpt.tau_spring,
        "residual_std": excerpt.residual_std,
    }  # fmt: skip
    return {name: _short(values) for name, values in signals.items()}


def _short(values: FloatArray) -> Any:
    """Pictures need no more than eight digits."""
    flat = [float(f"{v:.8g}") for v in values.ravel()]
    return np.array(flat).reshape(values.shape).tolist()


def _excerpt_from_dict(record: Mapping[str, Any], robot: Robot) -> Excerpt:
    samples = len(record["time"])
    shape = (samples, robot.n)

    def table(name: str) -> FloatArray:
        return _array(record[name], shape, f"excerpt.{name}")

    time = _array(record["time"], (samples,), "excerpt.time")
    motion = Motion(time, *(table(k) for k in ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")))
    spring = np.array(record["tau_spring"], dtype=np.float64).reshape(samples, len(robot.elastic_indices))
    # files of earlier versions have the scatter of the torque alone
    scatter = table("residual_std" if "residual_std" in record else "tau_std")
    return Excerpt(motion, table("tau_motor"), table("tau_std"), table("tau_model"), spring, scatter)
