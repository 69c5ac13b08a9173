"""Responses that do not start from rest: what the signals were at t ≤ 0, and what it still does.

The past is carried on beyond 0 as simply as can be: what has a past of its own, an input or a block
with dynamics, keeps the value it had at 0, and gains, delays and sums make of that, and of the past
that delays bring back, what they make of anything. Only inputs and blocks with dynamics then differ
from what they would have to be fed for this to be so. By linearity the response is this
continuation, plus that of the diagram from rest to all those differences.

A block y = num(s)/den(s) u with dynamics stands for den ξ = u, y = num ξ. With a constant past y₀
it was in steady state, ξ₀ = y₀/num(0), and would have to be fed u₀ = den(0) ξ₀ for ever. One that
passes no constant, num(0) = 0, was in steady state with what it was fed. With a past φ(t) and
num = b its ξ is φ/b; the slopes φ′(0), φ″(0), … that a value kept leaves out add the free motion

    L⁻¹{ Σ_k d_k Σ_{1≤j<k} s^{k−1−j} φ⁽ʲ⁾(0) / den(s) },    den = Σ_k d_k s^k.

The stepper of `collocation` is not begun with x(0) and z(t < 0) instead: its states are not the ξ
of the blocks. `descriptor` eliminates those that are tied to inputs, shifts others by derivatives
of u and w and adds channels of derivatives; the rest is pruned and rescaled. All of that would have
to map initial data too. The stepper also has one input, and breaking points that begin with it, not
at each kink of a past, nor at 0 in every channel, where past and solution need not join.

Bellman and Cooke, Differential-Difference Equations, Academic Press 1963, ch. 3 and 6.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np

from vsctrl.arrays import Array
from vsctrl.checks import quoted
from vsctrl.diagram.description.blocks import Block, Part, Sum
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.signals.elementary import Step
from vsctrl.diagram.signals.signal import Signal
from vsctrl.diagram.time.initial_data import DynamicBlock, InitialData, at_zero, checked
from vsctrl.diagram.time.response import from_rest
from vsctrl.errors import ImproperError, InputError
from vsctrl.symbols import s


def respond(
    loop: Numeric, source: str, target: str, signal: Signal, history: object, t: Array, side: str
) -> tuple[Array, float]:
    """The response of a channel at times t ≥ 0 (s), (len(t), 1), and what its source was at 0−.

    `history` maps names of signals to a number or a function of t ≤ 0.
    Errors: `InputError` where the past is not usable, `LimitError` as the response from rest.
    """
    diagram = loop.diagram
    past = InitialData(diagram, loop.blocks, checked(history, diagram), target)
    pushes = [push for block in past.dynamic_blocks.values() for push in _pushes(past, block)]
    y = past.carried_on(target, t, side)
    y = y + from_rest(loop, source, target, signal - Step(past.value_at_zero(source)), t, side)
    for name in diagram.inputs:
        if name != source and past.value_at_zero(name):
            y = y + from_rest(loop, name, target, Step(-past.value_at_zero(name)), t, side)
    for push, entry, parts in pushes:
        longer = type(diagram)(parts, (*diagram.inputs, entry), diagram.outputs)
        try:
            y = y + from_rest(replace(loop, diagram=longer), entry, target, push, t, side)
        except ImproperError:
            raise InputError(
                f"response: with this history {quoted(entry.rpartition('__')[0])} jumps at t = 0, "
                f"and {quoted(target)} holds a derivative of it, an impulse; give its block a "
                "past that goes with what it is fed, or ask for another signal."
            ) from None
    before = past.carried_on(source, np.zeros(1), "left")
    return y, float(before[0, 0])


def _pushes(past: InitialData, dynamic: DynamicBlock) -> Iterator[tuple[Signal, str, list[Part]]]:
    """(signal, its name, the parts with it) by which a block differs from its value at 0 held."""
    block = dynamic.block
    y = block.output

    def rewired(wiring: str) -> list[Part]:
        return [replace(p, wiring=wiring) if p is block else p for p in past.diagram.parts]

    missing = past.continuation(block.input) - Step(_needed(past, dynamic))
    if missing.terms:
        fed = Sum(f"{y}__fed = {block.input} + {y}__push")
        yield missing, f"{y}__push", [*rewired(f"{y}__fed -> {y}"), fed]
    if callable(dynamic.past) and dynamic.numbers.order > 1:
        slopes = past.functions[y].derivatives(Fraction(0), "left", dynamic.numbers.order)
        d = dynamic.den
        numerator = sum(
            float(d[k] * slopes[j]) * s ** (k - j)
            for k in range(2, dynamic.numbers.order + 1)
            for j in range(1, k)
        )
        if numerator:
            den = sum(float(c) * s**k for k, c in enumerate(d))
            free = Block(
                f"free motion of {block.name}", numerator / den, f"{y}__start -> {y}__free"
            )
            own = rewired(f"{block.input} -> {y}__own")
            yield Step(), f"{y}__start", [*own, free, Sum(f"{y} = {y}__own + {y}__free")]


def _needed(past: InitialData, dynamic: DynamicBlock) -> float:
    """The constant a block would have to be fed to keep the value that it had at 0."""
    block, numbers = dynamic.block, dynamic.numbers
    fed, varies = past.constant(block.input), past.delayed_terms(block.input)
    num, den = at_zero(numbers.num), at_zero(numbers.den)
    if callable(dynamic.past):
        return den * past.value_at_zero(block.output) / num
    unknown = not num and den != 0
    need = fed if unknown else den * dynamic.past / num if num else 0.0
    if varies and unknown:
        raise InputError(
            f"response: block {quoted(block.name)} is zero at s = 0, so that its own past does "
            "not tell "
            f"its state, and the history of {quoted(block.input)} is a function; split it into a "
            "gain "
            "and a block b/den(s) whose output you can name."
        )
    if numbers.improper and (varies or abs(fed - need) > 1e-12 * max(abs(fed), abs(need))):
        raise InputError(
            f"response: block {quoted(block.name)} differentiates and has dynamics, and what it "
            "was fed "
            "by this history is not what it was in steady state with; split it into a "
            "differentiator and a block with dynamics."
        )
    return need
