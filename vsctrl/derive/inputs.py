"""What users give to a derivation, checked once: scalars, vectors and unit axes.

The module exists so that a bad value ends in a sentence and never inside SymPy. What is derived
from the values is left to the other modules.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeAlias

import sympy as sp

from vsctrl.checks import quoted
from vsctrl.errors import InputError

#: Three numbers or expressions, or a 3×1 matrix.
Vector: TypeAlias = Sequence[Any] | sp.ImmutableMatrix

#: What symbols are tried at, over 250: distinct, so that no two are equal by accident.
PRIMES = (13, 29, 7, 37, 19, 43, 11, 31, 17, 41, 23, 47, 53, 59, 61, 67, 71, 73, 79, 83)

DOUBLE = 53  #: bits of a double, which its shortest decimal gives back

# A unit axis computed in doubles misses length 1 by a few rounding errors; typed digits miss more.
_UNIT_TOLERANCE = 1e-12


def scalar(name: str, value: Any) -> sp.Expr:
    """``value`` as a finite SymPy expression; text is refused, never parsed.

    Errors: `InputError` for anything that is not a finite number or a SymPy expression.
    """
    try:
        expression = sp.sympify(value, strict=True)
    except sp.SympifyError:
        expression = None
    if not isinstance(expression, sp.Expr) or expression.has(sp.nan, sp.oo, -sp.oo, sp.zoo):
        raise InputError(
            f"{name} = {quoted(value)} is not a finite number or a SymPy expression; "
            "give a number or an expression of vsctrl.symbols."
        )
    return expression


def decimals(expression: sp.Expr) -> sp.Expr:
    """The expression with each float as the decimal that it prints as, 812.3 as 8123/10.

    What is derived of exact numbers is exact, so that what cancels is 0; doubles leave 1e-17.
    """
    return expression.xreplace({f: _decimal(f) for f in expression.atoms(sp.Float)})


def _decimal(value: sp.Float) -> sp.Rational:
    return sp.Rational(repr(float(value)) if value._prec <= DOUBLE else str(value))


def symbols_in(expressions: Iterable[sp.Expr]) -> tuple[sp.Symbol, ...]:
    """The symbols of some expressions, each once, in their order and by name within one."""
    return tuple(dict.fromkeys(s for e in expressions for s in sorted(e.free_symbols, key=str)))


def vector(name: str, value: Vector) -> sp.ImmutableMatrix:
    """``value`` as a 3×1 column.

    Errors: `InputError` unless it has three entries that are numbers or expressions.
    """
    entries: list[Any] = []
    if not isinstance(value, str):
        with suppress(TypeError):
            entries = list(value)
    if len(entries) != 3:
        raise InputError(f"{name} = {quoted(value)} is not a vector; give its three components.")
    return sp.ImmutableMatrix([scalar(f"{name}[{i}]", entry) for i, entry in enumerate(entries)])


def axis(r: Vector) -> sp.ImmutableMatrix:
    """``r`` as a 3×1 unit column; a length that depends on symbols is taken as 1.

    Errors: `InputError` when the length is a number other than 1.
    """
    column = vector("r", r)
    square = sp.simplify(column.dot(column))
    if square.is_number and abs(sp.N(square - 1)) > _UNIT_TOLERANCE:
        values = ", ".join(str(entry) for entry in column)
        length = float(sp.N(square)) ** 0.5
        remedy = (
            "for a pure translation give any unit axis and omega = 0"
            if length == 0
            else "divide it by its length"
        )
        raise InputError(f"The axis r = ({values}) has length {length:.6g}, not 1; {remedy}.")
    return column


def vanishes(
    expression: sp.Expr, places: Mapping[sp.Symbol, sp.Expr] | None = None, within: str = "1e-20"
) -> bool:
    """Whether an expression is zero, tried at two places in general position in 60 digits.

    ``places`` say what some of its symbols stand for, and ``within`` which size counts as zero,
    more than the default where there are doubles. Symbols that are positive or real stay so; what
    is zero only under further conditions, as an angle that wraps round, must not be at these
    places: they are small.
    """
    placed = {s: e for s, e in (places or {}).items() if s in expression.free_symbols}
    free = expression.free_symbols.union(*(e.free_symbols for e in placed.values())) - set(placed)
    symbols = sorted(free, key=str)
    for shift in (0, 1):
        values: dict[sp.Symbol, sp.Expr] = {
            symbol: sp.Float(2 * PRIMES[(i + shift) % len(PRIMES)] + 1, 60) / 250
            for i, symbol in enumerate(symbols)
        }
        # Of decimals, not of fractions, whose roots and sines SymPy takes long to ponder.
        values |= {s: sp.N(e.xreplace(values), 60) for s, e in placed.items()}
        size = sp.N(expression.xreplace(values), 30)
        if not size.is_number or not abs(size) < sp.Float(within, 30):
            return False
    return True
