"""Reachability, strongly connected components and cycles, against powers of the matrix."""

import numpy as np
import pytest

from vsctrl.diagram.numerics.graphs import closure, components, on_cycles, reached


def graphs():
    random = np.random.default_rng(5)
    for n in (0, 1, 2, 3, 5, 9, 16):
        for density in (0.0, 0.5 / max(n, 1), 1 / max(n, 1), 2 / max(n, 1), 1.0):
            yield np.where(random.random((n, n)) < density, random.normal(size=(n, n)), 0.0)


def paths(edges):
    """Whether there is a path of 1, 2, … or n edges: sums of powers of the matrix of counts."""
    step = (edges != 0).astype(object)  # integers of any length
    power, total = step, step
    for _ in range(len(edges)):
        power = power @ step
        total = total + power
    return np.array(total != 0, bool).reshape(edges.shape)


@pytest.mark.parametrize("edges", list(graphs()))
def test_paths_are_those_that_powers_of_the_matrix_count(edges):
    some = paths(edges)
    both = some | np.eye(len(edges), dtype=bool)
    np.testing.assert_array_equal(closure(edges), both)
    np.testing.assert_array_equal(on_cycles(edges), np.diag(some))
    label = components(edges)
    np.testing.assert_array_equal(label[:, None] == label, both & both.T)
    for start in range(len(edges)):
        nodes = reached(np.flatnonzero(edges[start]), lambda i, e=edges: np.flatnonzero(e[i]))
        assert sorted(nodes) == np.flatnonzero(some[start]).tolist()


def test_nodes_are_met_in_order_and_once():
    after = {0: (3, 1, 3), 1: (4, 0), 3: (2,), 2: (), 4: (2,)}
    assert reached((0, 0), after.__getitem__) == [0, 3, 1, 2, 4]
