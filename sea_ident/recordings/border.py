"""The border between the project and the libraries behind the formats."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sea_ident.exceptions import RecordingError, SeaIdentError


@contextmanager
def errors_of_libraries(path: Path) -> Iterator[list[str]]:
    """Turn whatever a library makes of a damaged file into a RecordingError, and collect its warnings.

    The border is the one place where every exception is caught: the libraries behind the formats promise
    nothing about which ones a damaged file leads to.
    """
    found: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            yield found
        except SeaIdentError:
            raise
        except PermissionError as error:
            raise RecordingError(f"{path}: cannot be read: {error.strerror}") from error
        except Exception as error:
            what = " ".join(str(error).split())[:300] or "no further explanation"
            raise RecordingError(
                f"{path}: cannot be read as {path.suffix.lower() or 'a ROS 2 bag'}: "
                f"{type(error).__name__}: {what}. "
                "The file is damaged, cut off, or of another format than its name says"
            ) from error
    found += [f"{path}: {' '.join(str(item.message).split())[:300]}" for item in caught]
