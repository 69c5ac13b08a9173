"""Laurent series of transfer functions at s = 0, of which the final-value theorem is read off.

Rational in s and in constant delays, they have a Laurent series there whatever their parameters
are, and it takes nothing but polynomials to find it.
"""

import sympy as sp

from vsctrl.diagram.description.blocks import delays_as_symbols
from vsctrl.symbols import s


def laurent(transfer: sp.Expr, top: int) -> tuple[int, tuple[sp.Expr, ...]]:
    """(m, coefficients) of c₀ sᵐ + c₁ sᵐ⁺¹ + … up to s^top, c₀ ≠ 0, m < 0 for a pole at s = 0.

    Powers of s that numerator and denominator share are cancelled after the delays are expanded,
    so a hidden integrator does not disturb. There is always c₀, and a transfer function that is 0
    has no other. Errors: `InputError` for what is not rational in s and constant delays.
    """
    plain, delays = delays_as_symbols(sp.sympify(transfer, strict=True), "transfer")
    fraction = sp.fraction(sp.cancel(sp.together(plain)))
    # A sum of n exponentials times polynomials of degree m vanishes at most to order n (m + 1) − 1.
    most = max(_most_zeros(part, tuple(delays)) for part in fraction)

    def sides(terms: int) -> list[list[sp.Expr]]:
        near = {q: _delay_series(delay, most + terms) for q, delay in delays.items()}
        return [_stripped(_power_series(part.xreplace(near), most + terms)) for part in fraction]

    num, den = sides(1)
    if not num:
        return 0, (sp.S.Zero,)
    first = len(den) - len(num)
    terms = max(top - first + 1, 1)
    num, den = sides(terms)
    coefficients: list[sp.Expr] = []
    for k in range(terms):
        rest = num[k] - sum(den[k - i] * coefficients[i] for i in range(k))
        coefficients.append(sp.expand(sp.factor(rest / den[0])))
    return first, tuple(coefficients)


def coefficient(series: tuple[int, tuple[sp.Expr, ...]], power: int) -> sp.Expr:
    """That of s to a power in what `laurent` found, 0 where it found none."""
    first, coefficients = series
    return coefficients[power - first] if 0 <= power - first < len(coefficients) else sp.S.Zero


def _most_zeros(expr: sp.Expr, delays: tuple[sp.Symbol, ...]) -> int:
    powers = sp.Poly(expr, s, *delays).monoms()
    return len({power[1:] for power in powers}) * (max(power[0] for power in powers) + 1)


def _delay_series(delay: sp.Expr, order: int) -> sp.Expr:
    return sp.Add(*[(-delay * s) ** k / sp.factorial(k) for k in range(order)])


def _power_series(expr: sp.Expr, order: int) -> list[sp.Expr]:
    """The coefficients of s⁰ … sᵒʳᵈᵉʳ⁻¹ of a polynomial in s."""
    poly = sp.Poly(expr, s)
    return [sp.expand(poly.coeff_monomial(s**k)) for k in range(order)]


def _stripped(series: list[sp.Expr]) -> list[sp.Expr]:
    """The series from its first coefficient that is not zero on, none where all are."""
    first = next((k for k, c in enumerate(series) if c != 0), len(series))
    return series[first:]
