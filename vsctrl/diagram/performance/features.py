"""What is read off a response on pieces of time: extrema, first and last crossings, integrals.

All of them are of the polynomials themselves, between any samples; jumps lie at ends of pieces.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from vsctrl.arrays import Array
from vsctrl.caching import Caching
from vsctrl.diagram.numerics.chebyshev import less, piecewise, slope_matrix, tables
from vsctrl.diagram.numerics.chebyshev_zeros import zeros
from vsctrl.diagram.time.collocation import Trajectory

SAME = 1e-13  #: of the largest, by which values may differ that are one
LOST = 1e-15  #: of the largest, below which a whole piece adds nothing to an integral


@dataclass(frozen=True)
class Pieces(Caching):
    """Chebyshev coefficients c (pieces, n) of y on [ends[i], ends[i+1]] (s)."""

    ends: Array
    c: Array

    @classmethod
    def of(cls, trajectory: Trajectory, sign: float = 1.0) -> Pieces:
        """Those of the one output of a trajectory, times `sign`."""
        return cls(trajectory.ends, sign * trajectory.coefficients[:, :, 0])

    @property
    def lengths(self) -> Array:
        """Of the pieces (s)."""
        return np.diff(self.ends)

    @property
    def first(self) -> Array:
        """y at the beginning of each piece."""
        return np.asarray(self.c @ (-1.0) ** np.arange(self.c.shape[1]))

    @property
    def last(self) -> Array:
        """y at the end of each piece."""
        return np.asarray(self.c.sum(axis=1))

    @cached_property
    def size(self) -> float:
        """A bound of |y|, next to which rounding is measured."""
        return float(np.abs(self.c).sum(axis=1).max())

    def scaled(self, factor: float) -> Pieces:
        """y times a number."""
        return Pieces(self.ends, factor * self.c)

    def highest(self) -> tuple[float, float]:
        """(t, y) of the largest y, at a jump the limit that is larger; the first of equals."""
        best = max(float(self.first.max()), float(self.last.max()))
        most = self.c[:, 0] + np.abs(self.c[:, 1:]).sum(axis=1)
        held = np.flatnonzero(most > best + SAME * self.size)
        piece, xi = self._turning(held)
        inner = np.asarray(chebyshev.chebval(xi, self.c[piece].T, tensor=False))
        times = self.ends[piece] + self.lengths[piece] * (xi + 1) / 2
        t = np.concatenate([times, self.ends[:-1], self.ends[1:]])
        y = np.concatenate([inner, self.first, self.last])
        first = np.flatnonzero(y >= y.max() - SAME * self.size)
        return float(t[first].min()), float(y.max())

    def first_reaching(self, level: float) -> float | None:
        """The first t with y ≥ level, from below; None where it is never."""
        reach = self.c[:, 0] + np.abs(self.c[:, 1:]).sum(axis=1) >= level
        begins = self.first
        for i in np.flatnonzero(reach):
            if begins[i] >= level:
                return float(self.ends[i])
            _, xi = zeros(less(self.c[[i]], level))
            if len(xi):
                return float(self.ends[i] + self.lengths[i] * (xi.min() + 1) / 2)
        return None

    def last_outside(self, level: float, band: float) -> float:
        """The last t at which |y − level| > band; 0 where it never is."""
        away = np.abs(self.c[:, 0] - level) + np.abs(self.c[:, 1:]).sum(axis=1)
        ends = self.last
        for i in np.flatnonzero(away > band)[::-1]:
            if abs(ends[i] - level) > band * (1 + 1e-12):
                return float(self.ends[i + 1])
            both = np.vstack([less(self.c[[i]], level + band), less(self.c[[i]], level - band)])
            _, xi = zeros(both)
            if len(xi):
                return float(self.ends[i] + self.lengths[i] * (xi.max() + 1) / 2)
        return 0.0

    def beginning(self, least: float) -> float:
        """The end of the stretch on which |y| is no more than `least` from the start."""
        moves = np.flatnonzero(np.abs(self.c).sum(axis=1) > least)
        return float(self.ends[moves[0]]) if len(moves) else float(self.ends[-1])

    def at_the_end(self) -> Array:
        """y at some times in the last twenty-fifth of the whole."""
        t = np.linspace(0.96 * self.ends[-1], self.ends[-1], 65)
        values = piecewise(self.ends, self.c[:, :, None], 0.0, t, t * (1 - 1e-9))
        return np.asarray(values[:, 0])

    def times_t(self) -> Pieces:
        """t y(t)."""
        n = self.c.shape[1] + 1
        nodes, to_coefficients, _ = tables(n - 1)
        values = self.c @ chebyshev.chebvander(nodes, n - 2).T
        t = self.ends[:-1, None] + self.lengths[:, None] * (nodes + 1) / 2
        return Pieces(self.ends, (values * t) @ to_coefficients.T)

    def integral(self) -> float:
        """∫ y dt."""
        k = np.arange(0, self.c.shape[1], 2)
        return float((self.lengths / 2 * (self.c[:, ::2] @ (2 / (1.0 - k**2)))).sum())

    def integral_of_square(self) -> float:
        """∫ y² dt."""
        n = self.c.shape[1]
        nodes, to_coefficients, _ = tables(2 * n - 2)
        values = self.c @ chebyshev.chebvander(nodes, n - 1).T
        return Pieces(self.ends, values**2 @ to_coefficients.T).integral()

    def integral_of_size(self) -> float:
        """∫ |y| dt, split where y changes its sign."""
        anti = np.asarray(chebyshev.chebint(self.c, axis=1)) * (self.lengths / 2)[:, None]
        seen = np.flatnonzero(np.abs(self.c).sum(axis=1) > LOST * self.size)
        piece, xi = zeros(self.c[seen])
        return _variation(anti, seen[piece], xi)

    def _turning(self, among: NDArray[np.intp]) -> tuple[NDArray[np.intp], Array]:
        """(piece, ξ) at which y′ is 0, in some of the pieces; of rounding there would be many."""
        piece, xi = zeros(self.c[among] @ slope_matrix(self.c.shape[1] - 1))
        return among[piece], xi

    def variation(self) -> float:
        """Σ |Δy| between extrema and over jumps, that from y = 0 at the beginning included."""
        moves = np.abs(self.c[:, 1:]).sum(axis=1)
        piece, xi = self._turning(np.flatnonzero(moves > SAME * self.size))
        jumps = self.first - np.concatenate([[0.0], self.last[:-1]])
        return _variation(self.c, piece, xi) + float(np.abs(jumps).sum())


def _variation(c: Array, piece: NDArray[np.intp], xi: Array) -> float:
    """Σ |ΔF| of pieces F over the parts that some points divide them into."""
    count = len(c)
    where = np.concatenate([np.arange(count), piece, np.arange(count)])
    at = np.concatenate([np.full(count, -1.0), xi, np.full(count, 1.0)])
    order = np.lexsort((at, where))
    where, at = where[order], at[order]
    values = np.asarray(chebyshev.chebval(at, c[where].T, tensor=False))
    same = where[1:] == where[:-1]
    return float(np.abs(np.diff(values))[same].sum())
