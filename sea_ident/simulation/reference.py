"""What the controller follows: a periodic series, or one pass over samples."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from scipy.interpolate import BPoly

from sea_ident._typing import FloatArray
from sea_ident.exceptions import SimulationError
from sea_ident.motion import FourierSeries, Motion
from sea_ident.robot import Robot


@runtime_checkable
class HasSeries(Protocol):
    """Anything with a Fourier series, such as an Excitation."""

    @property
    def series(self) -> FourierSeries:
        """The series."""


class Reference(Protocol):
    """A motion that can be asked for at any time."""

    @property
    def begin(self) -> float:
        """Time at which it starts [s]."""

    @property
    def period(self) -> float | None:
        """Period [s], None where it does not repeat."""

    @property
    def duration(self) -> float:
        """Length of one pass [s]."""

    def motion(self, time: FloatArray) -> Motion:
        """(N, n) rigid motion at the times (N,) [s], counted from `begin`."""


@dataclass(frozen=True, eq=False)
class PeriodicReference:
    """A Fourier series."""

    series: FourierSeries

    @property
    def begin(self) -> float:
        """0 [s]."""
        return 0.0

    @property
    def period(self) -> float | None:
        """Period [s]."""
        return self.series.period

    @property
    def duration(self) -> float:
        """One period [s]."""
        return self.series.period

    def motion(self, time: FloatArray) -> Motion:
        """(N, n) motion."""
        return self.series.motion(time)


class SampledReference:
    """One pass over samples, joined by quintics that keep position, velocity and acceleration of every sample."""

    def __init__(self, motion: Motion) -> None:
        if len(motion) < 2:
            raise SimulationError(f"a reference of {len(motion)} samples cannot be followed; give at least 2")
        self._start = float(motion.time[0])
        values = np.stack([motion.q, motion.dq, motion.ddq], axis=1)
        self._curve = BPoly.from_derivatives(motion.time - self._start, values)
        self._rates = [self._curve.derivative(order) for order in (1, 2)]
        self._duration = float(motion.time[-1]) - self._start

    @property
    def begin(self) -> float:
        """Time of the first sample [s]."""
        return self._start

    @property
    def period(self) -> float | None:
        """It does not repeat."""
        return None

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self._duration

    def motion(self, time: FloatArray) -> Motion:
        """(N, n) motion; beyond the ends the ends are held."""
        inside = np.clip(time, 0.0, self._duration)
        moving = ((time >= 0.0) & (time <= self._duration))[:, None]
        rates = [np.where(moving, rate(inside), 0.0) for rate in self._rates]
        return Motion.rigid(time, self._curve(inside), *rates)


def as_reference(robot: Robot, reference: FourierSeries | HasSeries | Motion) -> Reference:
    """A reference from what `simulate` takes.

    Raises:
        SimulationError: if it does not fit the robot.
    """
    if isinstance(reference, HasSeries):
        names = tuple(getattr(reference, "joint_names", robot.joint_names))
        if names != robot.joint_names:
            raise SimulationError(
                f"the reference was designed for the joints {', '.join(names)}; {robot.name} has "
                f"{', '.join(robot.joint_names)}, and its limits are others: design one for it (excite)"
            )
        reference = reference.series
    if not isinstance(reference, FourierSeries | Motion):
        raise SimulationError(
            f"the reference is a {type(reference).__name__}; give a FourierSeries, an Excitation or a Motion"
        )
    if reference.n != robot.n:
        raise SimulationError(
            f"the reference has {reference.n} joints; {robot.name} has {robot.n}: {', '.join(robot.joint_names)}"
        )
    return PeriodicReference(reference) if isinstance(reference, FourierSeries) else SampledReference(reference)
