"""Factors without luck, against SymPy's own where that is quick."""

import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from sympy import symbols

from vsctrl.derive.simplify import factored

x, y, z, w = symbols("x y z w")
monomials = st.tuples(st.integers(-4, 4), *(st.integers(0, 1 + (n > 0)) for n in range(4))).map(
    lambda p: p[0] * x ** p[1] * y ** p[2] * z ** p[3] * w ** p[4]
)
polynomials = st.lists(monomials, min_size=1, max_size=4).map(lambda terms: sp.Add(*terms))


@given(polynomials, polynomials, st.sampled_from([1, -1, sp.Rational(2, 3), -6]))
def test_factors_are_those_of_sympy_written_as_sympy_writes_them(p, q, number):
    product = sp.expand(number * p * q)
    assert factored(product) == sp.factor(product)


def test_a_polynomial_that_is_linear_in_a_symbol_is_never_searched(monkeypatch):
    # SymPy 1.14 takes 20 s over it from one random point in twenty: it is in L of a_n x_g.
    F_y, a_n, n_02, n_11, n_20, u, v, x_g, y_g, skew = symbols("F_y a_n n_02 n_11 n_20 u v x y s")
    unlucky = a_n * (
        F_y**2 * ((n_02 + n_20) * (u - x_g) + n_11 * y_g)
        - F_y * skew * ((n_02 + n_20) * v - 2 * n_20 * y_g)
        - skew**2 * n_11 * y_g
    )
    searched = []
    monkeypatch.setattr("vsctrl.derive.simplify.sp.factor", lambda p: searched.append(p) or p)
    assert sp.expand(factored(sp.expand(unlucky)) - unlucky) == 0
    assert not any(p.is_Add for p in searched)
