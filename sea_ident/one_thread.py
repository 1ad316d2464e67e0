"""Linear algebra on one thread.

The matrices here are small, and threads inside it would wait for each other. A copy of this process has none of the
threads of OpenMP, and would wait for them without end where it is told to use several.
"""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import proxsuite  # noqa: F401 - it brings OpenMP, which must be loaded to be found
import scipy.linalg  # noqa: F401 - as must its library, and that of numpy
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
        with _LIBRARIES.limit(limits=1):
            return function(*args, **kwargs)

    return held
