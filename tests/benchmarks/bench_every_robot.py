"""Every URDF of example-robot-data: joints, bodies, base parameters, how clear the rank is, and how long it takes.

    python tests/benchmarks/bench_every_robot.py

`rank` counts the base parameters of links (and of rotors, where the URDF annotates motors); `energy` counts those of
the links by the energy model, an independent method; `gap` is the smallest kept singular value over the largest
rejected one.
"""

import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from independent_dynamics import energy_rank

from sea_ident import SeaIdentError, find_base_parameters, load_robot
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.effects.rotor_inertia import RotorInertia
from sea_ident.robot import example_robots_folder


def main() -> None:
    warnings.simplefilter("ignore")
    folder = example_robots_folder()
    print(f"{'URDF':<58}{'n':>4}{'bodies':>7}{'links':>6}{'energy':>7}{'rank':>6}{'gap':>9}{'load s':>8}{'base s':>8}")
    loaded = refused = 0
    for path in sorted(folder.rglob("*.urdf")):
        name = str(path.relative_to(folder))
        start = time.perf_counter()
        try:
            robot = load_robot(f"example:{name}")
        except SeaIdentError as error:
            refused += 1
            print(f"{name:<58}refused: {str(error).removeprefix(f'example:{name}: ')[:160]}")
            continue
        loaded += 1
        reading = time.perf_counter() - start
        links = find_base_parameters(robot, RigidBodies.instances(robot)).rank
        start = time.perf_counter()
        base = find_base_parameters(robot, (*RigidBodies.instances(robot), *RotorInertia.instances(robot)))
        grouping = time.perf_counter() - start
        print(
            f"{name:<58}{robot.n:>4}{len(robot.bodies):>7}{links:>6}{energy_rank(robot):>7}{base.rank:>6}"
            f"{base.gap:>9.1e}{reading:>8.3f}{grouping:>8.3f}"
        )
    print(f"{loaded} loaded, {refused} refused with a reason")


if __name__ == "__main__":
    main()
