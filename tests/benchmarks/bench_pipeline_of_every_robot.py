"""From excitation to diagnosis on URDFs of example-robot-data: what works, what is said, and how long it takes.

    python tests/benchmarks/bench_pipeline_of_every_robot.py [--springs] [--joints N] [URDF ...]

The first joints of every robot, or of those that are named, move; with `--springs` each has one of 300 N m/rad and a
motor. Every robot is simulated as it is described, identified and diagnosed with another motion held out. Nothing is
hidden in it but, with springs, the friction of links that many descriptions give and no model has by itself: it is to
be named, and nothing else.
"""

import argparse
import tempfile
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

from sea_ident import SeaIdentError, design_excitation, diagnose, identify, load_robot, simulate
from sea_ident.effects.link_friction import left_out
from sea_ident.robot import example_robots_folder

SPRING = (
    '<transmission name="{0} spring" type="sea_ident/SeriesElastic"><joint name="{0}"/><actuator name="{0} motor">'
    "<mechanicalReduction>100</mechanicalReduction><rotorInertia>2e-5</rotorInertia></actuator>"
    '<seriesElastic stiffness="300"/></transmission>'
)


def said_of(name: str, count: int, *, springs: bool, folder: Path) -> str:
    """What is said of one robot."""
    robot = load_robot(f"example:{name}")
    joints = robot.joint_names[:count]
    annotation = None
    if springs:
        annotation = folder / "springs.urdf"
        annotation.write_text(f"<robot name='springs'>{''.join(map(SPRING.format, joints))}</robot>")
    robot = load_robot(f"example:{name}", annotation, joints)
    first, second = (design_excitation(robot, starts=1, seed=seed) for seed in (1, 2))
    recording = simulate(robot, first, periods=10, seed=1).recording
    other = simulate(robot, second, periods=8, seed=2).recording
    model = identify(robot, recording, period=first.period)
    start = time.perf_counter()
    found = diagnose(model, recording, holdout=other, period=first.period)
    taken = time.perf_counter() - start
    hidden = sorted(f"link_friction {friction.joint}" for friction in left_out(robot, model.effects))
    named = sorted(f"{effect.effect} {effect.joint}" for effect in found.missing)
    return f"{robot.n} joints, {taken:.0f} s: {found.verdict}, {'as it is' if named == hidden else named or 'nothing'}"


def main(given: Sequence[str] | None = None) -> None:
    """Print a line for every robot."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("robots", nargs="*", metavar="URDF", help="within example-robot-data; all by default")
    parser.add_argument("--springs", action="store_true")
    parser.add_argument("--joints", type=int, default=6)
    arguments = parser.parse_args(given)
    everything = example_robots_folder()
    names = arguments.robots or sorted(str(path.relative_to(everything)) for path in everything.rglob("*.urdf"))
    warnings.simplefilter("ignore")
    for name in names:
        try:
            with tempfile.TemporaryDirectory() as folder:
                said = said_of(name, arguments.joints, springs=arguments.springs, folder=Path(folder))
        except SeaIdentError as error:
            said = f"refused: {str(error)[:160]}"
        print(f"{name:<58}{said}", flush=True)


if __name__ == "__main__":
    main()
