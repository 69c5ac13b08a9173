"""Roots of neutral loops right of a line: closed forms, printed numbers and plain winding counts.

The oracle is a winding of the scalar characteristic function, written out by hand, round a
rectangle in plain doubles, so finely sampled that no step turns by half a turn.
"""

import math
from itertools import pairwise

import effort
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.symbols import s

R = sp.Rational


def neutral(a, neutrals, lates=()):
    """x'(t) = a x(t) + Σ b x(t − τ) + Σ c x'(t − h), driven by u."""
    late = sum((sp.Rational(str(b)) * sp.exp(-sp.Rational(str(t)) * s) for b, t in lates), R(0))
    fast = sum((sp.Rational(str(c)) * sp.exp(-sp.Rational(str(h)) * s) for c, h in neutrals), R(0))
    block = Block("plant", 1 / (s - sp.Rational(str(a)) - late - s * fast), "u -> x")
    return Diagram([block], inputs=["u"], outputs=["x"]).at()


def function(a, neutrals, lates=()):
    """The characteristic function of the same equation, for arrays and for mpmath numbers."""

    def value(p, exp=np.exp):
        late = sum(b * exp(-p * t) for b, t in lates)
        return p * (1 - sum(c * exp(-p * h) for c, h in neutrals)) - a - late

    return value


def winding(value, left, right, top, points=30_001):
    """Zeros in a rectangle symmetric about the real axis."""
    floor = np.linspace(left, right, points // 4)
    path = np.concatenate(
        [
            floor - 1j * top,
            right + 1j * np.linspace(-top, top, points),
            floor[::-1] + 1j * top,
            left + 1j * np.linspace(top, -top, points),
        ]
    )
    at = value(path)
    turns = np.angle(at[1:] / at[:-1])
    if np.abs(turns).max() >= 2.0:
        assert points < 5_000_000, "the oracle's own steps are too long"
        return winding(value, left, right, top, 4 * points)
    return round(turns.sum() / (2 * np.pi))


def agrees(found, value, top=150.0):
    """The count, the list and the winding say the same, and the list zeroes the function."""
    assert found.certified
    assert found.count == len(found.roots) == winding(value, found.sigma, 50.0, top)
    for root in found.roots:
        with mp.workdps(30):
            exact = mp.findroot(lambda p: value(p, mp.exp), mp.mpc(root), tol=1e-20)
        # A simple root's accuracy, see `rightmost`.
        assert abs(complex(exact) - root) < 1e-10 * (1 + abs(root))


@pytest.mark.parametrize("c", [-0.9, -0.4, 0.3, 0.8])
@pytest.mark.parametrize("h", ["0.5", "2"])
def test_one_neutral_delay_has_its_chain_at_log_c_over_h(c, h):
    terms = (0.5, [(c, h)], [(-2.0, "0.7")])
    value = function(0.5, [(c, float(h))], [(-2.0, 0.7)])
    system = neutral(*terms)
    line = math.log(abs(c)) / float(h)
    for sigma in (line + 0.15, line + 0.5, 0.0, 0.3):
        found = system.roots_right_of(sigma)
        assert found.chain == pytest.approx(line, abs=1e-14)
        agrees(found, value)
        assert "strongly: small changes" in found.sentence
    chain = system.roots_right_of(line - 0.1)
    assert chain.certified
    assert math.isinf(chain.count)
    assert system.unstable_roots == system.roots_right_of(0.0).count


def test_the_winding_of_mpmath_agrees():
    """N = (1/2πj)∮ f'/f ds by quadrature with 15 digits, on a rectangle."""
    found = neutral(0.5, [(0.8, 1)], [(-2.0, "0.7")]).roots_right_of(0.0)
    c, h, b, tau = 0.8, 1.0, -2.0, 0.7

    def slope(p):
        return 1 - c * mp.exp(-p * h) * (1 - p * h) + b * tau * mp.exp(-p * tau)

    value = function(0.5, [(c, h)], [(b, tau)])
    corners = [0 - 20j, 5 - 20j, 5 + 20j, 0 + 20j, 0 - 20j]
    total = mp.mpc(0)
    for start, end in pairwise(corners):
        pieces = [start + (end - start) * k / 20 for k in range(21)]
        total += mp.quad(lambda p: slope(p) / value(p, mp.exp), pieces)
    # |s| ≤ (0.5 + 2)/(1 − 0.8) = 12.5 on the right, so the rectangle holds them all.
    assert float((total / (2j * mp.pi)).real) == pytest.approx(found.count, abs=1e-6)
    assert found.certified


def test_a_published_neutral_equation_is_stable_but_not_strongly():
    """x' = x/4 − x(t − 1)/3 + ¾x'(t − 1) − ½x'(t − 2): chains tend to −ln √2, all roots left of 0.

    P. Appeltans, W. Michiels, TDS-CONTROL manual, 2023, example 2.6, whose point is that with
    τ₂ = 2.005 there are roots right of the axis: ¾ + ½ > 1.
    """
    terms = [(0.75, 1.0), (-0.5, 2.0)]
    value = function(0.25, terms, [(-1 / 3, 1.0)])
    block = 1 / (s - R(1, 4) + sp.exp(-s) / 3 - s * (R(3, 4) * sp.exp(-s) - sp.exp(-2 * s) / 2))
    system = Diagram([Block("p", block, "u -> x")], inputs=["u"], outputs=["x"]).at()
    found = system.roots_right_of(0.0)
    assert (found.count, found.certified) == (0, True)
    assert found.chain == pytest.approx(-math.log(math.sqrt(2)), abs=1e-14)
    assert "not strongly" in found.sentence
    assert system.unstable_roots == 0
    for sigma in (-0.15, -0.3, -0.33):
        agrees(system.roots_right_of(sigma), value, top=40.0)
    moved = neutral(0.25, [(0.75, 1), (-0.5, "2.005")], [(-0.333, 1)])
    fallen = moved.roots_right_of(0.0)
    assert math.isinf(fallen.count)
    assert fallen.certified
    # ¾x + ½x² = 1 with x = e^{−c}: no delays near these bring a chain further right than c.
    bound = -math.log(math.sqrt(0.75**2 + 2) - 0.75)
    assert -0.3 < 0 < fallen.chain <= bound + 1e-12
    beyond = moved.roots_right_of(bound + 0.02)
    assert (beyond.count, beyond.certified) == (0, True)
    assert "strongly: small changes" in beyond.sentence


@pytest.mark.parametrize(("c1", "c2"), [(0.5, 0.3), (-0.5, 0.3), (0.2, -0.7)])
def test_two_incommensurate_delays_within_the_sum_bound(c1, c2):
    """1 − c₁e^{−s} − c₂e^{−s√2}, |c₁| + |c₂| < 1: strongly stable whatever the delays (Hale)."""
    root2 = repr(math.sqrt(2))
    system = neutral(0.3, [(c1, 1), (c2, root2)], [(-1.5, "0.4")])
    value = function(0.3, [(c1, 1.0), (c2, math.sqrt(2))], [(-1.5, 0.4)])
    for sigma in (0.0, 0.2):
        found = system.roots_right_of(sigma)
        agrees(found, value)
        assert "strongly: small changes" in found.sentence
        # Σ|c|e^{−σT} = 1 is the supremum of all phases, which these delays' ratio comes near.
        assert abs(c1) * math.exp(-found.chain) + abs(c2) * math.exp(
            -found.chain * math.sqrt(2)
        ) == pytest.approx(1.0, abs=1e-9)


def test_two_incommensurate_delays_beyond_it_have_a_chain_on_the_right():
    """1 + ½e^{−s} + 0.7e^{−s√2}: no real zero, but phases come together somewhere up the axis."""
    root2 = repr(math.sqrt(2))
    found = neutral(-1, [(-0.5, 1), (-0.7, root2)]).roots_right_of(0.0)
    assert math.isinf(found.count)
    assert found.certified


@pytest.mark.parametrize("h2", ["2", "3", "1.5", "1.25"])
def test_commensurate_chains_lie_where_the_polynomial_says(h2):
    """1 − c₁q^a − c₂q^b, q = e^{−s/4}: c_D = 4 ln max|1/q|, mostly left of the strong bound."""
    c1, c2 = 0.6, 0.6
    a, b = 4, round(4 * float(h2))
    monic = np.zeros(b + 1)  # in 1/q
    monic[0], monic[a], monic[b] = 1.0, -c1, c2
    line = 4 * math.log(np.abs(np.roots(monic)).max())
    system = neutral(-0.2, [(c1, 1), (-c2, h2)], [(-1.0, "0.3")])
    value = function(-0.2, [(c1, 1.0), (-c2, float(h2))], [(-1.0, 0.3)])
    found = system.roots_right_of(line + 0.05)
    assert found.chain == pytest.approx(line, abs=1e-12)
    agrees(found, value)
    assert math.isinf(system.roots_right_of(line - 0.02).count)


def test_the_chain_of_two_thousand_steps():
    """1 − 0.6q^1000 + 0.6q^2001: the rightmost zero, by Newton's method from each branch."""
    found = neutral(-1, [(0.6, 1), (-0.6, "2.001")]).roots_right_of(0.5)
    w = np.linspace(0, 1000 * np.pi, 2_000_001)
    best = -np.inf
    for line in (0.0, 0.1, 0.15):
        small = np.abs(1 - 0.6 * np.exp(-(line + 1j * w)) + 0.6 * np.exp(-2.001 * (line + 1j * w)))
        p = line + 1j * w[np.argsort(small)[:2000]]
        for _ in range(50):
            e, g = 0.6 * np.exp(-p), 0.6 * np.exp(-2.001 * p)
            p = p - (1 - e + g) / (e - 2.001 * g)
        good = np.abs(1 - 0.6 * np.exp(-p) + 0.6 * np.exp(-2.001 * p)) < 1e-10
        best = max(best, p[good].real.max())
    assert found.chain == pytest.approx(best, abs=1e-9)


def test_a_chain_on_the_line_itself_is_seen_to_tend_to_it_from_the_left():
    """x' = x'(t − 1) − x: e^{−s} = (s + 1)/s, larger than 1 right of −1/2; seen, not certified."""
    found = neutral(-1, [(1, 1)]).roots_right_of(0.0)
    assert not found.certified
    assert found.count == 0
    assert "tends to 0 rad/s from the left" in found.sentence
    assert found.chain == pytest.approx(0.0, abs=1e-14)


def test_delays_in_series_feed_through_but_make_no_chain():
    """Two delays after one another round an integrator: λ e^{−s(τ₁+τ₂)}/s is retarded."""
    parts = [
        Block("plant", -3 / s, "w -> y"),
        Block("there", sp.exp(-s / 5), "y -> v"),
        Block("back", sp.exp(-s / 2), "v -> w"),
    ]
    found = Diagram(parts, inputs=[], outputs=["y"]).at().roots_right_of(-3.0)
    assert found.chain == -math.inf
    assert "chain" not in found.sentence
    agrees(found, lambda p, exp=np.exp: p + 3 * exp(-p * 0.7))


def test_three_delays_across_two_blocks_against_the_expanded_determinant():
    """Delayed gains in a ring and an integrator: f = 1 − k₁k₂e^{−s(τ₁+τ₂)} − k₃e^{−sτ₃}."""
    parts = [
        Block("one", R(4, 5) * sp.exp(-s / 2), "u1 -> y1"),
        Block("two", -R(1, 2) * sp.exp(-3 * s / 10), "y1 -> y2"),
        Block("three", R(2, 5) * sp.exp(-s), "u1 -> y3"),
        Block("four", -2 / (s + 1), "u1 -> y4"),
    ]
    system = Diagram([*parts, Sum("u1 = y2 + y3 + y4 + r")], inputs=["r"], outputs=["y1"]).at()

    def value(p, exp=np.exp):
        return (p + 1) * (1 + 0.4 * exp(-p * 0.8) - 0.4 * exp(-p)) + 2

    for sigma in (0.0, -0.1, -0.2):
        agrees(system.roots_right_of(sigma), value)


GAIN = st.floats(-0.95, 0.95).map(lambda x: round(x, 2)).filter(lambda x: abs(x) > 0.04)
LATE = st.sampled_from([0.25, 0.5, 0.75, 1.0, 1.3, 2.0])


@settings(max_examples=effort.share(25), deadline=None, derandomize=True)
@given(
    a=st.floats(-2, 2).map(lambda x: round(x, 2)),
    neutrals=st.lists(st.tuples(GAIN, LATE), min_size=1, max_size=2, unique_by=lambda t: t[1]),
    b=st.floats(-4, 4).map(lambda x: round(x, 2)),
    tau=LATE,
    sigma=st.sampled_from([-0.4, 0.0, 0.1, 0.5]),
)
def test_random_neutral_loops_have_as_many_roots_as_the_winding_says(a, neutrals, b, tau, sigma):
    found = neutral(a, neutrals, [(b, tau)]).roots_right_of(sigma)
    value = function(a, neutrals, [(b, tau)])
    if math.isinf(found.count):
        # A chain: the further up the rectangle reaches, the more roots it holds.
        line = found.chain
        assert line > sigma
        edge = sigma - 1e-6
        low, high = (winding(value, edge, 50.0, top, 100_001) for top in (71.3, 311.7))
        assert high > low or line - sigma < 0.05
    elif found.certified and found.count <= 20:
        agrees(found, value, 500.0)
    assert found.certified or abs(found.chain - sigma) < 1e-3 or "too near" in found.sentence
