"""Results of two processes are those of a loop, whatever becomes of the second one."""

import multiprocessing
import os
import signal
import threading
import time

import numpy as np
import pytest
from joblib import Parallel, delayed

from sea_ident import side_by_side as module
from sea_ident.side_by_side import follows, second_core, shared, side_by_side

pytestmark = pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="this platform cannot copy a process"
)


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setattr(module, "_cores", lambda: 2)
    yield
    assert module._Pair.at_work == 0
    assert not copies()
    assert not [each for each in threading.enumerate() if "_send_all" in each.name]


def copies():
    """Copies of this process that are at work."""
    return [child for child in multiprocessing.active_children() if child.name.startswith("ForkProcess")]


class Both:
    """Calls a function, in either process not before the other one calls it too: so both have a part.

    Made before there is a copy, for both have to know of it.
    """

    def __init__(self, function):
        self.function, self.called = function, False
        self.barrier = multiprocessing.get_context("fork").Barrier(2)

    def __call__(self, item):
        if not self.called:
            self.called = True
            self.barrier.wait(60.0)
        return self.function(item)


def where(item):
    """Who works on it."""
    time.sleep(0.02)
    return item, os.getpid()


@shared
def everything(function, items):
    return list(side_by_side(function, items))


@pytest.mark.parametrize("count", [0, 1, 2, 3, 10])
def test_results_come_in_order_and_from_both(count):
    found = everything(Both(where) if count > 1 else where, range(count))
    assert [item for item, _ in found] == list(range(count))
    workers = {worker for _, worker in found}
    assert os.getpid() in workers or not count
    assert len(workers) == min(count, 2)


def test_one_core_is_a_loop(monkeypatch):
    monkeypatch.setattr(module, "_cores", lambda: 1)
    assert {worker for _, worker in everything(where, range(4))} == {os.getpid()}


def test_outside_a_shared_function_it_is_a_loop():
    assert {worker for _, worker in side_by_side(where, range(4))} == {os.getpid()}


def test_a_closure_and_what_it_knows_need_not_be_pickled():
    known = np.arange(4.0), lambda value: value + 1.0
    assert everything(lambda k: known[1](known[0][k]), range(4)) == [1.0, 2.0, 3.0, 4.0]


def test_large_results_come_whole_both_ways():
    """Both processes go on with all results, and say the same of them."""

    large, read = Both(lambda k: np.full(500_000, k)), Both(lambda each: (os.getpid(), float(each.mean())))

    @shared
    def twice():
        return list(side_by_side(read, list(side_by_side(large, range(4)))))

    found = twice()
    assert [mean for _, mean in found] == [0.0, 1.0, 2.0, 3.0]
    assert len({worker for worker, _ in found}) == 2


def test_a_process_goes_on_while_its_results_wait_to_be_taken():
    begun = multiprocessing.get_context("fork").Event()

    def large(item):
        if item == 0:
            assert begun.wait(20.0), "the copy stood still with a result that nobody took yet"
        if item == 2:
            begun.set()
        return np.full(600_000, item)

    assert [float(each.mean()) for each in everything(large, range(3))] == [0.0, 1.0, 2.0]


def test_each_process_keeps_what_it_computed():
    known = {}

    def computed(item):
        if item not in known:
            known[item] = os.getpid()
        return known[item]

    turns = [Both(computed) for _ in range(5)]

    @shared
    def often():
        return [list(side_by_side(turn, range(2))) for turn in turns]

    first, *others = often()
    assert len(set(first)) == 2
    assert others == [first] * 4


def test_an_error_is_raised_in_its_turn_in_both():
    """Who catches it goes on in step."""

    def odd(item):
        time.sleep(0.02)
        if item == 3:
            raise ValueError("three")
        return item

    one, other = Both(odd), Both(where)

    @shared
    def caught():
        found = []
        with pytest.raises(ValueError, match="three"):
            found.extend(side_by_side(one, range(6)))
        return found, list(side_by_side(other, range(4)))

    found, after = caught()
    assert found == [0, 1, 2]
    assert len({worker for _, worker in after}) == 2


def test_what_cannot_be_sent_is_done_by_both():
    assert [each() for each in everything(Both(lambda k: lambda: k), range(5))] == list(range(5))


def test_a_copy_that_dies_is_done_without():
    here = os.getpid()

    def deadly(item):
        time.sleep(0.02)
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    both = Both(deadly)

    @shared
    def twice():
        return [list(side_by_side(both, range(5))), list(side_by_side(deadly, range(3)))]

    assert twice() == [list(range(5)), list(range(3))]


def test_a_copy_that_stands_still_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(module, "LONGEST_WAIT", 0.1)
    here = os.getpid()

    def slow(item):
        time.sleep(0.05 if os.getpid() == here else 1e4)
        return item

    assert everything(Both(slow), range(4)) == [0, 1, 2, 3]


def test_a_copy_that_goes_another_way_is_done_without():
    """Were its results taken, they would be those of other work."""

    @shared
    def astray():
        list(side_by_side(where, range(2)))
        other = ["other", "items"] if follows() else ["these", "items"]
        found = list(side_by_side(lambda item: (time.sleep(0.05), item.upper())[1], other))
        return found, list(side_by_side(where, range(4)))

    found, after = astray()
    assert found == ["THESE", "ITEMS"]
    assert {worker for _, worker in after} == {os.getpid()}


def test_where_no_copy_can_be_made_it_is_a_loop(monkeypatch):
    def full(*_):
        raise OSError("cannot allocate memory")

    monkeypatch.setattr(multiprocessing.get_context("fork").Process, "start", full)
    assert {worker for _, worker in everything(where, range(4))} == {os.getpid()}


def test_beyond_what_can_be_counted_it_is_a_loop(monkeypatch):
    monkeypatch.setattr(module, "MOST_ITEMS", 10)

    turns = [Both(where), Both(where), where]

    @shared
    def long():
        return [list(side_by_side(turn, range(5))) for turn in turns]

    assert [len({worker for _, worker in each}) for each in long()] == [2, 2, 1]


def test_who_stops_asking_goes_on_in_step():
    begun, turns = Both(where), [Both(where) for _ in range(3)]

    @shared
    def stopped():
        results = side_by_side(begun, range(100))
        first = next(results)
        results.close()
        return first, [list(side_by_side(turn, range(3))) for turn in turns]

    first, after = stopped()
    assert first[0] == 0
    assert [[item for item, _ in each] for each in after] == [[0, 1, 2]] * 3
    assert all(len({worker for _, worker in each}) == 2 for each in after)


def test_what_the_copy_did_ahead_is_taken_by_one_that_comes_late(monkeypatch):
    monkeypatch.setattr(module, "LONGEST_WAIT", 5.0)
    both = Both(where)

    @shared
    def late():
        list(side_by_side(both, range(2)))
        if not follows():
            time.sleep(0.5)
        return list(side_by_side(where, range(4)))

    found = late()
    assert [item for item, _ in found] == list(range(4))
    assert os.getpid() not in {worker for _, worker in found}


def test_work_within_the_turn_of_another_is_shared_too():
    @shared
    def interleaved():
        return [(item, list(side_by_side(where, "abc"))) for item, _ in side_by_side(where, range(4))]

    found = interleaved()
    assert [item for item, _ in found] == list(range(4))
    assert all([letter for letter, _ in inner] == ["a", "b", "c"] for _, inner in found)


def test_work_within_an_item_is_a_loop():
    def nested(item):
        return item, {worker for _, worker in side_by_side(where, range(3))}

    assert all(len(workers) == 1 for _, workers in everything(nested, range(4)))


def test_there_is_one_copy_at_a_time():
    @shared
    def outer():
        return everything(where, range(2)), second_core(), len(copies())

    _, another, count = outer()
    assert not another
    assert count == 1
    assert second_core()


def test_other_threads_work_alone():
    @shared
    def with_a_thread():
        found = []
        other = threading.Thread(target=lambda: found.extend(everything(where, range(4))))
        other.start()
        other.join()
        return found

    assert {worker for _, worker in with_a_thread()} == {os.getpid()}


def test_nothing_of_the_copy_is_seen(capfd):
    both = Both(where)

    @shared
    def loud():
        print("said", flush=True)
        os.write(2, b"written")
        return list(side_by_side(both, range(2)))

    loud()
    said = capfd.readouterr()
    assert said.out == "said\n"
    assert said.err == "written"


def test_what_a_shared_function_raises_stops_the_copy():
    @shared
    def failing(error):
        list(side_by_side(where, range(2)))
        raise error

    for error in (ValueError("it"), KeyboardInterrupt()):
        with pytest.raises(type(error)):
            failing(error)
        assert not copies()


def test_a_worker_of_joblib_makes_no_copies():
    """Whoever works on several recordings at once has no core left."""

    def alone():
        return second_core()

    assert Parallel(n_jobs=2, backend="loky")(delayed(alone)() for _ in range(2)) == [False, False]
    assert Parallel(n_jobs=2, backend="multiprocessing")(delayed(second_core)() for _ in range(2)) == [False, False]
