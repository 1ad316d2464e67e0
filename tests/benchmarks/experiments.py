"""Simulated experiments that many seeds can share.

Closed-loop passes of the exoskeleton leg with friction jitter are simulated once, without sensor noise. Each seed takes
its own consecutive passes and adds its own sensor noise, which is what a new experiment would give. Consecutive they
must be: where one pass does not begin as the one before it ended, there is a jump that no machine makes.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import gettempdir

import numpy as np
from scipy.signal import lfilter

from sea_ident.effects import base_effects
from sea_ident.excitation import design_excitation
from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording
from sea_ident.regressor import prior_parameters
from sea_ident.robot import Robot, load_robot
from sea_ident.simulation import FrictionJitter, SensorNoise, SmoothCoulomb, VelocityController, simulate
from sea_ident.simulation.controller import Drive

FRICTION = SmoothCoulomb(0.01)
"""The simulator's friction has the v_off of the model here: what another one does is the diagnosis's business."""


RATE = 200.0
"""Samples per second [Hz]."""


@dataclass(frozen=True, eq=False)
class NoisyLoop(VelocityController):
    """A velocity loop that sees the noise of its encoder: it becomes motor torque, and that becomes motion.

    Attributes:
        noise: (N, n) noise of theta at every sample [rad].
    """

    noise: np.ndarray = field(default_factory=lambda: np.zeros((1, 1)))

    def drive(self, robot: Robot, reference, time: np.ndarray) -> Drive:
        """The drive, with the torque that the noise makes."""
        clean = super().drive(robot, reference, time)
        index = np.clip(np.floor(time * RATE + 1e-6).astype(int), 0, len(self.noise) - 1)
        rate = np.diff(self.noise, axis=0, prepend=self.noise[:1]) * RATE
        torque = clean.velocity_gain * rate[index] + clean.position_gain * self.noise[index]
        return replace(clean, bias=clean.bias - torque)


@dataclass(frozen=True, eq=False)
class Pool:
    """Exact passes (P, N, n); `loop_noise` is the noise of theta that the controller saw, `rate` is in [Hz]."""

    robot: Robot
    series: FourierSeries
    q: np.ndarray
    theta: np.ndarray
    current: np.ndarray
    tau_motor: np.ndarray
    loop_noise: np.ndarray | None = None
    rate: float = RATE

    def experiments(self, periods: int) -> int:
        """How many recordings of so many passes it holds."""
        return len(self.q) // periods

    def thinned(self, step: int) -> "Pool":
        """Every so many samples only: as if the sensors had been read less often."""
        tables = {key: getattr(self, key)[:, ::step] for key in ("q", "theta", "current", "tau_motor")}
        noise = None if self.loop_noise is None else self.loop_noise[:, ::step]
        return replace(self, **tables, loop_noise=noise, rate=self.rate / step)

    @property
    def truth(self) -> np.ndarray:
        return prior_parameters(self.robot, base_effects(self.robot))

    def springs(self) -> np.ndarray:
        """(3 n,) K1, K3, D of all springs."""
        springs = [self.robot.spring(name) for name in self.robot.joint_names]
        return np.ravel([[s.stiffness, s.cubic_stiffness, s.damping] for s in springs])


@dataclass(frozen=True)
class Sensors:
    """Noise that a seed adds.

    Attributes:
        link: standard deviation of q [rad].
        motor: standard deviation of theta [rad].
        current: standard deviation of the current [A].
        quantised: whether the encoders have 17 and 18 bits.
        colour: correlation time of the noise of the current [s].
        spikes: share of the samples whose current is off by a hundred times its noise.
    """

    link: float = 2e-5
    motor: float = 1e-5
    current: float = 0.05
    quantised: bool = True
    colour: float = 0.0
    spikes: float = 0.0


def make_pool(
    passes: int, seed: int, jitter: FrictionJitter | None = None, controller: VelocityController | None = None
) -> Pool:
    """Simulate passes without sensor noise."""
    robot = load_robot("exo_leg")
    series = design_excitation(robot, starts=2, seed=0).series
    run = simulate(
        robot,
        series,
        periods=passes,
        seed=seed,
        sensors=SensorNoise.none(),
        jitter=jitter,
        friction=FRICTION,
        controller=controller,
    )
    shape = (passes, -1, robot.n)
    current = run.recording.channel("current", robot.joint_names)
    return Pool(
        robot,
        series,
        *(table.reshape(shape) for table in (run.motion.q, run.motion.theta, current, run.tau_motor)),
    )


def make_noisy_pool(passes: int, seed: int, controller: VelocityController, noise: float) -> Pool:
    """Passes in a loop that sees the noise of its motor encoders (standard deviation `noise` [rad])."""
    robot = load_robot("exo_leg")
    series = design_excitation(robot, starts=2, seed=0).series
    settle, period = 2, series.period
    time = np.arange(round((passes + settle) * period * 50.0) + 1) / 50.0
    samples = round((passes + settle) * period * RATE)
    seen = noise * np.random.default_rng(seed).standard_normal((samples + 1, robot.n))
    run = simulate(
        robot,
        series.motion(time),
        seed=seed,
        sensors=SensorNoise.none(),
        jitter=FrictionJitter.none(),
        friction=FRICTION,
        controller=NoisyLoop(controller.bandwidth, controller.correction, controller.feedforward, seen),
        rate=RATE,
    )
    first, each = round(settle * period * RATE), round(period * RATE)
    current = run.recording.channel("current", robot.joint_names)
    tables = (run.motion.q, run.motion.theta, current, run.tau_motor, seen)
    return Pool(robot, series, *(t[first : first + passes * each].reshape(passes, each, robot.n) for t in tables))


def cached_pool(name: str, passes: int, seed: int, **settings) -> Pool:
    """A pool, kept in the folder for temporary files between runs of the benchmarks."""
    folder = Path(gettempdir()) / "sea_ident_benchmarks"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}_{passes}_{seed}.npz"
    if not path.exists():
        pool = make_noisy_pool(passes, seed, **settings) if "noise" in settings else make_pool(passes, seed, **settings)
        extra = {} if pool.loop_noise is None else {"loop_noise": pool.loop_noise}
        np.savez(
            path,
            coefficients=pool.series.coefficients,
            q=pool.q,
            theta=pool.theta,
            current=pool.current,
            tau_motor=pool.tau_motor,
            **extra,
        )
    with np.load(path) as saved:
        series = FourierSeries.from_coefficients(saved["coefficients"], 0.1)
        tables = [saved[k] for k in ("q", "theta", "current", "tau_motor", "loop_noise") if k in saved]
    return Pool(load_robot("exo_leg"), series, *tables)


def draw(pool: Pool, seed: int, periods: int, sensors: Sensors) -> Recording:
    """What the sensors see of the consecutive passes of a seed.

    They are its own as long as the pool lasts; the seeds after that take the halves of two neighbours, and so on.
    In a loop that sees noise the passes differ by no more than that noise, so that any order of them will do; each seed
    draws its own.
    """
    rng = np.random.default_rng(seed)
    if pool.loop_noise is None:
        again, block = divmod(seed, pool.experiments(periods))
        chosen = (np.arange(periods) + block * periods + again * periods // 2) % len(pool.q)
    else:
        chosen = rng.choice(len(pool.q), periods, replace=False)
    n = pool.robot.n
    q, theta, current = (table[chosen].reshape(-1, n) for table in (pool.q, pool.theta, pool.current))
    q = q + sensors.link * rng.standard_normal(q.shape)
    seen = sensors.motor * rng.standard_normal(q.shape)
    theta = theta + (seen if pool.loop_noise is None else pool.loop_noise[chosen].reshape(-1, n))
    noise = rng.standard_normal(q.shape)
    if sensors.colour:
        a = np.exp(-1.0 / (sensors.colour * pool.rate))
        noise = lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], noise, axis=0)
    if sensors.spikes:
        noise = noise + 100.0 * (rng.random(q.shape) < sensors.spikes) * rng.choice([-1.0, 1.0], q.shape)
    current = current + sensors.current * noise
    if sensors.quantised:
        for table, bits in ((q, 17), (theta, 18)):
            step = 2.0 * np.pi / 2**bits
            np.round(table / step, out=table)
            table *= step
    columns = {}
    for i, name in enumerate(pool.robot.joint_names):
        columns |= {f"q_{name}": q[:, i], f"theta_{name}": theta[:, i], f"current_{name}": current[:, i]}
    return Recording(np.arange(len(q)) / pool.rate, columns, f"passes of seed {seed}")


Found = dict[str, tuple[np.ndarray, ...]]
"""What one seed gives: arrays by label."""


def each_seed(path: Path | None, setting: str, seeds: Iterable[int], run: Callable[[int], Found]) -> list[Found]:
    """Run every seed once and keep what it gave, line by line, so that a run that is cut short goes on where it was.

    Args:
        path: file of lines of JSON; nothing is kept where None. It belongs to one state of the code.
        setting: name of the setting, so that one file holds several.
        seeds: the seeds.
        run: what a seed gives.
    """
    done: dict[int, Found] = {}
    if path is not None and path.exists():
        for line in path.read_text().splitlines():
            entry = json.loads(line)
            if entry["setting"] == setting:
                done[entry["seed"]] = {k: tuple(np.array(a) for a in v) for k, v in entry["found"].items()}
    for seed in (s for s in seeds if s not in done):
        done[seed] = run(seed)
        if path is not None:
            found = {label: [np.asarray(a).tolist() for a in arrays] for label, arrays in done[seed].items()}
            with path.open("a") as file:
                file.write(json.dumps({"setting": setting, "seed": seed, "found": found}) + "\n")
    return [done[s] for s in sorted(set(seeds) & set(done))]
