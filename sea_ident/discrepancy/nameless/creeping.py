"""A spring that creeps, which the library does not have: what it carries relaxes with time.

Loading and unloading take two ways, as with dry friction in the spring. What dry friction holds back does not depend on
how fast the spring is bent; what a spring in series with a damper holds back fades with time. In one wave both look
alike, a motion of several tells. Dry friction of another form than that of the library, which hardly slips on its way,
may be more like creep than like that form, so creep is held against dry friction of every width.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects import Column, Contribution, Effect, Shape, Side, State
from sea_ident.effects.acting import Action
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.memory import OneWayEffect
from sea_ident.effects.spring import SpringEffect
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot

_TIMES = 12
"""Time constants that a search tries, ..."""

_SHORTEST = 2.0
"""... from this many samples, below which the spring is damped, to the period, above which it is stiffer [-]."""

_ELEMENTS = 8
"""Elements of dry friction that creep is held against, ..."""

_NARROWEST, _WIDEST = 0.03, 10.0
"""... the widths of which are from and to these shares of half the travel of the spring [-]."""

_BEYOND = 0.3
"""Share of the excess that creep may leave of what these leave [-]."""


@dataclass(frozen=True)
class Creep(SpringEffect):
    """c (d - z) in the spring, tau z' = d - z, d = theta - q: a spring in series with a damper beside it.

    Evaluated over one period of a periodic motion it is in its steady state.

    Attributes:
        joint: joint at which it acts.
        time_constant: tau [s].
    """

    time_constant: float = 0.3

    name: ClassVar[str] = "creep"
    source: ClassVar[str] = "Zener, Elasticity and Anelasticity of Metals, University of Chicago Press, 1948"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("time_constant", "s", 1e-3, 1e2),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column: the stiffness that relaxes."""
        torque, position = self.units_of(robot)
        return (Column(self.parameter_name(), f"{torque}/{position}", self.name, self.joint, self.side, True),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Theta - q, before it relaxes."""
        return (theta - q)[:, None]

    def evaluate(self, state: State) -> Contribution:
        """Link and motor rows (N, n, 1) over one period."""
        time, i = state.motion.time, state.robot.index(self.required_joint)
        step = float(time[-1] - time[0]) / (len(time) - 1)
        frequency = 2j * np.pi * np.fft.rfftfreq(len(time), step)
        passed = self.time_constant * frequency / (1.0 + self.time_constant * frequency)
        relaxed = np.fft.irfft(passed * np.fft.rfft(state.motion.deflection[:, i]), n=len(time))
        return state.at(self.side, self.required_joint, relaxed[:, None])

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """None: it depends on the time before."""
        raise EffectError(f"the effect {self.name!r} cannot be simulated as a torque of the present state")

    def variants(self, state: State) -> tuple["Creep", ...]:
        """Time constants that this motion tells from a damper and from a stiffer spring."""
        time = state.motion.time
        step = float(time[-1] - time[0]) / (len(time) - 1)
        times = np.geomspace(_SHORTEST * step, len(time) * step, _TIMES)
        return tuple(replace(self, time_constant=float(each)) for each in times)

    @property
    def in_words(self) -> str:
        """What it does."""
        relaxing = f"relaxing with time in the spring of {self.joint}"
        return f"{relaxing}, as one that creeps with a time constant of {self.time_constant:.3g} s does"


@dataclass(frozen=True)
class DryFriction(OneWayEffect):
    """Sum of c_k z_k in the spring, z_k' = (d' - |d'| z_k) / w_k: what relaxes with the way that the spring bends.

    Attributes:
        joint: joint at which it acts.
        travel: of the spring [rad] or [m].
    """

    travel: float = 0.02

    name: ClassVar[str] = "dry_friction"
    side: ClassVar[Side] = Side.SPRING
    source: ClassVar[str] = "Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14, 1976"
    memory_size: ClassVar[int] = _ELEMENTS

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column per element."""
        torque, _ = self.units_of(robot)
        names = [self.parameter_name(str(k + 1)) for k in range(_ELEMENTS)]
        return tuple(Column(name, torque, self.name, self.joint, self.side) for name in names)

    @property
    def widths(self) -> FloatArray:
        """(m,) deflection in which each element forgets [rad] or [m]."""
        return 0.5 * self.travel * np.geomspace(_NARROWEST, _WIDEST, _ELEMENTS)

    def path(self, q: FloatArray, theta: FloatArray) -> FloatArray:
        """Theta - q."""
        return theta - q

    def advance(self, memory: tuple[float, ...], distance: float) -> tuple[float, ...]:
        """Towards one or minus one."""
        return tuple(self.advance_all(np.array([memory]), np.array([distance]))[0].tolist())

    def advance_all(self, memory: FloatArray, distances: FloatArray) -> FloatArray:
        """Towards one or minus one."""
        way = np.sign(distances)[:, None]
        return np.asarray(way + (memory - way) * np.exp(-np.abs(distances)[:, None] / self.widths))

    def remembered_columns(self, memory: FloatArray, dtheta: FloatArray) -> FloatArray:
        """All z."""
        return memory


def no_dry_friction(bench: Bench, fit: Fit, position: int, noise: NoiseFloor) -> bool:
    """Whether creep in a model explains much that dry friction of any width in its place does not."""
    creep, effects = fit.effects[position], list(fit.effects)
    motion = bench.state(fit.effects).motion
    travel = float(np.ptp(motion.deflection[:, bench.robot.index(str(creep.joint))]))
    effects[position] = DryFriction(creep.joint, travel)
    rival = bench.fit(effects, noise, start=fit.parameters)
    better = rival.statistic - fit.statistic > EQUALLY_GOOD * fit.unit
    return better and fit.excess < _BEYOND * rival.excess


def creeping(bench: Bench, effect: Effect) -> tuple[Creep, ...]:
    """Creep in the place of what was found in a spring, and in that of a push in every period at any spring."""
    everywhere = isinstance(effect, ExternalForce)
    places = Creep.instances(bench.robot) if everywhere or effect.side is Creep.side else ()
    return tuple(place for place in places if everywhere or place.joint == effect.joint)
