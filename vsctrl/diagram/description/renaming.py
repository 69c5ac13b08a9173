"""A diagram inside another: its signals renamed, its parts put in, its picture one box."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from vsctrl.checks import quoted
from vsctrl.diagram.description.blocks import Block, Subdiagram, signal_name
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.errors import InputError, nearest

M = TypeVar("M", bound=Wiring)


def subdiagram(
    diagram: Wiring, transfer: Callable[[str, str], Any], name: str, wiring: str
) -> Subdiagram:
    """The diagram as a block; its first input and first output become those of the wiring.

    `transfer` gives its transfer function from an input to a signal.
    """
    if not diagram.inputs or not diagram.outputs:
        raise InputError(
            f"block: the diagram has inputs {', '.join(diagram.inputs) or 'none'} and outputs "
            f"{', '.join(diagram.outputs) or 'none'}; a block needs one of each."
        )
    source, target = diagram.inputs[0], diagram.outputs[0]
    outer = Block(name, 1, wiring)
    inside = renamed(diagram, {source: outer.input, target: outer.output}, name)
    names = dict(zip(inside.signals, diagram.signals, strict=True))
    further = {outer: names[outer] for outer in (*inside.inputs[1:], *inside.outputs[1:])}
    return Subdiagram(
        name, transfer(source, target), wiring, parts=inside.parts, inner_names=further
    )


def renamed(diagram: M, signals: Mapping[str, str], name: str = "") -> M:
    """The diagram with other signal names; what is not named gets `name` in front."""
    if not isinstance(signals, Mapping):
        raise InputError(f'renamed: {quoted(signals)} maps no signals; write {{"old": "new"}}.')
    for signal in signals:
        if signal not in diagram.signals:
            raise InputError(
                f"renamed: there is no signal {quoted(signal)}{nearest(signal, diagram.signals)}; "
                f"the diagram has {', '.join(diagram.signals)}."
            )
        signal_name(str(signals[signal]), f"renamed: {signal}")
    front = re.sub(r"\W", "_", name) + "_" if name else ""
    new = {signal: signals.get(signal, front + signal) for signal in diagram.signals}
    if len(set(new.values())) < len(new):
        taken = sorted(n for n in new.values() if list(new.values()).count(n) > 1)
        raise InputError(
            f"renamed: {quoted(taken[0])} would be two signals; give each a name of its own."
        )
    parts = []
    for part in diagram.parts:
        moved = part.rewired(new, new)
        if isinstance(moved, Block) and name:
            moved = replace(moved, name=f"{name}: {moved.name}")
        parts.append(moved)
    return type(diagram)(parts, [new[n] for n in diagram.inputs], [new[n] for n in diagram.outputs])
