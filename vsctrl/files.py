"""Files, whole or not at all: one way to read, one way to write, and what goes wrong in sentences.

What is written goes to a temporary name beside its path and is renamed, so that nobody ever finds
half a file and a failure leaves what was there before.
"""

import contextlib
import os
import uuid
from collections.abc import Mapping
from pathlib import Path

from vsctrl.errors import InputError

Content = str | bytes


def as_path(name: str, value: object) -> Path:
    """The path that somebody gave as text or as a Path. Raises InputError for anything else."""
    if not isinstance(value, str | os.PathLike):
        from vsctrl.checks import quoted  # NumPy with it: not where no value is refused

        raise InputError(f"{name}: {quoted(value)} is no path; give the name of a file or folder.")
    return Path(os.fsdecode(value))


def read_bytes(path: Path, kind: str = "file") -> bytes:
    """Content of a file of that kind, as the remedy names it. Raises InputError."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        problem = "there is no such file; check the path"
    except IsADirectoryError:
        problem = f"this is a directory; name a {kind} in it"
    except (OSError, ValueError) as error:
        problem = f"the file cannot be read ({reason(error)}); check the path and its permissions"
    raise InputError(f"{path}: {problem}.")


def read_text(path: Path, kind: str = "file") -> str:
    """Text of a file in UTF-8, with or without a byte-order mark. Raises InputError."""
    try:
        return read_bytes(path, kind).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8 text."
        ) from None


def write(path: Path, content: Content, what: str) -> None:
    """Write one file, all of it or nothing; what: that it holds, for the sentence.

    Text is written in UTF-8. Raises InputError when the file cannot be written.
    """
    try:
        write_all({path: content})
    except (OSError, ValueError) as error:
        raise InputError(
            f"{path}: the {what} cannot be written ({reason(error)}); name a file in an "
            "existing directory where you may write."
        ) from None


def write_all(contents: Mapping[Path, Content]) -> None:
    """Write several files, all of them or none: what stood at their paths is put back if one fails.

    Text is written in UTF-8. Raises OSError, or ValueError for a path that no file can have, for
    the caller to say in its own sentence (``reason``).
    """
    waiting: dict[Path, Path] = {}
    before: dict[Path, Path | None] = {}
    try:
        for path, content in contents.items():
            waiting[path] = _temporary(path, content)
        for path, temporary in waiting.items():
            # The last rename is all or nothing by itself.
            if len(before) < len(waiting) - 1:
                before[path] = _temporary(path, path.read_bytes()) if path.exists() else None
            temporary.replace(path)
    except BaseException:
        for path, older in before.items():
            with contextlib.suppress(OSError):
                older.replace(path) if older else path.unlink(missing_ok=True)
        raise
    finally:
        for temporary in (*waiting.values(), *filter(None, before.values())):
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)


def reason(error: Exception) -> str:
    """What went wrong with a file, in the operating system's words."""
    return (isinstance(error, OSError) and error.strerror) or str(error)


def _temporary(path: Path, content: Content) -> Path:
    """A file of that content beside the path, on the disk and not only on its way there."""
    temporary = path.parent / f".vsctrl-{uuid.uuid4().hex}.tmp"
    try:
        with temporary.open("xb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
    except BaseException:
        with contextlib.suppress(OSError, ValueError):
            temporary.unlink()
        raise
    return temporary
