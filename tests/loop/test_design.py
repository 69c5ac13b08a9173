"""Every designed gain is verified by the exact-delay engine, which knows none of the formulas."""

import math

import effort
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import lambertw

import vsctrl as vs
from vsctrl import loop
from vsctrl.errors import InputError
from vsctrl.loop import criteria, design
from vsctrl.symbols import kappa, lam, tau

LATE = st.floats(0.005, 2.0)
RATIO = st.floats(0.5, 2.0)
PROPERTY = settings(max_examples=effort.share(25), deadline=None, derandomize=True)


def closed(gain, late, ratio=1.0):
    return vs.figure1.at(lam=gain, tau=late, ell=ratio, ell_hat=1.0, k_ff=0.0)


def margins(gain, late, ratio=1.0):
    return closed(gain, late, ratio).open("S_meas").margins()


# Against published and typed-in values -----------------------------------------------------------
@pytest.mark.parametrize(
    ("peak", "product"), [(1.2, 0.2055), (1.4, 0.3727), (1.6, 0.5057), (2.0, 0.7012)]
)
def test_the_published_pairs_of_peak_sensitivity_and_gain(peak, product):
    assert round(loop.gain_for(peak_sensitivity=peak, tau=1.0), 4) == product
    assert loop.gain_for(peak_sensitivity=peak, tau=0.08) * 0.08 == pytest.approx(product, abs=5e-5)


def test_the_derived_forms_are_those_of_the_theory():
    u, x, zeta = criteria.u, criteria.x, criteria.zeta
    gain, peak = criteria.sensitivity_peak()
    assert sp.simplify(gain - (u * sp.sin(u) - u**2 * sp.cos(u))) == 0
    assert sp.simplify(peak - 1 / (sp.cos(u) * sp.sqrt(1 + u**2))) == 0
    theta = sp.acos(zeta)
    expected = theta * sp.exp(-theta * sp.cot(theta)) / sp.sin(theta)
    assert sp.simplify(criteria.dominant_damping() - expected) == 0
    K = kappa * lam * tau
    error = tau * sp.cos(K) / (2 * K * (1 - sp.sin(K))) - tau
    difference = sp.lambdify((kappa, lam, tau), error - loop.squared_error())
    for point in [(1.0, 2.5, 0.08), (0.5, 1.0, 2.0), (1.7, 3.0, 0.3)]:
        assert difference(*point) == pytest.approx(0, abs=1e-13)
    assert sp.simplify(x - sp.Symbol("x", positive=True)) == 0


def test_the_margins_are_closed_forms():
    assert loop.gain_for(tau=0.08, phase_margin=math.pi / 3) == pytest.approx(math.pi / 6 / 0.08)
    assert loop.gain_for(tau=0.08, gain_margin=2) == pytest.approx(math.pi / 4 / 0.08)
    assert loop.gain_for(tau=0.08, gain_margin=2, kappa=4) == pytest.approx(math.pi / 16 / 0.08)


# Against the exact engine ------------------------------------------------------------------------
@PROPERTY
@given(peak=st.floats(1.001, 20.0), late=LATE, ratio=RATIO)
def test_the_loop_has_the_peak_sensitivity_that_was_asked_for(peak, late, ratio):
    gain = loop.gain_for(tau=late, kappa=ratio, peak_sensitivity=peak)
    found = margins(gain, late, ratio)
    assert found.stable
    assert found.peak_sensitivity == pytest.approx(peak, rel=1e-9)


@PROPERTY
@given(angle=st.floats(0.01, 1.55), late=LATE, ratio=RATIO)
def test_the_loop_has_the_phase_margin_that_was_asked_for(angle, late, ratio):
    found = margins(loop.gain_for(tau=late, kappa=ratio, phase_margin=angle), late, ratio)
    assert found.stable
    assert found.phase == pytest.approx(angle, abs=1e-9)


@PROPERTY
@given(factor=st.floats(1.01, 50.0), late=LATE, ratio=RATIO)
def test_the_loop_has_the_gain_margin_that_was_asked_for(factor, late, ratio):
    found = margins(loop.gain_for(tau=late, kappa=ratio, gain_margin=factor), late, ratio)
    assert found.stable
    assert found.gain == pytest.approx(factor, rel=1e-9)


@PROPERTY
@given(zeta=st.floats(0.01, 0.99), late=LATE, ratio=RATIO)
def test_the_dominant_pair_has_the_damping_that_was_asked_for(zeta, late, ratio):
    gain = loop.gain_for(tau=late, kappa=ratio, damping=zeta)
    pole = closed(gain, late, ratio).poles(2)[0]
    assert pole.imag != 0
    assert -pole.real / abs(pole) == pytest.approx(zeta, abs=1e-9)


def test_full_damping_is_the_fastest_gain_without_oscillation():
    assert loop.gain_for(tau=0.08, damping=1) == pytest.approx(loop.fastest_gain(0.08), rel=1e-15)
    near = loop.gain_for(tau=0.08, damping=1 - 1e-9)
    assert near == pytest.approx(loop.fastest_gain(0.08), rel=1e-8)


@pytest.mark.parametrize(
    "overshoot", [1e-8, 1e-4, 0.01, 0.05, 0.2, 0.45, 0.5, 0.7, 1.0, 1.03, 1.06, 1.073]
)
@pytest.mark.parametrize(("late", "ratio"), [(0.08, 1.0), (1.3, 0.6)])
def test_the_step_response_has_the_overshoot_that_was_asked_for(overshoot, late, ratio):
    gain = loop.gain_for(tau=late, kappa=ratio, overshoot=overshoot)
    channel = closed(gain, late, ratio)["S_ref", "S"]
    t = late * np.linspace(0, 40, 4001)
    top = t[np.argmax(channel.response(vs.Step(1.0), t).y.ravel())]
    fine = top + late * np.linspace(-0.01, 0.01, 2001)
    found = channel.response(vs.Step(1.0), fine).y.max() - 1
    # The grid is 1e-5 τ, on a parabola that bends by x² per τ².
    assert found == pytest.approx(overshoot, abs=1e-10)


@pytest.mark.parametrize("product", [1.0, 1.1, 1.37, 1.5])
def test_the_overshoot_is_the_gain_less_one_half(product):
    assert design.overshoot_of(product) == pytest.approx(product - 0.5, abs=1e-12)


def test_no_overshoot_is_the_double_pole_and_no_more():
    gain = loop.gain_for(tau=0.08, overshoot=0)
    assert gain == pytest.approx(1 / (math.e * 0.08), rel=1e-14)
    t = np.linspace(0, 3.2, 3001)
    assert closed(gain, 0.08)["S_ref", "S"].response(vs.Step(1.0), t).y.max() <= 1 + 1e-12
    assert design.overshoot_of(0.3) == 0


def test_the_overshoot_at_the_stability_limit_is_that_of_the_residue():
    assert criteria.largest_overshoot() == pytest.approx(2 / math.hypot(1, math.pi / 2), rel=1e-15)
    gain = loop.gain_for(tau=1.0, overshoot=criteria.largest_overshoot() * (1 - 1e-14))
    assert gain == pytest.approx(math.pi / 2, rel=1e-5)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("peak_sensitivity", [1.05, 1.4, 3.0, 100.0, 1e12]),
        ("phase_margin", [1.5, 1.0, 0.1]),
        ("gain_margin", [20, 3, 1.1]),
        ("damping", [1, 0.9, 0.5, 0.05]),
        ("overshoot", [0, 1e-6, 0.1, 0.49, 0.51, 0.99, 1.01, 1.05, 1.07]),
    ],
)
def test_asking_for_less_allows_a_larger_gain_below_the_limit(name, values):
    gains = [loop.gain_for(tau=0.08, **{name: value}) for value in values]
    assert gains == sorted(set(gains))
    assert gains[-1] <= loop.gain_limit(0.08)


# The integral of squares -------------------------------------------------------------------------
@pytest.mark.parametrize(("product", "late"), [(0.2, 0.08), (0.739, 1.0), (1.2, 0.5)])
def test_the_error_integral_is_that_of_the_exact_response(product, late):
    gain = product / late
    rate = -float(np.max(lambertw(-product, np.arange(-3, 3)).real)) / late
    nodes, weights = np.polynomial.legendre.leggauss(12)
    edges = np.arange(0, 16 / rate + late, late / 2)  # the kinks are at multiples of τ
    t = (edges[:-1, None] + late / 4 * (1 + nodes)).ravel()
    error = closed(gain, late)["S_ref", "S"].response(vs.Step(1.0), t).y.ravel() - 1
    integral = float((np.tile(weights, len(edges) - 1) * late / 4) @ error**2)
    assert loop.squared_error(gain, late, 1.0) == pytest.approx(integral, rel=1e-11)


def test_the_error_integral_by_parseval():
    def density(w):
        late = np.exp(-1j * w)
        return abs((0.7 - 0.7 * late - 1j * w) / (1j * w + 0.7 * late) / (1j * w)) ** 2 / math.pi

    pieces = [quad(density, a, b, limit=400)[0] for a, b in [(1e-9, 10), (10, 200), (200, 5000)]]
    # Beyond, the density is close to 1/(πω²).
    found = sum(pieces) + 1 / (math.pi * 5000)
    assert loop.squared_error(0.7, 1.0, 1.0) == pytest.approx(found, rel=1e-6)


def test_the_least_error_gain_is_where_the_cosine_meets_its_angle():
    gain = loop.least_error_gain(0.08, kappa=2.0)
    assert math.cos(gain * 0.16) == pytest.approx(gain * 0.16, abs=1e-14)
    least = loop.squared_error(gain, 0.08, 2.0)
    for factor in (0.5, 0.99, 1.01, 1.5):
        assert loop.squared_error(gain * factor, 0.08, 2.0) > least


def test_an_unstable_loop_has_no_error_integral():
    with pytest.raises(InputError, match=r"κλτ = 1.6 is not stable.*gain_limit"):
        loop.squared_error(1.6, 1.0, 1.0)


# Bad input ---------------------------------------------------------------------------------------
def test_exactly_one_criterion_that_exists():
    with pytest.raises(InputError, match=r"no criterion given; give exactly one of peak_sens"):
        loop.gain_for(tau=0.08)
    with pytest.raises(InputError, match=r"damping, overshoot given; give exactly one"):
        loop.gain_for(tau=0.08, damping=0.7, overshoot=0.1)
    with pytest.raises(InputError, match=r"'dampng' \(did you mean 'damping'\?\)"):
        loop.gain_for(tau=0.08, dampng=0.7)


@pytest.mark.parametrize(
    "asked",
    [
        {"peak_sensitivity": 1.0},
        {"peak_sensitivity": 0.5},
        {"phase_margin": 0},
        {"phase_margin": math.pi / 2},
        {"phase_margin": 60},
        {"gain_margin": 1},
        {"gain_margin": -2},
        {"damping": 0},
        {"damping": 1.01},
        {"overshoot": -0.1},
        {"overshoot": 1.0741},
        *(
            {name: bad}
            for name in design._CRITERIA
            for bad in (math.nan, math.inf, "1", True, None)
        ),
    ],
    ids=str,
)
def test_a_value_that_cannot_be_is_refused(asked):
    name = next(iter(asked))
    with pytest.raises(InputError, match=rf"^gain_for: {name} = .*give"):
        loop.gain_for(tau=0.08, **asked)


@pytest.mark.parametrize("bad", [-0.08, 0, math.nan, math.inf, "0.08", True, None])
def test_a_latency_that_limits_nothing_or_is_none_is_refused(bad):
    with pytest.raises(InputError, match=r"gain_for: tau.*give"):
        loop.gain_for(tau=bad, damping=0.7)
    with pytest.raises(InputError, match=r"least_error_gain: tau.*give"):
        loop.least_error_gain(bad)
    with pytest.raises(InputError, match=r"kappa.*give"):
        loop.gain_for(tau=0.08, damping=0.7, kappa=-1)
