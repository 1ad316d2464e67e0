"""Work that is done ahead of its turn by a second process, where there is a core for it."""

import multiprocessing
import os
import signal
import sys
import warnings
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from functools import cache
from multiprocessing.connection import Connection
from typing import Generic, TypeVar

from joblib import cpu_count

if sys.platform == "linux":
    import fcntl

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

ROOM = 1 << 20
"""Results that a second process may have sent before they are taken, all a Linux pipe holds [bytes]: one that is full
would keep it from going on until this process has finished what it does."""

LONGEST_WAIT = 60.0
"""Time after which what a second process has not answered is done here [s]: it may stand still for good, for it was
copied from a process whose other threads may have held a lock."""


def side_by_side(function: Callable[[_Item], _Result], items: Sequence[_Item]) -> Generator[_Result, None, None]:
    """Results of a function in the order of its items, worked on by this process and a copy of it.

    The results are those of a loop, with a second core or without. So the function must be pure: what it changes is
    not seen here where the copy did it. Nothing is begun before the first result is asked for; whoever stops asking
    (and closes the generator) stops the work.

    Args:
        function: of one item; a closure will do, for the copy knows all that is known here. Its results are pickled.
        items: what it is called with.

    Yields:
        One result for every item.

    Raises:
        Exception: whatever the function raises, when its turn comes.
    """
    if len(items) < 2 or not second_core():
        yield from map(function, items)
        return
    try:
        copy = _Copy(function, items)
    except OSError:  # no memory or no process left for it
        yield from map(function, items)
        return
    results: dict[int, _Result] = {}
    try:
        for k in range(len(items)):
            while k not in results:
                own = copy.next_item()
                if own is None:
                    # there is nothing left to begin: what is not here is with the copy, or was lost with it
                    if not copy.receive(results, LONGEST_WAIT):
                        results[k] = function(items[k])
                elif own == k:
                    results[k] = function(items[k])
                else:
                    with suppress(Exception):  # before its turn; then it is done again and raises what it has to
                        results[own] = function(items[own])
                    copy.receive(results)
            yield results.pop(k)
    finally:
        copy.stop()


def second_core() -> bool:
    """Whether there is a core for another process: the platform can copy one, and this is not one of several."""
    if _Copy.at_work:
        return False
    alone = multiprocessing.parent_process() is None and multiprocessing.current_process().name == "MainProcess"
    return sys.platform == "linux" and alone and _cores() > 1


@cache
def _cores() -> int:
    return int(cpu_count())


class _Copy(Generic[_Item, _Result]):
    """A copy of this process that works on the same items, each of which is begun by one of the two.

    Args:
        function: what is called.
        items: what it is called with.
    """

    at_work = 0
    """Copies that there are: one is enough."""

    def __init__(self, function: Callable[[_Item], _Result], items: Sequence[_Item]) -> None:
        context = multiprocessing.get_context("fork")
        self._receiver, sender = context.Pipe(duplex=False)
        with suppress(OSError):  # more than this user may have
            _widen(sender)
        self._count = len(items)
        self._begun = context.Value("i", 1)  # the first is for this process
        self._first = True
        task = (function, items, self._take, sender)
        self._process = context.Process(target=_work, args=task, daemon=True)
        with warnings.catch_warnings():
            # Python 3.12 warns where there are threads: the copy touches none of what they may hold, and is not waited
            # for without end
            warnings.simplefilter("ignore", DeprecationWarning)
            self._process.start()
        sender.close()
        _Copy.at_work += 1

    def next_item(self) -> int | None:
        """Position of the next item that this process is to begin, None where there is none."""
        first, self._first = self._first, False
        return 0 if first else self._take()

    def _take(self) -> int | None:
        with self._begun.get_lock():
            if self._begun.value >= self._count:
                return None
            self._begun.value += 1
            return int(self._begun.value) - 1

    def receive(self, results: dict[int, _Result], wait: float = 0.0) -> bool:
        """Take what the copy has done by now, the first after some time [s], and say whether there was anything."""
        received = False
        try:
            while self._receiver.poll(0.0 if received else wait):
                position, result = self._receiver.recv()
                results[position], received = result, True
        except Exception:  # whatever went wrong there: it is done again here, and raises what it has to
            return received
        return received

    def stop(self) -> None:
        """Stop the copy."""
        self._receiver.close()
        self._process.kill()
        self._process.join()
        self._process.close()
        _Copy.at_work -= 1


def _widen(sender: Connection) -> None:
    """Make room in the pipe for what is sent."""
    if sys.platform == "linux":
        fcntl.fcntl(sender.fileno(), fcntl.F_SETPIPE_SZ, ROOM)


def _work(
    function: Callable[[_Item], _Result],
    items: Sequence[_Item],
    next_item: Callable[[], int | None],
    sender: Connection,
) -> None:
    """Work on what is not begun yet and send the results, until one fails."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # what stops the whole program stops this by way of the other process
    try:
        while (position := next_item()) is not None:
            sender.send((position, function(items[position])))
    finally:
        os._exit(0)  # no output is to be flushed and nothing cleaned up: all that belongs to the other process
