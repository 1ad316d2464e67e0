"""The demo's numbers, arranged as the paper's tables I and II."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import find_base_parameters
from sea_ident.estimation import Model
from sea_ident.estimation.solve import condition_number, solve_weighted
from sea_ident.excitation import Excitation, reduced_effects
from sea_ident.motion import Motion
from sea_ident.regressor import build_regressor, prior_parameters
from sea_ident.robot import Robot
from sea_ident.validation import Validation


@dataclass(frozen=True)
class ParameterRow:
    """A row of table I.

    Attributes:
        name: of the parameter.
        cad: value of the robot's description; the simulated leg is built from it.
        estimate: identified value.
        std: standard deviation of the estimate.
        unit: of all three.
    """

    name: str
    cad: float
    estimate: float
    std: float
    unit: str


@dataclass(frozen=True)
class PerformanceRow:
    """A row of table II; None where a column does not apply.

    Attributes:
        criterion: what is compared.
        planned: of the optimised trajectory.
        measured: of the trajectory that the links took.
        joint_weighting: with one variance per joint.
        sample_weighting: with one variance per sample.
    """

    criterion: str
    planned: float | None
    measured: float | None
    joint_weighting: float | None
    sample_weighting: float | None


def parameter_table(model: Model) -> tuple[ParameterRow, ...]:
    """Base parameters and springs: value of the description, estimate, standard deviation (paper, table I)."""
    known = model.base.project(prior_parameters(model.robot, model.effects))
    rows = [
        ParameterRow(name, float(known[k]), float(model.values[k]), float(model.std[k]), model.base.units[k])
        for k, name in enumerate(model.base.names)
    ]
    for spring in model.springs:
        actuator = model.robot.spring(spring.joint)
        terms = (
            ("K1", actuator.stiffness, spring.stiffness, spring.stiffness_std, "N m/rad"),
            ("K3", actuator.cubic_stiffness, spring.cubic_stiffness, spring.cubic_stiffness_std, "N m/rad3"),
            ("D", actuator.damping, spring.damping, spring.damping_std, "N m s/rad"),
        )
        rows.extend(
            ParameterRow(f"{spring.joint}.{name}", float("nan") if cad is None else cad, value, std, unit)
            for name, cad, value, std, unit in terms
        )
    return tuple(rows)


def performance_table(
    excitation: Excitation,
    by_joint: Model,
    by_sample: Model,
    gait_by_joint: Validation,
    gait_by_sample: Validation,
    motion: Motion,
    exact_torque: FloatArray,
) -> tuple[PerformanceRow, ...]:
    """Information and prediction of the two weightings (paper, table II).

    Args:
        excitation: what was planned.
        by_joint: model with one torque variance per joint.
        by_sample: model with one torque variance per sample.
        gait_by_joint: prediction of the gait by the former.
        gait_by_sample: prediction of the gait by the latter.
        motion: (N, n) mean measured motion.
        exact_torque: (M, n) torque of the gait without the noise of the sensors, which only a simulation knows [N m].

    Returns:
        The rows. Planned and measured compare the reduced model of eq. 14, the only one known when planning.
    """
    log_det, condition = reduced_information(by_sample.robot, motion)
    rows = [
        PerformanceRow("log det(F'F), reduced model", excitation.log_det, log_det, None, None),
        PerformanceRow("condition number of F, reduced model", excitation.condition_number, condition, None, None),
        PerformanceRow("log det(F'F)", None, by_sample.fit.log_det, None, None),
        PerformanceRow("condition number of F", None, by_sample.fit.condition_number, None, None),
        PerformanceRow(
            "log det(F' Sigma^-1 F)", None, None, by_joint.fit.log_det_weighted, by_sample.fit.log_det_weighted
        ),
    ]
    for i, joint in enumerate(by_sample.robot.joint_names):
        rows.append(
            PerformanceRow(
                f"gait torque rms, {joint} [N m]", None, None,
                float(gait_by_joint.rms[i]), float(gait_by_sample.rms[i]),
            )
        )  # fmt: skip
    pair = (gait_by_joint, gait_by_sample)
    total = [float(np.sqrt(np.mean(v.rms**2))) for v in pair]
    rows.append(PerformanceRow("gait torque rms, all joints [N m]", None, None, total[0], total[1]))
    exact = [float(np.sqrt(np.mean((v.predicted - exact_torque) ** 2))) for v in pair]
    rows.append(PerformanceRow("the same against the exact torque [N m]", None, None, exact[0], exact[1]))
    return tuple(rows)


def reduced_information(robot: Robot, motion: Motion) -> tuple[float, float]:
    """Log det F'F and condition number of the reduced model (paper, eq. 14) over a motion of the links.

    Args:
        robot: the robot.
        motion: (N, n); only the links' part counts.

    Returns:
        Natural log of the determinant, and the condition number of F with normalised columns.
    """
    effects = reduced_effects(robot)
    base = find_base_parameters(robot, effects)
    links = Motion.rigid(motion.time, motion.q, motion.dq, motion.ddq)
    rows: FloatArray = build_regressor(robot, effects, links).sum[:, :, base.independent]
    solution = solve_weighted(rows, np.zeros(rows.shape[:2]))
    return solution.log_det, condition_number(solution.triangle)


def table_text(rows: Sequence[ParameterRow] | Sequence[PerformanceRow]) -> str:
    """A table in plain text, readable as Markdown."""
    records = [asdict(row) for row in rows]
    heads = [key.replace("_", " ") for key in records[0]]
    cells = [[_cell(value) for value in record.values()] for record in records]
    widths = [max(len(row[k]) for row in [heads, *cells]) for k in range(len(heads))]
    left = [isinstance(value, str) for value in records[0].values()]

    def line(row: Sequence[str]) -> str:
        parts = [text.ljust(w) if ll else text.rjust(w) for text, w, ll in zip(row, widths, left, strict=True)]
        return "| " + " | ".join(parts) + " |"

    rule = "|" + "|".join("-" * (w + 1) + ("-" if ll else ":") for w, ll in zip(widths, left, strict=True)) + "|"
    return "\n".join([line(heads), rule, *map(line, cells)])


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value:.5g}"
