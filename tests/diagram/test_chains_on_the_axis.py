"""Neutral loops whose chain of roots tends to the imaginary axis, from one side or the other.

1 + L with L = q(s)/p(s) e^{−sτ} + r(s) has |e^{−sτ}| = |(1 + r) p/q| at a root: larger than 1
throughout the right half plane leaves no root there, less than 1 far up puts a chain there.
"""

import math

import numpy as np
import pytest
from sympy import exp

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.symbols import s

INF = math.inf


def unity(L):
    return Diagram([Sum("e = r - y"), Block("L", L, "e -> y")], inputs=["r"], outputs=["y"]).at()


@pytest.mark.parametrize(
    ("L", "count"),
    [
        (1 / (s + 1) + exp(-4 * s), 0),  # |s + 2| > |s + 1|
        (3 / (s + 1) + exp(-4 * s), 0),
        (1 / s + exp(-s), 0),
        (1 / (s + 1) - exp(-s), 0),
        ((s + 1) / (s + 2) * exp(-s), 0),
        ((s - 2) / (s - 3) * exp(-s), 1),  # and |s − 3| > |s − 2| but right of 5/2, where one is
        ((s + 2) / (s + 1) * exp(-s), INF),  # |s + 1| < |s + 2|
        (10 / (s + 1) ** 2 + exp(-s), INF),  # |1 − 10/ω²| < 1
        (exp(-s), INF),  # all on the axis
        ((s - 1) / (s + 1) * exp(-s), INF),
    ],
)
def test_the_roots_on_or_right_of_the_axis_are_counted_as_they_are(L, count):
    system = unity(L)
    assert system.unstable_roots == count
    found = system.open("y").margins()
    assert found.unstable_roots == count
    assert not found.stable
    assert found.gain == 1
    if count == 0:
        assert found.delay == 0
        assert "tends to the imaginary axis" in found._repr_html_()
        assert "from the left" in system.roots_right_of(0).sentence


def test_the_real_root_beside_a_chain_is_the_one_of_a_fixed_point():
    """(s − 3) = −(s − 2) e^{−s}, by iteration."""
    root = 3.0
    for _ in range(200):
        root = 3 - (root - 2) * math.exp(-root)
    found = unity((s - 2) / (s - 3) * exp(-s)).roots_right_of(0)
    assert found.count == 1
    np.testing.assert_allclose(found.roots, [root], rtol=1e-12)


def test_sensitivity_is_unbounded_where_roots_come_as_near_as_one_likes():
    found = unity(1 / (s + 1) + exp(-4 * s)).open("y").margins()
    assert (found.peak_sensitivity, found.peak_frequency) == (INF, INF)
    assert found.modulus == 0


def test_a_chain_left_of_the_axis_for_good_leaves_a_stable_loop():
    found = unity(1 / (s + 1) + 0.99 * exp(-4 * s)).open("y").margins()
    assert found.stable and found.unstable_roots == 0 and found.peak_sensitivity < INF
