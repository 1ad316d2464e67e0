"""An excitation problem: what is to be told, how well, and inside which limits."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, make_effect
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.criteria import Criterion, log_det
from sea_ident.excitation.curvature_bounds import MotionBounds, proven_margins
from sea_ident.excitation.design_model import DesignModel
from sea_ident.excitation.dynamic_limits import DynamicLimits, dynamic_limits
from sea_ident.excitation.feasibility import at_rest, shrink
from sea_ident.excitation.information import Information
from sea_ident.excitation.limit_checks import as_numbers
from sea_ident.excitation.linear_limits import LinearLimits, linear_limits
from sea_ident.excitation.ramp import Ramp, RampMotion, design_ramp, design_ramp_out
from sea_ident.excitation.rest_position import comfortable_position
from sea_ident.excitation.result import Excitation
from sea_ident.excitation.space_limits import SpaceLimits, space_limits
from sea_ident.excitation.space_proof import TOLERANCE, proven_rooms
from sea_ident.excitation.space_wall import SpaceWall
from sea_ident.excitation.spectral_wall import linear_wall
from sea_ident.excitation.states import Sampling
from sea_ident.excitation.walls import DynamicWall, Wall
from sea_ident.motion import FourierSeries
from sea_ident.robot import Limits, Robot

# points of the walls' grids per harmonic
_LINEAR_POINTS = 32
_DYNAMIC_POINTS = 16
_SPACE_POINTS = 40
# part of torque limits left free for what a proof for all times takes
_RESERVE = 2e-3
# part of the velocity range within which friction turns over for the walls
_TURNING = 0.02


@dataclass(frozen=True, eq=False)
class Problem:
    """A criterion to be raised inside limits.

    Attributes:
        robot: the robot.
        model: the columns.
        criterion: what to raise.
        fine: information at the samples of the result.
        limits: limits that are linear in the coefficients.
        dynamic: limits on torque and deflection.
        space: half-spaces and self-collision.
        walls: all of them, on grids of times.
        centre: (n, 2 L + 1) a trajectory at rest, well inside.
        tolerance_factor: on the gains that are too small to go on for [-].
    """

    robot: Robot
    model: DesignModel
    criterion: Criterion
    fine: Information
    limits: LinearLimits
    dynamic: DynamicLimits
    space: SpaceLimits
    walls: tuple[Wall, ...]
    centre: FloatArray
    tolerance_factor: float = 1.0

    @staticmethod
    def of(
        robot: Robot,
        model: DesignModel,
        criterion: Criterion,
        limits: Limits,
        sampling: Sampling,
        *,
        noise: FloatArray | None,
        collected: FloatArray | None,
        seed: int,
        notes: list[str],
    ) -> "Problem":
        """Check the input and put it together.

        Raises:
            ExcitationError: wrong sizes.
            InfeasibleError: limits that exclude each other.
        """
        weights = _row_weights(model, noise)
        prior = _collected(model, collected)
        fine = Information(model.columns, sampling, 1.0, weights, prior, model.springs)
        linear, dynamic = linear_limits(robot, limits), dynamic_limits(robot, limits, notes)
        space = space_limits(robot, limits, notes)
        frequency, harmonics = sampling.base_frequency, sampling.harmonics
        nonlinear: list[Wall] = []
        if len(dynamic):
            nonlinear.append(
                DynamicWall.of(
                    dynamic.tightened(_RESERVE),
                    frequency,
                    harmonics,
                    _DYNAMIC_POINTS * harmonics,
                    _turning(linear),
                )
            )
        if len(space):
            nonlinear.append(SpaceWall.of(space, frequency, harmonics, _SPACE_POINTS * harmonics))
        position = comfortable_position(
            linear, nonlinear, harmonics, _describer(dynamic, space), np.random.default_rng([seed, 2**31])
        )
        wall = linear_wall(linear, frequency, harmonics, _LINEAR_POINTS * harmonics)
        centre = at_rest(position, harmonics)
        return Problem(robot, model, criterion, fine, linear, dynamic, space, (wall, *nonlinear), centre)

    @property
    def base_frequency(self) -> float:
        """[Hz]."""
        return self.fine.sampling.base_frequency

    @property
    def harmonics(self) -> int:
        """L."""
        return self.fine.sampling.harmonics

    def series(self, coefficients: FloatArray) -> FourierSeries:
        """The motion of (n, 2 L + 1) coefficients."""
        return FourierSeries.from_coefficients(coefficients, self.base_frequency)

    def coarse(self, samples: int, smoothing: FloatArray) -> Information:
        """The information on fewer samples.

        Friction turns over within a few hundredths of a rad/s; on a coarse grid its sign would jump from sample to
        sample. Its smoothing is widened to what the grid can show.

        Args:
            samples: at most so many per period.
            smoothing: (n,) least smoothing of the friction of each joint [rad/s] or [m/s].
        """
        whole = self.fine.sampling.samples
        count = min(samples, whole)
        effects = tuple(_smoothed(effect, self.robot, smoothing) for effect in self.fine.columns.effects)
        return replace(
            self.fine,
            columns=replace(self.fine.columns, effects=effects),
            sampling=replace(self.fine.sampling, samples=count),
            gain=whole / count,
        )

    def value(self, information: Information, coefficients: FloatArray) -> float:
        """The criterion."""
        return self.criterion.value(information.matrix(coefficients))

    def reported(self, coefficients: FloatArray) -> float:
        """The number by which designs are compared."""
        return self.criterion.reported(self.fine.matrix(coefficients))

    def margins(self, coefficients: FloatArray) -> FloatArray:
        """(m,) smallest distance to each linear limit over all t, then what the others are proven to keep."""
        series = self.series(coefficients)
        bounds = MotionBounds.of(series)
        return np.concatenate(
            [
                self.limits.margins(series),
                proven_margins(self.dynamic, series.motion, series.period, bounds),
                proven_rooms(self.space, series.motion, series.period, bounds),
            ]
        )

    @property
    def limit_names(self) -> tuple[str, ...]:
        """(m,) names in the order of `margins`."""
        return (*self.limits.names, *self.dynamic.names, *self.space.names)

    def tolerance(self, criterion: Criterion) -> float:
        """Gain of a step by a criterion that is too small to go on for."""
        return self.tolerance_factor * criterion.tolerance

    def outside(self, coefficients: FloatArray) -> list[str]:
        """Which limits a trajectory violates, and by how much."""
        units = (*self.limits.units, *self.dynamic.units, *(["m"] * len(self.space)))
        margins = self.margins(coefficients)
        order = [int(k) for k in np.argsort(margins, kind="stable") if margins[k] < 0.0]
        return [f"{self.limit_names[k]} by {-margins[k]:.3g} {units[k]}" for k in order]

    def settle(self, coefficients: FloatArray) -> FloatArray:
        """Shrink a trajectory toward rest by the little that it takes to be inside for all t."""

        def shrunk(factor: float) -> FloatArray:
            return self.centre + factor * (coefficients - self.centre)

        largest = 1.0
        while (exact := shrink(self.limits, self.series(shrunk(largest)), self.centre[:, -1])) < 1.0:
            largest *= exact * (1.0 - 1e-13)
        low, high = largest, largest
        step = 1e-4
        while low > 0.0 and float(self.margins(shrunk(low)).min(initial=0.0)) < 0.0:
            low, high = max(0.0, low - step), low
            step *= 3.0
        # between a factor that is inside and one that is not
        while high - low > 1e-4:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if float(self.margins(shrunk(middle)).min()) >= 0.0 else (low, middle)
        return shrunk(low)

    def ramps(self, coefficients: FloatArray, ramp: Ramp) -> tuple[RampMotion, RampMotion]:
        """From rest into a trajectory, and back to rest.

        Raises:
            InfeasibleError: none was found inside the limits.
        """
        series, rest = self.series(coefficients), self.centre[:, -1]
        duration = 0.5 * series.period if ramp.duration is None else ramp.duration
        return (
            design_ramp(series, self.limits, duration, rest, self._allows),
            design_ramp_out(series, self.limits, duration, rest, self._allows),
        )

    def _allows(self, ramp: RampMotion) -> bool:
        """Whether a ramp keeps the limits that are not linear."""
        bounds = MotionBounds.of_ramp(ramp)
        margins = proven_margins(self.dynamic, ramp.motion, ramp.duration, bounds)
        if float(margins.min(initial=0.0)) < 0.0:
            return False
        return float(proven_rooms(self.space, ramp.motion, ramp.duration, bounds).min(initial=0.0)) >= 0.0

    def result(
        self,
        coefficients: FloatArray,
        ramps: tuple[RampMotion | None, RampMotion | None],
        starts: int,
        values: tuple[float, ...],
        seed: int,
        seconds: float,
        notes: tuple[str, ...],
    ) -> Excitation:
        """The excitation of a trajectory."""
        matrix = self.fine.matrix(coefficients)
        eigenvalues = np.linalg.eigvalsh(matrix)
        scale = 1.0 / np.sqrt(np.diag(matrix))
        normalised = np.linalg.eigvalsh(matrix * np.outer(scale, scale))
        bound = self.dynamic.bound
        lower = np.concatenate([self.limits.lower, -bound, self.space.lower])
        upper = np.concatenate([self.limits.upper, bound, self.space.upper])
        margins = self.margins(coefficients)
        return Excitation(
            series=self.series(coefficients),
            joint_names=self.robot.joint_names,
            robot=self.robot.source,
            criterion=self.criterion.describe(),
            value=self.criterion.reported(matrix),
            log_det=log_det(matrix),
            condition_number=float(np.sqrt(normalised[-1] / normalised[0])),
            raw_condition_number=float(np.sqrt(eigenvalues[-1] / eigenvalues[0])),
            parameters=self.model.names,
            samples=self.fine.sampling.samples,
            margins={name: float(value) for name, value in zip(self.limit_names, margins, strict=True)},
            limits={name: (float(lower[k]), float(upper[k])) for k, name in enumerate(self.limit_names)},
            starts=starts,
            start_values=values,
            seed=seed,
            seconds=seconds,
            ramp_in=ramps[0],
            ramp_out=ramps[1],
            warnings=notes,
        )


def _describer(dynamic: DynamicLimits, space: SpaceLimits) -> Callable[[int, float], str]:
    """How a nonlinear limit stands, from its row and the part of its range that is left (negative outside)."""
    rows = len(dynamic) * (2 if dynamic.friction else 1)

    def describe(row: int, part: float) -> str:
        if row >= rows:
            # `part` is what is left of the wall's upper bound
            spent = TOLERANCE * space.size / space.reach
            return space.describe(row - rows, space.reach * (part * (1.0 - spent) + spent))
        k = row % len(dynamic)
        bound, unit = dynamic.bound[k], dynamic.units[k]
        return f"{dynamic.names[k]}: {(1.0 - part) * bound:.4g} {unit}, at most {bound:.4g} {unit}"

    return describe


def _turning(limits: LinearLimits) -> FloatArray:
    """(n,) velocity within which friction turns over for the walls: a small part of the largest one."""
    turning = np.zeros(limits.joints.shape[1])
    for k in np.flatnonzero(limits.derivative == 1):
        turning[limits.joints[k] != 0.0] = _TURNING * limits.upper[k]
    return turning


def _smoothed(effect: Effect, robot: Robot, smoothing: FloatArray) -> Effect:
    own = effect.shape_values.get("smoothing")
    if own is None or effect.joint is None:
        return effect
    widened = {**effect.shape_values, "smoothing": max(own, float(smoothing[robot.index(effect.joint)]))}
    return make_effect(effect.name, effect.joint, **widened)


def _row_weights(model: DesignModel, noise: FloatArray | None) -> FloatArray:
    """(R,) one over the standard deviation of each row."""
    n, rows = model.columns.robot.n, model.columns.rows
    deviation = np.ones(rows) if noise is None else as_numbers("noise", noise)
    if deviation.shape == (n,) and rows == 2 * n:
        deviation = np.tile(deviation, 2)
    if deviation.shape != (rows,) or not np.all(np.isfinite(deviation) & (deviation > 0.0)):
        raise ExcitationError(f"noise must be {n} positive standard deviations [N m], not {noise}")
    return 1.0 / deviation


def _collected(model: DesignModel, collected: FloatArray | None) -> FloatArray:
    """(p, p) information that is there already."""
    p = len(model.columns.chosen)
    prior = np.zeros((p, p)) if collected is None else as_numbers("information", collected)
    if prior.shape != (p, p) or not np.all(np.isfinite(prior)):
        raise ExcitationError(
            f"information is {prior.shape}; it must be a finite ({p}, {p}) matrix about {', '.join(model.names)}"
        )
    prior = 0.5 * (prior + prior.T)
    if float(np.linalg.eigvalsh(prior)[0]) < -1e-9 * float(np.abs(prior).max()):
        raise ExcitationError("information has a negative eigenvalue; it must be positive semidefinite, as F' F is")
    return prior
