"""Which entry of a page a result becomes, by its type."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from vsctrl import checks as check
from vsctrl.diagram import Diagram, Loop
from vsctrl.diagram.stability_chart.chart import StabilityChart
from vsctrl.diagram.system import System
from vsctrl.documents import load
from vsctrl.errors import InputError
from vsctrl.report.section import Entry
from vsctrl.servo import Run, Scenario
from vsctrl.study import Comparison, Remedies, SineResponse, Validation

Step = Callable[[str], None]


def entry_of(x: Any, name: str | None, prefix: str, progress: Step) -> Entry:
    """The entry of a result. Errors: `InputError` for what has no place on a page."""
    entry = _made(x, prefix, progress)
    return entry if name is None else replace(entry, name=name)


def _made(x: Any, prefix: str, progress: Step) -> Entry:
    if isinstance(x, str | Path):
        x = load(x)
    if isinstance(x, System) and isinstance(x.diagram, Diagram):
        x = Loop(x.diagram, x.values, name=", ".join(x.diagram.outputs) or "loop")
    if isinstance(x, Scenario):
        from vsctrl.report.scenario_entry import scenario_entry

        return scenario_entry(x, prefix, progress)
    if isinstance(x, Run):
        from vsctrl.report.scenario_entry import run_entry

        return run_entry(x, prefix, progress)
    if isinstance(x, Loop):
        from vsctrl.report.loop_entry import loop_entry

        return loop_entry(x, prefix, progress)
    if isinstance(x, Comparison | Validation | Remedies | StabilityChart | SineResponse):
        from vsctrl.report.result_entry import result_entry

        progress(f"a {type(x).__name__}")
        return result_entry(x, prefix)
    raise InputError(f"report: {check.quoted(x)} has no place on a page; {_wanted(x)}.")


def _wanted(x: Any) -> str:
    """What to give instead."""
    if isinstance(x, Diagram):
        return "give it numbers first, diagram.at(…)"
    return (
        "give a scenario or a loop (or the file of one), a system, a run, a comparison, remedies "
        "or a stability chart, or several in a list"
    )
