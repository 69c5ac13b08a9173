"""From wiring to formulas: the diagram solved once in symbols for its block gains.

Each block is one letter g₁…gₙ while the loop equations are solved, fraction-free; what the
letters stand for is put in afterwards. That keeps a fourteen-block diagram as quick to solve as its
loops are few, keeps each delay a symbol of its own until the very end, and gives numeric
evaluation a form that has not been multiplied out. A state space of many gains and integrators has
too many letters for that: there gains that are numbers are put in before, and all blocks that are
alike share a letter meanwhile.
"""

from __future__ import annotations

from functools import cache, cached_property
from typing import Any

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from vsctrl.diagram.description.wiring import Wiring, resolve
from vsctrl.diagram.numerics.graphs import reached
from vsctrl.errors import InputError
from vsctrl.symbols import s

MANY = 16  #: blocks that are numbers, from which on they are put in before equations are solved


class GainForm:
    """Every channel of a diagram as N(g)/Δ(g), polynomials in its block gains g₁…gₙ."""

    def __init__(self, diagram: Wiring) -> None:
        self.diagram = diagram
        self.letters = sp.symbols(f"g1:{len(diagram.blocks) + 1}")
        self._numbers = _numbers(diagram)
        letter_of = dict(zip((b.output for b in diagram.blocks), self.letters, strict=True))
        blocks = [block for block in diagram.blocks if block.output not in self._numbers]
        #: A letter → those of all blocks that it stands for while the equations are solved.
        self._alike: dict[sp.Symbol, list[sp.Symbol]] = {}
        first: dict[Any, sp.Symbol] = {}
        for block in blocks:
            own = letter_of[block.output]
            key = block.expr if self._numbers else block.output
            self._alike.setdefault(first.setdefault(key, own), []).append(own)
        domain = sp.QQ if self._numbers else sp.ZZ
        self.ring = domain[tuple(self._alike)] if self._alike else domain
        index = {block.output: i for i, block in enumerate(blocks)}
        n = len(index)
        rows = [[self.ring.zero] * n for _ in range(n)]
        drive: dict[str, list[Any]] = {u: [self.ring.zero] * n for u in diagram.inputs}
        for i, block in enumerate(blocks):
            rows[i][i] += self.ring.one
            key = block.expr if self._numbers else block.output
            gain = self.ring.from_sympy(first[key])
            for leaf, factor in self._leaves(block.input).items():
                if leaf in index:
                    rows[i][index[leaf]] -= factor * gain
                else:
                    drive[leaf][i] += factor * gain
        self._index = index
        self._matrix = DomainMatrix(rows, (n, n), self.ring).to_sparse()
        self._drive = drive
        self.channel = cache(self._channel)
        self._solve = cache(self._solve_input)

    def _leaves(self, signal: str) -> dict[str, Any]:
        """The signal as a sum of inputs and of outputs of blocks that are letters."""
        total: dict[str, Any] = {}
        for leaf, factor in resolve(self.diagram, signal).items():
            parts = {leaf: 1}
            if leaf in self._numbers:
                value, source = self._numbers[leaf]
                parts = {name: value * part for name, part in self._leaves(source).items()}
            for name, part in parts.items():
                total[name] = total.get(name, 0) + factor * part
        return {name: factor for name, factor in total.items() if factor}

    def _in_letters(self, polynomial: Any) -> sp.Expr:
        """A polynomial of first degree in each letter: gᵏ is a product of k that are alike."""
        expr = self.ring.to_sympy(polynomial)
        if all(len(letters) == 1 for letters in self._alike.values()):
            return expr
        groups = list(self._alike.values())
        terms = []
        for powers, factor in sp.Poly(expr, *self._alike).terms():
            held = [g for k, alike in zip(powers, groups, strict=True) for g in alike[:k]]
            terms.append(factor * sp.Mul(*held))
        return sp.Add(*terms)

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
        for leaf, factor in self._leaves(target).items():
            if leaf in self._index:
                total += factor * numerators[self._index[leaf]]
            elif leaf == source:
                total += factor * determinant
        num, den = total.cancel(determinant) if self._alike else (total, determinant)
        return self._in_letters(num), self._in_letters(den)


def _numbers(diagram: Wiring) -> dict[str, tuple[Any, str]]:
    """Output → (number, input) of blocks that are numbers and in no loop of such; few are none."""
    found = {
        block.output: (sp.QQ.from_sympy(block.expr), block.input)
        for block in diagram.blocks
        if block.expr.is_Rational
    }
    if len(found) < MANY:
        return {}

    def before(name: str) -> list[str]:
        return [leaf for leaf in resolve(diagram, found[name][1]) if leaf in found]

    looped = {name for name in found if name in reached(before(name), before)}
    return {name: pair for name, pair in found.items() if name not in looped}


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
