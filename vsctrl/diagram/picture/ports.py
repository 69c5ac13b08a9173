"""By which side each wire enters a part.

A block is entered from behind; a sum has three sides for its wires, and which wire takes which
decides whether the picture reads like a textbook's: the row from behind, feedback from below,
feed-forward and disturbances from above.
"""

from __future__ import annotations

from vsctrl.diagram.picture.place import Graph, Spot

OPPOSITE = {"right": "left", "left": "right", "top": "bottom", "bottom": "top"}
_SIDEWAYS = ("left", "right")


def sides(graph: Graph, spots: list[Spot], node: int, home: int) -> dict[str, str]:
    """Where each wire enters a node: straight wires from behind, others from their own side."""
    spot = spots[node]
    names = [name for _, name in graph.nodes[node].takes]
    back = OPPOSITE[spot.out]
    if graph.nodes[node].kind != "sum":
        return dict.fromkeys(names, back)
    others = [spots[graph.driver[name]] for name in names]
    straight = next((n for n, o in enumerate(others) if _straight(spots, o, spot, back)), None)
    if straight is None:
        straight = next((n for n, o in enumerate(others) if _behind(o, spot)), None)
    wishes: list[tuple[int, int, str]] = []
    for n, other in enumerate(others):
        if n == straight or other.out in ("top", "bottom"):
            wishes.append((0, n, back if n == straight else OPPOSITE[other.out]))
        else:
            level = other.lane == spot.lane
            # Feedback goes below, but around the outside where another row follows below.
            outside = spot.lane < home or (spot.lane == home and _row_below(graph, spots, home))
            above = other.lane < spot.lane or (level and outside)
            wishes.append((1 + abs(other.column - spot.column), n, "top" if above else "bottom"))
    free, entries = [back, "top", "bottom"], {}
    for _, n, wish in sorted(wishes):
        entries[names[n]] = wish if wish in free else free[0]
        free.remove(entries[names[n]])
    return entries


def _behind(source: Spot, sink: Spot) -> bool:
    """Whether a wire from another lane comes from where the flow in this one comes from."""
    upstream = source.column < sink.column if sink.out == "right" else source.column > sink.column
    return upstream and source.lane != sink.lane and source.out in _SIDEWAYS


def _row_below(graph: Graph, spots: list[Spot], home: int) -> bool:
    """Whether another input leads into a row of its own below the main one."""
    return any(
        spots[i].lane > home and spots[i].out == "right" and spots[i].column == 0
        for i in graph.of("input")
    )


def _straight(spots: list[Spot], source: Spot, sink: Spot, back: str) -> bool:
    """Whether a level wire can run from one cell to the other with nothing in between."""
    if source.lane != sink.lane or source.out != OPPOSITE.get(back):
        return False
    low, high = sorted((source.column, sink.column))
    ahead = (sink.column - source.column) * (1 if back == "left" else -1) > 0
    return ahead and not any(s.lane == sink.lane and low < s.column < high for s in spots)
