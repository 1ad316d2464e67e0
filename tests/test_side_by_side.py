"""Results of two processes are those of a loop, whatever becomes of the second one."""

import multiprocessing
import os
import signal
import time

import numpy as np
import pytest
from joblib import Parallel, delayed

from sea_ident import side_by_side as module
from sea_ident.side_by_side import second_core, side_by_side

pytestmark = pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="this platform cannot copy a process"
)


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setattr(module, "_cores", lambda: 2)
    yield
    assert module._Copy.at_work == 0
    assert not copies()


def copies():
    """Copies of this process that are at work."""
    return [child for child in multiprocessing.active_children() if child.name.startswith("ForkProcess")]


class Both:
    """Calls a function, and waits with the first item until the copy has begun another: so both have a part."""

    def __init__(self, function):
        self.function, self.begun = function, multiprocessing.get_context("fork").Event()

    def __call__(self, item):
        if item == 0:
            assert self.begun.wait(60.0)
        self.begun.set()
        return self.function(item)


def where(item):
    """Who works on it."""
    time.sleep(0.02)
    return item, os.getpid()


@pytest.mark.parametrize("count", [0, 1, 2, 3, 10])
def test_results_come_in_order_and_from_both(count):
    found = list(side_by_side(Both(where) if count > 1 else where, range(count)))
    assert [item for item, _ in found] == list(range(count))
    workers = {worker for _, worker in found}
    assert os.getpid() in workers or not count
    assert len(workers) == min(count, 2)


def test_one_core_is_a_loop(monkeypatch):
    monkeypatch.setattr(module, "_cores", lambda: 1)
    assert {worker for _, worker in side_by_side(where, range(4))} == {os.getpid()}


def test_a_closure_and_what_it_knows_need_not_be_pickled():
    known = np.arange(4.0), lambda value: value + 1.0
    assert list(side_by_side(lambda k: known[1](known[0][k]), range(4))) == [1.0, 2.0, 3.0, 4.0]


def test_large_results_come_whole():
    found = list(side_by_side(Both(lambda k: np.full(500_000, k)), range(4)))
    assert [float(each.mean()) for each in found] == [0.0, 1.0, 2.0, 3.0]


def test_the_copy_goes_on_while_its_results_wait_to_be_taken():
    begun = multiprocessing.get_context("fork").Event()

    def large(item):
        if item == 0:
            assert begun.wait(20.0), "the copy stood still with a result that nobody took yet"
        if item == 2:
            begun.set()
        return np.full(60_000, item)

    assert [float(each.mean()) for each in side_by_side(large, range(3))] == [0.0, 1.0, 2.0]


def test_an_error_is_raised_in_its_turn():
    def odd(item):
        time.sleep(0.02)
        if item == 3:
            raise ValueError("three")
        return item

    results = side_by_side(Both(odd), range(6))
    assert [next(results) for _ in range(3)] == [0, 1, 2]
    with pytest.raises(ValueError, match="three"):
        next(results)


def test_what_cannot_be_sent_is_done_here():
    assert [each() for each in side_by_side(Both(lambda k: lambda: k), range(5))] == list(range(5))


def test_a_copy_that_dies_is_done_without():
    def deadly(item):
        time.sleep(0.02)
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    here = os.getpid()
    assert list(side_by_side(Both(deadly), range(5))) == list(range(5))


def test_a_copy_that_stands_still_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(module, "LONGEST_WAIT", 0.1)
    here = os.getpid()

    def slow(item):
        time.sleep(0.05 if os.getpid() == here else 1e4)
        return item

    assert list(side_by_side(Both(slow), range(4))) == [0, 1, 2, 3]


def test_where_no_copy_can_be_made_it_is_a_loop(monkeypatch):
    def full(*_):
        raise OSError("cannot allocate memory")

    monkeypatch.setattr(multiprocessing.get_context("fork").Process, "start", full)
    assert {worker for _, worker in side_by_side(where, range(4))} == {os.getpid()}


def test_who_stops_asking_stops_the_work():
    results = side_by_side(where, range(100))
    assert next(results)[0] == 0
    assert len(copies()) == 1
    results.close()
    assert not copies()


def test_nothing_is_begun_before_the_first_result_is_asked_for():
    results = side_by_side(where, range(4))
    assert not copies()
    results.close()


def test_there_is_one_copy_at_a_time():
    def nested(item):
        return item, {worker for _, worker in side_by_side(where, range(3))}

    assert all(len(workers) == 1 for _, workers in side_by_side(nested, range(4)))
    results = side_by_side(where, range(3))
    next(results)
    assert not second_core()
    results.close()
    assert second_core()


def test_a_worker_of_joblib_makes_no_copies():
    """Whoever works on several recordings at once has no core left."""

    def alone():
        return second_core()

    assert Parallel(n_jobs=2, backend="loky")(delayed(alone)() for _ in range(2)) == [False, False]
    assert Parallel(n_jobs=2, backend="multiprocessing")(delayed(second_core)() for _ in range(2)) == [False, False]
