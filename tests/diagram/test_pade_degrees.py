"""Padé models of unequal degrees, and loops of delays in which a model has no solution.

Oracle: `mpmath.pade` of the Taylor coefficients of e^{−x}, evaluated with 50 digits.
"""

import mpmath as mp
import pytest
from sympy import Rational, exp

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.errors import InputError
from vsctrl.symbols import s

TAU = 0.3
DELAY = Diagram([Block("dead time", exp(-Rational(3, 10) * s), "u -> y")]).at()["u", "y"]


def by_mpmath(m, n, p):
    with mp.workdps(120):
        taylor = [(-1) ** k / mp.factorial(k) for k in range(m + n + 1)]
        above, below = mp.pade(taylor, m, n)
        x = mp.mpc(p) * mp.mpf("0.3")
        return complex(mp.polyval(above[::-1], x) / mp.polyval(below[::-1], x))


@pytest.mark.parametrize(
    "degrees", [(0, 1), (0, 2), (1, 2), (1, 3), (2, 2), (3, 4), (2, 4), (7, 8), (18, 20), (39, 40)]
)
def test_a_model_of_any_degrees_is_the_pade_approximant(degrees):
    model = DELAY.pade(degrees)
    assert model.nstates == degrees[1]
    for p in (0.0, 0.7j, 3 + 11j, 40j, -1 + 100j):
        want = by_mpmath(*degrees, p)
        assert complex(model(p)) == pytest.approx(want, abs=1e-11 * max(1, abs(want)))


def test_a_numerator_of_lower_degree_lets_no_high_frequency_through():
    assert DELAY.pade((3, 4)).D[0, 0] == 0
    assert DELAY.pade((4, 4)).order == DELAY.pade(4).order == 4
    model = DELAY.pade((3, 4))
    assert model.order == (3, 4)
    assert "Padé order (3, 4)" in model.sentence
    assert model.data()["order"] == [3, 4]
    assert model.worst((0.1, 5.0))[1] < 1e-4


def test_an_unstable_approximant_is_refused():
    """1/(1 + x + … + x⁵/5!) has roots in the right half plane."""
    with pytest.raises(InputError, match=r"order = \(0, 5\).*not all stable.*degree 3 to 5"):
        DELAY.pade((0, 5))
    DELAY.pade((0, 4))  # is stable, if not accurate


@pytest.mark.parametrize("order", [0, 41, (4, 3), (-1, 2), (1, 2, 3), (1.0, 2), "4", (1, 41), True])
def test_what_is_no_order_is_refused(order):
    with pytest.raises(InputError, match=r"order = .* is not usable; give .*\(3, 4\)"):
        DELAY.pade(order)


@pytest.mark.parametrize(("sign", "singular", "solvable"), [("-", (1, 3), 2), ("+", (2, 4), 3)])
def test_a_loop_of_gain_one_has_no_solution_where_its_model_passes_one(sign, singular, solvable):
    """e = r ∓ y, y = e(t − τ): an all-pass of order n is (−1)ⁿ at high frequencies."""
    parts = [Sum(f"e = r {sign} y"), Block("dead time", exp(-Rational("0.157") * s), "e -> y")]
    system = Diagram(parts, ["r"], ["y"]).at()
    H = system["r", "y"]
    for order in singular:
        with pytest.raises(InputError, match=rf"order {order}.*algebraic and singular.*give"):
            H.pade(order)
    assert H.pade(tol=1e-3, band=(0.5, 5.0)).order % 2 == solvable % 2
    # Its poles lie on the axis, beside which no model is near.
    with pytest.raises(InputError, match="reached by no order"):
        H.pade(tol=1e-3)
    w = 2.0j
    for order in (solvable + 6, (4, 5)):
        assert complex(H.pade(order)(w)) == pytest.approx(complex(H(w)), rel=1e-6)
    assert system.check().passed


def test_two_loops_that_no_all_pass_fits_are_checked_with_models_of_lower_numerator():
    """One loop is singular with models of odd order, the other with those of even order."""
    parts = [
        Sum("e = r - y"),
        Block("late", exp(-s / 10), "e -> y"),
        Sum("f = y + z"),
        Block("later", exp(-s / 5), "f -> z"),
    ]
    system = Diagram(parts, ["r"], ["z"]).at()
    for order in (3, 4):
        with pytest.raises(InputError, match="algebraic and singular"):
            system["r", "z"].pade(order)
    assert any("Padé (7, 8)" in line.faces for line in system.check().lines)
    with pytest.raises(InputError, match="algebraic and singular"):
        system["r", "z"].pade(tol=0.1)
