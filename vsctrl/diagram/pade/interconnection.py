"""A diagram with numbers as subsystems of python-control, joined by the names of its signals.

Each block is a `control.StateSpace` of its own, its delays replaced by Padé models, each sum a
summing junction, so that what is read and plotted there has the diagram's names.
"""

from __future__ import annotations

import re
import warnings
from typing import Any

import control

from vsctrl.checks import quoted
from vsctrl.diagram.description.blocks import Block, Part
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.pade.order import model
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.symbolic.model import Model
from vsctrl.errors import ImproperError, InputError


def interconnection(system: Numeric, order: Any, name: str) -> Any:
    """The diagram as one `control.StateSpace` that remembers its subsystems.

    Errors: `InputError` for a block that differentiates, which no state space does, and for delays
    without an order.
    """
    late = sorted({block.name for block in system.blocks if any(block.delays)})
    if late and order is None:
        raise InputError(
            f"to_control: block {quoted(late[0])} holds a delay, and python-control has rational "
            "systems "
            "only; give the order of its Padé models, as pade=6."
        )
    taken: set[str] = set()
    subsystems = [_subsystem(part, system, order, taken) for part in system.diagram.parts]
    diagram = system.diagram
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Unused (input|output)", UserWarning)
        return control.interconnect(
            subsystems,
            inputs=list(diagram.inputs),
            outputs=list(diagram.outputs),
            name=_own(name or "diagram", taken),
        )


def _subsystem(part: Part, system: Numeric, order: Any, taken: set[str]) -> Any:
    if not isinstance(part, Block):
        signs = [("-" if sign < 0 else "") + signal for sign, signal in part.terms]
        return control.summing_junction(signs, part.output, name=_own(f"sum {part.output}", taken))
    alone = Model([Block(part.name, part.expr, "u -> y")])
    numeric = Numeric(alone, {key: system.values[key] for key in alone.parameters})
    names = {"inputs": part.input, "outputs": part.output, "name": _own(part.name, taken)}
    late = any(tau for block in numeric.blocks for tau in block.delays)
    try:
        found = model(NumericChannel(numeric, "u", "y"), order if late else 1, None, None)
    except ImproperError:
        raise InputError(
            f"to_control: block {quoted(part.name)} differentiates its input, which no state "
            "space does; "
            "let it roll off, like s/(s/N + 1)."
        ) from None
    return control.ss(found.A, found.B, found.C, found.D, **names)


def _own(name: str, taken: set[str]) -> str:
    """A name that python-control can take apart from a signal's: letters, digits and _."""
    plain = own = re.sub(r"\W+", "_", name).strip("_") or "block"
    number = 2
    while own in taken:
        own, number = f"{plain}_{number}", number + 1
    taken.add(own)
    return own
