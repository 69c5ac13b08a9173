"""What is typed wrong ends in one sentence, and what lies far out is evaluated without overflow."""

from __future__ import annotations

import control
import mpmath
import numpy as np
import pytest
import sympy as sp

import vsctrl as vs
from vsctrl.errors import InputError, LimitError
from vsctrl.symbols import s

K = sp.Symbol("K", real=True)
NO_NUMBERS = ["a", None, [1, [2]], [np.nan], [np.inf], {}, object(), [True]]


HALF = sp.Rational(1, 2)


def loop(gain=2, delay=HALF, **values):
    return vs.Diagram(
        [vs.Sum("e = r - y"), vs.Block("L", gain * sp.exp(-delay * s) / (s + 1), "e -> y")],
        inputs=["r"],
        outputs=["y"],
    ).at(**values)


def refused(call, *words, kind=InputError):
    """The one sentence of the refusal, which is short."""
    with pytest.raises(kind) as error:
        call()
    text = str(error.value)
    assert type(error.value) is kind and len(text) < 320 and "\n" not in text
    for word in words:
        assert word in text
    return text


@pytest.mark.parametrize("sigma", ["a", None, [0, 1], np.nan, 1j, np.inf, -np.inf, 10**400, True])
def test_a_line_that_is_no_number_is_refused(sigma):
    refused(lambda: loop().roots_right_of(sigma), "roots_right_of", "sigma")


def test_a_line_beyond_the_range_of_floats_is_refused_with_the_farthest_one():
    assert "-1400" in refused(lambda: loop().roots_right_of(-1e6), "-1e+06")
    assert loop().roots_right_of(-50.0).count > 6


@pytest.mark.parametrize("n", [10**6, 10**40])
def test_more_roots_than_fit_a_machine_are_refused_and_the_number_that_fits_is_told(n):
    refused(lambda: loop().poles(n), "2000 or fewer", kind=LimitError)
    refused(lambda: loop()["r", "y"].poles(n), "2000 or fewer", kind=LimitError)
    refused(lambda: loop(K, K=1).root_locus("K", [1], n), "2000", kind=LimitError)


def test_without_delays_any_number_may_be_asked_for():
    assert loop(delay=0).poles(10**6) == pytest.approx([-3])


@pytest.mark.parametrize("values", [[1j], [], *NO_NUMBERS])
def test_root_locus_refuses_values_that_are_not_real(values):
    refused(lambda: loop(K, K=1).root_locus("K", values), "root_locus", "values")


@pytest.mark.parametrize("name", [None, [1], "Q", 3])
def test_root_locus_refuses_what_is_no_parameter(name):
    refused(lambda: loop(K, K=1).root_locus(name, [1.0]), "no parameter")


@pytest.mark.parametrize("omega", [[[1, 2]], [1j], [], *NO_NUMBERS])
def test_frequency_responses_refuse_what_is_no_list_of_frequencies(omega):
    for system in (loop(), loop().sampled(0.1, hold="e")):
        refused(lambda of=system: of["r", "y"].frequency_response(omega), "omega", "rad/s")


@pytest.mark.parametrize("at", NO_NUMBERS)
def test_channels_refuse_points_that_are_no_numbers(at):
    refused(lambda: loop()["r", "y"](at), "channel: s = ")
    refused(lambda: loop().sampled(0.1, hold="e")["r", "y"](at), "channel: z = ")


@pytest.mark.parametrize("at", [-1e4, -2e3 + 5j, -1e5 + 3j, -1e300])
def test_far_left_the_closed_loop_and_its_sensitivity_have_their_own_values(at):
    with mpmath.workdps(60):
        L = 2 * mpmath.exp(-mpmath.mpc(at) / 2) / (mpmath.mpc(at) + 1)
        expected = complex(L / (1 + L)), complex(1 / (1 + L))
    system = loop()
    # Floats hold what is far above their smallest number to rounding.
    assert system["r", "y"](at) == pytest.approx(expected[0], rel=1e-14)
    assert system["r", "e"](at) == pytest.approx(expected[1], rel=1e-12, abs=1e-300)
    assert system["r", "y"]([0.0, at])[0] == pytest.approx(2 / 3)


def test_far_left_a_smith_predictor_cancels_to_the_last_of_thousands_of_digits():
    plant, late = 1 / (s + 1), sp.exp(-s / 2)
    system = vs.Diagram(
        [
            vs.Sum("e = r - y - p"),
            vs.Block("C", 3, "e -> u"),
            vs.Block("plant", plant * late, "u -> y"),
            vs.Block("model", plant * (1 - late), "u -> p"),
        ],
        inputs=["r"],
        outputs=["y", "u"],
    ).at()
    # u = C/(1 + C G) r, of which no delay is left.
    assert system["r", "u"](-1e4) == pytest.approx(3 * (1 - 1e4) / (4 - 1e4), rel=1e-13)


@pytest.mark.parametrize("z", [1e-100, 1e-320, 1e200, 1e300, -1e-90 + 1e-91j])
def test_sampled_channels_have_their_own_value_where_powers_of_z_overflow(z):
    T, pole = 0.1, np.exp(-0.1)
    with mpmath.workdps(3000):
        at = mpmath.mpc(z)
        L = 2 * (1 - mpmath.mpf(pole)) / (at - mpmath.mpf(pole)) * at ** (-5)
        expected = complex(L / (1 + L))
    value = loop().sampled(T, hold="e")["r", "y"](z)
    assert value == pytest.approx(expected, rel=1e-12, abs=1e-300)


def test_sampled_channels_refuse_zero_where_they_are_late_and_take_it_elsewhere():
    refused(lambda: loop().sampled(0.1, hold="e")["r", "y"]([1, 0]), "z = 0")
    value = loop(delay=0).sampled(0.1, hold="e")["r", "y"](0)
    pole = np.exp(-0.1)
    assert value == pytest.approx(2 * (1 - pole) / (2 * (1 - pole) - pole))


@pytest.mark.parametrize("t", [*NO_NUMBERS, 1j, np.nan, np.inf, "1"])
@pytest.mark.parametrize("signal", [vs.Step(), vs.Step() + vs.Pulse(1), vs.Samples([1, 2], 0.1)])
def test_signals_refuse_times_that_are_none(signal, t):
    refused(lambda: signal(t), "signal: t = ")


@pytest.mark.parametrize("side", ["x", None, ["right"], np.zeros(2), 1])
def test_signals_and_responses_refuse_sides_that_are_none(side):
    refused(lambda: vs.Step()(1.0, side), "give 'right' or 'left'")
    refused(lambda: loop()["r", "y"].response(vs.Step(), [1.0], side), "give 'right' or 'left'")


def test_signals_are_divided_by_numbers_and_symbols():
    t = np.array([0.5, 1.5])
    for signal in (vs.Step(3), vs.Pulse(1, 3), vs.Samples([3, 6], 1.0), vs.Step(3) + vs.Ramp()):
        for number in (2, 2.0, np.float64(2), sp.Integer(2)):
            assert np.asarray((signal / number)(t), float) == pytest.approx(signal(t) / 2)
    assert sp.simplify((vs.Step(1) / K).laplace(s) - 1 / (K * s)) == 0


@pytest.mark.parametrize("number", [0, 0.0, np.nan, np.inf, 10**400, sp.Integer(0), sp.zoo])
def test_signals_refuse_divisors_without_an_inverse(number):
    refused(lambda: vs.Step() / number, "divisor")


@pytest.mark.parametrize("number", [10**400, sp.nan, sp.zoo, sp.I])
def test_signals_refuse_factors_that_are_not_finite_and_real(number):
    refused(lambda: vs.Pulse(1) * number, "factor")
    refused(lambda: vs.Step(number), "amplitude")


def test_a_plain_channel_has_no_margins_to_keep_to():
    refused(lambda: loop()["r", "y"].pade(tol=0.1, on="margins"), "margins", "open")


def test_a_twin_held_at_an_input_says_that_no_loop_is_broken_there():
    twin = loop(delay=0).sampled(0.1, hold="r")
    assert "None" not in refused(twin.open, "'r' is an input")
    assert "hold=None" not in refused(lambda: loop().sampled(0.1, hold="e").open([1]), "[1]")


@pytest.mark.parametrize("n", [np.arange(1000.0), np.arange(5), "a", None, 2.5, 0])
def test_sampled_responses_say_that_n_is_a_number_of_samples(n):
    channel = loop().sampled(0.1, hold="e")["r", "y"]
    assert len(refused(lambda: channel.response(vs.Step(), n), "number of samples")) < 200


def test_sampled_responses_refuse_samples_that_fill_no_machine():
    channel = loop().sampled(0.1, hold="e")["r", "y"]
    refused(lambda: channel.response(vs.Step(), 10**12), "fewer", kind=LimitError)


@pytest.mark.parametrize("wiring", ["u -> y", "bad", None])
def test_a_block_names_what_is_wrong_with_its_system_before_its_wiring(wiring):
    mimo = control.ss(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
    refused(lambda: vs.Block("m", mimo, wiring), "2 inputs and 2 outputs")
    refused(lambda: vs.Block("m", np.zeros(500), wiring), "no transfer function")


def test_every_face_of_a_loop_without_a_solution_gives_the_sentence_of_its_poles():
    system = vs.Diagram(
        [vs.Block("a", -1, "e -> y"), vs.Sum("e = u - y")], inputs=["u"], outputs=["y"]
    ).at()
    text = refused(system.poles, "singular")
    channel = system["u", "y"]
    for face in (system.check, lambda: channel(1), lambda: channel.frequency_response([1])):
        assert refused(face) == text


@pytest.mark.parametrize("period", [1e300, 1e308, 1e-300, 5e-324, 10**400, np.nan, [1], "a"])
def test_periods_that_overflow_are_refused(period):
    refused(lambda: loop().sampled(period, hold="e"), "sampled: period = ")


def test_a_period_in_which_an_unstable_plant_overflows_is_refused():
    system = vs.Diagram(
        [vs.Sum("e = r - y"), vs.Block("P", 1 / (s - 1), "e -> y")], inputs=["r"], outputs=["y"]
    ).at()
    refused(lambda: system.sampled(1e5, hold="e"), "100000 s", "overflows")


@pytest.mark.parametrize("value", [np.zeros(1000), ["a"] * 2000, loop()])
def test_long_values_are_shortened_in_every_sentence(value):
    system = loop()
    twin = system.sampled(0.1, hold="e")
    for call in (
        lambda: system[value],
        lambda: twin[value],
        lambda: system.open(value),
        lambda: twin.open(value),
        lambda: system.sampled(0.1, hold=value),
        lambda: system.sampled(value, hold="e"),
        lambda: system.sampled(0.1, hold="e", digital={"L": value}),
        lambda: vs.Block(value, 1, "a -> b"),
        lambda: vs.Block("a", 1, value),
        lambda: vs.Sum(value),
        lambda: vs.Step(value),
        lambda: vs.Pulse(value),
        lambda: vs.Step().delayed(value),
        lambda: system["r", "y"].response(value, [1.0]),
    ):
        refused(call)


@pytest.mark.parametrize("value", [1j, np.complex128(2 + 1j), np.complex64(1)])
def test_a_complex_number_is_no_value_of_a_parameter(value):
    with pytest.raises(vs.InputError, match=r"lam = .* is no number; give a real number"):
        vs.figure1.at(lam=value, tau=0.08, ell=1, ell_hat=1, k_ff=1)
