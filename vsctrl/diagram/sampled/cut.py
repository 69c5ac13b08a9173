"""The computer's half of a sampled loop: cut the diagram, discretise what runs in it, close it.

A hold and each digital block turn a signal into numbers at t = kT and numbers into a held signal.
There the diagram is cut; what is left is continuous, exact, and left to `zero_order_hold`. Here the
two halves are closed to one `difference_equation`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.checks import quoted
from vsctrl.diagram.description.blocks import Block, Part
from vsctrl.diagram.numerics.graphs import reached
from vsctrl.diagram.realisation import assembly
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.sampled import zero_order_hold
from vsctrl.diagram.sampled.difference_equation import DifferenceEquation
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients
from vsctrl.diagram.symbolic.model import Model
from vsctrl.errors import InputError

Side = dict[tuple[int, Fraction], float]
Filter = dict[int, float]  #: samples ago → coefficient

#: Relative to the period T: s = a (1 − q)/(b + c q) with q = 1/z, (a, b, c) a method.
METHODS = {"forward": (1.0, 0.0, 1.0), "backward": (1.0, 1.0, 0.0), "tustin": (2.0, 1.0, 1.0)}


def discretised(block: BlockCoefficients, method: str, period: Fraction) -> tuple[Filter, Filter]:
    """(b, a) of Σ a_d v[k−d] = Σ b_d y[k−d], a₀ = 1, from s = a(1 − q)/(T(b + c q)).

    q = 1 is s = 0, so static gains stay what they are. Errors: `InputError` for a delay that is no
    whole number of periods and for a block that would need a future sample.
    """
    order = max((k for side in (block.num, block.den) for k, _ in side), default=0)
    num, den = (_in_q(block.name, side, order, method, period) for side in (block.num, block.den))
    if abs(den.get(0, 0.0)) <= 1e-14 * max(map(abs, den.values())):
        raise InputError(
            f"sampled: block {quoted(block.name)} by {quoted(method)} would need a sample of the "
            "future (or "
            f"an infinite gain) at a period of {float(period):g} s; "
            "name 'backward' or 'tustin' for it, or another period."
        )
    return tuple({d: c / den[0] for d, c in side.items()} for side in (num, den))  # type: ignore[return-value]


def _in_q(name: str, side: Side, order: int, method: str, period: Fraction) -> Filter:
    a, b, c = METHODS[method]
    out: Filter = {}
    for (k, tau), value in side.items():
        samples_ago, after = zero_order_hold.ago(tau, period)
        if after:
            raise InputError(
                f"sampled: block {quoted(name)} runs in the computer, and its delay of "
                f"{float(tau):g} s "
                f"is {timing.shown(tau / period)} periods; make it a whole number, or take the "
                "block out of digital: a continuous block may have any delay."
            )
        scale = value * a**k * float(period) ** (order - k)
        factors = [[1.0, -1.0]] * k + [[b, c]] * (order - k)
        poly = np.ones(1)
        for factor in factors:
            poly = np.convolve(poly, factor)
        for d, coefficient in enumerate(poly):
            if coefficient:
                out[d + samples_ago] = out.get(d + samples_ago, 0.0) + scale * float(coefficient)
    return out


@dataclass(frozen=True)
class Cut:
    """A diagram cut at its hold and at its digital blocks; `asked` and `held` belong in pairs."""

    diagram: Model
    blocks: list[BlockCoefficients]
    asked: tuple[str, ...]  #: signals that are sampled
    held: tuple[str, ...]  #: inputs that they become after the computer
    filters: tuple[tuple[Filter, Filter], ...]


def cut(system: Numeric, period: Fraction, hold: str, digital: dict[str, str]) -> Cut:
    """Cut the diagram; a hold at an input cuts nothing, since inputs are held anyway."""
    diagram = system.diagram
    numbers = {block.name: block for block in system.blocks}
    one: Side = {(0, Fraction(0)): 1.0}
    asked, held_, filters = [], [], []
    if hold not in diagram.inputs:
        diagram = diagram.open(hold)
        asked, held_, filters = [hold], [diagram.inputs[-1]], [({0: 1.0}, {0: 1.0})]
    parts: list[Part] = []
    for part in diagram.parts:
        method = digital.get(part.name) if isinstance(part, Block) else None
        if method is None or not isinstance(part, Block):
            parts.append(part)
            continue
        filters.append(discretised(numbers[part.name], method, period))
        sent, got = f"{part.output}__sent", f"{part.output}__held"
        parts += [
            Block(part.name, 1, f"{part.input} -> {sent}"),
            Block(f"{part.name} held", 1, f"{got} -> {part.output}"),
        ]
        numbers[part.name] = BlockCoefficients(part.name, one, one)
        numbers[f"{part.name} held"] = BlockCoefficients(f"{part.name} held", one, one)
        asked.append(sent)
        held_.append(got)
    inputs = (*system.diagram.inputs, *held_)
    outputs = tuple(dict.fromkeys((*system.diagram.outputs, *asked)))
    opened = type(diagram)(parts, inputs=inputs, outputs=outputs)
    blocks = [numbers[block.name] for block in opened.blocks]
    return Cut(opened, blocks, tuple(asked), tuple(held_), tuple(filters))


def close(
    parts: Cut, period: Fraction, hold: str, sources: tuple[str, ...], targets: tuple[str, ...]
) -> DifferenceEquation:
    """The closed loop from some inputs to some signals, the held signals fed back.

    Errors: `InputError` for delays that the hold does not cut, an improper signal, and a singular
    algebraic loop through the hold.
    """
    system = assembly.realise(
        parts.diagram, parts.blocks, (*sources, *parts.held), (*targets, *parts.asked)
    )
    n, r, q, p = len(system.A), len(sources), len(parts.held), len(targets)
    continuous = zero_order_hold.sample(system, period, hold)
    order = [*range(n), *range(n + r, n + r + q), *range(n, n + r)]
    taps: dict[int, Array] = {0: np.zeros((n + q + p, n + q + r))}
    for d, matrix in continuous.items():
        wide = matrix[:, order]
        _into(taps, d, slice(0, n), wide[:n])
        _into(taps, d, slice(n + q, n + q + p), wide[n : n + p])
        for i, (b, _) in enumerate(parts.filters):
            for more, factor in b.items():
                _into(taps, d + more, slice(n + i, n + i + 1), factor * wide[n + p + i][None])
    for i, (_, a) in enumerate(parts.filters):
        for d, factor in a.items():
            if d:
                own = np.zeros((1, n + q + r))
                own[0, n + i] = -factor
                _into(taps, d, slice(n + i, n + i + 1), own)
    return DifferenceEquation(_solved(taps, n, q, hold), n, q)


def closed(loop: DifferenceEquation, sign: int, hold: str) -> DifferenceEquation:
    """What is left, without inputs, when the one output is fed back to the one input.

    `sign` −1: L of the return difference 1 + L is minus this loop.
    """
    m = loop.inner + 1
    taps = {d: matrix[:m, :m].copy() for d, matrix in loop.taps.items()}
    for matrix in taps.values():
        matrix[-1] *= -sign  # the input is the last held signal, and the output drives it
    return DifferenceEquation(
        _solved(taps, loop.states, loop.held + 1, hold), loop.states, loop.held + 1
    )


def without_differentiated_inputs(parts: Cut) -> Cut:
    """The same with the outputs of improper blocks that the hold does not reach zero.

    The same one where there are none. The poles of those blocks and of all others stay.
    """
    after = reached(
        parts.held,
        lambda name: [part.output for part in parts.diagram.parts if name in part.inputs],
    )
    pairs = zip(parts.diagram.blocks, parts.blocks, strict=True)
    blocks = [
        replace(b, num={}, cascade=()) if b.improper and block.output not in after else b
        for block, b in pairs
    ]
    return parts if blocks == parts.blocks else replace(parts, blocks=blocks)


def _into(taps: dict[int, Array], d: int, rows: slice, values: Array) -> None:
    if d not in taps:
        taps[d] = np.zeros_like(taps[0])
    taps[d][rows] += values


def _solved(taps: dict[int, Array], n: int, q: int, hold: str) -> dict[int, Array]:
    """Solve v[k] = D v[k] + … for v[k] and put it into the other rows."""
    v = slice(n, n + q)
    loop = np.eye(q) - taps[0][v, v]
    if q and np.linalg.cond(loop) > 1e12:
        raise InputError(
            f"sampled: the algebraic loop through the hold at {quoted(hold)} is singular (its "
            "return "
            "difference is zero): the signal asks for its own value at the same instant; change "
            "a gain in it or put a lag or a delay into it."
        )
    out = {}
    taps = {d: matrix.copy() for d, matrix in taps.items()}
    gain = taps[0][:, v].copy()
    gain[v], taps[0][:, v] = 0.0, 0.0
    for d, matrix in taps.items():
        if q:
            matrix[v] = np.linalg.solve(loop, matrix[v])
        matrix += gain @ matrix[v]
        if d == 0 or matrix.any():
            out[d] = matrix
    return dict(sorted(out.items()))
