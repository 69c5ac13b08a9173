"""What closed forms of the loop refuse with a sentence, and values that used to slip through."""

import math

import numpy as np
import pytest
import sympy as sp

import vsctrl as vs
from vsctrl import derive, loop
from vsctrl.errors import InputError
from vsctrl.symbols import F_x, T_s, k_ff, kappa, lam, tau, z


# Values that hold the symbols of others ---------------------------------------------------------
def test_values_are_put_in_all_at_once():
    """The ramp error is v[τ − (1 − k_ff κ)/(κλ)]: swapped letters change places in it."""
    error = loop.tracking_error(vs.Ramp(1), lam=tau, tau=lam)
    assert sp.simplify(error - (lam - (1 - k_ff * kappa) / (kappa * tau))) == 0
    gain = loop.nulling_feedforward(lam=tau, tau=lam, kappa=tau)
    assert sp.simplify(gain - (1 / tau - tau * lam)) == 0
    gain = loop.harmful_feedforward_gain(tau=kappa, kappa=tau)
    assert sp.simplify(gain - (2 - k_ff * tau) / (2 * kappa * tau)) == 0
    assert sp.simplify(loop.gain_limit(kappa, kappa=2 * tau) - sp.pi / (4 * tau * kappa)) == 0
    held = loop.gain_limit(kappa, period=tau, kappa=T_s)
    assert sp.simplify(held - loop.gain_limit(period=T_s, kappa=tau)) == 0
    constants = loop.error_constants(loop.figure1, "S_meas", lam=tau, tau=lam, kappa=lam)
    assert sp.simplify(constants.velocity - lam * tau) == 0
    slopes = loop.error_sensitivities(loop.figure1, vs.Ramp(1), lam=tau, tau=lam)
    assert sp.simplify(slopes["lam"] - (1 - k_ff * kappa) / (kappa * tau**2)) == 0


def test_the_order_of_values_does_not_matter_for_a_sine():
    """A E(jω) of figure 1 by hand, in the swapped letters: κλ/(s + κλe^{−τs}) − 1 at k_ff = 0."""
    signal = vs.Sine(2, 3)
    found = loop.tracking_error(signal, lam=tau, tau=lam, k_ff=0, kappa=1)
    jw = 1j * signal.omega
    expected = signal.amplitude * (1.7 / (jw + 1.7 * np.exp(-0.3 * jw)) - 1)
    assert complex(found.subs({lam: 0.3, tau: 1.7})) == pytest.approx(expected, rel=1e-14)


# What is 0 or infinite --------------------------------------------------------------------------
def test_an_error_that_is_nothing_has_amplitude_and_phase_0():
    none = loop.tracking_error(vs.Sine(2, 1), "aligned", k_ff=1, kappa=1)
    assert loop.amplitude_and_phase(none) == (0, 0)
    with pytest.raises(InputError, match="'a' is no expression; give what steady_error"):
        loop.amplitude_and_phase("a")
    with pytest.raises(InputError, match="nan is not finite"):
        loop.amplitude_and_phase(sp.nan)


@pytest.mark.parametrize("placement", ["measurement", "aligned", "actuator"])
def test_numbers_put_in_later_find_the_case_of_an_infinite_error(placement):
    late = loop.tracking_error(vs.Parabola(1), placement)
    cases = [{k_ff: 1, kappa: 1}, {k_ff: 0, kappa: 1, lam: 2, tau: sp.Rational(1, 2)}]
    cases += [{k_ff: 0, kappa: 1, lam: 2, tau: sp.Rational(1, 8)}]
    names = {k_ff: "k_ff", kappa: "kappa", lam: "lam", tau: "tau"}
    for case in cases:
        known = {names[symbol]: value for symbol, value in case.items()}
        early = loop.tracking_error(vs.Parabola(1), placement, **known)
        assert not late.subs(case).has(sp.nan)
        difference = late.subs(case) - early
        assert late.subs(case) == early or sp.simplify(difference) == 0
    # By hand: at k_ff = κ = 1 aligned figure 1 has no error, late it has vτ on a ramp.
    if placement == "aligned":
        assert late.subs(cases[0]) == 0
    # With λτ = 1 the lag vanishes; E(s) = 2e^{…} − 1 expanded to s² by hand leaves −τ²/2.
    if placement == "measurement":
        assert late.subs(cases[1]) == -sp.Rational(1, 8)
        assert late.subs(cases[2]) == -sp.oo


def test_without_latency_feedforward_does_no_harm_below_twice_the_right_gain():
    assert loop.harmful_feedforward_gain(tau=0, kappa=1, k_ff=1) == sp.oo
    assert loop.harmful_feedforward_gain(tau=0, kappa=1, k_ff=2) == sp.oo
    assert loop.harmful_feedforward_gain(tau=0, kappa=3, k_ff=1) == -sp.oo
    later = loop.harmful_feedforward_gain(tau=0)
    assert later.subs({kappa: 1, k_ff: 1}) == sp.oo and later.subs({kappa: 3, k_ff: 1}) == -sp.oo


# Sentences --------------------------------------------------------------------------------------
POINT = derive.Point()
SYSTEM = loop.figure1.at(lam=1, tau=0.1, k_ff=0, ell=1, ell_hat=1)
ONE = {"lam": 1, "tau": 0.1, "k_ff": 0}


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: loop.gain_for(tau=tau, phase_margin=1), "gain_for: tau = tau .*finite number"),
        (lambda: loop.gain_for(tau=0.08, damping=tau), "gain_for: damping = tau .*finite number"),
        (lambda: loop.matrix_gain_limit(np.eye(6), tau), "tau = tau is not usable"),
        (lambda: loop.matrix_gain_limit(np.eye(6), 0.08, T_s), "period = T_s is not usable"),
        (lambda: loop.least_error_gain(tau), "least_error_gain: tau = tau is not usable"),
        (lambda: loop.smith_gain_limit(0.08, tau), "tau_hat = tau is not usable"),
        (lambda: loop.pi_gain_limit(0.08, tau), "T_i = tau is not usable"),
        (lambda: vs.per_sample(tau, 0.04), "per_sample: gain = tau is not usable"),
        (lambda: loop.gain_limit(10**400), "tau = 1000.*0 is not usable; give a finite number"),
        (lambda: loop.gain_limit(1e300, period=1e-300), "period = 1e-300 s is not usable: a delay"),
        (lambda: loop.matrix_gain_limit([[sp.I]], 0.08), r"M = \[\[I\]\].*finite real"),
        (lambda: loop.steady_lag(loop.figure1, [[sp.I]], [1], **ONE), "M = .*finite real"),
        (lambda: loop.steady_lag(loop.figure1, np.eye(6), np.ones((6, 2)), **ONE), "6×2; give one"),
        (lambda: loop.calibration_matrix(POINT, {sp.Symbol("z"): 2 * z}), "is another symbol"),
        (lambda: loop.calibration_matrix(POINT, {F_x: 2 * F_x}), "believed has F_x, which is no"),
        (lambda: loop.calibration_matrix(POINT, {sp.Symbol("Z"): 2}), "did you mean 'z'"),
        (lambda: loop.calibration_matrix(POINT, {z: 0}), "interaction matrix is not finite"),
        (lambda: loop.calibration_matrix(POINT, {z: sp.oo}), "believed z: oo is not usable"),
        (lambda: loop.calibration_matrix(POINT, {z: math.nan}), "believed z: nan is not usable"),
        (lambda: loop.calibration_matrix(POINT, 3), "believed = 3 is no mapping"),
        (lambda: loop.calibration_matrix(POINT, {z: 2 * z}, 3), "common = 3 is no list"),
        (lambda: loop.calibration_matrix(POINT, {z: 2 * z}, [lam]), "common has lambda, which"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_ends_in_a_sentence(ask, message):
    with pytest.raises(InputError, match=message):
        ask()


@pytest.mark.parametrize(
    "ask",
    [
        lambda: loop.steady_error(SYSTEM, vs.Ramp(1)),
        lambda: loop.steady_lag(loop.figure1, np.full((6, 6), np.nan), np.ones(6), **ONE),
        lambda: loop.matrix_gain_limit([list("abcdef")] * 6, 0.08),
    ],
)
def test_sentences_stay_on_one_line(ask):
    with pytest.raises(InputError) as raised:
        ask()
    assert len(str(raised.value)) < 200 and "\n" not in str(raised.value)
