"""Full standard parameters that are physically possible, agree with the data, and stay near the robot's description.

Data determine the base parameters only. What they leave free is filled by the values of the description; what they
determine is kept, unless no real bodies have it: then the nearest that real bodies have is taken, in the metric of the
data, and the difference is reported.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects import Column
from sea_ident.estimation.carried_rotors import CarriedRotors, carried_rotors
from sea_ident.estimation.conic import ConicProgram
from sea_ident.estimation.model import Model
from sea_ident.estimation.physical_result import CONSISTENT, Box, PhysicalParameters, Pull
from sea_ident.estimation.pseudo_inertia import pseudo_inertia, pseudo_inertia_basis, reference_pseudo_inertia
from sea_ident.exceptions import IdentificationError
from sea_ident.one_thread import one_thread
from sea_ident.regressor import prior_parameters
from sea_ident.robot import INERTIAL_NAMES, Robot

INTERIOR = 1e-5
"""Every pseudo-inertia is at least this share of that of the description, so that it can be simulated."""


@one_thread
def physical_parameters(
    model: Model, *, pull: Pull = Pull.ENTROPIC, boxes: Mapping[str, Box] | None = None
) -> PhysicalParameters:
    """Find full standard parameters of real bodies that agree with an identified model.

    Every pseudo-inertia is positive definite, rotor inertias and friction are not negative, and a link has room for the
    rotors that it carries where it has in the description. First the base parameters
    nearest to the identified ones (weighted least squares on the reduced data) that such bodies can have; these are the
    identified ones wherever possible. Then, among all bodies with exactly these base parameters, those nearest to the
    description: by the entropic (log-determinant) divergence of the pseudo-inertias, or by Euclidean distance.

    Args:
        model: the identified model.
        pull: what "near" means.
        boxes: space that bodies occupy, by link name; the mass of a body then lies inside.

    Returns:
        The parameters, and by how much and where data and physics disagree.

    Raises:
        IdentificationError: a box belongs to no moving link, or the solver fails.

    References:
        Lee, Wensing, Park, Geometric robot dynamic identification: a convex programming approach, T-RO, 2020.
    """
    problem = _Problem.build(model, boxes or {})
    nearest = problem.nearest(model)
    shift = problem.grouping @ nearest - model.values
    std = np.where(model.std > 0.0, model.std, np.maximum(np.abs(model.values), 1e-12) * 1e-6)
    target = model.values if np.all(np.abs(shift / std) < CONSISTENT) else problem.grouping @ nearest
    values, drawn_by = problem.drawn_or_nearest(target, nearest, pull)
    # below zero by no more than the solver's accuracy
    values[problem.signed] = np.maximum(values[problem.signed], 0.0)
    base_values = problem.grouping @ values
    shift = base_values - model.values
    consistent = bool(np.all(np.abs(shift / std) < CONSISTENT))
    return PhysicalParameters(
        columns=model.base.columns,
        values=values,
        base_values=base_values,
        shift=shift,
        shift_in_std=shift / std,
        chi_square=float(shift @ model.information @ shift),
        bodies=() if consistent else problem.holding_back(model, float(shift @ model.information @ shift)),
        limited=() if consistent else problem.limited(values),
        model=replace(model, values=base_values),
        pull=drawn_by,
    )


@dataclass(frozen=True, eq=False)
class _Problem:
    """What is known of the parameters before the data.

    All in scaled parameters: psi = scale * x.
    """

    columns: tuple[Column, ...]
    grouping: FloatArray
    scale: FloatArray
    prior: FloatArray
    bodies: tuple[str, ...]
    places: tuple[IntArray, ...]
    references: tuple[FloatArray, ...]
    rotors: tuple[CarriedRotors, ...]
    signed: IntArray
    box_rows: FloatArray

    @staticmethod
    def build(model: Model, boxes: Mapping[str, Box]) -> "_Problem":
        robot, columns = model.robot, model.base.columns
        unknown = sorted(set(boxes) - set(robot.bodies))
        if unknown:
            raise IdentificationError(
                f"{robot.name} has no moving link {', '.join(unknown)}; its links are {', '.join(robot.bodies)}"
            )
        names = [column.name for column in columns]
        prior = prior_parameters(robot, model.effects)
        present = [b for b in robot.bodies if f"{b}.m" in names]
        places = tuple(np.array([names.index(f"{b}.{k}") for k in INERTIAL_NAMES], dtype=np.intp) for b in present)
        inertial = np.concatenate(places) if places else np.zeros(0, dtype=np.intp)
        masses = np.array([max(float(prior[place[0]]), 0.0) for place in places])
        mass_scale = float(masses.mean()) if masses.sum() > 0.0 else 1.0
        length = _size(robot)
        scale = np.ones(len(columns))
        guess = np.abs(np.linalg.lstsq(model.base.grouping, model.values, rcond=None)[0])
        for k in range(len(columns)):
            if k not in inertial:
                known = abs(float(prior[k])) if np.isfinite(prior[k]) else 0.0
                scale[k] = max(known, float(guess[k])) or 1.0
        for place in places:
            scale[place] = mass_scale * np.array([1.0] + [length] * 3 + [length**2] * 6)
        references = tuple(
            reference_pseudo_inertia(np.nan_to_num(prior[place]), max(float(masses.sum()), mass_scale), length)
            for place in places
        )
        signed = np.array([k for k, c in enumerate(columns) if c.nonnegative and k not in inertial], dtype=np.intp)
        rows = []
        for body, place in zip(present, places, strict=True):
            if body in boxes:
                rows.extend(_box_rows(boxes[body], place, len(columns)))
        return _Problem(
            columns=columns,
            grouping=model.base.grouping,
            scale=scale,
            prior=prior,
            bodies=tuple(present),
            places=places,
            references=references,
            rotors=carried_rotors(robot, names, present, np.where(np.isfinite(prior), prior, guess), references),
            signed=signed,
            box_rows=np.array(rows).reshape(len(rows), len(columns)),
        )

    def _constrain(self, program: ConicProgram, interior: float, without: str | None) -> None:
        """Pseudo-inertias, signs and boxes; each pseudo-inertia in the metric of its reference, so near unity."""
        for k, body in enumerate(self.bodies):
            if body == without:
                continue
            coefficients = np.zeros((program.size, 4, 4))
            coefficients[: len(self.columns)], offset = self._without_rotors(k)
            program.positive_semidefinite(coefficients, offset - interior * np.eye(4))
        rows = np.zeros((len(self.signed), program.size))
        rows[np.arange(len(self.signed)), self.signed] = 1.0
        program.nonnegative(rows, np.zeros(len(rows)))
        if len(self.box_rows):
            rows = np.zeros((len(self.box_rows), program.size))
            rows[:, : len(self.columns)] = self.box_rows * self.scale
            rows /= np.linalg.norm(rows, axis=1, keepdims=True)
            program.nonnegative(rows, np.zeros(len(rows)))

    def _without_rotors(self, k: int) -> tuple[FloatArray, FloatArray]:
        """(p, 4, 4) and (4, 4): pseudo-inertia of a body without its rotors, of x and constant, near unity."""
        place, rotors = self.places[k], self.rotors[k]
        half = np.linalg.inv(np.linalg.cholesky(self.references[k]))
        coefficients = -rotors.coefficients * self.scale[:, None, None]
        coefficients[place] += pseudo_inertia_basis() * self.scale[place, None, None]
        return half @ coefficients @ half.T, half @ -rotors.constant @ half.T

    def possible(self, values: FloatArray) -> bool:
        """Whether parameters (p,) are those of bodies, beyond what the solver's accuracy lets through."""
        for place, reference in zip(self.places, self.references, strict=True):
            half = np.linalg.inv(np.linalg.cholesky(reference))
            if np.linalg.eigvalsh(half @ pseudo_inertia(values[place]) @ half.T)[0] <= 0.0:
                return False
        return True

    def nearest(self, model: Model, without: str | None = None) -> FloatArray:
        """(p,) possible parameters with base parameters nearest to the identified ones; one body may be let off."""
        program = ConicProgram(len(self.columns))
        triangle = _root(model)
        matrix = triangle @ (self.grouping * self.scale)
        side = triangle @ model.values
        weight = 1.0 / max(float(np.linalg.norm(matrix, axis=0).max()) ** 2, 1e-300)
        known = np.where(np.isfinite(self.prior), self.prior, 0.0) / self.scale
        # a trace of pull only makes the solution unique
        faint = 1e-10
        program.hessian = 2.0 * (weight * matrix.T @ matrix + faint * np.eye(program.size))
        program.gradient = -2.0 * (weight * matrix.T @ side + faint * known)
        self._constrain(program, INTERIOR, without)
        return program.solve("physically possible parameters") * self.scale

    def drawn_or_nearest(self, target: FloatArray, nearest: FloatArray, pull: Pull) -> tuple[FloatArray, Pull | None]:
        """As `drawn`; by the other distance, or not at all, where the solver does not get through."""
        for chosen in dict.fromkeys((pull, Pull.EUCLIDEAN)):
            try:
                found = self.drawn(target, nearest, chosen)
            except IdentificationError:
                continue
            if self.possible(found) or not self.possible(nearest):
                return found, chosen
        return nearest, None

    def drawn(self, target: FloatArray, start: FloatArray, pull: Pull) -> FloatArray:
        """(p,) possible parameters with exactly these base parameters, nearest to the description."""
        count = len(self.columns)
        free = scipy.linalg.null_space(self.grouping * self.scale)
        if not free.shape[1]:
            return start
        # only the free directions are variables: x = particular + free y
        particular = start / self.scale
        correction = np.linalg.lstsq(self.grouping * self.scale, target - self.grouping @ start, rcond=None)[0]
        particular = particular + correction
        inertial = np.zeros(count, dtype=bool)
        for place in self.places:
            inertial[place] = True
        entropic = pull is Pull.ENTROPIC
        pulled = np.isfinite(self.prior) & ~(inertial & entropic)
        goal = np.where(np.isfinite(self.prior), self.prior, 0.0) / self.scale
        m = free.shape[1]
        program = ConicProgram(m + (14 * len(self.places) if entropic else 0))
        gain = free[pulled]
        program.hessian[:m, :m] = 2.0 * gain.T @ gain + 1e-12 * np.eye(m)
        program.gradient[:m] = 2.0 * gain.T @ (particular - goal)[pulled]
        basis = pseudo_inertia_basis()
        for k, (place, reference) in enumerate(zip(self.places, self.references, strict=True)):
            half = np.linalg.inv(np.linalg.cholesky(reference))
            shaped = half @ (basis * self.scale[place, None, None]) @ half.T
            along = np.einsum("cm,cij->mij", free[place], shaped)
            offset = np.einsum("c,cij->ij", particular[place], shaped)
            coefficients = np.zeros((program.size, 4, 4))
            coefficients[:m] = along
            if entropic:
                program.gradient[:m] += np.trace(along, axis1=1, axis2=2)
                _log_det(program, coefficients, offset, m + 14 * k)
            if not entropic or self.rotors[k].any:
                whole, constant = self._without_rotors(k)
                coefficients = np.zeros((program.size, 4, 4))
                coefficients[:m] = np.einsum("cm,cij->mij", free, whole)
                constant = constant + np.einsum("c,cij->ij", particular, whole)
                program.positive_semidefinite(coefficients, constant - 0.1 * INTERIOR * np.eye(4))
        rows = np.zeros((len(self.signed), program.size))
        rows[:, :m] = free[self.signed]
        # parameters that the data hold at zero are there already; a hair of slack keeps the problem solvable
        moved = np.abs(rows).max(axis=1, initial=0.0) > 1e-12
        program.nonnegative(rows[moved], np.maximum(particular[self.signed], 0.0)[moved] + 1e-9)
        if len(self.box_rows):
            scaled = self.box_rows * self.scale
            norms = np.linalg.norm(scaled, axis=1, keepdims=True)
            rows = np.zeros((len(scaled), program.size))
            rows[:, :m] = scaled @ free / norms
            program.nonnegative(rows, (scaled @ particular)[:, None].ravel() / norms.ravel() + 1e-9)
        y = program.solve("parameters nearest to the description")[:m]
        values = (particular + free @ y) * self.scale
        return np.asarray(values, dtype=np.float64)

    def holding_back(self, model: Model, chi_square: float) -> tuple[str, ...]:
        """Bodies without whose own limits the data could be met much better, the strongest first."""
        gains = {}
        for body in self.bodies:
            shift = self.grouping @ self.nearest(model, without=body) - model.values
            gains[body] = 1.0 - float(shift @ model.information @ shift) / max(chi_square, 1e-300)
        return tuple(sorted((body for body in gains if gains[body] > 0.1), key=lambda body: -gains[body]))

    def limited(self, values: FloatArray) -> tuple[str, ...]:
        """Other parameters at zero."""
        return tuple(self.columns[k].name for k in self.signed if values[k] < 1e-6 * self.scale[k])


def _root(model: Model) -> FloatArray:
    """(b, b) upper triangular root of the information F' Sigma^-1 F."""
    norms = np.sqrt(np.maximum(np.diag(model.information), 1e-300))
    scaled = model.information / np.outer(norms, norms)
    values, vectors = np.linalg.eigh(scaled)
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return np.asarray(root * norms, dtype=np.float64)


def _size(robot: Robot) -> float:
    """A length typical of the links [m]: the mean distance between joints and of centres of mass from them."""
    placements = [np.linalg.norm(robot.model.jointPlacements[k].translation) for k in range(2, robot.model.njoints)]
    levers = [np.linalg.norm(robot.model.inertias[k].lever) for k in range(1, robot.model.njoints)]
    lengths = [float(v) for v in (*placements, *levers) if v > 1e-3]
    return float(np.mean(lengths)) if lengths else 0.1


def _box_rows(box: Box, place: IntArray, count: int) -> list[FloatArray]:
    """Rows that are >= 0 where mass lies between two planes across every axis: int (x - l)(u - x) dm >= 0."""
    basis = pseudo_inertia_basis()
    rows = []
    for axis in range(3):
        low, high = float(box.lower[axis]), float(box.upper[axis])
        if not low < high:
            raise IdentificationError(f"a box has lower {low} and upper {high} m; lower must be below upper")
        row = np.zeros(count)
        row[place] = -basis[:, axis, axis] + (low + high) * basis[:, axis, 3] - low * high * basis[:, 3, 3]
        rows.append(row)
    return rows


def _log_det(program: ConicProgram, coefficients: FloatArray, offset: FloatArray, start: int) -> None:
    """Subtract log det of a (4, 4) affine matrix M from the objective.

    log det M = max sum log d_i  subject to  [[M, Z], [Z', diag d]] >= 0 with Z lower triangular and d its diagonal;
    every log d_i is a variable of its own, below the exponential cone. Variables: 10 of Z, then 4 logarithms.
    """
    size = program.size
    big = np.zeros((size, 8, 8))
    big[:, :4, :4] = coefficients
    shift = np.zeros((8, 8))
    shift[:4, :4] = offset
    index = start
    diagonal = {}
    for i in range(4):
        for j in range(i + 1):
            big[index, i, 4 + j] = big[index, 4 + j, i] = 1.0
            if i == j:
                big[index, 4 + i, 4 + i] = 1.0
                diagonal[i] = index
            index += 1
    program.positive_semidefinite(big, shift)
    for i in range(4):
        rows = np.zeros((3, size))
        rows[0, index + i] = 1.0
        rows[2, diagonal[i]] = 1.0
        program.exponential(rows, np.array([0.0, 1.0, 0.0]))
        program.gradient[index + i] -= 1.0
