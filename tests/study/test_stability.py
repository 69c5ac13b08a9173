"""Margins, limits and what Padé makes of them, against theory.md section 3 and own root finding."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.signal import TransferFunction, step
from scipy.special import lambertw

from vsctrl import paper
from vsctrl.errors import InputError, LimitError
from vsctrl.loop.summary import summarise
from vsctrl.study.plot_data import curves
from vsctrl.study.stability import stability

SPEED, TAU = 0.04, 0.08


def peak(x: float) -> float:
    """Ms of e^{−s}x/s: x = u sin u − u² cos u, Ms = 1/(cos u √(1 + u²))."""
    u = brentq(lambda u: u * math.sin(u) - u * u * math.cos(u) - x, 1e-9, math.pi / 2 - 1e-12)
    return 1 / (math.cos(u) * math.sqrt(1 + u * u))


def pade_denominator(order: int) -> np.ndarray:
    """Σ (2n − k)! n!/((2n)! k! (n − k)!) (sτ)^k at τ = 1, highest power first."""
    f = math.factorial
    return np.array(
        [
            f(2 * order - k) * f(order) / (f(2 * order) * f(k) * f(order - k))
            for k in range(order, -1, -1)
        ]
    )


def pade_limit(order: int) -> float:
    """The x at which x P(ju)/(ju) = −1: −2 arg D(ju) = −π/2 where |P| = 1, so x = u."""
    den = pade_denominator(order)
    return brentq(lambda u: 2 * np.angle(np.polyval(den, 1j * u)) - math.pi / 2, 0.5, 2.05)


def step_exact(t: np.ndarray, gain: float, late: float) -> np.ndarray:
    """Σ_{k≥1} (−1)^{k+1} λ^k (t − (k−1)τ)₊^k/k!"""
    out = np.zeros_like(t)
    for k in range(1, int(t[-1] / late) + 2):
        out += (
            (-1) ** (k + 1) * np.maximum(gain * (t - (k - 1) * late), 0.0) ** k / math.factorial(k)
        )
    return out


@pytest.fixture(scope="module")
def slide():
    return stability(paper.sliding())


# Margins ---------------------------------------------------------------------------------------
@pytest.mark.parametrize(("lam", "ratio"), [(2.5, 1.0), (5.0, 1.0), (12.0, 1.2)])
def test_margins_are_the_closed_forms(lam, ratio):
    found = stability(paper.sliding(lam=lam).with_(depth_ratio=ratio))
    x = ratio * lam * TAU
    margins = found.margins
    assert margins.stable and found.is_stable and margins.unstable_roots == 0
    assert margins.gain == pytest.approx(math.pi / (2 * x), rel=1e-10)
    assert margins.phase == pytest.approx(math.pi / 2 - x, rel=1e-10)
    assert margins.delay == pytest.approx(math.pi / (2 * ratio * lam) - TAU, rel=1e-10)
    assert margins.peak_sensitivity == pytest.approx(peak(x), rel=1e-9)


@pytest.mark.parametrize(("Ms", "x"), [(1.2, 0.2055), (1.4, 0.3727), (1.6, 0.5057), (2.0, 0.7012)])
def test_the_sensitivity_peaks_of_the_theory_page(Ms, x):
    assert peak(x) == pytest.approx(Ms, abs=3e-4)
    assert summarise(x / TAU, TAU).peak_sensitivity == pytest.approx(Ms, abs=3e-4)


def test_python_control_is_a_second_opinion(slide):
    second, exact = slide.second_opinion, slide.margins
    assert second.order >= 8
    assert second.gain == pytest.approx(exact.gain, rel=1e-6)
    assert second.phase == pytest.approx(exact.phase, rel=1e-6)
    assert second.delay == pytest.approx(exact.delay, rel=1e-6)


def test_limits_of_the_slide(slide):
    limits = slide.limits
    assert limits.continuous == pytest.approx(math.pi / 0.16, rel=1e-14)
    assert limits.sampled == pytest.approx(50 * math.sin(math.pi / 10), rel=1e-14)
    assert limits.fastest_continuous == pytest.approx(12.5 / math.e, rel=1e-14)
    assert limits.fastest_sampled == pytest.approx(100 / 27, rel=1e-14)
    assert slide.nulling_feedforward == pytest.approx(0.8, rel=1e-14)


def test_limits_with_a_depth_error():
    limits = stability(paper.sliding().with_(depth_ratio=2.0)).limits
    assert limits.continuous == pytest.approx(math.pi / 0.32, rel=1e-14)
    assert limits.sampled == pytest.approx(25 * math.sin(math.pi / 10), rel=1e-14)


@pytest.mark.parametrize(
    ("lam", "continuous", "sampled"),
    [(15.4, True, True), (15.5, True, False), (19.6, True, False), (19.7, False, False)],
)
def test_stable_means_continuous_and_as_sampled(lam, continuous, sampled):
    found = stability(paper.sliding(lam=lam))
    assert found.margins.stable is continuous
    assert found.is_stable is sampled
    # … which is what the roots say.
    assert (lambertw(-lam * TAU, np.arange(-4, 4)).real.max() < 0) == continuous
    assert (np.abs(np.roots([1, -1, 0, lam * 0.04])).max() < 1) == sampled


def test_an_unstable_loop_says_how_far_it_is_over():
    found = stability(paper.sliding(lam=25.0))
    assert not found.margins.stable and found.margins.unstable_roots == 2
    assert found.margins.gain_down == pytest.approx(math.pi / (2 * 25 * TAU), rel=1e-9)
    assert found.margins.phase == pytest.approx(math.pi / 2 - 2.0, rel=1e-9)
    # Its responses are shown at a gain that has some.
    assert found.stable_gain.values["lam"] == pytest.approx(math.pi / 0.32, rel=1e-12)


def test_without_latency_only_sampling_limits_the_gain():
    found = stability(paper.sliding(latency=0.0))
    assert found.limits.continuous == found.limits.fastest_continuous == math.inf
    assert found.limits.sampled == pytest.approx(50.0)
    assert found.limits.fastest_sampled == pytest.approx(25.0)
    assert found.margins.gain == math.inf and found.pade == ()
    assert found.margins.phase == pytest.approx(math.pi / 2)
    assert found.nulling_feedforward == pytest.approx(1.0)
    assert curves(found).locus is None


def test_a_latency_between_frames_has_limits_between_those_of_frames():
    """The root of z³ − z² + κλTₛ(0.75 z + 0.25) on the circle, for 1.25 frames."""
    found = stability(paper.sliding(latency=0.05)).limits.sampled
    roots = np.roots([1, -1, found * 0.04 * 0.75, found * 0.04 * 0.25])
    assert np.abs(roots).max() == pytest.approx(1, abs=1e-12)
    assert 2 * math.sin(math.pi / 10) / 0.04 < found < 1 / 0.04


# Readings of λ ---------------------------------------------------------------------------------
def test_the_readings_of_the_paper_s_gain(slide):
    assert [r.lam for r in slide.readings] == pytest.approx([2.5, 5.0, 0.1], rel=1e-12)
    for r in slide.readings:
        assert r.per_sample == pytest.approx(0.04 * r.lam, rel=1e-12)
        assert r.margins.gain == pytest.approx(math.pi / (2 * r.lam * TAU), rel=1e-9)
        assert r.margins.phase == pytest.approx(math.pi / 2 - r.lam * TAU, rel=1e-9)
        assert r.share_of_continuous == pytest.approx(r.lam * 0.16 / math.pi, rel=1e-12)
        assert r.share_of_sampled == pytest.approx(r.lam / (50 * math.sin(math.pi / 10)), rel=1e-12)
        assert r.lag == pytest.approx(SPEED * (TAU - 1 / r.lam), rel=1e-12)
        assert r.settling == pytest.approx(3 / r.lam, rel=1e-12)
    assert "second" in slide.readings[-1].label and "sample" in slide.readings[0].label


def test_a_reading_that_is_unstable_has_no_lag():
    found = stability(paper.sliding(lam=17.0))  # over the sampled limit only
    own = next(r for r in found.readings if r.lam == 17.0)
    assert own.lag is None and own.share_of_sampled > 1 > own.share_of_continuous
    assert all(r.lag is not None for r in found.readings if r.lam < 15)


# Padé ------------------------------------------------------------------------------------------
def test_the_gain_limits_of_the_pade_models(slide):
    assert [row.order for row in slide.pade] == [1, 2, 4]
    for row in slide.pade:
        assert row.gain_limit == pytest.approx(pade_limit(row.order) / TAU, rel=1e-8)
        assert row.gain_limit_error == pytest.approx(
            pade_limit(row.order) * 2 / math.pi - 1, rel=1e-4
        )
    one, two, four = (row.gain_limit for row in slide.pade)
    assert one == pytest.approx(25.0, abs=1e-9)
    assert two == pytest.approx(19.782, abs=5e-4)
    assert four == pytest.approx(19.63498, abs=5e-6)


def test_the_step_errors_of_the_pade_models(slide):
    t = np.linspace(0.0, 20 * TAU, 801)
    exact = step_exact(t, 2.5, TAU)
    for row in slide.pade:
        den = pade_denominator(row.order) * TAU ** np.arange(row.order, -1, -1)
        num = den * (-1.0) ** np.arange(row.order, -1, -1)
        # S/S* = λ D/(s D + λ N) of u = λ (S* − P S), S' = u.
        below = np.polyadd(np.append(den, 0.0), 2.5 * num)
        shown = step(TransferFunction(2.5 * den, below), T=t)[1]
        assert row.step_error == pytest.approx(np.abs(shown - exact).max(), rel=1e-4)
    assert all(a.step_error > b.step_error > 1e-5 for a, b in pairwise(slide.pade))
    assert slide.pade[0].step_error == pytest.approx(3e-3, rel=0.3)  # theory.md section 3


# Curves ----------------------------------------------------------------------------------------
def test_the_curves_of_the_slide(slide):
    found = curves(slide)
    omega = found.frequency.omega
    exact = 2.5 * np.exp(-1j * omega * TAU) / (1j * omega)
    np.testing.assert_allclose(found.frequency.exact, exact, rtol=1e-11)
    for order, values in found.frequency.pade.items():
        low = omega < 2.0
        den = np.polyval(pade_denominator(order), 1j * omega * TAU)
        np.testing.assert_allclose(values, 2.5 / (1j * omega) * den.conj() / den, rtol=1e-8)
        np.testing.assert_allclose(values[low], exact[low], rtol=1e-3)
    assert omega[0] < 2.5 < 19.635 < omega[-1]

    times = found.times
    early = times.t < 1.6
    np.testing.assert_allclose(
        times.step[early], step_exact(times.t[early], 2.5, TAU), rtol=0, atol=1e-10
    )
    assert times.slope == pytest.approx(SPEED) and times.lam == 2.5
    assert times.steady == pytest.approx({False: -0.0128, True: 0.0032}, abs=1e-12)
    for on in (False, True):
        assert times.ramp[on][-1] == pytest.approx(times.steady[on], abs=2e-5)
        assert times.ramp_pade[on][-1] == pytest.approx(times.steady[on], abs=2e-5)
    late = times.t < TAU  # nothing has been seen yet: feedback acts on S* alone
    with_ = SPEED * times.t[late] + 2.5 * SPEED * times.t[late] ** 2 / 2
    np.testing.assert_allclose(times.ramp[True][late], with_ - SPEED * times.t[late], atol=1e-12)

    locus = found.locus
    for gain, roots in zip(locus.gains, locus.exact, strict=True):
        known = lambertw(-gain * TAU, np.arange(-6, 6)) / TAU
        away = np.abs(roots[:, None] - known[None, :]).min(axis=1)
        # Near the double root the distance is the square root of the rounding.
        assert away.max() < (1e-6 if abs(gain * TAU - 1 / math.e) > 0.01 else 1e-3)
        assert roots.real.max() == pytest.approx(known.real.max(), abs=1e-3)


# The summary of the command line ---------------------------------------------------------------
def test_the_summary_is_the_closed_forms():
    found = summarise(5.0, 0.08, period=0.04, kappa=1.2, k_ff=1.0)
    x = 5.0 * 1.2 * 0.08
    assert found.stable and found.stable_as_sampled and found.unstable_roots == 0
    assert found.gain_margin == pytest.approx(math.pi / (2 * x), rel=1e-9)
    assert found.phase_margin_rad == pytest.approx(math.pi / 2 - x, rel=1e-9)
    assert found.delay_margin_s == pytest.approx(math.pi / 12 - 0.08, rel=1e-9)
    assert found.peak_sensitivity == pytest.approx(peak(x), rel=1e-9)
    assert found.limit_continuous == pytest.approx(math.pi / (2 * 1.2 * 0.08), rel=1e-12)
    assert found.limit_sampled == pytest.approx(50 * math.sin(math.pi / 10) / 1.2, rel=1e-12)
    roots = np.array([complex(*root) for root in found.roots])
    known = lambertw(-x, np.arange(-4, 4)) / 0.08
    assert np.abs(roots[:, None] - known).min(axis=1).max() < 1e-8
    historic = 0.2 / 6.0  # −(1 − κ)/(κλ)
    assert found.error_per_speed == pytest.approx(
        {"measurement": historic + 0.08, "aligned": historic, "actuator": historic}, rel=1e-12
    )


def test_a_summary_where_nothing_limits_has_null_and_no_infinity():
    found = summarise(2.5, 0.0)
    assert (found.limit_continuous, found.fastest_continuous, found.gain_margin) == (None,) * 3
    assert found.limit_sampled is None and found.stable_as_sampled is None
    text = json.dumps(found.data())
    assert "Infinity" not in text and "NaN" not in text
    assert json.loads(text)["phase_margin_rad"] == pytest.approx(math.pi / 2)
    assert "∞" in str(found) and "inf" not in str(found)


def test_a_loop_that_shakes_as_sampled_has_no_ramp_error_to_print():
    assert summarise(25.0, 0.08).error_per_speed["measurement"] is None
    held = summarise(17.0, 0.08, period=0.04)
    assert held.stable and held.stable_as_sampled is False


@pytest.mark.parametrize("lam", [100.0, 300.0])
def test_a_gain_far_over_the_limit_counts_every_unstable_root(lam):
    right = int((lambertw(-lam * TAU, np.arange(-200, 200)).real > 0).sum())
    assert summarise(lam, TAU).unstable_roots == right


def test_an_absurd_gain_is_never_called_stable():
    try:
        found = summarise(1e8, TAU)
    except (InputError, LimitError):
        return
    assert not found.stable


def test_a_tiny_gain_is_stable():
    assert summarise(1e-6, 0.08).stable
