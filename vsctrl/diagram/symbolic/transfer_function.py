"""From wiring to formulas: the diagram solved once in symbols for its block gains.

Each block is one letter g₁…gₙ while the loop equations are solved, fraction-free; what the
letters stand for is put in afterwards. That keeps a fourteen-block diagram as quick to solve as its
loops are few, keeps each delay a symbol of its own until the very end, and gives numeric
evaluation a form that has not been multiplied out.
"""

from __future__ import annotations

from functools import cache, cached_property
from typing import Any

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from vsctrl.diagram.description.wiring import Wiring, resolve
from vsctrl.errors import InputError
from vsctrl.symbols import s


class GainForm:
    """Every channel of a diagram as N(g)/Δ(g), polynomials in its block gains g₁…gₙ."""

    def __init__(self, diagram: Wiring) -> None:
        self.diagram = diagram
        self.letters = sp.symbols(f"g1:{len(diagram.blocks) + 1}")
        self.ring = sp.ZZ[self.letters] if self.letters else sp.ZZ
        index = {block.output: i for i, block in enumerate(diagram.blocks)}
        n = len(index)
        rows = [[self.ring.zero] * n for _ in range(n)]
        drive: dict[str, list[Any]] = {u: [self.ring.zero] * n for u in diagram.inputs}
        for i, block in enumerate(diagram.blocks):
            rows[i][i] += self.ring.one
            gain = self.ring.from_sympy(self.letters[i])
            for leaf, factor in resolve(diagram, block.input).items():
                if leaf in index:
                    rows[i][index[leaf]] -= factor * gain
                else:
                    drive[leaf][i] += factor * gain
        self._index = index
        self._matrix = DomainMatrix(rows, (n, n), self.ring).to_sparse()
        self._drive = drive
        self.channel = cache(self._channel)
        self._solve = cache(self._solve_input)

    def _solve_input(self, source: str) -> tuple[list[Any], Any]:
        n = len(self._index)
        column = DomainMatrix([[g] for g in self._drive[source]], (n, 1), self.ring).to_sparse()
        try:
            numerators, determinant = self._matrix.solve_den(column)
        except sp.polys.matrices.exceptions.DMNonInvertibleMatrixError:  # pragma: no cover
            raise InputError(
                "Diagram: its loop equations have no unique solution; look for a loop of gain 1 "
                f"among {', '.join(block.name for block in self.diagram.blocks)}."
            ) from None
        return [row[0] for row in numerators.to_list()], determinant

    def _channel(self, source: str, target: str) -> tuple[sp.Expr, sp.Expr]:
        """(N, Δ) with target = N/Δ · source, common factors cancelled in the letters."""
        numerators, determinant = self._solve(source)
        total = self.ring.zero
        for leaf, factor in resolve(self.diagram, target).items():
            if leaf in self._index:
                total += factor * numerators[self._index[leaf]]
            elif leaf == source:
                total += factor * determinant
        num, den = total.cancel(determinant) if self.letters else (total, determinant)
        return self.ring.to_sympy(num), self.ring.to_sympy(den)


class Solved(Wiring):
    """A wiring with its loop equations solved."""

    @cached_property
    def gains(self) -> GainForm:
        """Every channel in the symbols of the block gains (solved once, on first use)."""
        return GainForm(self)


def expression(diagram: Solved, source: str, target: str) -> sp.Expr:
    """The channel's transfer function in lowest terms, delays written back as exp(−τ s)."""
    num, den = polynomials(diagram, source, target)
    delays = {q: sp.exp(-tau * s) for b in diagram.blocks for q, tau in b.rational.delays.items()}
    return sp.factor_terms(num).xreplace(delays) / sp.factor_terms(den).xreplace(delays)


def polynomials(diagram: Solved, source: str, target: str) -> tuple[sp.Expr, sp.Expr]:
    """Numerator and denominator of a channel, polynomials in s, delay symbols and parameters."""
    num, den = diagram.gains.channel(source, target)
    ratios = (b.rational.num_expr / b.rational.den_expr for b in diagram.blocks)
    gains = dict(zip(diagram.gains.letters, ratios, strict=True))
    bottom = sp.together(den.xreplace(gains))
    if bottom == 0:
        raise singular_loop(diagram)
    return sp.fraction(sp.cancel(sp.together(num.xreplace(gains)) / bottom))


def singular_loop(diagram: Wiring) -> InputError:
    """The refusal of a loop whose equations have no solution."""
    return InputError(
        f"transfer: the loop through {', '.join(block.name for block in diagram.blocks)} is "
        "singular (its return difference is zero); change one of the gains in it."
    )
