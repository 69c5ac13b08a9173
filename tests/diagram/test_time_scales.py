"""Margins where the rates of a loop lie far apart, against closed forms and dense scans of L."""

import math

import numpy as np
import pytest
from effort import some
from oracles.random_loops import Loop, slow_and_fast
from sympy import Rational, exp

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.symbols import s

INF = math.inf


def margins(*blocks):
    return Loop(blocks, None, 0.0).system().open("y").margins()


@pytest.mark.parametrize("Ti", [30, 100, 1000, 3600, 10**6, 10**9])
def test_a_slow_integral_action_round_a_fast_plant_crosses_where_it_is_the_plant(Ti):
    """K²(1 + 1/(ωTᵢ)²) = 1 as the plant is 1 there; K = 1/2: ω Tᵢ = 1/√3, phase −60°."""
    plant = exp(-Rational(1, 100) * s) / (s / 100 + 1)
    found = margins(Rational(1, 2) * (1 + 1 / (Ti * s)), plant)
    ((w, phase),) = found.gain_crossings
    assert w == pytest.approx(1 / (math.sqrt(3) * Ti), rel=1e-4)
    assert math.degrees(phase) == pytest.approx(120, abs=0.2)
    assert found.delay == pytest.approx(phase / w, rel=1e-12)
    assert found.stable and found.bandwidth < 1 / Ti


def test_a_slow_resonance_of_the_controller_is_the_peak():
    """L ≈ (1 − (w₀/ω)² + 2ζ w₀/(jω))/2 far below the plant's 1000 rad/s: |1 + L| least near w₀/√3.

    There 1 + L = (3 − x²)/2 − jζx with x = w₀/ω: |1 + L| = √3 ζ at x = √3 but for ζ².
    """
    w0, z = Rational("0.02"), Rational("0.01")
    controller = (s**2 + 2 * z * w0 * s + w0**2) / s**2 / 2
    found = margins(controller, exp(-s / 1000) / (s / 1000 + 1))
    assert found.peak_sensitivity == pytest.approx(1 / (math.sqrt(3) * 0.01), rel=2e-3)
    assert found.peak_frequency == pytest.approx(0.02 / math.sqrt(3), rel=1e-3)
    assert math.degrees(found.phase) == pytest.approx(0.991, abs=1e-3)
    assert found.modulus == pytest.approx(1 / found.peak_sensitivity)


def test_a_sharp_peak_at_the_unit_circle_is_seen_beside_thousands_of_lower_ones():
    """With 0.85° of phase left at 3.1 mrad/s, beside |L| = 0.955 over thousands of turns: a scan.

    Near L = −1, where |L| = 1, the peak of S is that of T but for some per cent.
    """
    zeros = Rational(191, 200) * s**2 + Rational(14707, 312500000) * s + Rational(9359, 488281250)
    C = zeros / s**2
    found = margins(C * exp(-Rational(13, 200) * s) / (Rational(51, 200000) * s + 1))
    L = lambda w: complex(C.subs(s, 1j * w)) * np.exp(-0.065j * w) / (1 + 2.55e-4j * w)  # noqa: E731
    w = 0.0031312580916409 * (1 + np.linspace(-0.05, 0.05, 2001))
    scanned = max(abs(1 / (1 + L(x))) for x in w)
    assert scanned > 67 and found.peak_sensitivity == pytest.approx(scanned, rel=1e-4)
    assert found.peak_frequency == pytest.approx(0.00313, rel=1e-2)


@pytest.mark.parametrize("fast", [1, 1e3, 1e6, 1e9, 1e12])
def test_a_slow_inner_loop_is_not_overlooked(fast):
    """x = (e − x) ε/s has the pole −ε that no block has; 2ε/(s + ε) is 1 at √3 ε, at −60°."""
    eps = Rational(f"{1 / fast:.3g}")
    parts = [
        Sum("e = r - y"),
        Sum("v = e - x"),
        Block("inner", eps / s, "v -> x"),
        Block("gain", 2, "x -> x2"),
        Block("lag", exp(-s / 1000) / (s / 1000 + 1), "x2 -> y"),
    ]
    found = Diagram(parts, inputs=["r"], outputs=["y"]).at().open("y").margins()
    ((w, phase),) = found.gain_crossings
    assert w == pytest.approx(math.sqrt(3) * float(eps), rel=1e-4)
    assert math.degrees(phase) == pytest.approx(120, abs=0.3)


def test_a_gain_margin_is_infinite_only_where_nothing_limits():
    """K/(s + 1)³ at √3 rad/s is −K/8; Ke^{−0.1s}/(s + 1) at ω/10 + atan ω = π."""
    assert margins(Rational(1, 10**4) / (s + 1) ** 3).gain == pytest.approx(8e4, rel=1e-9)
    found = margins(Rational(1, 10**4) * exp(-s / 10) / (s + 1))
    w = 16.32
    for _ in range(50):
        w = 10 * (math.pi - math.atan(w))
    assert found.gain == pytest.approx(1e4 * math.hypot(1, w), rel=1e-9)
    assert margins(Rational(1, 10**4) / (s + 1) ** 2).gain == INF


def test_the_bandwidth_of_a_loop_that_lets_all_through_is_that_of_its_slow_part():
    """T = L/(1 + L), L = 1/(s + 1) + e^{−4s}, falls 3 dB below T(0) = 2/3, by bisection."""
    found = margins(1 / (s + 1) + exp(-4 * s))
    w = np.linspace(1e-3, 2, 2_000_001)
    L = 1 / (1j * w + 1) + np.exp(-4j * w)
    first = w[(np.abs(L / (1 + L)) < 2 / 3 * 10**-0.15).argmax()]
    assert found.bandwidth == pytest.approx(first, abs=2e-6)


def test_random_loops_of_any_spread_against_a_dense_scan():
    assert sum(is_as_scanned(seed) for seed in some(range(2000), 12)) > 0


OMEGA = np.geomspace(1e-9, 1e6, 60_001)


def is_as_scanned(seed):
    """Assert it of one loop; False where it has so many roots that their count is refused."""
    drawn = slow_and_fast(np.random.default_rng(seed))
    resolved = OMEGA[OMEGA * drawn.delay < 300]
    L = drawn.L(1j * resolved)
    if (np.abs(drawn.L(1j * OMEGA[OMEGA * drawn.delay >= 300])) > 0.9).any():
        return False
    found = drawn.system().open("y").margins()
    told = np.array([w for w, _ in found.gain_crossings])
    for w in resolved[:-1][np.diff(np.sign(np.abs(L) - 1)) != 0]:
        assert np.abs(np.log(told / w)).min() < 1e-3, (seed, drawn.blocks, w)
    peak = np.abs(1 / (1 + L)).max()
    assert found.peak_sensitivity >= peak * (1 - 1e-9), (seed, drawn.blocks)
    if found.stable and 0 < found.delay < INF:
        room = np.angle(-drawn.L(1j * told)) % (2 * math.pi) / told
        assert found.delay == pytest.approx(room.min(), rel=1e-7), (seed, drawn.blocks)
    return True
