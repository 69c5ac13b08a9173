"""Transfer functions as one writes them by hand, from SymPy expressions.

Outer fractions are stacked over a bar, inner ones get a slash; factors come as numbers, parameters,
s, sums, delays; e^(−τs) stays above the bar. How text is measured is left to `typeset`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import sympy as sp

from vsctrl.diagram.picture.typeset import THIN, Formula, Fraction, Line, Run, symbol, width
from vsctrl.symbols import s

LONGEST = 11.0  #: em; a wider formula gives way to G_name(s)


def formula(expr: sp.Expr, name: str) -> Formula:
    """A block's transfer function, or G_name(s) where it is too long."""
    pieces = _pieces(expr)
    if width(pieces) > LONGEST:
        short = Run(name if len(name) <= 16 else name[:15].rstrip() + "…").script(-0.22)
        head = symbol(name).runs if len(name) < 4 else (Run("G", True), short)
        pieces = (Line((*head, Run("("), Run("s", italic=True), Run(")"))),)
    return pieces


def _pieces(expr: sp.Expr) -> Formula:
    """The formula with its outermost fractions stacked: one piece for each line or fraction."""
    if not expr.is_Add:
        return _stacked(expr, lead=True)
    pieces: list[Any] = []
    for i, term in enumerate(_terms(expr)):
        for piece in _stacked(term, lead=i == 0):
            if pieces and isinstance(piece, Line) and isinstance(pieces[-1], Line):
                piece = Line(pieces.pop().runs + piece.runs)
            pieces.append(piece)
    return tuple(pieces)


def _stacked(term: sp.Expr, lead: bool) -> Formula:
    negative, num, den = _split(term)
    sign = _sign(negative, lead)
    if not den:
        return (Line((*sign, *_product(num))),)
    sign = (Run("−" + THIN),) if lead and negative else sign  # else it would lengthen the bar
    bar = Fraction(Line(_product(num)), Line(_product(den)))
    return (Line(sign), bar) if sign else (bar,)


def _sign(negative: bool, lead: bool) -> tuple[Run, ...]:
    if lead:
        return (Run("−"),) if negative else ()
    return (Run(THIN + ("−" if negative else "+") + THIN),)


def _inline(expr: sp.Expr) -> tuple[Run, ...]:
    """The expression on one line, fractions with a slash."""
    runs: list[Run] = []
    for i, term in enumerate(_terms(expr) if expr.is_Add else [expr]):
        negative, num, den = _split(term)
        runs += [*_sign(negative, lead=i == 0), *_product(num, alone=not den)]
        if den:
            is_sum = not isinstance(den[0], str) and bool(den[0].is_Add)
            below = _product(den, alone=len(den) == 1 and not is_sum)
            runs += [Run("/"), *(below if len(den) == 1 else _bracketed(below))]
    return tuple(runs)


def _product(factors: list[sp.Expr | str], alone: bool = True) -> tuple[Run, ...]:
    if not factors:
        return (Run("1"),)
    runs: list[Run] = []
    root = False
    for factor in factors:
        part = _factor(factor, brackets=len(factors) > 1 or not alone)
        digits = part[0].text[0].isdigit() and runs
        names = runs and (runs[-1].rise < 0 or len(runs[-1].text) > 1 < len(part[0].text))
        if digits or names or root:
            runs.append(Run("·" if digits else THIN))
        root = part[0].text == "√"
        runs += part
    return tuple(runs)


def _factor(factor: sp.Expr | str, brackets: bool) -> tuple[Run, ...]:
    if isinstance(factor, str):
        return (Run(factor),)
    if factor.is_Symbol:
        return symbol(factor.name).runs
    if isinstance(factor, sp.exp):
        return _power((Run("e", italic=True),), factor.exp)
    if factor.is_Add:
        return _bracketed(_inline(factor)) if brackets else _inline(factor)
    if factor.is_Pow:
        base, exponent = factor.as_base_exp()
        if exponent == sp.Rational(1, 2):
            return (Run("√"), *_atom(base))
        return _power(_atom(base), exponent)
    if factor.is_Function:
        inside = [run for arg in factor.args for run in (Run(", "), *_inline(arg))][1:]
        return (Run(factor.func.__name__), *_bracketed(inside))
    if factor.is_Mul:
        return _bracketed(_inline(factor))
    return (Run(str(factor)),)


def _atom(base: sp.Expr) -> tuple[Run, ...]:
    runs = _inline(base)
    return runs if base.is_Symbol or base.is_Integer else _bracketed(runs)


def _power(base: Iterable[Run], exponent: sp.Expr) -> tuple[Run, ...]:
    return (*base, *(run.script(0.4) for run in _inline(exponent)))


def _bracketed(runs: Iterable[Run]) -> tuple[Run, ...]:
    return (Run("("), *runs, Run(")"))


def _split(expr: sp.Expr) -> tuple[bool, list[sp.Expr | str], list[sp.Expr | str]]:
    """(negative, factors above the bar, factors below it); e^{−τs} stays above."""
    negative = False
    above: list[sp.Expr | str] = []
    below: list[sp.Expr | str] = []
    for factor in sp.Mul.make_args(expr):
        if factor.is_Rational:
            negative ^= bool(factor < 0)
            num, den = _number(abs(factor))
            above[:0] = [num] if num != "1" else []
            below[:0] = [den] if den != "1" else []
        elif factor.is_Pow and factor.exp.could_extract_minus_sign():
            below.append(factor.base**-factor.exp)
        else:
            above.append(factor)
    return negative, sorted(above, key=_rank), sorted(below, key=_rank)


def _number(value: sp.Rational) -> tuple[str, str]:
    """Numerator and denominator; a short finite decimal is one number, 0.08 and not 2/25."""
    p, q = int(value.p), int(value.q)
    if q != 1 and (p != 1 or q > 9) and (10**6 % q == 0) and len(f"{p / q:.6g}") <= 7:
        return f"{p / q:.6g}", "1"
    return str(p), str(q)


def _rank(factor: sp.Expr | str) -> tuple[int, str]:
    """Order of factors as one writes them: numbers, parameters, s, sums, delays."""
    if isinstance(factor, str):
        return 0, ""
    if isinstance(factor, sp.exp):
        return 5, str(factor)
    if factor.as_base_exp()[0].is_Add:
        return 4, str(factor)
    if factor.has(s):
        return 3, str(factor)
    indexed = factor.is_Symbol and "_" in factor.name  # 2ζω₀ rather than 2ω₀ζ
    return 1 + indexed, factor.name if factor.is_Symbol else str(factor)


def _terms(expr: sp.Expr) -> list[sp.Expr]:
    """Terms of a sum, highest power of s first; a positive one leads where there is one."""

    def power(term: sp.Expr) -> int:
        factors = (factor.as_base_exp() for factor in sp.Mul.make_args(term))
        return sum(int(exponent) for base, exponent in factors if base == s and exponent.is_Integer)

    terms = sorted(expr.as_ordered_terms(), key=lambda term: -power(term))
    first = next((t for t in terms if not t.could_extract_minus_sign()), terms[0])
    return [first, *(t for t in terms if t is not first)]
