"""Figures of a step response and integrals of the error: closed forms, and dense grids."""

import math

import effort
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.delay import figure1
from scipy.special import lambertw

import vsctrl as vs
from vsctrl.errors import InputError, LimitError
from vsctrl.symbols import s

R = sp.Rational


def channel(transfer):
    """One block."""
    parts = [vs.Block("block", transfer, "u -> y")]
    return vs.Diagram(parts, inputs=["u"], outputs=["y"]).at()["u", "y"]


K, Ti, T, late = sp.symbols("K Ti T late", positive=True)
PI_LOOP = vs.Diagram(
    [
        vs.Sum("e = r - y"),
        vs.Block("PI", K * (1 + 1 / (Ti * s)), "e -> u"),
        vs.Sum("v = u + d"),
        vs.Block("process", sp.exp(-late * s) / (T * s + 1), "v -> y"),
    ],
    inputs=["r", "d"],
    outputs=["y"],
)


def pi_loop(K=2.5, Ti=5.0, T=5.0, late=1.0):
    """A first-order process with dead time under PI control; d enters before the process."""
    return PI_LOOP.at(K=K, Ti=Ti, T=T, late=late)


# Step figures ------------------------------------------------------------------------------
@pytest.mark.parametrize(("K", "T", "late"), [(3, 5, 2), (R(-1, 2), R(1, 100), 7), (1, 900, 0)])
def test_first_order_with_dead_time(K, T, late):
    """y = K (1 − e^{−(t−θ)/T}): t₉₀ − t₁₀ = T ln 9, settled at θ + T ln 50."""
    info = channel(K * sp.exp(-late * s) / (T * s + 1)).step_info()
    T, late = float(T), float(late)
    assert info.final == pytest.approx(float(K), rel=1e-14)
    assert info.rise_time == pytest.approx(T * math.log(9), rel=1e-11)
    assert info.settling_time == pytest.approx(late + T * math.log(50), rel=1e-11)
    assert info.dead_time == late
    assert (info.overshoot, info.undershoot) == (0.0, 0.0)
    assert (info.peak, info.peak_time) == (info.final, math.inf)


@pytest.mark.parametrize("zeta", ["0.1", "0.3", "0.7"])
def test_second_order_overshoot_and_peak_time(zeta):
    """exp(−πζ/√(1−ζ²)) at π/√(1−ζ²)."""
    z = float(zeta)
    info = channel(-4 / (s**2 + 2 * R(zeta) * s + 1)).step_info()
    root = math.sqrt(1 - z**2)
    assert info.overshoot == pytest.approx(math.exp(-math.pi * z / root), rel=1e-11)
    assert info.peak_time == pytest.approx(math.pi / root, rel=1e-6)
    assert info.peak == pytest.approx(-4 * (1 + info.overshoot), rel=1e-13)
    # The envelope bounds the last crossing; the crossing itself is on the band to rounding.
    y = channel(-4 / (s**2 + 2 * R(zeta) * s + 1)).response(vs.Step(), [info.settling_time])
    assert abs(abs(y.outputs[0] / -4 - 1) - 0.02) < 1e-12


@pytest.mark.parametrize("x", [1.0, 1.2, 1.5])
def test_overshoot_of_figure_1_is_x_less_a_half(x):
    """Exactly x − 1/2 for 1 ≤ x ≤ 3/2, x = κλτ."""
    loop = figure1().at(lam=x / 0.08, tau=0.08, ell=1, ell_hat=1, k_ff=0)
    info = loop["S_ref", "S"].step_info()
    assert info.overshoot == pytest.approx(x - 0.5, rel=1e-12)
    assert info.final == 1.0


def test_a_zero_on_the_right_goes_the_wrong_way_first():
    """(1 − s)/(s + 1)²: y = 1 − e^{−t} − 2t e^{−t}, least where e^{−t}(2t − 1) = 0: t = 1/2."""
    info = channel((1 - s) / (s + 1) ** 2).step_info()
    assert info.undershoot == pytest.approx(2 * math.exp(-0.5) - 1, rel=1e-12)
    assert info.overshoot == 0.0


def test_slow_and_fast_modes_together_far_beyond_what_can_be_stepped():
    """Time constants 10⁵ s twice and 1 ms: y = 1 − (1 + t/T) e^{−t/T} to 1e-8."""
    fast = channel(sp.exp(-3 * s) / ((100000 * s + 1) ** 2 * (s / 1000 + 1)))
    info = fast.step_info()
    times = [float(-lambertw(-(1 - y) / math.e, -1).real - 1) for y in (0.1, 0.9, 0.98)]
    assert info.rise_time == pytest.approx(1e5 * (times[1] - times[0]), rel=1e-9)
    assert info.settling_time == pytest.approx(3.001 + 1e5 * times[2], rel=1e-9)
    assert fast.integral_errors().iae == pytest.approx(2e5 + 3.001, rel=1e-12)


def test_what_ends_at_0_has_a_peak_but_no_overshoot():
    """s/(s + 1)²: t e^{−t}, 1/e at 1 s; below 2 % of that from −W₋₁(−0.02/e) on."""
    info = channel(s / (s + 1) ** 2).step_info()
    assert (info.final, info.overshoot, info.rise_time) == (0.0, None, None)
    assert info.peak == pytest.approx(1 / math.e, rel=1e-13)
    assert info.peak_time == pytest.approx(1.0, rel=1e-7)
    last = float(-lambertw(-0.02 / math.e, -1).real)
    assert info.settling_time == pytest.approx(last, rel=1e-10)
    assert "ends at 0" in info.sentence


def test_what_is_done_after_a_time_reaches_its_peak_then():
    info = channel((1 - sp.exp(-s)) / s).step_info()
    assert (info.peak, info.settling_time) == pytest.approx((1.0, 0.98), rel=1e-12)
    assert info.peak_time == pytest.approx(1.0, rel=1e-6)
    jump = channel(2 * sp.exp(-3 * s)).step_info()
    assert (jump.rise_time, jump.settling_time, jump.dead_time) == (0.0, 3.0, 3.0)


@pytest.mark.parametrize(
    ("transfer", "final", "said"),
    [
        (1 / s, math.inf, "pole 0 rad/s is on the axis"),
        (-2 * sp.exp(-s) / s**2, -math.inf, "pole 0 rad/s"),
        (1 / (s - 1), None, "right of the axis"),
        (1 / (s**2 + 4), None, "2j rad/s is on"),
        (1 / (1 - sp.exp(-s) * R(3, 2)), None, "right of the axis"),
    ],
)
def test_nothing_settles_in_what_is_not_stable(transfer, final, said):
    H = channel(transfer)
    info = H.step_info()
    assert not info.stable and info.settling_time == math.inf
    assert (info.final, info.overshoot, info.peak) == (final, None, None)
    assert said in info.sentence
    assert H.integral_errors().iae == math.inf and H.total_variation() == math.inf


def test_what_cannot_be_asked_is_refused_in_a_sentence():
    H = channel(1 / (s + 1))
    with pytest.raises(InputError, match=r"improper|derivative|differentiat"):
        channel(s).step_info()
    for bad in (0, 1, -1, "a", None, math.nan):
        with pytest.raises(InputError, match="step_info: settling"):
            H.step_info(settling=bad)
    for bad in (0.1, (0.9, 0.1), (0.1, 1.0), "ab", (0.1, 0.5, 0.9)):
        with pytest.raises(InputError, match="step_info: rise"):
            H.step_info(rise=bad)
    with pytest.raises(InputError, match="did you mean 'zero'"):
        H.integral_errors(against="zer")
    with pytest.raises(LimitError, match="swings"):
        channel(sp.exp(-s) / (s**2 + R(1, 10**7) * s + 1)).step_info()


tenths = st.integers(2, 30).map(lambda k: k / 10)


@settings(max_examples=effort.share(24))
@given(tenths, tenths, tenths, st.integers(1, 9).map(lambda k: k / 10))
def test_a_dense_grid_sees_what_the_pieces_say(T, late, Ti, share):
    """A PI loop at a share of its gain limit; a step that ends at 1, a load that ends at 0."""
    limit = pi_loop(0.01, Ti, T, late).open("y").margins().gain
    loop = pi_loop(limit * share / 100, Ti, T, late)
    for source in "rd":
        H = loop[source, "y"]
        info = H.step_info(settling=0.05)
        end = 2 * info.settling_time + 5 * late
        t = np.linspace(0, end, 5001)
        y = np.asarray(H.response(vs.Step(), t).outputs)
        step, slope = float(t[1]), float(2 * np.abs(np.gradient(y, t)).max())
        peak = max(1.0, y.max()) if source == "r" else y[np.abs(y).argmax()]
        assert info.peak == pytest.approx(peak, abs=step * slope)
        size = 1.0 if source == "r" else abs(info.peak)
        out = np.abs(y - info.final) > 0.05 * size
        assert info.settling_time == pytest.approx(t[out].max(initial=0.0), abs=1.01 * step)
        assert info.dead_time == late
        if source == "r":
            first = [t[(y >= level).argmax()] for level in (0.1, 0.9)]
            assert info.rise_time == pytest.approx(first[1] - first[0], abs=2.02 * step)


# Integrals ---------------------------------------------------------------------------------
def test_the_integral_of_the_error_of_a_pi_loop():
    """Of a load step IE = −T_I/K; of a set-point step T_I/K too, as the process needs u = 1."""
    loop = pi_loop()
    assert loop["d", "y"].integral_errors().ie == pytest.approx(-2.0, rel=1e-12)
    assert loop["r", "y"].integral_errors().ie == pytest.approx(2.0, rel=1e-12)
    as_error = loop["r", "e"].integral_errors()
    as_channel = loop["r", "y"].integral_errors()
    assert (as_error.against, as_channel.against) == ("zero", "input")
    assert as_error.ie == pytest.approx(-as_channel.ie, rel=1e-12)
    for name in ("iae", "ise", "itae"):
        assert getattr(as_error, name) == pytest.approx(getattr(as_channel, name), rel=1e-11)


@pytest.mark.parametrize("x", [0.2, 0.739, 1.3])
def test_the_square_error_of_figure_1_in_closed_form(x):
    """∫e² = τ cos x/(2x(1 − sin x)), the delay of the output included."""
    loop = figure1().at(lam=x / 0.08, tau=0.08, ell=1, ell_hat=1, k_ff=0)
    e = loop["S_ref", "S_meas"].integral_errors()
    ise = 0.08 * math.cos(x) / (2 * x * (1 - math.sin(x)))
    assert e.ise == pytest.approx(ise, rel=1e-11)


def test_the_error_is_split_where_it_changes_sign():
    """∫|e^{−at} sin t| dt = (1 + q)/(1 − q)/(1 + a²), q = e^{−aπ}."""
    a = R(1, 5)
    e = channel(1 / ((s + a) ** 2 + 1) * s).integral_errors()  # y = e^{−at} sin t
    q = math.exp(-math.pi / 5)
    assert e.iae == pytest.approx((1 + q) / (1 - q) / (1 + 0.04), rel=1e-12)
    assert e.ie == pytest.approx(-1 / 1.04, rel=1e-12)
    assert e.ise == pytest.approx(1 / (4 * 0.2 * 1.04), rel=1e-12)


def test_the_integrals_weighted_with_time():
    """y = t e^{−t}: ∫t|y| = 2, ∫y = 1, ∫y² = 1/4; late by 3 s, ∫t|y| = 2 + 3."""
    e = channel(sp.exp(-3 * s) * s / (s + 1) ** 2).integral_errors()
    assert (e.itae, e.iae, e.ise) == pytest.approx((5.0, 1.0, 0.25), rel=1e-12)


def test_an_error_that_stays_has_no_finite_integral_and_a_sentence():
    e = channel(3 / (s + 1)).integral_errors()
    assert (e.iae, e.ie) == (math.inf, -math.inf) and "still -2" in e.sentence
    sine = channel(1 / (s + 1)).integral_errors(vs.Sine(3.0))
    assert (sine.iae, sine.ie) == (math.inf, None)
    slow = channel(1 / (s + 1)).integral_errors(vs.Sine(0.001))
    assert (slow.iae, slow.ie) == (math.inf, None)
    ramp = channel(1 / (s + 1)).integral_errors(vs.Ramp())
    assert ramp.ie == math.inf
    two = channel((2 * s + 1) / (s**2 + 2 * s + 1)).integral_errors(vs.Ramp())
    assert two.ie == pytest.approx(1.0, rel=1e-9)  # E = s²/(s + 1)²/s², e = t e^{−t}


def test_signals_that_die_out_themselves():
    """e^{−t/50} into 1/(s + 1), against 0: ∫y = 50."""
    H = channel(1 / (s + 1))
    assert H.integral_errors(vs.Exponential(-0.02), "zero").ie == pytest.approx(-50, rel=1e-12)
    assert H.integral_errors(vs.Pulse(2.0), "zero").iae == pytest.approx(2.0, rel=1e-12)


def test_the_total_variation_of_a_damped_oscillation_and_of_jumps():
    """Extrema 1 + (−1)ᵏ⁺¹ qᵏ make Σ|Δy| = (1 + q)/(1 − q); a lead jumps by 5 and falls by 4."""
    q = math.exp(-math.pi * 0.3 / math.sqrt(0.91))
    H = channel(1 / (s**2 + R(6, 10) * s + 1))
    assert H.total_variation() == pytest.approx((1 + q) / (1 - q), rel=1e-12)
    lead = channel((5 * s + 1) / (s + 1))
    assert lead.total_variation() == pytest.approx(9.0, rel=1e-12)
    assert lead.total_variation(vs.Sine(1.0)) == math.inf
    assert lead.total_variation(vs.Pulse(3.0)) == pytest.approx(
        2 * (5 + 4 * (1 - math.exp(-3))), rel=1e-12
    )
