"""A response as Chebyshev pieces in log frequency, and where a function of it is zero."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.numerics.chebyshev import tables
from vsctrl.diagram.numerics.chebyshev_zeros import zeros
from vsctrl.errors import LimitError

Response = Callable[[Any], Any]  #: L as a function of complex s, any shape

DEGREE = 16
MAX_PIECES = 100_000
EDGE = 1e-12  #: that near to −1, L is at the edge of stability
CLOSE = 1e-3  #: |L| or |T| at a crossing, from what it crosses; at a pole on the axis it is far off
NOTHING = 1e-9  #: a limit of |L| below this is rounding


def log_grid(low: float, high: float) -> Array:
    """Log ω where pieces are to begin and end, two to a decade."""
    number = max(4, math.ceil(2 * math.log10(high / low)))
    return np.linspace(math.log(low), math.log(high), number)


def chebyshev_pieces(
    L: Response, grid: Array, delay_s: float, most: int = MAX_PIECES
) -> tuple[Array, Complex]:
    """Intervals (k, 2) of log ω and L's Chebyshev coefficients (k, DEGREE + 1) on them.

    `delay_s` is the sum of L's delays (s), by which the rounding of its phase grows with ω.
    What is left of an interval around a pole on the axis, 1e-12 wide, is in none of them.
    """
    nodes, to_coefficients, _ = tables(DEGREE)
    open_ends = np.column_stack([grid[:-1], grid[1:]])
    before = np.full(len(open_ends), np.inf)  # what the piece that each is half of left unresolved
    done_ends, done = [], []
    total = 0
    while len(open_ends):
        mid, half = open_ends.mean(axis=1), np.diff(open_ends, axis=1)[:, 0] / 2
        values = L(1j * np.exp(mid[:, None] + half[:, None] * nodes))
        coefficients = values @ to_coefficients.T
        size = np.abs(values).max(axis=1)
        # e^{−jωτ} itself is only known to the rounding of ωτ, and L near a resonance to less; where
        # halving a piece no longer helps, what is left is rounding.
        known = 1e-13 + 1e-15 * delay_s * np.exp(open_ends[:, 1])
        tail = np.abs(coefficients[:, -3:]).max(axis=1)
        tail = np.divide(tail, size, out=np.zeros_like(tail), where=size > 0)
        tail[~np.isfinite(tail)] = np.inf
        stuck = (tail < np.maximum(1e-9, 1e-12 / half)) & (tail > 0.1 * before)
        small = half < 1e-12
        fine = (tail <= known) | (stuck & (tail < 1e-2)) | small
        keep = fine & ~(small & (tail > 1e-2))
        done_ends.append(open_ends[keep])
        done.append(coefficients[keep])
        rest, mid, before = open_ends[~fine], mid[~fine], np.tile(tail[~fine], 2)
        open_ends = np.vstack(
            [np.column_stack([rest[:, 0], mid]), np.column_stack([mid, rest[:, 1]])]
        )
        total += int(fine.sum())
        if total + len(open_ends) > most:
            raise LimitError(
                f"margins: the phase of L turns too often below {math.exp(grid[-1]):g} rad/s to "
                "follow; shorten the delay or lower the gain at high frequency."
            )
    ends, pieces = np.vstack(done_ends), np.vstack(done)
    order = np.argsort(ends[:, 0])
    return ends[order], pieces[order]


def zero_frequencies(ends: Array, coefficients: Array) -> Array:
    """All ω at which a real function, given by its pieces, crosses or touches zero, by rising ω."""
    k, xi = zeros(coefficients)
    x = np.sort(ends[k].mean(axis=1) + xi * np.diff(ends[k], axis=1)[:, 0] / 2)
    once = np.diff(x, prepend=-np.inf) > 1e-11 * np.maximum(np.abs(x), 1.0)
    return np.asarray(np.exp(x[once]))
