"""Laws of the truth, written for the MuJoCo plant: none of them calls the library's effects.

Every law acts on one `JointState` at a time and keeps its own memory. Torques oppose the motion: a positive number at
the motor or the link is subtracted from what drives it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import copysign, exp, sin, tan

import numpy as np

from tests.benchmarks.hidden_effects.case import Planted
from tests.benchmarks.hidden_effects.plants import Truth


class JointState:
    """State of one joint at one step: joint-side positions, speeds, torques."""

    __slots__ = ("d", "dd", "dq", "dth", "k", "q", "t", "th", "ts", "u")

    def __init__(self) -> None:
        self.q = self.dq = self.th = self.dth = self.d = self.dd = self.ts = self.u = self.t = 0.0
        self.k = 0


Law = Callable[[JointState], float]
Change = Callable[[JointState, float], float]
Wide = Callable[[list[JointState], list[float], list[float]], None]


@dataclass
class Hooks:
    """What acts on one joint beyond its base model, and on several at once.

    Attributes:
        spring: changes of the spring torque.
        level: changes of the Coulomb friction level.
        bristle: replaces the Coulomb friction by a law of its own (state, level) -> torque.
        smooth: opposing torques at the motor.
        link: opposing torques at the link.
        link_coulomb: Coulomb friction at the link [N m].
        drive: torque that the drive delivers for the torque that is recorded.
        viscous: factor of the viscous friction over time.
        temperature: of the motor over time [degC].
        sticks: whether the Coulomb friction really holds at zero speed, without any smoothing.
        turned: joint j and ratio r where the motor turns with theta + r q_j.
    """

    spring: list[Change] = field(default_factory=list)
    level: list[Change] = field(default_factory=list)
    bristle: Change | None = None
    smooth: list[Law] = field(default_factory=list)
    link: list[Law] = field(default_factory=list)
    link_coulomb: float = 0.0
    drive: Change | None = None
    viscous: Change | None = None
    temperature: Callable[[float], float] | None = None
    turned: tuple[int, float] | None = None
    sticks: bool = False


def trend(kind: float, duration: float) -> Callable[[float], float]:
    """Course of a drift from 0 to 1 over a recording: linear, or like a body that warms up."""
    if kind < 0.5:
        return lambda t: min(max(t / duration, 0.0), 1.0)
    return lambda t: (1.0 - exp(-3.0 * max(t, 0.0) / duration)) / (1.0 - exp(-3.0))


def bind(planted: Planted, truth: Truth, hooks: list[Hooks], wide: list[Wide], step: float, duration: float) -> None:
    """Add a planted effect to the hooks of a simulation.

    Args:
        planted: the effect; those of sensors and of the structure add nothing here.
        truth: the base model.
        hooks: (n,) hooks of every joint.
        wide: laws over several joints.
        step: time step [s].
        duration: time in which what drifts comes to its end, from when the robot has settled [s].

    Raises:
        KeyError: for a form that is not known.
    """
    if planted.joint is None:
        return
    i = truth.robot.index(planted.joint)
    _FORMS.get((planted.effect, planted.form), _nothing)(planted, truth, i, hooks, wide, step, duration)
    if (planted.effect, planted.form) not in _FORMS and (planted.effect, planted.form) not in ELSEWHERE:
        raise KeyError(f"no law for {planted.effect} in the form {planted.form}")


def _nothing(*_: object) -> None:
    return None


ELSEWHERE = {
    (name, "library")
    for name in (
        "torque_constant", "encoder_offset", "motor_encoder_offset", "joint_offset", "encoder_eccentricity",
        "position_delay", "torque_delay", "payload", "external_force", "base_tilt", "link_flexibility",
        "torque_constant_drift", "crosstalk", "changed_inertia", "common_torque_constant",
    )
}  # fmt: skip


# -- friction of the motor -------------------------------------------------------------------------------------------


def _stribeck(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, vs, a = p.size, p.shape["speed"], p.shape["exponent"]
    hooks[i].level.append(lambda s, f: f + c * exp(-((abs(s.dth) / vs) ** a)))


def _stiction(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    hooks[i].sticks = True
    _stribeck(p, truth, i, hooks, wide, step, duration)


def _stribeck_lorentz(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, vs = p.size, p.shape["speed"]
    hooks[i].level.append(lambda s, f: f + c / (1.0 + (s.dth / vs) ** 2))


def _power(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, e = p.size, p.shape["exponent"]
    hooks[i].smooth.append(lambda s: c * copysign(abs(s.dth) ** e, s.dth))


def _fading_viscous(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, v0 = p.size, p.shape["speed"]
    hooks[i].smooth.append(lambda s: c * s.dth / (1.0 + abs(s.dth) / v0))


def _lugre(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    """LuGre; with `static` 0 it is Dahl's model. `size` is the presliding width."""
    width, static, vs = p.size, p.shape.get("static", 0.0), p.shape.get("speed", 0.05)
    micro = p.shape.get("micro", 0.0)
    memory = [0.0]

    def law(s: JointState, level: float) -> float:
        v = s.dth
        g = level * (1.0 + static * exp(-((v / vs) ** 2)))
        stiffness = level / width
        rate = stiffness * abs(v) / g
        end = copysign(g / stiffness, v)
        z = memory[0]
        new = end + (z - end) * exp(-rate * step)
        memory[0] = new
        # speeds are those between the steps of the position: so is what they move the bristle to
        return stiffness * 0.5 * (z + new) + micro * (new - z) / step

    hooks[i].bristle = law


def _load(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    mu = p.size
    hooks[i].level.append(lambda s, f: f + mu * abs(s.ts))


def _direction(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    mu = p.size
    hooks[i].level.append(lambda s, f: f + (mu * abs(s.ts) if s.ts * s.dth > 0.0 else 0.0))


def _position(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, n, phase = p.size, p.shape["order"], p.shape["phase"]
    hooks[i].level.append(lambda s, f: max(f + c * sin(n * s.th + phase), 0.0))


def _drifting_friction(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    e, g = p.size, trend(p.shape["kind"], duration)
    hooks[i].level.append(lambda s, f: f * (1.0 + e * g(s.t)))
    hooks[i].viscous = lambda s, b: b * (1.0 + e * g(s.t))


def _warm_friction(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    e, tau = p.size, p.shape["time_constant"] * duration

    def temperature(t: float) -> float:
        return 24.0 + 18.0 * (1.0 - exp(-max(t, 0.0) / tau))

    hooks[i].temperature = temperature
    hooks[i].level.append(lambda s, f: f * (1.0 - e * (temperature(s.t) - 24.0) / 18.0))
    hooks[i].viscous = lambda s, b: b * (1.0 - e * (temperature(s.t) - 24.0) / 18.0)


# -- torque of the motor ---------------------------------------------------------------------------------------------


def _ripple(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, n, phase = p.size, p.shape["order"], p.shape["phase"]
    hooks[i].smooth.append(lambda s: c * sin(n * s.th + phase))


def _two_ripples(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, n, phase, m, other = p.size, p.shape["order"], p.shape["phase"], p.shape["second"], p.shape["second_phase"]
    hooks[i].smooth.append(lambda s: c * (sin(n * s.th + phase) + 0.6 * sin(m * s.th + other)))


def _offset(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c = p.size
    hooks[i].smooth.append(lambda s: c)


def _saturation(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c = p.size
    top = (3.0 * c) ** -0.5  # where the curve is flat; what is asked for before all has settled may be far beyond

    def saturated(s, u):  # type: ignore[no-untyped-def]
        u = min(max(u, -top), top)
        return u - c * u * u * u

    hooks[i].drive = saturated


def _saturation_tanh(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c = p.size  # 1 / (3 c) is the square of the torque at which tanh bends
    bend = (3.0 * c) ** -0.5
    hooks[i].drive = lambda s, u: bend * float(np.tanh(u / bend))


# -- springs ---------------------------------------------------------------------------------------------------------


def _stiffening(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, e = p.size, p.shape["exponent"]
    hooks[i].spring.append(lambda s, ts: ts + c * copysign(abs(s.d) ** e, s.d))


def _stiffening_tan(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, d0 = p.size, p.shape["deflection"]
    hooks[i].spring.append(lambda s, ts: ts + c * (tan(min(abs(s.d) / d0, 1.45)) - abs(s.d) / d0) * copysign(1.0, s.d))


def _asymmetric(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c = p.size * truth.stiffness[i]
    hooks[i].spring.append(lambda s, ts: ts + c * abs(s.d))


def _asymmetric_kink(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, kink = p.size * truth.stiffness[i], p.shape["kink"]
    at_rest = max(-kink, 0.0)  # without it, the spring would be preloaded too: an effect of its own
    hooks[i].spring.append(lambda s, ts: ts + 2.0 * c * (max(s.d - kink, 0.0) - at_rest))


def _maxwell_slip(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    """Two Maxwell-slip elements of width w and 3 w in the deflection; `size` is their total force."""
    w = p.shape["width"]
    force, memory = p.size, [0.0, 0.0, None]

    def law(s: JointState, ts: float) -> float:
        if memory[2] is None:
            memory[2] = s.d
        move = s.d - memory[2]
        memory[2] = s.d
        memory[0] = min(max(memory[0] + move / w, -1.0), 1.0)
        memory[1] = min(max(memory[1] + move / (3.0 * w), -1.0), 1.0)
        return ts + 0.5 * force * (memory[0] + memory[1])

    hooks[i].spring.append(law)


def _bouc_wen(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    """Bouc-Wen: z' = (d' - b |d'| |z|^(n-1) z - g d' |z|^n) / w with b + g = 1; `size` is the force at |z| = 1."""
    w, n, share = p.shape["width"], p.shape["exponent"], p.shape["share"]
    force, memory = p.size, [0.0]

    def rate(dd: float, z: float) -> float:
        a = abs(z)
        return (dd - share * abs(dd) * a ** (n - 1.0) * z - (1.0 - share) * dd * a**n) / w

    def law(s: JointState, ts: float) -> float:
        z = memory[0]
        half = z + 0.5 * step * rate(s.dd, z)
        memory[0] = z = z + step * rate(s.dd, half)
        return ts + force * z

    hooks[i].spring.append(law)


def _backlash(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    w, k1, k3 = p.size, truth.stiffness[i], truth.cubic[i]

    def law(s: JointState, ts: float) -> float:
        inside = s.d - w if s.d > w else s.d + w if s.d < -w else 0.0
        return ts - k1 * s.d - k3 * s.d**3 + k1 * inside + k3 * inside**3

    hooks[i].spring.append(law)


def _backlash_soft(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    """A gap whose flanks give way: the spring's torque is reduced smoothly around zero deflection."""
    w, k1 = p.size, truth.stiffness[i]
    hooks[i].spring.append(lambda s, ts: ts - k1 * w * s.d / (w * w + s.d * s.d) ** 0.5)


def _spring_offset(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c = p.size
    hooks[i].spring.append(lambda s, ts: ts + c)


def _drifting_spring(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    e, g, k1 = p.size, trend(p.shape["kind"], duration), truth.stiffness[i]
    hooks[i].spring.append(lambda s, ts: ts - e * g(s.t) * k1 * s.d)


# -- links -----------------------------------------------------------------------------------------------------------


def _link_friction(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    hooks[i].link_coulomb += p.size
    b = p.size * p.shape["viscous"]
    hooks[i].link.append(lambda s: b * s.dq)


def _parallel_spring(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    k, rest = p.size, p.shape["rest"]
    hooks[i].link.append(lambda s: k * (s.q - rest))


def _coupled(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    """A stage that turns with theta_i + r q_j; its inertia is of `Stages`, its friction follows here."""
    hooks[i].turned = (int(p.shape["other"]), p.size)


# -- what the library does not have ----------------------------------------------------------------------------------


def _soft_stop(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    k, start = p.size, p.shape["start"]
    hooks[i].link.append(lambda s: k * max(s.q - start, 0.0) ** 2)


def _viscous_position(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    b, n, phase = p.size, p.shape["order"], p.shape["phase"]
    hooks[i].smooth.append(lambda s: b * s.dth * sin(n * s.th + phase))


def _mesh_ripple(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, n, phase = p.size, p.shape["order"], p.shape["phase"]
    hooks[i].smooth.append(lambda s: c * s.ts * sin(n * s.th + phase))


def _taut_cable(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    k, j, slack = p.size, int(p.shape["other"]), p.shape["slack"]

    def law(s: list[JointState], link: list[float], motor: list[float]) -> None:
        pull = k * max(s[i].q + s[j].q - slack, 0.0)
        link[i] += pull
        link[j] += pull

    wide.append(law)


def _creep(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    k, tau = p.size * truth.stiffness[i], p.shape["time_constant"]
    memory = [None]

    def law(s: JointState, ts: float) -> float:
        if memory[0] is None:
            memory[0] = s.d
        memory[0] += step * (s.d - memory[0]) / tau
        return ts + k * (s.d - memory[0])

    hooks[i].spring.append(law)


def _disturbance(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, w, phase = p.size, p.shape["frequency"], p.shape["phase"]
    hooks[i].smooth.append(lambda s: c * sin(w * s.t + phase))


def _cross_viscous(p, truth, i, hooks, wide, step, duration):  # type: ignore[no-untyped-def]
    c, j = p.size, int(p.shape["other"])

    def law(s: list[JointState], link: list[float], motor: list[float]) -> None:
        motor[i] += c * s[i].dth * s[j].dth

    wide.append(law)


_FORMS = {
    ("stribeck_friction", "library"): _stribeck,
    ("stribeck_friction", "stiction"): _stiction,
    ("stribeck_friction", "lorentz"): _stribeck_lorentz,
    ("nonlinear_viscous_friction", "library"): _power,
    ("nonlinear_viscous_friction", "exponent"): _power,
    ("nonlinear_viscous_friction", "fading"): _fading_viscous,
    ("presliding_friction", "library"): _lugre,
    ("presliding_friction", "lugre"): _lugre,
    ("load_dependent_friction", "library"): _load,
    ("directional_efficiency", "library"): _direction,
    ("position_dependent_friction", "library"): _position,
    ("friction_drift", "library"): _drifting_friction,
    ("temperature_friction", "library"): _warm_friction,
    ("torque_ripple", "library"): _ripple,
    ("torque_ripple", "two_orders"): _two_ripples,
    ("torque_offset", "library"): _offset,
    ("torque_saturation", "library"): _saturation,
    ("torque_saturation", "tanh"): _saturation_tanh,
    ("spring_stiffening", "library"): _stiffening,
    ("spring_stiffening", "tan"): _stiffening_tan,
    ("asymmetric_spring", "library"): _asymmetric,
    ("asymmetric_spring", "kink"): _asymmetric_kink,
    ("spring_hysteresis", "library"): _maxwell_slip,
    ("spring_hysteresis", "bouc_wen"): _bouc_wen,
    ("backlash", "library"): _backlash,
    ("backlash", "soft"): _backlash_soft,
    ("spring_offset", "library"): _spring_offset,
    ("stiffness_drift", "library"): _drifting_spring,
    ("link_friction", "library"): _link_friction,
    ("parallel_spring", "library"): _parallel_spring,
    ("transmission_coupling", "library"): _coupled,
    ("soft_stop", "library"): _soft_stop,
    ("viscous_position", "library"): _viscous_position,
    ("mesh_ripple", "library"): _mesh_ripple,
    ("taut_cable", "library"): _taut_cable,
    ("creep", "library"): _creep,
    ("disturbance", "library"): _disturbance,
    ("cross_viscous", "library"): _cross_viscous,
}
