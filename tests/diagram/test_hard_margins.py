"""Margins where they are hard: feedthrough, poles on the axis, exact edges, endless phase.

Expected values are closed forms, written beside each; none is worked out by the package.
"""

import math

import numpy as np
import pytest
import sympy as sp
from sympy import Rational, exp

from vsctrl.cli import main
from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.errors import InputError, LimitError
from vsctrl.loop import figure1
from vsctrl.symbols import s

INF = math.inf


def unit_feedback(L, **values):
    parts = [Sum("e = r - y"), Block("L", L, "e -> y")]
    return Diagram(parts, inputs=["r"], outputs=["y"]).at(**values)


def margins(L, **values):
    return unit_feedback(L, **values).open("y").margins()


def at_omega(L, w):
    return sp.lambdify(s, L, "numpy")(1j * w)


@pytest.mark.parametrize(
    "L", [(2 * s + Rational(1, 2)) / (s + 1), 3 * (s + 1) / (s + 2), (s + 2) / (s + 1)]
)
def test_a_loop_that_lets_high_frequencies_through_stands_no_delay(L):
    assert margins(L).stable
    assert margins(L).delay == 0.0


def test_a_loop_that_lets_less_than_all_through_keeps_its_delay_margin():
    """|L| = 1 where ω² + 16 = 4ω² + 4 for (s + 4)/(2s + 2), that is ω = 2."""
    L = (s + 4) / (2 * s + 2)
    w = 2.0
    phase = math.pi + np.angle(at_omega(L, w))
    assert margins(L).delay == pytest.approx(phase / w, rel=1e-12)


def test_an_undamped_pole_is_no_crossing():
    """|L|² (1 − ω²)² (1 + ω²) = (1 − ω²)²/4 + ω², a cubic in ω²; |T| the same with 1 + L."""
    L = (Rational(1, 2) + s / (s**2 + 1)) / (s + 1) * exp(-s / 10)
    found = margins(L)
    x = np.polynomial.Polynomial([0, 1])
    cubic = (1 - x) ** 2 * (1 + x) - (1 - x) ** 2 / 4 - x
    roots = cubic.roots()
    w = np.sort(np.sqrt(roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0)].real))
    assert [at for at, _ in found.gain_crossings] == pytest.approx(w, rel=1e-10)
    phases = [np.angle(-at_omega(L, at)) for at in w]
    assert found.phase == pytest.approx(min(phases, key=abs), rel=1e-10)
    level = abs(0.5 / 1.5) * 10**-0.15
    fallen = abs(at_omega(L, found.bandwidth) / (1 + at_omega(L, found.bandwidth)))
    assert fallen == pytest.approx(level, rel=1e-9)
    below = np.linspace(1e-3, found.bandwidth * 0.999, 20_001)
    values = at_omega(L, below)
    assert (np.abs(values / (1 + values)) > level).all()


def test_the_bandwidth_passes_over_an_undamped_pole():
    """T = (s + 1)/(s² + s + 2), T(0) = ½: (1 + x)/((2 − x)² + x) = 10^(−0.3)/4 with x = ω²."""
    level = 10**-0.3 / 4
    # level (x² − 3x + 4) = 1 + x
    x = max(np.roots([level, -3 * level - 1, 4 * level - 1]))
    assert margins((s + 1) / (s**2 + 1)).bandwidth == pytest.approx(math.sqrt(x), rel=1e-10)


@pytest.mark.parametrize("L", [exp(-s / 10) / (s - 1), -1 / (s + 1), (s + 1) / (s**2 - 1)])
def test_a_loop_that_is_minus_one_at_zero_is_at_its_edge(L):
    found = margins(L)
    assert not found.stable
    assert (found.gain, found.peak_sensitivity, found.peak_frequency) == (1.0, INF, 0.0)
    assert found.phase_crossings[0] == (0.0, 1.0)


@pytest.mark.parametrize("L", [(1 - s) / (1 + s), -s / (s + 1), sp.Integer(-1)])
def test_a_singular_algebraic_loop_is_refused(L):
    with pytest.raises(InputError, match="singular"):
        margins(L)


def test_a_pade_model_of_a_loop_with_an_undamped_pole_is_found():
    L = unit_feedback((Rational(1, 2) + s / (s**2 + 1)) / (s + 1) * exp(-s / 10)).open("y")
    assert L.pade(tol=1e-2, on="margins").order <= 4


def test_what_a_neutral_loop_rises_to_counts_at_infinity():
    """|L| rises to ½, never reached, and the phase winds: gain 1/½, Ms 1/(1 − ½), Mt ½/(1 − ½)."""
    found = margins(Rational(1, 2) * ((s + Rational(1, 10)) / (s + 1)) ** 4 * exp(-10 * s))
    assert found.gain == pytest.approx(2, rel=1e-9)
    assert found.peak_sensitivity == pytest.approx(2, rel=1e-9)
    assert found.peak_complementary == pytest.approx(1, rel=1e-9)
    assert found.peak_frequency == found.complementary_frequency == INF


def test_two_delays_let_through_what_their_period_says():
    """L → 0.3 e^{−s} − 0.4 e^{−2s}; S, T and crossings on a fine grid of its period 2π."""
    L = (s + Rational(1, 10)) / (s + 4) * (Rational(3, 10) * exp(-s) - Rational(2, 5) * exp(-2 * s))
    found = margins(L)
    z = np.exp(-1j * np.linspace(0, 2 * np.pi, 2_000_001))
    F = 0.3 * z - 0.4 * z**2
    # Quadratic in the step of 3e-6 at an extremum.
    assert found.peak_sensitivity == pytest.approx((1 / np.abs(1 + F)).max(), rel=1e-9)
    assert found.peak_complementary == pytest.approx(np.abs(F / (1 + F)).max(), rel=1e-9)
    # On the real axis sin θ (0.3 − 0.8 cos θ) = 0: F = −0.7 at θ = π, −0.1 at 0, 0.4 otherwise.
    assert found.gain == pytest.approx(1 / 0.7, rel=1e-9)


def test_no_loop_at_all_limits_nothing():
    found = margins(sp.Symbol("K") / (s + 1), K=0)
    assert (found.gain, found.gain_down, found.phase, found.delay) == (INF, 0, INF, INF)
    assert (found.peak_sensitivity, found.peak_complementary, found.bandwidth) == (1, 0, 0)


@pytest.mark.parametrize("x", [2e4, 1e5])
def test_the_crossing_of_a_loop_late_by_thousands_of_turns_is_found(x):
    """|λe^{−s}/s| = 1 at ω = λ, with phase −π/2 − λ; −1 where ω = π/2 + 2πk."""
    found = figure1.at(lam=x, tau=1, ell=1, ell_hat=1, k_ff=1).open("S_meas").margins()
    assert found.unstable_roots == 2 * math.ceil((x - math.pi / 2) / (2 * math.pi))
    ((at, phase),) = found.gain_crossings
    assert at == pytest.approx(x, rel=1e-12)
    # The crossing is known to some 1e-13 of ω, which turns the phase by that part of ωτ.
    assert phase == pytest.approx(math.remainder(math.pi / 2 - x, 2 * math.pi), abs=1e-12 * x)
    last = math.pi / 2 + 2 * math.pi * math.floor((x - math.pi / 2) / (2 * math.pi))
    assert found.gain_down == pytest.approx(last / x, rel=1e-12)
    assert found.gain == pytest.approx((last + 2 * math.pi) / x, rel=1e-12)
    # T first falls where L = λ/ω is positive: −π/2 − ω = −2πk and λ/ω/(1 + λ/ω) below 10^(−0.15).
    fallen = 10**-0.15
    assert found.bandwidth == pytest.approx(x * (1 - fallen) / fallen, abs=2 * math.pi)


def test_roots_of_one_delay_are_counted_however_many_they_are():
    """2/(s + 1) is 1 at √3 rad/s; below, −ωτ − atan ω passes −π − 2πk with a pair each."""
    unstable = unit_feedback(2 * exp(-(10**6) * s) / (s + 1)).unstable_roots
    assert unstable == 2 * math.ceil((1e6 * math.sqrt(3) - 2 * math.pi / 3) / (2 * math.pi))
    unstable = figure1.at(lam=1e10, tau=0.08, ell=1, ell_hat=1, k_ff=1).unstable_roots
    assert unstable == 2 * math.ceil((8e8 - math.pi / 2) / (2 * math.pi))


def test_roots_too_many_to_count_are_not_given_a_number():
    with pytest.raises(LimitError, match="at least 32"):
        unit_feedback(2 * (exp(-(10**6) * s) + exp(-1234567 * s)) / (s + 1)).unstable_roots  # noqa: B018
    with pytest.raises(LimitError, match="too many"):
        figure1.at(lam=1e10, tau=0.08, ell=1, ell_hat=1, k_ff=1).open("S_meas").margins()


def test_zeros_on_the_axis_are_no_phase_crossings():
    """(1 − e^{−s})/s = e^{−s/2} sinc: its phase −ω/2 falls to −π and jumps back, never through."""
    found = margins((1 - exp(-s)) / s)
    assert found.gain == INF
    assert found.phase_crossings == ()


def test_a_pure_delay_is_at_its_edge_and_crosses_nowhere_else():
    """L = e^{−s} is −1 at odd multiples of π."""
    found = margins(exp(-s))
    assert not found.stable
    assert found.gain == 1.0
    assert found.delay == 0.0
    for at, phase in found.gain_crossings:
        assert math.cos(at) == pytest.approx(-1, abs=1e-12)
        assert phase == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    "words",
    [
        "--gain 1e300 --delay 1e300",
        "--gain 1e308 --delay 0 --ratio 1e308",
        "--gain 2.5 --delay .08 --period 1e-320",
        "--gain 2.5 --delay 1e-320",
    ],
)
def test_the_command_line_refuses_numbers_it_cannot_multiply(words):
    from click.testing import CliRunner

    found = CliRunner().invoke(main, ["loop", *words.split()])
    assert found.exit_code == 2
    assert "not usable" in found.output
    assert "Traceback" not in found.output
