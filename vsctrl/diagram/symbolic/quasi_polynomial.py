"""Numerator and denominator of a channel, multiplied out: Q(s) = Σ c sᵏ e^{−sτ}.

A channel N/Δ is kept in its blocks' gains, which is better for its values. Where its zeros are, and
how far the argument of each side turns, is asked of the sides themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl.arrays import Array, Complex
from vsctrl.caching import Caching
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients, Side
from vsctrl.diagram.symbolic.order_at_zero import Terms

CANCELS = 1e-12  #: of the products that are added up, below which their sum is rounding


@dataclass(frozen=True)
class QuasiPolynomial(Caching):
    """Q(s) = Σ c sᵏ e^{−sτ} as (k, τ in seconds) → c, none of them 0; without terms it is 0."""

    terms: Side

    @cached_property
    def columns(self) -> tuple[Array, Array, Array]:
        """(k, τ, c) of the terms."""
        k, tau = ([float(key[i]) for key in self.terms] for i in (0, 1))
        return np.array(k), np.array(tau), np.array(list(self.terms.values()))

    @property
    def least_delay(self) -> Fraction:
        """The delay (s) that all terms have in common."""
        return min((tau for _, tau in self.terms), default=Fraction(0))

    def advanced(self, by: Fraction) -> QuasiPolynomial:
        """The same times e^{s·by}: every delay shorter by so many seconds."""
        return QuasiPolynomial({(k, tau - by): c for (k, tau), c in self.terms.items()})

    def reflected(self) -> QuasiPolynomial:
        """Q(−s) e^{−sτ}, τ the longest delay: the zeros on the other side of the axis."""
        longest = max((tau for _, tau in self.terms), default=Fraction(0))
        return QuasiPolynomial(
            {(k, longest - tau): (-1) ** k * c for (k, tau), c in self.terms.items()}
        )

    def derivative(self) -> QuasiPolynomial:
        """Q′(s)."""
        sums: Side = {}
        for (k, tau), c in self.terms.items():
            for key, part in (((k - 1, tau), k * c), ((k, tau), -float(tau) * c)):
                if part:
                    sums[key] = sums.get(key, 0.0) + part
        return QuasiPolynomial(sums)

    def __call__(self, s: NDArray[Any]) -> Complex:
        """The values at complex s (rad/s), any shape."""
        k, tau, c = self.columns
        s = np.asarray(s, complex)[..., None]
        return np.asarray((c * s**k * np.exp(-s * tau)).sum(axis=-1), complex)


def sides(
    form: tuple[Terms, Terms], blocks: list[BlockCoefficients]
) -> tuple[QuasiPolynomial, QuasiPolynomial]:
    """N and Δ of a channel whose terms in the gains of the blocks are given.

    Denominators of blocks that neither side depends on are left out, and so are coefficients that
    are but rounding of what cancels.
    """
    used = np.flatnonzero(form[0].holds.any(0) | form[1].holds.any(0))
    numbers = [blocks[i] for i in used]
    num, den = (_total(side.holds[:, used], side.factor, numbers) for side in form)
    return num, den


def _total(
    holds: NDArray[np.bool_], factors: Array, blocks: list[BlockCoefficients]
) -> QuasiPolynomial:
    sums: dict[tuple[int, Fraction], tuple[float, float]] = {}
    for row, factor in zip(holds, factors.tolist(), strict=True):
        chosen = [b.num if held else b.den for held, b in zip(row, blocks, strict=True)]
        product = reduce(_times, chosen, {(0, Fraction(0)): (factor, abs(factor))})
        for key, (value, size) in product.items():
            total, most = sums.get(key, (0.0, 0.0))
            sums[key] = total + value, most + size
    return QuasiPolynomial({key: v for key, (v, size) in sums.items() if abs(v) > CANCELS * size})


def _times(
    left: dict[tuple[int, Fraction], tuple[float, float]], right: Side
) -> dict[tuple[int, Fraction], tuple[float, float]]:
    """The product, each coefficient with the sum of the sizes that made it."""
    out: dict[tuple[int, Fraction], tuple[float, float]] = {}
    for (k, tau), (value, size) in left.items():
        for (m, late), c in right.items():
            total, most = out.get((k + m, tau + late), (0.0, 0.0))
            out[k + m, tau + late] = total + value * c, most + size * abs(c)
    return out
