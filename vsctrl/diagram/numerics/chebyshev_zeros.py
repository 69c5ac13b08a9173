"""All real zeros of many Chebyshev sums at once.

Zeros are isolated by what the coefficients prove and polished; where they prove nothing, as near a
double zero, eigenvalues of the colleague matrix decide.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from vsctrl.arrays import Array
from vsctrl.diagram.numerics.chebyshev import slope_matrix, tables


def zeros(coefficients: Array) -> tuple[NDArray[np.intp], Array]:
    """(piece, ξ ∈ [−1, 1]) of every real zero of many Chebyshev sums at once.

    Pieces are quartered until each shows by its coefficients that it has no zero or is monotone;
    the few that will not, as near a double zero, are left to the colleague matrix.
    """
    index = np.arange(len(coefficients))
    size = np.abs(coefficients).max(axis=1, initial=0.0)
    middle, half, c = np.zeros(len(index)), 1.0, coefficients
    located: list[tuple[NDArray[np.intp], Array]] = []
    for level in range(3):
        if level:
            quarters = _quarters(coefficients.shape[1] - 1)
            c = (c @ quarters).transpose(1, 0, 2).reshape(-1, c.shape[1])
            half = half / 4
            middle = (middle[:, None] + half * np.array([-3.0, -1.0, 1.0, 3.0])).ravel()
            index = np.repeat(index, 4)
        possible = (np.abs(c[:, 0]) <= np.abs(c[:, 1:]).sum(axis=1)) & (size[index] > 0)
        c, middle, index = c[possible], middle[possible], index[possible]
        if not len(c):
            break
        slope = c @ slope_matrix(c.shape[1] - 1)
        monotone = np.abs(slope[:, 0]) > np.abs(slope[:, 1:]).sum(axis=1)
        crossing, xi, sure = _one_zero(c[monotone], slope[monotone], size[index[monotone]])
        located.append((index[monotone][crossing], middle[monotone][crossing] + half * xi))
        monotone[np.flatnonzero(monotone)[~sure]] = False
        c, middle, index = c[~monotone], middle[~monotone], index[~monotone]
    crossing, xi = _colleague(c, size[index])
    located.append((index[crossing], middle[crossing] + half * xi))
    pieces, places = (np.concatenate(side) for side in zip(*located, strict=True))
    return pieces, np.clip(places, -1.0, 1.0)


def _one_zero(
    c: Array, slope: Array, size: Array
) -> tuple[NDArray[np.intp], Array, NDArray[np.bool_]]:
    """Which of some monotone sums have a zero, where, and for which that is certain."""
    turn = (-1.0) ** np.arange(c.shape[1])
    low, high = c @ turn, c.sum(axis=1)
    # A zero at a common end must be found by one side at least, whatever rounding says.
    near = 1e-13 * size
    crosses = (np.minimum(low, high) <= near) & (np.maximum(low, high) >= -near)
    crossing = np.flatnonzero(crosses)
    rise = high[crossing] - low[crossing]
    xi = np.divide(
        -high[crossing] - low[crossing], rise, out=np.zeros(len(crossing)), where=rise != 0
    )
    xi, step = _polish(c[crossing], slope[crossing], xi, 6)
    sure = np.ones(len(c), bool)
    sure[crossing] = step <= 1e-9
    return crossing[sure[crossing]], xi[sure[crossing]], sure


def _colleague(c: Array, size: Array) -> tuple[NDArray[np.intp], Array]:
    """(sum, ξ ∈ [−1, 1]) of every real zero, as eigenvalues; each may be found twice or touch."""
    if not len(c):
        return np.zeros(0, np.intp), np.zeros(0)
    # The colleague matrix needs a leading coefficient that is not just rounding.
    lead = np.where(np.abs(c[:, -1]) > 1e-15 * size, c[:, -1], 1e-15 * size)
    n = c.shape[1] - 1
    matrix = np.zeros((len(c), n, n))
    matrix[:] = _multiplication(n)
    matrix[:, -1, :] -= c[:, :-1] / (2 * lead[:, None])
    roots = np.linalg.eigvals(matrix)
    hits = (np.abs(roots.imag) < 1e-7) & (np.abs(roots.real) <= 1 + 1e-9)
    sums, which = np.nonzero(hits)
    slope = c[sums] @ slope_matrix(c.shape[1] - 1)
    return sums, _polish(c[sums], slope, roots.real[sums, which], 2)[0]


def _polish(c: Array, slope: Array, xi: Array, rounds: int) -> tuple[Array, Array]:
    """Newton steps on each Chebyshev sum, none of which leaves [−1, 1]; and how long the last."""
    step, xi, orders = np.zeros(len(xi)), np.clip(xi, -1.0, 1.0), np.arange(c.shape[1])
    for _ in range(rounds if len(xi) else 0):
        basis = np.cos(np.arccos(xi)[:, None] * orders)
        value, below = (c * basis).sum(axis=1), (slope * basis[:, :-1]).sum(axis=1)
        step = np.divide(value, below, out=np.zeros_like(value), where=below != 0)
        step = np.where(np.abs(step) < 2, step, 0.0)
        step, xi = xi, np.clip(xi - step, -1.0, 1.0)
        step = step - xi
        if np.abs(step).max() <= 1e-15:
            break
    return xi, np.abs(step)


@cache
def _quarters(degree: int) -> Array:
    """(4, n, n): from the coefficients on [−1, 1] to those on each quarter, as ``c @ quarters``."""
    nodes, to_coefficients, _ = tables(degree)
    ends = np.array([-3.0, -1.0, 1.0, 3.0])
    moved = [chebyshev.chebvander((nodes + end) / 4, degree) for end in ends]
    return np.array([(to_coefficients @ values).T for values in moved])


@cache
def _multiplication(n: int) -> Array:
    """Multiplication by ξ in the Chebyshev basis, without the leading coefficient's row term."""
    matrix = (np.eye(n, k=1) + np.eye(n, k=-1)) / 2
    if n > 1:
        matrix[0, 1] = 1.0
    return matrix
