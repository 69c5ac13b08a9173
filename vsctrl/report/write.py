"""Writing a report: both files or neither, and never over a file that is not a report.

The folder is checked before anything is computed and the files are renamed into place at the end,
so that bad input or a full disk leaves nothing half-written behind.
"""

from __future__ import annotations

import contextlib
import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from vsctrl.errors import InputError
from vsctrl.files import MOST, as_path, beginning, read_text, write_all
from vsctrl.keywords import keywords
from vsctrl.report.data import SCHEMA, report_data
from vsctrl.report.page import GENERATOR, page
from vsctrl.report.verdict import verdict
from vsctrl.servo.scenario import GivenScenario, as_scenario
from vsctrl.study import LoopReport, examine

PAGE, DATA = "index.html", "report.json"


@dataclass(frozen=True)
class Report:
    """A written report: its files, the numbers behind them, and the first lines of its page.

    kind: of the verdict, "good", "warning" (the ways disagree) or "bad" (unstable, or failed).
    """

    page: Path
    data: Path
    result: LoopReport
    sentences: tuple[str, ...]
    kind: str


@keywords
def write_report(
    scenario: GivenScenario,
    out: str | Path = "report",
    *,
    command: str = "vsctrl.write_report(scenario)",
    progress: Callable[[str], None] = lambda step: None,
) -> Report:
    """Examine a scenario and write ``index.html`` and ``report.json`` into a folder.

    The folder is made if need be, and an older report in it is replaced. `command` is named in the
    page's footer; `progress` is told each step as it begins.
    Errors: `InputError` for a scenario that cannot be validated, a folder that cannot be written
    to, or one that holds another file of the same name.
    """
    scenario = as_scenario(scenario)
    folder, made = as_path("out", out), list[Path]()
    try:
        _prepare(folder, made)
        result = examine(scenario, progress)
        progress("page and figures")
        conclusion = verdict(result)
        data = report_data(result, conclusion).text()
        texts = {PAGE: page(result, conclusion, command), DATA: data}
        _write(folder, texts)
    except BaseException:
        _remove(made)
        raise
    return Report(folder / PAGE, folder / DATA, result, conclusion.sentences, conclusion.kind)


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
    for name, is_ours in ((PAGE, _is_our_page), (DATA, _is_our_data)):
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


def _write(folder: Path, texts: dict[str, str]) -> None:
    """Write all files or none."""
    try:
        folder.mkdir(parents=True, exist_ok=True)  # should another one have failed and removed it
        write_all({folder / name: text for name, text in texts.items()})
    except OSError as error:
        raise InputError(
            f"out: the report cannot be written to {folder} ({error.strerror}); free some space "
            "or name another folder with --out."
        ) from None
