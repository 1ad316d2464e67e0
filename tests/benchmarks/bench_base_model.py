"""Does the model that a diagnosis starts from still explain the torques, where much is missing?

    python tests/benchmarks/bench_base_model.py DIR [--row ROW]

DIR is that of a run of the hidden-effect benchmark with `--keep`. Per case: the largest share of a torque that the
model leaves, settled in its noise floor and fitted with all equations alike. Where the former is a multiple of the
latter, link equations, whose noise is that of encoders, outweigh the torques of the motors. Nothing is asserted here.
"""

import argparse
import json
import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from sea_ident import identify, load_robot
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.lack import remainder_share
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.diagnose import model_effects
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.recordings import read_recording

MULTIPLE = 2.0
"""Of what the first fit leaves, from which on a case is counted [-]."""


def remainders(case: Path) -> tuple[float, float]:
    """Shares of the torque that the settled and the first fit leave [-]."""
    about = json.loads((case / "joints.json").read_text())
    annotation = case / "annotation.urdf"
    robot = load_robot(case / "robot.urdf", annotation if annotation.exists() else None, about["joints"])
    recording = read_recording(case / "train.npz")
    model = identify(robot, recording, period=about["period"])
    effects = model_effects(model)
    bench = Bench(period_data(wide_processing(recording, robot, about["period"]), robot), effects)
    settled = settle(bench, effects)
    first = Settled(bench.again(bench.first_fit.solution, settled.noise), settled.noise)
    return remainder_share(bench, settled), remainder_share(bench, first)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--row", action="append", default=[], help="may be given more than once; default all")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    cases = [
        case
        for case in sorted((arguments.out / "cases").iterdir())
        if not arguments.row or case.name.rsplit("_", 1)[0] in arguments.row
    ]
    multiples = 0
    for case in cases:
        now, then = remainders(case)
        multiples += now > MULTIPLE * then
        print(
            f"{case.name:18s} settled {now:7.4f}   first {then:7.4f}   ratio {now / max(then, 1e-12):6.2f}", flush=True
        )
    print(f"{multiples} of {len(cases)} settled fits leave more than {MULTIPLE:g} times what the first leaves")
