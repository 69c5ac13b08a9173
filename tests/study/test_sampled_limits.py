"""Gain limits of the remedies: polynomials of the sampled loop against poles, scalar loops, 6-DOF.

The diagrams are sampled by another room of the package (`Diagram.at(...).sampled`), which knows
nothing of these polynomials; closed forms are those of theory.md, section 3.
"""

import math

import numpy as np
import pytest

from vsctrl import loop, paper, study
from vsctrl.study.compensation import sampled_limits

PERIOD, TAU = 0.04, 0.08


# Gain limits ------------------------------------------------------------------------------------
@pytest.mark.parametrize("frames", range(5))
def test_the_held_loop_ends_where_its_closed_form_says(frames):
    limit = sampled_limits.plain(frames * PERIOD, PERIOD, kappa=0.8).limit
    angle = math.pi / (2 * (2 * frames + 1))
    assert limit == pytest.approx(2 * math.sin(angle) / (0.8 * PERIOD), rel=1e-12)


def test_a_complex_kappa_has_the_limit_of_its_argument():
    mu = 1.06 * np.exp(0.3j)
    expected = 2 * math.sin((math.pi / 2 - 0.3) / 5) / (1.06 * PERIOD)
    assert sampled_limits.plain(TAU, PERIOD, kappa=complex(mu)).limit == pytest.approx(
        expected, rel=1e-9
    )


def largest_pole(diagram, lam, digital=None, **values):
    twin = diagram.at(lam=lam, ell_hat=1.0, k_ff=0.0, **values).sampled(
        PERIOD, hold="T", digital=digital or {}
    )
    poles = twin.poles()
    # The Smith diagram's own integrator is hidden; in the computer it is a sum without it.
    return np.abs(poles[np.abs(poles - 1) > 1e-7]).max()


@pytest.mark.parametrize("late", [0.08, 0.1, 0.05])
@pytest.mark.parametrize("believed", [0.04, 0.08, 0.09, 0.2])
def test_the_smith_polynomial_has_the_poles_of_the_sampled_diagram(late, believed):
    found = sampled_limits.predicted(late, PERIOD, believed, kappa=0.9)
    values = {"tau": late, "tau_hat": believed, "ell": 0.9}
    for share in (0.5, 0.999, 1.001):
        gain = share * found.limit
        pole = largest_pole(loop.smith(), gain, **values)
        assert found.modulus(gain) == pytest.approx(pole, abs=1e-9)
        assert (pole < 1) == (share < 1)


@pytest.mark.parametrize("late", [0.08, 0.1, 0.05])
@pytest.mark.parametrize("time", [0.12, 0.4, 1.6])
def test_the_integral_polynomial_has_the_poles_of_the_sampled_diagram(late, time):
    found = sampled_limits.integral(late, PERIOD, time, kappa=0.9)
    values = {"tau": late, "T_i": time, "ell": 0.9, "digital": {"gain": "backward"}}
    for share in (0.5, 0.999, 1.001):
        gain = share * found.limit
        pole = largest_pole(loop.pi(), gain, **values)
        # A double root of 1 as the gain falls makes the square root of rounding.
        assert found.modulus(gain) == pytest.approx(pole, abs=1e-7)
        assert (pole < 1) == (share < 1)


def test_no_gain_is_stable_with_too_short_an_integral():
    assert sampled_limits.integral(TAU, PERIOD, 0.02).limit == 0.0


def scalar_grows(gain, late, believed):
    """Whether S_{k+1} = S_k + κ Tₛ T_k grows under the Smith predictor, stepped one by one."""
    S, T = [1.0], []
    for k in range(3000):
        ahead = PERIOD * sum(T[max(k - believed, 0) : k])
        T.append(-gain * (S[max(k - late, 0)] + ahead))
        S.append(S[k] + PERIOD * T[k])
        if abs(S[-1]) > 1e6:
            return True
    return abs(S[-1]) > 1


@pytest.mark.parametrize(("believed", "limit"), [(2, 2 / PERIOD), (1, 2 / (3 * PERIOD))])
def test_a_predictor_one_frame_wrong_allows_a_third_of_the_gain(believed, limit):
    # At z = −1 one twist too few or too many changes its sign from frame to frame.
    assert sampled_limits.predicted(TAU, PERIOD, believed * PERIOD).limit == pytest.approx(
        limit, rel=1e-12
    )
    assert not scalar_grows(0.99 * limit, 2, believed)
    assert scalar_grows(1.01 * limit, 2, believed)


# In six degrees of freedom ----------------------------------------------------------------------
def test_the_limits_are_found_in_six_degrees_of_freedom():
    found = study.compare_remedies(paper.sliding(latency=0.04))
    assert found.limits.agrees
    for row in found.rows:
        assert row.limit.simulated == pytest.approx(row.limit.exact, rel=1e-4)
    # Continuous, κ = 1: π/2τ, and unlimited with the right predictor.
    assert found.of("none").limit.predicted == pytest.approx(math.pi / 2 / 0.04, rel=1e-9)
    assert found.of("Smith").limit.predicted == math.inf
    assert "alternates" in found.of("Smith").limit.note
    assert "∞" in str(found.limits)
    assert "half a period more" in found.notes[-2]


@pytest.mark.parametrize("periods", [0.3, 0.5, 1.25, 2.0, 3.7])
@pytest.mark.parametrize("kappa", [1.0, 1.3, 0.9 + 0.2j])
def test_two_ways_to_the_limit_of_figure_1_meet(periods, kappa):
    """Roots on the circle here, the phase on the circle (or the closed form) in the loop's room."""
    expected = loop.gain_limit(0.04 * periods, period=0.04, kappa=kappa)
    assert sampled_limits.plain(0.04 * periods, 0.04, kappa).limit == pytest.approx(
        expected, rel=1e-9
    )
