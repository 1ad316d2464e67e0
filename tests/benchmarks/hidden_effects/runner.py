"""Run cases: draw, simulate, diagnose in a process of its own, keep the results; stops and resumes."""

import json
import os
import queue
import subprocess
import sys
import threading
import time
import traceback
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.hidden_effects.case import Case
from tests.benchmarks.hidden_effects.diagnose_case import RESULT
from tests.benchmarks.hidden_effects.draw import draw_case
from tests.benchmarks.hidden_effects.generate import case_folder, generate, truth_file

TIME_LIMIT = 600.0


@dataclass(frozen=True)
class Task:
    """One case to be run.

    Attributes:
        root: folder of the run.
        seed: of the run.
        row: row of the table.
        index: number within the row.
        keep: whether recordings stay on disk.
        generate_only: whether the diagnosis is left out.
    """

    root: Path
    seed: int
    row: str
    index: int
    keep: bool
    generate_only: bool = False

    @property
    def label(self) -> str:
        """Name of its files."""
        return f"{self.row}_{self.index:04d}"


class Diagnoser:
    """A process that diagnoses folders; started again after a case that took too long."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[str] | None = None
        self.lines: queue.Queue[str] = queue.Queue()

    def _start(self) -> subprocess.Popen[str]:
        module = "tests.benchmarks.hidden_effects.diagnose_case"
        root = Path(__file__).resolve().parents[3]
        path = os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])
        process = subprocess.Popen(
            [sys.executable, "-m", module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=root,
            env={**os.environ, "PYTHONPATH": path},
        )
        self.lines = queue.Queue()
        threading.Thread(target=self._read, args=(process, self.lines), daemon=True).start()
        return process

    @staticmethod
    def _read(process: subprocess.Popen[str], lines: "queue.Queue[str]") -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.put(line.strip())
        lines.put("")

    def run(self, folder: Path) -> None:
        """Diagnose one folder; what went wrong is written beside it."""
        if self.process is None or self.process.poll() is not None:
            self.process = self._start()
        assert self.process.stdin is not None
        self.process.stdin.write(f"{folder}\n")
        self.process.stdin.flush()
        deadline, text = time.monotonic() + TIME_LIMIT, ""
        while time.monotonic() < deadline:
            try:
                answer = self.lines.get(timeout=1.0)
            except queue.Empty:
                continue
            if answer == str(folder):
                return
            if answer == "":
                text = "the process ended"
                break
        self.process.kill()
        self.process = None
        error = {"error": text or f"no diagnosis within {TIME_LIMIT:g} s"}
        (folder / RESULT).write_text(json.dumps(error))


_DIAGNOSER = Diagnoser()


def run_task(task: Task) -> str:
    """Draw, simulate and diagnose one case.

    Returns:
        A line about it.
    """
    folder, truth = case_folder(task.root, task.label), truth_file(task.root, task.label)
    started = time.perf_counter()
    try:
        if not truth.exists() or not ((folder / "train.npz").exists() or (folder / RESULT).exists()):
            generate(draw_case(task.seed, task.row, task.index), task.root)
        simulated = time.perf_counter()
        if task.generate_only:
            return f"{task.label}: simulated in {simulated - started:.1f} s"
        if not (folder / RESULT).exists():
            _DIAGNOSER.run(folder.resolve())
        result = json.loads((folder / RESULT).read_text())
    except Exception:
        (task.root / f"{task.label}.failed.txt").write_text(traceback.format_exc())
        return f"{task.label}: the benchmark itself failed, see {task.label}.failed.txt"
    if not task.keep and "error" not in result:
        for name in ("train", "holdout", "reference"):
            (folder / f"{name}.npz").unlink(missing_ok=True)
    case = Case.from_dict(json.loads(truth.read_text()))
    planted = ", ".join(f"{p.effect} @ {p.joint} {100 * p.gap:.2g} %" for p in case.planted) or "nothing"
    found = ", ".join(f"{m['effect']} @ {m['joint']}" for m in result.get("missing", [])) or "nothing"
    said = result.get("verdict", result.get("error", "?"))
    times = f"{simulated - started:.0f} + {time.perf_counter() - simulated:.0f} s"
    return f"{task.label} {case.robot} {case.engine}: {planted} -> {said}: {found} ({times})"


def run(tasks: list[Task], jobs: int) -> None:
    """Run tasks in parallel; Ctrl-C stops after what is running, and a later run goes on from there."""
    total = len(tasks)
    if jobs > 1:
        # each has one core: a second process of a diagnosis would compete with the others
        os.environ["LOKY_MAX_CPU_COUNT"] = "1"
    with ProcessPoolExecutor(max_workers=jobs) as pool:
        waiting, done = list(tasks), 0
        running: set[Future[str]] = set()
        try:
            while waiting or running:
                while waiting and len(running) < jobs:
                    running.add(pool.submit(run_task, waiting.pop(0)))
                finished, running = wait(running, return_when=FIRST_COMPLETED)
                for future in finished:
                    done += 1
                    print(f"[{done}/{total}] {future.result()}", flush=True)
        except KeyboardInterrupt:
            print("stopped; run the same command again to go on", flush=True)
            pool.shutdown(wait=False, cancel_futures=True)
