"""Robots that nobody built: trees of one to six links, drawn from a seed.

Axes point along an axis of their link or anywhere, links are 5 cm to 1.5 m long, chance makes joints elastic or rigid.
Springs, rotors and friction are in proportion to the weight that a joint carries.
"""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.hidden_effects.case import FloatArray, generator

MOST_JOINTS = 6
GRAVITY = 9.81


@dataclass(frozen=True)
class DrawnRobot:
    """A robot from a seed.

    Attributes:
        urdf: its description.
        viscous: viscous friction of the joints without a motor in it, 0 of the others [N m s/rad].
        coulomb: Coulomb friction of these [N m].
        reach: largest distance from the middle of the motion [rad].
        velocity: largest speed of the motion [rad/s].
        acceleration: largest acceleration of the motion [rad/s2].
    """

    urdf: str
    viscous: tuple[float, ...]
    coulomb: tuple[float, ...]
    reach: float
    velocity: float
    acceleration: float


def drawn_name(seed: int, index: int) -> str:
    """Name of a robot that is drawn."""
    return f"drawn-{seed}-{index}"


def drawn_robot(name: str) -> DrawnRobot:
    """The robot of a name."""
    _, seed, index = name.split("-")
    rng = generator(int(seed), 777, int(index))
    count = int(rng.integers(1, MOST_JOINTS + 1))
    parents = [-1, *(k if rng.random() < 0.75 else int(rng.integers(-1, k + 1)) for k in range(count - 1))]
    scale = _between(rng, 0.3, 3.0)
    lengths = 0.3 * scale * np.exp(rng.uniform(-0.5, 0.5, count))
    masses = 2.5 * scale**3 * np.exp(rng.uniform(-0.6, 0.6, count)) * 0.75 ** np.arange(count)
    along = [_direction(rng) for _ in range(count)]
    parts = ['<link name="base"/>', *(_link(rng, k, masses[k], lengths[k], along[k]) for k in range(count))]
    viscous, coulomb = np.zeros((2, count))
    for k, parent in enumerate(parents):
        carried = _carried(parents, k)
        mass, reach = float(masses[carried].sum()), float(lengths[carried].sum())
        torque, inertia = 0.35 * mass * GRAVITY * reach, 0.12 * mass * reach**2
        place = along[parent] * lengths[parent] if parent >= 0 else 0.2 * scale * rng.uniform(-1.0, 1.0, 3)
        parts.append(_joint(rng, k, parent, place, torque))
        friction = 0.06 * torque * np.exp(rng.uniform(-0.7, 0.7, 2))
        if rng.random() < 0.6:
            parts.append(_motor(rng, k, torque, inertia, friction))
        else:
            viscous[k], coulomb[k] = friction
    urdf = f'<robot name="{name}">' + "".join(parts) + "</robot>"
    limits = (float(rng.uniform(0.5, 1.2)), float(rng.uniform(1.0, 2.0)), float(rng.uniform(4.0, 10.0)))
    return DrawnRobot(urdf, tuple(viscous.tolist()), tuple(coulomb.tolist()), *limits)


def _carried(parents: list[int], k: int) -> list[int]:
    """A link and all that it carries."""
    found = [k]
    for j in range(k + 1, len(parents)):
        if parents[j] in found:
            found.append(j)
    return found


def _between(rng: np.random.Generator, lower: float, upper: float) -> float:
    return float(np.exp(rng.uniform(np.log(lower), np.log(upper))))


def _direction(rng: np.random.Generator) -> FloatArray:
    vector = rng.standard_normal(3)
    return np.asarray(vector / np.linalg.norm(vector))


def _text(values: FloatArray) -> str:
    return " ".join(repr(float(v)) for v in values)


def _link(rng: np.random.Generator, k: int, mass: float, length: float, along: FloatArray) -> str:
    """A rod along a direction, a little uneven."""
    centre = length * (along * rng.uniform(0.3, 0.6) + rng.uniform(-0.05, 0.05, 3))
    across = np.outer(along, along)
    inertia = mass * (length**2 / 12.0 * (np.eye(3) - across) + (0.15 * length) ** 2 * 0.5 * (np.eye(3) + across))
    names = ("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2)
    moments = " ".join(f'{name}="{float(inertia[i, j])!r}"' for name, i, j in names)
    return (
        f'<link name="link{k}"><inertial><origin xyz="{_text(centre)}"/><mass value="{float(mass)!r}"/>'
        f"<inertia {moments}/></inertial></link>"
    )


def _joint(rng: np.random.Generator, k: int, parent: int, place: FloatArray, torque: float) -> str:
    axis = _direction(rng)
    if rng.random() < 0.7:
        axis = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
    turned = rng.uniform(-1.0, 1.0, 3) if rng.random() < 0.4 else np.zeros(3)
    carrier = "base" if parent < 0 else f"link{parent}"
    return (
        f'<joint name="joint{k}" type="revolute"><parent link="{carrier}"/><child link="link{k}"/>'
        f'<origin xyz="{_text(place)}" rpy="{_text(turned)}"/><axis xyz="{_text(axis)}"/>'
        f'<limit lower="-1.8" upper="1.8" velocity="4" effort="{20.0 * torque!r}"/></joint>'
    )


def _motor(rng: np.random.Generator, k: int, torque: float, inertia: float, friction: FloatArray) -> str:
    """A motor with a spring that bends by 15 to 100 mrad under the weight that it carries."""
    gear, deflection = float(rng.choice([30.0, 50.0, 100.0, 160.0])), _between(rng, 0.015, 0.1)
    stiffness, rotor = torque / deflection, inertia * _between(rng, 0.1, 1.5) / gear**2
    damping = 0.1 * np.sqrt(stiffness * inertia)
    # one that softens more would push the wrong way where the motion bends it several times as far
    cubic = f' cubicStiffness="{stiffness * rng.uniform(-0.004, 0.1) / deflection**2!r}"' if rng.random() < 0.3 else ""
    return (
        f'<transmission name="motor{k}" type="sea_ident/SeriesElastic">'
        f'<joint name="joint{k}"><limit acceleration="20"/></joint><actuator name="motor{k}">'
        f"<mechanicalReduction>{gear!r}</mechanicalReduction><torqueConstant>0.1</torqueConstant>"
        f"<rotorInertia>{rotor!r}</rotorInertia><viscousFriction>{float(friction[0])!r}</viscousFriction>"
        f"<coulombFriction>{float(friction[1])!r}</coulombFriction></actuator>"
        f'<seriesElastic stiffness="{stiffness!r}" damping="{float(damping)!r}"{cubic}/></transmission>'
    )
