"""Motion of a robot as samples, and as the Fourier series that excites it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import SeaIdentError


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions, velocities and accelerations of links and motors.

    Attributes:
        time: (N,) [s].
        q: (N, n) link positions [rad] or [m].
        dq: (N, n) link velocities [rad/s] or [m/s].
        ddq: (N, n) link accelerations [rad/s2] or [m/s2].
        theta: (N, n) motor positions after the gear; equal to q at a rigid joint.
        dtheta: (N, n) motor velocities after the gear.
        ddtheta: (N, n) motor accelerations after the gear.
    """

    time: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    theta: FloatArray
    dtheta: FloatArray
    ddtheta: FloatArray

    def __post_init__(self) -> None:
        if self.q.ndim != 2 or self.time.shape != self.q.shape[:1]:
            raise SeaIdentError(f"motion: time is {self.time.shape} and q is {self.q.shape}; give (N,) and (N, n)")
        for name in ("dq", "ddq", "theta", "dtheta", "ddtheta"):
            shape = getattr(self, name).shape
            if shape != self.q.shape:
                raise SeaIdentError(f"motion: {name} is {shape}, q is {self.q.shape}; both must be (N, n)")

    @staticmethod
    def rigid(time: FloatArray, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> "Motion":
        """A motion in which every motor follows its link: theta = q."""
        return Motion(time, q, dq, ddq, q, dq, ddq)

    def __len__(self) -> int:
        return int(self.time.shape[0])

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @property
    def deflection(self) -> FloatArray:
        """(N, n) theta - q [rad] or [m]."""
        return self.theta - self.q

    @property
    def deflection_rate(self) -> FloatArray:
        """(N, n) theta' - q' [rad/s] or [m/s]."""
        return self.dtheta - self.dq

    def __getitem__(self, rows: slice | FloatArray | IntArray) -> "Motion":
        """Part of the samples."""
        return Motion(
            self.time[rows], self.q[rows], self.dq[rows], self.ddq[rows],
            self.theta[rows], self.dtheta[rows], self.ddtheta[rows],
        )  # fmt: skip

    def plus(self, errors: FloatArray) -> "Motion":
        """The motion with errors (6, N, n) of q, q', q'', theta, theta', theta'' added."""
        parts = (self.q, self.dq, self.ddq, self.theta, self.dtheta, self.ddtheta)
        return Motion(self.time, *(part + error for part, error in zip(parts, errors, strict=True)))

    def chunks(self, size: int) -> Iterator["Motion"]:
        """Consecutive parts of at most `size` samples."""
        for start in range(0, len(self), size):
            yield self[start : start + size]

    @staticmethod
    def mean(parts: "Sequence[Motion]") -> "Motion":
        """The mean of motions over the same times."""
        names = ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")
        return Motion(parts[0].time, *(np.mean([getattr(part, name) for part in parts], axis=0) for name in names))

    @staticmethod
    def concatenate(parts: "list[Motion]") -> "Motion":
        """One motion after the other; time is kept as it is in each."""
        names = ("time", "q", "dq", "ddq", "theta", "dtheta", "ddtheta")
        return Motion(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


@dataclass(frozen=True, eq=False)
class FourierSeries:
    """A periodic motion of n joints (paper, eqs. 15-17).

    q_i(t)  = q0_i + sum_l a_il / (w l) sin(w l t) - b_il / (w l) cos(w l t),   w = 2 pi base_frequency
    q_i'(t) =        sum_l a_il cos(w l t) + b_il sin(w l t)

    Attributes:
        base_frequency: [Hz].
        offset: (n,) q0 [rad] or [m].
        a: (n, L) cosine coefficients of the velocity [rad/s] or [m/s].
        b: (n, L) sine coefficients of the velocity [rad/s] or [m/s].
    """

    base_frequency: float
    offset: FloatArray
    a: FloatArray
    b: FloatArray

    def __post_init__(self) -> None:
        if not self.base_frequency > 0.0:
            raise SeaIdentError(f"the base frequency of a Fourier series is {self.base_frequency} Hz; it must be > 0")
        if self.a.ndim != 2 or self.a.shape != self.b.shape or self.offset.shape != self.a.shape[:1]:
            raise SeaIdentError(
                f"Fourier series: offset {self.offset.shape}, a {self.a.shape}, b {self.b.shape}; "
                f"give (n,), (n, L), (n, L)"
            )

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.a.shape[0])

    @property
    def harmonics(self) -> int:
        """Number of harmonics L."""
        return int(self.a.shape[1])

    @property
    def period(self) -> float:
        """Period [s]."""
        return 1.0 / self.base_frequency

    @property
    def coefficients(self) -> FloatArray:
        """(n, 2 L + 1) per joint: a_1..a_L, b_1..b_L, q0."""
        return np.concatenate([self.a, self.b, self.offset[:, None]], axis=1)

    @staticmethod
    def from_coefficients(coefficients: FloatArray, base_frequency: float) -> "FourierSeries":
        """The series of (n, 2 L + 1) coefficients in the order of `coefficients`."""
        harmonics = (coefficients.shape[1] - 1) // 2
        return FourierSeries(
            base_frequency,
            coefficients[:, -1].copy(),
            coefficients[:, :harmonics].copy(),
            coefficients[:, harmonics : 2 * harmonics].copy(),
        )

    def evaluate(self, time: FloatArray, derivative: int = 0) -> FloatArray:
        """(N, n) values of a derivative (0 position .. 3 jerk) at the times (N,) [s]."""
        basis = fourier_basis(time, self.base_frequency, self.harmonics, derivative)
        values: FloatArray = basis @ self.coefficients.T
        return values

    def sample(self, rate: float | None = None, *, samples: int | None = None) -> Motion:
        """One period as a rigid motion (theta = q).

        Args:
            rate: samples per second [Hz]; a whole number of samples per period is taken.
            samples: samples per period, instead of `rate`.

        Returns:
            The motion at ``samples`` equidistant times from 0, the end of the period not included.
        """
        if samples is None:
            samples = round((rate or 200.0) * self.period)
        time: FloatArray = np.arange(samples, dtype=np.float64) * (self.period / samples)
        return self.motion(time)

    def motion(self, time: FloatArray) -> Motion:
        """The rigid motion (theta = q) at the times (N,) [s]."""
        return Motion.rigid(time, *(self.evaluate(time, derivative) for derivative in range(3)))

    @staticmethod
    def fit(time: FloatArray, values: FloatArray, base_frequency: float, harmonics: int) -> "FourierSeries":
        """Least-squares fit to samples.

        Args:
            time: (N,) [s].
            values: (N, n) positions [rad] or [m].
            base_frequency: [Hz].
            harmonics: number of harmonics L; 2 L + 1 must not exceed N.

        Returns:
            The series.

        Raises:
            SeaIdentError: if there are fewer samples than coefficients.
        """
        if 2 * harmonics + 1 > len(time):
            raise SeaIdentError(f"{harmonics} harmonics need at least {2 * harmonics + 1} samples, not {len(time)}")
        # Position coefficients are of like size; velocity coefficients grow with the harmonic and condition badly.
        scale = 2.0 * np.pi * base_frequency * np.arange(1, harmonics + 1)
        basis = fourier_basis(time, base_frequency, harmonics, 0)
        basis[:, : 2 * harmonics] *= np.tile(scale, 2)
        solution: FloatArray = np.asarray(np.linalg.lstsq(basis, values, rcond=None)[0].T, dtype=np.float64)
        solution[:, : 2 * harmonics] *= np.tile(scale, 2)
        return FourierSeries.from_coefficients(solution, base_frequency)


def fourier_basis(time: FloatArray, base_frequency: float, harmonics: int, derivative: int = 0) -> FloatArray:
    """Values of the basis functions of a Fourier series.

    Args:
        time: (N,) [s].
        base_frequency: [Hz].
        harmonics: L.
        derivative: 0 position, 1 velocity, 2 acceleration, 3 jerk, ...

    Returns:
        (N, 2 L + 1) so that ``basis @ coefficients`` is the derivative (paper, eqs. 15-17).
    """
    frequency = 2.0 * np.pi * base_frequency * np.arange(1, harmonics + 1)
    phase = np.outer(time, frequency)
    # velocity = a cos + b sin; each further derivative turns both by a quarter period
    turn = (derivative - 1) * (np.pi / 2.0)
    gain = frequency ** (derivative - 1)
    offset = np.full((len(time), 1), 1.0 if derivative == 0 else 0.0)
    return np.concatenate([gain * np.cos(phase + turn), gain * np.sin(phase + turn), offset], axis=1)
