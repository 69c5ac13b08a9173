"""What a loop must satisfy as a whole: numbers for its parameters, signals that exist."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from vsctrl.checks import is_finite, quoted
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.document.applied import Applied
from vsctrl.diagram.document.units import TIME_UNITS, UNITS
from vsctrl.diagram.numerics.graphs import on_cycles
from vsctrl.errors import InputError, nearest
from vsctrl.problems import Problem, remedy, show


def value_problems(diagram: Wiring, values: Mapping[str, Any]) -> Iterator[Problem]:
    """Parameters without a number, numbers without a parameter."""
    for name in values:
        if name not in diagram.parameters:
            known = diagram.parameters
            hint = remedy(str(name), known) if known else "; they have none"
            yield f"parameters.{name}", f"no block uses it{hint}"
    for name in diagram.parameters:
        if name not in values:
            hint = nearest(name, [given for given in values if given not in diagram.parameters])
            yield f"parameters.{name}", f"missing; give it a number{hint}"
        elif not is_finite(values[name]):
            yield f"parameters.{name}", f"{show(values[name])} is not a finite number; give one"


def asked_problems(
    diagram: Wiring,
    opened: str,
    applied: tuple[Any, ...],
    watched: tuple[Any, ...],
    duration: float | None,
    time_unit: str,
) -> Iterator[Problem]:
    """What is asked of signals that there are not, or for no time."""
    if opened:
        try:
            if not isinstance(opened, str):
                raise InputError(f"{quoted(opened)} is no signal; give the name of one.")
            diagram.open(opened)
        except InputError as error:
            yield "open", str(error).removeprefix("open: ").rstrip(".")
    for number, one in enumerate(applied, start=1):
        if not isinstance(one, Applied):
            yield f"apply {number}", f"{show(one)} is not usable; give vs.Applied(input, kind, …)"
            continue
        for key, sentence in one.problems(diagram.inputs):
            yield f"apply {number}.{key}", sentence
    for name in watched:
        if name not in diagram.signals:
            yield "watch", f"there is no signal {show(name)}{remedy(str(name), diagram.signals)}"
    if duration is not None and not (is_finite(duration) and duration > 0):
        yield "duration", f"{show(duration)} s is no duration; give more than 0 s"
    if time_unit not in TIME_UNITS:
        hint = nearest(time_unit, TIME_UNITS)
        yield "time_unit", f"{show(time_unit)} is unknown{hint}; choose {', '.join(TIME_UNITS)}"


def unit_problems(units: Mapping[str, Any]) -> Iterator[Problem]:
    """Units that there are not."""
    for name, unit in units.items():
        if unit not in UNITS:
            hint = nearest(unit, UNITS)
            choice = f"{hint}; choose one of {', '.join(UNITS)}"
            yield f"parameters.{name}", f"unit {show(unit)} is unknown{choice}"


def sampling_problems(
    diagram: Wiring, period: Any, hold: Any, digital: Mapping[str, Any]
) -> Iterator[Problem]:
    """What a computer is to hold or to run and cannot, whatever the numbers are."""
    if period is None:
        if hold or digital:
            yield "sampling.period", "missing; give it, or leave hold and digital out"
        return
    if not isinstance(hold, str) or hold not in diagram.signals:
        what = f"there is no signal {show(hold)}" if hold else "missing; name the signal"
        yield "sampling.hold", f"{what}{remedy(str(hold), diagram.signals)}"
    blocks = [block.name for block in diagram.blocks]
    for name in digital:
        if name not in blocks:
            yield "sampling.digital", f"there is no block {show(name)}{remedy(str(name), blocks)}"


def in_a_loop(diagram: Wiring) -> list[str]:
    """The driven signals that a loop runs through, outputs of the diagram first."""
    place = {name: k for k, name in enumerate(diagram.signals)}
    edges = np.zeros((len(place), len(place)), bool)
    for part in diagram.parts:
        edges[[place[name] for name in part.inputs], place[part.output]] = True
    looped = on_cycles(edges)
    order = dict.fromkeys((*diagram.outputs, *diagram.drivers))
    return [name for name in order if looped[place[name]]]
