"""Files, whole or not at all: one way to read, one way to write, and what goes wrong in sentences.

What is written goes to a temporary name beside its path and is renamed, so that nobody ever finds
half a file and a failure leaves what was there before.
"""

import contextlib
import os
import shutil
import time
import uuid
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from vsctrl.errors import InputError, cut

Content = str | bytes

MOST = 16_000_000  #: bytes of a file that is read as a whole
MOST_TEXT = 4_000_000  #: bytes of one that a person may have written
PIECE = 1 << 20  #: bytes that are read at once
LONGEST_PATH = 1000  #: characters of a path in a sentence
TRIES, PAUSE = 500, 0.01  #: to wait for other writers, 5 s in all


def as_path(name: str, value: object) -> Path:
    """The path that somebody gave as text or as a Path. Raises InputError for anything else."""
    if not isinstance(value, str | os.PathLike):
        from vsctrl.checks import quoted  # NumPy with it: not where no value is refused

        raise InputError(f"{name}: {quoted(value)} is no path; give the name of a file or folder.")
    return Path(os.fsdecode(value))


@contextlib.contextmanager
def opened(path: Path, kind: str = "file") -> Iterator[BinaryIO]:
    """A file of that kind, as the remedy names it, to be read. Raises InputError.

    A pipe that nobody writes to is empty, instead of waiting for ever.
    """
    try:
        with open(path, "rb", opener=_not_waiting) as file:
            yield file
            return
    except FileNotFoundError:
        problem = "there is no such file; check the path"
    except IsADirectoryError:
        problem = f"this is a directory; name a {kind} in it"
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        problem = f"the file cannot be read ({reason(error)}); check the path and its permissions"
    raise InputError(f"{named(path)}: {problem}.")


def read_bytes(path: Path, kind: str = "file", most: int = MOST) -> bytes:
    """Content of a file of that kind, up to `most` bytes. Raises InputError."""
    with opened(path, kind) as file:
        content = bytearray()
        while piece := file.read(PIECE):
            content += piece
            if len(content) > most:
                raise InputError(
                    f"{named(path)}: this holds more than {most / 1e6:g} MB, "
                    f"which no {kind} does that vsctrl reads; name another one."
                )
    return bytes(content)


def read_text(path: Path, kind: str = "file", most: int = MOST_TEXT) -> str:
    """Text of a file in UTF-8, with or without a byte-order mark. Raises InputError."""
    try:
        return read_bytes(path, kind, most).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{named(path)}: byte {error.start} is not UTF-8; save the file as UTF-8 text."
        ) from None


def beginning(path: Path, size: int) -> bytes:
    """The first bytes of a file, at most `size` of them. Raises InputError."""
    with opened(path) as file:
        return file.read(size)


def write(path: Path, content: Content, what: str) -> None:
    """Write one file, all of it or nothing; what: that it holds, for the sentence.

    Text is written in UTF-8. Raises InputError when the file cannot be written.
    """
    try:
        write_all({path: content})
    except (OSError, ValueError) as error:
        raise InputError(
            f"{named(path)}: the {what} cannot be written ({reason(error)}); name a file in an "
            "existing directory where you may write."
        ) from None


def write_all(contents: Mapping[Path, Content]) -> None:
    """Write several files, all of them or none: what stood at their paths is put back if one fails.

    Of several writers at once the last one's files stay, never some of each. Text is written in
    UTF-8. Raises OSError, or ValueError for a path that no file can have, for the caller to say in
    its own sentence (``reason``).
    """
    waiting: dict[Path, Path] = {}
    before: dict[Path, Path | None] = {}
    try:
        for path, content in contents.items():
            waiting[path] = _temporary(path, content)
        with _alone({path.parent for path in waiting} if len(waiting) > 1 else ()):
            try:
                for path, temporary in waiting.items():
                    # The last rename is all or nothing by itself.
                    if len(before) < len(waiting) - 1:
                        before[path] = _kept(path)
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


def named(path: Path) -> str:
    """A path in a sentence, as it is unless no system would take one so long."""
    return text if len(text := str(path)) <= LONGEST_PATH else cut(text, LONGEST_PATH)


def reason(error: Exception) -> str:
    """What went wrong with a file, in the operating system's words."""
    return (isinstance(error, OSError) and error.strerror) or str(error)


def _not_waiting(path: str, flags: int) -> int:
    """Open a file without waiting for the other end of a pipe, then read it as any other."""
    nonblocking = getattr(os, "O_NONBLOCK", 0)
    number = os.open(path, flags | nonblocking)
    if nonblocking:
        os.set_blocking(number, True)
    return number


@contextlib.contextmanager
def _alone(folders: Iterable[Path]) -> Iterator[None]:
    """Keep other writers of vsctrl out of folders, where the system can lock one."""
    with contextlib.ExitStack() as held:
        for folder in sorted(folders):
            with contextlib.suppress(ImportError, OSError):
                import fcntl

                number = os.open(folder, os.O_RDONLY)
                held.callback(os.close, number)  # which gives the lock back
                for _ in range(TRIES):
                    with contextlib.suppress(BlockingIOError):
                        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
                        break
                    time.sleep(PAUSE)
        yield


def _kept(path: Path) -> Path | None:
    """What stands at a path under a second name, None where there is nothing."""
    if not path.exists():
        return None
    kept = _beside(path)
    try:
        os.link(path, kept, follow_symlinks=False)
    except (OSError, NotImplementedError):  # a file system without links
        shutil.copy2(path, kept, follow_symlinks=False)
    return kept


def _beside(path: Path) -> Path:
    return path.parent / f".vsctrl-{uuid.uuid4().hex}.tmp"


def _temporary(path: Path, content: Content) -> Path:
    """A file of that content beside the path, on the disk and not only on its way there."""
    temporary = _beside(path)
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
