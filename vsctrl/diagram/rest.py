"""The response from rest, also of a channel that holds a derivative of its input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vsctrl.diagram import delay, superpose
from vsctrl.diagram.blocks import Block
from vsctrl.diagram.numeric import Numeric
from vsctrl.diagram.signals import Signal
from vsctrl.errors import ImproperError
from vsctrl.symbols import s as symbol_s

Array = NDArray[np.float64]


def from_rest(
    loop: Numeric, source: str, target: str, signal: Signal, t: Array, side: str
) -> Array:
    """The response at times t (s), (len(t), 1)."""
    system, eased = _proper(loop, source, target, signal)
    return superpose.respond(system, eased, t, side)


def _proper(
    loop: Numeric, source: str, target: str, signal: Signal
) -> tuple[delay.DelaySystem, Signal]:
    """H u = (H/s) u′: where H is improper, u is differentiated and integrated again inside."""
    try:
        return delay.realise(loop.diagram, loop.blocks, (source,), (target,)), signal
    except ImproperError as refused:
        slope = signal.derivative()
        if slope is None:
            raise
        try:
            return _proper(_integrated(loop, source), f"{source}__slope", target, slope)
        except ImproperError:
            raise refused from None


def _integrated(loop: Numeric, source: str) -> Numeric:
    diagram, slope = loop.diagram, f"{source}__slope"
    part = Block(f"integral of {source}", 1 / symbol_s, f"{slope} -> {source}")
    inputs = [slope if name == source else name for name in diagram.inputs]
    longer = type(diagram)([part, *diagram.parts], inputs, diagram.outputs)
    return replace(loop, diagram=longer)
