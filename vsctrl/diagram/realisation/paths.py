"""Which blocks of a diagram lie between signals or on a loop, as its wiring tells."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.description.wiring import Wiring, resolve
from vsctrl.diagram.numerics.graphs import reached

Edges = defaultdict[str, list[str]]


def between(diagram: Wiring, sources: Iterable[str], targets: Iterable[str]) -> set[str]:
    """The outputs of the blocks that some inputs reach and that reach some signals."""
    fed_by, feeds = _edges(diagram)
    ends = [leaf for name in targets for leaf in resolve(diagram, name)]
    back, onward = reached(ends, fed_by.__getitem__), reached(sources, feeds.__getitem__)
    return {block.output for block in diagram.blocks}.intersection(back, onward)


def loops_through(diagram: Wiring, outputs: Iterable[str]) -> list[Block]:
    """The blocks of all loops that go through one of some blocks, given by their outputs."""
    fed_by, feeds = _edges(diagram)
    inside: set[str] = set()
    for output in outputs:
        before = reached([output], fed_by.__getitem__)
        inside.update(name for name in reached(feeds[output], feeds.__getitem__) if name in before)
    return [block for block in diagram.blocks if block.output in inside]


def _edges(diagram: Wiring) -> tuple[Edges, Edges]:
    """What each block's output follows from, and what each leaf is followed by."""
    fed_by, feeds = Edges(list), Edges(list)
    for block in diagram.blocks:
        for leaf in resolve(diagram, block.input):
            fed_by[block.output].append(leaf)
            feeds[leaf].append(block.output)
    return fed_by, feeds
