"""Characteristic roots of figure 1: the branches W_k(−x)/τ of Lambert's function, all of them."""

import math

import mpmath as mp
import numpy as np
import pytest
from oracles.delay import WORKING, figure1, figure1_poles


def loop(x, late=0.08):
    return figure1().at(WORKING | {"lam": x / late, "tau": late})


def unpaired(roots):
    """Roots whose conjugate is missing, counted with multiplicity."""
    left = list(roots)
    for r in roots:
        near = [k for k, other in enumerate(left) if abs(other - r.conjugate()) < 1e-7 * abs(r)]
        if not near:
            return r
        left.pop(near[0])
    return None


def distance(got, exact):
    """Largest distance from an exact root to the nearest one found, relative."""
    return max(np.abs(got - e).min() / abs(e) for e in exact)


@pytest.mark.parametrize("n", [1, 2, 6, 7, 20])
@pytest.mark.parametrize("x", [1e-4, 0.01, 0.2, 0.36, 0.5, 1.0, 1.57, 3.0, 30.0])
def test_the_rightmost_roots_are_the_lambert_branches(x, n):
    """Also the trap of the pure integrator: a finder that inverts A gives one root of eight."""
    got = loop(x).poles(n)
    assert n <= len(got) <= n + 1
    assert unpaired(got) is None
    # Simple roots: rounding of s + λe^{−sτ}, a few ε of |s|; 1e-12 is what the docstring promises.
    assert distance(got, figure1_poles(x, 0.08, n)) < 1e-12
    assert (np.diff(got.real) <= 1e-8).all(), "by falling real part"
    np.testing.assert_allclose(loop(x)["S_ref", "S"].poles(n), got, rtol=1e-12)


@pytest.mark.parametrize("x", [0.2, 3.0])
def test_sixty_roots(x):
    got = loop(x).poles(60)
    assert 60 <= len(got) <= 61
    assert unpaired(got) is None
    assert distance(got, figure1_poles(x, 0.08, 60)) < 1e-12


@pytest.mark.parametrize("x", [1e-6, 1e-8, 1e-10])
def test_six_roots_of_a_very_gentle_loop(x):
    """The second root lies 20 delays to the left, but it is there."""
    got = loop(x).poles(6)
    assert len(got) >= 6
    assert distance(got, figure1_poles(x, 0.08, 6)) < 1e-9


@pytest.mark.parametrize("late", [1e-6, 1e-5, 1e-3, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("x", [0.1, 0.5, 1.6])
def test_roots_do_not_depend_on_the_unit_of_time(x, late):
    got = loop(x, late).poles(6)
    assert len(got) >= 6
    assert unpaired(got) is None
    assert distance(got, figure1_poles(x / late * late, late, 6)) < 1e-12


@pytest.mark.parametrize("late", [0.08, 2.0])
def test_the_double_root(late):
    """x = 1/e: a double root at −1/τ, λ = 4.598 s⁻¹ at 80 ms."""
    got = loop(1 / math.e, late).poles(6)
    assert np.sum(np.abs(got * late + 1) < 1e-6) == 2  # √ε each side
    assert np.mean(got[:2]) * late == pytest.approx(-1.0, abs=1e-10)
    assert distance(got, figure1_poles(1 / math.e, late, 6)[2:]) < 1e-12


@pytest.mark.parametrize("offset", [-1e-4, -1e-6, 1e-6, 1e-4])
def test_near_the_double_root_there_are_two_simple_ones(offset):
    """They lie ±√(2e·offset) apart and are known to ε over that."""
    x = 1 / math.e + offset
    got = loop(x).poles(4)
    assert len(got) == 4
    assert distance(got, figure1_poles(x, 0.08, 4)) < 1e-10


@pytest.mark.parametrize("n", range(1, 12))
def test_conjugates_are_never_split(n):
    for x in (0.1, 0.5, 2.0):
        for late in (1e-4, 0.08, 7.0):
            got = loop(x, late).poles(n)
            assert unpaired(got) is None
            assert n <= len(got) <= n + 1


@pytest.mark.parametrize("values", [{"ell": 1085.0, "ell_hat": 930.0}, {"ell": 1e4, "lam": 1e-3}])
def test_scales_of_the_signals_do_not_move_the_roots(values):
    """Only κλ and τ count: pixels or metres, ℓ and ℓ̂ of any size."""
    given = WORKING | values
    x = given["lam"] * given["tau"] * given["ell"] / given["ell_hat"]
    assert distance(figure1().at(given).poles(8), figure1_poles(x, 0.08, 8)) < 1e-12


def test_no_delay_leaves_one_pole():
    system = figure1().at(WORKING | {"tau": 0.0})
    np.testing.assert_allclose(system.poles(6), [-2.5], rtol=1e-14)
    without = system.with_(k_ff=0.0)
    np.testing.assert_allclose(without["S_ref", "S"].poles(), [-2.5], rtol=1e-14)
    # With the derivative term the channel is (s + λ)/(s + λ) = 1: the root does not show.
    assert len(system["S_ref", "S"].poles()) == 0


def test_the_open_loop_has_the_integrator_alone():
    np.testing.assert_allclose(figure1().at(WORKING).open("S_meas").poles(6), [0.0], atol=1e-15)


@pytest.mark.parametrize("placement", ["aligned", "actuator"])
def test_placement_and_feed_forward_do_not_move_the_poles(placement):
    for k_ff in (0.0, 1.0):
        system = figure1(placement, error=True).at(WORKING | {"k_ff": k_ff})
        exact = figure1_poles(0.2, 0.08, 6)
        assert distance(system.poles(6), exact) < 1e-12
        if placement == "aligned" and k_ff == 1.0:
            # E/S* = −(1 − k_ff) s/(s + λe^{−τs}) is 0, which has no poles.
            assert len(system["S_ref", "E"].poles(6)) == 0
        else:
            assert distance(system["S_ref", "E"].poles(6), exact) < 1e-12


@pytest.mark.parametrize("late", [0.08, 0.5])
def test_the_limit_gain_by_bisection(late):
    """The gain at which the rightmost root crosses is π/(2τ), 19.635 s⁻¹ at 80 ms."""
    low, high = 1.5 / late, 1.65 / late
    while high - low > 1e-14 * high:
        mid = (low + high) / 2
        low, high = (low, mid) if loop(mid * late, late).poles(2)[0].real > 0 else (mid, high)
    assert high == pytest.approx(math.pi / 2 / late, rel=1e-13, abs=0)


def test_the_realised_loop_is_retarded():
    """S' = −λS(t − τ) has no feedthrough around its delay, nor has any realisation of it."""
    for rate in (2.5, 1e4, 1e6):
        system = figure1().at(WORKING | {"lam": rate, "tau": 0.2 / rate})["S_ref", "S_meas"]
        real = system.realisation
        assert not real.D[real.outputs :, real.inputs :].any()


@pytest.mark.parametrize("x", [60.0, 300.0, 1000.0])
def test_many_unstable_roots_are_all_counted(x):
    """One pair for each crossing π/2 + 2πk below x: 318 at x = 1000."""
    assert loop(x).unstable_roots == 2 * math.ceil((x - math.pi / 2) / (2 * math.pi))


def test_poles_zero_the_characteristic_equation():
    """s + λ e^{−sτ} = 0 with 30 digits at every pole returned."""
    with mp.workdps(30):
        for p in loop(0.9).poles(30):
            p = mp.mpc(p)
            rate, late = mp.mpf(0.9 / 0.08), mp.mpf("0.08")
            residual = p + rate * mp.exp(-p * late)
            assert abs(residual / (1 + p * late)) < 1e-12 * abs(p)


def test_the_root_locus_follows_the_branches():
    gains = np.array([0.5, 2.0, 4.0, 12.0, 25.0])
    locus = figure1().at(WORKING).root_locus("lam", gains, 4)
    assert locus.shape == (5, 4)
    for gain, row in zip(gains, locus, strict=True):
        assert distance(row, figure1_poles(gain * 0.08, 0.08, 4)) < 1e-12
    alone = figure1().at(WORKING | {"tau": 0.0}).root_locus("lam", gains, 2)
    np.testing.assert_allclose(alone[:, 0], -gains)
    assert np.isnan(alone[:, 1]).all()


def test_a_root_locus_tells_itself_in_six_lines_and_draws_itself():
    """Stable up to π/(2τ) = 19.63 s⁻¹."""
    locus = figure1().at(WORKING).root_locus("lam", [0.5, 2, 12, 19.6, 19.7, 25], 4)
    lines = str(locus).splitlines()
    assert len(lines) == 6 and lines[0].startswith("root locus") and "4 rightmost" in lines[0]
    assert "0.5 to 25, 6 values; its own is 2.5" in lines[1]
    assert lines[-1].split()[-3:] == ["0.5", "to", "19.6"]
    first = figure1_poles(0.5 * 0.08, 0.08, 4)[0]
    assert f"{first.real:.4g}" in lines[2]
    assert "at lam = 25" in lines[4]
    picture, table = locus._repr_html_().split("<table>")
    assert picture.startswith("<svg") and picture.count("<circle") > 6 and table.count("<tr>") == 6
    np.testing.assert_array_equal(np.asarray(locus), locus.roots)
