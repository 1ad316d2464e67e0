"""An excitation problem: what is to be told, how well, and inside which limits."""

from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import BaseParameters
from sea_ident.effects import Effect, make_effect
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.columns import ModelColumns
from sea_ident.excitation.criteria import Criterion
from sea_ident.excitation.dynamic_limits import DynamicLimits, dynamic_limits
from sea_ident.excitation.feasibility import at_rest, comfortable_position, shrink
from sea_ident.excitation.information import Information
from sea_ident.excitation.linear_limits import LinearLimits, linear_limits
from sea_ident.excitation.result import Excitation
from sea_ident.excitation.walls import DynamicWall, LinearWall, Wall
from sea_ident.motion import FourierSeries
from sea_ident.robot import Limits, Robot

# points of the walls' grids per harmonic
_LINEAR_POINTS = 32
_DYNAMIC_POINTS = 16
_CHECK_POINTS = 200


@dataclass(frozen=True, eq=False)
class Problem:
    """A criterion to be raised inside limits.

    Attributes:
        robot: the robot.
        base: base parameters of the model.
        criterion: what to raise.
        fine: information at the samples of the result.
        limits: limits that are linear in the coefficients.
        dynamic: limits on torque and deflection.
        walls: both, on grids of times.
        centre: (n, 2 L + 1) a trajectory at rest, well inside.
    """

    robot: Robot
    base: BaseParameters
    criterion: Criterion
    fine: Information
    limits: LinearLimits
    dynamic: DynamicLimits
    walls: tuple[Wall, ...]
    centre: FloatArray

    @staticmethod
    def of(
        robot: Robot,
        effects: tuple[Effect, ...],
        base: BaseParameters,
        criterion: Criterion,
        limits: Limits,
        *,
        base_frequency: float,
        harmonics: int,
        samples: int,
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
        weights, prior = _check_weights(robot, base, noise, collected)
        columns = ModelColumns(robot, effects, base.independent)
        fine = Information(columns, base_frequency, harmonics, samples, 1.0, weights, prior)
        linear, dynamic = linear_limits(robot, limits), dynamic_limits(robot, limits, notes)
        nonlinear: list[Wall] = []
        if len(dynamic):
            nonlinear.append(DynamicWall.of(dynamic, base_frequency, harmonics, _DYNAMIC_POINTS * harmonics))
        position = comfortable_position(
            linear, nonlinear, harmonics, dynamic.names, np.random.default_rng([seed, 2**31])
        )
        wall = LinearWall.of(linear, base_frequency, harmonics, _LINEAR_POINTS * harmonics)
        return Problem(robot, base, criterion, fine, linear, dynamic, (wall, *nonlinear), at_rest(position, harmonics))

    @property
    def base_frequency(self) -> float:
        """[Hz]."""
        return self.fine.base_frequency

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
        count = min(samples, self.fine.samples)
        effects = tuple(_smoothed(effect, self.robot, smoothing) for effect in self.fine.columns.effects)
        return replace(
            self.fine,
            columns=replace(self.fine.columns, effects=effects),
            samples=count,
            gain=self.fine.samples / count,
        )

    def value(self, information: Information, coefficients: FloatArray) -> float:
        """The criterion."""
        return self.criterion.value(information.eigenvalues(coefficients))

    def margins(self, coefficients: FloatArray) -> FloatArray:
        """(m,) smallest distance to each linear limit over all t, then to each dynamic limit."""
        linear = self.limits.margins(self.series(coefficients))
        if not len(self.dynamic):
            return linear
        points = _CHECK_POINTS * self.fine.harmonics
        wall = DynamicWall.of(self.dynamic, self.base_frequency, self.fine.harmonics, points)
        values = wall.values(coefficients)
        below, above = wall.overshoot(values)
        room = np.minimum(values - below - wall.lower, wall.upper - values - above).min(axis=1)
        return np.concatenate([linear, room])

    def settle(self, coefficients: FloatArray) -> FloatArray:
        """Shrink a trajectory toward rest by the little that it takes to be inside for all t."""
        factor = 1.0
        for _ in range(60):
            trial = self.centre + factor * (coefficients - self.centre)
            exact = shrink(self.limits, self.series(trial), self.centre[:, -1])
            if exact < 1.0:
                factor *= exact * (1.0 - 1e-13)
                continue
            worst = float(self.margins(trial).min(initial=0.0))
            if worst >= 0.0:
                return trial
            factor *= 1.0 - 1e-4 if worst > -1e-3 else 1.0 - 1e-2
        return self.centre

    def result(
        self,
        coefficients: FloatArray,
        starts: int,
        values: tuple[float, ...],
        seed: int,
        seconds: float,
        notes: tuple[str, ...],
    ) -> Excitation:
        """The excitation of a trajectory."""
        matrix = self.fine.matrix(coefficients)
        eigenvalues = self.fine.eigenvalues(coefficients)
        scale = 1.0 / np.sqrt(np.diag(matrix))
        normalised = np.linalg.eigvalsh(matrix * np.outer(scale, scale))
        bound = self.dynamic.bound
        names = (*self.limits.names, *self.dynamic.names)
        lower, upper = np.concatenate([self.limits.lower, -bound]), np.concatenate([self.limits.upper, bound])
        margins = self.margins(coefficients)
        return Excitation(
            series=self.series(coefficients),
            joint_names=self.robot.joint_names,
            robot=self.robot.source,
            criterion=self.criterion.name,
            value=self.criterion.reported(eigenvalues),
            log_det=float(np.log(eigenvalues).sum()),
            condition_number=float(np.sqrt(normalised[-1] / normalised[0])),
            raw_condition_number=float(np.sqrt(eigenvalues[-1] / eigenvalues[0])),
            parameters=self.base.names,
            samples=self.fine.samples,
            margins={name: float(value) for name, value in zip(names, margins, strict=True)},
            limits={name: (float(lower[k]), float(upper[k])) for k, name in enumerate(names)},
            starts=starts,
            start_values=values,
            seed=seed,
            seconds=seconds,
            warnings=notes,
        )


def _smoothed(effect: Effect, robot: Robot, smoothing: FloatArray) -> Effect:
    own = effect.shape_values.get("smoothing")
    if own is None or effect.joint is None:
        return effect
    widened = {**effect.shape_values, "smoothing": max(own, float(smoothing[robot.index(effect.joint)]))}
    return make_effect(effect.name, effect.joint, **widened)


def _check_weights(
    robot: Robot, base: BaseParameters, noise: FloatArray | None, collected: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """(n,) weight of each row, and (p, p) information that is there already."""
    p = base.rank
    prior = np.zeros((p, p)) if collected is None else np.asarray(collected, dtype=np.float64)
    if prior.shape != (p, p) or not np.all(np.isfinite(prior)):
        raise ExcitationError(
            f"information is {prior.shape}; it must be a finite ({p}, {p}) matrix about {', '.join(base.names)}"
        )
    if float(np.linalg.eigvalsh(prior + prior.T)[0]) < -1e-6 * max(float(np.abs(prior).max()), 1e-300):
        raise ExcitationError("information has a negative eigenvalue; it must be positive semidefinite, as F' F")
    deviation = np.ones(robot.n) if noise is None else np.asarray(noise, dtype=np.float64)
    if deviation.shape != (robot.n,) or not np.all(np.isfinite(deviation) & (deviation > 0.0)):
        raise ExcitationError(f"noise must be {robot.n} positive standard deviations [N m], not {deviation}")
    return 1.0 / deviation, 0.5 * (prior + prior.T)
