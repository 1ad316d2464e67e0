"""Identification of recordings of any length, in memory that does not grow with them."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import BaseParameters, find_base_parameters
from sea_ident.effects import Effect, base_effects
from sea_ident.estimation.estimators import Estimator, JointWLS, LeastSquares
from sea_ident.estimation.model import Excerpt, Fit, Model
from sea_ident.estimation.observations import Observations, base_rows, friction_is_modelled
from sea_ident.estimation.reduction import Reducer, Triangles
from sea_ident.estimation.solve import Solution, condition_number, solve_triangle
from sea_ident.estimation.springs import springs_from
from sea_ident.estimation.uncertainty import CovarianceKind, Uncertainty, bartlett
from sea_ident.exceptions import IdentificationError
from sea_ident.motion import Motion
from sea_ident.one_thread import one_thread
from sea_ident.processing import ProcessedRecording
from sea_ident.processing.variance import noise_from_curvature
from sea_ident.robot import Robot

BLOCK = 200
"""Samples of a block at first; blocks are joined as they become many."""

EXCERPT = 500
"""Samples that the model keeps at least, where there are as many."""

SPRING_SAMPLES = 20_000
"""Samples from which springs are identified at most."""


@one_thread
def identify_stream(
    robot: Robot,
    chunks: Iterable[tuple[Motion, FloatArray]],
    *,
    effects: Sequence[Effect] | None = None,
    estimator: Estimator | None = None,
    source: str = "stream",
    base: BaseParameters | None = None,
) -> Model:
    """Identify the dynamic model from consecutive pieces of one long recording.

    Only triangles are kept (see `reduction`); the result equals that of the dense solution to rounding. Springs are
    not identified: they need the data a second time (`identify_springs`).

    Args:
        robot: the robot.
        chunks: motion (N, n) and motor torque (N, n) of consecutive pieces.
        effects: the model; bodies, rotors, viscous and Coulomb friction where None.
        estimator: `LeastSquares` or `JointWLS`; the latter where None.
        source: where the data come from, for messages.
        base: base parameters, where they were found already.

    Returns:
        The model, with standard deviations from the correlation of the residual.

    Raises:
        IdentificationError: the data do not determine the model, or the estimator needs more than triangles.
    """
    chosen = tuple(base_effects(robot) if effects is None else effects)
    how = JointWLS() if estimator is None else estimator
    if not isinstance(how, LeastSquares | JointWLS):
        raise IdentificationError(
            f"the estimator {how.name} needs all samples at once; a stream is identified by least_squares or joint_wls"
        )
    base = find_base_parameters(robot, chosen) if base is None else base
    reducer = Reducer(robot, chosen, base, BLOCK)
    keeper = _Keeper(robot.n)
    noise: list[FloatArray] = []
    energy, count = np.zeros(robot.n), 0
    for motion, torque in chunks:
        valid = friction_is_modelled(robot, chosen, motion)
        reducer.add(motion, torque, valid.astype(float))
        keeper.add(motion, torque)
        energy += (torque**2).sum(axis=0)
        count += len(motion)
        if len(motion) >= 3 and len(noise) < 1000:
            noise.append(noise_from_curvature(torque))
    triangles = reducer.triangles()
    solution, uncertainty, covariance = _solve(triangles, isinstance(how, LeastSquares), source)
    plain = triangles.whole(np.ones(robot.n))[:-1, :-1]
    used = np.maximum(triangles.samples.sum(axis=0), 1)
    motion, torque = keeper.thinned()
    predicted = base_rows(robot, chosen, base, motion) @ solution.values
    none = np.zeros((len(motion), 0))
    return Model(
        robot=robot,
        effects=chosen,
        base=base,
        values=solution.values,
        model_covariance=covariance,
        uncertainty=uncertainty,
        information=solution.triangle.T @ solution.triangle,
        estimator=how.name,
        springs=(),
        fit=Fit(
            rms_residual=np.sqrt(triangles.squares(solution.values) / used),
            noise_std=np.sqrt(np.mean(noise, axis=0)) if noise else np.zeros(robot.n),
            rms_torque=np.sqrt(energy / max(count, 1)),
            condition_number=condition_number(plain),
            log_det=2.0 * float(np.log(np.abs(np.diag(plain))).sum()),
            log_det_weighted=solution.log_det,
            samples=count,
            periods=1,
            period=None,
        ),
        excerpt=Excerpt(motion, torque, np.zeros_like(torque), predicted, none, np.zeros_like(torque)),
        recording=source,
        warnings=uncertainty.warnings,
    )


def identify_long(
    observations: Observations, estimator: Estimator, unknown_zero: Sequence[str] = ()
) -> tuple[Model, tuple[str, ...]]:
    """Identify one long stretch: `identify_stream` on its pieces, then the springs from every so many samples.

    Returns:
        The model and its warnings.

    Raises:
        IdentificationError: as `identify_stream`.
    """
    robot, processed = observations.robot, observations.processed
    how = estimator if isinstance(estimator, LeastSquares) else JointWLS()
    model = identify_stream(
        robot,
        _pieces(processed),
        effects=observations.effects,
        estimator=how,
        source=processed.source,
        base=observations.base,
    )
    found = list(model.warnings)
    if not isinstance(estimator, LeastSquares | JointWLS):
        found.append(
            f"{processed.source}: {processed.samples} samples in one stretch are too many for {estimator.name}; "
            "weighted by joint instead"
        )
    thin = _thinned(processed, SPRING_SAMPLES)
    part = Observations(robot, observations.effects, observations.base, thin)
    springs = springs_from(part, model.values, model.uncertainty, unknown_zero)
    return replace(model, springs=springs), tuple(found)


def _pieces(processed: ProcessedRecording) -> Iterator[tuple[Motion, FloatArray]]:
    for start in range(0, processed.samples, 10_000):
        part = slice(start, start + 10_000)
        yield processed.motion[part], processed.tau_motor[part]


def _thinned(processed: ProcessedRecording, samples: int) -> ProcessedRecording:
    step = slice(None, None, max(1, -(-processed.samples // samples)))
    return replace(
        processed,
        motion=processed.motion[step],
        tau_motor=processed.tau_motor[step],
        tau_variance=processed.tau_variance[step],
        raw_tau_variance=processed.raw_tau_variance[step],
        period_tau_motor=processed.period_tau_motor[:, step],
        channels={kind: values[step] for kind, values in processed.channels.items()},
    )


def _solve(triangles: Triangles, plain: bool, source: str) -> tuple[Solution, Uncertainty, FloatArray]:
    """Solution, honest and model-based covariance."""
    n, count = triangles.joints, triangles.count
    used = triangles.samples.sum(axis=0).astype(float)
    weights = np.ones(n)
    try:
        solution = solve_triangle(triangles.whole(weights))
        for _ in range(3):
            squares = triangles.squares(solution.values)
            variance = squares / np.maximum(used - count / n, 1.0)
            if plain:
                variance = np.full(n, squares.sum() / max(used.sum() - count, 1.0))
            variance = np.maximum(variance, 1e-24 * max(float(variance.max()), 1e-300))
            weights = 1.0 / variance
            solution = solve_triangle(triangles.whole(weights))
    except IdentificationError as error:
        raise IdentificationError(f"{source}: {error}") from None
    scores = triangles.scores(solution.values, weights) @ solution.inverse.T
    covariance = bartlett(scores, n)
    low = np.diag(covariance) < np.diag(solution.inverse)
    if np.any(low) and np.all(np.diag(covariance) > 0.0):
        scale = np.where(low, np.sqrt(np.diag(solution.inverse) / np.diag(covariance)), 1.0)
        covariance = covariance * np.outer(scale, scale)
    text = "one stretch of data only: standard deviations rest on the correlation of the residual"
    uncertainty = Uncertainty(
        covariance=covariance,
        degrees_of_freedom=max(len(scores) - 1.0, 1.0),
        kind=CovarianceKind.RESIDUAL,
        influences=np.zeros((0, count)),
        repeatability=covariance,
        warnings=(text,),
    )
    return solution, uncertainty, solution.inverse


class _Keeper:
    """Keeps evenly spaced samples of a stream of unknown length."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._step, self._seen = 1, 0
        self._parts: list[tuple[Motion, FloatArray]] = []
        self._kept = 0

    def add(self, motion: Motion, torque: FloatArray) -> None:
        first = -self._seen % self._step
        self._seen += len(motion)
        if first >= len(motion):
            return
        part = slice(first, None, self._step)
        self._parts.append((motion[part], torque[part].copy()))
        self._kept += len(self._parts[-1][0])
        while self._kept > 2 * EXCERPT:
            motion, torque = self._all()
            self._parts = [(motion[::2], torque[::2])]
            self._kept, self._step = len(torque[::2]), 2 * self._step

    def _all(self) -> tuple[Motion, FloatArray]:
        return Motion.concatenate([m for m, _ in self._parts]), np.concatenate([t for _, t in self._parts])

    def thinned(self) -> tuple[Motion, FloatArray]:
        """(K, n) motion and torque."""
        if not self._parts:
            empty = np.zeros((0, self._n))
            return Motion.rigid(np.zeros(0), empty, empty, empty), empty
        return self._all()
