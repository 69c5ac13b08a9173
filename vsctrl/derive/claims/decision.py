"""Whether a residual is zero: by algebra, or not zero, by a place where it is not.

A proof needs both sides. That a formula holds is settled by exact algebra only, with the axis of
unit length and sin² + cos² = 1 as side relations; that it fails is settled by a counterexample,
evaluated with guaranteed digits. What neither settles is left open and proves nothing.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef, Derivative
from sympy.core.relational import Relational
from sympy.logic.boolalg import Boolean, BooleanFalse, BooleanTrue
from sympy.printing.pretty.pretty_symbology import pretty_symbol
from sympy.printing.str import StrPrinter

from vsctrl.symbols import r_x, r_y, r_z

#: Residuals that are zero where a statement holds, or relations that are true.
Facts = Any

# Whole numbers, all different, so that a counterexample reads well; the axis has unit length.
_PLACES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53)
_AXIS = {r_x: sp.Rational(2, 3), r_y: sp.Rational(-1, 3), r_z: sp.Rational(2, 3)}
_STAR = "⁎"
_READABLE = 25  # operations of a residual that simplifies in no time
_LONGEST = 110  # characters of a residual that is still worth reading


@dataclass(frozen=True)
class Decision:
    """``zero`` is True (proved), False (refuted at a place) or None (open); ``shown`` says how."""

    zero: bool | None
    shown: str


def decide(facts: Facts, at: Mapping[Any, Any] | None = None) -> Decision:
    """Whether all of some residuals are zero and relations true; ``at`` proposes a place to fail.

    ``facts`` is an expression, a relation, a matrix, or any nesting of them in tuples and lists.
    Symbols that do not commute stand for matrices of any size; a number for each, a 1×1 matrix,
    refutes.
    """
    still_open = ""
    for fact in _each(facts):
        decision = _decide(fact, dict(at or {}))
        if decision.zero is False:
            return decision
        if decision.zero is None:
            still_open = still_open or decision.shown
    return Decision(None, still_open) if still_open else Decision(True, "0")


def normal(expression: sp.Expr) -> sp.Expr:
    """The expression simplified, and exactly 0 where the side relations make it vanish.

    Polynomials in symbols, sines and cosines over a common denominator are decided completely.
    """
    flat = sp.expand(sp.expand_trig(expression) if expression.has(sp.sin, sp.cos) else expression)
    if flat == 0 or not flat.is_commutative:
        return flat
    if flat.has(sp.nan, sp.zoo):
        return sp.nan
    circles = _circles(flat)
    swaps = {
        f(angle): g
        for angle, pair in circles.items()
        for f, g in zip((sp.sin, sp.cos), pair, strict=True)
    }
    numerator = sp.fraction(sp.together(flat.xreplace(swaps)))[0]
    symbols = sorted(numerator.free_symbols | {r_x, r_y, r_z}, key=sp.default_sort_key)
    if not numerator.is_polynomial(*symbols):
        return sp.simplify(flat)
    first = [r_x, *(sine for sine, _ in circles.values())]
    second = [cosine for _, cosine in circles.values()]
    relations = [r_x**2 + r_y**2 + r_z**2 - 1, *(a**2 + b**2 - 1 for a, b in circles.values())]
    # The leading terms r_x², S², … are coprime, so the relations are a Groebner basis: the
    # numerator vanishes under them exactly when the remainder is zero.
    rest = [symbol for symbol in symbols if symbol not in {*first, *second}]
    R, *_ = sp.ring([*first, *second, *rest], sp.QQ)
    remainder = R.from_expr(numerator).rem([R.from_expr(f) for f in relations])
    return flat if remainder else sp.S.Zero


def text(expression: Any) -> str:
    """An expression in one line of plain Unicode: λ for lambda, x₀ for x_0."""
    shown = str(_Unicode().doprint(expression))
    # A star in a name, as in s*, is no product.
    return shown.replace("**", "^").replace("*", "·").replace(_STAR, "*").replace("-", "−")


def _each(facts: Facts) -> Iterator[Any]:
    if isinstance(facts, sp.MatrixBase) or (
        isinstance(facts, Iterable) and not isinstance(facts, sp.Expr | Boolean)
    ):
        for fact in facts:
            yield from _each(fact)
    else:
        yield sp.sympify(facts, strict=True)


def _decide(fact: Any, proposed: dict[Any, Any]) -> Decision:
    truth = fact.doit() if isinstance(fact, Relational) else fact
    if isinstance(truth, BooleanTrue):
        return Decision(True, "true")
    if isinstance(truth, BooleanFalse):
        return Decision(False, f"{_numbers(fact)} is false")
    if isinstance(truth, sp.Expr):
        truth = sp.expand(truth)
    # A place is tried before more algebra: it costs little, and what fails is often large.
    refuted = _refute(truth, proposed, 0)
    if refuted is not None:
        return refuted
    residual = truth if isinstance(truth, Boolean) else normal(truth)
    if residual == 0:
        return Decision(True, "0")
    if residual is sp.nan:
        return Decision(False, "0/0")
    still_open = Decision(None, f"{text(residual)} is neither proved nor refuted")
    return _refute(residual, proposed, 1) or still_open


def _refute(residual: Any, proposed: Mapping[Any, Any], shift: int) -> Decision | None:
    if residual.atoms(AppliedUndef, Derivative):
        return None  # it has no value at a place
    place = _place(residual, proposed, shift)
    value = _nonzero_value(residual, place)
    return None if value is None else Decision(False, _failure(residual, place, value))


def _numbers(fact: Any) -> str:
    """A relation of numbers with its sides in digits."""
    if not isinstance(fact, Relational):
        return "the printed relation"
    left, right = (text(side if side.is_Integer else sp.N(side, 4)) for side in fact.args)
    return f"{left} {fact.rel_op} {right}".replace("!=", "≠").replace("==", "=")


def _place(residual: Any, proposed: Mapping[Any, Any], shift: int) -> dict[Any, Any]:
    """A value for each symbol: the proposed one, or a number of its own."""
    free = sorted(residual.free_symbols, key=lambda s: (s.name, sp.default_sort_key(s)))
    numbers = dict(zip(free, _PLACES[shift:] + _PLACES[:shift], strict=False))
    return {symbol: proposed.get(symbol, _AXIS.get(symbol, numbers.get(symbol))) for symbol in free}


def _nonzero_value(residual: Any, place: dict[Any, Any]) -> str | None:
    """The residual there, where it is not zero for certain; None where that cannot be said."""
    # A 1×1 matrix commutes with every other.
    commuting = {s: sp.Dummy(s.name) for s in residual.free_symbols if not s.is_commutative}
    there = {commuting.get(s, s): sp.sympify(v, strict=True) for s, v in place.items()}
    value = residual.xreplace(commuting).xreplace(there)
    if isinstance(value, Boolean):
        return "false" if isinstance(value, BooleanFalse) else None
    if value.has(sp.nan, sp.zoo):
        return None
    size = sp.N(value, 30, maxn=60)
    if not size.is_number or not abs(size) > sp.Float("1e-20", 30):
        return None
    return text(sp.N(size, 4))


def _failure(residual: Any, place: dict[Any, Any], size: str) -> str:
    where = ", ".join(f"{text(symbol)} = {text(value)}" for symbol, value in place.items())
    if not where:
        return f"a residual of {size}"
    said = "false" if size == "false" else f"{size} ≠ 0"
    return f"{_short(residual)} is {said} at {where}"


def _short(residual: Any) -> str:
    numeric = isinstance(residual, sp.Expr) and residual.is_commutative
    if numeric and residual.count_ops() <= _READABLE:
        forms = (residual, sp.factor(residual), sp.simplify(residual))
        residual = min(forms, key=lambda e: len(text(e)))
    shown = text(residual)
    return shown if len(shown) <= _LONGEST else "the residual"


def _circles(expression: sp.Expr) -> dict[sp.Expr, tuple[sp.Dummy, sp.Dummy]]:
    """Symbols for the sine and the cosine of every angle that occurs."""
    angles = sorted({f.args[0] for f in expression.atoms(sp.sin, sp.cos)}, key=sp.default_sort_key)
    return {angle: (sp.Dummy(f"S_{i}"), sp.Dummy(f"C_{i}")) for i, angle in enumerate(angles)}


class _Unicode(StrPrinter):
    """SymPy's one-line printer with symbols as people write them."""

    def _print_Symbol(self, expr: Any) -> str:
        return str(pretty_symbol(expr.name.replace("*", _STAR)))

    _print_Dummy = _print_Symbol

    def _print_Function(self, expr: Any) -> str:
        inside = ", ".join(self._print(argument) for argument in expr.args)
        return f"{pretty_symbol(expr.func.__name__.replace('*', _STAR))}({inside})"
