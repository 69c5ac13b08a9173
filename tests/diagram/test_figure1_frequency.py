"""Figure 1 in frequency: transfer function, response, margins, against closed forms."""

import control
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from oracles.delay import WORKING, figure1

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.symbols import ell, ell_hat, k_ff, lam, s, tau

LATE = sp.exp(-tau * s)
DELTA = ell_hat * s + ell * lam * LATE
KAPPA = ell / ell_hat

# Each channel of theory.md section 3, by hand.
CLOSED = {
    ("measurement", "S"): ell * (lam + k_ff * s) / DELTA,
    ("measurement", "E"): (KAPPA * lam * (1 - LATE) - (1 - k_ff * KAPPA) * s)
    / (s + KAPPA * lam * LATE),
    ("measurement", "e"): (ell_hat * s - ell * k_ff * s * LATE) / DELTA,
    ("measurement", "T"): s * (lam + k_ff * s) / DELTA,
    ("aligned", "E"): -(1 - k_ff * KAPPA) * s / (s + KAPPA * lam * LATE),
    ("actuator", "E"): s * (k_ff * KAPPA * LATE - 1) / (s + KAPPA * lam * LATE),
}
SETS = [
    WORKING,
    {"lam": 7.3, "tau": 0.11, "ell": 1085.0, "ell_hat": 930.0, "k_ff": 0.0},
    {"lam": 0.4, "tau": 0.6, "ell": 0.8, "ell_hat": 1.3, "k_ff": -0.7},
]


def loop_gain(x: float, late: float = 0.08, kappa: float = 1.0):
    """The loop at κλτ = x."""
    return figure1().at(
        lam=x / (late * kappa), tau=late, ell=kappa * 700.0, ell_hat=700.0, k_ff=1.0
    )


def margins(x: float, late: float = 0.08, kappa: float = 1.0):
    return loop_gain(x, late, kappa).open("S_meas").margins()


@pytest.mark.parametrize(("placement", "target"), CLOSED)
def test_transfer_is_the_closed_form(placement, target):
    diagram = figure1(placement, error=True)
    q = sp.Symbol("q")
    difference = diagram.transfer("S_ref", target) - CLOSED[placement, target]
    assert sp.cancel(sp.together(difference.subs(LATE, q))) == 0


def test_transfer_is_written_in_lowest_terms_with_the_papers_letters():
    assert figure1().transfer("S_ref", "S") == ell * (lam + k_ff * s) / DELTA


@pytest.mark.parametrize("values", SETS)
@pytest.mark.parametrize(("placement", "target"), CLOSED)
def test_frequency_response_to_rounding(placement, target, values):
    omega = np.geomspace(1e-3, 1e3, 61)
    channel = figure1(placement, error=True).at(values)["S_ref", target]
    numbers = {p: sp.Rational(repr(v)) for p, v in zip(_symbols(), values.values(), strict=True)}
    f = sp.lambdify(s, CLOSED[placement, target].subs(numbers), "mpmath")
    with mp.workdps(50):
        exact = np.array([complex(f(mp.mpc(0, mp.mpf(repr(float(w)))))) for w in omega])
    response = channel.frequency_response(omega)
    assert isinstance(response, control.FrequencyResponseData)
    np.testing.assert_array_equal(response.omega, omega)
    # ωτ ≤ 600 is itself rounded to 6e-14. E = S − S* and e are differences of terms of order one,
    # rounded to about 1e-15 each, which 1e-2 · 1e-13 allows.
    scale = np.abs(exact) + (1e-2 if target in "Ee" else 0.0)
    for got in (response(1j * omega), channel(1j * omega), channel(1j * omega[:, None])[:, 0]):
        assert (np.abs(got - exact) / scale).max() < 1e-13


def _symbols():
    return (lam, tau, ell, ell_hat, k_ff)


@pytest.mark.parametrize("values", SETS)
def test_limits_at_frequency_zero(values):
    system = figure1(error=True).at(values)
    assert system["S_ref", "S"](0) == pytest.approx(1.0, rel=1e-13, abs=0)
    assert system["S_ref", "S"](0).imag == 0
    assert abs(system["S_ref", "E"](0)) < 1e-13
    assert abs(system["S_ref", "T"](0)) < 1e-13
    loop = system.open("S_meas")
    assert np.isinf(loop(0))
    omega = np.array([0.0, 1.0])
    both = system["S_ref", "S"].frequency_response(omega)
    assert both(0j) == pytest.approx(1.0, rel=1e-13, abs=0)
    assert np.isfinite(both(1j))


@pytest.mark.parametrize("rate", [1e-3, 1e-4, 1e-5, 1e-7])
def test_limit_at_zero_of_a_slow_loop(rate):
    """S(0) = 1 whatever λ; the pole at −λ may be nearer than any fixed circle around 0."""
    H = figure1().at(WORKING | {"lam": rate})["S_ref", "S"]
    assert abs(H(0) - 1) < 1e-13


def test_a_lightly_damped_block_is_evaluated_on_its_own_resonance():
    """T = k s/(s² + k s + 1) is exactly 1 at s = j, however close its own poles are."""
    k = sp.Symbol("k", positive=True)
    diagram = Diagram(
        [
            Sum("e = r - y"),
            Block("damper", k * s, "e -> u"),
            Block("resonance", 1 / (s**2 + 1), "u -> y"),
        ],
        outputs=["y"],
    )
    for value in (1.0, 0.1, 0.01, 1e-4):
        # s² + 1 = 0 is rounded to ε, beside which there is k alone.
        assert abs(diagram.at(k=value)["r", "y"](1j) - 1) < 1e-14 / value


@pytest.mark.parametrize("late", [0.0, 0.01, 1.0])
def test_a_resonance_in_a_delayed_loop_on_its_own_resonance(late):
    """T = G/(1 + G e^{−τs}) is e^{τs} where G = 1/(s² + ω²) is infinite."""
    w = 300
    diagram = Diagram(
        [
            Sum("e = r - w"),
            Block("resonance", 1 / (s**2 + w**2), "e -> y"),
            Block("late", sp.exp(-tau * s), "y -> w"),
        ],
        outputs=["y"],
    )
    at = np.array([1j * w, -1j * w])
    # s² + ω² = 0 is known to the rounding of ω² = 9e4, which is 1e-11 times a few operations.
    np.testing.assert_allclose(diagram.at(tau=late)["r", "y"](at), np.exp(late * at), rtol=1e-10)


@pytest.mark.parametrize("signal", ["e", "u_fb", "u", "T", "S", "S_meas"])
def test_the_loop_may_be_cut_anywhere(signal):
    values = {"lam": 3.1, "tau": 0.2, "ell": 2.0, "ell_hat": 1.6, "k_ff": 0.4}
    loop = figure1().at(values).open(signal)
    at = np.array([0.7j, 5j, 40j, 0.3 + 2j, -1.0 + 1j])
    exact = 2.0 / 1.6 * 3.1 * np.exp(-0.2 * at) / at
    np.testing.assert_allclose(loop(at), exact, rtol=1e-14)
    assert loop.margins().gain == pytest.approx(np.pi / 2 / (2 / 1.6 * 3.1 * 0.2), rel=1e-12, abs=0)


# Margins ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("x", [0.02, 0.1, 0.2055, 1 / np.e, 0.5057, 0.739, 1.0, 1.3, 1.57])
@pytest.mark.parametrize(("late", "kappa"), [(0.08, 1.0), (0.08, 0.6), (3.0, 1.7), (1e-3, 1.0)])
def test_margins_in_closed_form(x, late, kappa):
    m = margins(x, late, kappa)
    # Crossings are zeros of functions known to a few ε; only subtraction from π/2 loses more.
    assert m.gain == pytest.approx(np.pi / (2 * x), rel=2e-14, abs=0)
    assert m.phase == pytest.approx(np.pi / 2 - x, abs=1e-13)
    assert m.delay == pytest.approx((np.pi / (2 * x) - 1) * late, abs=1e-13 * late / x)
    assert m.gain_down == 0
    assert m.stable
    assert m.unstable_roots == 0
    assert len(m.gain_crossings) == 1
    assert m.gain_crossings[0] == pytest.approx((x / late, np.pi / 2 - x), rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("x", [1e-3, 1e-4, 1e-5, 1e-6, 1e-8])
def test_margins_of_a_gentle_loop(x):
    """A slow loop has margins too: its crossing lies at κλ, far below 1/τ."""
    m = margins(x)
    assert m.phase == pytest.approx(np.pi / 2 - x, abs=1e-13)
    assert m.delay == pytest.approx((np.pi / (2 * x) - 1) * 0.08, rel=1e-13, abs=0)
    assert m.stable


@pytest.mark.parametrize("rate", [0.1, 0.2])
def test_gain_margin_of_the_papers_own_gains_read_per_second(rate):
    """λ = 0.1 s⁻¹ at 80 ms: a gain margin of 196, not infinity."""
    m = figure1().at(WORKING | {"lam": rate}).open("S_meas").margins()
    assert m.gain == pytest.approx(np.pi / (2 * rate * 0.08), rel=1e-12, abs=0)


@pytest.mark.parametrize("rate", [1e-6, 1e-2, 1.0, 1e3, 1e6])
def test_margins_without_delay(rate):
    """L = λ/s: phase margin 90° at ω = λ, delay margin π/(2λ), no gain margin."""
    m = figure1().at(WORKING | {"lam": rate, "tau": 0.0}).open("S_meas").margins()
    assert m.stable
    assert m.gain == np.inf
    assert m.phase == pytest.approx(np.pi / 2, abs=1e-13)
    assert m.delay == pytest.approx(np.pi / 2 / rate, rel=1e-12, abs=0)
    assert m.peak_sensitivity == pytest.approx(1.0, abs=1e-6)  # approached as ω → ∞


def test_margins_without_any_gain_crossing():
    """L = e^{−τs}/2: |L| < 1 throughout, gain margin 2, Ms = 2 at ωτ = π (2k + 1)."""
    diagram = Diagram(
        [
            Sum("e = r - w"),
            Block("half", sp.Rational(1, 2), "e -> y"),
            Block("late", sp.exp(-s / 10), "y -> w"),
        ],
        outputs=["y"],
    )
    m = diagram.at().open("y").margins()
    assert m.stable
    assert m.gain == pytest.approx(2.0, rel=1e-13, abs=0)
    assert m.phase == np.inf
    assert m.delay == np.inf
    assert m.peak_sensitivity == pytest.approx(2.0, rel=1e-12, abs=0)


def test_margins_are_those_of_the_loop_not_of_what_follows_it():
    """An integrator behind the loop (position from velocity) leaves the margins as they are."""
    base = figure1()
    longer = Diagram([*base.parts, Block("odometer", 1 / s, "S -> way")], ["S_ref"], ["way"])
    m = longer.at(WORKING).open("S_meas").margins()
    assert m.delay == pytest.approx(np.pi / (2 * 2.5) - 0.08, rel=1e-12, abs=0)
    assert m.gain == pytest.approx(np.pi / (2 * 0.2), rel=1e-12, abs=0)


@pytest.mark.parametrize(("Ms", "x"), [(1.2, 0.2055), (1.4, 0.3727), (1.6, 0.5057), (2.0, 0.7012)])
def test_published_sensitivity_peaks(Ms, x):
    # x is given to 5e-5; dMs/dx < 3.5 up to Ms = 2
    assert margins(x).peak_sensitivity == pytest.approx(Ms, abs=2e-4)


@pytest.mark.parametrize("u", [0.3, 0.6, 0.9, 1.1, 1.3, 1.45, 1.55])
@pytest.mark.parametrize(("late", "kappa"), [(0.08, 1.0), (2.0, 0.5)])
def test_sensitivity_peak_in_closed_form(u, late, kappa):
    x = u * np.sin(u) - u**2 * np.cos(u)
    Ms = 1 / (np.cos(u) * np.sqrt(1 + u**2))
    m = margins(x, late, kappa)
    assert m.peak_sensitivity == pytest.approx(Ms, rel=2e-14 * max(1, Ms), abs=0)
    assert m.modulus == pytest.approx(1 / Ms, rel=2e-14 * max(1, Ms), abs=0)
    # An extremum is located to √ε of its width.
    assert m.peak_frequency == pytest.approx(u / late, rel=1e-7, abs=0)


@pytest.mark.parametrize("x", [0.2, 1.4, 3.0, 9.0])
def test_every_phase_crossing_is_found(x):
    late = 0.08
    m = margins(x, late)
    # L(jω) = (κλ/ω) e^{−j(ωτ + π/2)} is negative real at ωτ = π/2 + 2πk, without a gap.
    got = np.array(m.phase_crossings)
    omega = (2 * np.arange(len(got)) + 0.5) * np.pi / late
    assert x / late / (omega[-1] + 2 * np.pi / late) < 0.01, "the search went down to |L| = 0.01"
    # Their place is a zero of Im L, which is known to the rounding of ωτ.
    np.testing.assert_allclose(got[:, 0], omega, rtol=1e-13)
    np.testing.assert_allclose(got[:, 1], omega * late / x, rtol=1e-13)


@pytest.mark.parametrize(
    ("x", "roots"), [(1.5707, 0), (1.5709, 2), (3.0, 2), (7.8, 2), (7.9, 4), (20.0, 6)]
)
def test_an_unstable_loop_says_so(x, roots):
    """A pair crosses at each x = π/2 + 2πk; the count is checked with the Lambert branches."""
    branches = [complex(mp.lambertw(-x, k)).real for k in range(-20, 21)]
    assert sum(b > 0 for b in branches) == roots
    m = margins(x)
    assert m.stable == (roots == 0)
    assert m.unstable_roots == roots
    assert loop_gain(x).unstable_roots == roots
    assert m.phase == pytest.approx((np.pi / 2 - x + np.pi) % (2 * np.pi) - np.pi, abs=1e-12)


@pytest.mark.parametrize("x", [1.6, 2.5, 4.0])
def test_how_much_delay_an_unstable_loop_has_too_much(x):
    m = margins(x)
    assert m.delay == pytest.approx((np.pi / (2 * x) - 1) * 0.08, rel=1e-12, abs=0)
    assert m.gain_down == pytest.approx(np.pi / (2 * x), rel=1e-12, abs=0)


@pytest.mark.parametrize("x", [0.2, 0.7, 1.5])
def test_python_control_agrees_on_a_pade_model(x):
    """Second opinion: python-control's own margins of its own Padé model, delay 80 ms."""
    late = 0.08
    L = control.tf([x / late], [1, 0]) * control.tf(*control.pade(late, 8))
    gain, phase, _, at_gain, at_phase, _ = control.stability_margins(L)
    m = margins(x, late)
    # Padé of order 8 is right to 1e-13 at ωτ ≤ π/2; polynomial roots of degree 18 to ~1e-8.
    assert m.gain == pytest.approx(gain, rel=1e-7, abs=0)
    assert m.phase == pytest.approx(np.radians(phase), abs=1e-7)
    assert m.phase_crossings[0][0] == pytest.approx(at_gain, rel=1e-7, abs=0)
    assert m.gain_crossings[0][0] == pytest.approx(at_phase, rel=1e-7, abs=0)


def test_margins_of_a_conditionally_stable_loop():
    """L = k (s+1)²/s³ · …: unstable below k = 1/2, so gain_down = 1/(2k); delay-free."""
    k = sp.Symbol("k", positive=True)
    diagram = Diagram(
        [Sum("e = r - y"), Block("L", k * (s + 1) ** 2 / s**3, "e -> y")], outputs=["y"]
    )
    m = diagram.at(k=2.0).open("y").margins()
    # s³ + k s² + 2k s + k is Hurwitz iff 2k² > k; the crossing is at ω² = 2k = 1 for k = 1/2.
    assert m.stable
    assert m.gain_down == pytest.approx(0.25, rel=1e-10, abs=0)
    assert m.gain == np.inf
    below = diagram.at(k=0.4).open("y").margins()
    assert not below.stable
    assert below.unstable_roots == 2


@pytest.mark.parametrize("zeta", [1e-3, 1e-4, 1e-5, 1e-6])
def test_margins_see_a_needle(zeta):
    """|L| at the top of a resonance is g/(2ζ), where a sampled plot sees nothing."""
    g, wn = 1e-2, 30.0
    damping = sp.Symbol("damping", positive=True)
    L = g * wn**2 / (s**2 + damping * s + wn**2)
    diagram = Diagram([Sum("e = r - y"), Block("needle", L, "e -> y")], outputs=["y"])
    m = diagram.at(damping=2 * zeta * wn).open("y").margins()
    # |L| = 1: (1 − v²)² + (2ζv)² = g², v = ω/ωn
    b = 1 - 2 * zeta**2
    v2 = np.array([b - np.sqrt(b**2 - 1 + g**2), b + np.sqrt(b**2 - 1 + g**2)])
    # The needle's edges lie g/2 from ωn and |L|² there is known to ε/g.
    np.testing.assert_allclose([w for w, _ in m.gain_crossings], wn * np.sqrt(v2), rtol=1e-12)
    assert m.stable
