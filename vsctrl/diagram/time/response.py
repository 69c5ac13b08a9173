"""The response from rest, also of a channel that holds a derivative of its input."""

from __future__ import annotations

from dataclasses import replace

from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.checks import quoted, reals
from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.realisation import assembly, delay_system
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.signals.elementary import Step
from vsctrl.diagram.signals.signal import Signal
from vsctrl.diagram.time import superposition
from vsctrl.errors import ImproperError, InputError
from vsctrl.symbols import Expr
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
            return _proper(*_fed_through(1 / symbol_s, loop, source), target, slope)
        except ImproperError:
            raise refused from None


def impulse_system(loop: Numeric, source: str, target: str) -> delay_system.DelaySystem:
    """The system s H(s), whose step response is the impulse response of H.

    Errors: `ImproperError` where that holds impulses, as H lets some of its input through at once
    or delayed.
    """
    try:
        led, slope = _fed_through(symbol_s, loop, source)
        return assembly.realise(led.diagram, led.blocks, (slope,), (target,))
    except ImproperError:
        raise ImproperError(
            f"impulse: {quoted(target)} answers an impulse at {quoted(source)} with impulses, as "
            "some of its "
            "high frequencies pass, at once or delayed; ask for the step response, or filter it."
        ) from None


def impulse_response(loop: Numeric, source: str, target: str, t: Array, side: str) -> Array:
    """h(t) at times t (s), (len(t), 1). Errors: as `impulse_system`."""
    return superposition.respond(impulse_system(loop, source, target), Step(), t, side)


def _fed_through(factor: Expr, loop: Numeric, source: str) -> tuple[Numeric, str]:
    """The loop with one more block before an input, and the name of its input then."""
    diagram, name = loop.diagram, f"{source}__before"
    part = Block(f"before {source}", factor, f"{name} -> {source}")
    inputs = [name if known == source else known for known in diagram.inputs]
    longer = type(diagram)([part, *diagram.parts], inputs, diagram.outputs)
    return replace(loop, diagram=longer), name


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
