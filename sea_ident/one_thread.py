"""Linear algebra on one thread: the matrices here are small, and threads inside it would wait for each other."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import scipy.linalg  # noqa: F401 - its library, and that of numpy, must be loaded to be found
from threadpoolctl import ThreadpoolController

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")

_LIBRARIES = ThreadpoolController()


def one_thread(function: Callable[_Given, _Found]) -> Callable[_Given, _Found]:
    """A function that keeps the linear algebra of the process to one thread while it runs.

    It stands between the function and its caller: a warning for that one has a `stacklevel` one higher.
    """

    @wraps(function)
    def held(*args: _Given.args, **kwargs: _Given.kwargs) -> _Found:
        with _LIBRARIES.limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return held
