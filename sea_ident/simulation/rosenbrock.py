"""The integrator: a linearly-implicit Runge-Kutta method for M(u) u'' = F(t, u, u')."""

from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray


@dataclass(frozen=True, eq=False)
class RosenbrockW:
    """A Rosenbrock-W method: its order holds for any approximation of the Jacobian.

    Attributes:
        gamma: diagonal coefficient.
        nodes: (s,) times of the stages within a step, as parts of the step.
        stage: (s, s) coefficients of the stage values.
        coupling: (s, s) coefficients of the right-hand sides.
        weights: (s,) coefficients of the result.
        error: (s,) coefficients of its difference from a result of one order less.
        drift: (s,) coefficients of the change of the right-hand side with time alone.
        order: order of convergence.
    """

    gamma: float
    nodes: FloatArray
    stage: FloatArray
    coupling: FloatArray
    weights: FloatArray
    error: FloatArray
    drift: FloatArray
    order: int

    @staticmethod
    def from_tableau(
        alpha: FloatArray, gamma: FloatArray, weights: FloatArray, embedded: FloatArray, order: int
    ) -> "RosenbrockW":
        """Coefficients in the form without products with the Jacobian (Hairer, Wanner II, section IV.7)."""
        inverse = np.linalg.inv(gamma)
        diagonal = float(gamma[0, 0])
        return RosenbrockW(
            diagonal,
            alpha.sum(axis=1),
            alpha @ inverse,
            np.eye(len(weights)) / diagonal - inverse,
            weights @ inverse,
            (weights - embedded) @ inverse,
            gamma.sum(axis=1),
            order,
        )


def ros34pw2() -> RosenbrockW:
    """ROS34PW2: four stages, order 3, L-stable (Rang, Angermann, BIT 45, 2005)."""
    g = 4.3586652150845900e-01
    alpha = np.zeros((4, 4))
    alpha[1, :1] = [8.7173304301691801e-01]
    alpha[2, :2] = [8.4457060015369423e-01, -1.1299064236484185e-01]
    alpha[3, :3] = [0.0, 0.0, 1.0]
    gamma = np.diag([g, g, g, g])
    gamma[1, :1] = [-8.7173304301691801e-01]
    gamma[2, :2] = [-9.0338057013044082e-01, 5.4180672388095326e-02]
    gamma[3, :3] = [2.4212380706095346e-01, -1.2232505839045147e00, 5.4526025533510214e-01]
    weights = np.array([2.4212380706095346e-01, -1.2232505839045147e00, 1.5452602553351020e00, g])
    embedded = np.array([3.7810903145819369e-01, -9.6042292212423178e-02, 0.5, 2.1793326075422950e-01])
    return RosenbrockW.from_tableau(alpha, gamma, weights, embedded, 3)
