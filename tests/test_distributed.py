"""A real cluster of worker processes takes the work over, and the death of a worker changes nothing in the result."""

import os
import signal
import threading
import time
import warnings

import joblib
import numpy as np
import pytest

from sea_ident import design_excitation, load_robot
from sea_ident.batch import identify_batch
from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording, write_recording

distributed = pytest.importorskip(
    "distributed", reason="dask.distributed is not installed: pip install dask distributed"
)

# what dask and its network library warn of while workers die is theirs
pytestmark = pytest.mark.filterwarnings("ignore")
PERIOD, WORKERS, FLEET = 2.0, 3, 10


@pytest.fixture
def cluster():
    with (
        warnings.catch_warnings(),
        distributed.LocalCluster(
            n_workers=WORKERS,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            silence_logs="CRITICAL",
        ) as made,
    ):
        warnings.simplefilter("ignore")
        with distributed.Client(made) as client:
            client.wait_for_workers(WORKERS)
            yield client


@pytest.fixture(scope="module")
def leg():
    return load_robot("exo_leg")


@pytest.fixture(scope="module")
def slider():
    return load_robot("emps")


@pytest.fixture
def fleet(tmp_path):
    """Sliders of different masses; one recording is broken."""
    series = FourierSeries(1.0 / PERIOD, np.array([0.1]), np.array([[0.08, 0.05]]), np.array([[0.03, -0.06]]))
    instants = np.arange(6 * 400) * (PERIOD / 400)
    q, dq, ddq = (series.evaluate(instants, k)[:, 0] for k in range(3))
    for k in range(FLEET):
        noise = np.random.default_rng(k)
        force = (80.0 + 5.0 * k) * ddq + 200.0 * dq + 20.0 * np.tanh(dq / 0.005) + noise.normal(size=len(q))
        measured = q + 1e-7 * noise.normal(size=len(q))
        recording = Recording(instants, {"q_slider": measured, "tau_motor_slider": force}, f"slider {k}")
        write_recording(recording, tmp_path / f"slider{k}.csv")
    (tmp_path / "broken.csv").write_text("time,q_slider\n0,0\n1,nan\n")
    return tmp_path


def process_ids(client) -> dict[str, int]:
    return {address: int(pid) for address, pid in client.run(os.getpid).items()}


class Killer(threading.Thread):
    """Kills one worker as soon as that worker is at work."""

    def __init__(self, client) -> None:
        super().__init__(daemon=True)
        self.client, self.pids, self.killed = client, process_ids(client), None
        self.done = threading.Event()

    def run(self) -> None:
        deadline = time.monotonic() + 60.0
        while self.killed is None and time.monotonic() < deadline and not self.done.is_set():
            for address, keys in self.client.processing().items():
                if keys and address in self.pids:
                    os.kill(self.pids[address], signal.SIGKILL)
                    self.killed = address
                    break
            time.sleep(0.01)

    def __enter__(self) -> "Killer":
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.done.set()
        self.join()


def design(leg):
    return design_excitation(leg, base_frequency=0.2, harmonics=3, starts=6, seed=2, rate=50.0, jobs=1)


def contents(result):
    """Table and models of a batch."""
    models = sorted((result.table.parent / "models").glob("*.json"))
    return result.table.read_text(), {path.name: path.read_text() for path in models}


@pytest.mark.slow
def test_starts_of_an_excitation_on_a_cluster(leg, cluster):
    serial = design(leg)
    with joblib.parallel_config(backend="dask", wait_for_workers_timeout=30):
        spread = design_excitation(leg, base_frequency=0.2, harmonics=3, starts=6, seed=2, rate=50.0, jobs=-1)
    assert spread.start_values == serial.start_values
    np.testing.assert_array_equal(spread.series.a, serial.series.a)
    np.testing.assert_array_equal(spread.series.b, serial.series.b)
    np.testing.assert_array_equal(spread.series.offset, serial.series.offset)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_a_worker_killed_while_it_climbs_a_start(leg, cluster):
    serial = design(leg)
    with Killer(cluster) as killer, joblib.parallel_config(backend="dask", wait_for_workers_timeout=30):
        spread = design_excitation(leg, base_frequency=0.2, harmonics=3, starts=6, seed=2, rate=50.0, jobs=-1)
    assert killer.killed is not None, "no worker was killed while it worked"
    assert spread.start_values == serial.start_values
    np.testing.assert_array_equal(spread.series.a, serial.series.a)


@pytest.mark.slow
def test_a_fleet_on_a_cluster(slider, fleet, cluster):
    serial = identify_batch(slider, fleet, fleet / "serial", period=PERIOD, jobs=1)
    with joblib.parallel_config(backend="dask", wait_for_workers_timeout=30):
        spread = identify_batch(slider, fleet, fleet / "cluster", period=PERIOD)
    assert len(spread.failed) == 1
    assert contents(spread) == contents(serial)


@pytest.mark.scenario
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_a_worker_killed_while_it_identifies(slider, fleet, cluster):
    serial = identify_batch(slider, fleet, fleet / "serial", period=PERIOD, jobs=1)
    before = process_ids(cluster)
    with Killer(cluster) as killer, joblib.parallel_config(backend="dask", wait_for_workers_timeout=30):
        spread = identify_batch(slider, fleet, fleet / "cluster", period=PERIOD)
    assert killer.killed is not None, "no worker was killed while it worked"
    deadline = time.monotonic() + 30.0
    while before[killer.killed] in process_ids(cluster).values():
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert contents(spread) == contents(serial)
