"""A rigid arm and a robot with two chains, described or recorded wrongly: is it told what is wrong?

    python -m tests.benchmarks.bench_wrong_descriptions [NAME ...]

Two robots that the project does not have: six rigid joints with tilted axes, and two alike chains of two
joints with springs and a rigid one. Their true bodies, rotors, springs and frictions are not those of their
description. A motion is given, the torque follows from Pinocchio's recursive Newton-Euler algorithm, the springs are
inverted, and what sensors show is written to CSV files. Then something is wrong, in the files or in the URDF, and
`sea-ident identify` and `sea-ident diagnose` are run. A case is right where the effects that are named are those that
are wrong, or where nothing is named and the warnings say what to do. Printed per case: that, the verdict, what is named
and the seconds.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tests.benchmarks.through_files import in_words, run_cases, sea_ident, write

Array = NDArray[np.float64]
Table = dict[str, Array]

PERIOD, RATE, STEPS = 5.0, 250.0, 8
"""Period [s], rate of the recording [Hz], and instants that are computed per sample."""

PERIODS, HELD_OUT = 12, 6
CORNER = 200.0
"""Frequency above which nothing is differentiated [Hz]."""

ENCODER = 2.0 * np.pi / 2**17
"""Step of the encoder of a link [rad]; that of a motor is fifty times finer."""

CURRENT_NOISE = 0.02
"""Standard deviation [A]."""

SURE = ("named", "named_with_remainder")
RIGHT = 0.5 * np.pi
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
ARM = tuple(f"a{k}" for k in range(1, 7))
BOTH = ("l1", "l2", "l3", "r1", "r2", "r3")


@dataclass(frozen=True)
class Joint:
    """A joint with the link that it moves: places and numbers as in a URDF, inertia as ixx, iyy, izz, ixy, ixz, iyz."""

    name: str
    parent: str
    xyz: str
    rpy: str
    axis: str
    ratio: float
    torque_constant: float
    rotor: float
    com: str
    mass: float
    inertia: tuple[float, ...]
    stiffness: float | None = None

    def urdf(self) -> str:
        """Link, joint and transmission."""
        moments = " ".join(f'{k}="{v}"' for k, v in zip(MOMENTS, self.inertia, strict=True))
        kind = "transmission_interface/SimpleTransmission" if self.stiffness is None else "sea_ident/SeriesElastic"
        spring = "" if self.stiffness is None else f'<seriesElastic stiffness="{self.stiffness}"/>'
        return (
            f'<link name="{self.name}_link"><inertial><origin xyz="{self.com}"/><mass value="{self.mass}"/>'
            f'<inertia {moments}/></inertial></link><joint name="{self.name}" type="revolute">'
            f'<parent link="{self.parent}"/><child link="{self.name}_link"/><origin xyz="{self.xyz}" rpy="{self.rpy}"/>'
            f'<axis xyz="{self.axis}"/><limit lower="-2.2" upper="2.2" velocity="5" effort="200"/></joint>'
            f'<transmission name="{self.name}_drive" type="{kind}"><joint name="{self.name}"/>'
            f'<actuator name="{self.name}_motor"><mechanicalReduction>{self.ratio}</mechanicalReduction>'
            f"<torqueConstant>{self.torque_constant}</torqueConstant><rotorInertia>{self.rotor}</rotorInertia>"
            f"</actuator>{spring}</transmission>"
        )


def _arm() -> tuple[Joint, ...]:
    places = (
        ("base", "0 0 0.15", "0.1 0.05 0", "0 0 1"),
        ("a1_link", "0.05 0.1 0.1", "0 0 0.1", "0 1 0"),
        ("a2_link", "0.42 -0.02 0", "0 0.1 0", "0 1 0"),
        ("a3_link", "0.36 0.01 0", "0 1.3 0", "0 1 0"),
        ("a4_link", "0 0.09 0.02", "1.5708 0 0", "0 1 0"),
        ("a5_link", "0 0 0.08", "0 0.05 0", "0 0 1"),
    )
    motors = (
        (100, 0.1, 1.2e-4), (100, 0.1, 1.5e-4), (80, 0.1, 8e-5), (60, 0.06, 3e-5), (50, 0.06, 3e-5), (50, 0.05, 2e-5),
    )  # fmt: skip
    bodies = (
        ("0.01 -0.02 0.06", 3.5, (0.02, 0.02, 0.015, 0.001, 0.0, 0.0005)),
        ("0.2 0.01 0.05", 5.0, (0.02, 0.11, 0.11, 0.002, 0.003, 0.0)),
        ("0.17 0 -0.02", 2.6, (0.006, 0.045, 0.045, 0.0, 0.001, 0.0005)),
        ("0.01 0.04 0.02", 1.3, (0.003, 0.002, 0.003, 0.0001, 0.0, 0.0002)),
        ("0.0 -0.03 0.02", 1.1, (0.002, 0.0018, 0.0015, 0.0, 0.0001, 0.0001)),
        ("0.02 0.01 0.06", 0.6, (0.0012, 0.0011, 0.0005, 0.0001, 0.0, 0.0)),
    )
    return tuple(
        Joint(f"a{k + 1}", *place, *motor, *body)
        for k, (place, motor, body) in enumerate(zip(places, motors, bodies, strict=True))
    )


def _two_chains() -> tuple[Joint, ...]:
    found = []
    for side, sign in (("l", 1.0), ("r", -1.0)):
        found += [
            Joint(
                f"{side}1", "torso", f"0.02 {0.2 * sign} 0.4", f"{0.3 * sign} 0 0", "0 1 0", 100, 0.06, 3e-5,
                f"0.01 {0.05 * sign} 0.0", 2.4, (0.012, 0.01, 0.012, 0.0005 * sign, 0.0, 0.0), 300.0,
            ),
            Joint(
                f"{side}2", f"{side}1_link", f"0 {0.12 * sign} 0", "0 0.1 0", "1 0 0", 100, 0.06, 3e-5,
                f"0.02 {0.01 * sign} -0.16", 2.0, (0.03, 0.03, 0.006, 0.0, 0.001, 0.0), 250.0,
            ),
            Joint(
                f"{side}3", f"{side}2_link", "0 0 -0.32", "0 0 0.1", "0 1 0", 60, 0.05, 2e-5,
                "0.01 0.0 -0.13", 1.2, (0.012, 0.012, 0.002, 0.0, 0.0003, 0.0),
            ),
        ]  # fmt: skip
    return tuple(found)


ROBOTS: Mapping[str, tuple[str, tuple[Joint, ...]]] = {"arm": ("base", _arm()), "chains": ("torso", _two_chains())}


def described(robot: str) -> str:
    """The URDF of a robot."""
    root, joints = ROBOTS[robot]
    return f'<robot name="{robot}"><link name="{root}"/>{"".join(joint.urdf() for joint in joints)}</robot>'


def differentiated(values: Array, order: int) -> Array:
    """Derivative of a closed period (N, n)."""
    turns = 2j * np.pi * np.fft.fftfreq(len(values), PERIOD / len(values))
    turns[np.abs(turns) > 2.0 * np.pi * CORNER] = 0.0
    return np.real(np.fft.ifft((turns**order)[:, None] * np.fft.fft(values, axis=0), axis=0))


def recorded(robot: str, seed: int, amplitude: float, periods: int, gravity: tuple[float, float, float]) -> Table:
    """What the sensors show of a random motion of the true robot."""
    joints, model = ROBOTS[robot][1], pin.buildModelFromXML(described(robot))
    n, own = len(joints), np.random.default_rng(5)
    for body in range(1, model.njoints):
        inertia, heavier = model.inertias[body], own.uniform(0.9, 1.12)
        lever = inertia.lever * own.uniform(0.95, 1.05)
        model.inertias[body] = pin.Inertia(heavier * inertia.mass, lever, heavier * inertia.inertia)
    model.gravity.linear = np.array(gravity)
    ratio, constant = (np.array([getattr(j, key) for j in joints]) for key in ("ratio", "torque_constant"))
    rotor = np.array([j.rotor for j in joints]) * ratio**2 * own.uniform(0.9, 1.1, n)
    viscous, coulomb = own.uniform(1.0, 3.0, (2, n))
    elastic = np.array([j.stiffness is not None for j in joints])
    stiffness = np.array([j.stiffness or np.inf for j in joints]) * own.uniform(0.9, 1.1, n)
    cubic = np.where(elastic, 10.0 * own.uniform(1.0, 8.0, n) * np.where(elastic, stiffness, 0.0), 0.0)

    rng, count = np.random.default_rng(seed), round(PERIOD * RATE) * STEPS
    weights = rng.normal(size=(n, 4, 2)) / np.arange(1, 5)[None, :, None]
    weights *= amplitude / np.sqrt((weights**2).sum((1, 2)))[:, None, None]
    phase = 2.0 * np.pi * np.arange(count)[:, None] / count * np.arange(1, 5)
    q = np.sin(phase) @ weights[:, :, 0].T + np.cos(phase) @ weights[:, :, 1].T + rng.uniform(-0.2, 0.2, n)
    at = [model.joints[model.getJointId(j.name)].idx_v for j in joints]
    x = np.zeros((3, count, n))
    x[:, :, at] = q, differentiated(q, 1), differentiated(q, 2)
    data = model.createData()
    torque = np.array([pin.rnea(model, data, *each) for each in x.transpose(1, 0, 2)])[:, at]
    bent = np.zeros_like(torque)
    for _ in range(30):
        bent[:, elastic] = ((torque - cubic * bent**3) / stiffness)[:, elastic]
    theta = q + bent
    speed = differentiated(theta, 1)
    motor = torque + rotor * differentiated(theta, 2) + viscous * speed + coulomb * speed / np.hypot(speed, 0.005)

    q, theta, motor = (np.tile(values[::STEPS], (periods, 1)) for values in (q, theta, motor))
    noise = np.random.default_rng(seed + 500).normal(size=(3, *q.shape))
    fine = ENCODER / 50.0
    q = ENCODER * np.round((q + 0.3 * ENCODER * noise[0]) / ENCODER)
    theta = fine * np.round((theta + 0.5 * fine * noise[1]) / fine)
    table: Table = {"time": np.arange(len(q)) / RATE}
    for i, joint in enumerate(joints):
        table[f"q_{joint.name}"] = q[:, i]
        if joint.stiffness is not None:
            table[f"theta_{joint.name}"] = theta[:, i]
        table[f"current_{joint.name}"] = motor[:, i] / (ratio[i] * constant[i]) + CURRENT_NOISE * noise[2, :, i]
    return table


Edit = Callable[[Table], Table]


def exchanged(kind: str, a: str, b: str) -> Edit:
    """Two columns under each other's name."""
    return lambda table: {**table, f"{kind}_{a}": table[f"{kind}_{b}"], f"{kind}_{b}": table[f"{kind}_{a}"]}


def legs_exchanged(table: Table) -> Table:
    """Left under the name of right."""
    other = {"l": "r", "r": "l"}
    names = {key: key if key == "time" else "_".join((key[:-3], other[key[-2]] + key[-1])) for key in table}
    return {key: table[name] for key, name in names.items()}


def turned(*columns: str) -> Edit:
    """Columns with the other sign."""
    return lambda table: {key: -values if key in columns else values for key, values in table.items()}


def moved(**zeros: float) -> Edit:
    """Columns with another zero."""
    return lambda table: {key: values + zeros.get(key, 0.0) for key, values in table.items()}


def times(factor: float, kind: str) -> Edit:
    """All columns of a kind in another unit."""
    return lambda table: {key: factor * v if key.split("_")[0] == kind else v for key, v in table.items()}


def late(samples: int, *columns: str) -> Edit:
    """Columns that come late."""
    return lambda table: {key: np.roll(v, samples) if key in columns else v for key, v in table.items()}


@dataclass(frozen=True)
class Case:
    """What is wrong.

    Attributes:
        robot: of `ROBOTS`.
        names: effects and joints that are to be named.
        says: part of a warning, where nothing is to be named.
        edit: of the files.
        urdf: parts of the description, and what stands there instead.
        gravity: that acts [m/s2].
    """

    robot: str
    names: tuple[tuple[str, str | None], ...] = ()
    says: str = ""
    edit: Edit = dict
    urdf: tuple[tuple[str, str], ...] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)


def _at(effect: str, *joints: str) -> tuple[tuple[str, str | None], ...]:
    """An effect at every one of these joints."""
    return tuple((effect, joint) for joint in joints)


CASES: Mapping[str, Case] = {
    "arm": Case("arm"),
    "arm-positions": Case("arm", says="the positions of 'a2' and 'a3' look exchanged", edit=exchanged("q", "a2", "a3")),
    "arm-currents": Case("arm", says="current of 'a4' and 'a5' look exchanged", edit=exchanged("current", "a4", "a5")),
    "arm-sign": Case("arm", says="'q_a3=q_a3,sign=-1'", edit=turned("q_a3", "current_a3")),
    "arm-milliamperes": Case("arm", says="'current_a1=current_a1,unit=mA'", edit=times(1000.0, "current")),
    "arm-zero": Case("arm", _at("encoder_offset", "a2"), edit=moved(q_a2=0.2)),
    "arm-zero-90": Case("arm", _at("encoder_offset", "a3"), edit=moved(q_a3=RIGHT)),
    "arm-zeros-90": Case("arm", _at("encoder_offset", "a2", "a3"), edit=moved(q_a2=RIGHT, q_a3=-RIGHT)),
    "arm-zeros-of-four": Case(
        "arm",
        _at("encoder_offset", "a2", "a3", "a4", "a5"),
        edit=moved(q_a2=-RIGHT, q_a3=RIGHT, q_a4=-RIGHT, q_a5=2.0 * RIGHT),
    ),
    "arm-length": Case("arm", _at("joint_placement", "a3"), urdf=(("0.42 -0.02 0", "0.50 -0.02 0"),)),
    "arm-lengths": Case(
        "arm",
        _at("joint_placement", "a3", "a4"),
        urdf=(("0.42 -0.02 0", "0.44 -0.02 0"), ("0.36 0.01 0", "0.34 0.01 0")),
    ),
    "arm-angle": Case("arm", _at("encoder_offset", "a4"), urdf=(('rpy="0 1.3 0"', 'rpy="0 1.5 0"'),)),
    "arm-ratio": Case("arm", _at("torque_constant", "a3"), urdf=(("Reduction>80<", "Reduction>100<"),)),
    "arm-late": Case("arm", _at("torque_delay", "a2"), edit=late(3, "current_a2")),
    "arm-all-late": Case("arm", (("torque_delay", None),), edit=late(3, *(f"current_{joint}" for joint in ARM))),
    "arm-hangs": Case("arm", says="--gravity=0,0,9.81", gravity=(0.0, 0.0, 9.81)),
    "arm-wall": Case("arm", says="--gravity=9.81,0,0", gravity=(9.81, 0.0, 0.0)),
    "chains": Case("chains"),
    "chains-legs": Case("chains", says="the chains l1, l2, l3 and r1, r2, r3 look exchanged", edit=legs_exchanged),
    "chains-positions": Case("chains", says="look exchanged", edit=exchanged("q", "l1", "r1")),
    "chains-sign": Case("chains", says="sign=-1", edit=turned("theta_r2")),
    "chains-zero-of-link": Case("chains", _at("encoder_offset", "l2"), edit=moved(q_l2=0.8)),
    "chains-zero": Case("chains", _at("joint_offset", "l2"), edit=moved(q_l2=0.8, theta_l2=0.8)),
    "chains-zero-of-first": Case("chains", _at("joint_offset", "l1"), edit=moved(q_l1=0.8, theta_l1=0.8)),
    "chains-zero-180": Case("chains", _at("joint_offset", "l2"), edit=moved(q_l2=2.0 * RIGHT, theta_l2=2.0 * RIGHT)),
    "chains-zeros-90": Case(
        "chains",
        _at("joint_offset", "l2", "r2"),
        edit=moved(q_l2=RIGHT, theta_l2=RIGHT, q_r2=-RIGHT, theta_r2=-RIGHT),
    ),
    "chains-links-late": Case("chains", (("position_delay", None),), edit=late(2, *(f"q_{joint}" for joint in BOTH))),
    "chains-all-late": Case("chains", (("torque_delay", None),), edit=late(2, *(f"current_{joint}" for joint in BOTH))),
    "chains-length": Case("chains", _at("joint_placement", "l3"), urdf=(("0 0 -0.32", "0 0 -0.25"),)),
    "chains-leans": Case("chains", (("base_tilt", None),), gravity=(9.81 * np.sin(0.1), 0.0, -9.81 * np.cos(0.1))),
    "chains-hangs": Case("chains", says="--gravity=0,0,9.81", gravity=(0.0, 0.0, 9.81)),
}


def told(name: str, case: Case, folder: Path) -> bool:
    """Record, identify and diagnose one case; whether what is wrong is told."""
    urdf, model, out = (folder / file for file in ("robot.urdf", "model.json", "diagnosis.json"))
    text = described(case.robot)
    for part, instead in case.urdf:
        text = text.replace(part, instead, 1)
    urdf.write_text(text)
    files = folder / "train.csv", folder / "holdout.csv"
    for file, seed, amplitude, periods in zip(files, (1, 2), (0.7, 0.6), (PERIODS, HELD_OUT), strict=True):
        write(file, case.edit(recorded(case.robot, seed, amplitude, periods, case.gravity)))
    ran = sea_ident("identify", urdf, files[0], "--period", str(PERIOD), "--out", model)
    if not ran.refused:
        ran = sea_ident("diagnose", model, files[0], "--holdout", files[1], "--out", out)
    if ran.refused:
        right = bool(case.says) and case.says in ran.refused
        print(f"{'right' if right else 'WRONG':6}{name:22}refused: {ran.refused.strip()[:200]}", flush=True)
        return right
    found = json.loads(out.read_text())
    named = {(m["effect"], m["joint"]) for m in found["missing"]}
    said = not case.says or any(case.says in text for text in found["warnings"])
    right = named == set(case.names) and said
    # what is named without reservation, or nothing: what is wrong with a file leaves nothing to be told
    right = right and found["verdict"] in (SURE if case.names else ("none", "cannot_tell") if case.says else ("none",))
    print(f"{'right' if right else 'WRONG':6}{name:22}{ran.seconds:6.1f} s  {found['verdict']}", flush=True)
    for missing in found["missing"]:
        print(f"{'':28}{in_words(missing)}", flush=True)
    return right


if __name__ == "__main__":
    run_cases(CASES, told)
