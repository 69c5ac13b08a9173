"""Delays between whole periods: limits against the roots of the polynomial, and against theory."""

import cmath
import math

import effort
import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete

from vsctrl import loop
from vsctrl.errors import LimitError
from vsctrl.loop import fractional_delay

between = st.floats(0.02, 6.0).filter(lambda p: 0.01 < p % 1 < 0.99)


def radius(periods, gain):
    return np.abs(np.roots(fractional_delay.characteristic(periods, gain))).max()


@given(between, st.floats(0.01, 1 - 1e-6))
@settings(max_examples=effort.share(200), deadline=None)
def test_below_the_limit_all_roots_are_inside_the_circle_and_above_it_not(periods, share):
    limit = fractional_delay.limit(periods)
    assert radius(periods, share * limit) < 1
    assert radius(periods, limit) == pytest.approx(1, abs=1e-9)
    assert radius(periods, (1 + 1e-6) * limit) > 1


@given(between)
@settings(max_examples=effort.share(100), deadline=None)
def test_above_the_double_root_the_dominant_mode_oscillates(periods):
    gain = fractional_delay.double_root(periods)
    for share, oscillates in ((1 - 1e-6, False), (1 + 1e-5, True)):
        roots = np.roots(fractional_delay.characteristic(periods, share * gain))
        dominant = roots[np.argmax(np.abs(roots))]
        assert bool(abs(dominant.imag) > 1e-6) is oscillates


@given(between, st.floats(0.05, 1.4), st.floats(0.3, 3.0))
@settings(max_examples=effort.share(100), deadline=None)
def test_a_complex_kappa_takes_its_angle_from_the_phase(periods, angle, size):
    """The polynomial with a complex gain, on either side of the limit."""
    mu = cmath.rect(size, angle)
    limit = loop.gain_limit(periods * 0.04, period=0.04, kappa=mu)
    for share, stable in ((1 - 1e-6, True), (1 + 1e-6, False)):
        roots = np.roots(
            fractional_delay.characteristic(periods, 0.0)
            + (
                fractional_delay.characteristic(periods, 1.0)
                - fractional_delay.characteristic(periods, 0.0)
            )
            * (share * limit * mu * 0.04)
        )
        assert bool(np.abs(roots).max() < 1) is stable


@pytest.mark.parametrize("d", [0, 1, 2, 3])
def test_at_whole_periods_it_meets_the_closed_form(d):
    closed = 2 * math.sin(math.pi / (2 * (2 * d + 1)))  # theory.md, section 3
    for periods in [d + 1e-9] if d == 0 else [d - 1e-9, d + 1e-9]:
        assert fractional_delay.limit(periods) == pytest.approx(closed, rel=1e-7)
        double = d**d / (d + 1) ** (d + 1)  # without delay it is left like the root of f
        assert fractional_delay.double_root(periods) == pytest.approx(
            double, rel=1e-7 if d else 1e-4
        )


def test_many_periods_are_continuous_time():
    """π/2 and 1/e of κλτ; holding adds half a period, so the difference falls as 1/(2 periods)."""
    for periods in (200.5, 2000.5):
        share = periods / (periods + 0.5)
        assert fractional_delay.limit(periods) * periods == pytest.approx(
            share * math.pi / 2, rel=1e-5
        )
        assert fractional_delay.double_root(periods) * periods == pytest.approx(
            share / math.e, rel=1e-5
        )


@pytest.mark.parametrize("periods", [0.3, 1.5, 2.25])
def test_the_equation_is_that_of_a_plant_sampled_by_scipy(periods):
    """x' = u(t − τ) with u held: (x, u of the last frames) by SciPy's exact discretisation."""
    d, f = int(periods), periods % 1
    gain = 0.4
    integrator = [cont2discrete((np.zeros((1, 1)), np.ones((1, 1)), np.eye(1), np.zeros((1, 1))), h)
                  for h in (f, 1 - f)]  # fmt: skip
    early, late = (float(parts[1][0, 0]) for parts in integrator)
    A = np.zeros((d + 2, d + 2))
    A[0, 0] = 1.0
    # At frame k the held value is −gain x_k; over the next period u_{k−d−1} acts for f, u_{k−d}
    # for the rest.
    for age, share in ((d + 1, early), (d, late)):
        A[0, age] += -gain * share
    for age in range(1, d + 2):
        A[age, age - 1] = 1.0
    roots = np.sort_complex(np.linalg.eigvals(A))
    mine = np.sort_complex(np.roots(fractional_delay.characteristic(periods, gain)))
    np.testing.assert_allclose(roots, mine, atol=1e-12)


def test_the_loop_takes_any_delay():
    assert loop.gain_limit(0.09, period=0.04) == fractional_delay.limit(2.25) / 0.04
    assert loop.gain_limit(0.09, period=0.04, kappa=2) == fractional_delay.limit(2.25) / 0.08
    assert loop.fastest_gain(0.09, period=0.04) == fractional_delay.double_root(2.25) / 0.04


def _on_the_circle(periods, gain):
    """How far the equation is from 0 where its modulus allows a root on the circle, relative.

    In fifty digits: |z − 1| = gain |(1 − f) z + f| gives sin²(θ/2), and the equation is put in.
    """
    d = math.floor(periods)
    with mpmath.workdps(50):
        f, g = mpmath.mpf(periods) - d, mpmath.mpf(gain)
        q = g**2 / (4 + 4 * g**2 * f * (1 - f))
        theta = 2 * mpmath.asin(mpmath.sqrt(q))
        z = mpmath.expj(theta)
        rest = mpmath.expj((d + 1) * theta) * (z - 1) + g * ((1 - f) * z + f)
        return float(abs(rest) / abs(z - 1))


def _double(periods, gain):
    """The greatest value of the gain on 0 < z < 1, less the one told, relative; in fifty digits."""
    d = math.floor(periods)
    with mpmath.workdps(50):
        f = mpmath.mpf(periods) - d
        told, t = mpmath.mpf(gain), mpmath.mpf(1) / (d + 1 + mpmath.sqrt(f))
        value = lambda w: (1 - w) ** (d + 1) * w / (1 - (1 - f) * w)  # noqa: E731
        low, high = t / 4, min(4 * t, 1 - mpmath.mpf(10) ** -40)
        for _ in range(45):  # it rises, then falls, and is flat at the top
            a, b = low + (high - low) * mpmath.mpf("0.4"), low + (high - low) * mpmath.mpf("0.6")
            low, high = (low, b) if value(a) > value(b) else (a, high)
        return float(abs(value((low + high) / 2) / told - 1))


@given(st.floats(-9, 11.9), st.floats(0.001, 0.999))
@settings(max_examples=effort.share(1600), deadline=None)
@example(math.log10(0.0226636e9), 0.5)
@example(math.log10(9.3896 / 2.0162e-6), 0.25)
@example(math.log10(1e9 / 0.0184), 0.125)
def test_any_number_of_periods_is_answered_at_once_and_to_rounding(decade, f):
    """Up to 10¹² periods: a delay that is long beside the period costs no more than a short one."""
    d = math.floor(10**decade)
    periods = d + f if d else f * 10**decade
    if not 0.02 < periods % 1 < 0.98:  # which timing takes for whole, or is of no number of digits
        return
    limit, double = fractional_delay.limit(periods), fractional_delay.double_root(periods)
    assert 0 < double < limit
    if d:  # between the limits of d and d + 1 whole periods
        ends = [2 * math.sin(math.pi / (2 * (2 * n + 1))) for n in (d + 1, d)]
        assert ends[0] * (1 - 1e-14) <= limit <= ends[1] * (1 + 1e-14)
    if d or periods > 0.25:  # else a root leaves at z = −1
        assert _on_the_circle(periods, limit) < 1e-13
    else:
        assert limit == pytest.approx(2 / (1 - 2 * periods), rel=1e-15)
    assert _double(periods, double) < 1e-13


def test_an_equation_of_millions_of_coefficients_is_not_written_down():
    with pytest.raises(LimitError, match="give a longer period"):
        fractional_delay.characteristic(1e12 + 0.5, 1.0)


@pytest.mark.parametrize("tau", [0.0, 0.05, 0.08])
@pytest.mark.parametrize("kappa", [-0.1 + 1j, 1j, -1j, -1 + 0j, 0j])
def test_an_eigenvalue_that_is_not_in_the_right_half_plane_leaves_no_gain(tau, kappa):
    assert loop.gain_limit(tau, period=0.04, kappa=kappa) == 0.0
    M = [[kappa.real, kappa.imag], [-kappa.imag, kappa.real]]
    assert loop.matrix_gain_limit(M, tau, 0.04) == 0.0
