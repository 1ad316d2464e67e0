"""A robot, a simulator and forms of friction that the project does not have, through files and the command line alone.

    python -m tests.benchmarks.bench_new_user [CASE ...]

The arm has three elastic joints whose axes and base are tilted; its true masses, springs and frictions are not those of
its description. It is stepped by Pinocchio's articulated-body algorithm with every rotor as a body of its own, in
explicit steps of 0.2 ms, with friction c v / sqrt(v^2 + s^2), under a controller that looks at nothing but the motors.
The motion is a sum of sines that nobody optimised. What encoders and current sensors show is written to CSV files,
which `sea-ident identify` and `sea-ident diagnose` read. Printed per case: verdict, what is named with its first
parameters, the truth, and the seconds of the diagnosis.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tests.benchmarks.through_files import in_words, run_cases, sea_ident, write

Array = NDArray[np.float64]
Torques = tuple[Array, Array, Array]
"""Torques that an effect adds: to the friction of the motors, in the springs, on the links [N m]."""

JOINTS = ("yaw", "lift", "elbow")
RATIO = np.array([80.0, 100.0, 60.0])
TORQUE_CONSTANT = np.array([0.05, 0.05, 0.04])
ROTOR = np.array([2.5e-5, 2.5e-5, 1.5e-5])
STIFFNESS, CUBIC = np.array([270.0, 340.0, 130.0]), np.array([0.0, 5000.0, 1500.0])
DAMPING = np.array([0.8, 1.0, 0.3])
VISCOUS, COULOMB, SMOOTHING = np.array([1.5, 2.0, 0.6]), np.array([1.2, 1.6, 0.5]), 4e-3
GAINS = np.array([900.0, 1200.0, 400.0]), np.array([60.0, 80.0, 20.0])
HEAVIER = (1.07, 0.95, 1.1)
"""Mass of every link over that of the description."""

PERIOD, RATE, STEP = 5.0, 250.0, 2e-4
PERIODS, HELD_OUT = 15, 6
ENCODER = 2.0 * np.pi / 2**17
"""Step of the encoder of a link [rad]; that of a motor is fifty times finer."""

CURRENT_NOISE = 0.02
"""Standard deviation [A]."""


def _link(name: str, com: str, mass: float, inertia: tuple[float, ...]) -> str:
    entries = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), inertia, strict=True)
    moments = " ".join(f'{key}="{value}"' for key, value in entries)
    inertial = f'<inertial><origin xyz="{com}"/><mass value="{mass}"/><inertia {moments}/></inertial>'
    return f'<link name="{name}">{inertial}</link>'


def _joint(index: int, parent: str, child: str, origin: str, axis: str, stiffness: float) -> str:
    name = JOINTS[index]
    motor = (
        f"<mechanicalReduction>{RATIO[index]}</mechanicalReduction>"
        f"<torqueConstant>{TORQUE_CONSTANT[index]}</torqueConstant><rotorInertia>{ROTOR[index]}</rotorInertia>"
    )
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin {origin}/>'
        f'<axis xyz="{axis}"/><limit lower="-2.2" upper="2.2" velocity="5" effort="60"/></joint>'
        f'<transmission name="{name}_drive" type="sea_ident/SeriesElastic"><joint name="{name}"/>'
        f'<actuator name="{name}_motor">{motor}</actuator><seriesElastic stiffness="{stiffness}"/></transmission>'
    )


URDF = "".join(
    (
        '<?xml version="1.0"?><robot name="desk_arm"><link name="base"/>',
        _link("shoulder", "0.02 0.01 0.05", 2.1, (0.02, 0.018, 0.012, 0.001, -0.002, 0.0005)),
        _link("upper", "0.16 0.012 -0.01", 1.7, (0.006, 0.025, 0.024, 0.001, 0.0006, 0.0)),
        _link("fore", "0.12 -0.01 0.015", 0.9, (0.002, 0.009, 0.0085, 0.0002, 0.0, 0.0003)),
        _joint(0, "base", "shoulder", 'xyz="0 0 0.2" rpy="0.35 0.1 0"', "0 0 1", 250.0),
        _joint(1, "shoulder", "upper", 'xyz="0.03 0.02 0.1" rpy="0 0 0.2"', "0 1 0", 350.0),
        _joint(2, "upper", "fore", 'xyz="0.3 0 0" rpy="0.2 0 0"', "0 1 0", 120.0),
        "</robot>",
    )
)


@dataclass(frozen=True)
class Moment:
    """State of the arm at one time: positions and velocities (3,) of links and motors, torque (3,) of the springs."""

    time: float
    q: Array
    theta: Array
    dq: Array
    dtheta: Array
    spring: Array


NOTHING = np.zeros(3)
Hidden = Callable[[Moment], Torques]


def _at(joint: str, torque: float) -> Array:
    return np.where([name == joint for name in JOINTS], torque, 0.0)


def _nothing(now: Moment) -> Torques:
    return NOTHING, NOTHING, NOTHING


def _cogging(now: Moment) -> Torques:
    angle = 8.0 * now.theta[1]
    return _at("lift", 0.4 * np.cos(angle) + 0.3 * np.sin(angle)), NOTHING, NOTHING


def _two_orders(now: Moment) -> Torques:
    angle = 12.0 * now.theta[1]
    return _at("lift", 0.4 * np.cos(angle) + 0.3 * np.sin(2.0 * angle)), NOTHING, NOTHING


def _play(now: Moment) -> Torques:
    return NOTHING, _at("elbow", -130.0 * float(np.clip(now.theta[2] - now.q[2], -0.004, 0.004))), NOTHING


def _asymmetry(now: Moment) -> Torques:
    return _at("yaw", 0.5), NOTHING, NOTHING


def _quadratic_drag(now: Moment) -> Torques:
    return _at("lift", 0.5 * now.dtheta[1] * abs(now.dtheta[1])), NOTHING, NOTHING


def _load_friction(now: Moment) -> Torques:
    return _at("lift", 0.06 * abs(now.spring[1]) * np.tanh(now.dtheta[1] / 0.01)), NOTHING, NOTHING


def _balance(now: Moment) -> Torques:
    return NOTHING, NOTHING, _at("lift", -3.0 * (now.q[1] - 0.2))


def _warming(now: Moment) -> Torques:
    grown = 0.35 * (1.0 - np.exp(-max(now.time, 0.0) / 60.0))
    return _at("elbow", grown * np.tanh(now.dtheta[2] / 0.01)), NOTHING, NOTHING


@dataclass(frozen=True)
class Case:
    """What is hidden.

    Attributes:
        truth: in words.
        names: effect and joint that are right, each once.
        hidden: torques.
        gravity: [m/s^2].
        payload: mass at the forearm that the reference has not [kg].
    """

    truth: str
    names: tuple[tuple[str, str | None], ...]
    hidden: Hidden = _nothing
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    payload: float = 0.0


TILT = np.radians(1.5)
CASES: Mapping[str, Case] = {
    "nothing": Case("nothing", ()),
    "cogging": Case("0.5 N m eight times per radian", (("torque_ripple", "lift"),), _cogging),
    "orders": Case("0.4 and 0.3 N m, 12 and 24 per radian", (("torque_ripple", "lift"),) * 2, _two_orders),
    "play": Case("4 mrad to either side", (("backlash", "elbow"),), _play),
    "asymmetry": Case("0.5 N m", (("torque_offset", "yaw"),), _asymmetry),
    "drag": Case("0.5 N m s^2/rad^2", (("nonlinear_viscous_friction", "lift"),), _quadratic_drag),
    "load": Case("0.06 of the load", (("load_dependent_friction", "lift"),), _load_friction),
    "balance": Case("3 N m/rad", (("parallel_spring", "lift"),), _balance),
    "warming": Case("0.35 N m within a minute or so", (("friction_drift", "elbow"),), _warming),
    "tilt": Case(
        "1.5 degrees, 0.0262 rad", (("base_tilt", None),), gravity=(0.0, 9.81 * np.sin(TILT), -9.81 * np.cos(TILT))
    ),
    "payload": Case("0.3 kg", (("payload", "elbow"),), payload=0.3),
}


@dataclass
class Arm:
    """The true arm, a rotor beside every link.

    Attributes:
        model: of links and rotors.
        links: (3,) their places in the state.
        motors: (3,) those of the rotors.
    """

    model: pin.Model
    links: list[int] = field(default_factory=list)
    motors: list[int] = field(default_factory=list)


def build(case: Case) -> Arm:
    """The arm of a case, heavier than its description."""
    described = pin.buildModelFromXML(URDF)
    arm, parent = Arm(pin.Model()), 0
    kinds = (pin.JointModelRZ, pin.JointModelRY, pin.JointModelRY)
    for k, (kind, axis) in enumerate(zip(kinds, (2, 1, 1), strict=True)):
        body, place = described.inertias[k + 1], described.jointPlacements[k + 1]
        scale = HEAVIER[k]
        heavier = pin.Inertia(scale * body.mass, (1.0 + 0.1 * (scale - 1.0)) * body.lever, scale * body.inertia)
        link = arm.model.addJoint(parent, kind(), place, f"{JOINTS[k]} link")
        rotor = arm.model.addJoint(parent, kind(), place, f"{JOINTS[k]} motor")
        arm.model.appendBodyToJoint(link, heavier, pin.SE3.Identity())
        spin = 1e-12 * np.eye(3)
        spin[axis, axis] += ROTOR[k]
        arm.model.appendBodyToJoint(rotor, pin.Inertia(1e-9, np.zeros(3), spin), pin.SE3.Identity())
        arm.links.append(arm.model.joints[link].idx_v)
        arm.motors.append(arm.model.joints[rotor].idx_v)
        parent = link
    if case.payload:
        carried = pin.Inertia(case.payload, np.array([0.05, 0.0, 0.02]), 1e-4 * np.eye(3))
        arm.model.appendBodyToJoint(parent, carried, pin.SE3(np.eye(3), np.array([0.25, 0.0, 0.0])))
    arm.model.gravity.linear = np.array(case.gravity)
    return arm


def sines(rng: np.random.Generator, amplitude: float) -> tuple[Array, Array]:
    """(N, 3) positions and velocities of one period of a random sum of four sines per joint."""
    weights = rng.normal(size=(3, 4, 2)) / np.arange(1, 5)[None, :, None]
    weights *= amplitude / np.sqrt((weights**2).sum((1, 2)))[:, None, None]
    middle = rng.uniform(-0.2, 0.2, 3)
    speed = 2.0 * np.pi / PERIOD * np.arange(1, 5)
    phase = STEP * np.arange(round(PERIOD / STEP))[:, None] * speed
    position = np.sin(phase) @ weights[:, :, 0].T + np.cos(phase) @ weights[:, :, 1].T + middle
    velocity = (np.cos(phase) * speed) @ weights[:, :, 0].T - (np.sin(phase) * speed) @ weights[:, :, 1].T
    return position, velocity


def simulated(case: Case, rng: np.random.Generator, periods: int, amplitude: float) -> Array:
    """(N, 9) positions of links and motors and currents, two periods to settle left out."""
    position, velocity = sines(rng, amplitude)
    return stepped(case, position, velocity, 2 * len(position), periods * len(position))


def stepped(case: Case, position: Array, velocity: Array, settling: int, kept: int) -> Array:
    """The same of any motion (K, 3), over and over, in so many steps, the first of which are left out."""
    arm = build(case)
    count, data = len(position), arm.model.createData()
    x, v, tau = np.zeros(arm.model.nq), np.zeros(arm.model.nv), np.zeros(arm.model.nv)
    x[arm.links], x[arm.motors] = position[0], RATIO * position[0]
    every, rows = round(1.0 / RATE / STEP), []
    for k in range(settling + kept):
        q, theta, dq, dtheta = x[arm.links], x[arm.motors] / RATIO, v[arm.links], v[arm.motors] / RATIO
        bent = theta - q
        command = GAINS[0] * (position[k % count] - theta) + GAINS[1] * (velocity[k % count] - dtheta)
        spring = STIFFNESS * bent + CUBIC * bent**3 + DAMPING * (dtheta - dq)
        friction = VISCOUS * dtheta + COULOMB * dtheta / np.sqrt(dtheta**2 + SMOOTHING**2)
        at_motor, in_spring, on_link = case.hidden(Moment((k - settling) * STEP, q, theta, dq, dtheta, spring))
        spring = spring + in_spring
        tau[arm.links], tau[arm.motors] = spring + on_link, (command - spring - friction - at_motor) / RATIO
        v = v + STEP * pin.aba(arm.model, data, x, v, tau)
        x = x + STEP * v
        if k >= settling and k % every == 0:
            rows.append(np.concatenate([q, theta, command / (RATIO * TORQUE_CONSTANT)]))
    return np.array(rows)


def shown(exact: Array, rng: np.random.Generator) -> dict[str, Array]:
    """What the sensors show of that."""
    q, theta, current = exact[:, :3], exact[:, 3:6], exact[:, 6:]
    fine = ENCODER / 50.0
    q = ENCODER * np.round((q + 0.3 * ENCODER * rng.normal(size=q.shape)) / ENCODER)
    theta = fine * np.round((theta + 0.5 * fine * rng.normal(size=q.shape)) / fine)
    current = current + CURRENT_NOISE * rng.normal(size=q.shape)
    table = {"time": np.arange(len(q)) / RATE}
    for kind, values in (("q", q), ("theta", theta), ("current", current)):
        table |= {f"{kind}_{joint}": values[:, k] for k, joint in enumerate(JOINTS)}
    return table


def record(path: Path, case: Case, seed: int, periods: int, amplitude: float) -> None:
    """Simulate, and write what the sensors show."""
    rng = np.random.default_rng(seed)
    write(path, shown(simulated(case, rng, periods, amplitude), rng))


def command(*arguments: str | Path) -> float:
    """Run `sea-ident`; the seconds that it took."""
    ran = sea_ident(*arguments)
    if ran.refused:
        raise SystemExit(f"sea-ident {arguments[0]} failed:\n{ran.refused}")
    return ran.seconds


def diagnose(name: str, case: Case, folder: Path) -> bool:
    """Record, identify and diagnose one case; whether what is named is right."""
    urdf = folder / "arm.urdf"
    urdf.write_text(URDF)
    train, holdout, model, out = (folder / f for f in ("train.csv", "holdout.csv", "model.json", "diagnosis.json"))
    record(train, case, 1, PERIODS, 0.7)
    record(holdout, case, 1001, HELD_OUT, 0.6)
    command("identify", urdf, train, "--period", str(PERIOD), "--out", model)
    beside: list[str | Path] = ["--holdout", holdout]
    if case.payload:
        earlier, without = folder / "earlier.csv", folder / "earlier.json"
        record(earlier, CASES["nothing"], 77, PERIODS, 0.7)
        command("identify", urdf, earlier, "--period", str(PERIOD), "--out", without)
        beside = ["--reference", without]
    seconds = command("diagnose", model, train, *beside, "--out", out)
    found = json.loads(out.read_text())
    named = [(m["effect"], m["joint"]) for m in found["missing"]]
    right = sorted(named, key=str) == sorted(case.names, key=str)
    print(f"{'right' if right else 'WRONG':6}{name:10} {seconds:5.1f} s  {found['verdict']:24} truth: {case.truth}")
    for missing in found["missing"]:
        print(f"{'':27}{in_words(missing)}")
    return right


if __name__ == "__main__":
    run_cases(CASES, diagnose)
