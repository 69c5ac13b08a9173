"""How large a formula becomes when it is multiplied out: known before it is done.

A text of twenty characters can mean a polynomial of a million terms. A formula's size is a bound
on the degree of each name in it, sums brought over a common denominator, and on the binary digits
of its numbers, with numerator and denominator apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy as sp

from vsctrl.diagram.document.tokens import Token

MOST_TERMS = 20_000  #: product of (degree + 1) over all names
HIGHEST = 150  #: degree in one name
MOST_BITS = 60_000  #: of a number
MOST_POWER = 100  #: of a number or name, and denominator of a fractional exponent


Degrees = Mapping[str, int]  #: by name


@dataclass(frozen=True)
class Size:
    """Degrees above and below the bar, binary digits, and whether an exponential is in it."""

    above: Degrees = field(default_factory=dict)
    below: Degrees = field(default_factory=dict)
    bits: int = 1
    exponential: bool = False

    def __post_init__(self) -> None:
        for degrees in (self.above, self.below):
            terms = math.prod(degree + 1 for degree in degrees.values())
            if terms > MOST_TERMS or max(degrees.values(), default=0) > HIGHEST:
                raise ValueError("multiplies out to too many terms; split it into several blocks")
        if self.bits > MOST_BITS:
            raise ValueError("holds numbers of too many digits; write decimals of 17 digits")


def of_number(value: Fraction) -> Size:
    """The size of a number."""
    return Size(bits=value.numerator.bit_length() + value.denominator.bit_length())


def of_name(name: str) -> Size:
    """The size of a symbol."""
    return Size({name: 1})


def total(a: Size, b: Size) -> Size:
    """Of a sum, over the product of both denominators."""
    left, right = _times(a.above, b.below), _times(b.above, a.below)
    above = {name: max(left.get(name, 0), right.get(name, 0)) for name in {**left, **right}}
    return _joined(a, b, above, _times(a.below, b.below))


def product(a: Size, b: Size) -> Size:
    """Of a product."""
    return _joined(a, b, _times(a.above, b.above), _times(a.below, b.below))


def inverse(a: Size) -> Size:
    """Of 1 divided by it."""
    return replace(a, above=a.below, below=a.above)


def power(base: Size, of: sp.Expr, exponent: sp.Expr, token: Token) -> Size:
    """Of a power. Raises ValueError where its exponent is too large, or no plain one."""
    if exponent.is_Rational:
        p, q = abs(int(exponent.p)), int(exponent.q)
        if max(p, q) > MOST_POWER:
            raise ValueError(
                f"character {token.place}: an exponent is beyond ±{MOST_POWER}; give a smaller one"
            )
        times = max(-(-p // q), 1)
        above, below = (
            {name: degree * times for name, degree in side.items()}
            for side in (base.above, base.below)
        )
        grown = Size(above, below, base.bits * times, base.exponential)
        return inverse(grown) if exponent.is_negative else grown
    if exponent.is_Symbol or (-exponent).is_Symbol:
        return function(f"({of})**({exponent})", base)
    raise ValueError(
        f"character {token.place}: an exponent must be a fraction or the name of a parameter"
    )


def function(text: str, argument: Size, exponential: bool = False) -> Size:
    """Of a function, which is a name of its own."""
    return Size({text: 1}, {}, argument.bits, argument.exponential or exponential)


def _times(a: Degrees, b: Degrees) -> dict[str, int]:
    return {name: a.get(name, 0) + b.get(name, 0) for name in {**a, **b}}


def _joined(a: Size, b: Size, above: Degrees, below: Degrees) -> Size:
    return Size(above, below, a.bits + b.bits, a.exponential or b.exponential)
