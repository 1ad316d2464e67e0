"""Every estimator in seven noise settings, and on measured data beside published values.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_estimators.py [--seeds 300] [--further 100]
        [--likelihood-every 10] [--keep FILE]

Settings: white torque noise; coloured torque noise (correlation time 0.25 s); encoder noise ten times the usual; a
controller with high gains, which makes torque and motion of the noise of its encoders (ten times the usual). Further
ones that show where estimators break: encoder noise thirty times the usual, feedback of noise a hundred times the
usual, spikes of a hundred times the noise in one sample of a thousand. Coverage of 95 % intervals as reported (spread
between periods) and by eq. 13, bias, rms error relative to least squares, seconds of CPU time per estimate. Maximum
likelihood takes up to a hundred times as long as the others and runs on every tenth seed, unless told otherwise.

The motion is exact, periodic and smooth, its torques are exact (20 periods of 10 s at 50 Hz), so that nothing but the
noise is wrong. Feedback: the noise n of all encoders moves the joints by -T n, with T of second order (60 rad/s,
damping 0.7), and the torque is the one that this motion needs. What it printed is in results/estimators.md.
"""

import argparse
import sys
import time
import warnings
from pathlib import Path

import numpy as np
from experiments import Found, each_seed
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).parents[1]))
from estimation.emps import EFFECTS, IDENTIFICATION, PUBLISHED
from estimation.synthetic import Truth, leg_series, truth_of

from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import base_effects
from sea_ident.estimation import (
    InstrumentalVariables,
    JointWLS,
    LeastSquares,
    MaximumLikelihood,
    Observations,
    PerSampleWLS,
    Robust,
    identify,
)
from sea_ident.estimation.uncertainty import honest_uncertainty
from sea_ident.motion import Motion
from sea_ident.processing import ProcessedRecording, process
from sea_ident.recordings import Recording, read_recording
from sea_ident.regressor import build_total
from sea_ident.robot import load_robot

ESTIMATORS = (LeastSquares(), JointWLS(), PerSampleWLS(), Robust(), InstrumentalVariables(), MaximumLikelihood())
LEG = load_robot("exo_leg")
PERIODS, RATE = 20, 50.0
BANDWIDTH, DAMPING = 60.0, 0.7
"""Of the controller that feeds noise back [rad/s], [-]."""

SETTINGS = {
    "white noise": {},
    "coloured noise": {"colour": 0.25},
    "encoder noise x 10": {"encoder": 1e-4},
    "high-gain feedback": {"encoder": 1e-4, "feedback": True},
    "encoder noise x 30": {"encoder": 3e-4},
    "high-gain feedback of noise x 100": {"encoder": 1e-3, "feedback": True},
    "spikes": {"spikes": 1e-3},
}
EXTRA = tuple(SETTINGS)[4:]
"""The further settings, for which fewer seeds will do."""

HARMONICS = 150
"""Kept in q and theta: real friction bends the motion at every reversal, so that data ask for as many. Of these smooth
motions a tenth would do, and encoder noise up to a hundred times as large would do no harm."""


def measured(
    truth: Truth,
    seed: int,
    encoder: float = 1e-5,
    torque: float = 0.2,
    colour: float = 0.0,
    spikes: float = 0.0,
    feedback: bool = False,
) -> Recording:
    """What sensors see of an exact motion: noise of q and theta [rad], of the torque [N m] with its colour [s]."""
    rng = np.random.default_rng(seed)
    q, theta, tau = (np.tile(table, (PERIODS, 1)) for table in (truth.motion.q, truth.motion.theta, truth.tau_motor))
    noise = rng.standard_normal(q.shape)
    if colour:
        a = np.exp(-1.0 / (colour * RATE))
        noise = lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], noise, axis=0)
    noise = noise + 100.0 * (rng.random(q.shape) < spikes) * rng.choice([-1.0, 1.0], q.shape)
    seen = encoder * rng.standard_normal(q.shape)
    if feedback:
        moved, tau = fed_back(truth, seen)
        q, theta = q + moved, theta + moved
    tables = {
        "q": q + (seen if feedback else encoder * rng.standard_normal(q.shape)),
        "theta": theta + seen,
        "tau_motor": tau + torque * noise,
    }
    columns = {f"{kind}_{name}": t[:, i] for kind, t in tables.items() for i, name in enumerate(LEG.joint_names)}
    return Recording(np.arange(len(q)) / RATE, columns, f"seed {seed}")


def fed_back(truth: Truth, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How the joints move by the noise that the controller sees, and the torque (M, n) of the whole motion."""
    s = 2j * np.pi * np.fft.rfftfreq(len(seen), 1.0 / RATE)[:, None]
    answer = -(BANDWIDTH**2) / (s**2 + 2.0 * DAMPING * BANDWIDTH * s + BANDWIDTH**2) * np.fft.rfft(seen, axis=0)
    parts = [np.fft.irfft(answer * s**k, len(seen), axis=0) for k in range(3)]
    exact, samples = truth.motion, len(truth.motion)
    torque = np.empty_like(seen)
    for p in range(PERIODS):
        part = slice(p * samples, (p + 1) * samples)
        d, dd, ddd = (table[part] for table in parts)
        motion = Motion(
            exact.time,
            *(exact.q + d, exact.dq + dd, exact.ddq + ddd),
            *(exact.theta + d, exact.dtheta + dd, exact.ddtheta + ddd),
        )
        torque[part] = build_total(LEG, base_effects(LEG), motion) @ truth.parameters
    return parts[0], torque


def _processed(recording: Recording) -> ProcessedRecording:
    return process(recording, LEG, period=10.0, link_harmonics=HARMONICS, motor_harmonics=HARMONICS)


def estimates(recording: Recording, parameters: np.ndarray, slow: bool) -> Found:
    """Per estimator: error, reported half width, half width by eq. 13, seconds."""
    warnings.simplefilter("ignore")
    effects = base_effects(LEG)
    base = find_base_parameters(LEG, effects)
    exact = base.project(parameters)
    observations = Observations(LEG, effects, base, _processed(recording))
    for _ in observations.each_period():
        pass  # regressors are shared; their time is nobody's
    found = {}
    for estimator in ESTIMATORS:
        if isinstance(estimator, MaximumLikelihood) and not slow:
            continue
        begin = time.process_time()
        estimate = estimator.estimate(observations)
        uncertainty = honest_uncertainty(observations, estimate)
        seconds = time.process_time() - begin
        half = 1.96 * np.sqrt(np.diag(estimate.covariance))
        found[estimator.name] = (estimate.values - exact, uncertainty.half_width(), half, np.array(seconds))
    return found


def table(title: str, names: tuple[str, ...], results: list[dict]) -> None:
    """Coverages in percent over all parameters and of the worst; bias in units of the true standard deviation."""
    print(f"\n### {title}, {len(results)} seeds\n")
    print("| estimator | seeds | coverage | worst | by eq. 13 | bias/std, rms | worst bias | rmse / LS | seconds |")
    print("|---|---|---|---|---|---|---|---|---|")
    for estimator in ESTIMATORS:
        rows = [r[estimator.name] for r in results if estimator.name in r]
        if len(rows) < 2:
            continue
        error, half, model, seconds = (np.array([row[k] for row in rows]) for k in range(4))
        plain = np.array([r["least_squares"][0] for r in results if estimator.name in r])
        reference = np.sqrt((plain**2).mean(axis=0))
        inside = (np.abs(error) <= half).mean(axis=0)
        bias = error.mean(axis=0) / error.std(axis=0)
        worst, far = int(np.argmin(inside)), int(np.argmax(np.abs(bias)))
        rmse = np.exp(np.log(np.sqrt((error**2).mean(axis=0)) / reference).mean())
        print(
            f"| {estimator.name} | {len(rows)} | {100 * inside.mean():.1f} | "
            f"{100 * inside[worst]:.1f} {names[worst]} | "
            f"{100 * (np.abs(error) <= model).mean():.1f} | {np.sqrt((bias**2).mean()):.2f} | {bias[far]:+.2f} "
            f"{names[far]} | {rmse:.2f} | {seconds.mean():.3f} |",
            flush=True,
        )


def emps() -> None:
    """The electro-mechanical positioning system: all estimators beside the published values."""
    if not IDENTIFICATION.is_file():
        print(f"\nEMPS: no recording at {IDENTIFICATION}")
        return
    warnings.simplefilter("ignore")
    robot = load_robot("emps")
    processed = process(read_recording(IDENTIFICATION), robot)
    print(f"\n### EMPS, {processed.periods} periods of {processed.period:g} s\n")
    print(
        "Value +- stated standard deviation (repeatability: the part of it that the scatter between periods shows).\n"
    )
    print("| estimator | " + " | ".join(PUBLISHED) + " |")
    print("|---|---|---|---|---|")
    print("| published | " + " | ".join(f"{value:.4f}" for value in PUBLISHED.values()) + " |")
    for estimator in ESTIMATORS:
        model = identify(robot, processed, effects=EFFECTS, estimator=estimator)
        scatter = np.sqrt(np.diag(model.uncertainty.repeatability))
        cells = [f"{v:.3f} +- {s:.2g} ({r:.2g})" for v, s, r in zip(model.values, model.std, scatter, strict=True)]
        print(f"| {estimator.name} | " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=300)
    parser.add_argument("--further", type=int, default=100, help="seeds of the further settings")
    parser.add_argument("--likelihood-every", type=int, default=10, help="maximum likelihood on every so manieth seed")
    parser.add_argument("--keep", type=Path, help="file of seeds that are done; a run that was cut goes on from it")
    arguments = parser.parse_args()
    emps()
    names = find_base_parameters(LEG, base_effects(LEG)).names
    truth = truth_of(LEG, leg_series(), samples=round(10.0 * RATE))
    for title, noise in SETTINGS.items():

        def one(seed: int, noise: dict[str, float] = noise) -> Found:
            return estimates(measured(truth, seed, **noise), truth.parameters, seed % arguments.likelihood_every == 0)

        seeds = range(arguments.further if title in EXTRA else arguments.seeds)
        table(title, names, each_seed(arguments.keep, title, seeds, one))


if __name__ == "__main__":
    main()
