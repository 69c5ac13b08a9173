"""A report of anything: what is added to it becomes an entry of its page and of its numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from vsctrl.errors import InputError
from vsctrl.files import as_path
from vsctrl.keywords import keywords
from vsctrl.report.data import ReportData
from vsctrl.report.entries import entry_of
from vsctrl.report.files import DATA, PAGE, PAPER, folder_for, write
from vsctrl.report.page import page, paper_page
from vsctrl.report.section import Entry
from vsctrl.report.together import together

Step = Callable[[str], None]
PYTHON = "vsctrl.write_report(…)"


@dataclass(frozen=True)
class Written:
    """A report that was written: its files, and what is on its page."""

    page: Path
    data: Path
    entries: tuple[Entry, ...]

    @property
    def kind(self) -> str | None:
        """The worst of the verdicts, "good", "warning" or "bad"; None where nothing is judged."""
        worst = [each for each in ("bad", "warning", "good") if each in self._kinds]
        return worst[0] if worst else None

    @property
    def _kinds(self) -> set[str | None]:
        return {entry.verdict.kind for entry in self.entries}

    @property
    def sentences(self) -> tuple[str, ...]:
        """The verdicts, one after the other."""
        return tuple(each for entry in self.entries for each in entry.verdict.sentences)


class Report:
    """A page that results are added to, ``vs.Report("two gains").add(slow).add(fast).write()``.

    `title`: of the page; left out it is made of what is on it.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> chart = loop.stability_chart(lam=(1, 25), tau=(0.02, 0.2), grid=(6, 4))
    >>> report = vs.Report("a chart").add(chart)
    """

    def __init__(self, title: str | None = None) -> None:
        if title is not None and not isinstance(title, str):
            raise InputError("title: give text, or leave it out.")
        self._title = title
        self._entries: list[Entry] = []

    @property
    def entries(self) -> tuple[Entry, ...]:
        """What was added, in order."""
        return tuple(self._entries)

    def add(self, x: Any, name: str | None = None, progress: Step = lambda step: None) -> Self:
        """Add a result under a name, or its own; it is examined now.

        `x`: whatever `write_report` takes. Errors: `InputError` for what has no place on a page.
        """
        self._entries.append(entry_of(x, name, f"e{len(self._entries) + 1}", progress))
        return self

    @property
    def title(self) -> str:
        """Of the page."""
        if self._title is not None:
            return self._title
        names = [entry.name for entry in self._entries]
        if len(names) == 1 and self._entries[0].kind == "scenario":
            return f"How far behind, how fast: {names[0]}"
        return ", ".join(names) or "An empty report"

    def html(self, command: str = PYTHON) -> str:
        """The text of the page. Errors: `InputError` where nothing was added."""
        self._check()
        paper = PAPER if any(entry.paper for entry in self._entries) else ""
        return page(self.title, self._entries, together(self._entries), command, paper)

    def paper_html(self, command: str = PYTHON) -> str:
        """The text of the page about the paper; empty where nothing added is from it."""
        return paper_page(self.title, self._entries, command, PAGE)

    def data(self) -> ReportData:
        """The numbers of the page. Errors: `InputError` where nothing was added."""
        self._check()
        return ReportData.of(self.title, self._entries)

    def write(self, out: str | Path = "report", *, command: str = PYTHON) -> Written:
        """Write ``index.html`` and ``report.json`` into a folder, all or none.

        ``paper.html`` is beside them where what was added is an experiment of the paper. The
        folder is made if need be, and an older report in it is replaced.
        Errors: `InputError` for a folder that cannot be written to, or one that holds another file
        of the same name, and where nothing was added.
        """
        self._check()
        folder = as_path("out", out)
        with folder_for(folder):
            pages = {PAGE: self.html(command), PAPER: self.paper_html(command)}
            texts = pages | {DATA: self.data().text()}
            write(folder, {name: text for name, text in texts.items() if text})
        return Written(folder / PAGE, folder / DATA, self.entries)

    def _check(self) -> None:
        if not self._entries:
            raise InputError("report: nothing was added; give it a scenario, a loop or a result.")


@keywords
def write_report(
    x: Any,
    out: str | Path = "report",
    *,
    title: str | None = None,
    command: str = PYTHON,
    progress: Step = lambda step: None,
) -> Written:
    """Examine a result, or several in a list or by name, and write a page and its numbers.

    `x`: a scenario (or the path of a file), a loop, a run, a comparison and the like; `title`: of
    the page; `command` is named in its footer; `progress` is told each step as it begins. Writes
    ``index.html`` and ``report.json`` into the folder `out`, which is made if need be; an older
    report in it is replaced.
    Errors: `InputError` for what cannot be reported, a folder that cannot be written to, or one
    that holds another file of the same name.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> from tempfile import mkdtemp
    >>> chart = loop.stability_chart(lam=(1, 25), tau=(0.02, 0.2), grid=(6, 4))
    >>> vs.write_report(chart, out=mkdtemp()).page.name
    'index.html'
    """
    named = list(x.items()) if isinstance(x, dict) else None
    several = [(None, each) for each in x] if isinstance(x, list | tuple) else named
    folder = as_path("out", out)
    with folder_for(folder):
        report = Report(title)
        for name, each in several if several is not None else [(None, x)]:
            report.add(each, name, progress)
        return report.write(folder, command=command)
