"""From grid to pixels: columns as wide as their boxes, gaps as wide as their labels and tracks.

Beside each box the gap keeps a stretch free of tracks for the label of the signal that leaves
there, so that a label can never meet a wire or a box of another part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from vsctrl.diagram.picture.grid import Grid
from vsctrl.diagram.picture.route import Point, Wire

Width = Callable[[str], float]  #: of a signal's name

RADIUS = 11.0  #: of a summing point
NAME = 17.0  #: height kept above a box for its name
LABEL = 19.0  #: height kept above a wire for its signal
TRACK = 14.0  #: between wires side by side
MARGIN = 10.0
_ARROW, _GAP, _SIGN = 20.0, 12.0, 19.0


@dataclass(frozen=True)
class Size:
    """A block's box, and the width of its name above it."""

    width: float
    height: float
    name: float


@dataclass(frozen=True)
class Box:
    """A node's centre and size; ends of the diagram have no size."""

    node: int
    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True)
class Path:
    """A wire with its corners, from its source to the tip of its arrow."""

    signal: str
    points: tuple[Point, ...]


@dataclass(frozen=True)
class Label:
    """A signal's name: its anchor on the baseline, "start", "middle" or "end", and its width."""

    signal: str
    x: float
    y: float
    anchor: str
    width: float


@dataclass(frozen=True)
class Picture:
    """Everything that is drawn, in pixels; y points down."""

    width: float
    height: float
    boxes: tuple[Box, ...]
    paths: tuple[Path, ...]
    dots: tuple[Point, ...]
    labels: tuple[Label, ...]
    signs: tuple[tuple[float, float, int], ...]


def arrange(
    grid: Grid, wires: list[Wire], size: Callable[[int], Size], label_width: Width
) -> Picture:
    """Positions for all of it, given the size of each block and the width of each name."""
    frame = _Frame(grid, wires, size, label_width)
    boxes = tuple(frame.box(i) for i in range(len(grid.spots)))
    paths = tuple(frame.path(wire, boxes) for wire in wires)
    dots = tuple(frame.point(wire.points[0]) for wire in wires if wire.source is None)
    labels = tuple(label for box in boxes if (label := frame.label(box)))
    signs = tuple(sign for box in boxes for sign in frame.signs(box))
    return Picture(frame.x.end + MARGIN, frame.y.end + MARGIN, boxes, paths, dots, labels, signs)


@dataclass(frozen=True)
class _Extent:
    """How far a node's cell reaches from its centre."""

    left: float
    right: float
    up: float
    down: float


class _Axis:
    """Pixel positions of the cells' lines and of the lines used between them."""

    def __init__(
        self,
        cells: list[tuple[float, float]],
        used: Iterable[float],
        before: list[float],
        after: list[float],
    ) -> None:
        """`cells` reach below and above their line; gap g keeps after[g − 1] and before[g] free."""
        self.at: dict[float, float] = {}
        lines = sorted({u for u in used if u != int(u)})
        position = MARGIN
        for gap in range(len(cells) + 1):
            here = [u for u in lines if gap - 1 < u < gap]
            inner = 0 < gap < len(cells)
            if inner or here:
                position += after[gap - 1] if gap else _GAP
            self.at |= {u: position + TRACK * n for n, u in enumerate(here)}
            position += TRACK * max(len(here) - 1, 0)
            if gap < len(cells):
                position += before[gap] if inner or here else 0.0
                self.at[float(gap)] = position + cells[gap][0]
                position += sum(cells[gap])
            elif here:
                position += _GAP
            elif after[gap - 1] > _GAP:
                position += after[gap - 1]
        self.end = position


class _Frame:
    def __init__(
        self, grid: Grid, wires: list[Wire], size: Callable[[int], Size], label_width: Width
    ) -> None:
        self.grid, self.nodes, self.spots = grid, grid.graph.nodes, grid.spots
        self.size, self.label_width = size, label_width
        # The outputs that are not straight ahead of the label of their signal bear its name.
        turned = {wire.sink for wire in wires if wire.source is None or len(wire.points) > 2}
        self.ends = turned & set(grid.graph.of("output"))
        self.extents = [self._extent(i) for i in range(len(self.nodes))]
        self.x = self._columns([x for wire in wires for x, _ in wire.points])
        self.y = self._lanes([y for wire in wires for _, y in wire.points])

    def _extent(self, i: int) -> _Extent:
        node, spot = self.nodes[i], self.spots[i]
        if node.kind == "block":
            size = self.size(i)
            half = max(size.width, size.name) / 2
            return _Extent(half, half, size.height / 2 + NAME, size.height / 2)
        if node.kind == "sum":
            return _Extent(RADIUS, RADIUS, RADIUS + _SIGN, RADIUS + _SIGN)
        if spot.out in ("top", "bottom"):
            half, above = self.label_width(node.gives) / 2, LABEL * (spot.out == "bottom")
            return _Extent(half, half, above, LABEL - above)
        right = 6.0 + self.label_width(node.takes[0][1]) if i in self.ends else 0.0
        return _Extent(0.0, right, LABEL, 8.0)

    def _columns(self, used: list[float]) -> _Axis:
        columns = [spot.column for spot in self.spots]
        left = _largest(columns, [extent.left for extent in self.extents])
        right = _largest(columns, [extent.right for extent in self.extents])
        before, after = [_ARROW] * len(left), [_GAP] * len(left)
        for i, (node, spot) in enumerate(zip(self.nodes, self.spots, strict=True)):
            if self._is_labelled(i) and spot.out in ("left", "right"):
                room, cells = (after, right) if spot.out == "right" else (before, left)
                slack = cells[spot.column] - self._edge(i)
                need = self.label_width(node.gives) + 13.0 - slack
                room[spot.column] = max(room[spot.column], need)
        return _Axis(list(zip(left, right, strict=True)), used, before, after)

    def _lanes(self, used: list[float]) -> _Axis:
        lanes = [spot.lane for spot in self.spots]
        up = _largest(lanes, [extent.up for extent in self.extents])
        down = _largest(lanes, [extent.down for extent in self.extents])
        cells = list(zip(up, down, strict=True))
        return _Axis(cells, used, [8.0] * len(cells), [_GAP] * len(cells))

    def _is_labelled(self, i: int) -> bool:
        """Whether the node's signal is named; those inside a split sum are not."""
        return self.nodes[i].gives.isidentifier()

    def _edge(self, i: int) -> float:
        """From a node's centre to the port at its side."""
        kind = self.nodes[i].kind
        return self.size(i).width / 2 if kind == "block" else RADIUS * (kind == "sum")

    def point(self, point: Point) -> Point:
        """A point of the grid in pixels."""
        return self.x.at[point[0]], self.y.at[point[1]]

    def box(self, i: int) -> Box:
        """A node's box in pixels."""
        spot = self.spots[i]
        x, y = self.point((float(spot.column), float(spot.lane)))
        if self.nodes[i].kind == "block":
            return Box(i, x, y, self.size(i).width, self.size(i).height)
        side = 2 * RADIUS * (self.nodes[i].kind == "sum")
        return Box(i, x, y, side, side)

    def path(self, wire: Wire, boxes: tuple[Box, ...]) -> Path:
        """A wire in pixels, cut off at the boxes where it ends."""
        points = [self.point(point) for point in wire.points]
        if wire.source is not None:
            points[0] = _cut(points[0], points[1], boxes[wire.source])
        points[-1] = _cut(points[-1], points[-2], boxes[wire.sink])
        return Path(wire.signal, tuple(points))

    def label(self, box: Box) -> Label | None:
        """The name of the signal that leaves or ends here."""
        node, spot = self.nodes[box.node], self.spots[box.node]
        if box.node in self.ends:
            name = node.takes[0][1]
            return Label(name, box.x + 6.0, box.y + 4.5, "start", self.label_width(name))
        if not self._is_labelled(box.node):
            return None
        width = self.label_width(node.gives)
        if spot.out in ("top", "bottom"):
            down = -5.0 if spot.out == "bottom" else 14.0
            return Label(node.gives, box.x, box.y + down, "middle", width)
        away = box.width / 2 + (6.0 if box.width else 1.0)
        x, anchor = (box.x + away, "start") if spot.out == "right" else (box.x - away, "end")
        return Label(node.gives, x, box.y - 6.0, anchor, width)

    def signs(self, box: Box) -> list[tuple[float, float, int]]:
        """The sign of each wire into a sum, beside the tip of its arrow."""
        if self.nodes[box.node].kind != "sum":
            return []
        away, beside = RADIUS + 8.0, -9.0 if self.spots[box.node].out == "left" else 9.0
        offset = {"left": (-away, -8.0), "right": (away, -8.0)}
        offset |= {"top": (beside, -away), "bottom": (beside, away)}
        sides = [self.grid.sides[box.node, name] for _, name in self.nodes[box.node].takes]
        return [
            (box.x + offset[side][0], box.y + offset[side][1], sign)
            for side, (sign, _) in zip(sides, self.nodes[box.node].takes, strict=True)
        ]


def _largest(cells: list[int], sizes: list[float]) -> list[float]:
    """The largest size in each column or lane."""
    largest = [0.0] * (1 + max(cells))
    for cell, size in zip(cells, sizes, strict=True):
        largest[cell] = max(largest[cell], size)
    return largest


def _cut(end: Point, inside: Point, box: Box) -> Point:
    """Move the end of a wire from a box's centre to its edge."""
    (x, y), (u, v) = end, inside
    if y == v:
        return x + box.width / 2 * (1 if u > x else -1), y
    return x, y + box.height / 2 * (1 if v > y else -1)
