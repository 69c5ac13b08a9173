"""Which cell of a grid each part of a picture takes: the textbook habits.

The forward path makes the main row; the other parts are grouped into chains, each of which gets a
lane of its own where it needs one: feedback below, flowing back; feed-forward above. Columns and
lanes are counted here, not measured; pixels are left to `layout`, wires to `route`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

from vsctrl.diagram.description.blocks import Block, Sum
from vsctrl.diagram.description.wiring import Wiring

SEARCH = 4000  #: steps spent on a longest path; beyond, the best one found so far is taken


@dataclass(frozen=True)
class Node:
    """Something with a cell of its own; `takes` and `gives` are signal names."""

    kind: str  #: "block", "sum", "input" or "output"
    takes: tuple[tuple[int, str], ...]
    gives: str
    part: Block | Sum | None = None


@dataclass(frozen=True)
class Spot:
    """A cell, and the side its output leaves by: "right", "left", "top" or "bottom"."""

    column: int
    lane: int
    out: str = "right"


class Graph:
    """The diagram's parts and ends as nodes, joined by signals."""

    def __init__(self, diagram: Wiring) -> None:
        self.nodes = [node for part in diagram.shown for node in _nodes(part)]
        self.nodes += [Node("input", (), name) for name in diagram.inputs]
        self.nodes += [Node("output", ((1, name),), "") for name in dict.fromkeys(diagram.outputs)]
        self.driver = {node.gives: i for i, node in enumerate(self.nodes) if node.gives}
        self.after: list[list[tuple[int, int]]] = [[] for _ in self.nodes]
        self.before: list[list[tuple[int, int]]] = [[] for _ in self.nodes]
        for i, node in enumerate(self.nodes):
            for sign, name in node.takes:
                self.after[self.driver[name]].append((i, sign))
                self.before[i].append((self.driver[name], sign))

    def of(self, *kinds: str) -> list[int]:
        """The nodes of these kinds, in the diagram's order."""
        return [i for i, node in enumerate(self.nodes) if node.kind in kinds]

    def longest(self, start: int, goals: set[int], allowed: set[int]) -> list[int]:
        """The longest simple path from `start` to a goal that enters sums by the fewest minuses.

        A minus is where a loop closes: without that rule the longest path would run through
        the feedback of a neighbouring loop.
        """
        best: tuple[tuple[int, int], list[int]] = ((-len(self.nodes), 0), [])
        path, on_path, steps = [start], {start}, 0

        def walk(node: int, minuses: int) -> None:
            nonlocal best, steps
            steps += 1
            if node in goals and (-minuses, len(path)) > best[0]:
                best = ((-minuses, len(path)), path.copy())
            for after, sign in self.after[node]:
                worse = minuses + (sign < 0)
                if after not in allowed or after in on_path or -worse < best[0][0]:
                    continue
                if steps < SEARCH:
                    path.append(after)
                    on_path.add(after)
                    walk(after, worse)
                    on_path.remove(path.pop())

        walk(start, 0)
        return best[1]


def _nodes(part: Block | Sum) -> Iterable[Node]:
    """A block as it is; a sum as circles in a row, as a circle has room for three wires only."""
    if isinstance(part, Block):
        yield Node("block", ((1, part.input),), part.output, part)
        return
    terms, made = list(part.terms), 0
    while len(terms) > 3:
        made += 1
        partial = f"{part.output}+{made}"
        yield Node("sum", tuple(terms[:3]), partial, part)
        terms[:3] = [(1, partial)]
    yield Node("sum", tuple(terms), part.output, part)


def main_row(graph: Graph) -> list[int]:
    """The forward path, from the first input to the first output where a path joins them."""
    parts = set(graph.of("block", "sum"))
    starts, ends = graph.of("input"), graph.of("output")
    for end in ends:
        for start in starts:
            row = graph.longest(start, {end}, parts | {end})
            if len(row) > 2:
                return _past_errors(graph, row, ends, parts)
    for start in [*starts, min(parts)]:
        row = graph.longest(start, parts, parts)
        if row:
            return _up_to_output(graph, row)
    raise AssertionError("a diagram has at least one part")


def _past_errors(graph: Graph, row: list[int], ends: list[int], parts: set[int]) -> list[int]:
    """A row to an error signal holds no block yet: let it lead on to the next output."""
    if any(graph.nodes[i].kind == "block" for i in row):
        return row
    for end in ends:
        free = (parts - set(row)) | {end}
        more = graph.longest(row[-2], {end}, free) if end != row[-1] else []
        if any(graph.nodes[i].kind == "block" for i in more):
            return row[:-2] + more
    return row


def _up_to_output(graph: Graph, row: list[int]) -> list[int]:
    """Without a declared output the row ends at S for an input S_ref, else where it can."""
    stem = graph.nodes[row[0]].gives.partition("_")[0]
    for n, i in enumerate(row[1:], 2):
        if graph.nodes[i].gives == stem:
            return row[:n]
    return row


@dataclass(frozen=True)
class Chain:
    """Nodes in the order of flow, with the placed nodes that feed it and that it feeds."""

    nodes: list[int]
    source: int | None
    sink: int | None


def next_chain(graph: Graph, placed: set[int]) -> Chain:
    """The chain to place next: anchored at both ends if there is one, and then the longest."""
    free = set(graph.of("block", "sum")) - placed
    if not free:
        return _end(graph, placed)
    leaving = {i for i in free if any(j not in free for j, _ in graph.after[i])}
    known = placed | set(graph.of("input"))
    best: tuple[tuple[int, int, int], list[int]] = ((-1, 0, 0), [])
    for start in sorted(free):
        anchored = any(i in known for i, _ in graph.before[start])
        for goals in (leaving, free):
            path = graph.longest(start, goals, free)
            if path:
                minuses = sum(dict(graph.after[a])[b] < 0 for a, b in pairwise(path))
                score = 2 * anchored + (goals is leaving), -minuses, len(path)
                best = max(best, (score, path), key=lambda pair: pair[0])
    return _anchored(graph, best[1], placed)


def _anchored(graph: Graph, path: list[int], placed: set[int]) -> Chain:
    inputs, outputs = set(graph.of("input")), set(graph.of("output"))
    before = [(i, k) for i, k in graph.before[path[0]] if i in placed or i in inputs]
    # A plus leads into a chain before a minus does; then a wire before a new end.
    source = min(before, key=lambda pair: (-pair[1], pair[0] not in placed), default=(None, 0))[0]
    after = [i for i, _ in graph.after[path[-1]] if i not in path]
    starts = source is not None and source not in placed
    ahead = [i for i in after if i in outputs and i not in placed]
    joined = [i for i in after if i in placed]
    sink = next(iter(ahead + joined if starts else joined + ahead), None)
    nodes = [source, *path] if starts and source is not None else path
    nodes = [*nodes, sink] if sink is not None and sink not in placed else nodes
    return Chain(
        nodes, None if starts else source, sink if sink is not None and sink in placed else None
    )


def _end(graph: Graph, placed: set[int]) -> Chain:
    """An input or output that no chain has taken along."""
    end = min(set(graph.of("input", "output")) - placed)
    if graph.nodes[end].kind == "output":
        return Chain([end], graph.before[end][0][0], None)
    sums = [i for i, _ in graph.after[end] if graph.nodes[i].kind == "sum"]
    return Chain([end], None, (sums or [graph.after[end][0][0]])[0])
