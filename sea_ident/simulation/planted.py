"""Planted effects in a running simulation."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, Side, SimulationState
from sea_ident.effects.load import LoadEffect
from sea_ident.exceptions import SimulationError
from sea_ident.robot import Robot
from sea_ident.simulation.plant import PlantedEffect

SMALL_SPEED = 1e-3
"""Speed over which slopes are taken [rad/s] or [m/s]: coarse enough to see a smoothed sign as steep."""


def overrides(effect: Effect, hook: str) -> bool:
    """Whether an effect has a hook of its own."""
    return getattr(type(effect), hook) is not getattr(Effect, hook)


def motor_coordinates(robot: Robot) -> list[int]:
    """(n,) coordinate of each motor in u = (q, theta of the elastic joints)."""
    motors = list(range(robot.n))
    for k, i in enumerate(robot.elastic_indices):
        motors[int(i)] = robot.n + k
    return motors


class PlantedTorques:
    """Torques of effects that act on the present state, with or without memory.

    Coordinates are those of `ClosedLoop`: u = (q, theta of the elastic joints).

    Attributes:
        needs_load: whether an effect asks for the load of a rigid joint.
    """

    def __init__(self, robot: Robot, effects: Sequence[PlantedEffect], begin: float) -> None:
        self._n, self._begin = robot.n, begin
        self._motor = np.array(motor_coordinates(robot), dtype=np.intp)
        acting = [p for p in effects if overrides(p.effect, "torque")]
        hooks = [(p.effect.side is Side.SPRING, p.effect.torque(robot, p.values)) for p in acting]
        # Springs first: the others may depend on the torque that they transmit.
        self._springs = [hook for spring, hook in hooks if spring]
        self._others = [hook for spring, hook in hooks if not spring]
        self._memory = [hook.accept for _, hook in hooks if hasattr(hook, "accept")]
        rigid = {joint.name for joint in robot.joints if not joint.elastic}
        self.needs_load = any(isinstance(p.effect, LoadEffect) and p.effect.joint in rigid for p in acting)

    def _state(
        self,
        time: float,
        elapsed: float,
        u: list[float],
        w: list[float],
        tau_motor: list[float],
        tau_spring: list[float],
    ) -> SimulationState:
        n, motor = self._n, self._motor
        position, velocity = np.array(u), np.array(w)
        return SimulationState(
            time=max(time, self._begin),
            q=position[:n],
            dq=velocity[:n],
            theta=position[motor],
            dtheta=velocity[motor],
            tau_spring=np.array(tau_spring),
            tau_motor=np.array(tau_motor),
            elapsed=elapsed,
        )

    def add(
        self,
        time: float,
        elapsed: float,
        u: list[float],
        w: list[float],
        tau_motor: list[float],
        tau_spring: list[float],
        out: list[float],
    ) -> None:
        """Subtract the torques from the forces `out`, and add what acts in the springs to `tau_spring`."""
        link, motor = np.zeros(self._n), np.zeros(self._n)
        state = self._state(time, elapsed, u, w, tau_motor, tau_spring)
        for act in self._springs:
            act(state, link, motor)
        if self._springs:
            state.tau_spring[:] -= link
            tau_spring[:] = state.tau_spring.tolist()
        for act in self._others:
            act(state, link, motor)
        for i, torque in enumerate(link.tolist()):
            out[i] -= torque
        for i, torque in zip(self._motor.tolist(), motor.tolist(), strict=True):
            out[i] -= torque

    def add_damping(
        self,
        time: float,
        u: list[float],
        w: list[float],
        tau_motor: list[float],
        tau_spring: list[float],
        damping: FloatArray,
    ) -> None:
        """Add the slopes of the torques over the speeds, one side at a time, where they damp."""
        n, motor = self._n, self._motor.tolist()
        base = self._forces(time, u, w, tau_motor, tau_spring)
        for side in (range(n), [m for i, m in enumerate(motor) if m != i]):
            moved = list(w)
            for k in side:
                moved[k] += SMALL_SPEED if moved[k] >= 0.0 else -SMALL_SPEED
            changed = self._forces(time, u, moved, tau_motor, tau_spring)
            for k in side:
                slope = (base[k] - changed[k]) / (moved[k] - w[k])
                if slope > 0.0:
                    damping[k, k] += slope

    def _forces(
        self, time: float, u: list[float], w: list[float], tau_motor: list[float], tau_spring: list[float]
    ) -> list[float]:
        out = [0.0] * len(u)
        self.add(time, 0.0, u, w, list(tau_motor), list(tau_spring), out)
        return out

    def accept(
        self, time: float, u: list[float], w: list[float], tau_motor: list[float], tau_spring: list[float]
    ) -> None:
        """Tell the effects with memory where the step ended; torques are those of the last stage."""
        if self._memory:
            state = self._state(time, 0.0, u, w, tau_motor, tau_spring)
            for accept in self._memory:
                accept(state)


def altered_robot(robot: Robot, effects: Sequence[PlantedEffect]) -> Robot:
    """The robot after the effects that change its bodies, its couplings or gravity."""
    for planted in effects:
        robot = planted.effect.modified(robot, planted.values)
    return robot


def check_planted(robot: Robot, effects: Sequence[PlantedEffect]) -> None:
    """Refuse effects that cannot act.

    Raises:
        SimulationError: wrong number of values, or an effect without any hook.
    """
    for planted in effects:
        effect, columns = planted.effect, planted.effect.columns(robot)
        if np.shape(planted.values) != (len(columns),):
            raise SimulationError(
                f"the effect {effect.name!r} has {len(columns)} parameters "
                f"({', '.join(c.name for c in columns)}); {np.shape(planted.values)} values were given"
            )
        if not any(overrides(effect, hook) for hook in ("torque", "measured", "modified")):
            raise SimulationError(f"the effect {effect.name!r} has no way to act in a simulation")
