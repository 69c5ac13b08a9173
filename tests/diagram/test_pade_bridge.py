"""Padé models: python-control's own `pade`, the all-pass property, and the loop's limit gains."""

import control
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from oracles.delay import WORKING, figure1, figure1_response

from vsctrl.diagram import Block, Diagram, Step, Sum
from vsctrl.errors import InputError
from vsctrl.symbols import s

T = sp.Symbol("T", positive=True)


def pure_delay(late):
    return Diagram([Block("late", sp.exp(-T * s), "u -> y")]).at(T=late)["u", "y"]


def closed(x, order, late=0.08):
    return figure1().at(WORKING | {"lam": x / late, "tau": late})["S_ref", "S"].pade(order)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 6, 8])
@pytest.mark.parametrize("late", [0.08, 3.0])
def test_it_is_python_controls_pade(order, late):
    omega = np.geomspace(0.01, 30, 41) / late
    model = pure_delay(late).pade(order)
    num, den = control.pade(late, order)
    other = np.polyval(num, 1j * omega) / np.polyval(den, 1j * omega)
    # control's coefficients span (2n)!/n!, and so lose about that share of ε by order 8.
    np.testing.assert_allclose(model(1j * omega), other, rtol=0, atol=1e-10)
    assert isinstance(model, control.StateSpace)
    assert model.nstates == order


@pytest.mark.parametrize("order", [1, 2, 7, 20, 40])
def test_it_is_all_pass(order):
    omega = np.geomspace(1e-3, 1e4, 201) / 0.08
    gain = np.abs(pure_delay(0.08).pade(order)(1j * omega))
    assert np.abs(gain - 1).max() < 1e-12


@pytest.mark.parametrize("order", [4, 12, 20, 40])
def test_it_keeps_its_digits_at_high_order(order):
    """Against Σ (2n−k)! n!/((2n)! k! (n−k)!) (∓sτ)^k, summed with 60 digits."""
    model = pure_delay(0.08).pade(order)
    for x in (0.3, 3.0, 17.0, 60.0):
        with mp.workdps(60):
            terms = [
                mp.factorial(2 * order - k)
                / (mp.factorial(k) * mp.factorial(order - k))
                * mp.mpc(0, x) ** k
                for k in range(order + 1)
            ]
            below = mp.fsum(terms)
            above = mp.fsum((-1) ** k * term for k, term in enumerate(terms))
            exact = complex(above / below)
        assert abs(model(1j * x / 0.08) - exact) < 1e-13


@pytest.mark.parametrize("order", [2, 4, 8, 16])
def test_it_matches_the_delay_up_to_a_phase_of_its_order(order):
    """The error of (n, n) Padé is about (n!)²/((2n)!(2n+1)!) (ωτ)^{2n+1}."""
    model = pure_delay(1.0).pade(order)
    w = order / 2
    bound = np.exp(
        2 * _log_factorial(order)
        - _log_factorial(2 * order)
        - _log_factorial(2 * order + 1)
        + (2 * order + 1) * np.log(w)
    )
    assert abs(model(1j * w) - np.exp(-1j * w)) < 2 * bound + 1e-13


def _log_factorial(n):
    return float(np.sum(np.log(np.arange(1, n + 1))))


@pytest.mark.parametrize(
    ("order", "limit", "digits"),
    [
        (1, 2.0, 1e-9),  # s²/2 + (1 − x/2)s + x
        (2, np.sqrt(21) - 3, 1e-9),  # Routh: 12 − 6x − x² > 0, x < 1.5826
        (3, 1.57101, 5e-6),  # published to the digits given, theory.md section 3
        (4, 1.570798, 5e-7),
        (8, np.pi / 2, 1e-9),
    ],
)
def test_the_limit_gain_of_the_pade_loop(order, limit, digits):
    assert closed(limit - digits, order).poles().real.max() < 0
    assert closed(limit + digits, order).poles().real.max() > 0


@pytest.mark.parametrize("order", [1, 3, 10, 40])
def test_no_state_is_doubled(order):
    """One integrator and one delay: order + 1 states, not 2 (order + 1) as by L/(1 + L)."""
    for target in ("S", "e"):
        model = figure1().at(WORKING | {"k_ff": 0.0})["S_ref", target].pade(order)
        assert model.nstates == order + 1


def test_two_delays_and_two_states():
    diagram = Diagram(
        [
            Sum("e = r - v - w"),
            Block("G", 1 / (s**2 + s + 1), "e -> y"),
            Block("a", sp.exp(-s / 10), "y -> v"),
            Block("b", sp.exp(-s / 3) / 2, "y -> w"),
        ],
        outputs=["y"],
    )
    model = diagram.at()["r", "y"].pade(5)
    assert model.nstates == 2 + 2 * 5
    # The same in python-control's transfer functions, closed by its own feedback.
    late = control.tf(*control.pade(0.1, 5)) + control.tf(*control.pade(1 / 3, 5)) / 2
    other = control.feedback(control.tf([1], [1, 1, 1]), late)
    omega = np.geomspace(0.01, 30, 31)
    np.testing.assert_allclose(model(1j * omega), other(1j * omega), rtol=1e-8)


@pytest.mark.parametrize("order", [20, 40])
@pytest.mark.parametrize("x", [0.2, 1.0, 1.5])
def test_high_orders_invent_no_unstable_pole(order, x):
    model = closed(x, order)
    assert model.poles().real.max() < 0
    # And the rightmost pole is that of the exact loop.
    exact = figure1().at(WORKING | {"lam": x / 0.08}).poles(1)[0].real
    assert model.poles().real.max() == pytest.approx(exact, rel=1e-8, abs=0)


def test_the_loop_as_a_pade_model_has_its_sign():
    loop = figure1().at(WORKING).open("S_meas")
    w = np.array([0.5, 3.0, 15.0])
    np.testing.assert_allclose(loop.pade(8)(1j * w), loop(1j * w), rtol=1e-10)
    np.testing.assert_allclose(loop(1j * w), 2.5 * np.exp(-0.08j * w) / (1j * w), rtol=1e-14)


def test_without_delay_nothing_is_approximated():
    model = figure1().at(WORKING | {"tau": 0.0, "k_ff": 0.0})["S_ref", "S"].pade(7)
    assert model.nstates == 1
    np.testing.assert_allclose(model.poles(), [-2.5])


@pytest.mark.parametrize(("order", "error"), [(1, 3e-3), (12, 1e-5)])
def test_the_step_response_of_pade_converges_slowly_to_the_exact_one(order, error):
    """At λ = 2.5 it errs by 3e-3 at order 1 and still by 1e-5 at order 12 (theory.md)."""
    channel = figure1().at(WORKING | {"k_ff": 0.0})["S_ref", "S"]
    t = np.linspace(0, 1, 2001)
    exact = [figure1_response("step", x, 2.5, 0.08) for x in t[::4]]
    np.testing.assert_allclose(channel.response(Step(), t[::4]).outputs, exact, atol=1e-14)
    _, y = control.step_response(channel.pade(order), t)
    worst = np.abs(y - channel.response(Step(), t).outputs).max()
    assert error / 1.6 < worst < error * 1.6  # one digit is published


def test_names_reach_python_control():
    model = figure1().at(WORKING | {"k_ff": 0.0})["S_ref", "S"].pade(2)
    assert model.input_labels == ["S_ref"]
    assert model.output_labels == ["S"]


@pytest.mark.parametrize("order", [0, -1, 41, 2.5, 3.0, True, "4", None, np.nan])
def test_unusable_orders_are_refused(order):
    with pytest.raises(InputError, match=r"order = .*1 to 40"):
        pure_delay(0.08).pade(order)


def test_a_whole_number_of_any_kind_is_an_order():
    assert pure_delay(0.08).pade(np.int64(3)).nstates == 3
