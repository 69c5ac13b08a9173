"""Expressions as text that `formula` reads back: the same function of s and its parameters."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp

from vsctrl.checks import quoted
from vsctrl.diagram.document.formula import FUNCTIONS, LONGEST, RESERVED
from vsctrl.diagram.document.names import ascii_name, keyword
from vsctrl.errors import InputError
from vsctrl.symbols import s

MOST_DECIMALS = 17  #: that a number is written with; those that need more are fractions
SUM, PRODUCT, POWER, ATOM = range(4)  #: what binds more is greater

_BY_CLASS = {function: name for name, function in FUNCTIONS.items() if name != "sqrt"}


def render(expr: sp.Expr) -> str:
    """The text of an expression, decimals where a number is one.

    Errors: `InputError` for a function that the grammar has not, and for names that are none.
    """
    text = _text(expr, SUM)
    if len(text) > LONGEST:
        raise InputError(
            f"to_toml: a transfer function would be {len(text)} characters long, and a file takes "
            f"{LONGEST}; split its block into several."
        )
    return text


def name_of(symbol: sp.Symbol) -> str:
    """What a parameter is called in a file."""
    name = ascii_name(keyword(symbol))
    if name in RESERVED or name == "s" != symbol.name or not name.isidentifier():
        raise InputError(
            f"to_toml: a parameter cannot be called {quoted(symbol.name)} in a file; "
            "name it with letters, digits and _, but not like a function."
        )
    return name


def _text(expr: sp.Expr, around: int) -> str:
    """The text, in parentheses where it binds less than what is around it."""
    binds, text = _part(expr)
    return f"({text})" if binds < around else text


def _part(expr: sp.Expr) -> tuple[int, str]:
    if expr.is_Rational:
        return _number(Fraction(int(expr.p), int(expr.q)))
    if expr.is_Symbol:
        return ATOM, name_of(expr)
    if expr is sp.pi:
        return ATOM, "pi"
    if expr is sp.E:
        return ATOM, "exp(1)"
    if expr.is_Add:
        return SUM, _sum(expr)
    if expr.is_Mul:
        return _product(expr)
    if isinstance(expr, sp.exp):
        return ATOM, f"exp({_text(expr.exp, SUM)})"
    if expr.is_Pow:
        return _power(expr)
    if type(expr) in _BY_CLASS:
        return ATOM, f"{_BY_CLASS[type(expr)]}({_text(expr.args[0], SUM)})"
    raise InputError(
        f"to_toml: {quoted(str(expr))} cannot be written to a file, which knows "
        f"+ - * / ^ and {', '.join(FUNCTIONS)} of real numbers; give it as a parameter."
    )


def _sum(expr: sp.Expr) -> str:
    first, *rest = (_text(term, SUM) for term in expr.as_ordered_terms())
    for term in rest:
        first += f" - {term[1:]}" if term.startswith("-") else f" + {term}"
    return first


def _product(expr: sp.Expr) -> tuple[int, str]:
    coefficient, rest = expr.as_coeff_Mul()
    sign = "-" if coefficient < 0 else ""
    above, below = [], []
    number = Fraction(int(abs(coefficient).p), int(coefficient.q))
    factors = rest.as_ordered_factors()
    if all(factor.is_Symbol for factor in factors):
        factors.sort(key=lambda factor: factor == s)  # exp(-theta*s), as everybody writes it
    for factor in factors:
        base, exponent = factor.as_base_exp()
        if exponent.is_negative and exponent.is_Rational and not isinstance(factor, sp.exp):
            below.append(_text(base**-exponent, POWER))
        else:
            above.append(_text(factor, PRODUCT if not factor.is_Mul else POWER))
    if number != 1:
        binds, text = _number(number)
        if binds == ATOM:
            above.insert(0, text)
        else:
            above[:0] = [str(number.numerator)] if number.numerator != 1 else []
            below.insert(0, str(number.denominator))
    text = "*".join(above) or "1"
    if below:
        text += "/" + (below[0] if len(below) == 1 else f"({'*'.join(below)})")
    return (SUM if sign else PRODUCT), sign + text


def _power(expr: sp.Expr) -> tuple[int, str]:
    base, exponent = expr.as_base_exp()
    if exponent == sp.Rational(1, 2):
        return ATOM, f"sqrt({_text(base, SUM)})"
    if exponent.is_Rational and exponent.is_negative:
        return PRODUCT, f"1/{_text(base**-exponent, POWER)}"
    return POWER, f"{_text(base, ATOM)}^{_text(exponent, ATOM)}"


def _number(value: Fraction) -> tuple[int, str]:
    """A whole number or decimal as one, any other as a fraction."""
    sign = "-" if value < 0 else ""
    size = abs(value)
    text = str(size.numerator)
    if size.denominator != 1:
        text = _decimal(size) or f"{size.numerator}/{size.denominator}"
    if sign:
        return SUM, sign + text
    return (PRODUCT if "/" in text else ATOM), text


def _decimal(value: Fraction) -> str:
    """The decimal that a fraction is, empty where it has no end or too many digits."""
    for digits in range(1, MOST_DECIMALS + 1):
        scaled = value * 10**digits
        if scaled.denominator == 1:
            whole, rest = divmod(scaled.numerator, 10**digits)
            return f"{whole}.{rest:0{digits}d}"
    return ""
