"""What an effect is.

An effect is one physical cause. It declares the columns that it adds to the regressor, computes them from the state
of the robot, and can act in a simulation. Rigid bodies, rotors and friction are effects like any other.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any, ClassVar, Self

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, JointAction, SimulationState
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.motion import Motion
from sea_ident.robot import Robot

AT_ALL_JOINTS = ("position_delay", "torque_delay")
"""Effects that are at every joint where they are given none, and not in the base."""


@dataclass(frozen=True)
class Column:
    """A column of the regressor, which always carries its name.

    Attributes:
        name: name of its parameter, unique within a model.
        unit: unit of its parameter.
        effect: name of the effect that adds it.
        joint: joint that it belongs to, None where it belongs to no single joint.
        side: where it enters.
        nonnegative: whether a negative value is physically impossible.
    """

    name: str
    unit: str
    effect: str
    joint: str | None
    side: Side
    nonnegative: bool = False


@dataclass(frozen=True)
class Shape:
    """A parameter that enters nonlinearly.

    Attributes:
        name: name of the attribute of the effect.
        unit: unit.
        lower: smallest value that makes physical sense.
        upper: largest value that makes physical sense.
        logarithmic: whether a search should step by factors rather than differences.
        points: number of values that a search tries before it refines the best.
    """

    name: str
    unit: str
    lower: float
    upper: float
    logarithmic: bool = True
    points: int = 6

    def grid(self, points: int | None = None) -> FloatArray:
        """(points,) values from `lower` to `upper`; `points` of the shape by default."""
        points = self.points if points is None else points
        if self.logarithmic:
            return np.geomspace(self.lower, self.upper, points)
        return np.linspace(self.lower, self.upper, points)


@dataclass(frozen=True, eq=False)
class Anchor:
    """What the rest of a model says, for effects whose columns depend on it (the load of a joint, its friction).

    Attributes:
        robot: the robot.
        effects: effects of the model.
        parameters: value of every parameter by name; what is not in it counts as zero.
    """

    robot: Robot
    effects: tuple["Effect", ...]
    parameters: Mapping[str, float]

    def value(self, name: str) -> float:
        """Value of one parameter, 0 where the model has no such parameter."""
        return float(self.parameters.get(name, 0.0))

    def inertial(self) -> tuple[float, ...]:
        """(10 b,) standard inertial parameters, body by body."""
        return tuple(self.value(name) for name in self.robot.inertial_names)

    def smoothing(self, joint: str) -> float | None:
        """v_off of the Coulomb friction of a joint [rad/s], None where the model has none."""
        for effect in self.effects:
            if effect.joint == joint and effect.name == "coulomb_friction":
                return effect.shape_values.get("smoothing")
        return None


@dataclass(frozen=True)
class Effect(ABC):
    """One physical cause; subclasses live in one file each.

    Attributes:
        joint: joint at which it acts, None where it acts on the whole robot.
    """

    joint: str | None = None

    name: ClassVar[str]
    side: ClassVar[Side]
    source: ClassVar[str]
    shapes: ClassVar[tuple[Shape, ...]] = ()
    depth: ClassVar[int] = 0
    """Place on the way from what is recorded to the bodies: an encoder errs before the link bends behind it."""
    depends_on: ClassVar[tuple[str, ...]] = ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")
    """Parts of a motion that its columns depend on; a design takes no derivatives by the others."""

    @abstractmethod
    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """The columns that it adds to the regressor of this robot."""

    @abstractmethod
    def evaluate(self, state: State) -> Contribution:
        """Link and motor rows (N, n, k) of its columns, in the order of `columns`."""

    @classmethod
    def instances(cls, robot: Robot) -> tuple["Effect", ...]:
        """All the places at which it can act on this robot; by default once at every joint."""
        return tuple(cls(joint=name) for name in robot.joint_names)

    def prior(self, robot: Robot) -> FloatArray:
        """(k,) values that the robot's description gives to its parameters, NaN where it gives none."""
        return np.full(len(self.columns(robot)), np.nan)

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """How it acts in a simulation.

        Args:
            robot: the robot.
            values: (k,) values of its parameters.

        Returns:
            A function that adds its torque to the link rows (n,) and the motor rows (n,), with the sign of
            `evaluate`: a friction adds a positive number at positive speed.

        Raises:
            EffectError: if it cannot act in a simulation as a torque of the present state.
        """
        raise EffectError(f"the effect {self.name!r} cannot be simulated as a torque of the present state")

    def modified(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot with this effect in its bodies or its gravity; by default the robot as it is.

        A simulator asks every effect for both, `modified` and `torque`: what changes the masses cannot be a torque
        of the present state.
        """
        return robot

    def demand(self, robot: Robot, values: FloatArray) -> FloatArray:
        """(n,) torque that each motor is asked for over what its load and its rotor need [-]; by default one.

        Friction of a motor, and what else acts at it, comes beside that.
        """
        return np.ones(robot.n)

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """What the sensors show where the effect sits in a sensor; by default all signals as they are.

        Args:
            robot: the robot.
            time: (N,) [s].
            signals: true signals (N, n) by kind: q, theta, tau_motor, tau_spring.

        Returns:
            The signals as recorded.
        """
        return dict(signals)

    def corrected(self, robot: Robot, motion: Motion) -> Motion:
        """The motion as it was, from the motion as the sensors show it; by default they are the same."""
        return motion

    def read(self, robot: Robot, motion: Motion) -> Motion:
        """The motion as right encoders in their places would show it; by default that is the motion of the bodies."""
        return self.corrected(robot, motion)

    def shifted(self, robot: Robot, time: FloatArray, rows: Contribution) -> Contribution:
        """Rows as the recorded torque shows them; by default they are the same."""
        return rows

    def variants(self, state: State) -> tuple[Self, ...]:
        """The same effect with all the shapes that a search should try on this motion."""
        if not self.shapes:
            return (self,)
        own = self.on(state)
        grids = [shape.grid() for shape in own.ranges]
        names = [shape.name for shape in own.ranges]
        return tuple(
            replace(own, **dict(zip(names, map(float, values), strict=True)))  # type: ignore[arg-type]
            for values in product(*grids)
        )

    @classmethod
    def in_pieces(cls, variants: Sequence[Self]) -> tuple[Sequence[Self], FloatArray | None]:
        """Shapes (p) of which the columns of others (v) are sums, and how often each is in each (v, p).

        For effects of which many shapes share most of what they do. By default every shape stands for itself, and the
        second one is None.
        """
        return variants, None

    def on(self, state: State) -> Self:
        """The same effect with the ranges that its shapes have on this motion; by default those of its kind."""
        return self

    def beside(self) -> Self | None:
        """The same effect in another form, which can stand in a model beside this one; by default there is none.

        The names of its parameters are others, or it is not tried where this one is there.
        """
        return None

    def same_here(self, state: State) -> tuple[Self, ...]:
        """Other forms of the effect that do the same on this motion, those that other motions tell least at the end.

        By default there are none.
        """
        return ()

    def beginnings(self) -> tuple[Self, ...]:
        """The same effect with other shapes or amounts, from which a fit begins too; by default none.

        For where the fit from these may lead astray.
        """
        return ()

    def anchored(self, anchor: Anchor) -> Self:
        """The same effect, knowing what it needs of the rest of the model; by default it needs nothing."""
        return self

    def followed(self, state: State, values: FloatArray) -> FloatArray | None:
        """How its torque changes with the bodies of the model that it is anchored in, None where it does not.

        Args:
            state: robot and motion.
            values: (k,) of its parameters.

        Returns:
            (N, n, 10 b) link rows, for the standard inertial parameters.
        """
        return None

    def std_factors(self, robot: Robot) -> FloatArray:
        """(k,) standard deviations of its values over those that a linear fit gives its columns; by default one.

        For a column that itself grows with its value (`anchored`): what it does grows faster than the column says.
        """
        return np.ones(len(self.columns(robot)))

    def turning(self, motion: Motion, robot: Robot) -> dict[int, FloatArray]:
        """Speeds (N,) at whose reversal its torque jumps, by the index of the joint; none beside joint and motor speed.

        Where such a speed passes zero a sample tells nothing: it may be on either side of the jump.
        """
        return {}

    def plausible(self, values: FloatArray, parameters: Mapping[str, float]) -> bool:
        """Whether estimates (k,) of its columns make sense beside the other parameters of a model, by name.

        What `Column.nonnegative` says need not be said again.
        """
        return True

    @property
    def reservation(self) -> str | None:
        """What its estimates hang on that the data do not tell, for people; by default nothing."""
        return None

    def shape_unit(self, shape: Shape, robot: Robot) -> str:
        """Unit of a shape parameter at this joint: m in place of rad, kg in place of kg m2 where the joint slides."""
        if self.joint is not None and robot.joints[robot.index(self.joint)].prismatic:
            unit = shape.unit.replace("(N m)", "N").replace("N m", "N").replace("rad", "m")
            return unit.replace("kg m2", "kg")
        return shape.unit

    def parameter_name(self, label: str | None = None) -> str:
        """`<joint>.<effect>` or `<joint>.<effect>_<label>`."""
        stem = f"{self.joint}.{self.name}" if self.joint is not None else f"robot.{self.name}"
        return stem if label is None else f"{stem}_{label}"

    @property
    def title(self) -> str:
        """Name and joint, for people, and what tells it from another of its kind there."""
        return titled(self.name, self.joint)

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """Its shapes with the ranges of the motion that it was put on; by default those of its kind."""
        return self.shapes

    @property
    def shape_values(self) -> dict[str, float]:
        """Values of its nonlinear parameters."""
        return {shape.name: float(getattr(self, shape.name)) for shape in self.shapes}

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can hold; `effect_from_dict` reads it."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "joint"}
        return {"effect": self.name, "joint": self.joint, "shape": values}


class JointEffect(Effect):
    """An effect at a single joint, whose columns depend on the state of that joint and on nothing else."""

    @abstractmethod
    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """(N, k) columns from the state (N,) of the joint."""

    def evaluate(self, state: State) -> Contribution:
        """Link and motor rows (N, n, k)."""
        motion, joint = state.motion, self.required_joint
        i = state.robot.index(joint)
        columns = self.local_columns(motion.q[:, i], motion.dq[:, i], motion.theta[:, i], motion.dtheta[:, i])
        return state.at(self.side, joint, columns)

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The columns at the present state, times the values."""
        at, shares = robot.index(self.required_joint), self.side.shares
        return JointAction(at, shares, self.present_columns, values, of_speed=self.of_speed)

    @property
    def of_speed(self) -> bool:
        """Whether its columns depend on a speed."""
        return not {"dq", "dtheta"}.isdisjoint(self.depends_on)

    def present_columns(self, state: SimulationState) -> FloatArray:
        """(N, k) columns in N states of the joint at one time of a simulation."""
        return self.local_columns(state.q, state.dq, state.theta, state.dtheta)

    @property
    def required_joint(self) -> str:
        """The joint.

        Raises:
            EffectError: if none was given.
        """
        if self.joint is None:
            raise EffectError(f"the effect {self.name!r} acts at a joint; give joint=...")
        return self.joint

    def units_of(self, robot: Robot) -> tuple[str, str]:
        """Units of torque and of position of its joint: (N m, rad) or (N, m)."""
        joint = robot.joints[robot.index(self.required_joint)]
        return joint.torque_unit, joint.position_unit


def titled(name: str, joint: str | None) -> str:
    """Name of an effect with its joint, for people."""
    if joint is None:
        return f"{name} at all joints" if name in AT_ALL_JOINTS else name
    return f"{name} at {joint}"


def smooth_sign(velocity: FloatArray, smoothing: float) -> FloatArray:
    """tanh(v / v_off): within 4 % of the sign above 2 v_off (paper, eq. 3)."""
    return np.tanh(velocity / smoothing)
