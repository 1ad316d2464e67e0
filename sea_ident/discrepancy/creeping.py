"""A spring that creeps, which the library does not have: what it carries relaxes with time.

Loading and unloading take two ways, as with dry friction in the spring. What dry friction holds back does not depend on
how fast the spring is bent; what a spring in series with a damper holds back fades with time. In one wave both look
alike, a motion of several tells.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.effects import Column, Contribution, Effect, Shape, State
from sea_ident.effects.acting import Action
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.spring import SpringEffect
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot

_TIMES = 12
"""Time constants that a search tries, ..."""

_SHORTEST = 2.0
"""... from this many samples, below which the spring is damped, to the period, above which it is stiffer [-]."""


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


def creeping(bench: Bench, effect: Effect) -> tuple[Creep, ...]:
    """Creep in the place of what was found in a spring, and in that of a push in every period at any spring."""
    everywhere = isinstance(effect, ExternalForce)
    places = Creep.instances(bench.robot) if everywhere or effect.side is Creep.side else ()
    return tuple(place for place in places if everywhere or place.joint == effect.joint)
