"""Identification and diagnosis with the linear algebra on one thread, and on as many as it takes by itself.

    python tests/benchmarks/bench_threads.py

Without OMP_NUM_THREADS and its like in the environment, or both are the same. A leg with a pretensioned spring is
recorded for twenty periods. Printed: seconds of both, and how many times as long the second takes.
"""

import warnings
from functools import partial
from timeit import repeat

import numpy as np
from threadpoolctl import threadpool_info

import sea_ident
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.simulation import PlantedEffect, simulate

RUNS = 3


def main() -> None:
    """Record, and time."""
    warnings.simplefilter("ignore", SeaIdentWarning)
    leg = sea_ident.load_robot("exo_leg")
    series = sea_ident.design_excitation(leg, base_frequency=0.2, harmonics=6, starts=3, seed=1).series
    spring = PlantedEffect(make_effect("spring_offset", "knee"), np.array([1.0]))
    recording = simulate(leg, series, periods=20, seed=3, effects=[spring]).recording
    model = sea_ident.identify(leg, recording)
    own = sorted({library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"})
    print(f"threads of the linear algebra by itself: {own}")
    for name, function, given in (
        ("identify", sea_ident.identify, (leg, recording)),
        ("diagnose", sea_ident.diagnose, (model, recording)),
    ):
        unlimited = function.__wrapped__  # type: ignore[attr-defined]
        calls = [partial(call, *given) for call in (function, unlimited)]
        one, many = (min(repeat(call, number=1, repeat=RUNS)) for call in calls)
        print(f"{name}: {one:.2f} s on one thread, {many:.2f} s on {own}: {many / one:.1f} times")


if __name__ == "__main__":
    main()
