"""Peak of T = L/(1 + L) and bandwidth: closed forms, python-control, and a brute-force grid."""

import math

import control
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from oracles.delay import figure1

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.symbols import s


def loop(transfer):
    """A unity-feedback loop of one block."""
    parts = [Sum("e = r - y"), Block("plant", transfer, "e -> y")]
    return Diagram(parts, inputs=["r"], outputs=["y"]).at().open("y")


@pytest.mark.parametrize("x", [0.2, 0.4, 0.7, 1.0, 1.3, 1.55])
@pytest.mark.parametrize("late", [0.08, 3.0])
def test_figure_1_in_closed_form(x, late):
    """L = x e^{−ju}/(ju), u = ωτ, so |T|² = x²/(u² − 2ux sin u + x²)."""
    system = figure1().at(lam=x / late, tau=late, ell=1, ell_hat=1, k_ff=0)
    m = system.open("S_meas").margins()
    below = lambda u: u**2 - 2 * u * x * mp.sin(u) + x**2  # noqa: E731
    with mp.workdps(30):
        grid = [mp.mpf(k) / 200 for k in range(1, 800)]
        at = min(grid, key=below)
        if below(at) < x**2:
            at = mp.findroot(lambda u: mp.diff(below, u), at)
            expected = float(at), float(x / mp.sqrt(below(at)))
        else:
            expected = 0.0, 1.0
        drop = mp.mpf(10) ** mp.mpf("0.3") * x**2  # 3 dB, as python-control and MATLAB have it
        first = next(u for u in grid if below(u) > drop)
        half = mp.findroot(lambda u: below(u) - drop, first)
    assert m.complementary_frequency * late == pytest.approx(expected[0], rel=1e-7, abs=0)
    assert m.peak_complementary == pytest.approx(expected[1], rel=1e-12, abs=0)
    assert m.bandwidth * late == pytest.approx(float(half), rel=1e-11, abs=0)


@pytest.mark.parametrize("zeta", [0.05, 0.3, 0.6, 0.9])
def test_second_order_loop_without_delay(zeta):
    """T = 1/(s² + 2ζs + 1): Mt = 1/(2ζ√(1−ζ²)) at ω = √(1−2ζ²), and the textbook bandwidth."""
    m = loop(1 / (s * (s + sp.Rational(str(2 * zeta))))).margins()
    rises = zeta < math.sqrt(0.5)
    assert m.peak_complementary == pytest.approx(
        1 / (2 * zeta * math.sqrt(1 - zeta**2)) if rises else 1.0, rel=1e-12, abs=0
    )
    at = math.sqrt(1 - 2 * zeta**2) if rises else 0.0
    assert m.complementary_frequency == pytest.approx(at, rel=1e-6, abs=0)
    q = 1 - 2 * zeta**2
    at = math.sqrt(q + math.sqrt(q**2 + 10**0.3 - 1))
    assert m.bandwidth == pytest.approx(at, rel=1e-12, abs=0)


def test_the_bandwidth_is_that_of_python_control():
    """A loop without integrator: −3 dB of T(0), which is not 1."""
    plant = control.tf([3.0], [0.02, 0.3, 1.0])
    m = loop(3 / (sp.Rational(1, 50) * s**2 + sp.Rational(3, 10) * s + 1)).margins()
    assert m.bandwidth == pytest.approx(control.feedback(plant, 1).bandwidth(), rel=1e-6, abs=0)


def test_a_loop_that_never_falls_has_no_end_to_its_bandwidth():
    m = loop(sp.Rational(1, 2)).margins()
    assert (m.bandwidth, m.peak_complementary) == (math.inf, pytest.approx(1 / 3, rel=1e-15, abs=0))


def test_a_loop_that_lets_no_constant_through_has_no_bandwidth():
    """T(0) = 0: nothing to fall from."""
    m = loop(s / (s + 1) ** 2).margins()
    assert m.bandwidth == 0.0
    # T = s/(s² + 3s + 1), largest at ω = 1, where it is 1/3.
    assert m.peak_complementary == pytest.approx(1 / 3, rel=1e-12, abs=0)
    assert m.complementary_frequency == pytest.approx(1.0, rel=1e-6, abs=0)


@pytest.mark.parametrize("gain", [0.3, 0.9, 1.4])
def test_against_a_grid_where_two_delays_ripple(gain):
    transfer = sp.Rational(str(gain)) * (sp.exp(-s / 3) + sp.exp(-2 * s)) / (s + 1) / (s / 5 + 1)
    m = loop(transfer).margins()
    omega = np.geomspace(1e-4, 1e2, 1_000_001)
    late = np.exp(-1j * omega / 3) + np.exp(-2j * omega)
    L = gain * late / (1j * omega + 1) / (1j * omega / 5 + 1)
    T = np.abs(L / (1 + L))
    assert m.peak_complementary == pytest.approx(T.max(), rel=1e-8, abs=0)
    assert m.complementary_frequency == pytest.approx(omega[T.argmax()], rel=1e-4, abs=0)
    assert m.bandwidth == pytest.approx(omega[(T[0] * 10**-0.15 > T).argmax()], rel=2e-5, abs=0)


def positive(transfer):
    """The same with positive feedback."""
    parts = [Sum("e = r + y"), Block("plant", transfer, "e -> y")]
    return Diagram(parts, inputs=["r"], outputs=["y"]).at().open("y").margins()


def test_a_root_that_crosses_at_zero_bounds_the_gain():
    """1 − g/(2(s + 1)): the root g/2 − 1 crosses at ω = 0 for g = 2, where S = 2, T = −1 too."""
    m = positive(1 / (2 * (s + 1)))
    assert m.gain == pytest.approx(2.0, rel=1e-12, abs=0)
    assert m.phase_crossings == ((0.0, pytest.approx(2.0, rel=1e-12, abs=0)),)
    assert (m.peak_sensitivity, m.peak_frequency) == (pytest.approx(2.0, rel=1e-9, abs=0), 0.0)
    assert m.stable


def test_a_root_that_crosses_at_infinity_bounds_the_gain():
    """1 − g(s + 1)/(2(s + 3)): the root (g − 6)/(2 − g) passes infinity at g = 2, and 0 at 6."""
    m = positive((s + 1) / (2 * (s + 3)))
    assert m.gain == pytest.approx(2.0, rel=1e-12, abs=0)
    assert [w for w, _ in m.phase_crossings] == [0.0, math.inf]
    assert [g for _, g in m.phase_crossings] == pytest.approx([6.0, 2.0], rel=1e-9, abs=0)
    assert (m.peak_sensitivity, m.peak_frequency) == (pytest.approx(2.0, rel=1e-9, abs=0), math.inf)
