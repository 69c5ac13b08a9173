"""Figure 1 in time: exact-delay responses against the series summed with 120 digits."""

import math

import control
import numpy as np
import pytest
from oracles.delay import WORKING, figure1, figure1_response

from vsctrl.diagram import Parabola, Ramp, Sine, Step
from vsctrl.diagram.time import collocation

LATE = 0.08
ROUNDING = 1e-13  # a few hundred operations of order one, each rounded to 1.1e-16
SIGNALS = {
    "step": Step(1.0),
    "ramp": Ramp(1.0),
    "parabola": Parabola(1.0),
    "sine": Sine(3.0, 1.0),
}
# BreakingPoints, just beside them, within the first pieces, and far out.
TIMES = np.array([0, 0.013, 0.0799999, 0.08, 0.0800001, 0.16, 0.21, 0.24, 1, 3.3, 7.28, 10.0])


def channel(x, late=LATE, k_ff=0.0, target="S", **more):
    rate = x / late
    values = WORKING | {"lam": rate, "tau": late, "k_ff": k_ff} | more
    return figure1(error=True).at(values)["S_ref", target]


def exact(kind, times, x, late=LATE, k_ff=0.0, omega=3.0):
    return np.array([figure1_response(kind, t, x / late, late, k_ff, omega) for t in times])


def pieces(H, signal, horizon):
    return len(collocation.solve(H.realisation, signal, horizon).ends) - 1


@pytest.mark.parametrize("x", [0.05, 0.1, 0.2, 1 / math.e, 0.7012, 1.0, 1.3, 1.5])
@pytest.mark.parametrize("kind", SIGNALS)
def test_response_to_rounding_over_ten_seconds(kind, x):
    times = TIMES[::3] if kind == "sine" else TIMES  # its series is the slow one to sum
    y = channel(x).response(SIGNALS[kind], times).outputs
    # Relative to the largest value, which is 50 for the parabola.
    reference = exact(kind, times, x)
    assert np.abs(y - reference).max() < ROUNDING * max(1.0, np.abs(reference).max())


@pytest.mark.parametrize("k_ff", [1.0, 0.92, -0.5])
@pytest.mark.parametrize("kind", SIGNALS)
def test_feed_forward(kind, k_ff):
    x = 0.2
    times = TIMES[1::3] if kind == "sine" else TIMES
    y = channel(x, k_ff=k_ff).response(SIGNALS[kind], times).outputs
    reference = exact(kind, times, x, k_ff=k_ff)
    assert np.abs(y - reference).max() < ROUNDING * max(1.0, np.abs(reference).max())


def test_a_step_with_feed_forward_jumps_at_once_and_echoes_later():
    """k_ff s makes an impulse in T, so S jumps by k_ff at 0; right limits are reported."""
    H = channel(0.2, k_ff=0.7)
    y = H.response(Step(2.0), [0.0, LATE]).outputs
    assert y[0] == pytest.approx(1.4, abs=ROUNDING)
    assert y[1] == pytest.approx(2 * (0.7 + 0.2), abs=ROUNDING)
    e = channel(0.2, k_ff=0.7, target="e").response(Step(1.0), [0.0, 0.05, LATE, 0.1]).outputs
    assert e[:3] == pytest.approx([1.0, 1.0, 1 - 0.7], abs=ROUNDING)


def test_the_right_limit_is_also_reported_at_the_last_time():
    """What is asked for at t = τ does not depend on whether a later time is asked for too."""
    H = channel(0.2, k_ff=0.7, target="e")
    assert H.response(Step(), [LATE]).outputs[0] == pytest.approx(1 - 0.7, abs=ROUNDING)


@pytest.mark.parametrize("kappa", [0.6, 1.7])
def test_miscalibration_scales_rate_and_feed_forward(kappa):
    x, k_ff = 0.3, 1.0
    H = channel(x, k_ff=k_ff, ell=700 * kappa, ell_hat=700.0)
    y = H.response(Ramp(1.0), TIMES).outputs
    reference = exact("ramp", TIMES, kappa * x, k_ff=k_ff * kappa)
    assert np.abs(y - reference).max() < 1e-12


@pytest.mark.parametrize("late", [1e-4, 1e-3])
@pytest.mark.parametrize("kind", ["step", "sine"])
def test_a_tiny_delay_over_a_long_time(kind, late):
    """10 s hold 1e5 delays of 0.1 ms."""
    times = np.array([late / 2, late, 2.5 * late, 0.1, 0.7, 4.0])
    x = 2.5 * late
    H = channel(x, late)
    y = H.response(SIGNALS[kind], [*times, 10.0]).outputs[:-1]
    np.testing.assert_allclose(y, exact(kind, times, x, late), rtol=0, atol=ROUNDING)
    assert pieces(H, SIGNALS[kind], 10.0) < 100


@pytest.mark.parametrize("late", [10.0, 12.0, 1e6])
def test_a_delay_beyond_the_horizon(late):
    times = np.linspace(0, 10, 11)
    H = figure1().at(WORKING | {"lam": 0.3, "tau": late, "k_ff": 0.5})["S_ref", "S"]
    np.testing.assert_allclose(
        H.response(Step(), times).outputs, 0.5 + 0.3 * times, rtol=1e-14, atol=0
    )


@pytest.mark.parametrize("x", [0.05, 0.2, 0.5, 1.0, 1.5])
@pytest.mark.parametrize("kind", SIGNALS)
def test_kinks_do_not_proliferate(kind, x):
    assert pieces(channel(x, k_ff=1.0), SIGNALS[kind], 10.0) < 100


def test_no_delay_is_a_first_order_lag():
    times = np.linspace(0, 4, 9)
    H = figure1().at(WORKING | {"tau": 0.0, "k_ff": 0.0})["S_ref", "S"]
    for signal, closed in (
        (Step(), 1 - np.exp(-2.5 * times)),
        (Ramp(), times - (1 - np.exp(-2.5 * times)) / 2.5),
    ):
        np.testing.assert_allclose(H.response(signal, times).outputs, closed, atol=ROUNDING, rtol=0)
    # And python-control's own simulation of the same lag (matrix exponential, held input).
    other = control.forced_response(control.tf([2.5], [1, 2.5]), times, np.ones_like(times))
    mine = H.response(Step(), times)
    np.testing.assert_allclose(mine.outputs, other.outputs, atol=1e-12)


@pytest.mark.parametrize("x", [1.6, 1.8, 2.5])
def test_growth_beyond_the_limit(x):
    times = np.linspace(0.5, 10, 20)
    y = channel(x).response(Step(), times).outputs
    reference = exact("step", times, x)
    # Relative to the envelope; the growth rate σ t is amplified by rounding of λ and τ: σt·ε.
    envelope = np.maximum.accumulate(np.abs(reference))
    assert (np.abs(y - reference) / envelope).max() < 1e-12
    assert np.abs(reference).max() > 3.0


@pytest.mark.parametrize("x", [1.0, 1.1, 1.25, 1.5])
def test_overshoot_is_x_minus_one_half(x):
    """S' = 0 where S(t − τ) = 1, first at t = τ + 1/λ ≤ 2τ; there S = x + 1/2."""
    H = channel(x)
    top = LATE * (1 + 1 / x)
    assert H.response(Step(), [top]).outputs[0] == pytest.approx(x + 0.5, abs=ROUNDING)
    assert H.response(Step(), np.linspace(0, 10, 4001)).outputs.max() <= x + 0.5 + ROUNDING


@pytest.mark.parametrize("x", [0.05, 0.2, 0.36, 1 / math.e])
def test_no_overshoot_up_to_one_over_e(x):
    y = channel(x).response(Step(), np.linspace(0, 20, 4001)).outputs
    assert y.max() <= 1 + ROUNDING
    assert np.diff(y).min() > -ROUNDING


def test_overshoot_begins_beyond_one_over_e():
    """Poles at ±jω then: the error changes sign within a half turn."""
    assert channel(0.45).response(Step(), np.linspace(0, 5, 2001)).outputs.max() > 1 + 1e-5


@pytest.mark.parametrize("x", [0.2, 0.739085, 1.2])
def test_integral_of_squared_step_error(x):
    """∫(S − S*)² = τ cos x/(2x(1 − sin x)) − τ, by Gauss quadrature between the kinks."""
    H = channel(x, target="E")
    # Let the slowest mode fall below 1e-8 in amplitude, 1e-16 in square.
    horizon = LATE * {0.2: 90, 0.739085: 60, 1.2: 90}[x]
    cells = round(horizon / LATE)
    node, weight = np.polynomial.legendre.leggauss(12)
    times = LATE * (np.arange(cells)[:, None] + (node + 1) / 2)
    square = H.response(Step(), times.ravel()).outputs.reshape(times.shape) ** 2
    integral = (square @ weight).sum() * LATE / 2
    closed = LATE * (math.cos(x) / (2 * x * (1 - math.sin(x))) - 1)
    assert integral == pytest.approx(closed, rel=1e-12, abs=0)


@pytest.mark.parametrize("placement", ["measurement", "aligned", "actuator"])
@pytest.mark.parametrize(("kappa", "k_ff"), [(1.0, 1.0), (1.0, 0.0), (0.8, 1.0), (1.2, 0.5)])
def test_steady_error_on_a_ramp(placement, kappa, k_ff):
    rate, v = 2.5, 0.04
    values = {"lam": rate, "tau": LATE, "ell": kappa, "ell_hat": 1.0, "k_ff": k_ff}
    E = figure1(placement, error=True).at(values)["S_ref", "E"]
    gap = -(1 - k_ff * kappa) / (kappa * rate)
    steady = v * (gap + (LATE if placement == "measurement" else 0.0))
    # The slowest mode decays faster than e^{−κλt}: 1e-20 after 25 s. E = S − S*, both v t = 1.
    assert E.response(Ramp(v), [25.0]).outputs[0] == pytest.approx(steady, abs=ROUNDING)


def test_the_measured_error_hides_what_the_latency_does():
    """With k_ff = 1 the camera leads by vτ while the error it measures is zero."""
    system = figure1(error=True).at(WORKING)
    assert system["S_ref", "e"].response(Ramp(0.04), [25.0]).outputs[0] == pytest.approx(
        0.0, abs=ROUNDING
    )
    assert system["S_ref", "E"].response(Ramp(0.04), [25.0]).outputs[0] == pytest.approx(
        0.04 * LATE, abs=ROUNDING
    )


@pytest.mark.parametrize("placement", ["measurement", "aligned", "actuator"])
def test_steady_sine_is_the_frequency_response(placement):
    omega, amplitude = 4.0, 0.3
    H = figure1(placement, error=True).at(WORKING | {"k_ff": 0.6})["S_ref", "E"]
    times = np.linspace(25, 26, 7)
    steady = amplitude * np.imag(H(1j * omega) * np.exp(1j * omega * times))
    y = H.response(Sine(omega, amplitude), times).outputs
    np.testing.assert_allclose(y, steady, atol=ROUNDING)


def test_responses_scale_and_do_not_depend_on_the_times_asked():
    H = channel(0.9, k_ff=0.3)
    once = H.response(Step(1.0), [0.37, 2.0]).outputs
    dense = H.response(Step(1.0), np.r_[np.linspace(0, 2, 333), 0.37]).outputs
    assert once[0] == pytest.approx(dense[-1], abs=ROUNDING)
    np.testing.assert_allclose(H.response(Step(-250.0), [0.37, 2.0]).outputs, -250 * once)
    shuffled = H.response(Step(1.0), [2.0, 0.37, 2.0]).outputs
    np.testing.assert_allclose(shuffled, [once[1], once[0], once[1]], atol=ROUNDING)
    assert H.response(Step(1.0), [0.0]).outputs[0] == pytest.approx(0.3, abs=ROUNDING)


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3, 1e6, 1e9])
def test_units_of_signals_do_not_matter(size):
    """ℓ and ℓ̂ in any unit: only their ratio counts, to rounding."""
    times = np.array([0.05, 0.5, 2.0, 8.0])
    y = channel(0.9, ell=size, ell_hat=size).response(Step(), times).outputs
    np.testing.assert_allclose(y, exact("step", times, 0.9), atol=ROUNDING)


@pytest.mark.parametrize("rate", [1e-9, 1e-6, 1e-3])
def test_a_small_gain_keeps_its_digits(rate):
    """S = λ t until the first echo, whatever the size of λ."""
    H = figure1().at(WORKING | {"lam": rate, "tau": 5.0, "k_ff": 0.0})["S_ref", "S"]
    y = H.response(Step(), [1.0, 4.0]).outputs
    np.testing.assert_allclose(y, [rate, 4 * rate], rtol=ROUNDING)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_units_of_time_do_not_matter(scale):
    """The same loop in other units of time: y(t; λ, τ) = y(ct; λ/c, cτ)."""
    times = np.array([0.05, 0.5, 2.0, 8.0])
    first = channel(0.9).response(Step(), times).outputs
    other = channel(0.9, LATE * scale).response(Step(), times * scale).outputs
    np.testing.assert_allclose(other, first, atol=1e-12)
