"""A loop as data that a script can compute with: formulas as trees, channels as N/Δ of blocks.

Every coefficient and delay of a block is a tree of numbers, parameters and operators; every channel
is a numerator and a denominator in the gains of the blocks, as the diagram's own equations have it.
What is computed from it, in the browser, is exact in the delays and the same as here.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from vsctrl.diagram import Block, Diagram, Loop
from vsctrl.diagram.description.blocks import Terms
from vsctrl.errors import InputError

Tree = Any  #: a number, a parameter's name, or [operator, tree, …]
MOST_TERMS = 400  #: of a channel, in the gains of its blocks
PERIOD = "period"  #: the name under which the sampling period stands beside the parameters

_FUNCTIONS = {sp.exp: "exp", sp.log: "log", sp.sin: "sin", sp.cos: "cos", sp.tan: "tan"}
_FUNCTIONS |= {sp.Abs: "abs"}


def tree(expr: Any) -> Tree:
    """A formula of parameters as a tree. Errors: `InputError` for a function not known there."""
    if not isinstance(expr, sp.Basic):
        return float(expr)
    if expr.is_Symbol:
        return expr.name
    if expr.is_number:
        return float(expr)
    if expr.is_Add or expr.is_Mul:
        return ["+" if expr.is_Add else "*", *map(tree, expr.args)]
    if expr.is_Pow:
        base, power = expr.args
        if power == -1:
            return ["/", 1.0, tree(base)]
        return ["^", tree(base), tree(power)]
    if expr.func in _FUNCTIONS:
        return [_FUNCTIONS[expr.func], *map(tree, expr.args)]
    raise InputError(f"explorer: the formula {expr} holds {expr.func}, which it does not know.")


@dataclass
class _Blocks:
    """The table of all blocks and delays; what stands in it twice is there once."""

    names: dict[sp.Symbol, sp.Symbol]  #: parameter → a symbol called as its keyword is
    delays: list[Tree] = field(default_factory=list)
    table: list[dict[str, Any]] = field(default_factory=list)

    def index(self, block: Any) -> int:
        """The place of a block's transfer function."""
        own = {"num": self._side(block.rational, "num"), "den": self._side(block.rational, "den")}
        if own not in self.table:
            self.table.append(own)
        return self.table.index(own)

    def _side(self, rational: Any, side: str) -> list[Any]:
        terms: Terms = getattr(rational, side)
        return [
            [
                power,
                [[self._delay(rational.delays[q]), n] for q, n in late],
                tree(c.xreplace(self.names)),
            ]
            for (power, late), c in terms.items()
        ]

    def _delay(self, delay: Any) -> int:
        own = tree(delay.xreplace(self.names))
        if own not in self.delays:
            self.delays.append(own)
        return self.delays.index(own)

    def channel(self, diagram: Diagram, source: str, target: str) -> list[dict[str, Any]]:
        """[N, Δ] of a channel: its terms [factor, blocks whose numerator each holds]."""
        sides = diagram.terms(source, target)
        if sum(len(side.factor) for side in sides) > MOST_TERMS:
            raise InputError("explorer: the loops of this diagram are too many for it.")
        used = [i for i in range(len(diagram.blocks)) if any(x.holds[:, i].any() for x in sides)]
        place = {i: self.index(diagram.blocks[i]) for i in used}
        # Two equal blocks would share a place, and a term may hold one of them only.
        for i in used:
            if list(place.values()).count(place[i]) > 1:
                self.table.append(dict(self.table[place[i]]))
                place[i] = len(self.table) - 1
        return [
            {
                "used": [place[i] for i in used],
                "terms": [
                    [float(factor), [place[i] for i in used if row[i]]]
                    for row, factor in zip(side.holds, side.factor, strict=True)
                ],
            }
            for side in sides
        ]


def model(loop: Loop) -> dict[str, Any]:
    """The loop as data: blocks, L, the shown channels, and the cut that its computer makes.

    Errors: `InputError` for a diagram without a loop, or with formulas that no tree holds.
    """
    parameters = loop.diagram.parameters
    blocks = _Blocks({symbol: sp.Symbol(key) for key, symbol in parameters.items()})
    if not loop.opened:
        raise InputError("explorer: no loop runs through any signal of the diagram.")
    cut = loop.diagram.open(loop.opened)
    shown = _shown(loop)
    values = {key: float(loop.values[key]) for key in parameters}
    return {
        "values": values | ({PERIOD: float(loop.period)} if loop.period else {}),
        "loop": blocks.channel(cut, f"{loop.opened}__cut", loop.opened),
        "shown": [
            {"input": a, "output": b, "channel": blocks.channel(loop.diagram, a, b)}
            for a, b in shown
        ],
        "sampled": _sampled(loop, blocks, shown),
        "delays": blocks.delays,
        "blocks": blocks.table,
    }


def _shown(loop: Loop) -> list[tuple[str, str]]:
    """The channels whose responses are drawn: from the first input that gets something."""
    inputs = [one.input for one in loop.applied] or list(loop.diagram.inputs)
    return [(inputs[0], signal) for signal in loop.watched[:2]] if inputs else []


def _sampled(loop: Loop, blocks: _Blocks, shown: list[tuple[str, str]]) -> dict[str, Any] | None:
    """The diagram cut at the hold and at the blocks that the computer runs; None without any."""
    if loop.period is None or loop.hold in loop.diagram.inputs:
        return None
    cut = loop.diagram.open(loop.hold)
    asked, held = [loop.hold], [cut.inputs[-1]]
    filters: list[dict[str, Any] | None] = [None]
    parts: list[Any] = []
    for part in cut.parts:
        if not isinstance(part, Block) or (method := loop.digital.get(part.name)) is None:
            parts.append(part)
            continue
        filters.append({"block": blocks.index(part), "method": method})
        sent, got = f"{part.output}__sent", f"{part.output}__held"
        parts += [
            Block(part.name, 1, f"{part.input} -> {sent}"),
            Block(f"{part.name} held", 1, f"{got} -> {part.output}"),
        ]
        asked.append(sent)
        held.append(got)
    outputs = tuple(dict.fromkeys((*loop.diagram.outputs, *asked)))
    whole = Diagram(parts, inputs=(*loop.diagram.inputs, *held), outputs=outputs)

    def way(source: str, target: str) -> list[dict[str, Any]]:
        return blocks.channel(whole, source, target)

    return {
        "period": PERIOD,
        "filters": filters,
        "loop": [[way(j, i) for j in held] for i in asked],
        "shown": [
            {
                "into": [way(source, i) for i in asked],
                "out": way(source, target),
                "ways": [way(j, target) for j in held],
            }
            for source, target in shown
        ],
    }


def as_json(data: Any) -> str:
    """Data as the text of an element of a page, which no text in it can end."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
