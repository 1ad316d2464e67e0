"""Time to read and write a recording of 200 000 samples and 10 columns, per format, beside numpy's own CSV reader.

    python tests/benchmarks/bench_recordings.py [samples]

Prints the median of three runs [s], the ratio to `numpy.loadtxt` on the same numbers, and the size of the file.
"""

import shutil
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

from sea_ident.recordings import Recording, read_recording, write_recording

JOINTS = ("hip", "knee", "ankle")
RUNS = 3


def make_recording(samples: int) -> Recording:
    rng = np.random.default_rng(0)
    kinds = ("q", "theta", "tau_motor")
    columns = {f"{kind}_{joint}": rng.normal(size=samples) for kind in kinds for joint in JOINTS}
    return Recording(0.001 * np.arange(samples), columns, "benchmark")


def seconds(action) -> float:
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return median(times)


def size(path: Path) -> int:
    return sum(file.stat().st_size for file in path.iterdir()) if path.is_dir() else path.stat().st_size


def measure(samples: int, folder: Path) -> None:
    recording = make_recording(samples)
    write_recording(recording, folder / "x.csv")
    plain = seconds(lambda: np.loadtxt(folder / "x.csv", delimiter=",", skiprows=1, comments=None))
    print(f"{samples} samples, {1 + len(recording.columns)} columns; numpy.loadtxt alone: {plain:.2f} s")
    print("format     write [s]  read [s]  read/loadtxt  size [MB]")
    for suffix in (".csv", ".npz", ".mat", ".parquet", ".h5", ".bag", ".mcap", ".db3", ""):
        path = folder / f"x{suffix}"

        def write(path=path):
            if path.is_dir():
                shutil.rmtree(path)
            write_recording(recording, path)

        writing, reading = seconds(write), seconds(lambda path=path: read_recording(path))
        print(
            f"{suffix or 'folder':9s} {writing:10.2f} {reading:9.2f} {reading / plain:13.2f} {size(path) / 1e6:10.1f}",
            flush=True,
        )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        measure(int(sys.argv[1]) if len(sys.argv) > 1 else 200_000, Path(folder))
