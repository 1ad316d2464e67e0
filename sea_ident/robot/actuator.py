"""Actuators of a joint: a motor behind a gear, with or without a spring in series."""

from dataclasses import dataclass

from sea_ident._typing import FloatArray


@dataclass(frozen=True, eq=False)
class Actuator:
    """A motor that drives a joint rigidly through a gear.

    Every number but the gear ratio is an optional prior: what is None is identified, not guessed.

    Attributes:
        name: name of the actuator in the annotation.
        joint: name of the joint that it drives.
        gear_ratio: N, motor shaft angle per angle after the gear [-].
        torque_constant: k_t at the motor shaft [N m/A].
        rotor_inertia: about the spin axis, at the motor shaft [kg m2].
        rotor_group: motors of one group share one rotor inertia parameter.
        efficiency: eta of the transmission, in (0, 1] [-] (paper, eq. 7).
        viscous_friction: prior, acts on theta' [N m s/rad].
        coulomb_friction: prior, acts on theta' [N m].
        carrier: name of the link on which the motor is mounted.
        rotor_axis: (3,) unit spin axis in the frame of the carrier [-].
    """

    name: str
    joint: str
    gear_ratio: float
    torque_constant: float | None
    rotor_inertia: float | None
    rotor_group: str
    efficiency: float | None
    viscous_friction: float | None
    coulomb_friction: float | None
    carrier: str
    rotor_axis: FloatArray

    @property
    def elastic(self) -> bool:
        """Whether a spring stands between the gear and the link."""
        return False


@dataclass(frozen=True, eq=False)
class SeriesElasticActuator(Actuator):
    """A motor that drives a joint through a gear and a spring.

    tau_spring = K1 (theta - q) + K3 (theta - q)^3 + D (theta' - q')  (paper, eq. 21)

    Attributes:
        stiffness: prior K1 [N m/rad].
        cubic_stiffness: prior K3 [N m/rad3].
        damping: prior D [N m s/rad].
    """

    stiffness: float | None = None
    cubic_stiffness: float | None = None
    damping: float | None = None

    @property
    def elastic(self) -> bool:
        """Whether a spring stands between the gear and the link."""
        return True
