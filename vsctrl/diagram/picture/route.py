"""Wires through the grid: the cheapest path that touches no box and lies on no other wire.

Vertical wires run on tracks in the gaps between columns, level ones on rows between the lanes or
through empty cells. In each half of a gap one track more than is used is always kept, and
the stretch in front of every port is reserved for that port's wire; so a path always exists: out of
the port to a free track, along a free row, in again. Which one is taken is a matter of cost:
length, bends, branches, crossings.

Columns and lanes are at the whole numbers; the tracks of gap g are in (g − 0.9, g − 0.1),
the lower half belonging to the cells on the left of the gap; likewise the rows.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import pairwise

from vsctrl.diagram.picture.grid import Grid

Point = tuple[float, float]

_STEP = {"right": (1, 0), "left": (-1, 0), "top": (0, -1), "bottom": (0, 1)}
_ACROSS, _ALONG = 3.0, 10.0  # cost of one lane, of one column
_BEND, _BRANCH, _CROSSING = 5.0, 2.0, 25.0


@dataclass(frozen=True)
class Wire:
    """A path from a node's port, or from a point of the same signal's wires, to a node's port."""

    signal: str
    source: int | None  #: None where it branches off
    sink: int
    points: tuple[Point, ...]


def route(grid: Grid) -> list[Wire]:
    """One wire for each signal a node takes, the short and straight ones first."""
    router = _Router(grid)
    return [router.connect(sink, name) for sink, name in router.order()]


class _Router:
    def __init__(self, grid: Grid) -> None:
        self.grid, self.spots = grid, grid.spots
        self.wires: list[Wire] = []
        columns = 1 + max(spot.column for spot in self.spots)
        lanes = 1 + max(spot.lane for spot in self.spots)
        self.cells = {(spot.column, spot.lane): i for i, spot in enumerate(self.spots)}
        self.size = columns, lanes
        # (column or gap on the x axis, …) → the signals that own the stretch in front of a port
        self.ports: dict[tuple[int, int, str], str] = {}
        for i, spot in enumerate(self.spots):
            if gives := grid.graph.nodes[i].gives:
                self.ports[spot.column, spot.lane, spot.out] = gives
        for (i, name), side in grid.sides.items():
            self.ports[self.spots[i].column, self.spots[i].lane, side] = name

    def order(self) -> list[tuple[int, str]]:
        """Connections in the order of routing."""

        def length(pair: tuple[int, str]) -> tuple[int, int]:
            a, b = self.spots[self.grid.graph.driver[pair[1]]], self.spots[pair[0]]
            straight = a.lane == b.lane and self.grid.sides[pair] != a.out
            straight = straight and self.grid.sides[pair] in ("left", "right")
            forward = (b.column > a.column) == (a.out == "right")
            reach = abs(a.column - b.column) + 2 * abs(a.lane - b.lane)
            return (0 if straight and forward else 1), reach

        return sorted(self.grid.sides, key=length)

    def connect(self, sink: int, name: str) -> Wire:
        """Route one connection and keep it."""
        own = [wire for wire in self.wires if wire.signal == name]
        maze = _Maze(self, name)
        source = self.grid.graph.driver[name]
        spot, end = self.spots[source], self.spots[sink]
        starts: list[tuple[int, int, int, int]] = []
        for wire in own:
            starts += [(*node, 0, 0) for node in maze.along(wire) if maze.turns(*node)]
        i, j = maze.node((float(spot.column), float(spot.lane)))
        starts = starts or [(i, j, *_STEP[spot.out])]
        into = _STEP[self.grid.sides[sink, name]]
        goal = (*maze.node((float(end.column), float(end.lane))), -into[0], -into[1])
        path = maze.search(starts, goal)
        wire = Wire(name, None if own else source, sink, _corners(path))
        self.wires.append(wire)
        return wire


def _corners(path: list[Point]) -> tuple[Point, ...]:
    corners = path[:1]
    for before, here, after in zip(path, path[1:], path[2:], strict=False):
        if (before[0] == here[0]) != (here[0] == after[0]):
            corners.append(here)
    return (*corners, path[-1])


class _Maze:
    """What is passable for one signal, on the lines in use and one spare between each two."""

    def __init__(self, router: _Router, name: str) -> None:
        self.router, self.name = router, name
        used_x = {x for wire in router.wires for x, _ in wire.points}
        used_y = {y for wire in router.wires for _, y in wire.points}
        self.xs = _lines(router.size[0], used_x)
        self.ys = _lines(router.size[1], used_y)
        self.nx = len(self.xs)
        count = self.nx * len(self.ys)
        self.level, self.upright = bytearray(count), bytearray(count)  # 1 where not passable
        self.crossed = bytearray(count)
        self._reserve()
        for wire in router.wires:
            if wire.signal != name:
                self._occupy(wire)

    def node(self, point: Point) -> tuple[int, int]:
        """Indices of a point that is on lines of the maze."""
        return bisect_left(self.xs, point[0]), bisect_left(self.ys, point[1])

    def turns(self, i: int, j: int) -> bool:
        """Whether a wire of this signal may have a corner here."""
        cell = j * self.nx + i
        return not self.level[cell] and not self.upright[cell]

    def along(self, wire: Wire) -> Iterator[tuple[int, int]]:
        """Every node of the maze that a wire touches."""
        for a, b in pairwise(wire.points):
            (i, j), (k, m) = self.node(a), self.node(b)
            for u in range(min(i, k), max(i, k) + 1):
                for v in range(min(j, m), max(j, m) + 1):
                    yield u, v

    def _occupy(self, wire: Wire) -> None:
        for a, b in pairwise(wire.points):
            (i, j), (k, m) = self.node(a), self.node(b)
            blocked = self.level if j == m else self.upright
            for u in range(min(i, k), max(i, k) + 1):
                for v in range(min(j, m), max(j, m) + 1):
                    blocked[v * self.nx + u] = self.crossed[v * self.nx + u] = 1
            for corner in ((i, j), (k, m)):
                cell = corner[1] * self.nx + corner[0]
                self.level[cell] = self.upright[cell] = 1

    def _reserve(self) -> None:
        """Block boxes, and in front of each port everything but its own wire."""
        for column, lane in self.router.cells:
            i, j = self.node((float(column), float(lane)))
            self.level[j * self.nx + i] = self.upright[j * self.nx + i] = 1
            for side, (dx, dy) in _STEP.items():
                if dy and (column, lane, side) not in self.router.ports:
                    continue
                if self.router.ports.get((column, lane, side)) == self.name:
                    continue
                if dx:
                    self._block(self.level, self._half(self.xs, column, dx), [j])
                else:
                    self._block(self.upright, [i], self._half(self.ys, lane, dy))

    def _half(self, lines: list[float], cell: int, step: int) -> range:
        """The lines between a cell and the middle of the gap beside it."""
        low, high = sorted((cell + 0.02 * step, cell + 0.5 * step))
        return range(bisect_right(lines, low), bisect_left(lines, high))

    def _block(self, what: bytearray, columns: range | list[int], rows: range | list[int]) -> None:
        for j in rows:
            for i in columns:
                what[j * self.nx + i] = 1

    def search(
        self, starts: list[tuple[int, int, int, int]], goal: tuple[int, int, int, int]
    ) -> list[Point]:
        """The cheapest path; states are (i, j, direction of travel), direction 0 at a branch."""
        xs, ys, nx, ny = self.xs, self.ys, self.nx, len(self.ys)
        gx, gy = xs[goal[0]], ys[goal[1]]
        heap: list[tuple[float, int, float, tuple[int, int, int, int]]] = []
        cost: dict[tuple[int, int, int, int], float] = {}
        came: dict[tuple[int, int, int, int], tuple[int, int, int, int]] = {}
        for start in starts:
            if not (start[2] or start[3]):  # a port may also be where a wire around a block ends
                cost[start] = 0.0
            heappush(heap, (_ALONG * abs(xs[start[0]] - gx), len(heap), 0.0, start))
        pushed = len(heap)
        while heap:
            _, _, spent, state = heappop(heap)
            if spent > cost.get(state, spent):
                continue
            if state == goal and state in came:
                return self._path(state, came)
            i, j, dx, dy = state
            for step in _moves(dx, dy, self.turns(i, j)):
                u, v = i + step[0], j + step[1]
                if not (0 <= u < nx and 0 <= v < ny):
                    continue
                new, cell = (u, v, *step), v * nx + u
                if (self.level if step[0] else self.upright)[cell] and new != goal:
                    continue
                more = spent + _ALONG * abs(xs[u] - xs[i]) + _ACROSS * abs(ys[v] - ys[j])
                more += _BRANCH if not (dx or dy) else _BEND if (dx, dy) != step else 0.0
                more += _CROSSING * self.crossed[cell] if new != goal else 0.0
                if more < cost.get(new, float("inf")) - 1e-9:
                    cost[new], came[new] = more, state
                    pushed += 1
                    rest = _ALONG * abs(xs[u] - gx) + _ACROSS * abs(ys[v] - gy)
                    heappush(heap, (more + rest, pushed, more, new))
        raise AssertionError(f"no way for {self.name}")

    def _path(
        self,
        state: tuple[int, int, int, int],
        came: dict[tuple[int, int, int, int], tuple[int, int, int, int]],
    ) -> list[Point]:
        path = [state]
        while path[-1] in came and (len(path) == 1 or path[-1] != state):
            path.append(came[path[-1]])
        return [(self.xs[i], self.ys[j]) for i, j, _, _ in reversed(path)]


def _moves(dx: int, dy: int, turn: bool) -> tuple[tuple[int, int], ...]:
    if not (dx or dy):
        return (1, 0), (-1, 0), (0, 1), (0, -1)
    if not turn:
        return ((dx, dy),)
    return ((dx, dy), (dy, dx), (-dy, -dx))


def _lines(cells: int, used: set[float]) -> list[float]:
    """The cells' own lines, the lines in use between them, and a spare beside each of those."""
    lines = [float(n) for n in range(cells)]
    inside = sorted(used - set(lines))
    for gap in range(cells + 1):
        for low, high in ((gap - 0.9, gap - 0.5), (gap - 0.5, gap - 0.1)):
            here = [x for x in inside if low < x < high]
            ends = [low, *here, high]
            lines += here + [(a + b) / 2 for a, b in pairwise(ends)]
    return sorted(lines)
