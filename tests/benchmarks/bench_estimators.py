"""Every estimator in six noise settings, and on measured data beside published values.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_estimators.py [--seeds 300] [--keep FILE]

Settings: white torque noise; coloured torque noise (correlation time 0.25 s); encoder noise ten and thirty times the
usual; a controller with four times the usual gains, which makes torque and motion of the noise of its encoders; spikes
of a hundred times the noise in one sample of a thousand. Coverage of 95 % intervals as reported (spread between
periods) and by eq. 13, bias, root mean squared error relative to least squares, seconds of CPU time per estimate.
20 periods of 10 s at 50 Hz. Friction does not vary from pass to pass here, so that the noise settings stand alone; the
seeds share simulated passes (see experiments.py). A whole run takes about a quarter of an hour on one core; what it
printed is in results/estimators.md.
"""

import argparse
import time
import warnings
from functools import partial
from pathlib import Path

import numpy as np
from experiments import Pool, Sensors, cached_pool, draw, each_seed

from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import base_effects, make_effect
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
from sea_ident.processing import process
from sea_ident.recordings import read_recording
from sea_ident.robot import load_robot
from sea_ident.simulation import FrictionJitter, VelocityController

ESTIMATORS = (LeastSquares(), JointWLS(), PerSampleWLS(), Robust(), InstrumentalVariables(), MaximumLikelihood())
STIFF = VelocityController(bandwidth=240.0, correction=60.0)
SETTINGS = {
    "white noise": (Sensors(), None),
    "coloured noise": (Sensors(colour=0.25), None),
    "encoder noise x 10": (Sensors(link=2e-4, motor=1e-4), None),
    "encoder noise x 30": (Sensors(link=6e-4, motor=3e-4), None),
    "high-gain feedback": (Sensors(motor=3e-5), STIFF),
    "spikes": (Sensors(spikes=1e-3), None),
}
THIN = 4
"""Of the 200 samples a second every fourth is used."""

PUBLISHED = {"M [kg]": 95.1089, "Fv [N s/m]": 203.5034, "Fc [N]": 20.3935, "offset [N]": -3.1648}
EMPS = Path(__file__).parents[2] / ".." / "shared" / "data" / "emps" / "identification.csv"


def one_seed(pool: Pool, seed: int, sensors: Sensors) -> dict[str, tuple[np.ndarray, ...]]:
    """Per estimator: error, reported half width, half width by eq. 13, seconds."""
    warnings.simplefilter("ignore")
    robot = pool.robot
    effects = base_effects(robot)
    base = find_base_parameters(robot, effects)
    exact = base.project(pool.truth)
    processed = process(draw(pool, seed, 20, sensors), robot, period=10.0)
    observations = Observations(robot, effects, base, processed)
    for _ in observations.each_period():
        pass  # regressors are shared; their time is nobody's
    found = {}
    for estimator in ESTIMATORS:
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
    print("| estimator | coverage | worst parameter | by eq. 13 | bias/std, rms | worst bias | rmse / LS | seconds |")
    print("|---|---|---|---|---|---|---|---|")
    plain = np.array([r["least_squares"][0] for r in results])
    reference = np.sqrt((plain**2).mean(axis=0))
    for estimator in ESTIMATORS:
        rows = [r[estimator.name] for r in results]
        error, half, model, seconds = (np.array([row[k] for row in rows]) for k in range(4))
        inside = (np.abs(error) <= half).mean(axis=0)
        bias = error.mean(axis=0) / error.std(axis=0)
        worst, far = int(np.argmin(inside)), int(np.argmax(np.abs(bias)))
        rmse = np.exp(np.log(np.sqrt((error**2).mean(axis=0)) / reference).mean())
        print(
            f"| {estimator.name} | {100 * inside.mean():.1f} | {100 * inside[worst]:.1f} {names[worst]} | "
            f"{100 * (np.abs(error) <= model).mean():.1f} | {np.sqrt((bias**2).mean()):.2f} | {bias[far]:+.2f} "
            f"{names[far]} | {rmse:.2f} | {seconds.mean():.3f} |",
            flush=True,
        )


def emps() -> None:
    """The electro-mechanical positioning system: all estimators beside the published values."""
    if not EMPS.is_file():
        print(f"\nEMPS: no recording at {EMPS}")
        return
    warnings.simplefilter("ignore")
    robot = load_robot("emps")
    effects = (
        make_effect("rigid_bodies"),
        make_effect("viscous_friction", "slider"),
        make_effect("coulomb_friction", "slider", smoothing=1e-3),
        make_effect("torque_offset", "slider"),
    )
    processed = process(read_recording(EMPS), robot)
    print(f"\n### EMPS, {processed.periods} periods of {processed.period:g} s\n")
    print(
        "Value +- stated standard deviation (repeatability: the part of it that the scatter between periods shows).\n"
    )
    print("| estimator | " + " | ".join(PUBLISHED) + " |")
    print("|---|---|---|---|---|")
    print("| published | " + " | ".join(f"{value:.4f}" for value in PUBLISHED.values()) + " |")
    for estimator in ESTIMATORS:
        model = identify(robot, processed, effects=effects, estimator=estimator)
        scatter = np.sqrt(np.diag(model.uncertainty.repeatability))
        cells = [f"{v:.3f} +- {s:.2g} ({r:.2g})" for v, s, r in zip(model.values, model.std, scatter, strict=True)]
        print(f"| {estimator.name} | " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=300)
    parser.add_argument("--passes", type=int, default=400, help="simulated with a noisy loop")
    parser.add_argument("--keep", type=Path, help="file of seeds that are done; a run that was cut goes on from it")
    arguments = parser.parse_args()
    emps()
    for title, (sensors, controller) in SETTINGS.items():
        if controller is None:
            pool = cached_pool("steady", 40, 1, jitter=FrictionJitter.none())
        else:
            pool = cached_pool("stiff", arguments.passes, 1, controller=controller, noise=sensors.motor)
        names = find_base_parameters(pool.robot, base_effects(pool.robot)).names
        run = partial(one_seed, pool.thinned(THIN), sensors=sensors)
        table(title, names, each_seed(arguments.keep, title, range(arguments.seeds), run))


if __name__ == "__main__":
    main()
