"""Entries of derived matrices as short as a reader wants them: quotients, cos and sin.

SymPy's ``cancel`` knows no relation between cos and sin, and its ``simplify`` takes seconds. What
places put into a chain rule are rational functions of symbols, cos and sin, and roots of those, for
which one relation is enough. Every derivation ends in ``shortest``.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

# Factors of longer sums are rarely there, and never found at once.
_MOST_TERMS = 12

# Of a gradient: from so many on a product with it is not put over one denominator by ``cancel``.
_LONG = 100

_Pairs = Sequence[tuple[sp.Symbol, sp.Symbol]]


def shortened(entry: sp.Expr) -> sp.Expr:
    """The same rational function of symbols, cos and sin, without what cos² + sin² = 1 hides.

    Sums are expanded unless that multiplies out a denominator such as (z² − R²)².
    """
    angles = sorted({e.args[0] for e in entry.atoms(sp.cos, sp.sin)}, key=str)
    if not angles:
        return _reduced(entry, ())
    pairs = [(sp.Dummy("c", real=True), sp.Dummy("s", real=True)) for _ in angles]
    names: dict[sp.Expr, sp.Symbol] = {}
    for angle, (c, s) in zip(angles, pairs, strict=True):
        names |= {sp.cos(angle): c, sp.sin(angle): s}
    named = entry.xreplace(names)
    # A length √(l² cos² + l² sin²) is l; only then do numerator and denominator share a factor.
    roots = [power for power in named.atoms(sp.Pow) if not power.exp.is_Integer]
    named = named.xreplace({r: factored(_reduced(r.base, pairs)) ** r.exp for r in roots})
    both = (_reduced(named, pairs), _reduced(named, [pair[::-1] for pair in pairs]))
    return min(both, key=sp.count_ops).xreplace({name: value for value, name in names.items()})


def _reduced(entry: sp.Expr, pairs: _Pairs) -> sp.Expr:
    """The quotient without powers of the second of each pair, whose squares sum to 1."""
    whole = sp.expand(entry)
    # Only under a sum can anything be left to cancel; without, ``cancel`` is slow for nothing.
    if any(power.base.is_Add and power.exp.is_negative for power in whole.atoms(sp.Pow)):
        quotient = sp.cancel(entry)
        above, below = (_folded(part, pairs) for part in sp.fraction(quotient))
        return shortest(sp.cancel(above / below) if pairs else quotient)
    return _folded(whole, pairs)


def _folded(whole: sp.Expr, pairs: _Pairs) -> sp.Expr:
    """The expanded sum of monomials with removed² = 1 − kept²."""
    for kept, removed in pairs:
        whole = whole.replace(
            lambda e, r=removed: e.is_Pow and e.base == r and e.exp.is_Integer and e.exp > 1,
            lambda e, k=kept, r=removed: (1 - k**2) ** (e.exp // 2) * r ** (e.exp % 2),
        )
    return sp.expand(whole)


def shortest(quotient: sp.Expr, linear: Sequence[sp.Symbol] = ()) -> sp.Expr:
    """A quotient, as ``cancel`` leaves it, in the shortest of the forms that are cheap to find.

    Forms are factors, a sum over the ``linear`` symbols with factors as coefficients, the sum of
    single quotients and the quotient as it is; of equals the first.
    """
    above, below = sp.fraction(quotient)
    below = factored(below)
    candidates = [_factored(above) / below]
    linear = [symbol for symbol in linear if above.has(symbol)]
    if linear:
        candidates.append(sp.factor_terms(sp.Add(*_terms(above, linear))) / below)
    return min((*candidates, sp.expand(quotient), quotient), key=sp.count_ops)


def _terms(polynomial: sp.Expr, linear: Sequence[sp.Symbol]) -> list[sp.Expr]:
    """The terms of a polynomial in the ``linear`` symbols, each with its coefficient factored."""
    return [
        _factored(coefficient) * sp.Poly({powers: 1}, *linear).as_expr()
        for powers, coefficient in sp.Poly(polynomial, *linear).terms()
    ]


def _factored(polynomial: sp.Expr) -> sp.Expr:
    return factored(polynomial) if len(sp.Add.make_args(polynomial)) <= _MOST_TERMS else polynomial


def factored(expression: sp.Expr) -> sp.Expr:
    """``sp.factor``, but without its search where a polynomial is linear in one of its symbols.

    Over many symbols SymPy lifts factors from a random point, which takes seconds as a rule and
    minutes at unlucky ones. A polynomial c₁ x + c₀ is gcd(c₀, c₁) times one that has no factor.
    """
    number, factors, rest = sp.S.One, [], expression
    while (x := _linear_in(rest)) is not None:
        common, part = sp.Poly(rest, x).primitive()
        # As SymPy writes a factor: numbers in front, and the leading coefficient positive.
        by, part = sp.Poly(part.as_expr()).primitive()
        sign = -1 if part.LC() < 0 else 1
        number, rest = number * sign * by, common
        factors.append((sign * part).as_expr())
    by, rest = sp.factor(rest).as_coeff_Mul()
    number, product = number * by, sp.Mul(rest, *factors)
    # A number, unless it is a sign, is to stay in front of a sum.
    return sp.Mul(number, product, evaluate=abs(number) == 1 or not product.is_Add)


def _linear_in(expression: sp.Expr) -> sp.Symbol | None:
    """A symbol in which a polynomial of several terms is of first degree, if there is one."""
    if not expression.is_Add or not expression.is_polynomial(*expression.free_symbols):
        return None
    whole = sp.Poly(expression)
    return next((x for x in whole.gens if whole.degree(x) == 1), None)


def is_long(gradient: sp.Matrix) -> bool:
    """Whether it is rational and so long that ``cancel`` of a product would take minutes."""
    rational = all(entry.is_rational_function(*entry.free_symbols) for entry in gradient)
    return rational and sum(map(sp.count_ops, gradient)) > _LONG


def contracted(
    gradient: sp.Matrix, rates: sp.Matrix, linear: Sequence[sp.Symbol]
) -> sp.ImmutableMatrix:
    """The product of two matrices of rational functions, each entry in lowest terms.

    Only factors of the denominators of the first and the second can be left below, so that trial
    divisions by them do what ``cancel`` does by the greatest common divisor. What stays longer than
    the chain rule itself is left as that.
    """
    generators = sorted(gradient.free_symbols | rates.free_symbols, key=str)
    ring = sp.QQ[generators] if generators else sp.QQ
    left, right = (
        [[_Quotient.of(matrix[i, j], ring) for j in range(matrix.cols)] for i in range(matrix.rows)]
        for matrix in (gradient, rates)
    )
    rows = [
        [
            _sum([g * row[j] for g, row in zip(each, right, strict=True)], ring)
            for j in range(rates.cols)
        ]
        for each in left
    ]
    short = [quotient.shortest(linear) for row in rows for quotient in row]
    chain = [
        sp.Add(
            *(g.shortest(()) * row[j].shortest(linear) for g, row in zip(each, right, strict=True))
        )
        for each in left
        for j in range(rates.cols)
    ]
    entries = [min(pair, key=sp.count_ops) for pair in zip(short, chain, strict=True)]
    return sp.ImmutableMatrix(gradient.rows, rates.cols, entries)


@dataclass(frozen=True)
class _Quotient:
    """A polynomial of a ring over a product of powers of irreducible ones."""

    ring: Any
    above: Any
    below: dict[Any, int]

    @classmethod
    def of(cls, entry: sp.Expr, ring: Any) -> "_Quotient":
        above, below = (ring.from_sympy(side) for side in sp.fraction(sp.cancel(entry)))
        number, factors = below.factor_list()
        return cls(ring, above * ring.convert(1 / number), dict(factors))

    def __mul__(self, other: "_Quotient") -> "_Quotient":
        below = Counter(self.below)
        below.update(other.below)
        return _Quotient(self.ring, self.above * other.above, dict(below))

    def reduced(self) -> "_Quotient":
        above, below = self.above, {}
        for factor, power in self.below.items() if above else ():
            left = power
            while left:
                quotient, rest = divmod(above, factor)
                if rest:
                    below[factor] = left
                    break
                above, left = quotient, left - 1
        return _Quotient(self.ring, above, below)

    def shortest(self, linear: Sequence[sp.Symbol]) -> sp.Expr:
        number, above = self.above.primitive() if self.above else (0, self.above)
        below = sp.Mul(*(self.ring.to_sympy(f) ** power for f, power in self.below.items()))
        top = self.ring.to_sympy(above)
        linear = [symbol for symbol in linear if top.has(symbol)]
        forms = [top, sp.Add(*_terms(top, linear))] if linear else [_factored(top)]
        return sp.Rational(number) * min(forms, key=sp.count_ops) / below


def _sum(terms: Sequence[_Quotient], ring: Any) -> _Quotient:
    below: dict[Any, int] = {}
    for term in terms:
        for factor, power in term.below.items():
            below[factor] = max(power, below.get(factor, 0))
    above = ring.zero
    for term in terms:
        part = term.above
        for factor, power in below.items():
            part = part * factor ** (power - term.below.get(factor, 0))
        above = above + part
    return _Quotient(ring, above, below).reduced()
