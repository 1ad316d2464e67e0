"""Read thousands of damaged files of every format, each reader in a process with bounded memory.

    python tests/benchmarks/bench_recordings_fuzz.py [files per format] [seed]

Prints, per format: files read, recordings that came out, errors of the project, other exceptions, files that ended
the process (a crash inside a library, or a hang), the slowest file and the peak memory. The readers of MAT and HDF5
run in a process of their own otherwise, so that such a crash is an error like any other; here they run directly, so
that crashes are counted.
"""

import multiprocessing
import resource
import sys
import tempfile
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "recordings"))
from damage import SUFFIXES, damaged, write_sample

from sea_ident.exceptions import SeaIdentError
from sea_ident.recordings import hdf5_file, mat_file, read_recording

MEMORY_LIMIT = 2**28
ADDRESS_SPACE = 2**32
SECONDS = 60


def read_directly(reader, path, memory_limit):
    return {"hdf5_file:parse_hdf5": hdf5_file.parse_hdf5, "mat_file:parse_mat": mat_file.parse_mat}[reader](
        path, memory_limit
    )


def read_damaged(suffix: str, seeds: range, folder: str, progress) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    warnings.simplefilter("ignore")
    hdf5_file.read_isolated = mat_file.read_isolated = read_directly
    name = "." + suffix.split(".")[-1]
    valid = (Path(folder) / f"valid{suffix}").read_bytes()
    path = Path(folder) / f"damaged{seeds.start}{name}"
    for seed in seeds:
        path.write_bytes(damaged(suffix, valid, seed))
        start = time.perf_counter()
        try:
            read_recording(path, memory_limit=MEMORY_LIMIT)
            outcome = "read"
        except SeaIdentError:
            outcome = "refused"
        except BaseException as error:
            outcome = f"seed {seed}: {type(error).__name__}: {error}"[:300]
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        progress.put((seed, outcome, time.perf_counter() - start, memory))


def fuzz(suffix: str, count: int, first: int, folder: str) -> None:
    write_sample(suffix, Path(folder) / f"valid{suffix}")
    context = multiprocessing.get_context("fork")
    done, outcomes, died, slowest, peak = first, [], [], 0.0, 0.0
    while done < first + count:
        queue = context.SimpleQueue()
        worker = context.Process(target=read_damaged, args=(suffix, range(done, first + count), folder, queue))
        worker.start()
        last = time.monotonic()
        while worker.is_alive() or not queue.empty():
            if queue.empty():
                if time.monotonic() - last > SECONDS:
                    worker.kill()
                time.sleep(0.002)
                continue
            seed, outcome, seconds, memory = queue.get()
            last = time.monotonic()
            done, slowest, peak = seed + 1, max(slowest, seconds), max(peak, memory)
            outcomes.append(outcome)
        worker.join()
        if done < first + count:
            died.append((done, worker.exitcode))
            done += 1
    other = [outcome for outcome in outcomes if outcome not in ("read", "refused")]
    print(
        f"{suffix:11s}{len(outcomes):6d} files: {outcomes.count('read'):5d} read, "
        f"{outcomes.count('refused'):5d} refused, "
        f"{len(other)} other exceptions, {len(died)} ended the process, slowest {slowest:.2f} s, peak {peak:.0f} MiB",
        flush=True,
    )
    for text in [*sorted(set(other))[:5], *[f"seed {seed} ended the process ({code})" for seed, code in died[:5]]]:
        print("          ", text)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    for suffix in SUFFIXES:
        with tempfile.TemporaryDirectory() as folder:
            fuzz(suffix, count, first, folder)
