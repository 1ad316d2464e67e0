"""Long work shared with a second process that takes the same steps, where there is a core for it.

The second process is a copy of the first and runs the same function on the same arguments. So it knows all that the
first one knows, whatever was computed once it keeps, and nothing but results is sent. Only the first one answers.
"""

import multiprocessing
import os
import pickle
import signal
import struct
import sys
import warnings
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from contextvars import ContextVar
from functools import cache, wraps
from mmap import mmap
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from typing import ParamSpec, TypeVar
from zlib import crc32

from joblib import cpu_count

_Given = ParamSpec("_Given")
_Answer = TypeVar("_Answer")
_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

MOST_ITEMS = 1 << 20
"""Items of one piece of work that are shared; those beyond are done by both processes."""

LONGEST_WAIT = 60.0
"""Time after which what the second process has not answered is done without it [s]: it may stand still for good, for it
was copied from a process whose other threads may have held a lock."""

_HEAD = struct.Struct("<qI?")
"""Number of an item, the sign of the steps up to there, whether a result follows."""


def shared(function: Callable[_Given, _Answer]) -> Callable[_Given, _Answer]:
    """A function whose `side_by_side` work is done by this process and a copy of it, to the same answer.

    The copy runs all of the function. What is between the shared items is done by both, and must go the same way in
    both; where it does not, the copy is done without. What the copy writes to the screen is dropped; whatever else
    reaches beyond the function has to ask whether it `follows`.

    It stands between the function and its caller: a warning for that one has a `stacklevel` one higher.
    """

    @wraps(function)
    def run(*args: _Given.args, **kwargs: _Given.kwargs) -> _Answer:
        if not second_core():
            return function(*args, **kwargs)
        try:
            pair = _Pair.begun(lambda: function(*args, **kwargs))
        except OSError:  # no memory or no process left for it
            return function(*args, **kwargs)
        token = _PAIR.set(pair)
        try:
            return function(*args, **kwargs)
        finally:
            _PAIR.reset(token)
            pair.stop()

    return run


def side_by_side(function: Callable[[_Item], _Result], items: Sequence[_Item]) -> Generator[_Result, None, None]:
    """Results of a function in the order of its items; the two processes of a `shared` function do a part of them each.

    The results are those of a loop, and outside such a function it is one. So the function must be pure: what it
    changes is not seen where the other process did it. Nothing is begun before the first result is asked for.

    Args:
        function: of one item; a closure will do. Its results are pickled.
        items: what it is called with.

    Yields:
        One result for every item.

    Raises:
        Exception: whatever the function raises, when its turn comes.
    """
    pair = _PAIR.get()
    if pair is None or len(items) < 2 or not pair.takes(len(items)):
        yield from map(function, items)
    else:
        yield from pair.results(function, items)


def second_core() -> bool:
    """Whether there is a core for another process: the platform can copy one, and this is not one of several."""
    if _Pair.at_work:
        return False
    alone = multiprocessing.parent_process() is None and multiprocessing.current_process().name == "MainProcess"
    return sys.platform == "linux" and alone and _cores() > 1


def follows() -> bool:
    """Whether this is the copy, whose answer nobody hears."""
    pair = _PAIR.get()
    return pair is not None and pair.copy


@cache
def _cores() -> int:
    return int(cpu_count())


class _Pair:
    """One of two processes that take the same steps, and its way to the other.

    Args:
        connection: to the other one.
        claims: shared bytes, one for every item that either of the two has begun.
        process: the copy; None in the copy itself.
    """

    at_work = 0
    """Pairs that there are: one is enough."""

    def __init__(
        self, connection: Connection, claims: mmap, process: multiprocessing.process.BaseProcess | None
    ) -> None:
        self._connection, self._claims, self._process = connection, claims, process
        self._next = self._sign = 0
        self._busy = self._lost = False
        self._wanted: list[range] = []
        self._received: dict[int, tuple[int, bytes | None]] = {}
        self._outgoing: SimpleQueue[bytes | None] = SimpleQueue()
        # a pipe that is full must not keep a process from going on
        self._sender = Thread(target=self._send_all, daemon=True)
        self._sender.start()
        _Pair.at_work += 1

    @classmethod
    def begun(cls, work: Callable[[], object]) -> "_Pair":
        """This process beside a copy of it that does the same work.

        Raises:
            OSError: there can be no copy.
        """
        context = multiprocessing.get_context("fork")
        here, there = context.Pipe()
        claims = mmap(-1, MOST_ITEMS)
        process = context.Process(target=_follow, args=(work, here, there, claims), daemon=True)
        with warnings.catch_warnings():
            # Python 3.12 warns where there are threads: the copy touches none of what they may hold, and is not waited
            # for without end
            warnings.simplefilter("ignore", DeprecationWarning)
            process.start()
        there.close()
        return cls(here, claims, process)

    @property
    def copy(self) -> bool:
        """Whether this is the copy."""
        return self._process is None

    def takes(self, count: int) -> bool:
        """Whether so many items can be shared: not within one that is, and not without the other process."""
        return not self._busy and not self._lost and self._next + count <= MOST_ITEMS

    def results(self, function: Callable[[_Item], _Result], items: Sequence[_Item]) -> Generator[_Result, None, None]:
        """The results of a function in the order of its items, with those of the other process."""
        numbers = range(self._next, self._next + len(items))
        self._next = numbers.stop
        steps = getattr(function, "__qualname__", type(function).__qualname__), len(items), *map(_about, items)
        sign = self._sign = crc32(repr(steps).encode(), self._sign)
        # the first is asked for first: it is begun by the process that answers
        order = [*numbers] if not self.copy else [*numbers[1:], numbers[0]]
        found: dict[int, _Result] = {}
        failed: set[int] = set()
        self._wanted.append(numbers)
        try:
            for number, item in zip(numbers, items, strict=True):
                while number not in found:
                    self._receive(0.0)
                    self._take(numbers, sign, found, failed)
                    if number in found:
                        break
                    if number in failed or self._lost:
                        found[number] = self._done(function, item)
                        break
                    own = next((each for each in order if not self._claims[each]), None)
                    if own is None:
                        self._receive(None if self.copy else LONGEST_WAIT)
                        continue
                    self._claims[own] = 1
                    try:
                        found[own] = self._done(function, items[own - numbers.start])
                    except Exception:  # the other one has to see it too; here it is raised in its turn
                        failed.add(own)
                        self._send(own, sign)
                    else:
                        self._send(own, sign, found[own])
                yield found.pop(number)
        finally:
            self._wanted.remove(numbers)

    def _done(self, function: Callable[[_Item], _Result], item: _Item) -> _Result:
        self._busy = True
        try:
            return function(item)
        finally:
            self._busy = False

    def _take(self, numbers: range, sign: int, found: dict[int, _Result], failed: set[int]) -> None:
        """Take what the other process has sent of some items; what it could not do or send is to be done here."""
        for number in [each for each in self._received if each in numbers]:
            signed, payload = self._received.pop(number)
            if signed != sign:
                self._received.clear()
                self._go_alone()
                return
            if payload is None:
                failed.add(number)
            elif number not in found:
                found[number] = pickle.loads(payload)

    def _receive(self, wait: float | None) -> None:
        """Receive what the other process has sent, and wait for something [s]; None for as long as it takes."""
        if self._lost:
            return
        try:
            waited = self._connection.poll(wait)
            while self._connection.poll(0.0):
                message = self._connection.recv_bytes()
                number, sign, whole = _HEAD.unpack_from(message)
                if number >= self._next or any(number in each for each in self._wanted):
                    self._received[number] = sign, message[_HEAD.size :] if whole else None
        except (OSError, EOFError):
            self._go_alone()
        else:
            if not waited and wait != 0.0:
                self._go_alone()

    def _send(self, number: int, sign: int, *result: object) -> None:
        payload = b""
        if result:
            try:
                payload = pickle.dumps(result[0], pickle.HIGHEST_PROTOCOL)
            except Exception:  # what cannot be sent is done by the other one too
                result = ()
        self._outgoing.put(_HEAD.pack(number, sign, bool(result)) + payload)

    def _send_all(self) -> None:
        with suppress(OSError):
            while (message := self._outgoing.get()) is not None:
                self._connection.send_bytes(message)

    def _go_alone(self) -> None:
        """Go on without the other process: it is gone, stands still, or goes another way."""
        self._lost = True
        if self._process is None:
            os._exit(0)
        self._process.kill()

    def finish(self) -> None:
        """Wait until all is sent."""
        self._outgoing.put(None)
        self._sender.join()

    def stop(self) -> None:
        """Stop the copy."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process.close()
        self.finish()
        self._connection.close()
        self._claims.close()
        _Pair.at_work -= 1


_PAIR: ContextVar[_Pair | None] = ContextVar("pair", default=None)
"""The pair whose work is done here; other threads have none."""


def _follow(work: Callable[[], object], here: Connection, there: Connection, claims: mmap) -> None:
    """Take the same steps as the process that this is a copy of."""
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # what stops the whole program stops this by way of the other one
        here.close()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115 - as long as the process lives
        pair = _Pair(there, claims, None)
        _PAIR.set(pair)
        work()
        pair.finish()
    finally:
        os._exit(0)  # no output is to be flushed and nothing cleaned up: all that belongs to the other process


def _about(item: object) -> object:
    """What an item is about, in a word: by that two processes know whether they are at the same step."""
    if isinstance(item, (int, str)):
        return item
    if isinstance(item, (tuple, list)):
        return tuple(_about(each) for each in item)
    effect = getattr(item, "effect", item)
    return type(item).__name__, str(getattr(effect, "name", "")), str(getattr(effect, "joint", ""))
