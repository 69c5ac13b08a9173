"""Peaks of sensitivities, and the bandwidth."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.frequency.piecewise import CLOSE, DEGREE, EDGE, Response, zero_frequencies
from vsctrl.diagram.numerics.chebyshev import slope_matrix, tables
from vsctrl.diagram.numerics.chebyshev_zeros import zeros


def highest_peak(
    L: Response,
    ends: Array,
    above: Array | None,
    below: Array,
    limits: tuple[complex, complex],
    also: Array,
) -> tuple[float, float]:
    """(ω, value) of the largest √(above/below), the limits of the band included.

    A peak too sharp for a piece's samples to show is looked for in the pieces that hold `also`, in
    those beside them, and in those of whose values least is known.
    `below` holds |1 + L|²; `above` |L|² for T = L/(1 + L), or is None for S = 1/(1 + L).
    """
    degree = (2 if above is None else 4) * DEGREE
    _, to_coefficients, values = tables(degree)
    under = below @ values[:, : below.shape[1]].T
    over = np.ones_like(under) if above is None else above @ values[:, : below.shape[1]].T
    samples = (over / under).max(axis=1)
    # Only a piece whose largest possible value exceeds the best sample can hold the maximum.
    most = np.ones(len(below)) if above is None else np.abs(above).sum(axis=1)
    least = below[:, 0] - np.abs(below[:, 1:]).sum(axis=1)
    close = np.argsort(-samples)[:8]
    holds = np.searchsorted(ends[:, 0], np.log(also), "right") - 1
    unsure = np.argsort(least / np.maximum(most, 1e-300))[:8]
    beside = np.clip(np.concatenate([holds - 1, holds, holds + 1]), 0, len(ends) - 1)
    close = np.unique(np.concatenate([close, beside, unsure]))
    close = close[((least <= 0) | (most >= samples.max() * least))[close]]
    slope = below_slope = below[close] @ slope_matrix(2 * DEGREE)
    if above is not None:
        grid = values[:, : below_slope.shape[1]]
        turn = above[close] @ slope_matrix(2 * DEGREE) @ grid.T * under[close]
        slope = (turn - over[close] * (below_slope @ grid.T)) @ to_coefficients.T
    k, xi = zeros(slope)
    inner = ends[close[k]].mean(axis=1) + xi * np.diff(ends[close[k]], axis=1)[:, 0] / 2
    omega = np.exp(np.concatenate([inner, ends[[0, -1], [0, 1]]]))

    def height(gain: Any) -> Any:
        # Where L is infinite S is 0 and T is 1.
        with np.errstate(all="ignore"):
            value = np.abs(np.divide(1 if above is None else gain, 1 + np.asarray(gain)))
        return np.where(np.isnan(value), float(above is not None), value)

    heights = height(L(1j * omega))
    best = int(heights.argmax())
    # The supremum may be a limit that is not reached, at ω = 0 or at ω = ∞.
    for edge, limit in zip((0.0, math.inf), limits, strict=True):
        end = float(height(limit)) if abs(limit) < math.inf else float(above is not None)
        if not math.isnan(limit.real) and end > heights[best]:
            omega, heights, best = np.array([edge]), np.array([end]), 0
    return float(omega[best]), float(heights[best])


def fallen_from(at_zero: complex) -> float:
    """What is 3 dB below |T| at ω = 0."""
    if abs(1 + at_zero) < EDGE:
        return math.inf
    start = abs(at_zero / (1 + at_zero)) if abs(at_zero) < math.inf else 1.0
    return float(start * 10**-0.15)


def bandwidth_of(L: Response, ends: Array, size: Array, distance: Array, at_zero: complex) -> float:
    """The least ω at which |T|² = |L|²/|1 + L|² falls 3 dB below what it is at ω = 0."""
    fallen = fallen_from(at_zero)
    if fallen == math.inf or not fallen:  # T(0) is infinite, or there is nothing to fall from
        return 0.0
    omega = zero_frequencies(ends, size - fallen**2 * distance)
    values = L(1j * omega)
    with np.errstate(all="ignore"):
        crossing = np.abs(np.abs(values / (1 + values)) / fallen - 1) < CLOSE
    return float(min(omega[crossing], default=math.inf))
