"""Valid recordings of every format, and random damage to them, for tests that no file breaks a reader."""

import io
import zipfile
from pathlib import Path

import h5py
import numpy as np
import scipy.io

from sea_ident.recordings import Recording, write_recording
from sea_ident.recordings.naming import TIME

SUFFIXES = (".csv", ".npz", ".inner.npz", ".mat", ".plain.mat", ".4.mat", ".73.mat", ".parquet", ".h5")
SUFFIXES += (".bag", ".mcap", ".db3")
"""Formats; inner: damaged inside the archive, whose checksums are right again; plain: not compressed."""

ISOLATED = (".mat", ".plain.mat", ".4.mat", ".73.mat", ".h5")
"""Formats whose library ends the process on some damaged files, and is therefore run in a process of its own."""


def sample_recording(samples: int = 40, seed: int = 0) -> Recording:
    rng = np.random.default_rng(seed)
    time = 0.01 * np.arange(samples)
    names = ["q_hip", "q_knee", "theta_hip", "theta_knee", "tau_motor_hip", "tau_motor_knee", "dq_hip"]
    names += ["dq_knee", "current_hip", "temperature_knee", "q_reference_hip"]
    return Recording(time, {name: rng.normal(size=samples) for name in names}, "sample")


def write_mat73(recording: Recording, path: Path) -> None:
    """As MATLAB's save -v7.3: HDF5 behind a 512-byte header, column vectors turned into rows."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in {TIME: recording.time, **recording.columns}.items():
            dataset = file.create_dataset(name, data=values[None, :], compression="gzip")
            dataset.attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM"
    with open(path, "r+b") as file:
        file.write(head)


def write_sample(suffix: str, path: Path, samples: int = 40) -> bytes:
    """Write a valid recording of a format and return its bytes."""
    recording = sample_recording(samples)
    variables = {TIME: recording.time, **recording.columns}
    if suffix == ".73.mat":
        write_mat73(recording, path)
    elif suffix in (".plain.mat", ".4.mat"):
        scipy.io.savemat(path, variables, format=suffix[1] if suffix == ".4.mat" else "5")
    else:
        write_recording(recording, path)
    return path.read_bytes()


def damage_inside(data: bytes, rng: np.random.Generator) -> bytes:
    """Damage one array in an archive, and pack it again."""
    packed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(packed, "w") as new:
        members = old.namelist()
        chosen = members[int(rng.integers(3))]
        for name in members:
            part = old.read(name)
            new.writestr(name, damage(part, rng) if name == chosen else part)
    return packed.getvalue()


def damaged(suffix: str, data: bytes, seed: int) -> bytes:
    """Damage a valid file of a format."""
    rng = np.random.default_rng(seed)
    return damage_inside(data, rng) if suffix == ".inner.npz" else damage(data, rng)


def damage(data: bytes, rng: np.random.Generator) -> bytes:
    """One to six random changes: bytes, bits, numbers at their bounds, cuts, repeats, insertions."""
    out = bytearray(data)
    for _ in range(int(rng.choice([1, 1, 1, 2, 3, 6]))):
        if not out:
            break
        at = int(rng.integers(len(out)))
        kind = int(rng.choice([0, 0, 1, 1, 1, 2, 2, 2, 3, 4, 5, 6]))
        if kind == 0:
            out[at] = int(rng.integers(256))
        elif kind == 1:
            out[at] ^= 1 << int(rng.integers(8))
        elif kind == 2:
            width = int(rng.choice([1, 2, 4, 8]))
            bounds = [0, 1, 2 ** (8 * width) - 1, 2 ** (8 * width - 1), 2 ** (8 * width - 1) - 1]
            out[at : at + width] = int(rng.choice(np.array(bounds, dtype=object))).to_bytes(width, "little")
        elif kind == 3:
            del out[at:]
        elif kind == 4:
            del out[at : at + int(rng.integers(1, 200))]
        elif kind == 5:
            piece = out[at : at + int(rng.integers(1, 200))]
            to = int(rng.integers(len(out)))
            out[to:to] = piece
        else:
            out[at:at] = rng.bytes(int(rng.integers(1, 50)))
    return bytes(out)
