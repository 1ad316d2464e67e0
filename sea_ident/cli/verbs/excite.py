"""`sea-ident excite`: the trajectory that tells most about the parameters."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sea_ident.cli.inputs import read_robot
from sea_ident.cli.options import AnnotationFile, AsJson, JointNames, RobotSource, Seed
from sea_ident.cli.output import best_so_far, check_targets, emit, progress

if TYPE_CHECKING:
    from sea_ident.excitation import Progress


def excite(
    robot: RobotSource,
    out: Annotated[Path, typer.Option("--out", metavar="EXC.json", help="File to write.", show_default=False)],
    base_frequency: Annotated[float, typer.Option("--base-frequency", help="One over the period [Hz].")] = 0.1,
    harmonics: Annotated[int, typer.Option("--harmonics", help="Harmonics per joint.")] = 10,
    starts: Annotated[int, typer.Option("--starts", help="Random starts; the best is kept.")] = 8,
    seed: Seed = 0,
    jobs: Annotated[int, typer.Option("--jobs", help="Starts at a time; -1: one per core.")] = -1,
    csv: Annotated[Path | None, typer.Option("--csv", metavar="T.csv", help="Also write the sampled motion.")] = None,
    annotation: AnnotationFile = None,
    joints: JointNames = None,
    as_json: AsJson = False,
) -> None:
    """Design an exciting trajectory inside the limits of a robot. Ctrl-C keeps the best so far."""
    from sea_ident.excitation import design_excitation

    check_targets(out, csv)
    loaded = read_robot(robot, annotation, joints)
    with progress("designing the excitation", starts) as tell, best_so_far():
        ended: set[int] = set()

        def report(state: "Progress") -> None:
            # a start that reports its first step follows on one that has ended
            ended.add(state.start)
            tell(max(len(ended) - 1, 0), f"start {len(ended)} of {state.starts}, best {state.best:.3f}")

        designed = design_excitation(
            loaded,
            base_frequency=base_frequency,
            harmonics=harmonics,
            starts=starts,
            seed=seed,
            jobs=jobs,
            progress=report,
        )
    designed.save(out)
    if csv is not None:
        from sea_ident.excitation import write_trajectory_csv

        write_trajectory_csv(designed, csv)
    files = [str(path) for path in (out, csv) if path is not None]
    emit({**designed.to_dict(), "files": files}, f"{designed.summary()}\nwritten: {', '.join(files)}", as_json=as_json)
