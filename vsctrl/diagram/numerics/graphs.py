"""Reachability in directed graphs: of matrices by SciPy, of what is only known step by step.

A graph is a matrix (n, n) that is not 0 at (i, j) where an edge leads from node i to node j.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from vsctrl.arrays import Mask

Node = TypeVar("Node")


def closure(edges: NDArray[Any]) -> Mask:
    """Whether a path of no, one or more edges leads from node i to node j, (n, n)."""
    if not len(edges):
        return np.zeros((0, 0), bool)
    return np.isfinite(dijkstra(csr_array(edges != 0), unweighted=True))


def components(edges: NDArray[Any]) -> NDArray[np.int32]:
    """The number of the strongly connected component of each node, (n,)."""
    if not len(edges):
        return np.zeros(0, np.int32)
    return np.asarray(connected_components(csr_array(edges != 0), connection="strong")[1])


def on_cycles(edges: NDArray[Any]) -> Mask:
    """Which nodes are reached from themselves by one edge or more, (n,)."""
    component = components(edges)
    return (np.bincount(component)[component] > 1) | (np.diag(edges) != 0)


def reached(starts: Iterable[Node], after: Callable[[Node], Iterable[Node]]) -> list[Node]:
    """The starts and all nodes that follow from them, each once, in the order they are met."""
    nodes = list(dict.fromkeys(starts))
    known = set(nodes)
    for node in nodes:  # grows while it is read
        new = [n for n in dict.fromkeys(after(node)) if n not in known]
        nodes += new
        known.update(new)
    return nodes
