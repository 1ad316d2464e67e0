"""Second step: the springs, from the spring torque that the identified dynamic model gives (paper, eqs. 21-23)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.arguments import expect, expect_names
from sea_ident.effects import JointEffect, corrected_motion
from sea_ident.estimation.circularity import circular_factor, circular_note
from sea_ident.estimation.observations import Observations, SpringSide
from sea_ident.estimation.period_scores import period_scores
from sea_ident.estimation.solve import solve_across
from sea_ident.estimation.spring_lack import beside_the_law, spring_lack
from sea_ident.estimation.spring_misfit import spring_misfit
from sea_ident.estimation.spring_result import SpringResult, SpringTerm, Verdict
from sea_ident.estimation.spring_untold import ROUNDING, told_by_rest, untold
from sea_ident.estimation.spring_verdict import held_out_rms, verdict_of
from sea_ident.estimation.uncertainty import FEW_PERIODS, CovarianceKind, Uncertainty
from sea_ident.exceptions import IdentificationError
from sea_ident.motion import Motion
from sea_ident.one_thread import one_thread
from sea_ident.processing import ProcessedRecording
from sea_ident.processing.harmonics import differentiate

if TYPE_CHECKING:
    from sea_ident.estimation.model import Model

DOUBTED = 2.0
"""Standard deviations below which a cubic term may be made by what the law lacks [-]."""


@one_thread
def identify_springs(
    model: "Model", processed: ProcessedRecording, *, unknown_zero: Sequence[str] = ()
) -> tuple[SpringResult, ...]:
    """Identify the springs with a dynamic model that was identified from the same recording.

    Args:
        model: the dynamic model.
        processed: the recording.
        unknown_zero: joints whose encoders of theta and q have different, unknown zeros; the difference is fitted.

    Returns:
        One result for every elastic joint, in the order of the robot, with the further effects that the model has in
        its springs.

    Raises:
        IdentificationError: the spring torque cannot be computed.
        RobotError: `unknown_zero` names a joint that is no elastic joint.
    """
    from sea_ident.estimation.model import Model  # which imports this module

    expect(model, "identify_springs: model", Model)
    expect(processed, "identify_springs: processed", ProcessedRecording)
    observations = Observations(model.robot, model.effects, model.base, processed)
    inside = tuple(effect for effect in model.spring_effects if isinstance(effect, JointEffect))
    return springs_from(observations, model.values, model.uncertainty, unknown_zero, inside)


def springs_from(
    observations: Observations,
    values: FloatArray,
    uncertainty: Uncertainty,
    unknown_zero: Sequence[str] = (),
    effects: Sequence[JointEffect] = (),
) -> tuple[SpringResult, ...]:
    """As `identify_springs`, from observations and the (b,) base parameters found from them.

    Args:
        observations: the recording.
        values: (b,) base parameters.
        uncertainty: of the base parameters.
        unknown_zero: joints with unknown zeros.
        effects: what else is in the springs.
    """
    robot, processed = observations.robot, observations.processed
    elastic = robot.elastic_indices
    expect_names(unknown_zero, "unknown_zero")
    for name in unknown_zero:
        robot.spring(name)
    for effect in effects:
        robot.spring(effect.required_joint)
    if not elastic.size:
        return ()
    if observations.spring_side is SpringSide.NONE:
        raise IdentificationError(
            f"{robot.name}: the base parameters determine neither the link rows nor the motor rows of the elastic "
            "joints, so the spring torque is not known; give priors or record more kinds of motion"
        )
    tau = observations.spring_torque(observations.mean, processed.tau_motor, values)
    # a spring lies between the motor and the bodies, wherever an encoder that errs sees these
    motion = corrected_motion(robot, observations.effects, processed.motion)
    per_period = None
    if processed.periods > 1 and len(uncertainty.influences) == processed.periods:
        per_period = [
            (corrected_motion(robot, observations.effects, own_motion), torque)
            for own_motion, torque in observations.spring_torque_of_periods(values)
        ]
    results = []
    for k, joint in enumerate(elastic):
        name = robot.joint_names[joint]
        own = None if per_period is None else [(each, torque[:, k]) for each, torque in per_period]
        data = _SpringData(
            name,
            int(joint),
            motion,
            tau[:, k],
            observations.mean.spring[:, k],
            own,
            uncertainty,
            tuple(effect for effect in effects if effect.joint == name),
            tuple(len(effect.columns(robot)) for effect in effects if effect.joint == name),
            processed.places,
            processed.link_harmonics if processed.motor_harmonics > processed.link_harmonics else 0,
            robot.joints[joint].position_unit,
            _repeated(processed, int(joint)),
        )
        result = _one_spring(data, name in unknown_zero)
        channels = processed.channels
        torques = [processed.tau_motor[:, joint]]
        if "tau_spring" in channels:
            torques.append(channels["tau_spring"][:, joint])
        deflections = [processed.motion.deflection[:, joint]]
        if "deflection" in channels:
            deflections.append(channels["deflection"][:, joint])
        factor = circular_factor(deflections, torques)
        if factor is not None:
            result = replace(result, verdict=Verdict.CIRCULAR, note=circular_note(factor))
        results.append(result)
    return tuple(results)


def _repeated(processed: ProcessedRecording, joint: int) -> float:
    """Rms of what repeats in the deflection of a joint because of steps of its encoders [rad] or [m]."""
    steps = processed.encoder_steps
    return 0.0 if steps is None else float(np.hypot(steps.link_error[joint], steps.motor_error[joint]))


def spring_from_torque(name: str, joint: int, motion: Motion, torque: FloatArray, unknown_zero: bool) -> SpringResult:
    """A spring from its torque (N,) as it was measured [N m], with the uncertainty that the residual shows."""
    none = np.zeros((1, 1))
    uncertainty = Uncertainty(none, np.inf, CovarianceKind.RESIDUAL, np.zeros((0, 1)), none)
    rows = np.zeros((len(torque), 1))
    return _one_spring(_SpringData(name, joint, motion, torque, rows, None, uncertainty), unknown_zero)


@dataclass(frozen=True, eq=False)
class _SpringData:
    """What is known of one spring: its torque as the dynamic model gives it, with rows (N, b) for its uncertainty.

    `repeated` is the rms of errors of the deflection that are the same in every period, as steps of encoders are.
    `harmonics` are those of q where theta has more, else 0. Harmonics of theta without those of q beside them would be
    deflections that no torque of the link answers.
    """

    name: str
    joint: int
    motion: Motion
    tau: FloatArray
    rows: FloatArray
    per_period: list[tuple[Motion, FloatArray]] | None
    uncertainty: Uncertainty
    effects: tuple[JointEffect, ...] = ()
    widths: tuple[int, ...] = ()
    places: tuple[int, ...] = (0,)
    harmonics: int = 0
    unit: str = "rad"
    repeated: float = 0.0

    def answered(self, table: FloatArray) -> FloatArray:
        """(N, c) columns in the harmonics that q has, too."""
        return differentiate(table, 1.0, self.harmonics)[0] if self.harmonics else table

    def columns(self, motion: Motion, zero: float) -> FloatArray:
        """(N, 3 + k) columns of K1, K3, D and of the other effects."""
        return spring_columns(motion, self.joint, zero, self.effects)

    @property
    def owners(self) -> list[str]:
        """What each column belongs to, in words."""
        own = [e.name for e, width in zip(self.effects, self.widths, strict=True) for _ in range(width)]
        return ["the stiffness", "the cubic stiffness", "the damping", *own, "the zero of the encoders"]

    def left_in_periods(self, values: FloatArray, zero: float) -> FloatArray | None:
        """(P, N) what values (3 + k,) leave of the torque of every period; None without periods."""
        if self.per_period is None:
            return None
        return np.stack([tau - self.columns(motion, zero) @ values for motion, tau in self.per_period])


def spring_columns(motion: Motion, joint: int, zero: float, effects: Sequence[JointEffect] = ()) -> FloatArray:
    """(N, 3 + k) columns of K1, K3, D of the spring of a joint and of further effects in it.

    Args:
        motion: (N, n), as the bodies and the motor move.
        joint: number of the joint.
        zero: difference of the zeros of theta and q [rad] or [m].
        effects: what else is in the spring.
    """
    q, dq = motion.q[:, joint], motion.dq[:, joint]
    theta, dtheta = motion.theta[:, joint] - zero, motion.dtheta[:, joint]
    deflection = theta - q
    law = [deflection, deflection**3, dtheta - dq]
    return np.column_stack([*law, *(effect.local_columns(q, dq, theta, dtheta) for effect in effects)])


def fit_zero(motion: Motion, joint: int, tau: FloatArray) -> float:
    """The difference of zeros [rad] or [m] for which the odd law fits a torque (N,) best: Newton's steps on it."""
    zero = float(np.mean(motion.deflection[:, joint]))
    for _ in range(50):
        columns = spring_columns(motion, joint, zero)
        values = np.linalg.lstsq(columns, tau, rcond=None)[0]
        d = columns[:, 0]
        slope = values[0] + 3.0 * values[1] * d**2
        full = np.column_stack([columns, -slope])
        step = float(np.linalg.lstsq(full, tau - columns @ values, rcond=None)[0][3])
        zero += step
        if abs(step) <= 1e-12 * max(float(np.ptp(d)), 1e-300):
            break
    return zero


def _one_spring(data: _SpringData, unknown_zero: bool) -> SpringResult:
    name, joint, motion, tau = data.name, data.joint, data.motion, data.tau
    zero = fit_zero(motion, joint, tau) if unknown_zero else 0.0
    whole = data.columns(motion, zero)
    columns, count = whole[:, :3], whole.shape[1]
    scale = np.linalg.norm(whole, axis=0)
    if np.any(scale[:3] == 0.0):
        raise IdentificationError(
            f"joint {name!r}: the deflection theta - q is zero throughout; there is no spring in this data"
        )
    if np.any(scale == 0.0):
        raise IdentificationError(
            f"joint {name!r}: this motion does not show {', '.join(e.name for e in data.effects)} in its spring; leave "
            "it out"
        )
    extra = np.zeros((len(tau), 0))
    if unknown_zero:
        guess = np.linalg.lstsq(whole / scale, tau, rcond=None)[0] / scale
        extra = -(guess[0] + 3.0 * guess[1] * columns[:, :1] ** 2)
    values, inverse = _solve(data, zero, extra)
    design = np.column_stack([whole, extra])
    residual = tau - design @ values
    law_values, law_inverse = values[:count], inverse[:count]
    left = data.left_in_periods(law_values, zero)
    full = _covariance(data, law_inverse, left, residual)
    # a verdict is about noise: what the law lacks is no lack of excitation
    noise_std = np.sqrt(np.maximum(np.diag(full), 0.0))
    misfit = lacking = lack = None
    if left is not None:
        repeated = abs(float(law_values[0])) * data.repeated
        misfit = spring_misfit(left, law_inverse, whole, data.rows, data.uncertainty, data.harmonics, repeated)
        if misfit.covariance is not None:
            lacking = misfit.covariance
            beside = beside_the_law(motion, joint, zero, data.unit)
            found = spring_lack(values, left.mean(axis=0), inverse, design, beside, misfit.noise, data.harmonics)
            if found is not None:
                lack, shift = found
                lacking = lacking + np.outer(shift[:count], shift[:count])
            full = full + lacking
    at_rest = told_by_rest(whole, law_values)
    full = full + at_rest @ at_rest.T
    law, covariance = values[:3], full[:3, :3]
    freedom = data.uncertainty.degrees_of_freedom
    std = np.sqrt(np.maximum(np.diag(full), 0.0))
    own = [k for k in range(count) if k != 1]
    linear = np.linalg.lstsq(whole[:, own] / scale[own], tau, rcond=None)[0] / scale[own]
    held_out = held_out_rms(whole, motion, joint, zero, tau)
    spread = f"{np.std(columns[:, 0]):.2g} {data.unit}"
    verdict, note = verdict_of(law, noise_std, freedom, held_out, spread, float(np.std(tau)))
    if lacking is not None and verdict is Verdict.STIFFENING and abs(law[1]) < DOUBTED * std[1]:
        note = f"{note}, which may be what its law lacks"
    return SpringResult(
        joint=name,
        stiffness=float(law[0]),
        stiffness_std=float(std[0]),
        cubic_stiffness=float(law[1]),
        cubic_stiffness_std=float(std[1]),
        damping=float(law[2]),
        damping_std=float(std[2]),
        verdict=verdict,
        covariance=_rows(covariance),
        degrees_of_freedom=float(freedom),
        linear_stiffness=float(linear[0]),
        linear_damping=float(linear[1]),
        zero=float(zero),
        rms_residual=float(np.sqrt(np.mean(residual**2))),
        rms_torque=float(np.sqrt(np.mean(tau**2))),
        largest_deflection=float(np.abs(columns[:, 0]).max()),
        held_out=held_out,
        note=note,
        terms=_terms(data, values, std, np.any(at_rest != 0.0, axis=1)),
        full_covariance=_rows(full) if data.effects else (),
        noise=None if misfit is None else misfit.noise,
        misfit=() if lacking is None else _rows(lacking[:3, :3]),
        lack=lack,
    )


def _rows(table: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(v) for v in row) for row in table)


def _terms(
    data: _SpringData, values: FloatArray, std: FloatArray, by_rest: NDArray[np.bool_]
) -> tuple[SpringTerm, ...]:
    """The effects beyond the law with their values, from those of all columns."""
    found, start = [], 3
    for effect, width in zip(data.effects, data.widths, strict=True):
        own = slice(start, start + width)
        numbers = tuple(map(float, values[own])), tuple(map(float, std[own]))
        found.append(SpringTerm(effect, *numbers, by_rest=bool(np.any(by_rest[own]))))
        start += width
    return tuple(found)


def _solve(data: _SpringData, zero: float, extra: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solve for the law.

    Noise of the deflection, squared, would make the spring look softer. With periods, every product is therefore taken
    between different periods, whose noises are independent. One side of the products has no harmonics beyond those of
    q.

    Args:
        data: the spring.
        zero: difference of the zeros [rad].
        extra: (N, 0 or 1) further column, the same in all periods.

    Returns:
        (c,) values and (c, N) the matrix by which a change of the torque changes them.
    """
    design = np.column_stack([data.columns(data.motion, zero), extra])
    norms = np.linalg.norm(design, axis=0)
    if data.per_period is None:
        unit = design / norms
        nothing = untold(data.name, unit.T @ unit, data.owners)
        if data.harmonics:
            instruments = data.answered(unit)
            inverse = solve_across(instruments.T @ unit, instruments.T, nothing)
        else:
            # products would square how far the columns are from being the same
            inverse = np.linalg.pinv(unit - unit @ nothing @ nothing.T, rcond=ROUNDING**0.5)
        values = inverse @ data.tau
    else:
        periods = len(data.per_period)
        tables = [np.column_stack([data.columns(motion, zero), extra]) / norms for motion, _ in data.per_period]
        torques = [tau for _, tau in data.per_period]
        parts = [data.answered(table) for table in tables]
        table, torque = sum(tables) / periods, sum(torques) / periods
        instruments = np.asarray(sum(parts) / periods, dtype=np.float64)
        own = sum(z.T @ t for z, t in zip(parts, tables, strict=True)) / periods
        side = sum(z.T @ tau for z, tau in zip(parts, torques, strict=True)) / periods
        gram = (periods * instruments.T @ table - own) / (periods - 1.0)
        nothing = np.zeros((len(gram), 0))
        if np.linalg.cond(gram) > 1e12:
            gram, side = instruments.T @ table, instruments.T @ torque
            nothing = untold(data.name, table.T @ table, data.owners)
        else:
            side = (periods * instruments.T @ torque - side) / (periods - 1.0)
        values, inverse = solve_across(gram, side, nothing), solve_across(gram, instruments.T, nothing)
    return values / norms, inverse / norms[:, None]


def _covariance(data: _SpringData, inverse: FloatArray, left: FloatArray | None, residual: FloatArray) -> FloatArray:
    """(3 + k, 3 + k) covariance of K1, K3, D and the other effects, with that of the dynamic model in it.

    Every period moves the law in two ways that are not independent: by its own deflections, and by its share in the
    dynamic model. Both are added up before they are squared.
    """
    uncertainty = data.uncertainty
    step = inverse @ data.rows
    if left is None:
        return np.asarray(
            step @ uncertainty.covariance @ step.T + _residual_covariance(inverse, residual), dtype=np.float64
        )
    periods = len(left)
    factor = periods / (periods - 1.0)
    residuals = left - left.mean(axis=0)
    direct = period_scores(residuals[:, :, None], inverse.T[:, None, :], data.places) / periods
    if uncertainty.kind in (CovarianceKind.PERIODS, CovarianceKind.REMAINDER) and periods >= FEW_PERIODS:
        moves = direct + uncertainty.influences @ step.T
        rest = uncertainty.covariance - uncertainty.repeatability
        return np.asarray(moves.T @ moves * factor + step @ rest @ step.T, dtype=np.float64)
    # few periods: the model's own covariance is better known than from the spread of so few
    return np.asarray(step @ uncertainty.covariance @ step.T + direct.T @ direct * factor, dtype=np.float64)


def _residual_covariance(inverse: FloatArray, residual: FloatArray) -> FloatArray:
    """Covariance from scores of the residual summed over pieces, where there are no periods."""
    pieces = np.array_split(np.arange(len(residual)), min(40, max(len(residual) // 8, 1)))
    scores = np.array([inverse[:, piece] @ residual[piece] for piece in pieces])
    return np.asarray(scores.T @ scores, dtype=np.float64)
