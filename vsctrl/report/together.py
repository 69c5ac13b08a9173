"""What several entries of a page have in common: the answers in one table, curves in one figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from vsctrl.errors import InputError, LimitError
from vsctrl.report import plots
from vsctrl.report.figures import figure
from vsctrl.report.section import Entry, Part, Section, Table
from vsctrl.report.wording import digits, length, listed, per_second, percent, seconds, time

STILL = 1e-3  #: of the mean distance, less of which is no swing
PREFIX = "together"  #: of the ids of figures that are about several entries


def together(entries: Sequence[Entry]) -> list[Section]:
    """Sections about all loops, and all scenarios, of a page; none where there is only one."""
    loops = [each for each in entries if each.kind == "loop"]
    scenarios = [
        each for each in entries if each.kind == "scenario" and getattr(each.source, "loop", None)
    ]
    sections = []
    if len(loops) > 1:
        sections.append(Section("loops", "The loops beside each other", _of_loops(loops)))
    if len(scenarios) > 1:
        title = "The scenarios beside each other"
        sections.append(Section("scenarios", title, _of_scenarios(scenarios)))
    return sections


# Loops -------------------------------------------------------------------------------------------
def _of_loops(entries: list[Entry]) -> list[Part]:
    parts: list[Part] = [_loop_table(entries)]
    names = [each.name for each in entries]
    loops = [each.source for each in entries]
    opened = [_opened(loop) for loop in loops]
    if None not in opened:
        parts.append(figure(plots.bode(*opened, names=names), PREFIX, "bode"))
        parts.append(figure(plots.nyquist(*opened, names=names), PREFIX, "nyquist"))
    steps = [_first_step(loop) for loop in loops]
    if None not in steps:
        last = max(loop.horizon for loop in loops)
        drawn: Any = plots.step(*steps, t=last, names=names)
        plots.in_unit(drawn, loops[0].time_unit)
        drawn.alt = f"Step responses of {listed(names)}."
        parts.append(figure(drawn, PREFIX, "step"))
    return parts


def _opened(loop: Any) -> Any:
    """L as the loop runs; None where no loop runs through any signal."""
    if loop.sampled is not None and loop.hold not in loop.diagram.inputs:
        return loop.sampled.open()
    return loop.open if loop.opened else None


def _first_step(loop: Any) -> Any:
    """The channel from the first input that gets a step to the first signal that is watched."""
    inputs = [one.input for one in loop.applied if one.kind == "step"]
    if not inputs or not loop.watched:
        return None
    return loop.channel(inputs[0], loop.watched[0])


def _loop_table(entries: list[Entry]) -> Table:
    rows = []
    for each in entries:
        loop = each.source
        margins = each.data["sampled_margins"] or each.data["margins"] or {}
        unit = loop.time_unit
        info = _step_info(loop)
        rows.append(
            (
                each.name,
                each.verdict.word,
                _or_dash(margins.get("gain"), lambda value: f"× {digits(value, 4)}"),
                _or_dash(margins.get("phase"), lambda value: f"{digits(math.degrees(value), 4)}°"),
                _or_dash(margins.get("delay"), lambda value, unit=unit: time(value, unit)),
                _or_dash(margins.get("peak_sensitivity"), lambda value: digits(value, 4)),
                "–" if info is None else time(info.settling_time, unit),
                "–" if info is None or info.overshoot is None else percent(info.overshoot),
            )
        )
    heads = ("", "verdict", "gain margin", "phase", "delay", "Ms", "settling 2 %", "overshoot")
    held = [each.name for each in entries if each.source.sampled is not None]
    remarks = [f"As sampled: {listed(held)}."] if held else []
    return Table(heads, rows, "Loops", left=2, remarks=remarks)


def _step_info(loop: Any) -> Any:
    channel = _first_step(loop)
    try:
        info = None if channel is None else loop.step_info(channel.source, channel.target)
    except (InputError, LimitError):
        return None
    return info if info is not None and math.isfinite(info.settling_time) else None


def _or_dash(value: float | None, shown: Any) -> str:
    return "no limit" if value is None else str(shown(value))


# Scenarios ---------------------------------------------------------------------------------------
def _of_scenarios(entries: list[Entry]) -> list[Part]:
    rows = []
    for each in entries:
        x = each.source
        constant = None if x.advice is None else x.advice.constant
        last = x.last
        side = "" if not last.along_motion else " behind" if last.mean < 0 else " ahead"
        swings = last.half_range > STILL * abs(last.mean)
        swing = f" ± {length(last.half_range)}" if swings else ""
        where = f"{length(abs(last.mean))}{swing}{side}"
        rows.append(
            (
                each.name,
                "stable" if x.loop.is_stable else "unstable",
                per_second(x.loop.elements.lam),
                per_second(x.loop.gain_limit) if math.isfinite(x.loop.gain_limit) else "no limit",
                "–" if constant is None else seconds(constant),
                where if x.run.status.complete else f"ends at {x.run.t[-1]:g} s",
            )
        )
    heads = ("", "loop", "λ", "stable up to", "errors fall to 1/e in", "last quarter of the run")
    names = [each.name for each in entries]
    drawn = plots.distances([each.source.run for each in entries], names)
    return [Table(heads, rows, "Scenarios", left=2), figure(drawn, PREFIX, "distances")]
