"""Limits of the motion of a robot, all per joint and all optional (infinite where not given)."""

from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.robot.workspace import HalfSpace, SelfCollision


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits on the motion; an infinite entry is no limit.

    Attributes:
        lower: (n,) lowest position [rad] or [m].
        upper: (n,) highest position [rad] or [m].
        velocity: (n,) largest speed [rad/s] or [m/s].
        acceleration: (n,) largest acceleration [rad/s2] or [m/s2].
        jerk: (n,) largest jerk [rad/s3] or [m/s3].
        torque: (n,) largest motor torque at the joint side [N m] or [N].
        deflection: (n,) largest spring deflection |theta - q| [rad] or [m].
        combinations: (c, n) coefficients of linear combinations of the positions.
        combination_lower: (c,) lowest value of each combination.
        combination_upper: (c,) highest value of each combination.
        combination_names: (c,) names of the combinations.
        half_spaces: limits on where points of links may be.
        self_collision: the distance that links keep from each other; None where they may touch.
    """

    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    torque: FloatArray
    deflection: FloatArray
    combinations: FloatArray
    combination_lower: FloatArray
    combination_upper: FloatArray
    combination_names: tuple[str, ...]
    half_spaces: tuple[HalfSpace, ...] = ()
    self_collision: SelfCollision | None = None

    @staticmethod
    def unlimited(n: int) -> "Limits":
        """Limits of n joints that limit nothing."""
        free = np.full(n, np.inf)
        return Limits(
            lower=-free,
            upper=free,
            velocity=free,
            acceleration=free,
            jerk=free,
            torque=free,
            deflection=free,
            combinations=np.zeros((0, n)),
            combination_lower=np.zeros(0),
            combination_upper=np.zeros(0),
            combination_names=(),
        )

    def replace(
        self, **changes: FloatArray | tuple[str, ...] | tuple[HalfSpace, ...] | SelfCollision | None
    ) -> "Limits":
        """A copy with some fields replaced, as `dataclasses.replace`."""
        return replace(self, **changes)  # type: ignore[arg-type]
