"""Speed and accuracy of the simulation.

    python tests/benchmarks/bench_simulation.py [--repeats 5]

Prints the real-time factor (simulated time over CPU time of one core, settling included) with its spread, and how the
error falls with the step, and what the steps that are taken by default leave. Nothing is asserted here.
"""

import argparse
import platform
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "simulation"))

from plants import baxter_arm, modest_series, ur10

from sea_ident import load_robot
from sea_ident.effects import make_effect
from sea_ident.simulation import (
    FrictionJitter,
    PlantedEffect,
    PreslidingCoulomb,
    SensorNoise,
    SmoothCoulomb,
    plant_from_robot,
    simulate,
)


def real_time_factors(repeats: int) -> None:
    leg = load_robot("exo_leg")
    planted = [
        PlantedEffect(make_effect("stribeck_friction", "knee"), np.array([0.3])),
        PlantedEffect(make_effect("torque_ripple", "hip"), np.array([0.1, 0.1])),
    ]
    single = {
        name: PlantedEffect(make_effect(name, "knee", **shape), np.array(values))
        for name, values, shape in (
            ("torque_ripple", [1.0, 0.5], {"order": 4.0}),
            ("spring_offset", [1.0], {}),
            ("backlash", [300.0], {"half_width": 0.002}),
            ("load_dependent_friction", [0.1], {}),
        )
    }
    cases = {
        "exo_leg": (leg, {"periods": 20}),
        "exo_leg, presliding friction": (leg, {"periods": 20, "friction": PreslidingCoulomb()}),
        "exo_leg, two planted effects": (leg, {"periods": 20, "effects": planted}),
        **{f"exo_leg, {name}": (leg, {"periods": 5, "effects": [effect]}) for name, effect in single.items()},
        "Baxter arm, seven springs": (baxter_arm(), {"periods": 5}),
        "UR10, rigid": (ur10(), {"periods": 5}),
    }
    print(f"real-time factor, periods of 10 s with settling, sensor noise and jitter, {platform.processor() or 'CPU'}")
    print(f"{'':32s}{'median':>8s}{'lowest':>8s}{'highest':>8s}{'us per step':>13s}")
    for name, (robot, options) in cases.items():
        series = modest_series(robot, base_frequency=0.1, harmonics=6)
        factors = []
        for seed in range(repeats):
            begin = time.process_time()
            run = simulate(robot, series, seed=seed, **options)
            simulated = (run.settling_periods + run.periods) * run.period
            factors.append(simulated / (time.process_time() - begin))
        per_step = 1e6 * simulated / np.median(factors) / run.steps
        print(f"{name:32s}{np.median(factors):8.1f}{min(factors):8.1f}{max(factors):8.1f}{per_step:13.1f}")


def step_table() -> None:
    leg = load_robot("exo_leg")
    series = modest_series(leg, base_frequency=0.1, harmonics=6)
    quiet = {"periods": 1, "sensors": SensorNoise.none(), "jitter": FrictionJitter.none()}
    begin = simulate(leg, series, **quiet).motion
    print("\nexo_leg, one period: largest error against a step of 0.08 ms, and order")
    for law in (SmoothCoulomb(0.02), SmoothCoulomb(), PreslidingCoulomb()):
        print(
            f"  {law}\n  {'step [ms]':>10s}{'q [rad]':>12s}{'dtheta [rad/s]':>16s}{'tau_motor [N m]':>17s}{'order':>8s}"
        )
        truth = simulate(leg, series, friction=law, start=begin, step=0.005 / 64, **quiet)
        before = None
        for substeps in (1, 2, 4, 8):
            run = simulate(leg, series, friction=law, start=begin, step=0.005 / substeps, **quiet)
            errors = [
                np.abs(run.motion.q - truth.motion.q).max(),
                np.abs(run.motion.dtheta - truth.motion.dtheta).max(),
                np.abs(run.tau_motor - truth.tau_motor).max(),
            ]
            order = "" if before is None else f"{np.log2(before / errors[0]):8.2f}"
            print(f"  {5.0 / substeps:10.4g}{errors[0]:12.2e}{errors[1]:16.2e}{errors[2]:17.2e}{order}")
            before = errors[0]


def usual_step_table() -> None:
    """The steps that a simulation takes by itself, and short ones alone, against steps of a sixteenth of a sample."""
    rigid = replace(plant_from_robot(ur10()), coulomb_friction=np.array([6.7, 8.0, 6.4, 1.0, 1.0, 1.0]))
    plants = [("exo_leg", plant_from_robot(load_robot("exo_leg"))), ("Baxter arm", plant_from_robot(baxter_arm()))]
    print("\nsteps by default, one period of 10 s after settling: largest error against steps of 0.31 ms or less")
    print(f"  {'':22s}{'steps':>8s}{'CPU [s]':>10s}{'q [rad]':>12s}{'tau_motor [N m]':>17s}")
    for name, plant in (*plants, ("UR10 with friction", rigid)):
        robot = plant.robot
        series = modest_series(robot, base_frequency=0.1, harmonics=6)
        quiet = {"plant": plant, "periods": 1, "sensors": SensorNoise.none(), "jitter": FrictionJitter.none()}
        begin = simulate(robot, series, **quiet).motion
        usual_step = simulate(robot, series, start=begin, **quiet).step
        truth = simulate(robot, series, start=begin, step=min(0.005 / 16, 0.5 * usual_step), **quiet)
        for label, step in ((name, None), ("  short steps alone", usual_step)):
            start = time.process_time()
            run = simulate(robot, series, start=begin, step=step, **quiet)
            spent = time.process_time() - start
            error_q, error_tau = (
                np.abs(one - other).max()
                for one, other in ((run.motion.q, truth.motion.q), (run.tau_motor, truth.tau_motor))
            )
            print(f"  {label:22s}{run.steps:8d}{spent:10.2f}{error_q:12.2e}{error_tau:17.2e}")


def settling_table() -> None:
    print("\nsettling to 1e-8")
    for name, robot in (("exo_leg", load_robot("exo_leg")), ("Baxter arm", baxter_arm()), ("UR10", ur10())):
        run = simulate(robot, modest_series(robot, base_frequency=0.1, harmonics=6), periods=1)
        print(f"  {name:12s}{run.settling_periods} periods, last change {run.settled:.1e}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--repeats", type=int, default=5)
    real_time_factors(parser.parse_args().repeats)
    step_table()
    usual_step_table()
    settling_table()
