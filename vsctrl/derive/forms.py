"""How a derived expression is written: the shortest of the forms that are cheap to find."""

from collections.abc import Sequence

from sympy import Add, Expr, Poly, Symbol, count_ops, factor, factor_terms, fraction

#: Factors of longer sums are rarely there, and never found at once.
MOST_TERMS = 12


def shortest(entry: Expr, linear: Sequence[Symbol] = ()) -> Expr:
    """The same quotient of expanded sums, as ``cancel`` leaves it, in the shortest form.

    Forms are factors, a sum over the ``linear`` symbols with factors as coefficients, and the
    quotient as it is; of equals the first.
    """
    numerator, denominator = fraction(entry)
    below = factor(denominator)
    candidates = [_factored(numerator) / below]
    linear = [symbol for symbol in linear if numerator.has(symbol)]
    if linear:
        candidates.append(factor_terms(Add(*_terms(numerator, linear))) / below)
    return min((*candidates, entry), key=count_ops)


def _terms(polynomial: Expr, linear: Sequence[Symbol]) -> list[Expr]:
    """The terms of a polynomial in the ``linear`` symbols, each with its coefficient factored."""
    return [
        _factored(coefficient) * Poly({powers: 1}, *linear).as_expr()
        for powers, coefficient in Poly(polynomial, *linear).terms()
    ]


def _factored(polynomial: Expr) -> Expr:
    return factor(polynomial) if len(Add.make_args(polynomial)) <= MOST_TERMS else polynomial
