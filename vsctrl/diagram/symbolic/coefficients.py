"""The blocks in numbers: every coefficient and every delay, compiled once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from vsctrl.checks import decimal
from vsctrl.diagram.description.blocks import delay_symbol
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.errors import InputError

Side = dict[tuple[int, Fraction], float]  #: (power of s, delay in seconds) → coefficient


@dataclass(frozen=True)
class BlockCoefficients:
    """One block in numbers: (power of s, delay in seconds) → coefficient, for num and den."""

    name: str
    num: dict[tuple[int, Fraction], float]
    den: dict[tuple[int, Fraction], float]

    @property
    def sections(self) -> tuple[tuple[Side, Side], ...]:
        """(num, den) of blocks in series whose outputs, num each, are added up."""
        return ((self.num, self.den),)

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


class Coefficients:
    """Every coefficient and delay of a diagram as one compiled function of its parameters."""

    def __init__(self, diagram: Wiring) -> None:
        self._diagram = diagram
        ratios = [block.rational for block in diagram.blocks]
        self._delays = list({q: tau for r in ratios for q, tau in r.delays.items()}.values())
        flat = [c for ratio in ratios for side in (ratio.num, ratio.den) for c in side.values()]
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
            num = self._side(block.rational.num, rest, delays, block.name)
            den = self._side(block.rational.den, rest, delays, block.name)
            _check_causal(block.name, den)
            blocks.append(_levelled(BlockCoefficients(block.name, num, den)))
        return blocks

    def _side(
        self, side: dict[Any, sp.Expr], rest: Any, delays: dict[sp.Symbol, Fraction], name: str
    ) -> dict[tuple[int, Fraction], float]:
        out: dict[tuple[int, Fraction], float] = {}
        for power, monomial in side:
            key = power, sum((n * delays[q] for q, n in monomial), Fraction(0))
            out[key] = out.get(key, 0.0) + next(rest)
        if not np.isfinite(list(out.values())).all():
            raise InputError(f"at: block {name!r} is not finite; check the values given.")
        return {key: value for key, value in out.items() if value}


def _levelled(block: BlockCoefficients) -> BlockCoefficients:
    """The block with numerator and denominator divided by the power of 2 that leaves den near 1.

    Cancelling decimals leaves numbers like 10¹⁷ on both sides, which the states would inherit.
    """
    shift = -math.frexp(max(abs(c) for c in block.den.values()))[1]
    try:
        num, den = (
            {key: math.ldexp(c, shift) for key, c in side.items()}
            for side in (block.num, block.den)
        )
    except OverflowError:  # a gain beyond 1e308 is left for those who use it to refuse
        return block
    return BlockCoefficients(block.name, num, den)


def _check_causal(name: str, den: dict[tuple[int, Fraction], float]) -> None:
    if not den:
        raise InputError(
            f"at: block {name!r} divides by zero at these values; "
            "give its denominator a value other than 0."
        )
    top = max(k for k, _ in den)
    if (top, Fraction(0)) not in den:
        raise InputError(
            f"at: block {name!r} predicts the future: the highest power of s in its "
            "denominator is delayed; multiply numerator and denominator so that it is not."
        )
