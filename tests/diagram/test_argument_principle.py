"""Roots right of a line: the count of the argument principle against Lambert W and matrices."""

import numpy as np
import pytest
import sympy as sp
from oracles.delay import WORKING, figure1
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


def test_a_loop_of_a_gain_and_a_delay_has_nothing_but_its_chain():
    """1 + k e^{−s}: all roots on Re s = ln k."""

    def neutral(gain):
        return Diagram(
            [Sum("e = r - w"), Block("k", gain, "e -> y"), Block("l", sp.exp(-s), "y -> w")],
            outputs=["y"],
        ).at()

    chain = neutral(1.5).roots_right_of()
    assert np.isinf(chain.count)
    assert chain.certified
    assert "infinitely many" in chain.sentence
    calm = neutral(0.5).roots_right_of()
    assert calm.count == 0
    assert calm.certified
    assert calm.chain == pytest.approx(np.log(0.5), abs=1e-14)
    on_it = neutral(1.0).roots_right_of()
    assert not on_it.certified
    assert "not certified" in on_it.sentence


def test_a_root_on_the_line_is_said_not_to_be_certified():
    """s + e^{−s} − 1 is exactly 0 at s = 0, twice."""
    shifted = Diagram(
        [Sum("e = r - w"), Block("p", 1 / s, "e -> y"), Block("l", sp.exp(-s) - 1, "y -> w")],
        outputs=["y"],
    ).at()
    on_it = shifted.roots_right_of(0.0)
    assert not on_it.certified
    assert "too near the line" in on_it.sentence


@pytest.mark.parametrize("order", [2, 3, 4, 6])
def test_a_multiple_root_is_found_as_often_as_it_is_one(order):
    """(s + 1)^m beside a delayed loop: each to ε^{1/m} at least, their mean much better."""
    parts = [
        Block("a", 1 / (s + 1) ** order, "u -> x"),
        Block("b", 1 / (s + 5 + sp.exp(-s) / 10), "x -> y"),
    ]
    system = Diagram(parts, inputs=["u"], outputs=["y"]).at()
    for found in (system.poles(order + 2), system["u", "y"].poles(order)):
        assert np.abs(found[:order] + 1).max() < 2.2e-16 ** (1 / order)
        assert np.abs(found[order:] + 1).min(initial=1.0) > 0.5


def test_signals_that_cancel_in_equal_delays_leave_no_false_roots():
    """A perfect Smith predictor's s (s + λ), far left of where e^{−sτ} is 9 million."""
    lead, late = 200.0, 0.08
    parts = [
        Block("gain", lead, "e -> u"),
        Block("plant", sp.exp(-tau * s) / s, "u -> y"),
        Block("model", 1 / s, "u -> x"),
        Block("late model", sp.exp(-tau * s), "x -> z"),
        Sum("e = r - y - x + z"),
    ]
    found = Diagram(parts, inputs=["r"], outputs=["y"]).at(tau=late)
    poles = found.poles(6)
    # s (s + λ) for the two integrators, both within rounding times e^{λτ}.
    assert len(poles) == 2
    np.testing.assert_allclose(poles, [0.0, -lead], rtol=1e-6, atol=1e-9)
    assert found.roots_right_of(-300.0).count == 2
