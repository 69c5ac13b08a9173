"""The largest |F(jω)| of a function of frequency, and where: by pieces, not by a grid."""

from __future__ import annotations

import math

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.frequency.piecewise import (
    DEGREE,
    Response,
    chebyshev_pieces,
    log_grid,
    zero_frequencies,
)
from vsctrl.diagram.numerics.chebyshev import slope_matrix, squared

LOOKED_INTO = 12  #: pieces, those with the largest samples


def supremum(
    F: Response, band: tuple[float, float], resonances: Array, delay_s: float
) -> tuple[float, float]:
    """(ω in rad/s, |F(jω)|) at the largest |F| over a band, ends included.

    `resonances` (rad/s) are frequencies near which F may be so large in so short an interval that
    no sample would show it: pieces begin there. `delay_s` (s) is the sum of F's delays.
    """
    low, high = band
    inside = resonances[(resonances > low * (1 + 1e-9)) & (resonances < high * (1 - 1e-9))]
    grid = np.unique(np.concatenate([log_grid(low, high), np.log(inside)]))
    grid = grid[np.concatenate([[True], np.diff(grid) > 1e-11])]
    ends, pieces = chebyshev_pieces(F, grid, delay_s)
    size = squared(pieces, 0.0)
    most = size[:, 0] + np.abs(size[:, 1:]).sum(axis=1)
    samples = np.abs(pieces @ _signs()).max(axis=1)
    close = np.argsort(-samples)[:LOOKED_INTO]
    close = np.union1d(close[most[close] >= samples.max() ** 2], _beside(ends, inside))
    turning = zero_frequencies(ends[close], size[close] @ slope_matrix(2 * DEGREE))
    omega = np.concatenate([turning, [low, high], inside])
    height = np.abs(F(1j * omega))
    height[~np.isfinite(height)] = 0.0
    best = int(height.argmax())
    return float(omega[best]), float(height[best])


def _signs() -> Array:
    """From coefficients to the values at −1, 0 and 1."""
    k = np.arange(DEGREE + 1)
    return np.column_stack([(-1.0) ** k, np.cos(k * math.pi / 2), np.ones(DEGREE + 1)])


def _beside(ends: Array, places: Array) -> Array:
    """The pieces on either side of some frequencies."""
    at = np.searchsorted(ends[:, 0], np.log(places), "right")
    return np.unique(np.clip(np.concatenate([at - 2, at - 1, at]), 0, len(ends) - 1).astype(int))
