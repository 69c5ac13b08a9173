"""Roots right of a line: the count of the argument principle against Lambert W and matrices."""

import numpy as np
import pytest
import sympy as sp
from delay_oracle import WORKING, figure1
from scipy.special import lambertw

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.symbols import lam, s, tau


def branches(x, late):
    """W_k(−x)/τ over enough branches for any line used here."""
    return np.array([lambertw(-x, k) / late for k in range(-2000, 2000)])


@pytest.mark.parametrize("x", [0.05, 0.2, 0.5, 1.5, 1.6, 5.0, 80.0])
@pytest.mark.parametrize("line", [-60.0, -20.0, -5.0, -1.0, 0.0, 3.0])
def test_figure1_against_lambert(x, line):
    system = figure1().at(WORKING | {"lam": x / 0.08})
    exact = branches(x, 0.08)
    exact = exact[exact.real > line]
    found = system.roots_right_of(line)
    assert found.certified
    assert found.count == len(exact)
    assert len(found.roots) == min(len(exact), 64)  # no more are listed
    for root in found.roots:
        # A double root at x near 1/e is known to the square root of rounding only.
        assert np.abs(exact - root).min() < 1e-9 * (1 + abs(root))
    assert f"{len(exact)} roots" in found.sentence


def test_without_delay_it_is_the_spectrum():
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-6.0, -3.0, 2.0]])
    polynomial = s**3 - 2 * s**2 + 3 * s + 6
    system = Diagram([Block("p", 1 / polynomial, "u -> y")]).at()
    spectrum = np.linalg.eigvals(A)
    for line in (-2.0, -0.5, 0.0, 1.0, 2.0):
        assert system.roots_right_of(line).count == (spectrum.real > line).sum()


def test_an_unstable_plant_in_a_delayed_loop():
    """ẋ = a x − k x(t − τ), a τ < 1: stable iff a < k < √(a² + ω²) with ω = a tan ωτ."""
    a, late = 1.0, 0.4
    loop = Diagram(
        [
            Sum("e = r - w"),
            Block("plant", lam / (s - 1), "e -> y"),
            Block("late", sp.exp(-tau * s), "y -> w"),
        ],
        outputs=["y"],
    )
    low, high = 1e-3, np.pi / 2 / late - 1e-6
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if a * np.tan(middle * late) < middle else (low, middle)
    top = np.hypot(a, low)
    expected = {0.9: 1, 1.1: 0, 0.99 * top: 0, 1.01 * top: 2}
    for gain, count in expected.items():
        found = loop.at(lam=gain, tau=late).roots_right_of()
        assert (found.count, len(found.roots), found.certified) == (count, count, True)


def test_a_neutral_loop_says_why_it_is_not_certified():
    def neutral(gain):
        return Diagram(
            [Sum("e = r - w"), Block("k", gain, "e -> y"), Block("l", sp.exp(-s), "y -> w")],
            outputs=["y"],
        ).at()

    chain = neutral(1.5).roots_right_of()
    assert np.isinf(chain.count)
    assert "infinitely many" in chain.sentence
    calm = neutral(0.5).roots_right_of()
    assert calm.count == 0
    assert not calm.certified
    assert "not certified" in calm.sentence
