"""`sea-ident excite`: the trajectory that tells most about the parameters."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sea_ident.cli.inputs import read_limits, read_robot
from sea_ident.cli.options import AnnotationFile, AsJson, Gravity, Jobs, JointNames, RobotSource, Seed
from sea_ident.cli.output import best_so_far, check_targets, emit, note, progress

if TYPE_CHECKING:
    from sea_ident.excitation import Excitation, Progress
    from sea_ident.excitation.joint_trajectory import Storage


class BagStorage(StrEnum):
    """Formats of ROS 2 bags."""

    mcap = "mcap"
    sqlite3 = "sqlite3"


def excite(
    robot: RobotSource,
    out: Annotated[Path, typer.Option("--out", metavar="EXC.json", help="File to write.", show_default=False)],
    base_frequency: Annotated[float, typer.Option("--base-frequency", help="One over the period [Hz].")] = 0.1,
    harmonics: Annotated[int, typer.Option("--harmonics", help="Harmonics per joint.")] = 10,
    starts: Annotated[int, typer.Option("--starts", help="Random starts; the best is kept.")] = 8,
    seed: Seed = 0,
    jobs: Jobs = -1,
    half_space: Annotated[
        list[str] | None,
        typer.Option(
            "--half-space",
            metavar="LINK[@X,Y,Z]:NX,NY,NZ,D",
            help="Keep a point of a link (its origin by default) at n . p <= D in the frame of the base [m]; may be "
            "repeated.",
        ),
    ] = None,
    self_collision: Annotated[
        float | None,
        typer.Option("--self-collision", metavar="M", help="Least distance between links that are not neighbours [m]."),
    ] = None,
    links_inside: Annotated[
        float | None,
        typer.Option(
            "--links-inside",
            metavar="PART",
            help="Keep the limits where the springs take the links too, and leave this part of each free. Default: "
            "only where links would swing.",
        ),
    ] = None,
    links_as_planned: Annotated[
        bool,
        typer.Option(
            "--links-as-planned",
            help="A controller moves the links themselves along the trajectory: where springs would take them is not "
            "looked at.",
        ),
    ] = False,
    ramp: Annotated[
        float | None,
        typer.Option(
            "--ramp", metavar="S", help="Begin and end at rest: ramps of at least so long [s], inside limits."
        ),
    ] = None,
    csv: Annotated[Path | None, typer.Option("--csv", metavar="T.csv", help="Also write the sampled motion.")] = None,
    yaml: Annotated[
        Path | None,
        typer.Option("--yaml", metavar="T.yaml", help="Also write a ROS 2 JointTrajectory for `ros2 topic pub`."),
    ] = None,
    bag: Annotated[
        Path | None,
        typer.Option("--bag", metavar="T", help="Also write it as a ROS 2 bag: a new folder, or a .mcap or .db3 file."),
    ] = None,
    bag_storage: Annotated[
        BagStorage, typer.Option("--bag-storage", help="Format inside the folder.")
    ] = BagStorage.mcap,
    rate: Annotated[
        float | None,
        typer.Option(
            "--rate", metavar="HZ", help="Samples per second in T. Default: 1000 in CSV, 100 in ROS messages."
        ),
    ] = None,
    periods: Annotated[int, typer.Option("--periods", help="Whole periods in T.")] = 1,
    annotation: AnnotationFile = None,
    joints: JointNames = None,
    gravity: Gravity = None,
    as_json: AsJson = False,
) -> None:
    """Design an exciting trajectory inside the limits of a robot. Ctrl-C keeps the best so far."""
    from sea_ident.exceptions import SeaIdentError
    from sea_ident.excitation import LinksAsPlanned, LinksInside, Ramp, design_excitation
    from sea_ident.excitation.joint_trajectory import bag_types

    if links_as_planned and links_inside is not None:
        raise SeaIdentError("--links-as-planned does not look at what --links-inside is to keep; give one of them")
    _check_targets(out, csv, yaml, bag, inputs=(robot, annotation))
    _check_samples(base_frequency, harmonics, rate, periods, csv is not None, yaml is not None or bag is not None)
    if bag is not None:
        bag_types()
    loaded = read_robot(robot, annotation, joints, gravity)
    limits = read_limits(loaded, half_space, self_collision)
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
            limits=limits,
            links=LinksAsPlanned() if links_as_planned else None if links_inside is None else LinksInside(links_inside),
            ramp=None if ramp is None else Ramp(ramp),
            jobs=jobs,
            progress=report,
        )
    designed.save(out)
    _write_samples(designed, csv, yaml, bag, bag_storage.value, rate, periods)
    files = [str(path) for path in (out, csv, yaml, bag) if path is not None]
    emit({**designed.to_dict(), "files": files}, f"{designed.summary()}\nwritten: {', '.join(files)}", as_json=as_json)


def _check_targets(
    out: Path, csv: Path | None, yaml: Path | None, bag: Path | None, inputs: tuple[str | None, ...]
) -> None:
    """As `check_targets`; a bag is a folder that is not there yet."""
    from sea_ident.exceptions import SeaIdentError

    if bag is not None and bag.is_dir():
        raise SeaIdentError(f"{bag}: exists already; remove it or choose another name")
    check_targets(out, csv, yaml, bag, inputs=inputs)


def _check_samples(
    base_frequency: float, harmonics: int, rate: float | None, periods: int, table: bool, messages: bool
) -> None:
    """Refuse, before the work begins, what could not be sampled after it."""
    from sea_ident.excitation.joint_trajectory import RATE
    from sea_ident.excitation.trajectory import CSV_RATE, check_sampling

    for wanted, default in ((table, CSV_RATE), (messages, RATE)):
        if wanted:
            check_sampling(base_frequency, harmonics, default if rate is None else rate, periods)


def _write_samples(
    designed: "Excitation",
    csv: Path | None,
    yaml: Path | None,
    bag: Path | None,
    storage: "Storage",
    rate: float | None,
    periods: int,
) -> None:
    """The sampled motion in every form that was asked for."""
    from sea_ident.excitation import write_trajectory_bag, write_trajectory_csv, write_trajectory_yaml
    from sea_ident.excitation.joint_trajectory import RATE
    from sea_ident.excitation.trajectory import CSV_RATE

    if csv is not None:
        write_trajectory_csv(designed, csv, CSV_RATE if rate is None else rate, periods)
    if yaml is not None:
        write_trajectory_yaml(designed, yaml, RATE if rate is None else rate, periods)
    if bag is not None:
        write_trajectory_bag(designed, bag, RATE if rate is None else rate, periods, storage=storage)
    if designed.ramp_out is None and (yaml is not None or bag is not None):
        note("note: without --ramp the ROS trajectory begins and ends in motion, which most controllers refuse")
