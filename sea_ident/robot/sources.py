"""Where robots come from: files, shipped robots, example-robot-data."""

import re
from importlib import resources
from pathlib import Path

import pinocchio as pin

from sea_ident.exceptions import RobotError
from sea_ident.robot.xml import LARGEST_FILE

EXAMPLE_PREFIX = "example:"


def robots_folder() -> Path:
    """Folder of the robots that ship with sea_ident (inside the wheel, or beside the package in a checkout)."""
    package = Path(str(resources.files("sea_ident")))
    installed = package / "robots"
    return installed if installed.is_dir() else package.parent / "robots"


def _shipped() -> dict[str, bool]:
    """Names of the shipped files, and whether each is a robot (or else an annotation)."""
    files = sorted(robots_folder().glob("*/*.urdf"))
    return {path.stem: "<link" in path.read_text(encoding="utf-8") for path in files}


def shipped_robots() -> tuple[str, ...]:
    """Names under which `load_robot` finds the robots that ship with sea_ident."""
    return tuple(name for name, is_robot in _shipped().items() if is_robot)


def shipped_annotations() -> tuple[str, ...]:
    """Names under which `load_robot` finds the annotation fragments that ship with sea_ident."""
    return tuple(name for name, is_robot in _shipped().items() if not is_robot)


def example_robots_folder() -> Path:
    """Folder of example-robot-data's robots.

    Raises:
        RobotError: if example-robot-data is not installed.
    """
    # The pip package ships data only, under the prefix that its Pinocchio wheel lives in.
    for parent in Path(pin.__file__).resolve().parents:
        for prefix in (parent, parent / "cmeel.prefix"):
            folder = prefix / "share" / "example-robot-data" / "robots"
            if folder.is_dir():
                return folder
    raise RobotError("example-robot-data is not installed; run: pip install example-robot-data")


def _find_example(inner: str) -> Path:
    folder = example_robots_folder().resolve()
    path = (folder / inner).resolve()
    if not path.is_relative_to(folder):
        raise RobotError(f"{EXAMPLE_PREFIX}{inner} lies outside example-robot-data; give the path of the file itself")
    if path.is_file():
        return path
    known = sorted(str(p.relative_to(folder)) for p in folder.glob("*/**/*.urdf"))
    words = [word for word in re.split(r"[^a-z0-9]+", inner.lower()) if word not in ("", "urdf", "description")]
    alike = [name for name in known if any(word in name for word in words)]
    hint = f"it has {', '.join(alike)}" if alike else f"it has {len(known)} URDFs in {folder}"
    raise RobotError(f"example-robot-data has no file {inner!r}; {hint}")


def find_urdf(source: str | Path) -> Path:
    """The file that a robot source means.

    Args:
        source: path of a URDF, name of a shipped robot, or ``example:<path inside example-robot-data>``.

    Returns:
        Path of the file.

    Raises:
        RobotError: if there is no such file; the message lists what does exist.
    """
    text = str(source)
    try:
        if text.startswith(EXAMPLE_PREFIX):
            return _find_example(text.removeprefix(EXAMPLE_PREFIX))
        path = Path(text)
        if path.is_file():
            return path
        is_folder = path.is_dir() and text != ""
    except (OSError, ValueError) as error:  # names too long, with a zero byte, ...
        raise RobotError(f"{text[:200]!r} is not the name of a file: {error}") from None
    if re.fullmatch(r"[\w.-]+", text):
        shipped = list(robots_folder().glob(f"*/{text}.urdf"))
        if shipped:
            return shipped[0]
    if is_folder:
        files = sorted(str(p) for p in path.glob("*.urdf"))
        raise RobotError(f"{text!r} is a folder, not a URDF" + (f"; it holds {', '.join(files)}" if files else ""))
    raise RobotError(
        f"no file {text!r}, and no shipped robot of that name; shipped robots: {', '.join(shipped_robots())}; "
        f"shipped annotations: {', '.join(shipped_annotations())}"
    )


def read_text(path: Path) -> str:
    """Text of an XML file, in UTF-8 or in the encoding that it declares.

    Raises:
        RobotError: if it cannot be read, or is too large.
    """
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise RobotError(f"{path}: {size} bytes is too large for a URDF (at most {LARGEST_FILE})")
        data = path.read_bytes()
    except OSError as error:
        raise RobotError(f"{path}: cannot be read: {error}") from None
    declared = re.match(rb"\s*<\?xml[^>]*encoding=[\"']([A-Za-z0-9._-]+)[\"']", data)
    encodings = ["utf-8-sig"]
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encodings = ["utf-16"]
    elif declared:
        encodings.append(declared.group(1).decode("ascii"))
    for encoding in encodings:
        try:
            return data.decode(encoding)
        except (UnicodeDecodeError, LookupError):
            continue
    raise RobotError(f"{path}: is not text in {' or '.join(encodings)}; is it a URDF?")
