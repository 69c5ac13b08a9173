"""A block of high order as sections of order one and two in series.

The coefficients of a polynomial of high degree hide its roots: of (s + 1)³⁰ in floats they lie up
to 0.3 off, and its value at s = j has lost five digits. Its factors hide nothing. They are found
before there are floats: repeated ones exactly, by the square-free decomposition, and what is then
left of a polynomial without parameters by its roots to 30 digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import sympy as sp

from vsctrl.symbols import s

HIGHEST = 4  #: degree up to which a denominator is left as it is, if no root is threefold
DIGITS = 30

Section = tuple[sp.Expr, sp.Expr]  #: numerator and denominator


@dataclass
class _Stage:
    """A section that takes factors of the numerator while it stays proper."""

    num: sp.Poly
    den: sp.Poly

    @property
    def room(self) -> int:
        """By how many degrees the numerator may grow."""
        return int(self.den.degree() - self.num.degree())


@lru_cache(maxsize=256)
def sections(num: sp.Expr, den: sp.Expr) -> tuple[Section, ...]:
    """Sections whose product is num/den, polynomials in s; num in delay symbols, too.

    One where the order is low, where the denominator holds more than s and parameters, and where
    the numerator is neither a polynomial in s times one in the delays nor of low order.
    """
    below = _polynomial(den)
    if below is None or below.degree() < 3 or num == 0:
        return ((num, den),)
    factors = below.sqf_list()[1]
    if below.degree() <= HIGHEST and max(times for _, times in factors) < 3:
        return ((num, den),)
    stages = [_Stage(sp.Poly(1, s), factor) for factor in _split(factors)]
    together, numerators = _numerator(num)
    for factor in sorted(numerators, key=lambda f: -int(f.degree())):
        _place(factor, stages)
    *front, last = stages
    if sp.degree(together, s) > max(last.room, 0):
        return ((num, den),)
    lead = below.LC() / sp.prod(stage.den.LC() for stage in stages)
    tail = last.num.as_expr() * together, last.den.as_expr() * lead
    return (*((stage.num.as_expr(), stage.den.as_expr()) for stage in front), tail)


def _polynomial(expr: sp.Expr) -> sp.Poly | None:
    """The expression as a polynomial in s whose coefficients are rational in parameters."""
    try:
        poly = sp.Poly(expr, s)
    except sp.PolynomialError:
        return None
    parameters = expr.free_symbols - {s}
    # The symbols of delays stand for functions of s.
    plain = not any(a.name.startswith("q[") for a in parameters)
    return poly if plain and not poly.domain.is_EX else None


def _numerator(num: sp.Expr) -> tuple[sp.Expr, list[sp.Poly]]:
    """What has to stay together, and the factors in s alone."""
    together, factors = sp.Integer(1), []
    for factor in sp.Mul.make_args(sp.factor_terms(num)):
        poly = _polynomial(factor)
        if poly is None or not poly.degree():
            together *= factor
            continue
        own = _split(poly.sqf_list()[1])
        together *= poly.LC() / sp.prod(part.LC() for part in own)
        factors += own
    return together, factors


def _split(factors: list[tuple[sp.Poly, int]]) -> list[sp.Poly]:
    """Each factor as often as it occurs, those without parameters as ones of degree 1 and 2."""
    out: list[sp.Poly] = []
    for factor, times in factors:
        numeric = not factor.free_symbols_in_domain
        parts = _real_factors(factor) if numeric and factor.degree() > 2 else [factor]
        out += [part for part in parts for _ in range(times)]
    return out


def _real_factors(poly: sp.Poly) -> list[sp.Poly]:
    """A square-free polynomial with rational coefficients by its roots, conjugates together."""
    import mpmath

    with mpmath.workdps(DIGITS):
        top = poly.LC()
        coefficients = [mpmath.mpf(int((c / top).p)) / int((c / top).q) for c in poly.all_coeffs()]
        # What floats know of the roots saves most of the iterations, if it tells them apart.
        start = np.roots([float(c) for c in coefficients])
        begin = start.tolist() if len(set(start)) == poly.degree() else None
        extra = 20 * poly.degree() + 200
        try:
            roots = mpmath.polyroots(coefficients, maxsteps=500, extraprec=extra, roots_init=begin)
        except mpmath.libmp.libhyper.NoConvergence:
            return [poly]
        near = mpmath.mpf(10) ** (5 - DIGITS)
        out = []
        for root in roots:
            if abs(mpmath.im(root)) <= near * abs(root):
                out.append([1, -mpmath.re(root)])
            elif mpmath.im(root) > 0:
                out.append([1, -2 * mpmath.re(root), abs(root) ** 2])
        exact = [[sp.Rational(str(mpmath.nstr(c, 25))) for c in side] for side in out]
    if sum(len(side) - 1 for side in exact) != poly.degree():
        return [poly]
    return [sp.Poly(side, s, domain="QQ") for side in exact]


def _place(factor: sp.Poly, stages: list[_Stage]) -> None:
    """Multiply a factor of the numerator to a stage that has room, or to two that become one."""
    roomy = [stage for stage in stages if stage.room >= factor.degree()]
    stages.sort(key=lambda stage: stage.room)
    if not roomy and sum(stage.room for stage in stages[-2:]) >= factor.degree():
        other, one = stages.pop(), stages.pop()
        roomy = [_Stage(one.num * other.num, one.den * other.den)]
        stages += roomy
    stage = min(roomy or stages, key=lambda stage: stage.room)
    stage.num *= factor
