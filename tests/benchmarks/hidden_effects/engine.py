"""The MuJoCo plant: bodies by MuJoCo, forces and time stepping by the benchmark itself.

Positions live on the steps and velocities between them (leapfrog): second order, and Coulomb friction is solved for
implicitly, so that it really holds at zero speed.
"""

from dataclasses import dataclass
from math import pi, tanh

import mujoco
import numpy as np
import pinocchio as pin

from sea_ident.motion import FourierSeries, Motion
from sea_ident.regressor import inverse_dynamics
from tests.benchmarks.hidden_effects import forms
from tests.benchmarks.hidden_effects.case import FloatArray, Noise, Planted
from tests.benchmarks.hidden_effects.mjcf import Coupling, Flexibility, Payload, Stages, build_mjcf
from tests.benchmarks.hidden_effects.plants import Truth

STEP = 1e-3
FARTHEST_SWING = 0.5
"""Angle of its swing on the spring by which a link may get on in a step [rad]."""


@dataclass(frozen=True, eq=False)
class Exact:
    """What really happened, at the recorded instants.

    Attributes:
        motion: exact states with accelerations.
        tau_motor: (N, n) torque that the drive was asked for and that its current shows [N m].
        tau_spring: (N, n) torque that the spring gives to the link, at a rigid joint the motor torque less its
            friction [N m].
        temperature: (N, n) of the motors [degC].
        period: [s].
        course: time that what drifts takes for all of its course, however long a recording is [s].
    """

    motion: Motion
    tau_motor: FloatArray
    tau_spring: FloatArray
    temperature: FloatArray
    period: float
    course: float


@dataclass(frozen=True)
class Friction:
    """How the base friction behaves.

    Attributes:
        form: `ramp`, linear up to the smoothing speed and constant beyond, or `tanh`.
        smoothing: speed [rad/s]; with `ramp` and 0 it sticks.
        jitter: spread of its level from pass to pass near zero speed [-].
        jitter_speed: speed up to which it acts [rad/s].
    """

    form: str = "ramp"
    smoothing: float = 0.005
    jitter: float = 0.0
    jitter_speed: float = 0.1


def friction_of(noise: Noise, form: str, smoothing: float) -> Friction:
    """Friction of a case."""
    return Friction(form, smoothing, noise.jitter, noise.jitter_speed)


def reference_torque(truth: Truth, series: FourierSeries, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Motor positions that would move the links on the series, and the torques of the drives for it.

    Returns:
        theta (N, n) and torque (N, n), without what the truth hides.
    """
    robot = truth.robot
    rigid = series.motion(time)
    link, _ = inverse_dynamics(robot, rigid)
    stiff = np.where(truth.stiffness > 0.0, truth.stiffness, np.inf)
    deflection = link / stiff
    theta = rigid.q + deflection
    step = float(time[1] - time[0])
    rate = (np.roll(theta, -1, 0) - np.roll(theta, 1, 0)) / (2.0 * step)
    acceleration = (np.roll(theta, -1, 0) - 2.0 * theta + np.roll(theta, 1, 0)) / step**2
    motion = Motion(time, rigid.q, rigid.dq, rigid.ddq, theta, rate, acceleration)
    bodies, rotors = inverse_dynamics(robot, motion)
    friction = truth.viscous * rate + truth.coulomb * np.tanh(rate / 0.05)
    return theta, bodies + rotors + friction


def _swings_within(truth: Truth) -> float:
    """Time in which the fastest link swings by a radian on its spring [s], in the middle pose."""
    mobility = np.diagonal(np.linalg.inv(truth.robot.mass_matrices(np.zeros(truth.robot.n))[0]))
    return float(1.0 / np.sqrt(max(float(np.max(truth.stiffness * mobility)), 1e-300)))


def simulate_mujoco(
    truth: Truth,
    series: FourierSeries,
    periods: int,
    *,
    planted: tuple[Planted, ...] = (),
    friction: Friction | None = None,
    actuator_noise: FloatArray | None = None,
    settle: int = 1,
    rate: float = 200.0,
    seed: int = 0,
    step: float = STEP,
    course: float | None = None,
) -> Exact:
    """Simulate a robot that tracks a trajectory with motor feedback.

    Args:
        truth: the robot and its base model.
        series: trajectory of the links; its period must be a whole number of steps.
        periods: periods that are recorded.
        planted: effects beyond the base model.
        friction: how the base friction behaves.
        actuator_noise: (n,) standard deviation of the drives' torque noise [N m].
        settle: periods before the recording starts.
        rate: of the recording [Hz].
        seed: of noise and jitter.
        step: time step [s].
        course: time in which what drifts comes to its end [s]; that of the recording by default.

    Returns:
        The exact states and torques of the recorded periods.
    """
    robot, n = truth.robot, truth.robot.n
    friction = friction or Friction()
    if any(p.effect == "link_flexibility" for p in planted):
        step = step / 4.0  # the small body between the two springs is fast
    elif _swings_within(truth) * FARTHEST_SWING < step:
        step = step / 4.0
    per_period = round(series.period / step)
    stride = round(1.0 / (rate * step))
    first, total = settle * per_period, (settle + periods) * per_period
    duration = periods * series.period
    course = duration if course is None else course
    rng = np.random.default_rng(np.random.SeedSequence([seed, 77]))

    payloads, flexibilities, couplings = _structure(planted, truth)
    model = build_mjcf(robot, step, payloads, flexibilities, couplings)
    stages = Stages(robot, model, couplings)
    for p in planted:
        if p.effect == "base_tilt":
            model.opt.gravity[:] = pin.exp3(p.size * np.array([p.shape["x"], p.shape["y"], 0.0])) @ model.opt.gravity
    data = mujoco.MjData(model)

    def dof(name: str) -> int:
        return int(model.jnt_dofadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)])

    elastic = list(robot.elastic)
    driven = [e or j.actuator is not None for e, j in zip(elastic, robot.joints, strict=True)]
    if any(d and not e for d, e in zip(driven, elastic, strict=True)):
        raise NotImplementedError("rigid joints with rotors are not simulated")
    iq = [dof(name) for name in robot.joint_names]
    it = [
        dof(f"{name} rotor") if e else iq[i] for i, (name, e) in enumerate(zip(robot.joint_names, elastic, strict=True))
    ]
    soft = [
        (dof(f"{p.joint} flexibility"), robot.index(str(p.joint)), p.size)
        for p in planted
        if p.effect == "link_flexibility"
    ]
    gear = [float(g) if e else 1.0 for g, e in zip(robot.gear_ratios, elastic, strict=True)]

    time = np.arange(per_period) * step
    theta_reference, torque_reference = reference_torque(truth, series, time)
    rate_reference = (np.roll(theta_reference, -1, 0) - np.roll(theta_reference, 1, 0)) / (2 * step)

    inertia = _motor_inertias(stages, model, data, series, iq, it, gear, elastic)
    bandwidth = 2.0 * pi * 4.0
    kp = [m * bandwidth**2 for m in inertia]
    kd = [2.0 * 0.8 * m * bandwidth for m in inertia]
    theta_rows, rate_rows, torque_rows = theta_reference.tolist(), rate_reference.tolist(), torque_reference.tolist()
    noise_rows = None
    if actuator_noise is not None and np.any(actuator_noise > 0.0):
        noise_rows = (rng.standard_normal((total, n)) * actuator_noise).tolist()

    hooks = [forms.Hooks() for _ in range(n)]
    wide: list[forms.Wide] = []
    for p in planted:
        forms.bind(p, truth, hooks, wide, step, course)
    pushes = _pushes(planted, model, series.period, duration, step)
    link_inertia = _link_inertias(stages, model, data, series, iq)

    nv = model.nv
    start_q, start_v = series.evaluate(np.zeros(1))[0], series.evaluate(np.zeros(1), 1)[0]
    x, v, a = [0.0] * nv, [0.0] * nv, [0.0] * nv
    for i in range(n):
        x[iq[i]], v[iq[i]] = float(start_q[i]), float(start_v[i])
        if elastic[i]:
            x[it[i]] = gear[i] * float(theta_reference[0, i])
            v[it[i]] = gear[i] * float(rate_reference[0, i])
    for k, i, compliance in soft:
        x[k] = -compliance * float(truth.stiffness[i] * (theta_reference[0, i] - start_q[i]))

    k1, k3, damping = truth.stiffness.tolist(), truth.cubic.tolist(), truth.damping.tolist()
    viscous, coulomb = truth.viscous.tolist(), truth.coulomb.tolist()
    states = [forms.JointState() for _ in range(n)]
    coupling, net, f_motor, f_link = [0.0] * n, [0.0] * n, [0.0] * n, [0.0] * n
    jitter, forward = [0.0] * n, [False] * n
    smoothing, ramp, spread = friction.smoothing, friction.form == "ramp", friction.jitter
    jitter_speed = friction.jitter_speed
    half = 0.5 * step
    qpos, qvel, applied = data.qpos, data.qvel, data.qfrc_applied
    forward_dynamics = mujoco.mj_forward
    count = (total - first) // stride
    log = np.empty((count, 8, n))
    range_n = range(n)
    row = 0

    for step_index in range(total):
        t = (step_index - first) * step
        phase = step_index % per_period
        at = [vi + half * ai for vi, ai in zip(v, a, strict=True)]
        theta_r, rate_r, torque_r = theta_rows[phase], rate_rows[phase], torque_rows[phase]
        for i in range_n:
            s = states[i]
            s.t, s.k = t, step_index
            s.q, s.dq = x[iq[i]], at[iq[i]]
            if elastic[i]:
                s.th, s.dth = x[it[i]] / gear[i], at[it[i]] / gear[i]
                s.d = d = s.th - s.q
                s.dd = s.dth - s.dq
                ts = k1[i] * d + k3[i] * d * d * d + damping[i] * s.dd
                for change in hooks[i].spring:
                    ts = change(s, ts)
                s.ts = ts
            else:
                s.th, s.dth = s.q, s.dq
                s.ts = s.u - f_motor[i]
            s.u = torque_r[i] + kp[i] * (theta_r[i] - s.th) + kd[i] * (rate_r[i] - s.dth)
            if noise_rows is not None:
                s.u += noise_rows[step_index][i]
        extra_link, extra_motor = [0.0] * n, [0.0] * n
        for law in wide:
            law(states, extra_link, extra_motor)
        force = [0.0] * nv
        for i in range_n:
            s, h = states[i], hooks[i]
            spring = s.ts if elastic[i] else 0.0
            b = viscous[i] if h.viscous is None else h.viscous(s, viscous[i])
            carried = 0.0 if h.turned is None else h.turned[1] * states[h.turned[0]].dq
            resisting = b * (s.dth + carried) + extra_motor[i]
            for smooth in h.smooth:
                resisting += smooth(s)
            level = coulomb[i]
            for change in h.level:
                level = change(s, level)
            if spread:
                moving = s.dth > 0.0
                if moving is not forward[i]:
                    forward[i] = moving
                    jitter[i] = spread * float(rng.standard_normal())
                level *= max(1.0 + jitter[i] / (1.0 + (s.dth / jitter_speed) ** 2), 0.0)
            drive = s.u if h.drive is None else h.drive(s, s.u)
            free = drive - spring - resisting
            m = inertia[i]
            if h.bristle is not None:
                f = h.bristle(s, level)
            elif level > 0.0:
                sharp = ramp or h.sticks
                # what sticks is solved for at the end of the step, what is smooth in its middle
                ahead_by = step if sharp else half
                ahead = v[it[i]] / gear[i] + ahead_by * (free / m - coupling[i]) + carried
                f = ahead / ((0.0 if h.sticks else smoothing) / level + ahead_by / m)
                f = level if f > level else -level if f < -level else f
                if not sharp:
                    w = ahead - half * f / m
                    stiffness = half * level / m
                    for _ in range(4):
                        bend = tanh(w / smoothing)
                        w -= (w + stiffness * bend - ahead) / (1.0 + stiffness / smoothing * (1.0 - bend * bend))
                    f = level * tanh(w / smoothing)
            else:
                f = 0.0
            f_motor[i] = f + resisting
            if h.turned is not None:
                force[iq[h.turned[0]]] -= h.turned[1] * (f + b * (s.dth + carried))
            net[i] = free - f
            force[it[i]] += net[i] / gear[i]
            push = spring - extra_link[i]
            for law_at_link in h.link:
                push -= law_at_link(s)
            if h.link_coulomb > 0.0:
                m = link_inertia[i]
                ahead = v[iq[i]] + step * (a[iq[i]] + f_link[i] / m)
                c = h.link_coulomb
                f = ahead / (smoothing / c + step / m)
                f_link[i] = f = c if f > c else -c if f < -c else f
                push -= f
            force[iq[i]] += push
        for body, vector, share in pushes:
            data.xfrc_applied[body, :3] = share(t) * vector
        qpos[:] = x
        qvel[:] = at
        applied[:] = force
        forward_dynamics(model, data)
        a = stages.accelerations(data).tolist()
        before = v
        v = [vi + step * ai for vi, ai in zip(v, a, strict=True)]
        for i in range_n:
            coupling[i] = net[i] / inertia[i] - a[it[i]] / gear[i]
        if step_index >= first and (step_index - first) % stride == 0:
            for i in range_n:
                s, j, k = states[i], iq[i], it[i]
                log[row, :, i] = (
                    s.q, 0.5 * (before[j] + v[j]), a[j], s.th, 0.5 * (before[k] + v[k]) / gear[i], a[k] / gear[i],
                    s.u, s.ts if elastic[i] else s.u - f_motor[i],
                )  # fmt: skip
            row += 1
        x = [xi + step * vi for xi, vi in zip(x, v, strict=True)]
    if not np.all(np.isfinite(log)):
        raise FloatingPointError("the simulation diverged")
    clock = np.arange(count) * (stride * step)
    temperature = np.full((count, n), 24.0)
    for i, h in enumerate(hooks):
        if h.temperature is not None:
            temperature[:, i] = [h.temperature(float(value)) for value in clock]
        else:
            temperature[:, i] += (6.0 + i) * (1.0 - np.exp(-clock / (0.2 * (i + 2) * duration)))
    motion = Motion(clock, *(np.ascontiguousarray(log[:, k]) for k in range(6)))
    return Exact(motion, log[:, 6].copy(), log[:, 7].copy(), temperature, series.period, course)


def _structure(
    planted: tuple[Planted, ...], truth: Truth
) -> tuple[tuple[Payload, ...], tuple[Flexibility, ...], tuple[Coupling, ...]]:
    names = truth.robot.joint_names
    payloads, flexibilities, couplings = [], [], []
    for p in planted:
        if p.effect == "payload":
            payloads.append(Payload(str(p.joint), p.size, (p.shape["x"], p.shape["y"], p.shape["z"])))
        elif p.effect == "link_flexibility":
            stiffness = 1.0 / max(p.size, 1e-12)
            flexibilities.append(
                Flexibility(str(p.joint), stiffness, p.shape["damping"] * stiffness, p.shape["inertia"])
            )
        elif p.effect == "transmission_coupling":
            couplings.append(Coupling(str(p.joint), names[int(p.shape["other"])], p.size))
    return tuple(payloads), tuple(flexibilities), tuple(couplings)


def _pushes(planted, model, period, duration, step):  # type: ignore[no-untyped-def]
    pushes = []
    for p in planted:
        if p.effect != "external_force":
            continue
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, p.joint)
        vector = p.size * np.array([p.shape["x"], p.shape["y"], p.shape["z"]])
        if p.shape["every_period"] > 0.5:
            begin, end, repeats = p.shape["begin"] * period, p.shape["end"] * period, period
        else:
            begin = p.shape["begin"] * duration
            end, repeats = begin + p.shape["length"], np.inf
        pushes.append((body, vector, lambda t, b=begin, e=end, r=repeats: share_of_step(t, step, b, e, r)))
    return pushes


def share_of_step(time: float, step: float, begin: float, end: float, period: float = np.inf) -> float:
    """Share of the step around a time in which a push from begin to end [s] acts, again in every period.

    What a step of `time` does to a velocity is done between half a step before it and half a step after it.
    """
    whole = 0.0
    for again in (-period, 0.0, period) if np.isfinite(period) else (0.0,):
        at = (time % period if np.isfinite(period) else time) + again
        whole += max(min(at + 0.5 * step, end) - max(at - 0.5 * step, begin), 0.0)
    return whole / step


def _motor_inertias(stages, model, data, series, iq, it, gear, elastic):  # type: ignore[no-untyped-def]
    """What a torque at each motor accelerates at least, on the joint side [kg m2]."""
    smallest = np.full(len(iq), np.inf)
    for q in series.evaluate(np.linspace(0.0, series.period, 7)):
        data.qpos[:] = 0.0
        data.qpos[iq] = q
        mujoco.mj_forward(model, data)
        inverse = np.linalg.inv(stages.inertia(data))
        smallest = np.minimum(smallest, [gear[i] ** 2 / inverse[k, k] for i, k in enumerate(it)])
    return [float(m if e else 0.9 * m) for m, e in zip(smallest, elastic, strict=True)]


def _link_inertias(stages, model, data, series, iq):  # type: ignore[no-untyped-def]
    smallest = np.full(len(iq), np.inf)
    for q in series.evaluate(np.linspace(0.0, series.period, 7)):
        data.qpos[:] = 0.0
        data.qpos[iq] = q
        mujoco.mj_forward(model, data)
        inverse = np.linalg.inv(stages.inertia(data))
        smallest = np.minimum(smallest, [1.0 / inverse[k, k] for k in iq])
    return [0.8 * float(m) for m in smallest]
