"""The response from rest, also of a channel that holds a derivative of its input."""

from __future__ import annotations

from dataclasses import replace

from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.checks import quoted, reals
from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.realisation import assembly, delay_system
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.signals.signal import Signal
from vsctrl.diagram.time import superposition
from vsctrl.errors import ImproperError, InputError
from vsctrl.symbols import s as symbol_s


def from_rest(
    loop: Numeric, source: str, target: str, signal: Signal, t: Array, side: str
) -> Array:
    """The response at times t (s), (len(t), 1)."""
    system, eased = _proper(loop, source, target, signal)
    return superposition.respond(system, eased, t, side)


def _proper(
    loop: Numeric, source: str, target: str, signal: Signal
) -> tuple[delay_system.DelaySystem, Signal]:
    """H u = (H/s) u′: where H is improper, u is differentiated and integrated again inside."""
    try:
        return assembly.realise(loop.diagram, loop.blocks, (source,), (target,)), signal
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


def check_signal(signal: object) -> None:
    """Refuse what is no signal, and one that holds symbols."""
    if not isinstance(signal, Signal):
        raise InputError(
            f"response: {quoted(signal)} is no signal; give a Step(…), Ramp(…), Parabola(…), "
            "Sine(…), Pulse(…), Samples(…) or a sum of these."
        )
    values = [value for _, primitive in signal.primitives for value in primitive.values]
    if any(hasattr(value, "free_symbols") for value in values):
        raise InputError(f"response: {quoted(signal)} holds symbols; give it numbers.")


def checked_times(t: ArrayLike) -> Array:
    """A list of finite times of 0 s or more."""
    times = reals(t)
    if times is None or times.ndim != 1 or not len(times) or times.min() < 0:
        raise InputError("response: t must be a list of finite times of 0 s or more.")
    return times
