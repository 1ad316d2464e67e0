"""Is an effect of the size that a diagnosis calls the smallest found?

    python tests/benchmarks/bench_detectability.py [--times 1.0] [--seed 900]

A leg with nothing hidden is diagnosed. Then every effect of one column or one amount is hidden in it, one at a time, so
many times as large as the smallest that was stated, and the recording is diagnosed without a held-out motion. Left out
are pushes, what couples two joints, of which one alone is stated, and what has no size of its own: play, whose column
is as large as its spring is stiff, presliding, which is as large as the dry friction, and friction of a power that is
dry friction by another name. Printed per effect: size, verdict, what is named, and whether the effect is among the
names or their alternatives; then the share.
"""

import argparse
import warnings

import numpy as np

import sea_ident
from sea_ident.discrepancy import Diagnosis
from sea_ident.discrepancy.result.findings import Detectability
from sea_ident.effects import make_effect
from sea_ident.effects.signal import SignalEffect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.excitation import Excitation, design_excitation
from sea_ident.robot import Robot
from sea_ident.simulation import PlantedEffect, simulate
from tests.benchmarks.hidden_effects.table import wilson

PERIODS = 12

WITHOUT_A_SIZE = ("external_force", "backlash", "presliding_friction", "nonlinear_viscous_friction")
OF_TWO_JOINTS = ("transmission_coupling",)


def planted(robot: Robot, stated: Detectability, times: float) -> PlantedEffect | None:
    """The effect so many times as large as stated, None where it has more than one size."""
    if stated.effect in (*WITHOUT_A_SIZE, *OF_TWO_JOINTS):
        return None
    shapes = {name: value for name, value, _ in stated.shapes}
    effect = make_effect(stated.effect, stated.joint)
    if isinstance(effect, SignalEffect):
        if len(effect.amounts) != 1:
            return None
        size = {effect.amounts[0].name: times * stated.smallest}
        return PlantedEffect(make_effect(stated.effect, stated.joint, **size), np.zeros(0))
    if len(effect.columns(robot)) != 1:
        return None
    return PlantedEffect(make_effect(stated.effect, stated.joint, **shapes), np.array([times * stated.smallest]))


def diagnosed(robot: Robot, excitation: Excitation, seed: int, effects: list[PlantedEffect]) -> Diagnosis:
    """Record, identify, diagnose."""
    recording = simulate(robot, excitation, periods=PERIODS, seed=seed, effects=effects).recording
    model = sea_ident.identify(robot, recording, period=excitation.period)
    return sea_ident.diagnose(model, recording)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=900)
    given = parser.parse_args()
    warnings.simplefilter("ignore", SeaIdentWarning)
    leg = sea_ident.load_robot("exo_leg")
    excitation = design_excitation(leg, starts=2, seed=1)
    found = tried = 0
    for stated in diagnosed(leg, excitation, given.seed, []).detectability:
        hidden = planted(leg, stated, given.times) if stated.joint and np.isfinite(stated.smallest) else None
        if hidden is None:
            continue
        tried += 1
        try:
            diagnosis = diagnosed(leg, excitation, given.seed + tried, [hidden])
        except sea_ident.exceptions.SeaIdentError as error:
            print(f"{stated.effect} @ {stated.joint}: not tried, {error}")
            tried -= 1
            continue
        names = [(e.effect, e.joint) for m in diagnosis.missing for e in (m, *m.alternatives)]
        right = (stated.effect, stated.joint) in names
        found += right
        size = f"{given.times * stated.smallest:.3g} {stated.unit}"
        print(
            f"{stated.effect} @ {stated.joint}, {size}: {diagnosis.verdict}, {names} {'found' if right else ''}",
            flush=True,
        )
    low, high = wilson(found, tried)
    print(
        f"found {found} of {tried} = {found / tried:.0%} [{low:.0%}, {high:.0%}] at {given.times:g} times the smallest"
    )


if __name__ == "__main__":
    main()
