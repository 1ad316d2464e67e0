"""The measured recordings that the project is judged by."""

from pathlib import Path

import numpy as np
import pytest

from sea_ident.recordings import read_recording, write_recording

DATA = Path(__file__).parents[2] / ".." / "shared" / "data"

FACTS = {
    "emps/identification.csv": ("slider", 24841, 24.84, 1000.0, True),
    "emps/validation_pulses.csv": ("slider", 24841, 24.84, 1000.0, True),
    "quanser_2dof_flexible_link/square_wave.csv": ("stage1 stage2", 10000, 19.998, 500.0, True),
    "hebi_x5/example_log.csv": ("output", 999, 9.979387, 99.91, False),
}


@pytest.mark.parametrize("name", FACTS)
def test_measured_recording(name, tmp_path):
    path = DATA / name
    if not path.is_file():
        pytest.skip(f"{name} is not beside the project")
    joints, samples, duration, rate, uniform = FACTS[name]
    found = read_recording(path)
    assert " ".join(found.joints) == joints
    assert found.samples == samples
    assert found.duration == pytest.approx(duration)
    assert found.sample_rate == pytest.approx(rate, rel=1e-4)
    assert found.is_uniform is uniform
    assert found.warnings == ()
    table = np.genfromtxt(path, delimiter=",", names=True)
    for column, values in found.columns.items():
        assert np.array_equal(values, table[column])
    write_recording(found, tmp_path / "again.npz")
    again = read_recording(tmp_path / "again.npz")
    assert all(np.array_equal(again.columns[column], values) for column, values in found.columns.items())
