"""The delay-tolerant variants: closed forms against the exact engine, limits against roots."""

import math

import effort
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import vsctrl as vs
from vsctrl import loop
from vsctrl.errors import InputError, LimitError
from vsctrl.symbols import T_i, ell, ell_hat, h, k_ff, kappa, lam, s, tau, tau_hat, v

PLACEMENTS = ("measurement", "aligned", "actuator")
HISTORIC = -(1 - k_ff * kappa) / (kappa * lam)
LAG = {"measurement": tau + HISTORIC, "aligned": HISTORIC, "actuator": HISTORIC}
RAMP_ERROR = {
    **{("preview", p): LAG[p] + h for p in PLACEMENTS},
    **{("pi", p): tau if p == "measurement" else sp.Integer(0) for p in PLACEMENTS},
    ("previewed_feedforward", None): HISTORIC,
    ("smith", None): tau - tau_hat / kappa + HISTORIC,
}
PARABOLA_ERROR = {  # where the ramp error is nulled: per unit of acceleration, from the theory page
    ("pi", "aligned"): HISTORIC * T_i,
    ("pi", "actuator"): HISTORIC * T_i,
}


def variant(name, placement):
    return getattr(loop, name)(*([placement] if placement else []))


def rightmost(system):
    """The rightmost root but the model's own at 0."""
    roots = system.poles(8)
    return float(roots[np.abs(roots) > 1e-9].real.max())


# Tracking errors ---------------------------------------------------------------------------------
@pytest.mark.parametrize(("name", "placement"), RAMP_ERROR)
def test_the_ramp_error_in_closed_form_and_none_after_a_step(name, placement):
    diagram = variant(name, placement)
    found = loop.steady_error(diagram, vs.Ramp(v))
    assert sp.simplify(found - v * RAMP_ERROR[name, placement]) == 0
    assert loop.steady_error(diagram, vs.Step(3)) == 0


@pytest.mark.parametrize(("name", "placement"), PARABOLA_ERROR)
def test_the_parabola_error_where_the_ramp_error_is_null(name, placement):
    found = loop.steady_error(variant(name, placement), vs.Parabola(1))
    assert sp.simplify(found - PARABOLA_ERROR[name, placement]) == 0


@settings(max_examples=effort.share(40), deadline=None, derandomize=True)
@given(
    which=st.sampled_from(list(RAMP_ERROR)),
    x=st.floats(0.1, 0.9),
    late=st.floats(0.02, 0.5),
    ratio=st.floats(0.6, 1.5),
    k=st.floats(-0.5, 1.5),
    share=st.floats(0.3, 1.6),
)
def test_the_closed_form_is_where_the_exact_engine_settles(which, x, late, ratio, k, share):
    given_ = {"lam": x / (ratio * late), "tau": late, "ell": ratio, "ell_hat": 1.0, "k_ff": k}
    given_ |= {"tau_hat": share * late, "h": share * late, "T_i": late * (8 + 10 * share) / x}
    diagram = variant(*which)
    values = {name: given_[name] for name in diagram.parameters}
    system = diagram.at(values)
    rate = -rightmost(system)
    assert rate > 0
    t = 30 / rate
    settled = system["S_ref", "S"].response(vs.Ramp(1.0), [t]).y.ravel()[-1] - t
    if "S_star" in diagram.signals:
        settled += values["h"]  # the reference of now is that much behind the input
    known = {n: a for n, a in values.items() if n not in ("ell", "ell_hat")} | {"kappa": ratio}
    error = float(loop.steady_error(diagram, vs.Ramp(1.0), **known))
    assert settled == pytest.approx(error, abs=1e-9 * max(t, 1.0))


def test_the_measured_error_hides_what_the_integral_does_not_see():
    assert loop.steady_error(loop.pi(), vs.Ramp(v), output="S_meas") == 0
    assert loop.steady_error(loop.pi(), vs.Ramp(v)) == v * tau


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_figure_1_itself_gives_what_tracking_error_gives(placement):
    for signal in (vs.Step(1), vs.Ramp(v)):
        found = loop.steady_error(loop.diagram(placement), signal)
        assert sp.simplify(found - loop.tracking_error(signal, placement)) == 0


def test_a_parabola_outruns_what_lags_on_a_ramp():
    known = {"lam": 2.5, "tau": 0.08, "kappa": 1, "tau_hat": 0.08}
    assert loop.steady_error(loop.smith(), vs.Parabola(1), k_ff=0, **known) == -sp.oo
    # 0.08 − (1 − 0.8)/2.5 cancels exactly, as decimals do and doubles do not.
    found = loop.steady_error(
        loop.preview(), vs.Parabola(1), k_ff=0.8, lam=2.5, tau=0.08, kappa=1, h=0
    )
    assert found == pytest.approx(-0.0032)


# Preview -----------------------------------------------------------------------------------------
def test_preview_buys_back_the_lag_of_a_loop_without_feedforward():
    nulled = sp.solve(loop.steady_error(loop.preview(), vs.Ramp(v)), h)[0]
    assert sp.simplify(nulled - ((1 - k_ff * kappa) / (kappa * lam) - tau)) == 0
    system = loop.preview().at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=0, h=0.32)
    late = system["S_ref", "S_star"].response(vs.Ramp(0.04), [20.0]).y.ravel()[0]
    now = system["S_ref", "S"].response(vs.Ramp(0.04), [20.0]).y.ravel()[0]
    assert now == pytest.approx(late, abs=1e-11)


def test_a_feedforward_as_early_as_the_actuator_is_late_leaves_no_error_at_all():
    diagram = loop.previewed_feedforward()
    transfer = diagram.transfer("S_ref", "S") - diagram.transfer("S_ref", "S_star")
    perfect = {h: tau, k_ff: 1, ell: ell_hat}
    assert sp.simplify(transfer.subs(perfect)) == 0
    error = loop.steady_error(diagram, vs.Parabola(1), k_ff=1, kappa=1)
    assert sp.simplify(error - (h - tau) / lam) == 0
    system = diagram.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1, h=0.08)
    w = 1j * np.geomspace(0.01, 1000, 200)
    np.testing.assert_allclose(system["S_ref", "S"](w), system["S_ref", "S_star"](w), atol=1e-13)


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_preview_leaves_the_loop_alone(placement):
    known = {"lam": 2.5, "tau": 0.08, "ell": 1.2, "ell_hat": 1, "k_ff": 1}
    ours, plain = loop.preview(placement).at(h=0.3, **known), loop.diagram(placement).at(**known)
    np.testing.assert_allclose(ours.poles(4), plain.poles(4), rtol=1e-10)


# Smith predictor ---------------------------------------------------------------------------------
def test_the_perfect_predictor_takes_the_delay_out_of_the_characteristic_equation():
    perfect = {tau_hat: tau, ell: ell_hat}
    found = sp.simplify(loop.smith().transfer("S_ref", "S").subs(perfect))
    assert sp.simplify(found - (lam + k_ff * s) / (s + lam)) == 0


@pytest.mark.parametrize("gain", [0.5, 2.5, 25.0, 50.0])
def test_the_perfect_predictor_has_one_pole_and_a_hidden_one(gain):
    system = loop.smith().at(lam=gain, tau=0.08, tau_hat=0.08, ell=1, ell_hat=1, k_ff=1)
    np.testing.assert_allclose(system.poles(6), [0, -gain], atol=1e-8 * gain)
    t = np.linspace(0, 2, 101)
    step = system.with_(k_ff=0)["S_ref", "S"].response(vs.Step(1.0), t).y.ravel()
    np.testing.assert_allclose(step, 1 - np.exp(-gain * t), atol=1e-10)


@pytest.mark.parametrize(
    ("late", "model", "ratio"),
    [
        (1.0, 0.9, 1.0),
        (1.0, 1.1, 1.0),
        (1.0, 0.5, 1.0),
        (0.08, 0.04, 1.0),
        (0.08, 0.1, 1.0),
        (1.0, 2.0, 1.0),
        (1.0, 0.8, 1.4),
        (1.0, 1.0, 2.5),
        (0.08, 0.06, 0.7),
    ],
)
def test_the_gain_limit_under_mismatch_is_where_bisection_on_the_roots_finds_it(late, model, ratio):
    limit = loop.smith_gain_limit(late, model, ratio)
    system = loop.smith().at(lam=1, tau=late, tau_hat=model, ell=ratio, ell_hat=1, k_ff=0)
    # The first loss of stability: every gain below is stable …
    for gain in np.linspace(0.02, 0.999, 30) * limit:
        assert rightmost(system.with_(lam=float(gain))) < 0
    low, high = 0.99 * limit, 1.01 * limit
    assert rightmost(system.with_(lam=high)) > 0
    for _ in range(26):  # … and the sign changes there.
        middle = (low + high) / 2
        low, high = (low, middle) if rightmost(system.with_(lam=middle)) > 0 else (middle, high)
    assert limit == pytest.approx(low, rel=1e-8)


@pytest.mark.parametrize("gap", [-0.3, -0.1, -0.01, -1e-4, 1e-4, 0.01, 0.1, 0.3, 3.0])
def test_a_mismatch_never_limits_the_gain_below_its_inverse(gap):
    limit = loop.smith_gain_limit(1.0, 1.0 + gap) if gap > -1 else 0
    assert limit * abs(gap) >= 1
    if gap < 1:  # and better than no predictor at all
        assert limit > loop.gain_limit(1.0)


def test_a_predictor_without_model_delay_is_figure_1_and_a_perfect_one_has_no_limit():
    assert loop.smith_gain_limit(0.08, 0.0) == pytest.approx(math.pi / 0.16, rel=1e-12)
    assert loop.smith_gain_limit(0.08, 0.08) == math.inf
    assert loop.smith_gain_limit(0.08, 0.08, kappa=1.99) == math.inf
    assert loop.smith_gain_limit(0.0, 0.08) == math.inf  # 2 − cos ω is never 0
    assert loop.smith_gain_limit(0, 0) == math.inf


def test_a_search_that_would_not_end_says_up_to_where_all_is_stable():
    with pytest.raises(LimitError, match=r"stable up to .* s⁻¹"):
        loop.smith_gain_limit(1.0, 1.0 + 1e-9)


# PI ----------------------------------------------------------------------------------------------
@pytest.mark.parametrize("placement", ["aligned", "actuator"])
@pytest.mark.parametrize("ratio", [0.7, 1.0, 1.4])
def test_the_integral_nulls_the_ramp_error_whatever_the_calibration(placement, ratio):
    system = loop.pi(placement).at(lam=3.0, T_i=0.8, tau=0.08, ell=ratio, ell_hat=1.0, k_ff=0.0)
    t = 20.0
    settled = system["S_ref", "S"].response(vs.Ramp(0.04), [t]).y.ravel()[0] - 0.04 * t
    assert settled == pytest.approx(0, abs=1e-10)


@pytest.mark.parametrize("integral", [0.081, 0.1, 0.2, 1.0, 10.0])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_the_gain_limit_of_the_integral_law_is_where_the_roots_cross(integral, ratio):
    limit = loop.pi_gain_limit(0.08, integral, ratio)
    assert 0 < limit < loop.gain_limit(0.08, kappa=ratio)
    system = loop.pi().at(lam=limit, T_i=integral, tau=0.08, ell=ratio, ell_hat=1, k_ff=0)
    low, high = (system.with_(lam=limit * (1 + e)).poles(2)[0].real for e in (-1e-4, 1e-4))
    assert low < 0 < high
    assert system.poles(2)[0].real == pytest.approx(0, abs=1e-9 / 0.08)


def test_the_integral_law_without_and_with_too_little_integral_time():
    assert loop.pi_gain_limit(0.08, 0.08) == 0
    assert loop.pi_gain_limit(0.0, 1.0) == math.inf
    assert loop.pi_gain_limit(0.08, 1e9) == pytest.approx(math.pi / 0.16, rel=1e-7)
    system = loop.pi().at(lam=0.01, T_i=0.07, tau=0.08, ell=1, ell_hat=1, k_ff=0)
    assert system.poles(2)[0].real > 0


# The diagrams ------------------------------------------------------------------------------------
@pytest.mark.parametrize(("name", "placement"), RAMP_ERROR)
def test_every_variant_is_made_once_and_draws_itself(name, placement):
    diagram = variant(name, placement)
    assert variant(name, placement) is diagram
    assert diagram.inputs == ("S_ref",)
    assert diagram.outputs[0] == "S"
    assert "S_meas" in diagram.signals
    assert diagram._repr_svg_().startswith("<svg")


def test_the_modelled_latency_goes_by_its_keyword():
    assert loop.smith().parameters["tau_hat"] == tau_hat
    assert vs.figure1.parameters.keys() == {"ell", "ell_hat", "k_ff", "lam", "tau"}


# Bad input ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("make", [loop.preview, loop.pi])
def test_an_unknown_placement_names_the_nearest(make):
    with pytest.raises(InputError, match=r"'aligend'.*did you mean 'aligned'"):
        make("aligend")


@pytest.mark.parametrize("signal", [vs.Pulse(1.0), 3.0, "ramp", None])
def test_a_signal_without_a_steady_error_is_refused(signal):
    with pytest.raises(InputError, match="no steady error; give a Step, Ramp, Parabola, Sine or"):
        loop.steady_error(loop.pi(), signal)


@pytest.mark.parametrize(
    "values",
    [{"lam": -1}, {"tau": -0.1}, {"tau_hat": math.nan}, {"k_ff": "1"}, {"kappa": 0}, {"lam": True}],
    ids=str,
)
def test_values_that_cannot_be_are_refused(values):
    with pytest.raises(InputError, match=rf"{next(iter(values))}.*give"):
        loop.steady_error(loop.smith(), vs.Ramp(1.0), **values)


def test_unknown_names_are_refused():
    with pytest.raises(InputError, match=r"'tau_hut' \(did you mean 'tau_hat'\?\)"):
        loop.steady_error(loop.smith(), vs.Ramp(1.0), tau_hut=0.1)
    with pytest.raises(InputError, match=r"no signal 'S_mes'"):
        loop.steady_error(loop.smith(), vs.Ramp(1.0), output="S_mes")


@pytest.mark.parametrize("bad", [-0.1, math.nan, math.inf, "0.08", True, None])
def test_limits_refuse_what_is_no_delay_or_time(bad):
    for ask in (
        lambda: loop.smith_gain_limit(bad, 0.08),
        lambda: loop.smith_gain_limit(0.08, bad),
        lambda: loop.smith_gain_limit(0.08, 0.07, bad),
        lambda: loop.pi_gain_limit(bad, 1.0),
        lambda: loop.pi_gain_limit(0.08, bad),
        lambda: loop.pi_gain_limit(0.08, 1.0, bad),
    ):
        with pytest.raises(InputError, match="give"):
            ask()


def test_an_error_that_cancels_exactly_does_not_stall_the_engine():
    """S follows the ramp h late without any error: the delayed signals are nothing but rounding."""
    system = loop.previewed_feedforward().at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1, h=0.08)
    t = np.linspace(0.0, 10.0, 101)
    S = system["S_ref", "S"].response(vs.Ramp(1.0), t).y.ravel()
    np.testing.assert_allclose(S, np.maximum(t - 0.08, 0.0), atol=1e-13)
