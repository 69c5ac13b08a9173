"""The characteristic function of a diagram as one smooth function of s and of two parameters.

    F(s; x, y) = det(diag d(s) − diag n(s) W),   block i = nᵢ/dᵢ, W the wiring of signs

Its zeros are the diagram's characteristic roots. Unlike the realised delay system it keeps its
form where a gain or a delay becomes zero, so that a root can be followed there and past it. It is
the product of the determinants of the diagram's loops; of equal loops, as of two axes tuned alike,
one is taken, since Newton's method cannot follow a root that is double everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from vsctrl.arrays import Array, Complex
from vsctrl.caching import Caching
from vsctrl.diagram.description.wiring import Wiring, resolve
from vsctrl.diagram.numerics.graphs import components
from vsctrl.symbols import s

TURN = np.exp(2j * np.pi * (np.arange(64) + 0.5) / 64)


@dataclass(frozen=True)
class Determinant(Caching):
    """F(s; x, y)/sᵐ over a rectangle, m the roots that lie at 0 for all x and y.

    `box` is ((x₀, x₁), (y₀, y₁)); the places u and v run over it from 0 to 1. `unit` is a
    frequency (rad/s) of the order of the roots.
    """

    diagram: Wiring
    values: dict[str, float]
    names: tuple[str, str]
    box: tuple[tuple[float, float], tuple[float, float]]
    unit: float

    def __call__(self, s: Complex, u: Array, v: Array) -> Complex:
        """F/sᵐ at arrays of one shape; near s = 0, if m > 0, by Cauchy's formula round it."""
        order, radius = self._fixed
        if not order:
            return self._raw(s, u, v)
        out = np.empty(s.shape, complex)
        near = np.abs(s) < radius / 2
        far = ~near
        out[far] = self._raw(s[far], u[far], v[far]) / s[far] ** order
        circle = radius * TURN
        around, p, q = np.broadcast_arrays(circle, u[near][:, None], v[near][:, None])
        kernel = circle / (circle - s[near][:, None]) / circle**order
        out[near] = (self._raw(around, p, q) * kernel).mean(axis=-1)
        return out

    @property
    def fixed(self) -> int:
        """How many roots lie at 0 wherever the parameters are, as of a hidden integrator."""
        return self._fixed[0]

    @cached_property
    def _fixed(self) -> tuple[int, float]:
        """The order m of the zero of F at s = 0 that all places share, and a radius round it."""
        return min(self._order_at(u, v) for u, v in ((0.317, 0.719), (0.593, 0.271), (0.83, 0.87)))

    def _order_at(self, u: float, v: float) -> tuple[int, float]:
        """The order of the zero at s = 0: on a small circle the first Taylor term is the largest.

        A root that is merely slow makes a second term; the circle shrinks until there is one.
        """
        for radius in self.unit * 10.0 ** -np.arange(12):
            around = self._raw(radius * TURN, np.full(64, u), np.full(64, v))
            terms = np.abs([(around * TURN**-k).mean() for k in range(16)])
            first = int(np.argmax(terms > 1e-9 * terms.max()))
            if first == int(np.argmax(terms)):
                return first, float(radius)
        return 0, self.unit

    def _raw(self, s: Complex, u: Array, v: Array) -> Complex:
        return np.asarray(np.prod([part for part, _ in self._parts(s, u, v)], axis=0), complex)

    def _parts(self, s: Complex, u: Array, v: Array) -> list[tuple[Complex, int]]:
        """The determinant of each loop, one of each kind, and how many are of that kind."""
        matrix = self._matrix(s, u, v)
        return [(_det(matrix, loop), many) for loop, many in self._loops]

    def times(self, s: complex, u: float, v: float) -> int:
        """How many equal loops have a root at s = `s`, where one has."""
        near = np.array([s, s + (0.01 + 0.01j) * (abs(s) + self.unit)])
        parts = self._parts(near, np.full(2, u), np.full(2, v))
        return min(parts, key=lambda part: float(np.abs(part[0][0] / part[0][1])))[1]

    @cached_property
    def _loops(self) -> list[tuple[list[int], int]]:
        """The blocks of each loop (a block in none is one by itself), equal loops once."""
        label = components(self._wiring)
        turn = np.arange(1.0, 8.0)
        points = self.unit * (0.2 + 0.31 * turn) * np.exp(1.1j * turn)
        places = np.outer([0.618, 0.382], turn) % 1.0
        matrix = self._matrix(points, *np.asarray(places, float))
        kinds: list[tuple[Complex, list[int], int]] = []
        for which in np.unique(label):
            loop = [int(i) for i in np.flatnonzero(label == which)]
            values = _det(matrix, loop)
            for k, (known, first, many) in enumerate(kinds):
                if (
                    np.abs(values * known[0] - known * values[0]).max()
                    <= 1e-10 * np.abs(values * known[0]).max()
                ):
                    kinds[k] = known, first, many + 1
                    break
            else:
                kinds.append((values, loop, 1))
        return [(loop, many) for _, loop, many in kinds]

    def _matrix(self, s: Complex, u: Array, v: Array) -> Complex:
        (x0, x1), (y0, y1) = self.box
        place = {self.names[0]: x0 + (x1 - x0) * u, self.names[1]: y0 + (y1 - y0) * v}
        numbers = [place.get(name, value) for name, value in self.values.items()]
        with np.errstate(all="ignore"):
            sides = [side + np.zeros(s.shape, complex) for side in self._sides(s, *numbers)]
            num, den = np.stack(sides[::2], axis=-1), np.stack(sides[1::2], axis=-1)
            matrix = -num[..., None] * self._wiring
            index = np.arange(num.shape[-1])
            matrix[..., index, index] += den
            return np.asarray(matrix, complex)

    @cached_property
    def _sides(self) -> Callable[..., Any]:
        """Every block's numerator and denominator, compiled."""
        sides = []
        for block in self.diagram.blocks:
            delays = {q: sp.exp(-tau * s) for q, tau in block.rational.delays.items()}
            sides += [block.rational.num_expr.xreplace(delays)]
            sides += [block.rational.den_expr.xreplace(delays)]
        symbols = [s, *self.diagram.parameters.values()]
        return sp.lambdify(symbols, sides, modules="numpy", cse=True)

    @cached_property
    def _wiring(self) -> Array:
        index = {block.output: i for i, block in enumerate(self.diagram.blocks)}
        wiring = np.zeros((len(index), len(index)))
        for i, block in enumerate(self.diagram.blocks):
            for leaf, factor in resolve(self.diagram, block.input).items():
                if leaf in index:
                    wiring[i, index[leaf]] = factor
        return wiring


def _det(matrix: Complex, loop: list[int]) -> Complex:
    with np.errstate(all="ignore"):
        return np.asarray(np.linalg.det(matrix[..., loop, :][..., loop]), complex)
