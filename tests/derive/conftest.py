"""Algebra modulo r_x² + r_y² + r_z² = 1, shared by the tests that take the axis as symbols."""

from collections.abc import Callable

import pytest
from sympy import QQ, Dummy, Expr, cos, default_sort_key, fraction, ring, sin, together

from vsctrl.symbols import omega, r_x, r_y, r_z, t


@pytest.fixture
def vanishes() -> Callable[[Expr], bool]:
    """Whether an expression in sin ωt and cos ωt is zero for every unit axis r."""
    S, C = Dummy("S"), Dummy("C")
    relations = [r_x**2 + r_y**2 + r_z**2 - 1, S**2 + C**2 - 1]

    def decide(expression: Expr) -> bool:
        expression = together(expression.subs({sin(omega * t): S, cos(omega * t): C}))
        numerator = fraction(expression)[0]
        others = numerator.free_symbols - {r_x, r_y, r_z, S, C}
        R, *_ = ring([r_x, r_y, r_z, S, C, *sorted(others, key=default_sort_key)], QQ)
        # The leading terms r_x² and S² are coprime, so the two relations are a Groebner basis:
        # the numerator is a combination of them exactly when the remainder is zero.
        return not R.from_expr(numerator).rem([R.from_expr(f) for f in relations])

    return decide
