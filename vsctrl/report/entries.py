"""Which entry of a page a result becomes, by its type."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from vsctrl import checks as check
from vsctrl.diagram import Loop
from vsctrl.documents import load
from vsctrl.errors import InputError
from vsctrl.report.section import Entry
from vsctrl.servo import Scenario

Step = Callable[[str], None]


def entry_of(x: Any, name: str | None, prefix: str, progress: Step) -> Entry:
    """The entry of a result. Errors: `InputError` for what has no place on a page."""
    entry = _made(x, prefix, progress)
    return entry if name is None else replace(entry, name=name)


def _made(x: Any, prefix: str, progress: Step) -> Entry:
    if isinstance(x, str | Path):
        x = load(x)
    if isinstance(x, Scenario):
        from vsctrl.report.scenario_entry import scenario_entry

        return scenario_entry(x, prefix, progress)
    if isinstance(x, Loop):
        from vsctrl.report.loop_entry import loop_entry

        return loop_entry(x, prefix, progress)
    raise InputError(
        f"report: {check.quoted(x)} has no place on a page; give a scenario, as vs.load(FILE) "
        "reads it."
    )
