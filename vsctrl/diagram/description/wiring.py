"""Signals by name: parts that are joined wherever a name is the same, checked when made."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import sympy as sp

from vsctrl.caching import Caching
from vsctrl.checks import quoted
from vsctrl.diagram.description.blocks import Block, Part, Subdiagram
from vsctrl.errors import InputError, nearest
from vsctrl.symbols import KEYWORDS, s


@dataclass(frozen=True, init=False)
class Wiring(Caching):
    """Blocks and sums joined wherever a signal name is the same, with named inputs and outputs."""

    parts: tuple[Part, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    shown: tuple[Part, ...] = field(compare=False, repr=False)

    def __init__(
        self,
        parts: Iterable[Part],
        inputs: Iterable[str] | None = None,
        outputs: Iterable[str] | None = None,
    ) -> None:
        boxes = tuple(parts) if isinstance(parts, Iterable) else (parts,)
        flat = opened(boxes)
        _check_parts(flat)
        flat = _one_symbol_a_name(flat)
        object.__setattr__(self, "parts", flat)
        taken = {name for part in flat for name in part.inputs}
        undriven = dict.fromkeys(n for p in flat for n in p.inputs if n not in self.drivers)
        ends = dict.fromkeys(part.output for part in flat if part.output not in taken)
        for side, names, default in (("inputs", inputs, undriven), ("outputs", outputs, ends)):
            names = tuple(default) if names is None else _names(side, names)
            object.__setattr__(self, side, names)
        _check_wiring(self, undriven, taken, ends, boxes)
        object.__setattr__(self, "shown", boxed(boxes, self))
        self.parameters  # noqa: B018 - refuses two symbols of one keyword

    @cached_property
    def drivers(self) -> dict[str, Part]:
        """The part that drives each signal."""
        return {part.output: part for part in self.parts}

    @cached_property
    def signals(self) -> tuple[str, ...]:
        """Every signal of the diagram, inputs first."""
        return (*self.inputs, *self.drivers)

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """The diagram's blocks, in the order given."""
        return tuple(part for part in self.parts if isinstance(part, Block))

    @cached_property
    def parameters(self) -> dict[str, sp.Symbol]:
        """The keyword that `at` takes for each parameter → its symbol."""
        free = set().union(*(block.expr.free_symbols for block in self.blocks)) - {s}
        keyword = {symbol.name: word for word, symbol in KEYWORDS.items()}
        symbols: dict[str, sp.Symbol] = {}
        for symbol in sorted(free, key=lambda a: a.name):
            word = keyword.get(symbol.name, symbol.name)
            if word in symbols:
                raise InputError(
                    f"Diagram: the symbols {symbols[word]} and {symbol} would both be the "
                    f"parameter {quoted(word)}; rename one of them."
                )
            symbols[word] = symbol
        return dict(sorted(symbols.items()))

    def numbers(self, values: Mapping[str, Any]) -> dict[str, float]:
        """Check a value for each parameter; errors name the parameter, the value, the remedy."""
        known = self.parameters
        for name in values:
            if name not in known:
                raise InputError(
                    "at: there is no parameter "
                    f"{quoted(name)}{nearest(name, known, values[name])}; "
                    f"the diagram has {', '.join(known) or 'none'}."
                )
        missing = [name for name in known if name not in values]
        if missing:
            raise InputError(f"at: no value for {', '.join(missing)}; give {missing[0]}=….")
        return {name: _number(name, values[name]) for name in known}

    def require(self, signal: str) -> None:
        """Raise a sentence if the diagram has no such signal."""
        if signal not in self.signals:
            raise InputError(
                f"there is no signal {quoted(signal)}{nearest(signal, self.signals)}; "
                f"the diagram has {', '.join(self.signals)}."
            )

    def check_channel(self, source: str, target: str) -> None:
        """Refuse a channel that does not go from an input to a signal. Errors: `InputError`."""
        self.require(source)
        self.require(target)
        if source not in self.inputs:
            raise InputError(
                f"{quoted(source)} is not an input of the diagram; "
                f"a channel starts at {' or '.join(map(repr, self.inputs)) or 'an input'}."
            )

    def open(self, signal: str) -> Self:
        """The diagram with every use of `signal` cut and fed from a new input, `signal__cut`.

        Minus the transfer function from that input to `signal` is the loop transfer function L
        of the return difference 1 + L.
        """
        if signal not in self._opened:
            self._check_opening(signal)
            source = f"{signal}__cut"
            parts = [part.rewired({signal: source}, {}) for part in self.parts]
            outputs = dict.fromkeys((*self.outputs, signal))
            self._opened[signal] = type(self)(parts, (*self.inputs, source), outputs)
        return self._opened[signal]

    @cached_property
    def _opened(self) -> dict[str, Self]:
        return {}

    def _check_opening(self, signal: str) -> None:
        self.require(signal)
        if signal in self.inputs:
            raise InputError(
                f"open: {quoted(signal)} is an input, so no loop runs through it; "
                f"open one of {', '.join(self.drivers)}."
            )
        if all(signal not in part.inputs for part in self.parts):
            raise InputError(
                f"open: nothing takes {quoted(signal)}, so no loop runs through it; "
                f"open a signal that feeds another part."
            )

    def __str__(self) -> str:
        lines = [str(part) for part in self.parts]
        return "\n".join([f"inputs {', '.join(self.inputs)} → {', '.join(self.outputs)}", *lines])


def is_channel(pair: object) -> bool:
    """Whether this is a pair of names, as in ``system["input", "output"]``."""
    return isinstance(pair, tuple) and len(pair) == 2 and all(isinstance(n, str) for n in pair)


def _names(side: str, names: Iterable[str]) -> tuple[str, ...]:
    listed = (names,) if isinstance(names, str) or not isinstance(names, Iterable) else tuple(names)
    if not all(isinstance(name, str) for name in listed) or len(set(listed)) < len(listed):
        raise InputError(
            f"Diagram: {side} = {quoted(names)} are no signals; list the name of each once, like "
            '["S_ref"].'
        )
    return listed


def _number(name: str, value: Any) -> float:
    try:
        if isinstance(value, str | bool | np.bool_ | complex | np.complexfloating):
            raise TypeError
        number = float(value)
    except OverflowError:
        number = math.inf
    except (TypeError, ValueError):
        raise InputError(
            f"at: {name} = {quoted(value)} is no number; give a real number."
        ) from None
    if not math.isfinite(number):
        raise InputError(f"at: {name} = {number} is not finite; give a finite number.")
    return number


def _one_symbol_a_name(parts: tuple[Part, ...]) -> tuple[Part, ...]:
    """Let one name mean one symbol, whatever assumptions its maker gave it in each block."""
    first: dict[str, sp.Symbol] = {"s": s}
    out: list[Part] = []
    for part in parts:
        if isinstance(part, Block):
            symbols = sorted(part.expr.free_symbols, key=lambda a: a.name)
            swap = {a: first.setdefault(a.name, a) for a in symbols}
            if any(a != b for a, b in swap.items()):
                part = replace(part, expr=part.expr.xreplace(swap))
        out.append(part)
    return tuple(out)


def _check_parts(parts: tuple[Part, ...]) -> None:
    drivers: dict[str, Part] = {}
    names: set[str] = set()
    for part in parts:
        if not isinstance(part, Part):
            raise InputError(
                f"Diagram: {quoted(part)} is no part; give Block(…) and Sum(…) objects."
            )
        if part.output in drivers:
            raise InputError(
                f"Diagram: signal {quoted(part.output)} has two drivers, {drivers[part.output]} "
                "and "
                f"{part}; rename one and join them with a Sum."
            )
        if isinstance(part, Block) and part.name in names:
            raise InputError(f"Diagram: two blocks are called {quoted(part.name)}; rename one.")
        names |= {part.name} if isinstance(part, Block) else set()
        drivers[part.output] = part
    if not parts:
        raise InputError("Diagram: there are no parts; give at least one Block.")


def _check_wiring(
    diagram: Wiring,
    undriven: Iterable[str],
    taken: set[str],
    ends: Iterable[str],
    boxes: tuple[Part, ...],
) -> None:
    inside = {
        outer: (inner, box.name)
        for box in boxes
        if isinstance(box, Subdiagram)
        for outer, inner in box.inner_names.items()
    }
    for name in undriven:
        if name not in diagram.inputs:
            hint = nearest(name, diagram.signals)
            if name in inside:
                hint = ", the input {} of block {}".format(*map(quoted, inside[name]))
            raise InputError(
                f"Diagram: nothing drives signal {quoted(name)}{hint}; drive it or declare it in "
                "inputs."
            )
    for name in diagram.inputs:
        if name in diagram.drivers:
            raise InputError(
                f"Diagram: input {quoted(name)} is driven by {diagram.drivers[name]}; "
                "take it out of inputs or rename the signal."
            )
        if name not in taken:
            raise InputError(
                f"Diagram: input {quoted(name)} leads nowhere{nearest(name, taken)}; "
                "let a part take it or take it out of inputs."
            )
    for name in diagram.outputs:
        diagram.require(name)
    for name in ends:
        if name not in diagram.outputs:
            what, hint = str(diagram.drivers[name]), nearest(name, taken)
            if name in inside:
                what, hint = "output {} of block {}".format(*map(quoted, inside[name])), ""
            raise InputError(
                f"Diagram: {what} leads nowhere{hint}; "
                f"let a part take {quoted(name)} or declare it in outputs."
            )
    for name in diagram.drivers:
        resolve(diagram, name)  # refuses sums that feed each other in a loop


def resolve(diagram: Wiring, signal: str) -> dict[str, int]:
    """The signal as a signed sum of block outputs and inputs, sums between them expanded."""

    def expand(name: str, above: tuple[str, ...]) -> dict[str, int]:
        part = diagram.drivers.get(name)
        if part is None or isinstance(part, Block):
            return {name: 1}
        if name in above:
            loop = " → ".join((*above[above.index(name) :], name))
            raise InputError(
                f"Diagram: the sums {loop} feed each other without a block between them; "
                "put a Block with the gain you mean into that loop."
            )
        total: dict[str, int] = {}
        for sign, term in part.terms:
            for leaf, factor in expand(term, (*above, name)).items():
                total[leaf] = total.get(leaf, 0) + sign * factor
        return {leaf: factor for leaf, factor in total.items() if factor}

    return expand(signal, ())


def boxed(boxes: tuple[Part, ...], diagram: Wiring) -> tuple[Part, ...]:
    """The parts to draw: as given, unless a signal within a box is asked for outside of it."""
    driven = {part.output for part in boxes}
    taken = {name for part in boxes for name in part.inputs}
    hidden = {part.output for part in diagram.parts} - driven
    asked = taken | set(diagram.outputs)
    return diagram.parts if hidden & asked or set(diagram.inputs) - taken else boxes


def opened(parts: Iterable[Part]) -> tuple[Part, ...]:
    """The parts with those of every subdiagram in its place."""
    flat: list[Part] = []
    for part in parts:
        flat += part.parts if isinstance(part, Subdiagram) else (part,)
    return tuple(flat)
