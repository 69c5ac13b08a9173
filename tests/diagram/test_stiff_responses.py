"""Responses of high order, of wide time constants, of long times and of growth without end."""

import math

import control
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from sympy import exp

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.diagram.channel import Channel
from vsctrl.diagram.signals.elementary import Sine, Step
from vsctrl.errors import InputError, LimitError
from vsctrl.symbols import s


def alone(gain) -> Channel:
    return Diagram([Block("P", gain, "u -> y")], inputs=["u"], outputs=["y"]).at()["u", "y"]


def looped(gain):
    return Diagram([Sum("e = r - y"), Block("L", gain, "e -> y")], inputs=["r"], outputs=["y"]).at()


def answer(channel: Channel, t, signal=None):
    return channel.response(signal or Step(), t).outputs


def lags(rates, t):
    """The step response of ∏ 1/(1 + s/rate), rates all different, by partial fractions."""
    with mp.workdps(60):
        p = [mp.mpf(rate) for rate in rates]
        residues = [mp.fprod(q / (q - a) for q in p if q != a) for a in p]
        return [
            float(1 - mp.fsum(c * mp.exp(-a * at) for c, a in zip(residues, p, strict=True)))
            for at in t
        ]


@pytest.mark.parametrize("decades", [4, 8, 9, 11])
def test_one_block_may_hold_lags_of_many_decades(decades):
    rates = [10**k for k in range(decades)]
    t = [1e-3, 1.0, 5.0, 50.0]
    y = answer(alone(1 / sp.prod([1 + s / rate for rate in rates])), t)
    np.testing.assert_allclose(y, lags(rates, t), rtol=0, atol=1e-13)


@pytest.mark.parametrize("fast", [1e6, 1e9, 1e14])
def test_a_stiff_pole_asks_for_no_short_pieces_once_it_has_died(fast):
    t = [0.1, 1.0, 10.0]
    y = answer(alone(1 / ((s + 1) * (s / sp.Integer(int(fast)) + 1))), t)
    np.testing.assert_allclose(y, lags([1, fast], t), rtol=0, atol=1e-12)


@pytest.mark.parametrize("order", [8, 15, 20, 30])
def test_equal_lags_answer_as_the_incomplete_gamma_function(order):
    """P(n, t); a polynomial of degree 20 cannot hold the start tⁿ of the higher ones by itself."""
    t = [order / 4, float(order), 2.0 * order]
    exact = [float(mp.gammainc(order, 0, at, regularized=True)) for at in t]
    # (s + 1)³⁰ has coefficients of 1.6e8, whose rounding the response feels.
    np.testing.assert_allclose(answer(alone((s + 1) ** -order), t), exact, rtol=0, atol=1e-12)


def test_a_loop_of_twenty_lags_and_a_delay_follows_its_first_two_passes():
    """y = P u(t − 1) − P² u(t − 2) + …, where later passes have not come to matter."""
    t = np.array([5.0, 12.0, 20.0])
    y = answer(looped(exp(-s) * (s + 1) ** -20)["r", "y"], t)
    passes = [
        [float(mp.gammainc(20 * k, 0, max(at - k, 0), regularized=True)) for at in t]
        for k in range(1, 7)
    ]
    exact = sum(row * (-1) ** k for k, row in enumerate(np.array(passes)))
    np.testing.assert_allclose(y, exact, rtol=0, atol=1e-13)


def test_a_random_block_of_order_twelve_answers_as_its_matrix_exponential():
    """expm in 40 digits; the block is given as a quotient, whose rounding is what is allowed."""
    np.random.seed(12)  # noqa: NPY002 - what python-control draws from
    given = control.rss(12, 1, 1)
    t = [0.3, 1.0]
    y = answer(alone(given), t)
    with mp.workdps(40):
        whole = mp.zeros(13)
        whole[:12, :12], whole[:12, 12] = mp.matrix(given.A.tolist()), mp.matrix(given.B.tolist())
        states = [mp.expm(whole * mp.mpf(at))[:12, 12] for at in t]
        exact = [float((mp.matrix(given.C.tolist()) * x)[0] + given.D[0, 0]) for x in states]
    np.testing.assert_allclose(y, exact, rtol=1e-12)


def test_balancing_leaves_the_transfer_function_to_rounding():
    channel = alone(1 / sp.prod([1 + s / 10**k for k in range(8)]))
    at = np.array([0.3j, 1e3j, 2e6j])
    exact = [complex(mp.fprod(1 / (1 + mp.mpc(p) / 10**k) for k in range(8))) for p in at]
    np.testing.assert_allclose(channel.realisation.transfer(at)[:, 0, 0], exact, rtol=1e-10)
    assert np.abs(channel.realisation.A).max() < 1e8  # the companion matrix has 1e28


def test_growth_beyond_all_floats_is_said_with_its_time():
    """e^{5t} passes 1e308 at 141.9 s; a piece that would pass it ends a little before."""
    loop = looped(exp(-s) / (s - 5))["r", "y"]
    for channel in (loop, alone(1 / (s - 5))):
        with pytest.raises(InputError, match=r"grows beyond all floats by about t = 1[34]\d"):
            answer(channel, [100.0, 300.0])
    t = [1.0, 100.0]
    exact = [math.expm1(5 * at) / 5 for at in t]
    np.testing.assert_allclose(answer(alone(1 / (s - 5)), t), exact, rtol=1e-11)


@pytest.mark.parametrize("t", [1e8, 1e10, 1e15])
def test_what_has_settled_stays_so_for_any_number_of_delays(t):
    y = answer(looped(2 * exp(-s / 2) / (s + 1))["r", "y"], [t])
    np.testing.assert_allclose(y, 2 / 3, rtol=1e-12)


def test_a_change_too_late_for_its_delay_is_refused():
    loop = looped(2 * exp(-s / 2) / (s + 1))["r", "y"]
    with pytest.raises(LimitError, match=r"still changes at t = 5e.11 s"):
        answer(loop, [1e12], Step() + Step().delayed(5e11))


def test_too_many_pieces_are_blamed_on_what_asks_for_them(monkeypatch):
    monkeypatch.setattr("vsctrl.diagram.time.collocation.MAX_PIECES", 200)
    with pytest.raises(LimitError, match=r"200 pieces by t = .* changes within") as fast:
        answer(alone(1 / (s + 1)), [10.0], Sine(1e4))
    assert "neutral" not in str(fast.value)
    with pytest.raises(LimitError, match="do not fade"):
        answer(looped(sp.Rational(9, 10) * (exp(-s) + exp(-s * sp.sqrt(2).n(15))))["r", "y"], [1e3])


@pytest.mark.parametrize("gain", [exp(-s) * (s + 1) ** -8, (s + 1) ** -20, 0 * s, 1 / (s + 2)])
def test_check_passes_late_and_empty_responses(gain):
    table = looped(gain).check()
    assert table.passed, str(table)


def test_a_weak_quick_sine_beside_a_step_is_not_taken_for_rounding():
    t, weak = np.linspace(0, 20, 7), 1e-9
    sine = weak * (100 * np.exp(-t) + np.sin(100 * t) - 100 * np.cos(100 * t)) / (1 + 1e4)
    y = answer(alone(1 / (s + 1)), t, Step() + Sine(100.0, weak))
    np.testing.assert_allclose(y, -np.expm1(-t) + sine, rtol=0, atol=1e-12)


@pytest.mark.parametrize("omega", [0.3, 20.9, 300.0])
def test_a_gain_follows_a_sine_of_many_turns(omega):
    """Nothing but the signal itself limits the pieces here: y = 2u, and a lag beside a gain."""
    t = np.linspace(0.0, 30.0, 3001)
    u = np.sin(omega * t)
    np.testing.assert_allclose(answer(alone(2), t, Sine(omega)), 2 * u, atol=1e-10)
    lag = 2 * (omega * np.exp(-t) - omega * np.cos(omega * t) + u) / (1 + omega**2)
    found = answer(alone((s + 3) / (s + 1)), t, Sine(omega))
    np.testing.assert_allclose(found, u + lag, atol=1e-10)


@pytest.mark.parametrize("late", [1, 7, 300])
def test_what_arrives_when_all_else_has_long_been_at_rest_is_resolved(late):
    """1 − e^{−100(t − τ)} behind a dead time of hundreds of time constants."""
    parts = [Block("late lag", sp.exp(-late * s) / (s / 100 + 1), "u -> y")]
    H = Diagram(parts, inputs=["u"], outputs=["y"]).at()["u", "y"]
    since = np.array([0.001, 0.005, 0.02, 0.05, 0.5])
    y = H.response(Step(), late + since).outputs
    # The times themselves are rounded by ε τ, which is 100 ε τ of y.
    assert y == pytest.approx(1 - np.exp(-100 * since), rel=1e-10)


def test_a_mode_that_swings_for_thousands_of_its_periods_beside_a_fast_one():
    """e^{st} on a circle round its pole would grow beyond all numbers before it is at rest.

    Of ω²/(s² + 2ζωs + ω²)/(1 + s/b) the residues at p = −ζω + jω√(1 − ζ²) and at −b are known.
    """
    zeta, w, b = 1 / 300, 0.3, 1000.0
    H = w**2 / (s**2 + 2 * sp.Rational(1, 300) * w * s + w**2) / (1 + s / b)
    plant = Diagram([Block("P", H.subs(w, sp.Rational(3, 10)), "u -> y")], ["u"], ["y"]).at()
    info = plant["u", "y"].step_info()
    p = w * (-zeta + 1j * np.sqrt(1 - zeta**2))
    residue = w**2 / (p * (p - p.conjugate()) * (1 + p / b))
    t = np.linspace(0, 60, 2_000_001)
    y = 1 + 2 * (residue * np.exp(p * t)).real
    y += w**2 / ((b * b - 2 * zeta * w * b + w**2) * -1) * np.exp(-b * t)
    assert info.overshoot == pytest.approx(y.max() - 1, abs=1e-9)
    # The last excursion beyond 2 % is within a half turn of where the envelope passes it.
    envelope = np.log(2 * abs(residue) / 0.02) / (zeta * w)
    assert envelope - np.pi / p.imag <= info.settling_time <= envelope


def test_a_moving_average_in_a_loop_with_a_fast_lag_has_step_figures():
    """(1 − e^{−Ns})/(Ns) has a pole at 0 in its blocks, and none in the loop."""
    N = sp.Rational(22, 5)
    average = (1 - exp(-N * s)) / (N * s)
    loop = looped(3 / (s / 100 + 1) * average * exp(-sp.Rational(809, 100000) * s))
    info = loop["r", "y"].step_info()
    assert info.final == pytest.approx(0.75, rel=1e-12)
    t = info.settling_time * np.array([0.999, 1.001])
    before, after = np.abs(answer(loop["r", "y"], t) - 0.75) > 0.02 * 0.75
    assert before and not after
