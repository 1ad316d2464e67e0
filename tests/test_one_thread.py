"""The linear algebra of a process runs on one thread while the library works, and on as many as before after it."""

import os
import sys
import warnings

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import sea_ident
from sea_ident import side_by_side as module
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.excitation.quadratic import solve_quadratic
from sea_ident.one_thread import one_thread
from sea_ident.recordings import Recording
from sea_ident.side_by_side import shared, side_by_side


def counts():
    """Threads of every library of linear algebra that is loaded, and of OpenMP within them."""
    return {library["num_threads"] for library in threadpool_info()}


@pytest.fixture(autouse=True)
def two_threads():
    with threadpool_limits(limits=2):
        if counts() != {2}:
            pytest.skip(f"the linear algebra here does not take two threads: {threadpool_info()}")
        yield
        assert counts() == {2}


@one_thread
def inside():
    """What a call sees."""
    return counts()


def test_a_call_runs_on_one_thread():
    assert inside() == {1}
    assert counts() == {2}
    assert inside.__doc__ == "What a call sees."


def test_a_call_within_a_call_leaves_it_on_one_thread():
    @one_thread
    def outer():
        return inside(), counts()

    assert outer() == ({1}, {1})


def test_what_a_call_raises_ends_it():
    @one_thread
    def fails():
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        fails()
    assert counts() == {2}


@pytest.mark.skipif(sys.platform != "linux", reason="a process is copied on Linux alone")
def test_a_copy_of_a_process_that_used_several_threads_does_not_wait_for_them(monkeypatch):
    # a quadratic program of this size goes to several threads of OpenMP where it may
    rng = np.random.default_rng(0)
    factor, rows = rng.normal(size=(300, 300)), rng.normal(size=(1200, 300))
    problem = factor @ factor.T + np.eye(300), rng.normal(size=300), rows, np.full(1200, -0.1), np.full(1200, 0.1)
    solve_quadratic(*problem)
    monkeypatch.setattr(module, "_cores", lambda: 2)
    monkeypatch.setattr(module, "LONGEST_WAIT", 20.0)

    def solved(turn):
        solve_quadratic(*problem)
        return os.getpid()

    solvers = one_thread(shared(lambda: list(side_by_side(solved, range(6)))))()
    assert len(set(solvers)) == 2


class Asked(Exception):
    """Somebody looked at an argument."""


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("close_gap", 2), ("design_excitation", 1), ("diagnose", 2), ("find_base_parameters", 2), ("identify", 2),
        ("identify_springs", 2), ("process", 2), ("simulate", 2), ("validate", 2),
    ],
)  # fmt: skip
def test_the_entry_points_do(name, arguments):
    seen = []

    class Telltale:
        """Stands for any argument: the first thing that is asked of it tells the threads."""

        def __getattribute__(self, attribute):
            seen.append(counts())
            raise Asked

        def __iter__(self):
            seen.append(counts())
            raise Asked

    with pytest.raises((Asked, SeaIdentError, TypeError)):
        getattr(sea_ident, name)(*[Telltale()] * arguments)
    assert seen
    assert all(each == {1} for each in seen)


def test_a_warning_is_that_of_the_caller():
    leg = sea_ident.load_robot("exo_leg")
    time = np.arange(400) / 200.0
    columns = {f"{kind}_{joint}": 0.1 * np.sin(time) for joint in leg.joint_names for kind in ("q", "theta")}
    torques = {f"tau_motor_{joint}": np.cos(time) for joint in leg.joint_names}
    recording = Recording(time=time, columns={**columns, **torques}, source="short")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sea_ident.process(recording, leg)
    files = {w.filename for w in caught if issubclass(w.category, SeaIdentWarning)}
    assert files == {__file__}
