"""Finding the boundaries of a stability chart: from a grid of counts to the curves between them.

A grid of counts by the argument principle says where something must change; on each edge of the
grid that it cannot yet explain, the root on the axis is located and its curve traced. The method is
Neimark's D-partition (1949), with the count in place of his rule for shading the sides.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.roots import argument_principle
from vsctrl.diagram.roots.rightmost import rightmost
from vsctrl.diagram.stability_chart.characteristic import Determinant
from vsctrl.diagram.stability_chart.continuation import RootOnAxis, split_where, trace
from vsctrl.errors import InputError

HALVINGS = 7  #: parts of a grid edge, as powers of 2, that are searched for crossings
NEAR = 1e-3  #: of the rectangle's side: closer to a corner, its count may be either


class DPartition:
    """The counts on the grid, and the boundaries found so far."""

    def __init__(
        self,
        system: Numeric,
        names: tuple[str, str],
        box: tuple[tuple[float, float], tuple[float, float]],
        x: Array,
        y: Array,
    ) -> None:
        self.system, self.names, self.box = system, names, box
        low, high = np.array(box).T
        self.low, self.size = low, high - low
        unit = _unit(self._at(0.5, 0.5).autonomous)
        #: a root at 0 that never moves is not counted, and a line at 0 could not tell its side
        self.line = 1e-6 * unit
        self.F = Determinant(system.diagram, system.values, names, box, unit)
        self.u, self.v = (x - low[0]) / self.size[0], (y - low[1]) / self.size[1]
        self.unstable = np.array([[self._count(u, v) for u in self.u] for v in self.v], float)
        self.boundaries: list[tuple[Array, bool, int]] = []  # oriented points (k, 3), closed, roots
        self.missed = 0  #: edges of the grid whose change no boundary explains in the end

    def run(self) -> list[tuple[Array, Array, bool, int]]:
        """Every boundary: points (k, 2) of (x, y), ω (k,) in rad/s, whether closed, how many roots.

        Each is traced from a change of the count that the boundaries before it do not explain.
        """
        tried: set[tuple[int, int, int]] = set()
        while edge := next((e for e in self._unexplained() if e not in tried), None):
            tried.add(edge)
            axis, j, i = edge
            counts = self.unstable[j, i], self.unstable[j + axis, i + 1 - axis]
            self._refine(*self._ends(edge), counts, axis, HALVINGS)
        # Along a boundary itself a second root may cross, where two boundaries meet.
        middles = [np.mean(self._ends(edge), axis=0) for edge in self._unexplained()]
        self.missed = sum(not self._is_on_one(middle) for middle in middles)
        return [
            (self.low + self.size * z[:, :2], np.abs(z[:, 2]) * self.F.unit, closed, roots)
            for z, closed, roots in self.boundaries
        ]

    def _ends(self, edge: tuple[int, int, int]) -> tuple[Array, Array]:
        axis, j, i = edge
        a = np.array([self.u[i], self.v[j]])
        return a, np.array([self.u[i + 1 - axis], self.v[j + axis]])

    def _refine(
        self, a: Array, b: Array, counts: tuple[float, float], axis: int, halvings: int
    ) -> None:
        """Halve an edge until a single root or pair crosses on a short part, then trace it."""
        if counts[0] == counts[1] or not np.isfinite(counts).all():
            return
        if halvings:
            middle = (a + b) / 2
            inside = self._count(*middle)
            self._refine(a, middle, (counts[0], inside), axis, halvings - 1)
            self._refine(middle, b, (inside, counts[1]), axis, halvings - 1)
            return
        for start in self._crossings(a, b, counts, axis):
            if self._trace(*start):
                break

    def _crossings(
        self, a: Array, b: Array, counts: tuple[float, float], axis: int
    ) -> list[tuple[RootOnAxis, Array]]:
        """Points on the part of an edge from a to b with a root on the axis, by Newton."""
        middle = (a + b) / 2
        near = rightmost(self._at(*middle).autonomous, int(max(counts)) + 4) / self.F.unit
        near = near[near.imag >= -1e-9]
        length = float(np.abs(b - a).max())
        out = []
        for root in near[np.argsort(np.abs(near.real))][:8]:
            curve = RootOnAxis(self.F, pair=bool(abs(root.imag) > 1e-6))
            start = np.array([*middle, abs(root.imag) if curve.pair else 0.0])
            corrected = curve.corrected(start, np.eye(3)[1 - axis], max(abs(float(start[2])), 0.05))
            if corrected is None or np.abs(corrected[0][:2] - middle).max() > 0.6 * length + 1e-9:
                continue
            if not curve.pair or abs(corrected[0][2]) > 1e-6:
                out.append((curve, np.append(np.clip(corrected[0][:2], 0, 1), corrected[0][2])))
        return out

    def _trace(self, curve: RootOnAxis, start: Array) -> bool:
        """Add the boundary through a point, unless it is known; whether there is one."""
        if self._is_on_one(start):
            return True
        path = trace(curve, start)
        if len(path.points) < 2:
            return False
        pieces = [path.points]
        if not curve.pair and not path.closed:
            pieces = split_where(path.points, self._slope_at_zero, RootOnAxis(self.F, pair=True))
        for points in pieces:
            u, v, w = points[len(points) // 2]
            times = self.F.times(1j * w * self.F.unit, u, v)
            roots = (2 if curve.pair else 1) * times
            self.boundaries.append((self._oriented(points), path.closed, roots))
        return True

    def _is_on_one(self, z: Array) -> bool:
        """Whether a point (u, v) or (u, v, ω) lies on a boundary found so far."""
        return any(_on(points, z) for points, _, _ in self.boundaries)

    def _slope_at_zero(self, z: Array) -> Array:
        """F'(0; x, y), real."""
        tiny = np.full(len(z), 1e-9)
        return self.F(1j * tiny * self.F.unit, z[:, 0], z[:, 1]).imag / tiny

    def _oriented(self, points: Array) -> Array:
        """The points in the order that has the growing real part on the left."""
        middle = np.unique(np.linspace(0, len(points) - 2, 9).round().astype(int))
        z = (points[middle] + points[middle + 1]) / 2
        way = points[middle + 1, :2] - points[middle, :2]
        u, v, w = z.T
        h = 1e-6 * np.maximum(np.abs(w), 0.05)
        unit = self.F.unit
        # From dF = 0 along a root: ∂s/∂u = −F_u/F_s.
        by_s = (self.F(1j * (w + h) * unit, u, v) - self.F(1j * (w - h) * unit, u, v)) / (2j * h)
        s = 1j * w * unit
        by_u = (self.F(s, u + 1e-6, v) - self.F(s, u - 1e-6, v)) / 2e-6
        by_v = (self.F(s, u, v + 1e-6) - self.F(s, u, v - 1e-6)) / 2e-6
        to_the_left = (by_u / by_s).real * way[:, 1] - (by_v / by_s).real * way[:, 0]
        return points if np.median(np.sign(to_the_left)) >= 0 else points[::-1]

    def _unexplained(self) -> list[tuple[int, int, int]]:
        """Edges (axis, row, column) of the grid whose change of count no boundary explains."""
        out = []
        for axis in (0, 1):
            sure, maybe = self._crossed(axis)
            with np.errstate(invalid="ignore"):
                change = np.diff(self.unstable, axis=1 - axis)
            for j, i in np.argwhere(np.isfinite(change)):
                rest, jumps = int(change[j, i]) - sure.get((j, i), 0), maybe.get((j, i), [])
                sums = {sum(c) for n in range(len(jumps) + 1) for c in combinations(jumps[:8], n)}
                if rest and rest not in sums:
                    out.append((axis, int(j), int(i)))
        return out

    def _crossed(
        self, axis: int
    ) -> tuple[dict[tuple[int, int], int], dict[tuple[int, int], list[int]]]:
        """By grid edge along an axis: roots gained on the way, for certain and near a corner."""
        sure: dict[tuple[int, int], int] = {}
        maybe: dict[tuple[int, int], list[int]] = {}
        lines, marks = (self.v, self.u) if axis == 0 else (self.u, self.v)
        for points, _, roots in self.boundaries:
            along, across = points[:, axis], points[:, 1 - axis]
            for k, line in enumerate(lines):
                over = across > line if k < len(lines) - 1 else across >= line
                for k_before in np.flatnonzero(over[1:] != over[:-1]):
                    fraction = (line - across[k_before]) / (across[k_before + 1] - across[k_before])
                    place = along[k_before] + fraction * (along[k_before + 1] - along[k_before])
                    up = bool(over[k_before + 1])
                    jump = roots if up == (axis == 1) else -roots
                    i = int(np.clip(np.searchsorted(marks, place) - 1, 0, len(marks) - 2))
                    near = np.abs(marks - place) < NEAR
                    hit = [i] if not near.any() else [int(np.argmax(near)) - 1]
                    hit += [hit[0] + 1] if near.any() else []
                    for edge in hit:
                        key = (k, edge) if axis == 0 else (edge, k)
                        if near.any():
                            maybe.setdefault(key, []).append(jump)
                        else:
                            sure[key] = sure.get(key, 0) + jump
        return sure, maybe

    def _count(self, u: float, v: float) -> float:
        return argument_principle.count_right_of(self._at(u, v).autonomous, self.line)

    def _at(self, u: float, v: float) -> Numeric:
        low, high = self.box[0][0], self.box[1][0]
        place = dict(
            zip(self.names, (low + u * self.size[0], high + v * self.size[1]), strict=True)
        )
        try:
            numeric = replace(self.system, values={**self.system.values, **place})
            numeric.autonomous  # noqa: B018 - a diagram without numbers here is refused by name
        except InputError as error:
            where = ", ".join(f"{name} = {value:g}" for name, value in place.items())
            raise InputError(f"stability_chart: at {where}: {error}") from None
        return numeric


def _unit(system: DelaySystem) -> float:
    """A frequency (rad/s) of the order of the dominant roots: the median of their moduli."""
    size = np.abs(rightmost(system, 6))
    size = size[size > 1e-9 * size.max(initial=0.0)]
    return float(np.median(size)) if len(size) else 1 / float(max(system.delays, default=1))


def _on(points: Array, z: Array) -> bool:
    """Whether z, (u, v) or (u, v, ω), lies on a polyline (k, 3): nearer than its steps bend."""
    unit = np.array([1.0, 1.0, max(abs(float(z[-1])), 0.05) * 10])[: len(z)]
    a, way = (points[:-1, : len(z)] - z) / unit, np.diff(points[:, : len(z)], axis=0) / unit
    size = np.maximum((way * way).sum(1), 1e-300)
    fraction = np.clip(-(a * way).sum(1) / size, 0, 1)
    return bool(np.linalg.norm(a + fraction[:, None] * way, axis=1).min() < 1e-3)
