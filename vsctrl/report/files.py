"""The files of a report: all or none, and never over a file that is not a report.

The folder is checked before anything is computed and the files are renamed into place at the end,
so that bad input or a full disk leaves nothing half-written behind.
"""

from __future__ import annotations

import contextlib
import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vsctrl.errors import InputError
from vsctrl.files import MOST, beginning, read_text, write_all
from vsctrl.report.data import SCHEMA
from vsctrl.report.page import GENERATOR

PAGE, DATA, PAPER = "index.html", "report.json", "paper.html"


@contextmanager
def folder_for(folder: Path) -> Iterator[None]:
    """A folder made, if need be, for what is done within; taken back where that fails."""
    made: list[Path] = []
    try:
        _prepare(folder, made)
        yield
    except BaseException:
        _remove(made)
        raise


def _prepare(folder: Path, made: list[Path]) -> None:
    """Make the folder and look at what is in it; `made` gets what was made, innermost first."""
    try:
        missing = [path for path in (folder, *folder.parents) if not path.exists()]
        if not missing and not folder.is_dir():
            raise InputError(f"out: {folder} is a file, not a folder; name another with --out.")
        for path in reversed(missing):
            made.insert(0, path)  # before it is there, so that it goes whenever this is ended
            try:
                path.mkdir()
            except FileExistsError:  # another report is being written there
                made.remove(path)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"out: the folder {folder} cannot be written to ({error.strerror}); "
            "name another with --out."
        ) from None
    for name, is_ours in ((PAGE, _is_our_page), (PAPER, _is_our_page), (DATA, _is_our_data)):
        path = folder / name
        if path.exists() and not is_ours(path):
            raise InputError(
                f"out: {path} exists and is no report of vsctrl; move it away or name another "
                "folder with --out."
            )


def _is_our_page(path: Path) -> bool:
    try:
        head = beginning(path, 2000)
    except InputError:
        return False
    return f'<meta name="generator" content="{GENERATOR} '.encode() in head


def _is_our_data(path: Path) -> bool:
    try:
        content = json.loads(read_text(path, "report", MOST))
    except (ValueError, RecursionError):  # of the file, its text, or JSON
        return False
    kind = SCHEMA.partition("/")[0]
    return isinstance(content, dict) and str(content.get("schema", "")).startswith(f"{kind}/")


def _remove(made: list[Path]) -> None:
    """Take back the folders that were made, unless somebody has put something into them."""
    for path in made:
        with contextlib.suppress(OSError):
            path.rmdir()


def write(folder: Path, texts: dict[str, str]) -> None:
    """Write all files or none, and take away what an older report leaves that this one has not."""
    try:
        folder.mkdir(parents=True, exist_ok=True)  # should another one have failed and removed it
        write_all({folder / name: text for name, text in texts.items()})
        if PAPER not in texts and _is_our_page(folder / PAPER):
            (folder / PAPER).unlink()
    except OSError as error:
        raise InputError(
            f"out: the report cannot be written to {folder} ({error.strerror}); free some space "
            "or name another folder with --out."
        ) from None
