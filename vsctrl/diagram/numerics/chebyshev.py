"""Chebyshev sums: nodes and matrices, made once a degree, that work on values and coefficients.

A sum f(ξ) = Σ c_k T_k(ξ) on [−1, 1] is kept by its coefficients c, or by its values at the nodes
−cos(πk/n), k = 0..n. Source: Trefethen, Approximation Theory and Approximation Practice (2013).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from vsctrl.arrays import Array


@cache
def tables(degree: int) -> tuple[Array, Array, Array]:
    """Chebyshev nodes of [−1, 1], the matrix to coefficients and the one back to values."""
    nodes = -np.cos(np.pi * np.arange(degree + 1) / degree)
    values = chebyshev.chebvander(nodes, degree)
    return nodes, np.asarray(np.linalg.inv(values), float), np.asarray(values, float)


def squared(coefficients: NDArray[np.complex128], offset: float) -> Array:
    """The coefficients of |f + offset|² from those of complex sums f, twice as many."""
    degree = coefficients.shape[1] - 1
    _, to_coefficients, values = tables(2 * degree)
    sums = coefficients @ values[:, : degree + 1].T + offset
    return np.asarray((np.abs(sums) ** 2) @ to_coefficients.T)


def less(coefficients: Array, constant: float) -> Array:
    """The coefficients of f − constant."""
    out = coefficients.copy()
    out[:, 0] -= constant
    return out


@cache
def slope_matrix(degree: int) -> Array:
    """From the coefficients of a sum to those of its derivative, as ``c @ slope``."""
    return np.asarray(chebyshev.chebder(np.eye(degree + 1), axis=1), float)


@cache
def integral_matrix(degree: int) -> Array:
    """From the values of a sum at the nodes to those of its integral from −1."""
    nodes, to_coefficients, _ = tables(degree)
    anti = chebyshev.chebint(np.eye(degree + 1), lbnd=-1, axis=0)
    return np.asarray(chebyshev.chebvander(nodes, degree + 1) @ anti @ to_coefficients, float)


@cache
def differentiation_matrix(degree: int) -> Array:
    """From the values of a sum at the nodes to those of its derivative."""
    x = tables(degree)[0]
    c = np.where((np.arange(degree + 1) % degree) == 0, 2.0, 1.0) * (-1.0) ** np.arange(degree + 1)
    gaps = x[:, None] - x[None, :] + np.eye(degree + 1)
    matrix = np.outer(c, 1 / c) / gaps
    return np.asarray(matrix - np.diag(matrix.sum(axis=1)))


@cache
def inner_tables(degree: int) -> tuple[Array, Array]:
    """Nodes within (−1, 1), for what may jump at the ends; the matrix to coefficients."""
    nodes = -np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    return nodes, np.asarray(np.linalg.inv(chebyshev.chebvander(nodes, degree)), float)


def interpolation_matrix(points: Array, degree: int) -> Array:
    """From the values of a sum at the nodes to those at some points of [−1, 1]."""
    return np.asarray(chebyshev.chebvander(points, degree) @ tables(degree)[1], float)


def slope(coefficients: Array, length: float) -> Array:
    """The coefficients of the derivative of sums on an interval of some length."""
    return np.asarray(chebyshev.chebder(coefficients) * (2 / length), float)


def piecewise(ends: Array, coefficients: Array, base: float, t: Array, side: Array) -> Array:
    """Piecewise sums (pieces, n, p) at times base + t, each in the piece that `side` lies in."""
    piece = np.clip(np.searchsorted(ends, side, side="right") - 1, 0, len(coefficients) - 1)
    a, b = ends[piece], ends[piece + 1]
    xi = 2 * ((base - a) + t) / (b - a) - 1
    if len(t) < 100:  # fewer calls, which then cost more than what they compute
        basis = chebyshev.chebvander(xi, coefficients.shape[1] - 1)
        return np.asarray((basis[:, :, None] * coefficients[piece]).sum(axis=1))
    xi = xi[:, None]
    c = coefficients.transpose(1, 0, 2)
    high = low = np.zeros((len(t), coefficients.shape[2]))
    for row in c[:0:-1]:
        high, low = row[piece] + 2 * xi * high - low, high
    return np.asarray(c[0][piece] + xi * high - low)
