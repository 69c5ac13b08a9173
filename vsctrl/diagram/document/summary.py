"""A loop in six lines: what it is, its numbers, where it is opened, what is asked of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.document.applied import Applied
from vsctrl.diagram.document.units import UNITS
from vsctrl.errors import cut

LONGEST = 160  #: characters of a line


def lines(diagram: Wiring, of: Mapping[str, Any]) -> str:
    """The lines about a loop, `of` its fields."""
    unit = of["time_unit"]
    blocks = sum(isinstance(part, Block) for part in diagram.parts)
    told = [
        of["name"] + (f": {of['description']}" if of["description"] else ""),
        f"{', '.join(diagram.inputs) or 'no inputs'} → {', '.join(diagram.outputs)}; "
        f"{counted(blocks, 'block')}, {counted(len(diagram.parts) - blocks, 'sum')}",
        "parameters: " + (", ".join(_parameter(of, name) for name in of["values"]) or "none"),
        f"L is broken at {of['opened']}" if of["opened"] else "no loop to be opened",
        "; ".join(_applied(one, unit) for one in of["applied"]) or "nothing is applied",
        f"watched: {', '.join(of['watched'])}"
        + (f", for {time(of['duration'], unit)}" if of["duration"] is not None else ""),
    ]
    if of["period"] is not None:
        digital = ", ".join(f"{name} by {method}" for name, method in of["digital"].items())
        told.append(
            f"sampled every {time(of['period'], unit)}, {of['hold']} held"
            + (f"; {digital}" if digital else "")
        )
    return "\n".join(cut(line, LONGEST) for line in told)


def time(seconds: float, unit: str) -> str:
    """A time in a unit."""
    return f"{seconds / float(UNITS[unit][1]):.6g} {unit}"


def counted(number: int, what: str) -> str:
    """1 block, 2 blocks."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def _parameter(of: Mapping[str, Any], name: str) -> str:
    unit, value = of["units"].get(name, ""), of["values"][name]
    shown = f"{value / float(UNITS[unit][1]):.6g} {unit}" if unit else f"{value:.6g}"
    return f"{name} = {shown}"


def _applied(one: Applied, unit: str) -> str:
    return f"{one.kind} of {one.size:g} at {one.input} from {time(one.at, unit)}"
