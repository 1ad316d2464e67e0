"""The project's own simulator as the second generator: the truth in the library's formulas, another integrator."""

import warnings
from collections.abc import Iterator

import numpy as np

from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording
from sea_ident.simulation import (
    ComputedTorque,
    FrictionJitter,
    Plant,
    PlantedEffect,
    SensorNoise,
    SmoothCoulomb,
    simulate,
)
from tests.benchmarks.hidden_effects.case import Case, Planted
from tests.benchmarks.hidden_effects.plants import Truth


def plant_of(truth: Truth) -> Plant:
    """The truth as the simulator wants it, without friction at the links."""
    robot, zero = truth.robot, np.zeros(truth.robot.n)
    actuators = [joint.actuator for joint in robot.joints]
    return Plant(
        robot=robot,
        viscous_friction=truth.viscous,
        coulomb_friction=truth.coulomb,
        link_viscous_friction=zero,
        link_coulomb_friction=zero,
        stiffness=truth.stiffness,
        cubic_stiffness=truth.cubic,
        spring_damping=truth.damping,
        efficiency=np.array([1.0 if a is None or a.efficiency is None else a.efficiency for a in actuators]),
        torque_constant=np.array(
            [np.nan if a is None or a.torque_constant is None else a.torque_constant for a in actuators]
        ),
    )


def planted_effects(
    planted: Planted, truth: Truth, smoothing: float, period: float, periods: int
) -> Iterator[PlantedEffect]:
    """The library's effects that say what a planted one says.

    Args:
        planted: the effect, in the library's form.
        truth: the base model.
        smoothing: of the friction [rad/s].
        period: [s].
        periods: over which it drifts or pushes.

    Raises:
        KeyError: for an effect that the library does not have.
    """
    robot = truth.robot
    p, s, c, joint = planted, planted.shape, planted.size, planted.joint
    i = 0 if joint is None else robot.index(joint)
    duration = period * periods
    turn = (c * np.cos(s.get("phase", 0.0)), c * np.sin(s.get("phase", 0.0)))

    def one(*values: float, **shape: float) -> PlantedEffect:
        return PlantedEffect(make_effect(p.effect, joint, **shape), np.array(values, dtype=float))

    def drift(*amounts: float, **shape: float) -> PlantedEffect:
        linear = s["kind"] < 0.5
        tau = 1e4 if linear else duration / 3.0
        rate = 60.0 / (tau * -np.expm1(-duration / tau))
        return one(*(rate * a for a in amounts), time_constant=tau, **shape)

    match p.effect:
        case "stribeck_friction":
            yield one(c, speed=s["speed"], exponent=s["exponent"], smoothing=smoothing)
        case "nonlinear_viscous_friction" | "spring_stiffening":
            yield one(c, exponent=s["exponent"])
        case "presliding_friction":
            yield one(float(truth.coulomb[i]), displacement=c, smoothing=smoothing)
        case "load_dependent_friction" | "directional_efficiency":
            yield one(c, smoothing=smoothing)
        case "position_dependent_friction":
            yield one(*turn, order=s["order"], smoothing=smoothing)
        case "torque_ripple":
            yield one(*turn, order=s["order"])
        case "torque_offset" | "spring_offset" | "torque_saturation":
            yield one(c)
        case "torque_constant":  # here what is recorded is more by it, there it is divided
            yield one(1.0 / (1.0 + c) - 1.0)
        case "asymmetric_spring":
            yield one(c * truth.stiffness[i], exponent=1.0)
        case "spring_hysteresis":
            yield one(0.5 * c, 0.5 * c, slip=s["width"])
        case "backlash":
            # play in series with the whole law of the spring, as in the other engine
            yield one(truth.stiffness[i], half_width=c, softness=0.01, cubic=float(truth.cubic[i] / truth.stiffness[i]))
        case "link_friction":
            yield one(c * s["viscous"], c, smoothing=smoothing)
        case "parallel_spring":
            yield one(c, -c * s["rest"])
        case "base_tilt":
            yield one(-c * s["x"], -c * s["y"])
        case "link_flexibility":
            yield one(compliance=c)
        case "transmission_coupling":
            other = robot.joint_names[int(s["other"])]
            effect = make_effect(p.effect, joint, other=other, smoothing=smoothing, ratio=c)  # type: ignore[arg-type]
            yield PlantedEffect(effect, effect.planted(robot, c))  # type: ignore[attr-defined]
        case "encoder_offset" | "motor_encoder_offset" | "joint_offset":
            yield one(offset=c)
        case "encoder_eccentricity":
            yield one(sine=turn[0], cosine=turn[1])
        case "position_delay":
            yield one(delay=c)
        case "torque_delay":  # here the current lags, there it leads
            yield one(delay=-c)
        case "friction_drift":
            yield drift(c * float(truth.viscous[i]), c * float(truth.coulomb[i]), smoothing=smoothing)
        case "stiffness_drift":
            yield drift(-c * float(truth.stiffness[i]))
        case "torque_constant_drift":
            yield drift(-c)
        case "temperature_friction":
            tau = s["time_constant"] * duration
            change = [-c / 18.0 * float(base[i]) for base in (truth.viscous, truth.coulomb)]
            yield one(*change, reference=24.0, rise=18.0, time_constant=tau, smoothing=smoothing)
        case "external_force":
            force = [c * s[axis] for axis in "xyz"]
            for k in range(periods):
                yield one(*force, start=(k + s["begin"]) * period, stop=(k + s["end"]) * period)
        case "payload":
            centre = np.array([s[axis] for axis in "xyz"])
            inertia = c * (4e-4 * np.eye(3) + centre @ centre * np.eye(3) - np.outer(centre, centre))
            moments = [inertia[a] for a in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
            yield one(c, *(c * centre), *moments)
        case _:
            raise KeyError(f"the library has no effect {p.effect!r}")


def record_project(
    case: Case, truth: Truth, series: FourierSeries, periods: int, planted: tuple[Planted, ...], seed: int, name: str
) -> Recording:
    """A recording of the project's simulator.

    Args:
        case: noise and friction.
        truth: the robot.
        series: trajectory of the links.
        periods: of the recording.
        planted: what acts beside the base model.
        seed: of noise and jitter.
        name: of the recording.

    Returns:
        The recording.
    """
    noise, robot = case.noise, truth.robot
    plant = plant_of(truth)
    # what drifts does so by the clock, however long a recording is
    shape = case.friction_smoothing, case.period, max(case.periods, periods)
    effects = [e for p in planted for e in planted_effects(p, truth, *shape)]
    share = noise.torque * _torque_rms(truth, series)
    scale = np.array([j.actuator.gear_ratio if j.actuator else 1.0 for j in robot.joints]) * np.nan_to_num(
        plant.torque_constant, nan=1.0
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        result = simulate(
            robot,
            series,
            periods=periods,
            seed=seed,
            plant=plant,
            sensors=SensorNoise(
                link_position=noise.link_encoder,
                motor_position=noise.motor_encoder,
                link_resolution=noise.link_step,
                motor_resolution=noise.motor_step,
                current=tuple(share / scale),
                motor_torque=tuple(share),
            ),
            jitter=FrictionJitter(noise.jitter, noise.jitter_speed),
            friction=SmoothCoulomb(case.friction_smoothing),
            effects=effects,
            controller=ComputedTorque(plant) if robot.elastic_indices.size else None,
        )
    columns = {k: v for k, v in result.recording.columns.items() if "reference" not in k}
    return Recording(result.recording.time, columns, name)


def _torque_rms(truth: Truth, series: FourierSeries) -> np.ndarray:
    from tests.benchmarks.hidden_effects.engine import reference_torque

    _, torque = reference_torque(truth, series, np.arange(500) * (series.period / 500))
    return np.sqrt(np.mean(torque**2, axis=0))
