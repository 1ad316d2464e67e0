"""Planted effects in a running simulation."""

from collections.abc import Callable, Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, Side, SimulationState
from sea_ident.exceptions import SimulationError
from sea_ident.robot import Robot
from sea_ident.simulation.plant import PlantedEffect


def overrides(effect: Effect, hook: str) -> bool:
    """Whether an effect has a hook of its own."""
    return getattr(type(effect), hook) is not getattr(Effect, hook)


class PlantedTorques:
    """Torques of effects that act on the present state, with or without memory.

    Coordinates are those of `ClosedLoop`: u = (q, theta of the elastic joints).
    """

    def __init__(
        self,
        robot: Robot,
        effects: Sequence[PlantedEffect],
        begin: float,
        period: float,
        temperature: Callable[[float], FloatArray] | None,
    ) -> None:
        self._robot, self._temperature = robot, temperature
        self._begin, self._period = begin, period
        self._motor = np.arange(robot.n)
        self._motor[robot.elastic_indices] = robot.n + np.arange(len(robot.elastic_indices))
        self._effects = tuple(effects)
        acting = [p for p in effects if overrides(p.effect, "torque")]
        hooks = [(p.effect.side is Side.SPRING, p.effect.torque(robot, p.values)) for p in acting]
        # Springs first: the others may depend on the torque that they transmit.
        self._springs = [hook for spring, hook in hooks if spring]
        self._others = [hook for spring, hook in hooks if not spring]
        self._memory = [hook.accept for _, hook in hooks if hasattr(hook, "accept")]

    def added_inertia(self, size: int) -> FloatArray | None:
        """(size, size) what effects add to the mass matrix, None where none does."""
        adding = [p for p in self._effects if overrides(p.effect, "added_inertia")]
        parts = [p.effect.added_inertia(self._robot, p.values) for p in adding]
        if not parts:
            return None
        n = self._robot.n
        select = np.zeros((2 * n, size))
        select[np.arange(n), np.arange(n)] = 1.0
        select[n + np.arange(n), self._motor] = 1.0
        total: FloatArray = select.T @ sum(parts) @ select
        return total

    def _state(
        self,
        time: float,
        elapsed: float,
        u: list[float],
        w: list[float],
        tau_motor: list[float],
        tau_spring: list[float],
    ) -> SimulationState:
        n, motor = self._robot.n, self._motor
        position, velocity = np.array(u), np.array(w)
        return SimulationState(
            time=time,
            q=position[:n],
            dq=velocity[:n],
            theta=position[motor],
            dtheta=velocity[motor],
            tau_spring=np.array(tau_spring),
            tau_motor=np.array(tau_motor),
            elapsed=elapsed,
            period_index=max(0, int(np.floor((time - self._begin) / self._period + 1e-9))),
            temperature=None if self._temperature is None else self._temperature(time),
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
        n = self._robot.n
        link, motor = np.zeros(n), np.zeros(n)
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
        n, motor = self._robot.n, self._motor.tolist()
        base = self._forces(time, u, w, tau_motor, tau_spring)
        small = 1e-3
        for side in (range(n), [m for i, m in enumerate(motor) if m != i]):
            moved = list(w)
            for k in side:
                moved[k] += small if moved[k] >= 0.0 else -small
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
    """The robot after the effects that change its bodies or gravity."""
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
                f"({', '.join(c.name for c in columns)}), {np.shape(planted.values)} values were given"
            )
        if not any(overrides(effect, hook) for hook in ("torque", "measured", "modified", "added_inertia")):
            raise SimulationError(f"the effect {effect.name!r} has no way to act in a simulation")
