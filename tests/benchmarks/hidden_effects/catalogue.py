"""What can be hidden: draws of forms and shapes, first guesses of sizes, largest sizes that make sense."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.hidden_effects.case import FloatArray, Planted
from tests.benchmarks.hidden_effects.gap import Gauge

Draw = Callable[["Place"], tuple[float, float, dict[str, float]]]


@dataclass(frozen=True, eq=False)
class Place:
    """A joint on a trajectory, for draws.

    Attributes:
        gauge: robot and motion.
        joint: index of the joint.
        rng: random numbers.
    """

    gauge: Gauge
    joint: int
    rng: np.random.Generator

    @property
    def torque(self) -> float:
        """Torque rms of the motor [N m]."""
        return float(self.gauge.torque_rms()[self.joint])

    @property
    def coulomb(self) -> float:
        """[N m]."""
        return float(self.gauge.truth.coulomb[self.joint])

    def column(self, name: str) -> FloatArray:
        """(N,) a signal of the motion."""
        return np.asarray(getattr(self.gauge.exact.motion, name)[:, self.joint])

    @property
    def deflection(self) -> float:
        """Largest deflection [rad]."""
        return float(np.abs(self.column("deflection")).max())

    @property
    def speed(self) -> float:
        """Largest speed of the motor [rad/s]."""
        return float(np.abs(self.column("dtheta")).max())

    @property
    def other(self) -> int:
        """Another joint, a neighbour: one after it where there is any."""
        return max(self.gauge.truth.robot.neighbours(self.joint))

    def phase(self) -> float:
        """Any angle."""
        return float(self.rng.uniform(-np.pi, np.pi))

    def between(self, lower: float, upper: float) -> float:
        """Log-uniform."""
        return float(np.exp(self.rng.uniform(np.log(lower), np.log(upper))))

    def sign(self) -> float:
        """Either sign."""
        return float(self.rng.choice([-1.0, 1.0]))


@dataclass(frozen=True)
class Entry:
    """One effect in one form.

    Attributes:
        effect: name.
        form: form.
        draw: first size, largest size and shape at a place.
        springs: whether it needs a spring at the joint.
        whole: whether it acts on the whole robot.
        accepted: names that count as the right class, besides its own.
    """

    effect: str
    form: str
    draw: Draw
    springs: bool = False
    whole: bool = False
    accepted: tuple[str, ...] = ()


def _stribeck(p: Place) -> tuple[float, float, dict[str, float]]:
    shape = {"speed": p.between(0.03, 0.25) * min(p.speed, 1.0), "exponent": float(p.rng.uniform(1.0, 2.0))}
    return 0.4 * p.coulomb, 4.0 * p.coulomb, shape


def _external(p: Place) -> tuple[float, float, dict[str, float]]:
    direction = p.rng.standard_normal(3)
    direction /= np.linalg.norm(direction)
    begin = float(p.rng.uniform(0.0, 0.8))
    length = float(p.rng.uniform(0.08, 0.18))
    shape = dict(zip("xyz", map(float, direction), strict=True))
    return 2.0, 100.0, {**shape, "begin": begin, "end": begin + length, "every_period": 1.0}


def _tilt(p: Place) -> tuple[float, float, dict[str, float]]:
    angle = p.phase()
    return 0.03, 0.1, {"x": float(np.cos(angle)), "y": float(np.sin(angle))}


def _coupling(p: Place) -> tuple[float, float, dict[str, float]]:
    return p.sign() * 0.1, 1.0, {"other": float(p.other)}


def _order(p: Place, lower: float = 2.0, upper: float = 40.0) -> float:
    return float(np.round(p.between(lower, upper)))


def _presliding(static: float) -> Draw:
    def draw(p: Place) -> tuple[float, float, dict[str, float]]:
        speed = p.between(0.02, 0.1)
        return 0.01, 0.2, {"static": static * float(p.rng.uniform(0.5, 1.0)), "speed": speed, "micro": 0.0}

    return draw


def _two_ripples(p: Place) -> tuple[float, float, dict[str, float]]:
    n = _order(p, 4.0, 30.0)
    m = n * float(p.rng.choice([2.0, 3.0]))
    return 0.03 * p.torque, 0.5 * p.torque, {"order": n, "phase": p.phase(), "second": m, "second_phase": p.phase()}


def _drift(p: Place) -> tuple[float, float, dict[str, float]]:
    return p.sign() * 0.3, 0.9, {"kind": float(p.rng.integers(0, 2))}


def _end(p: Place) -> tuple[float, float, dict[str, float]]:
    q = p.column("q")
    start = float(q.max() - 0.3 * np.ptp(q))
    return 0.1 * p.torque / (0.3 * float(np.ptp(q))) ** 2, 1e4, {"start": start}


def _cable(p: Place) -> tuple[float, float, dict[str, float]]:
    q = p.gauge.exact.motion.q
    total = q[:, p.joint] + q[:, p.other]
    return 0.1 * p.torque, 50.0 * p.torque, {"other": float(p.other), "slack": float(np.median(total))}


def _payload(p: Place) -> tuple[float, float, dict[str, float]]:
    places = {axis: float(v) for axis, v in zip("xyz", p.rng.uniform(-0.06, 0.06, 3), strict=True)}
    return 0.3, 5.0, places


def _parallel(p: Place) -> tuple[float, float, dict[str, float]]:
    q = p.column("q")
    return 0.2 * p.torque, 20.0 * p.torque, {"rest": float(q.mean() + 0.5 * p.rng.uniform(-1, 1) * np.ptp(q))}


# fmt: off
LIBRARY: tuple[Entry, ...] = (
    Entry("stribeck_friction", "library", _stribeck),
    Entry("nonlinear_viscous_friction", "library", lambda p: (
        0.2 * p.coulomb, 20.0 * p.coulomb, {"exponent": float(p.rng.uniform(1.7, 2.6))})),
    Entry("presliding_friction", "library", _presliding(0.0)),
    Entry("load_dependent_friction", "library", lambda p: (0.05, 0.5, {})),
    Entry("directional_efficiency", "library", lambda p: (0.05, 0.5, {})),
    Entry("position_dependent_friction", "library", lambda p: (
        0.3 * p.coulomb, 1.0 * p.coulomb, {"order": _order(p, 1.0, 8.0), "phase": p.phase()})),
    Entry("torque_ripple", "library", lambda p: (
        0.03 * p.torque, 0.5 * p.torque, {"order": _order(p), "phase": p.phase()})),
    Entry("torque_offset", "library", lambda p: (p.sign() * 0.03 * p.torque, 0.5 * p.torque, {})),
    Entry("torque_saturation", "library", lambda p: (0.03 / (3 * p.torque**2), 0.2 / (3 * p.torque**2), {})),
    Entry("torque_constant", "library", lambda p: (p.sign() * 0.05, 0.3, {}), springs=True),
    Entry("spring_stiffening", "library", lambda p: (
        p.sign() * 0.2 * p.torque / p.deflection**2, 3.0 * p.torque / p.deflection**2,
        {"exponent": float(p.rng.uniform(1.9, 2.1))}), springs=True),
    Entry("asymmetric_spring", "library", lambda p: (p.sign() * 0.05, 0.5, {}), springs=True),
    Entry("spring_hysteresis", "library", lambda p: (
        0.05 * p.torque, 0.6 * p.torque, {"width": p.between(0.1, 0.5) * p.deflection}), springs=True),
    Entry("backlash", "library", lambda p: (0.1 * p.deflection, 0.6 * p.deflection, {}), springs=True),
    Entry("spring_offset", "library", lambda p: (p.sign() * 0.05 * p.torque, 0.5 * p.torque, {}), springs=True),
    Entry("link_friction", "library", lambda p: (
        0.05 * p.torque, 0.6 * p.torque, {"viscous": float(p.rng.uniform(0.0, 1.0))}), springs=True),
    Entry("parallel_spring", "library", _parallel, springs=True),
    Entry("base_tilt", "library", _tilt, whole=True),
    Entry("link_flexibility", "library", lambda p: (
        0.1 / max(float(p.gauge.truth.stiffness[p.joint]), 100.0),
        2.0 / max(float(p.gauge.truth.stiffness[p.joint]), 100.0),
        {"damping": 8e-4, "inertia": 3e-3}), springs=True),
    Entry("transmission_coupling", "library", _coupling, springs=True),
    Entry("encoder_offset", "library", lambda p: (p.sign() * 0.01, 0.15, {})),
    Entry("encoder_eccentricity", "library", lambda p: (0.005, 0.05, {"phase": p.phase()})),
    Entry("position_delay", "library", lambda p: (0.002, 0.03, {})),
    Entry("torque_delay", "library", lambda p: (0.005, 0.05, {})),
    Entry("friction_drift", "library", _drift),
    Entry("torque_constant_drift", "library", lambda p: (p.sign() * 0.1, 0.3, _drift(p)[2])),
    Entry("stiffness_drift", "library", lambda p: (p.sign() * 0.1, 0.4, _drift(p)[2]), springs=True),
    Entry("temperature_friction", "library", lambda p: (
        0.3, 0.8, {"time_constant": float(p.rng.uniform(0.15, 0.6))})),
    Entry("external_force", "library", _external),
)

ZEROS: tuple[Entry, ...] = (
    Entry("encoder_offset", "library", lambda p: (p.sign() * 0.02, 0.3, {})),
    # a constant stands for it in a linear spring
    Entry("motor_encoder_offset", "library", lambda p: (p.sign() * 0.02, 2.0, {}), springs=True,
        accepted=("spring_offset",)),
    # that of the first joint is a tilt of the base
    Entry("joint_offset", "library", lambda p: (p.sign() * 0.02, 0.5, {}), springs=True, accepted=("base_tilt",)),
)

WHOLE: tuple[Entry, ...] = (
    Entry("torque_delay", "library", lambda p: (0.005, 0.05, {}), whole=True),
    # of rigid joints it is the other one, backwards
    Entry("position_delay", "library", lambda p: (0.002, 0.03, {}), springs=True, whole=True),
)

OTHER_FORMS: tuple[Entry, ...] = (
    Entry("stribeck_friction", "stiction", lambda p: (
        0.4 * p.coulomb, 4.0 * p.coulomb, {"speed": p.between(0.015, 0.04), "exponent": 1.0}),
        accepted=("presliding_friction",)),
    Entry("stribeck_friction", "lorentz", _stribeck),
    Entry("nonlinear_viscous_friction", "exponent", lambda p: (
        0.2 * p.coulomb, 20.0 * p.coulomb, {"exponent": float(p.rng.choice([1.4, 3.3]))})),
    Entry("nonlinear_viscous_friction", "fading", lambda p: (
        0.5 * p.coulomb, 60.0 * p.coulomb, {"speed": p.between(0.15, 0.6)}), accepted=("stribeck_friction",)),
    Entry("presliding_friction", "lugre", _presliding(0.5), accepted=("stribeck_friction",)),
    Entry("torque_ripple", "two_orders", _two_ripples),
    Entry("torque_saturation", "tanh", lambda p: (0.03 / (3 * p.torque**2), 0.2 / (3 * p.torque**2), {})),
    Entry("spring_stiffening", "tan", lambda p: (
        0.1 * p.torque, 20.0 * p.torque, {"deflection": 1.4 * p.deflection}), springs=True),
    Entry("asymmetric_spring", "kink", lambda p: (
        p.sign() * 0.05, 0.5, {"kink": float(p.rng.uniform(-0.3, 0.3)) * p.deflection}), springs=True,
        accepted=("spring_stiffening",)),
    Entry("spring_hysteresis", "bouc_wen", lambda p: (
        0.05 * p.torque, 0.6 * p.torque,
        {"width": p.between(0.1, 0.4) * p.deflection, "exponent": float(p.rng.uniform(1.0, 2.0)),
         "share": float(p.rng.uniform(0.5, 0.8))}), springs=True),
    Entry("backlash", "soft", lambda p: (0.1 * p.deflection, 0.6 * p.deflection, {}), springs=True),
)

UNKNOWN: tuple[Entry, ...] = (
    Entry("soft_stop", "library", _end),
    Entry("viscous_position", "library", lambda p: (
        0.5 * p.coulomb, 20.0 * p.coulomb, {"order": _order(p, 2.0, 8.0), "phase": p.phase()})),
    Entry("mesh_ripple", "library", lambda p: (0.03, 0.5, {"order": _order(p, 5.0, 30.0), "phase": p.phase()}),
        springs=True),
    Entry("taut_cable", "library", _cable),
    Entry("creep", "library", lambda p: (0.1, 1.0, {"time_constant": p.between(0.1, 1.0)}), springs=True),
    Entry("disturbance", "library", lambda p: (0.03 * p.torque, 0.5 * p.torque, {
        "frequency": 2 * np.pi * float(p.rng.integers(6, 16)) / p.gauge.series.period, "phase": p.phase()})),
    Entry("cross_viscous", "library", lambda p: (
        p.sign() * 0.3 * p.coulomb, 20.0 * p.coulomb, {"other": float(p.other)})),
    Entry("crosstalk", "library", lambda p: (p.sign() * 0.03, 0.5, {"other": float(p.other)})),
)

REFERENCE: tuple[Entry, ...] = (
    Entry("payload", "library", _payload),
    Entry("common_torque_constant", "library", lambda p: (p.sign() * 0.05, 0.3, {}), whole=True,
        accepted=("torque_constant",)),
    Entry("payload", "library", _payload),
)
# fmt: on

ENTRIES: Mapping[tuple[str, str], Entry] = {
    (entry.effect, entry.form): entry for entry in (*ZEROS, *WHOLE, *LIBRARY, *OTHER_FORMS, *UNKNOWN, *REFERENCE)
}


def places(entry: Entry, gauge: Gauge) -> list[int]:
    """Joints at which an effect can be hidden."""
    robot = gauge.truth.robot
    if entry.whole:
        return [0]
    if entry.effect == "payload":
        return [robot.n - 1]
    return [i for i in range(robot.n) if robot.elastic[i] or not entry.springs]


def draw_effect(entry: Entry, gauge: Gauge, joint: int, target: float, rng: np.random.Generator) -> Planted | None:
    """An effect whose gap is what is wanted.

    Args:
        entry: effect and form.
        gauge: robot and motion.
        joint: index of the joint.
        target: gap as a share of torque.
        rng: random numbers.

    Returns:
        The effect; None where it cannot have that gap there.
    """
    size, largest, shape = entry.draw(Place(gauge, joint, rng))
    name = None if entry.whole else gauge.truth.robot.joint_names[joint]
    first = Planted(entry.effect, name, entry.form, size, shape)
    return gauge.scaled_to(first, target, largest)
