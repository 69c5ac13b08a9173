"""All roots in a rectangle, certified: Lambert's function, chains of neutral loops, bad input."""

from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from oracles.delay import WORKING, figure1
from scipy.special import lambertw

import vsctrl as vs
from vsctrl.errors import InputError
from vsctrl.symbols import s

R = sp.Rational


@pytest.mark.parametrize("box", [((-60, 5), (-300, 300)), ((-55, 0), (10, 1000)), ((5, 9), (1, 2))])
def test_figure1_holds_the_branches_of_lambert(box):
    (a, b), (c, d) = box
    exact = np.array([lambertw(-0.5, k) / 0.08 for k in range(-60, 60)])
    exact = exact[(a < exact.real) & (exact.real < b) & (c < exact.imag) & (exact.imag < d)]
    found = figure1().at(WORKING | {"lam": 0.5 / 0.08}).roots_in(re=box[0], im=box[1])
    assert found.certified
    assert found.count == len(found.roots) == len(exact)
    for root in exact:
        assert np.abs(found.roots - root).min() < 1e-11 * abs(root)


def neutral_lag():
    """(0.65 + 1.2 s) e^{−0.27 s}/(2.3 s + 1) under unity feedback."""
    pd = (R("0.65") + R("1.2") * s) * sp.exp(-R("0.27") * s) / (R("2.3") * s + 1)
    parts = [vs.Sum("e = r - y"), vs.Block("P", pd, "e -> y")]
    return vs.Diagram(parts, inputs=["r"], outputs=["y"]).at()


def test_a_stretch_of_a_chain_far_up_is_listed_whole():
    """Its roots lie 2π/τ = 23.27 rad/s apart, near Re s = ln(1.2/2.3)/τ."""
    found = neutral_lag().roots_in(re=(-3, 0), im=(1000, 1100))
    assert found.certified
    assert found.count == 4
    np.testing.assert_allclose(np.diff(np.sort(found.roots.imag)), 2 * np.pi / 0.27, rtol=1e-4)
    np.testing.assert_allclose(found.roots.real, np.log(1.2 / 2.3) / 0.27, rtol=1e-4)


def test_poles_of_a_neutral_loop_are_the_low_ones_of_its_chain_whatever_their_number():
    """−0.4746 right of the line −2.40958, then −2.4151 ± 11.60j, which nothing is before."""
    loop = neutral_lag()
    assert loop.roots_right_of(-2).chain == pytest.approx(np.log(1.2 / 2.3) / 0.27)
    lists = [loop.poles(n) for n in range(2, 9)]
    for n, poles in enumerate(lists, start=2):
        assert n <= len(poles) <= n + 1
        assert poles[0] == pytest.approx(-0.4746, abs=5e-5)
        assert np.abs(poles - (-2.4151 + 11.60j)).min() < 5e-3
        np.testing.assert_allclose(np.sort(poles.imag), np.sort(poles.conj().imag), rtol=1e-12)
    for fewer, more in pairwise(lists):
        assert all(np.abs(more - root).min() < 1e-9 for root in fewer)


@pytest.mark.parametrize("late", ["0.99", "0.995"])
def test_poles_show_that_a_chain_reaches_right_of_the_axis(late):
    """x₁′ = r − x₂/8, x₂ = x₁ + ¾x₂(t − h) − ½x₂(t − 2): stable for h = 1 only.

    W. Michiels, S.-I. Niculescu, "Stability, Control, and Computation for Time-Delay Systems",
    2nd ed., SIAM 2014, eq. (1.90): h = 0.99 has a root at 0.03774 + 76.61j.
    """
    parts = [
        vs.Block("back", -R(1, 8), "x2 -> q"),
        vs.Sum("d = r + q"),
        vs.Block("integrator", 1 / s, "d -> x1"),
        vs.Block("n", R(3, 4) * sp.exp(-R(late) * s) - sp.exp(-2 * s) / 2, "x2 -> w"),
        vs.Sum("x2 = x1 + w"),
    ]
    system = vs.Diagram(parts, inputs=["r"], outputs=["x2"]).at()
    poles = system.poles(4)
    assert poles.real.max() > 0.03
    np.testing.assert_allclose(np.sort(poles.imag), np.sort(poles.conj().imag), rtol=1e-12)
    if late == "0.99":
        found = system.roots_in(re=(0.01, 1), im=(70, 80))
        assert found.certified
        assert np.abs(found.roots - (0.03774 + 76.61j)).min() < 6e-3


@pytest.mark.parametrize("re", [(1, 0), (0, np.inf), (0,), "ab", (0, 1, 2), (-1e6, 0)])
def test_what_is_no_rectangle_is_refused(re):
    with pytest.raises(InputError, match="roots_in: re ="):
        figure1().at(WORKING).roots_in(re=re, im=(0, 1))


def test_gains_alone_have_no_roots():
    parts = [vs.Sum("e = r - y"), vs.Block("gain", 6, "e -> y")]
    found = vs.Diagram(parts).at().roots_in(re=(-1, 1), im=(-1, 1))
    assert found.certified and found.count == 0 and len(found.roots) == 0
