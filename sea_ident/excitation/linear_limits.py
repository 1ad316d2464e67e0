"""Limits that are linear in the Fourier coefficients, and how far they are kept over all time.

Position, velocity, acceleration, jerk and linear combinations of joints are trigonometric polynomials of time. Their
extrema are the real roots of one more trigonometric polynomial, so that a limit is checked for all t and not at
samples.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import ExcitationError
from sea_ident.motion import FourierSeries, fourier_basis
from sea_ident.robot import Limits, Robot

ComplexArray: TypeAlias = NDArray[np.complex128]

# harmonics from which on roots are isolated by bisection, and how often at most
_COMPANION = 40
_BISECTIONS = 24
_KINDS = ("position", "velocity", "acceleration", "jerk")


@dataclass(frozen=True, eq=False)
class LinearLimits:
    """lower <= combination of joints of a derivative of the motion <= upper, for all t.

    Attributes:
        names: (m,) names of the limits.
        joints: (m, n) coefficients of the joints [-].
        derivative: (m,) 0 position .. 3 jerk.
        lower: (m,) lowest value.
        upper: (m,) highest value.
        units: (m,) units of the values.
    """

    names: tuple[str, ...]
    joints: FloatArray
    derivative: IntArray
    lower: FloatArray
    upper: FloatArray
    units: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.names)

    @property
    def width(self) -> FloatArray:
        """(m,) range of each limit; where one side is open, twice the size of the other (at least 1)."""
        both = np.isfinite(self.lower) & np.isfinite(self.upper)
        open_side = 2.0 * np.maximum(np.where(np.isfinite(self.lower), np.abs(self.lower), np.abs(self.upper)), 0.5)
        with np.errstate(invalid="ignore"):
            return np.where(both, self.upper - self.lower, open_side)

    def joint_width(self) -> FloatArray:
        """(n,) width of the position range of each joint, at most 2 pi (or 2 pi m)."""
        reach = np.full(self.joints.shape[1], 2.0 * np.pi)
        for k in np.flatnonzero(self.derivative == 0):
            joints = np.flatnonzero(self.joints[k])
            if len(joints) == 1:
                reach[joints] = np.minimum(reach[joints], self.width[k] / abs(self.joints[k, joints]))
        return reach

    def rows(self, series_shape: tuple[float, int], which: IntArray, time: FloatArray) -> FloatArray:
        """(R, n (2 L + 1)) rows so that ``row @ coefficients.ravel()`` is limit `which` at `time`.

        Args:
            series_shape: base frequency [Hz] and number of harmonics.
            which: (R,) indices of limits.
            time: (R,) [s].
        """
        frequency, harmonics = series_shape
        basis = np.empty((len(time), 2 * harmonics + 1))
        for order in np.unique(self.derivative):
            take = self.derivative[which] == order
            basis[take] = fourier_basis(time[take], frequency, harmonics, int(order))
        return (self.joints[which][:, :, None] * basis[:, None, :]).reshape(len(time), -1)

    def extremes(self, series: FourierSeries) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
        """Exact extremes over all t.

        Args:
            series: the motion.

        Returns:
            (m,) smallest and largest value, and all extrema as (R,) index of limit and (R,) time [s].
        """
        if not len(self):
            empty = np.zeros(0)
            return empty, empty, np.zeros(0, dtype=np.intp), empty
        combined = FourierSeries.from_coefficients(self.joints @ series.coefficients, series.base_frequency)
        return stationary_points(combined, self.derivative)

    def margins(self, series: FourierSeries) -> FloatArray:
        """(m,) smallest distance to each limit over all t; negative outside."""
        low, high, _, _ = self.extremes(series)
        return np.minimum(low - self.lower, self.upper - high)


def stationary_points(
    series: FourierSeries, derivative: IntArray
) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
    """All extrema of trigonometric polynomials.

    The slope sum_l A_l cos l phi + B_l sin l phi, times z^L with z = exp(i phi), is a polynomial of degree 2 L in z:
    the real extrema are its roots on the unit circle, eigenvalues of its companion matrix. As their cost grows with
    L^3, the roots of many harmonics are isolated by bisection instead. Each is polished by Newton's method and a grid
    of 8 points per harmonic is added, so that a root lost to rounding (a double one) costs nothing that could be seen.

    Args:
        series: m polynomials as the joints of a series.
        derivative: (m,) which derivative of each is meant.

    Returns:
        (m,) smallest value, (m,) largest value, and the extrema as (R,) index and (R,) time [s].
    """
    m, harmonics = series.a.shape
    omega = 2.0 * np.pi * series.base_frequency
    order = np.arange(1, harmonics + 1)
    # value(phi) = offset + Re sum_l value_l exp(i l phi); velocity = Re sum (a - i b) exp(i l phi)
    values = (series.a - 1j * series.b) * (1j * omega * order) ** (derivative[:, None] - 1)
    offset = np.where(derivative == 0, series.offset, 0.0)
    slope = values * 1j * order
    grid = 2.0 * np.pi * np.arange(8 * harmonics) / (8 * harmonics)
    which = np.repeat(np.arange(m), len(grid))
    phase = np.tile(grid, m)
    on_grid = (values[which] * np.exp(1j * phase[:, None] * order)).sum(axis=1).real.reshape(m, -1)
    peak = (on_grid >= np.roll(on_grid, 1, axis=1)) & (on_grid >= np.roll(on_grid, -1, axis=1))
    valley = (on_grid <= np.roll(on_grid, 1, axis=1)) & (on_grid <= np.roll(on_grid, -1, axis=1))
    candidates = [(which[(peak | valley).ravel()], phase[(peak | valley).ravel()])]
    size = np.abs(slope).max(axis=1)
    solvable = np.flatnonzero(size > 0.0)
    if harmonics > _COMPANION:
        index, angle = _isolated_roots(slope[solvable])
        candidates.append((solvable[index], angle))
    elif len(solvable):
        polynomial = np.concatenate(
            [slope[solvable][:, ::-1].conj(), np.zeros((len(solvable), 1)), slope[solvable]], axis=1
        )
        polynomial /= size[solvable, None]
        index, angle = _unit_roots(polynomial)
        candidates.append((solvable[index], angle))
    which = np.concatenate([c[0] for c in candidates])
    phase = np.concatenate([c[1] for c in candidates])
    for _ in range(4):
        wave = np.exp(1j * phase[:, None] * order)
        first = (slope[which] * wave).sum(axis=1).real
        second = (slope[which] * 1j * order * wave).sum(axis=1).real
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(second != 0.0, -first / second, 0.0)
        phase = phase + np.clip(step, -0.2 / harmonics, 0.2 / harmonics)
    level = (values[which] * np.exp(1j * phase[:, None] * order)).sum(axis=1).real
    low, high = on_grid.min(axis=1), on_grid.max(axis=1)
    np.minimum.at(low, which, level)
    np.maximum.at(high, which, level)
    time = np.mod(phase, 2.0 * np.pi) / omega
    return low + offset, high + offset, which, time


def _isolated_roots(slope: ComplexArray) -> tuple[IntArray, FloatArray]:
    """Roots of (m, L) trigonometric polynomials ``Re sum_l slope_l exp(i l phi)``: index and angle of each.

    An arc is given up where the polynomial is proven to have no root in it, and kept where its derivative is proven to
    have none, so that there is one root at most; any other is cut in two.
    """
    m, harmonics = slope.shape
    order = np.arange(1, harmonics + 1)
    bend = (np.abs(slope) * order**2).sum(axis=1)  # of the second derivative, at most
    half = np.pi / (8 * harmonics)
    index = np.repeat(np.arange(m), 8 * harmonics)
    angle = np.tile((2.0 * np.arange(8 * harmonics) + 1.0) * half, m)
    found: list[tuple[IntArray, FloatArray]] = []
    for _ in range(_BISECTIONS):
        wave = slope[index] * np.exp(1j * angle[:, None] * order)
        level, tilt = wave.sum(axis=1).real, -(order * wave.imag).sum(axis=1)
        change = half * bend[index]
        possible = np.abs(level) <= half * (np.abs(tilt) + 0.5 * change)
        single = possible & (np.abs(tilt) > change)
        found.append((index[single], angle[single]))
        left = possible & ~single
        half *= 0.5
        index = np.repeat(index[left], 2)
        angle = (angle[left][:, None] + half * np.array([-1.0, 1.0])).ravel()
    found.append((index, angle))
    return np.concatenate([part[0] for part in found]), np.concatenate([part[1] for part in found])


def _unit_roots(polynomial: ComplexArray) -> tuple[IntArray, FloatArray]:
    """Roots near the unit circle of (m, d + 1) polynomials, lowest power first: index and angle of each."""
    m, size = polynomial.shape
    degree = size - 1
    # A vanishing leading coefficient would put eigenvalues at infinity; a trace of it changes no root on the circle
    # by more than rounding.
    lead = polynomial[:, -1]
    safe = np.where(np.abs(lead) > 1e-13, lead, 1e-13)
    companion = np.zeros((m, degree, degree), dtype=complex)
    companion[:, np.arange(1, degree), np.arange(degree - 1)] = 1.0
    companion[:, :, -1] = -polynomial[:, :-1] / safe[:, None]
    roots = np.linalg.eigvals(companion)
    index, place = np.nonzero(np.abs(np.abs(roots) - 1.0) < 1e-2)
    return index, np.angle(roots[index, place])


def linear_limits(robot: Robot, limits: Limits) -> LinearLimits:
    """All limits of a robot that are linear in the motion.

    Args:
        robot: the robot, for names and units.
        limits: its limits.

    Returns:
        Those that limit anything.

    Raises:
        ExcitationError: NaN, or a lower limit at or above its upper limit.
    """
    n = robot.n
    names: list[str] = []
    rows: list[FloatArray] = []
    orders: list[int] = []
    bounds: list[tuple[float, float]] = []
    units: list[str] = []

    def add(name: str, row: FloatArray, order: int, lower: float, upper: float, unit: str) -> None:
        if np.isnan(lower) or np.isnan(upper):
            raise ExcitationError(f"limit {name}: is NaN; give a number, or infinity for no limit")
        if lower > upper or np.isposinf(lower) or np.isneginf(upper):
            raise ExcitationError(f"limit {name}: lower limit {lower:g} {unit} is above upper limit {upper:g} {unit}")
        if lower == upper or upper - lower <= 1e-9 * max(1.0, abs(lower) if np.isfinite(lower) else 1.0):
            raise ExcitationError(f"limit {name}: the range is zero ({upper:g} {unit}); nothing could move. Lock the "
                                  f"joint (joints=...) or widen the limit")  # fmt: skip
        if np.isfinite(lower) or np.isfinite(upper):
            names.append(name)
            rows.append(row)
            orders.append(order)
            bounds.append((lower, upper))
            units.append(unit)

    for i, joint in enumerate(robot.joints):
        unit, row = joint.position_unit, np.eye(n)[i]
        add(f"{joint.name}.position", row, 0, float(limits.lower[i]), float(limits.upper[i]), unit)
        for order, values in ((1, limits.velocity), (2, limits.acceleration), (3, limits.jerk)):
            value = float(values[i])
            suffix = "s" if order == 1 else f"s{order}"
            add(f"{joint.name}.{_KINDS[order]}", row, order, -value, value, f"{unit}/{suffix}")
    for k, name in enumerate(limits.combination_names):
        row = limits.combinations[k]
        unit = robot.joints[int(np.argmax(row != 0.0))].position_unit
        add(name, row, 0, float(limits.combination_lower[k]), float(limits.combination_upper[k]), unit)
    return LinearLimits(
        tuple(names),
        np.array(rows).reshape(len(names), n),
        np.array(orders, dtype=np.intp),
        np.array([b[0] for b in bounds]),
        np.array([b[1] for b in bounds]),
        tuple(units),
    )
