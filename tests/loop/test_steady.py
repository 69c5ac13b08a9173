"""Steady errors of any diagram: closed forms against the exact engine, mpmath and textbooks."""

import math

import effort
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import vsctrl as vs
from vsctrl import loop
from vsctrl.errors import InputError
from vsctrl.loop.laurent import coefficient, laurent
from vsctrl.symbols import T_i, k_ff, kappa, lam, omega, s, tau, v

PLACEMENTS = ("measurement", "aligned", "actuator")
KNOWN = {"lam": 2.5, "tau": 0.08, "kappa": 1.2, "k_ff": 0.7}
a, b, K, theta = sp.symbols("a b K theta", positive=True)


def E(placement, s, lam, tau, kappa, k_ff):
    """The error transfer function as the theory page has it, for any kind of number."""
    late = mp.exp(-tau * s)
    above = {
        "measurement": kappa * lam * (1 - late) - (1 - k_ff * kappa) * s,
        "aligned": -(1 - k_ff * kappa) * s,
        "actuator": s * (k_ff * kappa * late - 1),
    }[placement]
    return above / (s + kappa * lam * late)


def unity(L):
    """Unit feedback around an open loop L."""
    return vs.Diagram(
        [vs.Sum("e = r - y"), vs.Block("loop", L, "e -> y")], inputs=["r"], outputs=["y"]
    )


def disturbed():
    """A lag with dead time under PI control, and a disturbance at its input."""
    return vs.Diagram(
        [
            vs.Sum("e = r - y"),
            vs.Block("controller", K * (1 + 1 / (T_i * s)), "e -> u"),
            vs.Sum("w = u + d"),
            vs.Block("plant", sp.exp(-theta * s) * b / (s + a), "w -> y"),
        ],
        inputs=["r", "d"],
        outputs=["y"],
    )


# Any diagram -----------------------------------------------------------------------------------
def test_a_disturbance_is_rejected_by_the_integral_and_by_no_more():
    diagram = disturbed()
    assert loop.steady_error(diagram, vs.Step(v), source="d") == 0
    # y/d = b s e^{−θs} … / (K b/T_i) at s → 0.
    assert sp.simplify(loop.steady_error(diagram, vs.Ramp(v), source="d") - v * T_i / K) == 0
    assert loop.steady_error(diagram, vs.Parabola(v), source="d") == sp.oo
    assert sp.simplify(loop.steady_error(diagram, vs.Ramp(v)) + v * a * T_i / (K * b)) == 0


@pytest.mark.parametrize("signal", [vs.Step(0.3), vs.Ramp(0.3), vs.Exponential(0.4, 0.3)], ids=str)
@pytest.mark.parametrize("source", ["r", "d"])
def test_it_is_where_the_exact_engine_settles(signal, source):
    values = {"K": 1.3, "T_i": 2.0, "a": 0.8, "b": 1.1, "theta": 0.25}
    diagram = disturbed()
    t = 60.0
    y = float(np.ravel(diagram.at(values)[source, "y"].response(signal, [t]).outputs)[-1])
    error = y - float(signal(t)) * (source == "r")
    found = float(loop.steady_error(diagram, signal, source=source, **values))
    scale = math.exp(0.4 * t) if isinstance(signal, vs.Exponential) else 1.0
    # The engine promises 1e-10 of the response.
    assert error / scale == pytest.approx(found, abs=1e-10 * (abs(y) / scale + 1))


@settings(max_examples=effort.share(30), deadline=None, derandomize=True)
@given(
    numbers=st.lists(st.integers(-9, 9), min_size=6, max_size=6),
    late=st.fractions(0, 2, max_denominator=8),
    order=st.integers(0, 2),
)
def test_a_limit_is_what_mpmath_finds_at_a_tiny_s(numbers, late, order):
    """Rational in s with a delay, made to have a pole or a zero of any order at 0."""
    c = [mp.mpf(n) for n in numbers]
    top = (numbers[0] + numbers[1] * s) * (1 - sp.exp(-sp.Rational(late) * s)) + numbers[2] * s**2
    bottom = (abs(numbers[3]) + 1) * s ** (abs(numbers[4]) % 3) + s**3 * numbers[5]
    diagram = vs.Diagram([vs.Block("g", 1 + top / bottom, "u -> y")])
    signal = (vs.Step(1), vs.Ramp(1), vs.Parabola(1))[order]
    found = loop.steady_error(diagram, signal)
    with mp.workdps(120):
        p = mp.mpf(10) ** -30
        late_ = mp.mpf(late.numerator) / late.denominator
        above = (c[0] + c[1] * p) * (1 - mp.exp(-late_ * p)) + c[2] * p**2
        below = (abs(c[3]) + 1) * p ** (abs(numbers[4]) % 3) + p**3 * c[5]
        limit = above / below / p**order
        if found in (sp.oo, -sp.oo):
            assert abs(limit) > 1e25 and mp.sign(limit) == (1 if found == sp.oo else -1)
        else:
            assert abs(limit - mp.mpf(found.p) / found.q) < mp.mpf(10) ** -25


def test_hidden_and_real_integrators():
    late = sp.exp(-tau * s)
    first, found = laurent((1 - late) ** 3 / (s * (1 - late) ** 2), 2)
    expected = (tau, -(tau**2) / 2, tau**3 / 6)
    assert first == 0
    assert [sp.simplify(x - y) for x, y in zip(found, expected, strict=True)] == [0, 0, 0]
    first, found = laurent(late / s**2, 0)
    assert (first, found) == (-2, (1, -tau, tau**2 / 2))
    assert coefficient((first, found), -3) == 0
    assert laurent(sp.S.Zero, 2) == (0, (0,))


def test_the_series_at_zero_is_mpmath_s_taylor_series():
    late = sp.exp(-s * sp.Rational(3, 10))
    transfer = (2 + 3 * s - late) / (1 + 2 * s + 5 * s**2 + late * (1 - s))
    first, found = laurent(transfer, 5)
    with mp.workdps(60):
        q = mp.mpf(3) / 10

        def direct(p):
            above = 2 + 3 * p - mp.exp(-q * p)
            return above / (1 + 2 * p + 5 * p**2 + mp.exp(-q * p) * (1 - p))

        exact = mp.taylor(direct, 0, 5)
        assert first == 0
        for ours, theirs in zip(found, exact, strict=True):
            assert abs(mp.mpf(ours.p) / ours.q - theirs) < mp.mpf(10) ** -30


def test_values_that_make_an_integrator_of_a_lag_change_the_type():
    diagram = unity(K / (s + a))
    assert sp.simplify(loop.steady_error(diagram, vs.Step(1)) + a / (K + a)) == 0
    x = sp.Symbol("x", real=True)
    diagram = unity(K / (s + x))
    assert loop.steady_error(diagram, vs.Ramp(1), x=0) == -1 / K
    open_loop = vs.Diagram([vs.Block("g", 1 / (s + x), "u -> y")])
    assert loop.steady_error(open_loop, vs.Step(1), x=0) == sp.oo
    assert loop.error_constants(diagram, "y", x=0).type == 1


def test_the_error_that_the_law_sees_is_another_one():
    assert loop.tracking_error(vs.Ramp(v), output="S_meas", k_ff=1, kappa=1) == 0
    seen = loop.tracking_error(vs.Ramp(v), output="S_meas")
    assert sp.simplify(seen + v * (1 - k_ff * kappa) / (kappa * lam)) == 0


# Sines and exponentials ------------------------------------------------------------------------
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_a_sine_leaves_the_transfer_function_at_j_omega(placement):
    found = loop.tracking_error(vs.Sine(3.0, 0.02), placement, **KNOWN)
    with mp.workdps(40):
        exact = mp.mpf("0.02") * E(
            placement, mp.mpc(0, 3), *map(mp.mpf, ("2.5", "0.08", "1.2", "0.7"))
        )
        ours = mp.mpmathify(sp.N(found, 38))
        assert abs(ours - exact) < mp.mpf(10) ** -32


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_a_sine_settles_at_its_amplitude_and_phase(placement):
    symbolic = loop.tracking_error(vs.Sine(omega, v), placement)
    size, phase = loop.amplitude_and_phase(symbolic)
    numbers = {"lam": 2.5, "tau": 0.08, "k_ff": 0.7}
    at = {omega: 3.0, v: 0.02, lam: 2.5, tau: 0.08, k_ff: 0.7, kappa: 1.2}
    size, phase = float(size.subs(at)), float(phase.subs(at))
    t = np.linspace(20.0, 22.0, 41)
    channel = loop.diagram(placement).at(ell=1.2, ell_hat=1, **numbers)["S_ref", "S"]
    error = np.ravel(channel.response(vs.Sine(3.0, 0.02), t).outputs) - 0.02 * np.sin(3 * t)
    np.testing.assert_allclose(error, size * np.sin(3 * t + phase), atol=1e-12)
    cosine = np.ravel(channel.response(vs.diagram.signals.elementary.Cosine(3.0, 0.02), t).outputs)
    error = cosine - 0.02 * np.cos(3 * t)
    np.testing.assert_allclose(error, size * np.cos(3 * t + phase), atol=1e-12)


def test_amplitude_and_phase_of_symbols_without_assumptions():
    p, q = sp.symbols("p q")
    size, phase = loop.amplitude_and_phase((p + sp.I) / (q - 2 * sp.I))
    for at in ({p: 1.5, q: -0.3}, {p: -2, q: 4}, {p: 0.1, q: 0.2}):
        exact = complex((p + sp.I).subs(at)) / complex((q - 2 * sp.I).subs(at))
        assert complex(size.subs(at)) == pytest.approx(abs(exact), rel=1e-14)
        assert float(phase.subs(at)) == pytest.approx(math.atan2(exact.imag, exact.real), rel=1e-13)


@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("rate", [-0.4, 0.9])
def test_an_exponential_leaves_the_transfer_function_at_its_rate(placement, rate):
    found = float(loop.tracking_error(vs.Exponential(rate, 0.02), placement, **KNOWN))
    assert found == pytest.approx(0.02 * float(E(placement, rate, 2.5, 0.08, 1.2, 0.7)), rel=1e-14)
    t = 14.0
    values = {"lam": 2.5, "tau": 0.08, "k_ff": 0.7, "ell": 1.2, "ell_hat": 1}
    channel = loop.diagram(placement).at(values)["S_ref", "S"]
    y = float(np.ravel(channel.response(vs.Exponential(rate, 0.02), [t]).outputs)[-1])
    left = y / math.exp(rate * t) - 0.02
    # The transient e^{−3.7 t} is 1e-22 of it; the engine keeps 1e-14 of the largest value.
    assert left == pytest.approx(found, abs=1e-12 * max(1.0, math.exp(-rate * t)))


def test_a_rate_that_is_a_pole_is_refused():
    with pytest.raises(InputError, match=r"s = -2 is a pole of the loop.*another rate"):
        loop.steady_error(unity(1 / (s + 1)), vs.Exponential(-2))


# Error constants -------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("L", "expected"),
    [
        (500 * (s + 2) * (s + 5) / ((s + 8) * (s + 10) * (s + 12)), (0, 5.208, 0, 0)),
        (
            500 * (s + 2) * (s + 5) * (s + 6) / (s * (s + 8) * (s + 10) * (s + 12)),
            (1, math.inf, 31.25, 0),
        ),
        (
            500 * (s + 2) * (s + 4) * (s + 5) * (s + 6) * (s + 7)
            / (s**2 * (s + 8) * (s + 10) * (s + 12)),
            (2, math.inf, math.inf, 875),
        ),
    ],
)  # fmt: skip
def test_the_static_error_constants_of_nise(L, expected):
    """N. S. Nise, Control Systems Engineering, example 7.4 (three decimals are printed)."""
    found = loop.error_constants(unity(L), "y")
    assert found.type == expected[0]
    numbers = [float(c) for c in (found.position, found.velocity, found.acceleration)]
    assert numbers == pytest.approx(list(expected[1:]), abs=5e-4)


def test_the_constants_of_the_variants_in_symbols():
    plain = loop.error_constants(loop.figure1, "S_meas")
    assert (plain.type, plain.position, plain.acceleration) == (1, sp.oo, 0)
    assert sp.simplify(plain.velocity - kappa * lam) == 0
    integral = loop.error_constants(loop.pi(), "S_meas")
    assert (integral.type, integral.velocity) == (2, sp.oo)
    assert sp.simplify(integral.acceleration - kappa * lam / T_i) == 0
    # The predictor's own finite sum has no pole at 0: e = S_ref − S_pred is of type 1 still.
    assert loop.error_constants(loop.smith(), "e", kappa=1).type == 1


@pytest.mark.parametrize(
    "L", [K * (s + a) / (s * (s + b)), K * (s + a) / (s**2 * (s + b)), K / (s + a)]
)
def test_constants_and_errors_agree_in_a_unit_feedback(L):
    late = L * sp.exp(-theta * s)
    constants = loop.error_constants(unity(late), "y")
    step, ramp = (loop.steady_error(unity(late), signal) for signal in (vs.Step(1), vs.Ramp(1)))
    assert sp.simplify(step + 1 / (1 + constants.position)) == 0
    if constants.velocity != 0:
        assert sp.simplify(ramp + 1 / constants.velocity) == 0
    else:
        assert ramp == -sp.oo


def test_a_signal_outside_the_loop_has_no_constants():
    diagram = vs.Diagram([vs.Block("a", K / s, "u -> w"), vs.Block("b", K, "w -> y")])
    with pytest.raises(InputError, match="no loop runs through 'w'"):
        loop.error_constants(diagram, "w")


# Sensitivities ---------------------------------------------------------------------------------
@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("relative", [False, True])
def test_sensitivities_are_the_slopes_of_the_error(placement, relative):
    """Against mpmath's numerical derivative of lim E(s)/s, typed in."""
    order = ("lam", "tau", "kappa", "k_ff")

    def error(*values):
        lam_, tau_, kappa_, k = values
        historic = -(1 - k * kappa_) / (kappa_ * lam_)
        return mp.mpf("0.04") * (historic + (tau_ if placement == "measurement" else 0))

    found = loop.error_sensitivities(
        loop.diagram(placement), vs.Ramp(0.04), relative=relative, **KNOWN
    )
    assert found.keys() == set(order)
    with mp.workdps(40):
        at = [mp.mpf(str(KNOWN[name])) for name in order]
        for i, name in enumerate(order):
            slope = mp.diff(error, tuple(at), tuple(int(i == j) for j in range(4)))
            slope *= at[i] / error(*at) if relative else 1
            assert float(found[name]) == pytest.approx(float(slope), rel=1e-14, abs=1e-18)


def test_the_sensitivity_to_the_latency_is_the_speed_and_calibration_matters_least_at_high_gain():
    found = loop.error_sensitivities(loop.figure1, vs.Ramp(v))
    assert found["tau"] == v
    assert sp.simplify(found["kappa"] - v / (kappa**2 * lam)) == 0
    assert loop.error_sensitivities(loop.pi(), vs.Ramp(v))["kappa"] == 0
    assert "ell_hat" not in found


def test_the_sensitivity_of_a_sine_is_that_of_its_complex_amplitude():
    found = loop.error_sensitivities(loop.figure1, vs.Sine(3.0), **KNOWN)
    with mp.workdps(40):
        at = [mp.mpf(x) for x in ("2.5", "0.08", "1.2", "0.7")]
        for i, name in enumerate(("lam", "tau", "kappa", "k_ff")):
            slope = mp.diff(
                lambda *values: E("measurement", mp.mpc(0, 3), *values),
                tuple(at),
                tuple(int(i == j) for j in range(4)),
            )
            assert abs(mp.mpmathify(sp.N(found[name], 30)) - slope) < mp.mpf(10) ** -17


def test_what_is_infinite_or_nothing_has_no_sensitivity():
    with pytest.raises(InputError, match="which has no such sensitivity"):
        loop.error_sensitivities(loop.figure1, vs.Parabola(1))
    with pytest.raises(InputError, match="leaves the error 0"):
        loop.error_sensitivities(loop.figure1, vs.Step(1), relative=True)
    assert set(loop.error_sensitivities(loop.figure1, vs.Step(1)).values()) == {0}


# Feed-forward that does harm -------------------------------------------------------------------
def test_the_gain_from_which_on_feedforward_makes_the_error_larger():
    found = loop.harmful_feedforward_gain()
    assert sp.simplify(found - (2 - k_ff * kappa) / (2 * kappa * tau)) == 0
    assert float(loop.harmful_feedforward_gain(tau=0.08, kappa=1, k_ff=1)) == 6.25
    for gain, larger in ((6.24, False), (6.26, True)):
        known = {"lam": gain, "tau": 0.08, "kappa": 1}
        with_, without = (abs(loop.tracking_error(vs.Ramp(1), k_ff=k, **known)) for k in (1, 0))
        assert bool(with_ > without) is larger


# Every signal of the first is taken, and the second has none from outside.
TAKEN = vs.Diagram([vs.Sum("e = r - y"), vs.Block("p", 1 / (s + 1), "e -> y")])
RING = vs.Diagram([vs.Block("p", 1 / (s + 1), "e -> y"), vs.Block("q", -1, "y -> e")])


def test_a_diagram_without_outputs_answers_for_a_signal_that_is_named():
    assert loop.steady_error(TAKEN, vs.Step(), output="y") == -sp.Rational(1, 2)


# Bad input -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: loop.steady_error("figure1", vs.Ramp(1)), "'figure1' is no diagram"),
        (lambda: loop.error_constants("figure1", "S_meas"), "'figure1' is no diagram"),
        (lambda: loop.error_sensitivities(None, vs.Ramp(1)), "None is no diagram"),
        (lambda: loop.steady_error(disturbed(), vs.Ramp(1), source="e"), "'e' is not an input"),
        (lambda: loop.steady_error(disturbed(), vs.Ramp(1), reference="R"), "no signal 'R'"),
        (lambda: loop.steady_error(loop.pi(), vs.Ramp(1), T_i=-1), r"steady_error: T_i = -1.*give"),
        (lambda: loop.steady_error(loop.pi(), vs.Step(1) + vs.Ramp(1)), "no steady error; give"),
        (lambda: loop.steady_error(TAKEN, vs.Step()), 'no output to take; name.*output="y"'),
        (lambda: loop.error_transfer(RING, "y"), 'no input to take; name.*reference="y"'),
        (lambda: loop.error_constants(loop.figure1, "S_mes"), "did you mean 'S_meas'"),
        (lambda: loop.error_constants(loop.figure1, "S_meas", tua=1), "did you mean 'tau'"),
        (lambda: loop.error_sensitivities(loop.figure1, vs.Ramp(1), lambd=1), "did you mean 'lam'"),
        (lambda: loop.harmful_feedforward_gain(lam=1), "'lam' is what is asked for"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_with_a_sentence(ask, message):
    with pytest.raises(InputError, match=message):
        ask()
