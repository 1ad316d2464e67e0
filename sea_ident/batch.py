"""`identify_batch`: a folder of recordings, each identified, with one table at the end."""

import csv
import hashlib
import json
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from threading import Thread
from time import sleep
from typing import Any

from joblib import Parallel, delayed
from joblib.externals.loky.process_executor import BrokenProcessPool

import sea_ident
from sea_ident.arguments import as_path, expect, expect_whole
from sea_ident.atomic import atomic_file
from sea_ident.estimation import identify
from sea_ident.exceptions import RecordingError, SeaIdentError, SeaIdentWarning
from sea_ident.recordings import ColumnSource, read_recording
from sea_ident.recordings.columns import as_source
from sea_ident.recordings.files import SUFFIXES, is_recording
from sea_ident.robot import Robot, robot_from_text

WATCH = 1.0
"""Time [s] between two looks of a worker process at whether the run that it works for is still there."""

MODELS, ROWS, TABLE = "models", "rows", "table.csv"


@dataclass(frozen=True)
class BatchRow:
    """Outcome of one recording.

    Attributes:
        recording: name of its file.
        done: whether a model was found.
        message: why not; empty where it was.
        resumed: whether an earlier run had done it already.
        warnings: what a user should know.
        values: numbers by column: fit per joint, parameters and springs with their standard deviations.
    """

    recording: str
    done: bool
    message: str
    resumed: bool
    warnings: tuple[str, ...]
    values: Mapping[str, float]


@dataclass(frozen=True)
class Batch:
    """Outcome of a folder of recordings.

    Attributes:
        rows: one for every recording, by name.
        table: the table that was written.
        left_out: files of the folder that are no recordings by their names.
    """

    rows: tuple[BatchRow, ...]
    table: Path
    left_out: tuple[str, ...] = ()

    @property
    def failed(self) -> tuple[BatchRow, ...]:
        """Recordings without a model."""
        return tuple(row for row in self.rows if not row.done)

    def summary(self) -> str:
        """Counts, failures with their reasons, and the table."""
        resumed = sum(row.resumed for row in self.rows)
        lines = [
            f"{len(self.rows)} recordings: {len(self.rows) - len(self.failed)} identified ({resumed} of them by an "
            f"earlier run), {len(self.failed)} failed"
        ]
        lines.extend(f"  {row.recording}: {row.message}" for row in self.failed)
        if self.left_out:
            more = f" and {len(self.left_out) - 5} more" if len(self.left_out) > 5 else ""
            lines.append(f"no recordings by their names: {', '.join(self.left_out[:5])}{more}")
        lines.append(f"table: {self.table}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """For `sea-ident batch --json`."""
        rows = [
            {
                "recording": row.recording,
                "done": row.done,
                "message": row.message,
                "resumed": row.resumed,
                "warnings": list(row.warnings),
                "values": dict(row.values),
            }
            for row in self.rows
        ]
        return {
            "recordings": len(rows),
            "failed": len(self.failed),
            "rows": rows,
            "left_out": list(self.left_out),
            "table": str(self.table),
        }


@dataclass(frozen=True)
class _Task:
    """What a worker needs, in plain types that any cluster can send."""

    path: str
    urdf: str
    source: str
    annotation: str | None
    joints: tuple[str, ...]
    gravity: tuple[float, ...]
    period: float | None
    columns: Mapping[str, str | ColumnSource] | None
    parent: int

    def fingerprint(self) -> str:
        """Changes with the contents of the recording, the robot, the settings and the version."""
        digest = hashlib.sha256()
        path = Path(self.path)
        for part in sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]:
            with open(part, "rb") as file:
                while block := file.read(1 << 20):
                    digest.update(block)
        columns = {name: asdict(as_source(how)) for name, how in sorted((self.columns or {}).items())}
        settings = [self.urdf, self.annotation, self.joints, self.gravity, self.period, columns, sea_ident.__version__]
        digest.update(json.dumps(settings).encode())
        return digest.hexdigest()


@dataclass(frozen=True)
class _Outcome:
    path: str
    model: dict[str, Any] | None
    message: str
    warnings: tuple[str, ...]


def identify_batch(
    robot: Robot,
    folder: str | Path,
    out: str | Path | None = None,
    *,
    period: float | None = None,
    columns: Mapping[str, str | ColumnSource] | None = None,
    jobs: int = -1,
    progress: Callable[[int, int, str], None] | None = None,
) -> Batch:
    """Identify every recording of a folder.

    A recording that cannot be identified is a row with the reason, and the others go on. What was done before a kill is
    kept: a second run identifies only what is missing, has changed, or failed. The work goes through joblib, so that a
    cluster takes it over under ``joblib.parallel_config(backend="dask")``; the result does not depend on that.

    Args:
        robot: the robot of all recordings.
        folder: where the recordings are.
        out: where models and table go; `identified` inside `folder` where None.
        period: [s]; found from the data where None.
        columns: how foreign columns are called, in every recording; as in `read_recording`.
        jobs: recordings at a time; -1 is one per core.
        progress: called with the number done, the number of all, and the name of the recording.

    Returns:
        The rows, which are also in ``table.csv``.

    Raises:
        RecordingError: there is no such folder, or no recording in it.
        SeaIdentError: `jobs` is 0.
    """
    expect(robot, "identify_batch: robot", Robot)
    expect_whole(jobs, "identify_batch: jobs")
    if jobs == 0:
        raise SeaIdentError("jobs is 0; give at least 1, or -1 for one per core")
    folder = as_path(folder, "identify_batch: folder")
    target = folder / "identified" if out is None else as_path(out, "identify_batch: out")
    paths, others = _recordings(folder, target / TABLE)
    try:
        for name in (MODELS, ROWS):
            (target / name).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{target}: cannot be made: {error.strerror or error}") from None
    tasks = [
        _Task(
            str(path),
            robot.urdf,
            robot.source,
            robot.annotation,
            robot.joint_names,
            tuple(robot.gravity.tolist()),
            period,
            columns,
            os.getpid(),
        )
        for path in paths
    ]
    tell = progress or (lambda done, count, name: None)
    rows: dict[str, BatchRow] = {}
    prints: dict[str, str] = {}
    for task in tasks:
        name = Path(task.path).name
        try:
            prints[name] = task.fingerprint()
        except OSError:
            prints[name] = ""  # cannot be read: reading it says why, in its row
        kept = _kept(target, name, prints[name])
        if kept is not None:
            rows[name] = kept
    tell(len(rows), len(tasks), "")
    open_tasks = [task for task in tasks if Path(task.path).name not in rows]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)  # each is in the row that it concerns
        for outcome in _outcomes(open_tasks, jobs):
            name = Path(outcome.path).name
            rows[name] = _keep(target, name, prints[name], outcome)
            tell(len(rows), len(tasks), name)
    ordered = tuple(rows[path.name] for path in paths)
    _write_table(ordered, target / TABLE)
    return Batch(ordered, target / TABLE, others)


def _recordings(folder: Path, table: Path) -> tuple[list[Path], tuple[str, ...]]:
    """Recordings of a folder without the table of an earlier run, and the names of other files."""
    if not folder.is_dir():
        raise RecordingError(f"{folder}: no such folder")
    seen = sorted(p for p in folder.iterdir() if p.name[0] != "." and p.absolute() != table.absolute())
    found = [p for p in seen if is_recording(p)]
    if not found:
        raise RecordingError(f"{folder}: holds no recording; known suffixes are {', '.join(SUFFIXES)}")
    return found, tuple(p.name for p in seen if not p.is_dir() and p not in found)


def _outcomes(tasks: Sequence[_Task], jobs: int) -> Iterator[_Outcome]:
    """As they come. Where one brings its worker process down, those that were lost are done again, each alone."""
    finished: set[str] = set()
    try:
        for outcome in Parallel(n_jobs=jobs, return_as="generator_unordered")(delayed(_one)(task) for task in tasks):
            finished.add(outcome.path)
            yield outcome
    except BrokenProcessPool:
        for task in tasks:
            if task.path in finished:
                continue
            try:
                yield from Parallel(n_jobs=2, backend="loky")([delayed(_one)(task)])
            except BrokenProcessPool:
                yield _Outcome(task.path, None, "its worker process ended without an answer (out of memory?)", ())


@cache
def _end_with(parent: int) -> None:
    """Let this worker process end when its parent has gone: a killed run cannot tell its workers to stop."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(WATCH)
        os._exit(1)

    if os.getppid() == parent:
        Thread(target=watch, daemon=True).start()


def _one(task: _Task) -> _Outcome:
    """Identify one recording; every failure is an outcome, a defect of the library included."""
    if os.getpid() != task.parent:
        _end_with(task.parent)
        # a worker of its own: what is warned of is in the outcome, and its standard error is nobody's
        warnings.simplefilter("ignore", SeaIdentWarning)
    try:
        robot = robot_from_text(task.urdf, task.source, task.annotation, task.joints, task.gravity)
        recording = read_recording(task.path, columns=task.columns)
        model = identify(robot, recording, period=task.period)
        found = tuple(dict.fromkeys((*recording.warnings, *model.warnings)))
        return _Outcome(task.path, model.to_dict(), "", found)
    except SeaIdentError as error:
        return _Outcome(task.path, None, str(error), ())
    except Exception as error:  # one bad recording must not stop a fleet; the reason is kept
        return _Outcome(task.path, None, f"defect: {type(error).__name__}: {error}", ())


def _kept(target: Path, name: str, fingerprint: str) -> BatchRow | None:
    """What an earlier run found, where it still holds."""
    try:
        record = json.loads((target / ROWS / f"{name}.json").read_text(encoding="utf-8"))
        if record["fingerprint"] != fingerprint or not record["done"]:
            return None
        if not (target / MODELS / f"{name}.json").is_file():
            return None
        values = {str(key): float(value) for key, value in record["values"].items()}
        return BatchRow(name, True, "", True, tuple(record["warnings"]), values)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None  # not there, or not ours: it is done again


def _keep(target: Path, name: str, fingerprint: str, outcome: _Outcome) -> BatchRow:
    """Write the model first and the row after it, so that a row stands for a model that is there."""
    values: dict[str, float] = {}
    model = target / MODELS / f"{name}.json"
    if outcome.model is None:
        model.unlink(missing_ok=True)
    else:
        values = table_values(outcome.model)
        with atomic_file(model) as temporary:
            temporary.write_text(json.dumps(outcome.model, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    row = BatchRow(name, outcome.model is not None, outcome.message, False, outcome.warnings, values)
    record = {
        "fingerprint": fingerprint,
        "done": row.done,
        "message": row.message,
        "warnings": list(row.warnings),
        "values": values,
    }
    with atomic_file(target / ROWS / f"{name}.json") as temporary:
        temporary.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return row


def table_values(model: Mapping[str, Any]) -> dict[str, float]:
    """Columns of the table from the contents of a MODEL.json."""
    fit = model["fit"]
    values: dict[str, float] = {key: fit[key] for key in ("periods", "samples", "condition_number", "log_det")}
    for kind in ("rms_residual", "noise_std"):
        values.update({f"{joint}.{kind}": value for joint, value in fit[kind].items()})
    for parameter in model["base_parameters"]:
        values[parameter["name"]] = parameter["value"]
        values[f"{parameter['name']} std"] = parameter["std"]
    for spring in model["springs"]:
        for key in ("stiffness", "cubic_stiffness", "damping"):
            values[f"{spring['joint']}.{key}"] = spring[key]
            values[f"{spring['joint']}.{key} std"] = spring[f"{key}_std"]
    return {key: float(value) for key, value in values.items() if value is not None}


def _write_table(rows: Sequence[BatchRow], path: Path) -> None:
    columns = list(dict.fromkeys(key for row in rows for key in row.values))
    with (
        atomic_file(path) as temporary,
        open(temporary, "w", newline="", encoding="utf-8", errors="backslashreplace") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(["recording", "status", "message", "warnings", *columns])
        for row in rows:
            numbers = [repr(row.values[key]) if key in row.values else "" for key in columns]
            status = "done" if row.done else "failed"
            writer.writerow([row.recording, status, row.message, "; ".join(row.warnings), *numbers])
