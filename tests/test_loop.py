"""The closed forms of figure 1 against theory.md section 3, root finding and the exact engine.

Every expected formula is typed in here from the theory page; nothing is taken from the code.
"""

import math

import effort
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import lambertw

import vsctrl as vs
from vsctrl import loop
from vsctrl.errors import InputError
from vsctrl.symbols import T_s, d, k_ff, kappa, lam, s, tau, v

PLACEMENTS = ("measurement", "aligned", "actuator")
HISTORIC = -(1 - k_ff * kappa) / (kappa * lam)
RAMP_ERROR = {  # per unit of slope, theory.md section 3
    "measurement": tau + HISTORIC,
    "aligned": HISTORIC,
    "actuator": HISTORIC,
}
KNOWN = {"lam": sp.Rational(5, 2), "tau": sp.Rational(2, 25), "kappa": 1}  # the paper's loop
LATE = sp.exp(-tau * s)
DENOMINATOR = s + kappa * lam * LATE
TRANSFER = {
    "measurement": (kappa * lam * (1 - LATE) - (1 - k_ff * kappa) * s) / DENOMINATOR,
    "aligned": -(1 - k_ff * kappa) * s / DENOMINATOR,
    "actuator": s * (k_ff * kappa * LATE - 1) / DENOMINATOR,
}


def sampled_roots(gain_per_sample: float, samples: int) -> np.ndarray:
    if samples == 0:
        return np.array([1 - gain_per_sample])
    return np.roots([1.0, -1.0, *[0.0] * (samples - 1), gain_per_sample])


# Tracking errors -------------------------------------------------------------------------------
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_the_error_transfer_function_is_that_of_the_theory(placement):
    assert sp.simplify(loop.tracking_transfer(placement) - TRANSFER[placement]) == 0


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_the_ramp_error_is_that_of_the_theory_for_any_parameters(placement):
    found = loop.tracking_error(vs.Ramp(v), placement)
    assert sp.simplify(found - v * RAMP_ERROR[placement]) == 0


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_a_step_leaves_no_error(placement):
    assert loop.tracking_error(vs.Step(3), placement) == 0
    assert loop.tracking_error(vs.Step(3), placement, lam=2.5, tau=0.08, kappa=1, k_ff=1) == 0


@pytest.mark.parametrize(
    ("placement", "k", "late", "millimetres"),
    [
        ("measurement", 0, 0.00, -16.0),
        ("measurement", 1, 0.00, 0.0),
        ("measurement", 1, 0.08, 3.2),
        ("measurement", 0, 0.08, -12.8),
        ("aligned", 0, 0.08, -16.0),
        ("aligned", 1, 0.08, 0.0),
        ("actuator", 0, 0.08, -16.0),
        ("actuator", 1, 0.08, 0.0),
    ],
)
def test_the_lag_of_the_slide_in_millimetres(placement, k, late, millimetres):
    found = loop.tracking_error(vs.Ramp(0.04), placement, lam=2.5, kappa=1, k_ff=k, tau=late)
    assert 1e3 * float(found) == pytest.approx(millimetres, abs=1e-12)


def test_the_paper_s_one_over_lambda_law():
    assert sp.simplify(loop.tracking_error(vs.Ramp(v), tau=0, k_ff=0, kappa=1) + v / lam) == 0


def test_numbers_and_symbols_mix():
    found = loop.tracking_error(vs.Ramp(v), tau=sp.Rational(2, 25), k_ff=1, kappa=1)
    assert sp.simplify(found - v * sp.Rational(2, 25)) == 0


def test_a_parabola_outruns_a_loop_that_lags_on_the_ramp():
    known = {"lam": 2.5, "tau": 0.08, "kappa": 1}
    assert loop.tracking_error(vs.Parabola(1), k_ff=0, **known) == -sp.oo
    assert loop.tracking_error(vs.Parabola(1), k_ff=1, **known) == sp.oo


@pytest.mark.parametrize(
    ("placement", "known", "expected"),
    [
        # κλ(1 − e^{−τs}) − κλτ s = −κλ τ²s²/2 + …, over κλ, times 1/s² ⇒ −τ²/2
        ("measurement", KNOWN | {"k_ff": sp.Rational(4, 5)}, -0.0032),
        ("aligned", KNOWN | {"k_ff": 1}, 0.0),
        # s (e^{−τs} − 1) = −τ s² + … ⇒ −τ/(κλ)
        ("actuator", KNOWN | {"k_ff": 1}, -0.032),
    ],
)
def test_a_parabola_leaves_a_finite_error_where_the_ramp_error_is_nulled(
    placement, known, expected
):
    assert float(loop.tracking_error(vs.Parabola(1), placement, **known)) == pytest.approx(
        expected, abs=1e-12
    )


# The feed-forward gain that nulls --------------------------------------------------------------
def test_the_nulling_feedforward_of_each_placement():
    assert sp.simplify(loop.nulling_feedforward() - (1 - kappa * lam * tau) / kappa) == 0
    assert sp.simplify(loop.nulling_feedforward("aligned") - 1 / kappa) == 0
    assert sp.simplify(loop.nulling_feedforward("actuator") - 1 / kappa) == 0
    assert float(loop.nulling_feedforward(lam=2.5, tau=0.08, kappa=1)) == pytest.approx(0.8)
    assert float(loop.nulling_feedforward(lam=2.5, tau=0, kappa=2)) == pytest.approx(0.5)


# Gain limits -----------------------------------------------------------------------------------
def test_the_continuous_gain_limit():
    assert sp.simplify(loop.gain_limit() - sp.pi / (2 * kappa * tau)) == 0
    assert loop.gain_limit(0.08) == pytest.approx(math.pi / 0.16, rel=1e-15)
    assert round(loop.gain_limit(tau=0.08), 3) == 19.635
    assert loop.gain_limit(0.08, kappa=1.25) == pytest.approx(math.pi / 0.2, rel=1e-15)
    assert isinstance(loop.gain_limit(0.08), float)


@pytest.mark.parametrize("late", [0.02, 0.08, 1.5])
def test_the_rightmost_root_crosses_the_axis_at_the_continuous_limit(late):
    def rightmost(gain: float) -> float:
        return float(np.max(lambertw(-gain * late, np.arange(-4, 4)).real)) / late

    limit = loop.gain_limit(late)
    assert rightmost(limit * (1 - 1e-9)) < 0 < rightmost(limit * (1 + 1e-9))


def test_the_sampled_gain_limit_in_symbols():
    expected = 2 * sp.sin(sp.pi / (2 * (2 * d + 1))) / (kappa * T_s)
    assert sp.simplify(loop.gain_limit(period=T_s) - expected) == 0


@pytest.mark.parametrize(
    ("samples", "per_sample"), [(0, 2.0), (1, 1.0), (2, 0.618034), (3, 0.445042)]
)
@pytest.mark.parametrize("period", [0.04, 0.001, 2.0])
def test_the_sampled_gain_limit_is_where_a_root_leaves_the_circle(samples, per_sample, period):
    limit = loop.gain_limit(samples * period, period=period)
    assert limit * period == pytest.approx(per_sample, abs=1e-6)
    inside, outside = (
        np.abs(sampled_roots(limit * period * (1 + e), samples)).max() for e in (-1e-8, 1e-8)
    )
    assert inside < 1 < outside


def test_the_sampled_limit_of_the_paper_is_not_the_continuous_one():
    limit = loop.gain_limit(tau=0.08, period=0.04)
    assert round(limit, 3) == 15.451
    assert limit == pytest.approx(25 * (math.sqrt(5) - 1) / 2, rel=1e-14)
    assert loop.gain_limit(0.08, period=0.04, kappa=2) == pytest.approx(limit / 2, rel=1e-14)


def test_sampling_costs_gain_and_costs_less_as_it_gets_finer():
    found = [loop.gain_limit(0.08, period=0.08 / n) for n in (1, 2, 4, 16, 256)]
    assert found == sorted(found)
    assert found[-1] < loop.gain_limit(0.08)
    assert found[-1] == pytest.approx(loop.gain_limit(0.08), rel=3e-3)


@pytest.mark.parametrize(("late", "period"), [(0.3, 0.1), (0.12, 0.04), (0.7, 0.1)])
def test_a_delay_that_is_a_whole_number_of_periods_but_for_rounding_is_taken(late, period):
    limit = loop.gain_limit(late, period=period)
    assert limit == pytest.approx(
        2 * math.sin(math.pi / (2 * (2 * round(late / period) + 1))) / period, rel=1e-13
    )


def test_a_number_from_sympy_counts_as_a_number():
    two = loop.gain_limit(sp.Rational(2, 25), period=sp.Rational(1, 25), kappa=1)
    assert float(two) == pytest.approx(15.450849718747, rel=1e-12)
    assert float(loop.gain_limit(sp.Rational(2, 25), kappa=1)) == pytest.approx(math.pi / 0.16)


# The fastest gain without oscillation ----------------------------------------------------------
def test_the_fastest_gain_is_the_continuous_double_root():
    assert sp.simplify(loop.fastest_gain() - sp.exp(-1) / (kappa * tau)) == 0
    gain = loop.fastest_gain(0.08)
    assert gain == pytest.approx(1 / (math.e * 0.08), rel=1e-14)
    assert round(gain, 3) == 4.598
    # s + λe^{−τs} and its derivative vanish together at −1/τ …
    at = -1 / 0.08
    assert at + gain * math.exp(-0.08 * at) == pytest.approx(0, abs=1e-12)
    assert 1 - 0.08 * gain * math.exp(-0.08 * at) == pytest.approx(0, abs=1e-13)
    # … and from there on the dominant root is complex.
    below, above = (lambertw(-gain * (1 + e) * 0.08, 0) for e in (-1e-6, 1e-6))
    assert below.imag == 0 < abs(above.imag)


@pytest.mark.parametrize("samples", [1, 2, 3, 7])
def test_the_fastest_sampled_gain_is_a_double_root(samples):
    gain = loop.fastest_gain(samples * 0.04, period=0.04)
    assert gain * 0.04 == pytest.approx(
        samples**samples / (samples + 1) ** (samples + 1), rel=1e-13
    )
    polynomial = np.poly1d([1.0, -1.0, *[0.0] * (samples - 1), gain * 0.04])
    double = samples / (samples + 1)
    assert polynomial(double) == pytest.approx(0, abs=1e-15)
    assert polynomial.deriv()(double) == pytest.approx(0, abs=1e-14)
    below, above = (sampled_roots(gain * 0.04 * (1 + e), samples) for e in (-1e-6, 1e-6))
    assert below[np.abs(below).argmax()].imag == 0 < abs(above[np.abs(above).argmax()].imag)


def test_the_fastest_sampled_gain_of_the_paper_and_without_latency():
    assert round(loop.fastest_gain(0.08, period=0.04), 3) == 3.704
    assert loop.fastest_gain(0, period=0.04) == pytest.approx(25.0, rel=1e-15)  # dead beat
    expected = d**d / (d + 1) ** (d + 1) / (kappa * T_s)
    assert sp.simplify(loop.fastest_gain(period=T_s) - expected) == 0


def test_without_latency_nothing_limits_the_continuous_gain():
    assert loop.gain_limit(0) == math.inf
    assert loop.fastest_gain(0.0) == math.inf
    assert loop.gain_limit(0, period=0.04) == pytest.approx(50.0, rel=1e-15)


def test_a_gain_per_sample_in_seconds():
    assert loop.per_sample(0.1, 0.04) == pytest.approx(2.5, rel=1e-15)
    assert vs.per_sample(0.2, period=0.04) == pytest.approx(5.0, rel=1e-15)


# The diagrams ----------------------------------------------------------------------------------
def test_figure_1_has_the_paper_s_transfer_function():
    from vsctrl.symbols import ell, ell_hat

    expected = ell * (lam + k_ff * s) / (ell_hat * s + ell * lam * LATE)
    assert sp.simplify(vs.figure1.transfer("S_ref", "S") - expected) == 0


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_every_placement_has_the_same_loop_transfer_function(placement):
    system = loop.diagram(placement).at(lam=2.5, tau=0.08, ell=1.2, ell_hat=1, k_ff=1)
    w = np.array([0.1, 3.0, 30.0])
    expected = 3.0 * np.exp(-0.08j * w) / (1j * w)
    opened = system.open("S_meas")
    np.testing.assert_allclose(opened.frequency_response(w).complex, expected, rtol=1e-12)


@settings(max_examples=effort.share(40), deadline=None, derandomize=True)
@given(
    x=st.floats(0.05, 1.2),
    late=st.floats(0.01, 0.5),
    ratio=st.floats(0.5, 2.0),
    k=st.floats(-0.5, 1.5),
    placement=st.sampled_from(PLACEMENTS),
)
def test_the_closed_form_is_where_the_exact_delay_engine_settles(x, late, ratio, k, placement):
    gain = x / (ratio * late)
    rate = -float(np.max(lambertw(-x, np.arange(-3, 3)).real)) / late
    t = 32 / rate  # e^{−32} = 1e-14 of the transient is left
    system = loop.diagram(placement).at(lam=gain, tau=late, ell=ratio, ell_hat=1.0, k_ff=k)
    settled = system["S_ref", "S"].response(vs.Ramp(1.0), [t]).y.ravel()[-1] - t
    closed = loop.tracking_error(vs.Ramp(1.0), placement, lam=gain, tau=late, kappa=ratio, k_ff=k)
    # The engine promises 1e-10 of the response, which is t here.
    assert settled == pytest.approx(float(closed), abs=1e-10 * max(t, 1.0))


# Bad input -------------------------------------------------------------------------------------
@pytest.mark.parametrize("function", [loop.gain_limit, loop.fastest_gain])
@pytest.mark.parametrize("bad", [-0.08, math.nan, math.inf, "0.08", True, None])
def test_a_delay_that_is_none_is_refused(function, bad):
    with pytest.raises(InputError, match=r"tau.*give"):
        function(bad)
    with pytest.raises(InputError, match=r"tau.*give"):
        function(bad, period=0.04)


@pytest.mark.parametrize("function", [loop.gain_limit, loop.fastest_gain])
@pytest.mark.parametrize("bad", [-0.04, 0, math.nan, math.inf, "0.04", True])
def test_a_period_or_ratio_that_is_not_above_zero_is_refused(function, bad):
    with pytest.raises(InputError, match=r"period.*give"):
        function(0.08, period=bad)
    with pytest.raises(InputError, match=r"kappa.*give"):
        function(0.08, kappa=bad)


@pytest.mark.parametrize("late", [0.05, 0.079, 0.01])
def test_a_delay_between_samples_has_the_limit_of_its_roots(late):
    """z^{d+1}(z − 1) + κλTₛ((1 − f) z + f) has a root on the circle; a tenth below it has not."""
    d, f = int(late / 0.04), late / 0.04 % 1
    radii = []
    for share in (1.0, 0.9):
        gain = share * loop.gain_limit(late, period=0.04) * 0.04
        roots = np.roots(np.polyadd([1.0, -1.0, *[0.0] * (d + 1)], gain * np.array([1 - f, f])))
        radii.append(np.abs(roots).max())
    assert radii[0] == pytest.approx(1, abs=1e-9) and radii[1] < 1
    assert loop.fastest_gain(late, period=0.04) < loop.gain_limit(late, period=0.04)


def test_a_number_of_samples_asks_for_a_number_as_period():
    with pytest.raises(InputError, match="period"):
        loop.gain_limit(0.08, period=T_s)


@pytest.mark.parametrize(
    "ask",
    [
        loop.diagram,
        loop.tracking_transfer,
        loop.nulling_feedforward,
        lambda placement: loop.tracking_error(vs.Ramp(1.0), placement),
    ],
)
def test_an_unknown_placement_names_the_nearest(ask):
    with pytest.raises(InputError, match=r"placement: 'measurment'.*did you mean 'measurement'"):
        ask("measurment")
    with pytest.raises(InputError, match=r"placement: 'x'.*measurement, aligned, actuator"):
        ask("x")
    with pytest.raises(InputError, match="placement: 3"):
        ask(3)


def test_an_unknown_keyword_names_the_nearest():
    with pytest.raises(InputError, match=r"'lambd'.*did you mean 'lam'.*k_ff, kappa, lam, tau"):
        loop.tracking_error(vs.Ramp(1.0), lambd=2.5)
    with pytest.raises(InputError, match=r"^nulling_feedforward: .*'k_ff'"):
        loop.nulling_feedforward(k_ff=1)


@pytest.mark.parametrize("signal", [vs.Pulse(1.0), 3.0, "ramp", None])
def test_a_signal_without_a_steady_error_is_refused(signal):
    with pytest.raises(InputError, match="no steady error; give a Step, Ramp, Parabola, Sine or"):
        loop.tracking_error(signal)


@pytest.mark.parametrize(
    "values",
    [
        {"lam": -2.5},
        {"lam": 0},
        {"lam": math.nan},
        {"tau": -0.08},
        {"tau": math.inf},
        {"kappa": 0},
        {"k_ff": math.nan},
        {"lam": True},
    ],
    ids=str,
)
def test_the_closed_forms_refuse_values_that_cannot_be(values):
    name = next(iter(values))
    with pytest.raises(InputError, match=rf"{name}.*give"):
        loop.tracking_error(vs.Ramp(1.0), **values)
    if name != "k_ff":
        with pytest.raises(InputError, match=rf"{name}.*give"):
            loop.nulling_feedforward(**values)


def test_text_is_never_evaluated(tmp_path):
    victim = tmp_path / "made-by-eval"
    text = f"__import__('pathlib').Path({str(victim)!r}).touch()"
    for ask in (
        lambda: loop.tracking_error(vs.Ramp(1.0), tau=text),
        lambda: loop.nulling_feedforward(lam=text),
        lambda: loop.gain_limit(text),
        lambda: loop.gain_limit(0.08, kappa=text),
        lambda: loop.per_sample(text, 0.04),
    ):
        with pytest.raises((InputError, TypeError, ValueError)):
            ask()
        assert not victim.exists()
    with pytest.raises(InputError, match="tau"):
        loop.tracking_error(vs.Ramp(1.0), tau="0.08")


@pytest.mark.parametrize("bad", [0, -0.1, math.nan, math.inf, "0.1", True, None])
def test_a_gain_per_sample_wants_numbers_above_zero(bad):
    with pytest.raises(InputError, match=r"gain.*give"):
        loop.per_sample(bad, 0.04)
    with pytest.raises(InputError, match=r"period.*give"):
        loop.per_sample(0.1, bad)
