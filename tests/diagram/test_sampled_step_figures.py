"""Figures of sampled step responses: geometric series, and plain recursions of the same loops."""

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
from vsctrl.errors import InputError, LimitError
from vsctrl.symbols import s

T = 0.04


def twin(x, late=0):
    """Figure 1 with κλT = x and a measurement `late` periods old: y⁺ = y + x (r − y[k − late])."""
    loop = figure1().at(lam=x / T, tau=late * T, ell=1, ell_hat=1, k_ff=0)
    return loop.sampled(T)["S_ref", "S"]


def recursion(x, late, n=4000):
    y = np.zeros(n + 1)
    for k in range(n):
        y[k + 1] = y[k] + x * (1.0 - (y[k - late] if k >= late else 0.0))
    return y[:n]


@pytest.mark.parametrize("x", [0.1, 0.5, 1.0])
def test_a_geometric_series(x):
    """y = 1 − qᵏ, q = 1 − x: above 1 − p at k ≥ ln p/ln q; T Σ e = T/x, T Σ e² = T/(1 − q²)."""
    q, info = 1 - x, twin(x).step_info()
    # A sample at the level itself has reached it.
    first = lambda p: math.ceil(math.log(p) / math.log(q) - 1e-9) if q else 1  # noqa: E731
    assert info.rise_time == pytest.approx(T * (first(0.1) - first(0.9)), abs=1e-12)
    assert info.settling_time == pytest.approx(T * first(0.02), abs=1e-12)
    assert info.final == pytest.approx(1, rel=1e-14) and info.overshoot == info.undershoot == 0
    assert info.dead_time == info.period == T
    assert info.peak_time == (math.inf if q else T)
    e = twin(x).integral_errors()
    assert e.iae == e.ie == pytest.approx(T / x, rel=1e-13)
    assert e.ise == pytest.approx(T / (1 - q * q), rel=1e-13)
    assert e.itae == pytest.approx(T * T * q / x**2, rel=1e-12, abs=1e-15)  # Σ k qᵏ = q/(1 − q)²
    assert "at the samples" in str(info) and "at the samples" in str(e)


def test_a_swing_from_sample_to_sample():
    """q = −1/2: y = 1 − (−1/2)ᵏ, first 3/2; Σ |e| = 1/(1 − |q|) = 2, Σ e = 1/(1 − q) = 2/3."""
    info, e = twin(1.5).step_info(), twin(1.5).integral_errors()
    assert (info.overshoot, info.peak, info.peak_time) == pytest.approx((0.5, 1.5, T), rel=1e-13)
    assert info.settling_time == pytest.approx(6 * T)
    assert (e.iae, e.ie) == pytest.approx((2 * T, 2 / 3 * T), rel=1e-13)


cases = st.tuples(st.integers(0, 6), st.integers(5, 95).map(lambda k: k / 100))


@settings(max_examples=effort.share(60))
@given(cases)
def test_late_measurements_against_the_recursion(case):
    """At a share of the limit 2 sin(π/(2(2d + 1)))."""
    late, share = case
    x = share * 2 * math.sin(math.pi / (2 * (2 * late + 1)))
    y, H = recursion(x, late), twin(x, late)
    info, e = H.step_info(settling=0.05), H.integral_errors()
    outside = np.flatnonzero(np.abs(y - 1) > 0.05 + 1e-9)
    assert info.settling_time == pytest.approx(T * (outside[-1] + 1))
    assert info.rise_time == pytest.approx(
        T * ((y > 0.9 - 1e-9).argmax() - (y > 0.1 - 1e-9).argmax())
    )
    assert info.overshoot == pytest.approx(max(y.max() - 1, 0), abs=2e-11)
    error = 1 - y
    k = np.arange(len(y))
    assert e.iae == pytest.approx(T * np.abs(error).sum(), rel=1e-9)
    assert e.ise == pytest.approx(T * (error**2).sum(), rel=1e-9)
    assert e.itae == pytest.approx(T * T * (k * np.abs(error)).sum(), rel=1e-8)


def held_pi(K=0.8, Ti=2.0, period=0.25):
    """A PI controller in the computer, Tustin, round e^{−s/2}/(2s + 1); d enters before it."""
    parts = [
        vs.Sum("e = r - y"),
        vs.Block("PI", sp.nsimplify(K) * (1 + 1 / (sp.nsimplify(Ti) * s)), "e -> u"),
        vs.Sum("v = u + d"),
        vs.Block("process", sp.exp(-s / 2) / (2 * s + 1), "v -> y"),
    ]
    system = vs.Diagram(parts, inputs=["r", "d"], outputs=["y"]).at()
    return system.sampled(period, hold="u", digital={"PI": "tustin"})


@pytest.mark.parametrize("source", ["r", "d"])
def test_python_control_runs_the_state_space_to_the_same_figures(source):
    H = held_pi()[source, "y"]
    t, y = control.step_response(H.state_space(), T=np.arange(0, 100, 0.25), squeeze=True)
    info, e = H.step_info(), H.integral_errors()
    final = 1.0 if source == "r" else 0.0
    assert info.final == pytest.approx(final, abs=1e-13)
    assert info.peak == pytest.approx(y[np.abs(y).argmax()], rel=1e-10)
    band = 0.02 * (final or np.abs(y).max())
    assert info.settling_time == t[np.flatnonzero(np.abs(y - final) > band)[-1] + 1]
    assert info.dead_time == t[np.abs(y) > 1e-14].min()
    assert e.against == ("input" if source == "r" else "zero")
    assert e.iae == pytest.approx(0.25 * np.abs(final - y).sum(), rel=1e-9)
    if source == "d":
        # Of an integral action the load leaves IE = −T_I/K, sampled as well.
        assert e.ie == pytest.approx(-2.0 / 0.8, rel=1e-9)
        assert info.overshoot is None and "ends at 0" in info.sentence


def test_the_continuous_figures_follow_as_the_period_goes_to_zero():
    loop = figure1().at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=0)
    fine, exact = loop.sampled(0.001)["S_ref", "S"], loop["S_ref", "S"]
    for name in ("rise_time", "settling_time", "final"):
        found, limit = (getattr(H.step_info(), name) for H in (fine, exact))
        assert found == pytest.approx(limit, abs=3e-3)
    assert fine.integral_errors().ise == pytest.approx(exact.integral_errors().ise, rel=5e-3)


def test_nothing_settles_in_what_is_not_stable():
    for H, said, final in (
        (twin(2.5), "outside the unit circle", None),
        (twin(2.0), "on the unit circle", None),
    ):
        info = H.step_info()
        assert not info.stable and info.settling_time == math.inf and info.final == final
        assert said in info.sentence and H.integral_errors().iae == math.inf
    integral = vs.Diagram([vs.Block("i", -3 / s, "u -> y")], inputs=["u"]).at().sampled(1, "u")
    assert integral["u", "y"].step_info().final == -math.inf


def test_an_error_that_stays_or_a_signal_that_grows_has_no_finite_sum():
    H = twin(0.5)
    ramp = H.integral_errors(vs.Ramp())
    assert (ramp.iae, ramp.ie) == (math.inf, math.inf) and "still 0.08" in ramp.sentence
    sine = H.integral_errors(vs.Sine(3.0))
    assert (sine.iae, sine.ie) == (math.inf, None)
    assert "grows" in H.integral_errors(vs.Exponential(0.5)).sentence
    fading = H.integral_errors(vs.Exponential(-0.5), "zero")
    assert fading.ie == pytest.approx(-T / (1 - math.exp(-0.5 * T)), rel=1e-12)


def test_what_hides_within_the_loop_keeps_nothing_from_settling():
    """A moving average has a root at 0 in s that no signal shows."""
    mean = (1 - sp.exp(-s / 2)) / (s / 2)
    parts = [vs.Sum("e = r - m"), vs.Block("plant", 1 / (2 * s), "e -> y")]
    parts.append(vs.Block("mean", mean, "y -> m"))
    system = vs.Diagram(parts, inputs=["r"], outputs=["y"]).at()
    info = system.sampled(0.25, hold="e")["r", "y"].step_info()
    y = system.sampled(0.25, hold="e")["r", "y"].response(np.ones(400)).outputs
    assert info.final == pytest.approx(1.0, rel=1e-9)
    assert info.peak == pytest.approx(y.max(), rel=1e-9)


def test_what_cannot_be_asked_is_refused_in_a_sentence():
    H = twin(0.5)
    with pytest.raises(InputError, match="step_info: settling"):
        H.step_info(settling=2)
    with pytest.raises(InputError, match="did you mean 'zero'"):
        H.integral_errors(against="zer")
    with pytest.raises(LimitError, match="samples until it is at rest"):
        twin(1e-6).step_info()


def test_many_samples_are_those_of_the_equation_one_by_one(monkeypatch):
    """Blocks of 128 samples, and the equation itself."""
    equation = held_pi()["d", "u"].difference_equation
    u = np.random.default_rng(1).standard_normal((2500, 1))
    quick = equation.run(u)
    monkeypatch.setattr("vsctrl.diagram.sampled.difference_equation.MANY", 10**9)
    np.testing.assert_allclose(quick, equation.run(u), atol=1e-13)
