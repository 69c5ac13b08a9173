"""The exponential as a signal: closed forms, and the response engine on it against brute force."""

import math

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from oracles.delay import WORKING, figure1

import vsctrl as vs
from vsctrl import InputError
from vsctrl.symbols import s

T = np.array([0.0, 0.05, 0.08, 0.11, 0.4, 1.0, 3.0])


def loop_response(rate, t, gain=2.5, late=0.08, feed=0.0):
    """S(t) of S' = gain (u(t) − S(t − late)) + feed u', u = e^{rate t}, summed with 60 digits.

    1/(s + K e^{−τs}) = Σ (−K)^k e^{−kτs}/s^{k+1}, and the n-fold integral of e^{at} is
    (e^{at} − Σ_{j<n} (at)^j/j!)/aⁿ.
    """

    def integral(left, n):
        rest = mp.exp(a * left) - mp.fsum((a * left) ** j / mp.factorial(j) for j in range(n))
        return rest / a**n

    with mp.workdps(60):
        a, K, tau = mp.mpf(repr(rate)), mp.mpf(repr(gain)), mp.mpf(repr(late))
        total, k = mp.mpf(0), 0
        while (left := mp.mpf(repr(float(t))) - k * tau) >= 0:
            # feed u' drives S directly: u' is a e^{at} from 0 on, plus an impulse at 0.
            fed = feed * (a * integral(left, k + 1) + left**k / mp.factorial(k))
            total += (-K) ** k * (K * integral(left, k + 1) + fed)
            k += 1
        return float(total)


@pytest.mark.parametrize("rate", [-30.0, -1.5, 0.7, 4.0])
def test_a_lag_answers_an_exponential_with_two(rate):
    channel = vs.Diagram([vs.Block("lag", 1 / (s + 1), "u -> y")]).at()["u", "y"]
    y = np.asarray(channel.response(vs.Exponential(rate, 2.0), T).outputs)
    exact = 2 * (np.exp(rate * T) - np.exp(-T)) / (rate + 1)
    np.testing.assert_allclose(y, exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("rate", [-30.0, -1.5, 0.7, 4.0])
@pytest.mark.parametrize("feed", [0.0, 1.0])
def test_figure_1_answers_it_as_the_series_of_its_delays(rate, feed):
    channel = figure1().at(WORKING | {"k_ff": feed})["S_ref", "S"]
    y = np.asarray(channel.response(vs.Exponential(rate), T).outputs)
    exact = np.array([loop_response(rate, t, feed=feed) for t in T])
    np.testing.assert_allclose(y, exact, atol=1e-12 * np.abs(exact).max())


def test_a_shifted_difference_is_the_difference_of_responses():
    channel = figure1().at(WORKING | {"k_ff": 0.0})["S_ref", "S"]
    u = vs.Step(1.0) - vs.Exponential(-3.0).delayed(0.3)
    y = np.asarray(channel.response(u, T).outputs)
    late = np.array([loop_response(-3.0, t - 0.3) if t > 0.3 else 0.0 for t in T])
    step = np.asarray(channel.response(vs.Step(), T).outputs)
    np.testing.assert_allclose(y, step - late, atol=1e-13)


def test_the_sampled_twin_sees_it_at_the_samples():
    twin = figure1().at(WORKING | {"k_ff": 0.0}).sampled(0.04, hold="T")
    t = 0.04 * np.arange(40)
    y = np.asarray(twin["S_ref", "S"].response(vs.Exponential(-1.5), 40).outputs).ravel()
    S = [0.0] * 40
    for k in range(39):
        S[k + 1] = S[k] + 0.04 * 2.5 * (math.exp(-1.5 * t[k]) - (S[k - 2] if k >= 2 else 0.0))
    np.testing.assert_allclose(y, S, atol=1e-13)


def test_what_it_is_and_its_transform():
    u = vs.Exponential(-2.0, 3.0)
    np.testing.assert_allclose(u(T), 3 * np.exp(-2 * T))
    assert u(-1.0) == 0.0 and u.delayed(0.5)(0.4) == 0.0
    assert 2 * u == vs.Exponential(-2.0, 6.0) == u + u
    assert u.derivative() is None
    a, b, p = sp.symbols("a b p", positive=True)
    ours = vs.Exponential(-a, b).laplace(p)
    t = sp.Symbol("t", positive=True)
    assert sp.simplify(ours - sp.laplace_transform(b * sp.exp(-a * t), t, p)[0]) == 0


def test_its_onset_holds_the_jump_of_every_derivative():
    t = 0.6
    taylor = sum(j * t**k / math.factorial(k) for k, j in enumerate(vs.Exponential(-2).onset(24)))
    assert taylor == pytest.approx(math.exp(-1.2), rel=1e-14)


def test_a_fast_decay_that_starts_late_does_not_overflow_before_it():
    assert vs.Exponential(-1e4).delayed(1.0)(0.5) == 0.0


def test_what_cannot_be_is_refused_with_a_sentence():
    with pytest.raises(InputError, match=r"Exponential: rate = nan .* finite"):
        vs.Exponential(math.nan)
    with pytest.raises(InputError, match=r"rate = 1000 1/s .* by 0\.7 s; ask for a shorter time"):
        vs.Exponential(1000.0)(1.0)
