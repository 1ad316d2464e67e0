"""The picture of the README: two effects are hidden in the simulated leg, found by name, and the gap closes.

    OMP_NUM_THREADS=1 python tests/benchmarks/picture_of_the_gap.py [examples/pictures/gap.svg]

The left side shows the motor equation of the hip on the recording that was diagnosed; the right side shows the gap on
another motion, which was used for nothing.
"""

import sys
import warnings
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sea_ident import design_excitation, identify, load_robot, simulate
from sea_ident.discrepancy import Diagnosis, diagnose
from sea_ident.effects import make_effect
from sea_ident.simulation import PlantedEffect

BEFORE, AFTER, NOISE, INK = "#d1570a", "#0b6fc2", "#9aa3ad", "#30363d"
HIDDEN = (
    ("stribeck_friction", "knee", 0.6),
    ("load_dependent_friction", "hip", 0.04),
)


def experiment(seed: int = 1) -> Diagnosis:
    """The diagnosis of a leg with the hidden effects."""
    robot = load_robot("exo_leg")
    planted = [PlantedEffect(make_effect(name, joint), np.array([value])) for name, joint, value in HIDDEN]
    recordings = [
        simulate(robot, design_excitation(robot, starts=2, seed=k), periods=20, seed=k, effects=planted).recording
        for k in (seed, seed + 1)
    ]
    model = identify(robot, recordings[0], period=10.0)
    return diagnose(model, recordings[0], holdout=recordings[1], period=10.0)


def draw(diagnosis: Diagnosis, path: Path) -> None:
    """Residual over time, and the gap per joint."""
    waves, gap = diagnosis.waveforms, diagnosis.holdout
    assert waves is not None
    assert gap is not None
    figure = Figure(figsize=(9.0, 2.9), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, width_ratios=(2.3, 1.0))
    e = waves.equations.index("hip motor")
    left.axhspan(-2 * waves.noise[e], 2 * waves.noise[e], color=NOISE, alpha=0.3, lw=0, label="noise, ±2 std")
    left.plot(waves.time, waves.before[:, e], color=BEFORE, lw=1.1, label="the model as it was")
    left.plot(waves.time, waves.after[:, e], color=AFTER, lw=1.1, label="with the effects that were named")
    left.set(xlabel="time [s]", ylabel="residual of the hip motor [N m]")
    left.margins(x=0)
    left.legend(frameon=False, fontsize=8, ncol=3, loc="upper center", bbox_to_anchor=(0.5, 1.16))
    joints = list(gap.before)
    place = np.arange(len(joints))
    parts = ((gap.before, BEFORE, "before"), (gap.after, AFTER, "after"), (gap.noise, NOISE, "noise"))
    for k, (part, color, label) in enumerate(parts):
        right.bar(place + 0.27 * (k - 1), [part[j] for j in joints], 0.25, color=color, label=label)
    right.set_xticks(place, joints)
    right.set_ylabel("gap on held-out motion [N m]")
    right.legend(frameon=False, fontsize=8, ncol=3, loc="upper center", bbox_to_anchor=(0.5, 1.16))
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(colors=INK)
    figure.savefig(path, facecolor="white", metadata={"Date": None})


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    found = experiment()
    print(found.summary())
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[2] / "examples/pictures/gap.svg"
    target.parent.mkdir(exist_ok=True)
    draw(found, target)
