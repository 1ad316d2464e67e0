"""How long a step may be for the friction of a robot."""

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

PLACES = 16
"""Configurations along the reference at which the inertia is looked at."""


def usual_step(plant: Plant, laws: Sequence[FrictionLaw], reference: Reference) -> float:
    """Longest step that resolves how friction turns over where a joint reverses [s].

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
    return float(np.clip(TIMES_BRAKING / fastest, SHORTEST, LONGEST))
