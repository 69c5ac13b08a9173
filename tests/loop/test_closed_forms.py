"""Every closed form of figure 1: proved with SymPy, or verified to 30 digits with mpmath.

The formulas that are expected are typed in from the theory page; where they are solutions of an
equation, they are put into that equation, which is typed in too.
"""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from oracles.steps import DIGITS, error, extremes, pieces, squared

import vsctrl as vs
from vsctrl import loop
from vsctrl.errors import InputError
from vsctrl.loop import criteria
from vsctrl.loop.criteria import u, x, zeta
from vsctrl.loop.limits import sampled_characteristic
from vsctrl.symbols import T_s, d, k_ff, kappa, lam, omega, s, t, tau
from vsctrl.symbols import z_plane as z

PLACEMENTS = ("measurement", "aligned", "actuator")
L = kappa * lam * sp.exp(-tau * s) / s  # of figure 1 opened at its measurement
TINY = mp.mpf(10) ** -30
POINTS = [("2.5", "0.08", "1"), ("0.7", "0.3", "1.3"), ("19", "0.08", "0.8"), ("4", "1.5", "0.4")]


def number(expr, at=None):
    """A SymPy expression to 40 digits."""
    return mp.mpmathify(sp.N(expr.subs(at or {}), 40))


def put(gain, late, ratio):
    return {lam: sp.Rational(gain), tau: sp.Rational(late), kappa: sp.Rational(ratio)}


# Poles -----------------------------------------------------------------------------------------
def test_each_branch_of_lambert_s_w_is_a_root_of_the_characteristic_equation():
    """With W e^W = −κλτ, s + κλ e^{−τs} = 0 at s = W/τ."""
    W = sp.Symbol("W")
    root = loop.pole(3).replace(sp.LambertW, lambda a, k: W)
    gain = -W * sp.exp(W) / (kappa * tau)
    assert sp.simplify((s + kappa * lam * sp.exp(-tau * s)).subs(s, root).subs(lam, gain)) == 0
    assert loop.pole() == sp.LambertW(-kappa * lam * tau) / tau
    assert loop.pole(-1) == sp.LambertW(-kappa * lam * tau, -1) / tau


@pytest.mark.parametrize("point", POINTS)
def test_the_poles_to_30_digits_and_the_dominant_pair_first(point):
    with mp.workdps(DIGITS):
        gain, late, ratio = map(mp.mpf, point)
        roots = [number(loop.pole(k), put(*point)) for k in range(-4, 4)]
        for root in roots:
            assert abs(root + ratio * gain * mp.exp(-late * root)) < TINY * (1 + abs(root) ** 2)
        dominant = max(roots, key=lambda root: root.real)
        assert dominant.real == max(roots[3].real, roots[4].real)
    system = vs.figure1.at(
        lam=float(point[0]), tau=float(point[1]), ell=float(point[2]), ell_hat=1, k_ff=0
    )
    both = sorted((complex(r) for r in roots), key=lambda r: (-round(r.real, 8), r.imag))
    np.testing.assert_allclose(
        sorted(system.poles(4), key=lambda r: (-round(r.real, 8), r.imag)), both[:4], rtol=1e-9
    )


# Limits and margins ----------------------------------------------------------------------------
def test_the_limit_the_double_root_and_the_margins_solve_their_equations():
    characteristic = s + kappa * lam * sp.exp(-tau * s)
    at_limit = {lam: loop.gain_limit(), s: sp.I * sp.pi / (2 * tau)}
    assert sp.simplify(characteristic.subs(at_limit)) == 0
    double = {lam: loop.fastest_gain(), s: -1 / tau}
    assert sp.simplify(characteristic.subs(double)) == 0
    assert sp.simplify(sp.diff(characteristic, s).subs(double)) == 0


def test_the_margins_are_those_of_the_open_loop():
    found = criteria.margins()
    assert sp.simplify(found["gain_margin"] - sp.pi / (2 * x)) == 0
    assert sp.simplify(found["phase_margin"] - (sp.pi / 2 - x)) == 0
    assert sp.simplify(found["delay_margin"] - (sp.pi / (2 * x) - 1)) == 0
    at = {lam: x / (kappa * tau)}
    turned = {s: sp.I * sp.pi / (2 * tau)}  # where L is real and negative
    assert sp.simplify(L.subs(turned).subs(at) + 1 / found["gain_margin"]) == 0
    crossing = {s: sp.I * kappa * lam}  # where |L| = 1
    phase = sp.exp(sp.I * (found["phase_margin"] - sp.pi))
    assert sp.simplify(L.subs(crossing).subs(at) - phase) == 0
    # More delay by that margin, times τ, makes L = −1 there.
    later = {tau: tau * (1 + found["delay_margin"].subs(x, kappa * lam * tau))}
    assert sp.simplify(L.subs(crossing).subs(later)) == -1


@pytest.mark.parametrize("gain", [0.5, 2.5, 12.0])
def test_the_margins_are_those_of_the_engine(gain):
    system = vs.figure1.at(lam=gain, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    margins = system.open("S_meas").margins()
    found = {name: float(m.subs(x, gain * 0.08)) for name, m in criteria.margins().items()}
    assert margins.gain == pytest.approx(found["gain_margin"], rel=1e-10)
    assert margins.phase == pytest.approx(found["phase_margin"], rel=1e-10)
    assert margins.delay == pytest.approx(0.08 * found["delay_margin"], rel=1e-10)


# Sensitivity and damping -----------------------------------------------------------------------
@pytest.mark.parametrize("at", ["0.1", "0.4", "0.6", "0.9", "1.2", "1.5"])
def test_the_sensitivity_peak_is_the_least_distance_to_minus_one(at):
    gain, peak = criteria.sensitivity_peak()
    assert sp.simplify(gain - (u * sp.sin(u) - u**2 * sp.cos(u))) == 0
    assert sp.simplify(peak - 1 / (sp.cos(u) * sp.sqrt(1 + u**2))) == 0
    with mp.workdps(DIGITS):
        where = mp.mpf(at)
        X = where * mp.sin(where) - where**2 * mp.cos(where)

        def size(w):
            return 1 / abs(1 + X * mp.exp(-1j * w) / (1j * w))

        assert abs(mp.diff(size, where)) < TINY
        assert abs(size(where) * mp.cos(where) * mp.sqrt(1 + where**2) - 1) < TINY
        assert size(where) >= max(size(mp.mpf(k) / 50) for k in range(1, 1000)) - TINY


@pytest.mark.parametrize(
    ("peak", "gain"), [(1.2, 0.2055), (1.4, 0.3727), (1.6, 0.5057), (2.0, 0.7012)]
)
def test_the_sensitivity_peaks_of_the_theory_page(peak, gain):
    assert loop.gain_for(peak_sensitivity=peak, tau=1.0) == pytest.approx(gain, abs=5e-5)


@pytest.mark.parametrize("damping", ["0.1", "0.5", "0.7", "0.99"])
def test_the_gain_of_a_damping_ratio_has_a_dominant_pair_of_that_ratio(damping):
    with mp.workdps(DIGITS):
        gain = number(criteria.dominant_damping(), {zeta: sp.Rational(damping)})
        root = mp.lambertw(-gain, 0)
        assert abs(-root.real / abs(root) - mp.mpf(damping)) < TINY


# Step response ---------------------------------------------------------------------------------
def test_the_step_series_solves_the_delay_equation_on_every_piece():
    """S′(t) = κλ(1 − S(t − τ)), with S = 0 before 0."""
    whole = loop.step_response(5).subs(k_ff, 0)
    expected = sum(
        (-1) ** (k + 1) * (kappa * lam) ** k * sp.Max(0, t - (k - 1) * tau) ** k / sp.factorial(k)
        for k in range(1, 6)
    ).subs(sp.Max(0, t), t)
    assert sp.simplify(whole - expected) == 0
    for n in range(1, 6):  # on [(n − 1)τ, nτ], where the first n terms count

        def on(n):
            return loop.step_response(n).subs(k_ff, 0).replace(sp.Max, lambda *a: sp.Add(*a))

        before = on(n - 1).subs(t, t - tau) if n > 1 else 0
        assert sp.expand(sp.diff(on(n), t) - kappa * lam * (1 - before)) == 0
        if n > 1:
            assert sp.expand((on(n) - on(n - 1)).subs(t, (n - 1) * tau)) == 0


@pytest.mark.parametrize("gain", ["0.2", "0.9", "1.5"])
def test_the_step_series_is_the_method_of_steps_to_30_digits(gain):
    series = loop.step_response(12).subs({k_ff: 0, lam: sp.Rational(gain), tau: 1, kappa: 1})
    with mp.workdps(DIGITS):
        for at in ("0.3", "1", "2.71", "7.5", "11.9"):
            exact = 1 + error(gain, mp.mpf(at))
            assert abs(number(series, {t: sp.Rational(at)}) - exact) < TINY


def test_the_step_series_with_feedforward_is_what_the_engine_computes():
    # One time after the other: the arrays that SymPy 1.13 makes of Max are ragged.
    known = {lam: 2.5, tau: 0.08, kappa: 1.2, k_ff: 0.6}
    series = np.vectorize(sp.lambdify(t, loop.step_response(8).subs(known), "math"))
    at = np.linspace(0.0, 0.64, 33)
    system = vs.figure1.at(lam=2.5, tau=0.08, ell=1.2, ell_hat=1, k_ff=0.6)
    exact = np.ravel(system["S_ref", "S"].response(vs.Step(), at + 1e-13).outputs)
    # Terms without a power of (t − kτ)₊ jump, so at a multiple of τ rounding decides the side.
    np.testing.assert_allclose(series(at + 1e-13), exact, atol=1e-12)


def test_summed_in_floats_the_series_loses_what_the_engine_keeps():
    """At t = 10 s its terms reach e^{κλt}-like sizes while their sum is 1."""
    gain, late = 2.5, 0.08
    terms, k = [], 1
    while (left := 10.0 - (k - 1) * late) > 0:
        terms.append((-1) ** (k + 1) * float(mp.mpf(gain * left) ** k / mp.factorial(k)))
        k += 1
    lost = abs(sum(terms) - 1 - float(error("0.2", mp.mpf(125) - TINY)))
    system = vs.figure1.at(lam=gain, tau=late, ell=1, ell_hat=1, k_ff=0)
    kept = float(np.ravel(system["S_ref", "S"].response(vs.Step(), [10.0]).outputs)[-1])
    assert lost > 1e-9
    assert abs(kept - 1 - float(error("0.2", mp.mpf(125) - TINY))) < 1e-13


# Overshoot -------------------------------------------------------------------------------------
def test_the_first_overshoot_is_x_less_one_half():
    assert criteria.first_overshoot() == x - sp.Rational(1, 2)


@pytest.mark.parametrize("gain", ["1", "1.2", "1.5", "1.569"])
def test_it_is_the_largest_peak_from_1_to_three_halves_and_a_little_beyond(gain):
    with mp.workdps(DIGITS):
        peaks = extremes(gain, 60)
        assert abs(peaks[0] - (mp.mpf(gain) - mp.mpf("0.5"))) < TINY
        assert max(peaks[1:]) <= peaks[0]


def test_there_is_none_up_to_one_over_e_and_a_later_one_is_larger_near_the_stability_limit():
    assert not extremes(str(mp.exp(-1) * 0.999), 60)
    with mp.workdps(DIGITS):
        assert extremes("0.5", 60)
        peaks = extremes("1.57", 60)
        assert max(peaks[1:]) > peaks[0]


def test_at_the_stability_limit_it_tends_to_twice_the_residue():
    with mp.workdps(DIGITS):
        exact = 2 / mp.sqrt(1 + mp.pi**2 / 4)
        assert abs(criteria.largest_overshoot() - exact) < 1e-15
        peaks = extremes(str(mp.pi / 2), 160)
        # The next pole pair, Re W₁(−π/2) = −1.6, is forgotten by then.
        assert abs(max(peaks[-4:]) - exact) < TINY


# Integral of squares ---------------------------------------------------------------------------
@pytest.mark.parametrize("gain", ["0.3", "0.739085", "1"])
def test_the_squared_error_is_the_integral_of_the_method_of_steps(gain):
    """The true error is the one that the law sees one τ later, less the τ before it moves."""
    with mp.workdps(DIGITS):
        X = mp.mpf(gain)
        closed = mp.cos(X) / (2 * X * (1 - mp.sin(X))) - 1
        ours = number(criteria.squared_step_error(), {x: sp.Rational(gain)})
        assert abs(ours - closed) < TINY
        n = 120  # at x = 1 the slowest pole is −0.318, and e^{−2·0.318·120} = 1e-33
        # e here is S − 1 after the step: over all times it is the true error.
        assert abs(squared(gain, n) - closed) < TINY


def test_the_squared_error_is_least_where_cos_x_is_x():
    slope = sp.simplify(sp.diff(criteria.squared_step_error(), x))
    formula = (x - sp.cos(x)) * 1 / (2 * x**2 * (1 - sp.sin(x)))
    assert sp.simplify(sp.expand_trig(slope - formula)) == 0
    assert loop.least_error_gain(1.0) == pytest.approx(
        float(mp.findroot(lambda v: mp.cos(v) - v, 0.7))
    )


# Sampled ---------------------------------------------------------------------------------------
def test_the_sampled_characteristic_and_its_limits_to_30_digits():
    p = z ** (d + 1) - z**d + kappa * lam * T_s
    assert sp.simplify(sampled_characteristic() - p) == 0
    for n in range(6):
        with mp.workdps(DIGITS):
            theta = mp.pi / (2 * n + 1)
            limit = number(loop.gain_limit(period=T_s), {d: n, kappa: 1, T_s: 1})
            root = mp.exp(1j * theta)
            assert abs(root ** (n + 1) - root**n + limit) < TINY
            if n:
                gain = number(loop.fastest_gain(period=T_s), {d: n, kappa: 1, T_s: 1})
                double = mp.mpf(n) / (n + 1)
                assert abs(double ** (n + 1) - double**n + gain) < TINY
                assert abs((n + 1) * double**n - n * double ** (n - 1)) < TINY


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_the_error_of_a_sampled_sine_in_closed_form(placement):
    shift = z**-d if placement == "aligned" else 1
    moved = kappa * T_s * (lam * shift + k_ff * sp.I * omega)
    moved *= z**-d if placement == "actuator" else 1
    expected = moved / (z - 1 + kappa * lam * T_s * z**-d) - 1
    expected = expected.subs(z, sp.exp(sp.I * omega * T_s))
    assert sp.simplify(loop.sampled_sine_error(placement) - expected) == 0


@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("samples", [0, 1, 3])
def test_it_is_what_the_recursion_settles_at(placement, samples):
    gain, period, ratio, feed, w = 2.5, 0.04, 1.2, 0.7, 1.3
    values = {lam: gain, T_s: period, kappa: ratio, k_ff: feed, omega: w, d: samples}
    closed = complex(loop.sampled_sine_error(placement).subs(values))

    def wanted(k):
        return np.exp(1j * w * k * period)

    S = [0j] * (samples + 1)  # the complex sine from long before, so that nothing is missing
    for k in range(samples, 700):
        seen = k - samples
        compared = seen if placement == "aligned" else k
        if placement == "actuator":
            twist = gain * (wanted(seen) - S[seen]) + feed * 1j * w * wanted(seen)
        else:
            twist = gain * (wanted(compared) - S[seen]) + feed * 1j * w * wanted(k)
        S.append(S[k] + ratio * period * twist)
    k = len(S) - 1
    assert S[k] / wanted(k) - 1 == pytest.approx(closed, abs=1e-12)


def test_holding_costs_half_a_period_which_the_continuous_formula_does_not_know():
    """With k_ff = 1 and no latency it predicts 0, where ω²Tₛ/(2λ) is left."""
    perfect = {kappa: 1, k_ff: 1}
    held = loop.sampled_sine_error().subs(perfect).subs(d, 0)
    assert sp.simplify(sp.limit(held / omega**2, omega, 0) - T_s / (2 * lam)) == 0
    assert loop.tracking_error(vs.Sine(omega), tau=0, kappa=1, k_ff=1) == 0
    numbers = {lam: 2.5, T_s: 0.04, d: 2, kappa: 1, omega: 1.0}
    for feed, off in ((0, 3e-2), (1, 0.4)):  # about 2 % where the error is large
        true = complex(loop.sampled_sine_error().subs(k_ff, feed).subs(numbers))
        plain = complex(loop.tracking_error(vs.Sine(1.0), lam=2.5, tau=0.08, kappa=1, k_ff=feed))
        assert 1e-3 < abs(plain - true) / abs(true) < off
        # The twist comes Tₛ/2 later in the mean: a second delay, in the actuator.
        parts = [*loop.diagram("actuator").parts]
        parts = [p for p in parts if p.output != "S_meas"]
        parts.append(vs.Block("vision", sp.exp(-2 * T_s * s), "S -> S_meas"))
        repaired = vs.Diagram(parts, inputs=["S_ref"], outputs=["S"])
        known = {"lam": 2.5, "T_s": 0.04, "tau": 0.02, "kappa": 1, "k_ff": feed}
        found = complex(loop.steady_error(repaired, vs.Sine(1.0), **known))
        assert abs(found - true) / abs(true) < 2e-3


# Complex gain ----------------------------------------------------------------------------------
@pytest.mark.parametrize("mu", [1 + 0.5j, 0.3 - 1.2j, 2.0 + 0j, 1e-3 - 1j])
def test_a_complex_gain_passes_the_axis_at_its_limit(mu):
    with mp.workdps(20):
        limit = loop.gain_limit(0.08, kappa=mu)
        turned = mp.pi / 2 - abs(mp.arg(mu))
        assert limit == pytest.approx(float(turned / (abs(mu) * 0.08)), rel=1e-13)
        root = -1j * mp.sign(mp.im(mu) or 1) * turned / 0.08
        assert abs(root + mu * limit * mp.exp(-0.08 * root)) < 1e-12 * abs(root)
    for n in range(4):  # zⁿ⁺¹ − zⁿ + μλTₛ
        sampled = loop.gain_limit(n * 0.04, period=0.04, kappa=mu)
        inside, outside = (
            np.abs(np.roots(np.polyadd([1, -1, *[0] * n], [c])))
            for c in (mu * sampled * (1 + e) * 0.04 for e in (-1e-7, 1e-7))
        )
        assert inside.max() < 1 < outside.max()


# Padé ------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("order", "printed", "digits"),
    [(1, 2, 1e-15), (2, 1.5826, 5e-5), (3, 1.57101, 5e-6), (4, 1.570798, 5e-7)],
)
def test_the_limits_that_pade_models_believe_in(order, printed, digits):
    assert float(loop.pade_gain_limit(order)) == pytest.approx(printed, abs=digits)


@pytest.mark.parametrize("order", range(1, 9))
def test_a_pade_limit_puts_a_root_on_the_axis_and_is_the_first_to_do_so(order):
    """With mpmath's own Padé approximant of e^{−s}."""
    with mp.workdps(DIGITS):
        coefficients = [(-1) ** k / mp.factorial(k) for k in range(2 * order + 1)]
        above, below = mp.pade(coefficients, order, order)
        limit = number(loop.pade_gain_limit(order))

        def loop_at(p, gain):
            return p * mp.polyval(below[::-1], p) + gain * mp.polyval(above[::-1], p)

        assert abs(loop_at(1j * limit, limit)) < TINY * 10**5  # the approximant's own rounding
        for factor, stable in (("0.999999", True), ("1.000001", False)):
            gain = limit * mp.mpf(factor)
            p = [
                gain * a + b for a, b in zip([*above, mp.mpf(0)], [mp.mpf(0), *below], strict=True)
            ]
            roots = mp.polyroots(p[::-1], maxsteps=500, extraprec=200)
            assert all(root.real < 0 for root in roots) is stable


def test_pade_limits_fall_to_that_of_the_delay():
    found = [number(loop.pade_gain_limit(n)) for n in range(1, 9)]
    assert found == sorted(found, reverse=True)
    assert 0 < found[-1] - mp.pi / 2 < 1e-14


# Bad input -------------------------------------------------------------------------------------
@pytest.mark.parametrize("bad", [0, -1, 1.5, True, "2", None, [2]])
def test_what_is_no_number_of_terms_is_refused(bad):
    with pytest.raises(InputError, match="give an integer from 1 on"):
        loop.step_response(bad)
    with pytest.raises(InputError, match="give an integer from 1 on"):
        loop.pade_gain_limit(bad)
    if bad not in (0, -1) or bad is True:
        with pytest.raises(InputError, match=r"branch = .* is none; give an integer"):
            loop.pole(bad)
    with pytest.raises(InputError, match="placement"):
        loop.sampled_sine_error(bad)


def test_the_pieces_of_the_oracle_join():
    """The oracle's own sanity: continuous, and −1 + x t at first."""
    first, second = pieces("0.5", 2)
    assert first == [-1, mp.mpf("0.5")]
    assert abs(mp.fsum(first) - second[0]) < TINY
