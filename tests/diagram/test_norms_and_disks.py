"""Norms and disk margins: closed forms, python-control without delays, dense grids with them."""

import math

import control
import effort
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.delay import figure1

import vsctrl as vs
from vsctrl.errors import InputError
from vsctrl.symbols import s

R = sp.Rational


def channel(transfer):
    """One block."""
    parts = [vs.Block("block", transfer, "u -> y")]
    return vs.Diagram(parts, inputs=["u"], outputs=["y"]).at()["u", "y"]


def opened(transfer):
    """L of a unity-feedback loop of one block."""
    parts = [vs.Sum("e = r - y"), vs.Block("L", transfer, "e -> y")]
    return vs.Diagram(parts, inputs=["r"], outputs=["y"]).at().open("y")


# Norms -------------------------------------------------------------------------------------
@pytest.mark.parametrize("late", [0, 3])
def test_norms_of_a_lag_do_not_depend_on_its_dead_time(late):
    """K/(Ts + 1): K/√(2T), and K at ω = 0."""
    H = channel(3 * sp.exp(-late * s) / (5 * s + 1))
    assert H.norm(2) == pytest.approx(3 / math.sqrt(10), rel=1e-12)
    assert H.norm("inf") == 3.0
    assert H.peak_gain() == (3.0, 0.0)


@pytest.mark.parametrize("zeta", ["0.3", "0.01", "0.0000001"])
def test_norms_of_a_resonance(zeta):
    """1/(s² + 2ζs + 1): 1/(2√ζ), and 1/(2ζ√(1 − ζ²)) at √(1 − 2ζ²)."""
    z = float(zeta)
    H = channel(1 / (s**2 + 2 * R(zeta) * s + 1))
    assert H.norm(2) == pytest.approx(0.5 / math.sqrt(z), rel=1e-8)
    peak = H.peak_gain()
    assert peak.gain == pytest.approx(0.5 / (z * math.sqrt(1 - z * z)), rel=1e-9)
    assert peak.frequency == pytest.approx(math.sqrt(1 - 2 * z * z), rel=1e-7)


@pytest.mark.parametrize("x", [0.3, 0.9, 1.4])
def test_h2_of_figure_1_in_closed_form(x):
    """∫h² of K e^{−τs}/(s + K e^{−τs}) is K cos x/(2(1 − sin x)), x = Kτ (late or not)."""
    loop = figure1().at(lam=x / 0.08, tau=0.08, ell=1, ell_hat=1, k_ff=0)
    square = x / 0.08 * math.cos(x) / (2 * (1 - math.sin(x)))
    assert loop["S_ref", "S"].norm(2) == pytest.approx(math.sqrt(square), rel=1e-11)


def test_the_peak_of_the_sensitivity_is_that_of_the_margins():
    loop = figure1().at(lam=8, tau=0.08, ell=1, ell_hat=1, k_ff=0)
    m, peak = loop.open("S_meas").margins(), loop["S_ref", "e"].peak_gain()
    assert peak.gain == pytest.approx(m.peak_sensitivity, rel=1e-12)
    assert peak.frequency == pytest.approx(m.peak_frequency, rel=1e-6)


def test_norms_that_are_infinite_and_limits_at_the_ends():
    assert channel(1 / s).norm("inf") == channel(1 / (s - 1)).norm(2) == math.inf
    assert channel((s + 2) / (s + 1)).norm(2) == channel(sp.exp(-s)).norm(2) == math.inf
    assert channel(s / (s + 1)).peak_gain() == (1.0, math.inf)
    assert channel(1 / (s - 1)).peak_gain().gain == pytest.approx(1.0)
    assert channel(1 / (1 + sp.exp(-s) / 2)).norm("inf") == pytest.approx(2.0, rel=1e-12)
    with pytest.raises(InputError, match="give 2 or 'inf'"):
        channel(1 / (s + 1)).norm(1)


# Disk margins ------------------------------------------------------------------------------
@pytest.mark.parametrize("skew", [0.0, 1.0, -1.0, 0.5])
def test_disks_of_python_control(skew):
    """The example of Seiler, Packard and Gahinet, on a grid of python-control's own."""
    d = opened(25 / (s**3 + 10 * s**2 + 10 * s + 10)).disk_margin(skew)
    grid = np.linspace(1.85, 2.05, 1001)
    alpha, _, phase = control.disk_margins(control.tf([25], [1, 10, 10, 10]), grid, skew)
    assert d.alpha == pytest.approx(float(alpha), rel=1e-5)
    assert math.degrees(d.phase) == pytest.approx(float(phase), rel=1e-5)
    assert d.stable and 1.8 < d.frequency < 2.1


def test_the_disks_of_s_and_of_t_are_the_inverses_of_their_peaks():
    L = opened(2 * sp.exp(-s / 10) / s)
    m = L.margins()
    assert L.disk_margin(1.0).alpha == pytest.approx(1 / m.peak_sensitivity, rel=1e-12)
    assert L.disk_margin(-1.0).alpha == pytest.approx(1 / m.peak_complementary, rel=1e-12)
    assert L.disk_margin(1.0).gain_min == pytest.approx(1 / (1 + 1 / m.peak_sensitivity), rel=1e-12)


K, late = sp.symbols("K late", positive=True)
LOOP = vs.Diagram(
    [vs.Sum("e = r - y"), vs.Block("L", K * sp.exp(-late * s) / (s * (s + 1)), "e -> y")],
    inputs=["r"],
    outputs=["y"],
)
gains = st.integers(1, 9).map(lambda k: k / 10)


@settings(max_examples=effort.share(40))
@given(gains, st.integers(1, 20), st.sampled_from([-1.0, -0.5, 0.0, 0.7, 1.0]))
def test_no_change_in_the_disk_destabilises_and_one_on_its_edge_does(share, late, skew):
    """|δ| = α somewhere makes L f = −1; gain and phase margins are no smaller than the disk's."""
    slow = LOOP.at(K=0.01, late=late / 10)
    L = slow.with_(K=0.01 * share * slow.open("y").margins().gain).open("y")
    d, m = L.disk_margin(skew), L.margins()
    assert d.stable and d.gain_max <= m.gain * (1 + 1e-9)
    assert d.phase <= m.phase * (1 + 1e-9) or math.isinf(d.phase)
    w = np.geomspace(1e-3, 1e3, 4001)
    f = -1 / L(1j * w)  # what would make L f = −1
    delta = np.abs((f - 1) / ((1 - skew) / 2 + (1 + skew) / 2 * f))
    assert delta.min() >= d.alpha * (1 - 1e-12)
    assert delta.min() == pytest.approx(d.alpha, rel=1e-3)
    phi = d.phase if math.isfinite(d.phase) else 1.0
    edge = np.exp(1j * phi)
    size = abs((edge - 1) / ((1 - skew) / 2 + (1 + skew) / 2 * edge))
    assert size == pytest.approx(d.alpha, rel=1e-9) or (math.isinf(d.phase) and size < d.alpha)


def test_an_unstable_loop_tolerates_nothing():
    d = opened(20 * sp.exp(-s / 10) / s).disk_margin()
    assert (d.alpha, d.gain_min, d.gain_max, d.phase, d.stable) == (0.0, 1.0, 1.0, 0.0, False)
    assert "unstable" in str(d) and "critical" not in str(d)
    with pytest.raises(InputError, match="disk_margin: skew"):
        opened(1 / s).disk_margin("a")


# Samples with time stamps ------------------------------------------------------------------
def test_samples_at_uneven_times_are_steps_or_straight_lines_between_them():
    t = [0.0, 0.1, 0.35, 1.0]
    held, lines = (vs.Samples([1, 3, -2, 0.5], times=t, hold=h) for h in ("zero", "first"))
    assert held([0.05, 0.1, 0.34, 0.35, 5]) == pytest.approx([1, 3, 3, -2, 0.5])
    assert held([0.1], side="left") == pytest.approx([1])
    assert lines([0.05, 0.1, 0.225, 5]) == pytest.approx([2, 3, 0.5, 0.5])
    H = channel(sp.exp(-s / 2) / (s + 1))
    pieces = vs.Step() + 2 * vs.Step().delayed(0.1) - 5 * vs.Step().delayed(0.35)
    pieces = pieces + 2.5 * vs.Step().delayed(1)
    at = np.linspace(0, 4, 41)
    assert H.response(held, at).outputs == pytest.approx(H.response(pieces, at).outputs, abs=1e-13)


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_even_time_stamps_are_a_period(hold):
    values = np.sin(np.arange(150))
    H, at = channel(sp.exp(-s / 3) / (s + 1)), np.linspace(0, 8, 33)
    even = H.response(vs.Samples(values, 0.04, hold), at).outputs
    stamped = vs.Samples(values, times=0.04 * np.arange(150), hold=hold)
    assert H.response(stamped, at).outputs == pytest.approx(even, abs=1e-12)
    p = 0.3 + 2j
    assert stamped.laplace(p) == pytest.approx(vs.Samples(values, 0.04, hold).laplace(p))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({}, "either a period"),
        ({"period": 1.0, "times": [0, 1]}, "either a period"),
        ({"times": [0, 1, 2]}, "3 times for 2 values"),
        ({"times": [-1, 1]}, "negative"),
        ({"times": [1, 1]}, "does not come after"),
        ({"times": "ab"}, "times = 'ab'"),
    ],
)
def test_time_stamps_that_are_none_are_refused(arguments, said):
    with pytest.raises(InputError, match=said):
        vs.Samples([1.0, 2.0], **arguments)
