"""A page that holds explorers only, as a report would, and is made in a moment."""

from functools import cache
from pathlib import Path

import vsctrl as vs
from vsctrl.diagram import Loop
from vsctrl.report.explorer.explorer import explorer, figure_1_explorer
from vsctrl.report.page import page
from vsctrl.report.section import Entry, Section, Verdict

EXAMPLES = Path(vs.__file__).parent / "examples"


def of_figure_1(scenario: vs.Scenario) -> str:
    """The page of the explorer that a scenario of figure 1 gets."""
    part = figure_1_explorer(vs.loop.of(scenario), scenario.law.placement, "e1-explorer")
    return _page(scenario.name, part)


def of_loop(loop: Loop) -> str:
    """The page of the explorer that a loop gets."""
    return _page(loop.name, explorer(loop, "e1-explorer"))


@cache
def example(name: str) -> Loop:
    """A loop that `vsctrl new` prints."""
    return Loop.load(EXAMPLES / f"{name}.toml")


def _page(name: str, part) -> str:
    sections = [Section("move", "Move its numbers", [part])]
    verdict = Verdict(None, ("An explorer.",))
    return page(name, [Entry("loop", name, "", verdict, sections, {})], (), "a test", "")
