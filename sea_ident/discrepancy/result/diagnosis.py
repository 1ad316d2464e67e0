"""What a diagnosis says, and DIAGNOSIS.json."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sea_ident.arguments import as_path
from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.result.findings import (
    Alternative,
    Detectability,
    LackOfFit,
    Location,
    MissingEffect,
    MissingParameter,
    NextExperiment,
    Unseen,
    Verdict,
    Waveforms,
    chance,
)
from sea_ident.effects import effect_from_dict
from sea_ident.effects.drift import TrendEffect
from sea_ident.estimation import Model
from sea_ident.exceptions import ModelFileError
from sea_ident.plain import plain

IN_WORDS = {"training": "training", "holdout": "held out"}
"""Data on which a gap was measured, for people."""

_LARGEST = 1e100  # magnitude beyond which a number was not written by a diagnosis


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Where a model and a recording disagree, and what is missing.

    Attributes:
        verdict: the outcome in a word.
        text: one paragraph that a person can act on.
        lack_of_fit: whether the model as it was, refitted, leaves more than noise.
        locations: where, the strongest first.
        missing: what, the largest torque first.
        training: gap on the recording.
        holdout: gap on the held-out recording (or held-out periods).
        simulation_gap: of forward simulation by signal q, theta, tau; empty where it was not made.
        trend_gap: what goes with the course of a recording, on it (training) and on another one (holdout) as if that
            began as it did; empty where nothing changes.
        detectability: what could have been seen.
        next_experiment: what to do about an ambiguous pair.
        warnings: what to know before trusting this.
        model: the model with the effects; the refitted model where nothing was added; None where no fit was possible.
        waveforms: for pictures.
        recording: source of the recording.
        holdout_source: source of the held-out data, None where there is none.
        units: unit of the torque of each joint, N m or N.
    """

    verdict: Verdict
    text: str
    lack_of_fit: LackOfFit
    locations: tuple[Location, ...] = ()
    missing: tuple[MissingEffect, ...] = ()
    training: Gap | None = None
    holdout: Gap | None = None
    simulation_gap: Mapping[str, Gap] = field(default_factory=dict)
    detectability: tuple[Detectability, ...] = ()
    next_experiment: NextExperiment | None = None
    warnings: tuple[str, ...] = ()
    model: Model | None = None
    waveforms: Waveforms | None = None
    recording: str = ""
    holdout_source: str | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    trend_gap: Mapping[str, Gap] = field(default_factory=dict)

    @property
    def adds(self) -> bool:
        """Whether anything is missing that was added to the model; what changed since an earlier one is in it."""
        return bool(self.missing) and self.verdict is not Verdict.ONLY_AGAINST_REFERENCE

    @property
    def adds_to_mean(self) -> bool:
        """Whether any of it is in the mean of the periods, and does not just change in the course of the recording."""
        return self.adds and any(not isinstance(m.detail, TrendEffect) for m in self.missing)

    @property
    def adds_to_held_out(self) -> bool:
        """Whether any of it shows in the mean of held-out data, where what drifts is another than in the recording."""
        return self.adds_to_mean or (self.adds and self.holdout is not None and self.holdout.shrink > 0.0)

    def summary(self) -> str:
        """The paragraph, and the tables behind it."""
        lines = [f"{self.verdict}: {self.text}"]
        kind = "perhaps" if self.verdict is Verdict.CANNOT_TELL else "missing"
        for m in self.missing:
            lines.append(f"  {kind}: {m.title}, {m.extent}, p {chance(m.p_value)}")
            lines.extend(f"    {p}" for p in m.parameters)
            lines.extend([] if m.unseen is None else [f"    {m.unseen}"])
            if m.alternatives:
                others = ", ".join(f"{a.title} ({a.cos2:.3f})" for a in m.alternatives)
                lines.append(f"    or: {others}")
        gaps = {IN_WORDS["training"]: self.training, IN_WORDS["holdout"]: self.holdout}
        gaps |= {f"from period to period, {IN_WORDS[label]}": gap for label, gap in self.trend_gap.items()}
        gaps |= {f"forward simulation of {kind}": gap for kind, gap in self.simulation_gap.items()}
        for label, gap in gaps.items():
            if gap is not None:
                units = units_by_joint(self.units, gap.before, positions=label.endswith(("of q", "of theta")))
                alike = len(of_all := set(units.values())) == 1
                told = f" [{of_all.pop()}], {label}: {gap.summary()}" if alike else f", {label}: {gap.summary(units)}"
                lines.append(f"  gap{told}")
        if self.next_experiment is not None:
            first, second = self.next_experiment.separates
            times = plain(self.next_experiment.gain, 3)
            lines.append(f"  next experiment: tells {first} from {second} {times} times better")
        lines.extend(
            f"  where: {x.joint} {x.equation}, {x.regime}: {x.excess_rms:.3g}, z {x.z:.4g}" for x in self.locations[:5]
        )
        lines.extend(f"  warning: {text}" for text in self.warnings)
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The content of DIAGNOSIS.json."""
        empty: dict[str, Any] = {"before": {}, "after": {}, "noise": {}}
        return {
            "verdict": str(self.verdict),
            "summary": self.text,
            "recording": self.recording,
            "holdout": self.holdout_source,
            "units": dict(self.units),
            "lack_of_fit": {
                "statistic": self.lack_of_fit.statistic,
                "dof": self.lack_of_fit.dof,
                "p_value": self.lack_of_fit.p_value,
                "trend_p_value": self.lack_of_fit.trend_p_value,
                "remainder": self.lack_of_fit.remainder,
                "per_joint": {joint: dict(parts) for joint, parts in self.lack_of_fit.per_joint.items()},
            },
            "locations": [
                {"joint": x.joint, "equation": x.equation, "regime": x.regime, "excess_rms": x.excess_rms, "z": x.z}
                for x in self.locations
            ],
            "missing": [_missing_to_dict(m) for m in self.missing],
            "gap": {
                "training": empty if self.training is None else _gap_to_dict(self.training),
                "holdout": None if self.holdout is None else _gap_to_dict(self.holdout),
                "shrink_training": None if self.training is None else self.training.shrink,
                "shrink_holdout": None if self.holdout is None else self.holdout.shrink,
            },
            "simulation_gap": {kind: _gap_to_dict(gap) for kind, gap in self.simulation_gap.items()},
            "trend_gap": {label: _gap_to_dict(gap) for label, gap in self.trend_gap.items()},
            "detectability": [
                {
                    "effect": d.effect, "joint": d.joint, "smallest": d.smallest if np.isfinite(d.smallest) else None,
                    "unit": d.unit, "absorbed": d.absorbed, "confusable_with": list(d.confusable_with),
                    "shapes": [{"name": name, "value": value, "unit": unit} for name, value, unit in d.shapes],
                    "title": d.title,
                }
                for d in self.detectability
            ],
            "next_experiment": None
            if self.next_experiment is None
            else {
                "separates": list(self.next_experiment.separates),
                "excitation": dict(self.next_experiment.excitation),
                "gain": self.next_experiment.gain,
            },
            "warnings": list(self.warnings),
            "waveforms": None if self.waveforms is None else _waveforms_to_dict(self.waveforms),
        }  # fmt: skip

    def save(self, path: str | Path) -> None:
        """Write DIAGNOSIS.json; the file is complete or does not appear.

        Raises:
            ModelFileError: if it cannot be written.
        """
        target = as_path(path, "save: path")
        partial = target.with_name(target.name + ".part")
        try:
            partial.write_text(json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n", encoding="utf-8")
            partial.replace(target)
        except OSError as error:
            raise ModelFileError(f"{target}: the diagnosis cannot be written: {error}") from error


def torque_unit(units: Mapping[str, str]) -> str:
    """Unit of the torques of all joints, whose own are given; of either kind where they differ or are not known."""
    of_all = set(units.values())
    return of_all.pop() if len(of_all) == 1 else "N m or N"


def position_unit(units: Mapping[str, str]) -> str:
    """Unit of the positions of all joints, of which those of the torque are given."""
    return {"N m": "rad", "N": "m"}.get(torque_unit(units), "rad or m")


def units_by_joint(units: Mapping[str, str], joints: Iterable[str], *, positions: bool = False) -> dict[str, str]:
    """Unit of the torque of each of these joints or of its position; of either kind where it is not known."""
    unit_of = position_unit if positions else torque_unit
    return {joint: unit_of({joint: units[joint]} if joint in units else {}) for joint in joints}


def read_diagnosis(path: str | Path) -> Diagnosis:
    """Read DIAGNOSIS.json; the model is not in it.

    Raises:
        ModelFileError: if it cannot be read or is no diagnosis.
    """
    try:
        record = json.loads(as_path(path, "read_diagnosis: path").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ModelFileError(f"{path}: the diagnosis cannot be read: {error}") from error
    try:
        return _from_dict(record)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        raise ModelFileError(f"{path}: not a diagnosis ({type(error).__name__}: {error})") from error


def _missing_to_dict(m: MissingEffect) -> dict[str, Any]:
    return {
        "effect": m.effect,
        "joint": m.joint,
        "parameters": [_parameter_to_dict(p) for p in m.parameters],
        "torque_share": m.torque_share,
        "p_value": m.p_value,
        "alternatives": [{"effect": a.effect, "joint": a.joint, "cos2": a.cos2} for a in m.alternatives],
        "transfer": m.transfer,
        "detail": None if m.detail is None else m.detail.to_dict(),
        "values": list(m.values),
        "unseen": None
        if m.unseen is None
        else {
            "effect": m.unseen.effect,
            "joint": m.unseen.joint,
            "parameters": [_parameter_to_dict(p) for p in m.unseen.parameters],
        },
    }


def _parameter_to_dict(p: MissingParameter) -> dict[str, Any]:
    return {"name": p.name, "value": p.value, "std": p.std, "unit": p.unit}


def _gap_to_dict(gap: Gap) -> dict[str, Any]:
    return {"before": dict(gap.before), "after": dict(gap.after), "noise": dict(gap.noise)}


def _waveforms_to_dict(w: Waveforms) -> dict[str, Any]:
    thin = slice(None, None, max(1, len(w.time) // 500))
    return {
        "time": w.time[thin].tolist(),
        "equations": list(w.equations),
        "before": w.before[thin].tolist(),
        "after": w.after[thin].tolist(),
        "noise": w.noise.tolist(),
        "q": w.q[thin].tolist(),
        "dtheta": w.dtheta[thin].tolist(),
        "deflection": w.deflection[thin].tolist(),
        "explained": {name: values[thin].tolist() for name, values in w.explained.items()},
        "bands": {name: values[thin].tolist() for name, values in w.bands.items()},
    }


def _from_dict(record: Mapping[str, Any]) -> Diagnosis:
    lack, gap = record["lack_of_fit"], record["gap"]
    after = record.get("next_experiment")
    waves = record.get("waveforms")
    units = {str(joint): str(unit) for joint, unit in record.get("units", {}).items()}
    training = _gap_from_dict(gap["training"], units)
    return Diagnosis(
        verdict=Verdict(record["verdict"]),
        text=record["summary"],
        lack_of_fit=LackOfFit(
            _finite(lack["statistic"]), int(lack["dof"]), _finite(lack["p_value"]), _finite(lack["trend_p_value"]),
            {joint: _numbers(parts) for joint, parts in lack["per_joint"].items()}, _finite(lack.get("remainder", 0.0)),
        ),
        locations=tuple(
            Location(
                str(x["joint"]), str(x["equation"]), str(x["regime"]), _finite(x["excess_rms"]), _finite(x["z"])
            )
            for x in record["locations"]
        ),
        missing=tuple(_missing_from_dict(m) for m in record["missing"]),
        training=training if training is not None and training.before else None,
        holdout=_gap_from_dict(gap["holdout"], units),
        simulation_gap={k: _gap(g, units) for k, g in record["simulation_gap"].items()},
        trend_gap={label: _gap(g, units) for label, g in record.get("trend_gap", {}).items() if label in IN_WORDS},
        detectability=tuple(
            Detectability(
                d["effect"], d["joint"], float("inf") if d["smallest"] is None else _finite(d["smallest"]), d["unit"],
                _finite(d["absorbed"]), tuple(str(other) for other in d["confusable_with"]),
                tuple((str(x["name"]), _finite(x["value"]), str(x["unit"])) for x in d.get("shapes", [])),
                str(d.get("title", "")),
            )
            for d in record["detectability"]
        ),
        next_experiment=None
        if after is None
        else NextExperiment(
            (str(after["separates"][0]), str(after["separates"][1])), after["excitation"], _finite(after["gain"])
        ),
        warnings=tuple(str(text) for text in record["warnings"]),
        waveforms=None if waves is None else _waveforms_from_dict(waves),
        recording=record.get("recording", ""),
        holdout_source=record.get("holdout"),
        units=units,
    )  # fmt: skip


def _missing_from_dict(m: Mapping[str, Any]) -> MissingEffect:
    unseen = m.get("unseen")
    return MissingEffect(
        effect=m["effect"],
        joint=m["joint"],
        parameters=_parameters_from_dict(m["parameters"]),
        torque_share=_finite(m["torque_share"]),
        p_value=_finite(m["p_value"]),
        alternatives=tuple(Alternative(a["effect"], a["joint"], _finite(a["cos2"])) for a in m["alternatives"]),
        transfer=None if m.get("transfer") is None else _finite(m["transfer"]),
        detail=None if m.get("detail") is None else effect_from_dict(m["detail"]),
        values=tuple(_finite(value) for value in m.get("values", ())),
        unseen=None
        if unseen is None
        else Unseen(unseen["effect"], unseen["joint"], _parameters_from_dict(unseen["parameters"])),
    )


def _parameters_from_dict(records: Iterable[Mapping[str, Any]]) -> tuple[MissingParameter, ...]:
    return tuple(
        MissingParameter(str(p["name"]), _finite(p["value"]), _finite(p["std"]), str(p["unit"])) for p in records
    )


def _finite(value: Any) -> float:
    """A number that can be reckoned with."""
    number = float(value)
    if not abs(number) < _LARGEST:
        raise ValueError(f"{value} is not a number of a diagnosis")
    return number


def _numbers(record: Mapping[str, Any]) -> dict[str, float]:
    return {str(key): _finite(value) for key, value in record.items()}


def _gap_from_dict(record: Mapping[str, Any] | None, units: Mapping[str, str]) -> Gap | None:
    return None if record is None else _gap(record, units)


def _gap(record: Mapping[str, Any], units: Mapping[str, str]) -> Gap:
    before, after, noise = (_numbers(record[key]) for key in ("before", "after", "noise"))
    if not before.keys() == after.keys() == noise.keys():
        raise ValueError("a gap names different joints before and after")
    return Gap(before, after, noise, units)


def _waveforms_from_dict(w: Mapping[str, Any]) -> Waveforms:
    arrays = {name: np.asarray(w[name], dtype=np.float64)
              for name in ("time", "before", "after", "noise", "q", "dtheta", "deflection")}  # fmt: skip
    explained = {name: np.asarray(values, dtype=np.float64) for name, values in w["explained"].items()}
    bands = {name: np.asarray(values, dtype=np.float64) for name, values in w.get("bands", {}).items()}
    return Waveforms(equations=tuple(w["equations"]), explained=explained, bands=bands, **arrays)
