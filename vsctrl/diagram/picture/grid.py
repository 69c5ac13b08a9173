"""A column and a lane for every part, and the side by which each wire enters.

Each chain of `place` gets columns between the parts it joins (new ones where there are too few)
and a lane that is free over its whole length: inner loops next to the row they belong to, outer
loops farther out. Numbers are ordinals with fractions while the grid grows, integers at the end.
"""

from __future__ import annotations

from dataclasses import dataclass

from vsctrl.diagram.picture.place import Chain, Graph, Spot, main_row, next_chain
from vsctrl.diagram.picture.ports import OPPOSITE, sides

_ENDS = ("input", "output")


@dataclass(frozen=True)
class Grid:
    """Every node's cell, and for each (node, signal it takes) the side where the wire enters."""

    graph: Graph
    spots: list[Spot]
    sides: dict[tuple[int, str], str]


def build(graph: Graph) -> Grid:
    """Place everything."""
    placer = _Placer(graph)
    placer.columns()
    placer.lanes()
    columns = {x: i for i, x in enumerate(sorted(set(placer.column.values())))}
    lanes = {y: i for i, y in enumerate(sorted(set(placer.lane.values())))}
    nodes = range(len(graph.nodes))
    cells = [(columns[placer.column[i]], lanes[placer.lane[i]]) for i in nodes]
    spots = [Spot(*cells[i], placer.out.get(i, "right")) for i in nodes]
    entered = {i: sides(graph, spots, i, lanes[0.0]) for i in nodes}
    entries = {(i, name): side for i in nodes for name, side in entered[i].items()}
    return Grid(graph, spots, entries)


class _Placer:
    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.row = main_row(graph)
        self.column = {i: float(n) for n, i in enumerate(self.row)}
        self.lane: dict[int, float] = dict.fromkeys(self.row, 0.0)
        self.out: dict[int, str] = {}
        self.chains: list[Chain] = []
        self.rows = {0.0}
        self.busy = {0.0: [(0.0, float(len(self.row) - 1))]}

    def columns(self) -> None:
        """A column for each node, chain by chain."""
        while len(self.column) < len(self.graph.nodes):
            chain = next_chain(self.graph, set(self.column))
            if side := self._side_for_input(chain):
                self.out[chain.nodes[0]] = OPPOSITE[side]
                self.column[chain.nodes[0]] = self.column[chain.sink or 0]
            else:
                self._spread(chain)
            self.chains.append(chain)

    def _side_for_input(self, chain: Chain) -> str:
        """The side, "top" or "bottom", by which a lone input can go straight into a sum, or ""."""
        node, sink = chain.nodes[0], chain.sink
        if self.graph.nodes[node].kind != "input" or len(chain.nodes) > 1 or sink is None:
            return ""
        if self.graph.nodes[sink].kind != "sum" or len(self.graph.after[node]) > 1:
            return ""
        taken = {self._likely_side(i, sink) for i, _ in self.graph.before[sink] if i != node}
        wishes = ("bottom", "top") if self.out.get(sink) == "left" else ("top", "bottom")
        return next((side for side in wishes if side not in taken), "")

    def _likely_side(self, source: int, sink: int) -> str:
        """By which side a sum will be entered, as far as that is known before there are lanes."""
        if source not in self.column:
            return ""
        out, facing = self.out.get(source, "right"), self.out.get(sink, "right")
        if out in ("top", "bottom"):
            return OPPOSITE[out]
        if facing == "left":
            return "" if self.column[source] > self.column[sink] else "top"
        if source in self.row and sink in self.row:
            return "" if self.row.index(source) + 1 == self.row.index(sink) else "bottom"
        return "top" if out == "right" else "bottom"

    def _spread(self, chain: Chain) -> None:
        """Columns for a chain: along the flow between its ends, or back against it."""
        low = None if chain.source is None else self.column[chain.source]
        high = None if chain.sink is None else self.column[chain.sink]
        count = len(chain.nodes)
        if low is not None and high is not None:
            columns = self._spread_between(chain, low, high)
        elif high is not None:
            inside = [x for x in self._known() if x < high][-count:]
            missing = count - len(inside)
            columns = [min(self._known()) - missing + n for n in range(missing)] + inside
        else:
            start = float("-inf") if low is None else low
            inside = [x for x in self._known() if x > start][:count]
            top = max(self._known())
            columns = inside + [top + 1 + n for n in range(count - len(inside))]
        self.column |= dict(zip(chain.nodes, columns, strict=True))

    def _spread_between(self, chain: Chain, source: float, sink: float) -> list[float]:
        """Columns for a chain with two ends; one that flows to the left is turned."""
        ends = [i for i in (chain.source, chain.sink) if i is not None]
        low, high = min(source, sink), max(source, sink)
        leftward = sink <= source
        # In a lane that flows to the left, left is forward.
        forward = all(self.out.get(i) == "left" for i in ends) == leftward
        inside = [x for x in self._known() if low < x < high]
        if not forward:
            # Against the flow a part may stand right below the one that feeds it; not below a
            # sum that it feeds, which is entered from there.
            inside += [source]
            inside += [sink] if self.graph.nodes[ends[-1]].kind != "sum" and low < high else []
            inside.sort()
        columns = self._window(inside, len(chain.nodes), (low + high) / 2)
        if not columns:
            last = max((x for x in inside if x < high), default=low)
            columns = sorted(inside + self._fresh(last, len(chain.nodes) - len(inside)))
        if leftward:
            self.out |= dict.fromkeys(chain.nodes, "left")
            columns.reverse()
        return columns

    def _known(self) -> list[float]:
        return sorted(set(self.column.values()))

    def _fresh(self, after: float, count: int) -> list[float]:
        """New columns between `after` and the next one."""
        following = next((x for x in self._known() if x > after), after + 1.0)
        return [after + (following - after) * (n + 1) / (count + 1) for n in range(count)]

    def _window(self, inside: list[float], count: int, middle: float) -> list[float]:
        """Neighbouring columns near the middle, blocks over blocks where that is possible."""
        blocks = {
            self.column[i] for i in self.row if self.graph.nodes[i].kind == "block"
        }  # a wide box over a sum would push the main row apart
        windows = [inside[n : n + count] for n in range(len(inside) - count + 1)]

        def cost(window: list[float]) -> tuple[int, float, float]:
            off = abs(sum(window) / count - middle)
            return sum(x not in blocks for x in window), off, -window[0]

        return min(windows, key=cost) if windows else []

    def lanes(self) -> None:
        """A lane for each node: chains on which others hang first, then short ones first."""
        depth: dict[int, int] = dict.fromkeys(self.row, 0)
        keyed = []
        for n, chain in enumerate(self.chains):
            anchors = [i for i in (chain.source, chain.sink) if i is not None]
            level = max((depth[i] + 1 for i in anchors), default=0)
            depth |= dict.fromkeys(chain.nodes, level)
            low, high = self._extent(chain)
            # Ends hang on what is there already, so they come last.
            end = len(chain.nodes) == 1 and self.graph.nodes[chain.nodes[0]].kind in _ENDS
            keyed.append(((end, level, high - low, n), chain))
        for _, chain in sorted(keyed, key=lambda pair: pair[0]):
            lane = self._lane(chain)
            self.lane |= dict.fromkeys(chain.nodes, lane)
            self.busy.setdefault(lane, []).append(self._extent(chain))

    def _extent(self, chain: Chain) -> tuple[float, float]:
        ends = [i for i in (chain.source, chain.sink) if i is not None]
        columns = [self.column[i] for i in [*chain.nodes, *ends]]
        return min(columns), max(columns)

    def _lane(self, chain: Chain) -> float:
        source, sink = chain.source, chain.sink
        if source is None and sink is None:
            lane = max(self.busy) + 1
            self.rows.add(lane)
            return lane
        extent = self._extent(chain)
        lanes = [self.lane[i] for i in (source, sink) if i is not None]
        if lanes[0] != lanes[-1]:
            return self._between(lanes[0], lanes[-1], extent)
        if sink is None and source is not None and self.out.get(source, "right") == "right":
            beyond = (self.column[source] + 1e-9, extent[1])
            if self._free(lanes[0], beyond):
                return lanes[0]
        below = self.out.get(chain.nodes[0], "right") in ("left", "top")
        return self._outward(lanes[0], 1 if below else -1, extent)

    def _free(self, lane: float, extent: tuple[float, float]) -> bool:
        return not any(a <= extent[1] and extent[0] <= b for a, b in self.busy[lane])

    def _outward(self, lane: float, step: int, extent: tuple[float, float]) -> float:
        """The next free lane above (−1) or below (+1), in front of any other row."""
        while True:
            beyond = sorted((x for x in self.busy if (x - lane) * step > 0), key=lambda x: x * step)
            if not beyond:
                return lane + step
            if beyond[0] in self.rows or (self.out and self._drop(beyond[0], extent)):
                return (lane + beyond[0]) / 2
            lane = beyond[0]
            if self._free(lane, extent):
                return lane

    def _drop(self, lane: float, extent: tuple[float, float]) -> bool:
        """Whether a dropping input would have to go past a lane that is taken."""
        return extent[0] == extent[1] and not self._free(lane, extent)

    def _between(self, a: float, b: float, extent: tuple[float, float]) -> float:
        low, high = min(a, b), max(a, b)
        inner = sorted(x for x in self.busy if low < x < high)
        for lane in inner:
            if lane not in self.rows and self._free(lane, extent):
                return lane
        return ((inner[-1] if inner else low) + high) / 2
