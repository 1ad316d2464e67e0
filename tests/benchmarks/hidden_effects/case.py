"""What a case of the benchmark is: drawn from a seed, written as JSON, opened only after the diagnosis."""

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Planted:
    """An effect in the truth.

    Attributes:
        effect: its name in the library's interface, or a name of its own where the library has nothing like it.
        joint: joint at which it acts, None where it acts on the whole robot.
        form: `library` where the truth follows the library's formula, else the name of the truth's own law.
        size: linear size in the units of the form.
        shape: nonlinear parameters of the form.
        gap: what the base model leaves unexplained, as a share of the joint's torque rms [-].
        torque_share: change of the motor torque with and without it, as a share of the joint's torque rms [-].
        small: whether it is one of the small companions of a main effect.
    """

    effect: str
    joint: str | None
    form: str
    size: float
    shape: dict[str, float] = field(default_factory=dict)
    gap: float = float("nan")
    torque_share: float = float("nan")
    small: bool = False

    @property
    def name(self) -> tuple[str, str | None]:
        """Effect and joint, as a diagnosis should give them."""
        return self.effect, self.joint


@dataclass(frozen=True)
class Noise:
    """Sensors and pass-to-pass variation of one case.

    Attributes:
        link_encoder: standard deviation of q before quantisation [rad].
        motor_encoder: standard deviation of theta before quantisation [rad].
        link_step: quantisation of q [rad].
        motor_step: quantisation of theta [rad].
        torque: standard deviation of the recorded torque, as a share of the joint's torque rms [-].
        actuator: real torque noise of the drive, as a share of the joint's torque rms [-].
        jitter: spread of the Coulomb friction from pass to pass near zero speed [-].
        jitter_speed: speed up to which it acts [rad/s].
    """

    link_encoder: float
    motor_encoder: float
    link_step: float
    motor_step: float
    torque: float
    actuator: float
    jitter: float
    jitter_speed: float


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes:
        row: row of the table that it belongs to.
        seed: seed of the run.
        index: number of the case within its row.
        robot: name in `plants.ROBOTS`, or of one that is drawn.
        engine: `mujoco` or `project`.
        period: [s].
        periods: periods of the training recording.
        holdout_periods: periods of the held-out recording.
        weak: whether the excitation is weak.
        channel: `tau_motor` or `current`, what the recording holds.
        friction_form: `ramp` or `tanh`, how the base friction turns its sign.
        friction_smoothing: its width [rad/s].
        noise: sensors and variation.
        planted: the truth.
        reference: whether an earlier recording without the planted effects is given as a reference model.
        forbidden: effects taken out of the library that diagnoses.
    """

    row: str
    seed: int
    index: int
    robot: str
    engine: str
    period: float
    periods: int
    holdout_periods: int
    weak: bool
    channel: str
    friction_form: str
    friction_smoothing: float
    noise: Noise
    planted: tuple[Planted, ...]
    reference: bool = False
    forbidden: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Name of its files."""
        return f"{self.row}_{self.index:04d}"

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        return asdict(self)

    @staticmethod
    def from_dict(record: dict[str, Any]) -> "Case":
        """The case that `to_dict` wrote."""
        values = dict(record)
        values["noise"] = Noise(**values["noise"])
        values["planted"] = tuple(Planted(**p) for p in values["planted"])
        values["forbidden"] = tuple(values["forbidden"])
        return Case(**values)


def generator(*key: int) -> np.random.Generator:
    """Random numbers that depend on nothing but the key."""
    return np.random.default_rng(np.random.SeedSequence(list(key)))
