"""How long a step may be for the friction of a robot, and for how fast it moves."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from sea_ident.simulation.friction import FrictionLaw
from sea_ident.simulation.plant import Plant
from sea_ident.simulation.planted import coordinate_map, motor_coordinates
from sea_ident.simulation.reference import Reference

LONGEST = 2.5e-3
"""Step where friction asks for no shorter one [s], ..."""

SHORTEST = 5e-4
"""... and where it asks for next to nothing [s]: friction without any smoothing has no step that is short enough."""

LONGEST_BETWEEN = 5e-3
"""Step between reversals [s], where it is seen to be short enough."""

TIMES_BRAKING = 3.0
"""Times as long as the time in which friction at its steepest brakes a joint that a step may be [-].

Positions of legs and of arms are then within 1e-5 rad of those with steps of a twentieth, also where motions are fast.
The first stage of a much longer step does not see how steep friction is going to be where a joint reverses."""

FARTHEST_TURN = 0.034
"""Angle by which a link may turn in a step [rad]: where one turns by twice as much, torques are off by one or two
thousandths of themselves, which a good recording shows."""

PLACES = 16
"""Configurations along the reference at which the inertia is looked at, ..."""

SPEEDS = 200
"""... and speeds."""


def usual_step(plant: Plant, laws: Sequence[FrictionLaw], reference: Reference) -> float:
    """Longest step that resolves how friction turns over where a joint reverses, and how bodies turn [s].

    Args:
        plant: the true numbers.
        laws: (n,) friction of every joint.
        reference: that the robot is to follow.
    """
    robot = plant.robot
    whole, motors = coordinate_map(robot), motor_coordinates(robot)
    slopes = np.zeros(whole.shape[1])
    for i, law in enumerate(laws):
        slopes[motors[i]] += law.steepest(float(plant.coulomb_friction[i]))
        if robot.elastic[i]:
            slopes[i] += law.steepest(float(plant.link_coulomb_friction[i]))
    model, fastest = robot.extended_model, 1e-300
    for q in reference.motion(np.linspace(0.0, reference.duration, PLACES)).q:
        mass = pin.crba(model, model.createData(), robot.extended_state(q))
        mass = whole.T @ (np.triu(mass) + np.triu(mass, 1).T) @ whole
        try:
            mobility = np.linalg.inv(np.linalg.cholesky(mass))
        except np.linalg.LinAlgError:  # the simulation tells what is wrong with it, where it comes to that
            continue
        fastest = max(fastest, float(np.max(slopes * np.sum(mobility**2, axis=0))))
    turning = FARTHEST_TURN / max(_fastest_turn(plant, reference), 1e-300)
    return float(np.clip(min(TIMES_BRAKING / fastest, turning), SHORTEST, LONGEST))


def _fastest_turn(plant: Plant, reference: Reference) -> float:
    """Largest angular velocity of a link along a reference [rad/s]."""
    robot, fastest = plant.robot, 0.0
    model = robot.extended_model
    data = model.createData()
    motion = reference.motion(np.linspace(0.0, reference.duration, SPEEDS))
    for x, v in zip(robot.extended_state(motion.q), robot.extended_rate(motion.dq), strict=True):
        pin.forwardKinematics(model, data, x, v)
        fastest = max(fastest, *(float(np.linalg.norm(data.v[int(k)].angular)) for k in robot.body_indices))
    return fastest
