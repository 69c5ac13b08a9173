"""The blocks in numbers: every coefficient and every delay, compiled once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from vsctrl.caching import Caching
from vsctrl.checks import decimal, quoted
from vsctrl.diagram.description.blocks import Rational, Terms, delay_symbol
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.errors import InputError

Side = dict[tuple[int, Fraction], float]  #: (power of s, delay in seconds) → coefficient


@dataclass(frozen=True)
class BlockCoefficients:
    """One block in numbers: (power of s, delay in seconds) → coefficient, for num and den.

    Of a high order it also has `cascade`, the same as blocks in series.
    """

    name: str
    num: Side
    den: Side
    cascade: tuple[tuple[Side, Side], ...] = ()

    @property
    def sections(self) -> tuple[tuple[Side, Side], ...]:
        """(num, den) of blocks in series that it is made of: itself, or those of `cascade`."""
        return self.cascade or ((self.num, self.den),)

    @property
    def delays(self) -> set[Fraction]:
        """Its delays (s), 0 for what is not delayed."""
        return {tau for side in (self.num, self.den) for _, tau in side}

    @property
    def order(self) -> int:
        """The highest power of s in its denominator."""
        return max(k for k, _ in self.den)

    @property
    def improper(self) -> bool:
        """Whether its numerator has a higher power of s than its denominator."""
        return max((k for k, _ in self.num), default=0) > self.order


class Coefficients(Caching):
    """Every coefficient and delay of a diagram as one compiled function of its parameters."""

    def __init__(self, diagram: Wiring) -> None:
        self._diagram = diagram
        ratios = [block.rational for block in diagram.blocks]
        self._delays = list({q: tau for r in ratios for q, tau in r.delays.items()}.values())
        sides = [side for ratio in ratios for side in _sides(ratio)]
        flat = [c for side in sides for c in side.values()]
        symbols = list(diagram.parameters.values())
        self._flat = sp.lambdify(symbols, [*self._delays, *flat], modules="math", cse=True)

    @cached_property
    def _delay_names(self) -> list[str]:
        """How each delay reads in the diagram, for messages."""
        return [str(delay) for delay in self._delays]

    def __call__(self, values: dict[str, float]) -> list[BlockCoefficients]:
        """The blocks in numbers; errors name the delay or block that has no finite value."""
        try:
            numbers = [float(x) for x in self._flat(*values.values())]
        except (ZeroDivisionError, OverflowError, ValueError, TypeError):
            pairs = ", ".join(f"{name} = {value:g}" for name, value in values.items())
            raise InputError(
                f"at: a block has no finite real value{f' at {pairs}' if pairs else ''}; "
                "look for a division by zero or the root or logarithm of a negative number."
            ) from None
        delays = {}
        for expr, name, number in zip(self._delays, self._delay_names, numbers, strict=False):
            if number < 0:
                raise InputError(
                    f"at: the delay {name} = {number:g} s is negative, which would predict the "
                    "future; give a delay of 0 or more."
                )
            delays[delay_symbol(expr)] = decimal(f"at: delay {name}", number)
        rest = iter(numbers[len(self._delays) :])
        blocks = []
        for block in self._diagram.blocks:
            ratio, name = block.rational, block.name
            num, den, *more = (self._side(side, rest, delays, name) for side in _sides(ratio))
            _check_causal(name, den)
            cascade = tuple(_levelled(*pair) for pair in zip(more[::2], more[1::2], strict=True))
            # A coefficient that is zero at these values may have taken a section's order.
            whole = all(pair[1] for pair in cascade)
            blocks.append(BlockCoefficients(name, *_levelled(num, den), cascade if whole else ()))
        return blocks

    def _side(
        self, side: dict[Any, sp.Expr], rest: Any, delays: dict[sp.Symbol, Fraction], name: str
    ) -> dict[tuple[int, Fraction], float]:
        out: dict[tuple[int, Fraction], float] = {}
        for power, monomial in side:
            key = power, sum((n * delays[q] for q, n in monomial), Fraction(0))
            out[key] = out.get(key, 0.0) + next(rest)
        if not np.isfinite(list(out.values())).all():
            raise InputError(f"at: block {quoted(name)} is not finite; check the values given.")
        return {key: value for key, value in out.items() if value}


def _sides(ratio: Rational) -> list[Terms]:
    """Numerator and denominator of a block, and those of its sections where it has several."""
    sections = ratio.sections if len(ratio.factors) > 1 else ()
    return [ratio.num, ratio.den, *(side for pair in sections for side in pair)]


def _levelled(num: Side, den: Side) -> tuple[Side, Side]:
    """Numerator and denominator divided by the power of 2 that leaves den near 1.

    Cancelling decimals leaves numbers like 10¹⁷ on both sides, which the states would inherit.
    """
    shift = -math.frexp(max((abs(c) for c in den.values()), default=1.0))[1]
    try:
        level_num, level_den = (
            {key: math.ldexp(c, shift) for key, c in side.items()} for side in (num, den)
        )
    except OverflowError:  # a gain beyond 1e308 is left for those who use it to refuse
        return num, den
    return level_num, level_den


def _check_causal(name: str, den: dict[tuple[int, Fraction], float]) -> None:
    if not den:
        raise InputError(
            f"at: block {quoted(name)} divides by zero at these values; "
            "give its denominator a value other than 0."
        )
    top = max(k for k, _ in den)
    if (top, Fraction(0)) not in den:
        raise InputError(
            f"at: block {quoted(name)} predicts the future: the highest power of s in its "
            "denominator is delayed; multiply numerator and denominator so that it is not."
        )
