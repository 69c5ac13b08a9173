"""Signals put together, and what channels answer to them: pulses, sums, shifts, samples, limits."""

import math
from fractions import Fraction

import effort
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.delay import WORKING, Box, Network, figure1, figure1_response
from scipy import signal as scipy_signal

from vsctrl import InputError, LimitError, loop
from vsctrl.diagram import Block, Diagram, Parabola, Pulse, Ramp, Samples, Sine, Step, Sum
from vsctrl.diagram.signals.elementary import Cosine
from vsctrl.diagram.time import collocation, superposition
from vsctrl.symbols import s

LATE = 0.08
RATE = 2.5
ROUNDING = 1e-13
LOOP = figure1(error=True).at(WORKING)
H = figure1().at(WORKING | {"k_ff": 0.0})["S_ref", "S"]


def values(channel, signal, t, side="right"):
    return np.asarray(channel.response(signal, t, side).outputs)


def series(kind, times, feed=0.0, omega=1.0):
    """The 120-digit series, zero before 0."""
    return np.array(
        [0.0 if t < 0 else figure1_response(kind, t, RATE, LATE, feed, omega) for t in times]
    )


def pieces(channel, signal, horizon):
    return len(collocation.solve(channel.realisation, signal, horizon).ends) - 1


# What a signal is ------------------------------------------------------------------------------
def test_sums_multiples_and_shifts_are_what_they_say():
    t = np.array([0.0, 0.1, 0.29, 0.3, 0.5, 2.0])
    late = np.where(t >= 0.3, t - 0.3, 0.0)
    np.testing.assert_allclose(Ramp(2.0).delayed(0.3)(t), 2 * late, atol=1e-16)
    np.testing.assert_allclose((Step(2) - 3 * Ramp().delayed(0.3))(t), 2 - 3 * late, atol=1e-15)
    np.testing.assert_allclose(Pulse(0.3, 4.0)(t), np.where(t < 0.3, 4.0, 0.0))
    np.testing.assert_allclose(Pulse(0.3)(t, "left"), [0, 1, 1, 1, 0, 0])
    np.testing.assert_allclose(Cosine(3.0, 2.0)(t), 2 * np.cos(3 * t))
    assert (Step() + Ramp())(-1.0) == 0.0


def test_like_terms_add_up():
    assert Step(1.0) + Step(2.0) == Step(3.0)
    assert 2 * Ramp(1.5) == Ramp(3.0) == np.float64(2) * Ramp(1.5) == Ramp(1.5) * 2
    assert -Pulse(0.3) == Pulse(0.3, -1)
    assert (Step() - Step()).terms == ()
    assert sum([Step(), Step()]) == Step(2)
    assert (Sine(2.0) + Sine(3.0)).terms == ((0, Sine(2.0)), (0, Sine(3.0)))
    assert hash(Step().delayed(0.1)) == hash(Step().delayed(0.1))


def test_starts_are_rational():
    """0.1 + 0.2 is 0.3 here, whatever it is in binary."""
    assert Step().delayed(0.1).delayed(0.2) == Step().delayed(0.3)
    assert Step().delayed(0.3).terms == ((Fraction(3, 10), Step()),)


def test_signals_are_frozen():
    for signal in (Pulse(0.3), Step().delayed(0.1), Samples([1.0], 0.1)):
        with pytest.raises(AttributeError):
            signal.period = 3.0


SHAPES = [
    Pulse(0.3, 2.0),
    Step().delayed(0.3) - 2 * Ramp().delayed(1),
    Parabola(3.0).delayed(0.5) + Sine(2.0).delayed(0.25) + Cosine(1.5),
    Samples([1.0, -2.0, 0.5], 0.25),
    Samples([1.0, -2.0, 0.5, 0.0], 0.25, "first").delayed(0.5),
]


@pytest.mark.parametrize("signal", SHAPES, ids=str)
def test_laplace_is_the_integral(signal):
    """∫ u e^{−pt} dt, cell by cell on a mesh that holds every start, to where e^{−pt} is 1e-17."""
    node, weight = np.polynomial.legendre.leggauss(14)
    t = (np.arange(60 * 20)[:, None] + (node + 1) / 2) / 20
    for p in (1.0, 0.7 + 2j):
        integral = (signal(t) * np.exp(-p * t) @ weight).sum() / 40
        assert signal.laplace(p) == pytest.approx(integral, rel=1e-12, abs=1e-12)


def test_laplace_in_symbols():
    p, a = sp.symbols("p a", positive=True)
    assert sp.simplify((Step(a) + Ramp(2)).laplace(p) - a / p - 2 / p**2) == 0
    pulse = Pulse(0.5, a).laplace(p, exp=sp.exp)
    assert sp.simplify(pulse - a * (1 - sp.exp(-p / 2)) / p) == 0
    with pytest.raises(InputError, match=r"give exp=sympy\.exp"):
        Pulse(0.5).laplace(p)


@pytest.mark.parametrize("signal", SHAPES, ids=str)
def test_jumps_are_those_of_the_derivatives(signal):
    """A Taylor polynomial with the jumps at every start up to then is the signal itself."""
    for t in (0.1, 0.4, 0.62, 1.3):
        total = sum(
            jump * (t - float(start)) ** k / math.factorial(k)
            for start, row in signal.onsets(24).items()
            if start < t
            for k, jump in enumerate(row)
        )
        assert total == pytest.approx(float(signal(t)), abs=1e-13)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pulse(0.0), r"Pulse: width = 0\.0 .* above 0"),
        (lambda: Pulse(math.nan), "Pulse: width = nan"),
        (lambda: Pulse("1"), "Pulse: width = '1'"),
        (lambda: Pulse(1.0, math.inf), "Pulse: amplitude = inf .* finite"),
        (lambda: Step().delayed(-0.1), r"delayed: seconds = -0\.1 .* 0 s or more"),
        (lambda: Step().delayed(math.inf), "delayed: seconds = inf"),
        (lambda: math.nan * Step(), "Step: amplitude = nan"),
        (lambda: Samples([], 0.1), r"Samples: values = \[\] .* one number or more"),
        (lambda: Samples([[1.0]], 0.1), "Samples: values"),
        (lambda: Samples([1.0, math.nan], 0.1), r"Samples: values\[1\] = nan"),
        (lambda: Samples([1.0], 0), "Samples: period = 0 .* above 0"),
        (lambda: Samples([1.0], 0.1, "second"), "Samples: hold = 'second' .* 'zero' or 'first'"),
        (lambda: H.response(Step(), [1.0], side="up"), "side = 'up' .* 'right' or 'left'"),
        (lambda: H.response(np.ones(3), [1.0]), r"is no signal; give .* Samples"),
        (lambda: H.response(Pulse(1, sp.Symbol("a")), [1.0]), "holds symbols"),
        (lambda: loop.tracking_error(Pulse(1.0)), "has no steady error"),
    ],
)
def test_what_cannot_be_used_is_refused_with_a_sentence(make, message):
    with pytest.raises(InputError, match=message):
        make()


# Sums and shifts through a channel -------------------------------------------------------------
TIMES = np.array([0, 0.05, LATE, 0.3, 0.3 + LATE, 0.41, 1.0, 4.0])


@pytest.mark.parametrize("feed", [0.0, 0.7])
def test_a_pulse_is_a_step_less_a_later_step(feed):
    channel = figure1().at(WORKING | {"k_ff": feed})["S_ref", "S"]
    exact = 2 * (series("step", TIMES, feed) - series("step", np.round(TIMES - 0.3, 12), feed))
    np.testing.assert_allclose(values(channel, Pulse(0.3, 2.0), TIMES), exact, atol=ROUNDING)


def test_each_kind_shifted():
    late = np.round(TIMES - 0.3, 12)
    for kind, signal in (("ramp", Ramp()), ("parabola", Parabola()), ("sine", Sine(1.0))):
        exact = series(kind, late)
        np.testing.assert_allclose(values(H, signal.delayed(0.3), TIMES), exact, atol=ROUNDING)


NUMBERS = st.floats(-10, 10).map(lambda x: round(x, 3))
SIGNALS = st.sampled_from([*SHAPES, Step(), Ramp(), Sine(5.0).delayed(0.13)])


@settings(max_examples=effort.share(25), deadline=None, derandomize=True)
@given(NUMBERS, SIGNALS, NUMBERS, SIGNALS)
def test_responses_are_linear(a, u, b, v):
    t = np.array([0.1, 0.3, 0.55, 1.7])
    both = a * values(H, u, t) + b * values(H, v, t)
    np.testing.assert_allclose(values(H, a * u + b * v, t), both, atol=1e-12)


@settings(max_examples=effort.share(15), deadline=None, derandomize=True)
@given(SIGNALS, st.integers(1, 200).map(lambda k: k / 100))
def test_responses_do_not_depend_on_when(u, late):
    t = np.array([0.1, 0.3, 0.55, 1.7])
    np.testing.assert_allclose(values(H, u.delayed(late), t + late), values(H, u, t), atol=1e-12)


def test_pieces_stay_few():
    assert pieces(H, Pulse(0.3), 10.0) < 60
    assert pieces(H, Step() - Step().delayed(3 * LATE), 10.0) < 40
    train = Samples(np.sin(np.arange(100)), LATE / 2)
    assert pieces(H, train, 10.0) < 160
    # A late, steep ramp is no rougher than an early one.
    assert pieces(H, Ramp(25.0).delayed(399.96), 400.5) < 130


# Left and right limits -------------------------------------------------------------------------
def test_both_limits_of_a_feedthrough_path():
    channel = Diagram([Block("b", 2 + sp.exp(-s / 10), "r -> y")]).at()["r", "y"]
    t = [0.0, 0.1, 0.25, 0.30000000000000004, 0.35]
    pulse = Pulse(0.25)
    np.testing.assert_allclose(values(channel, pulse, t), [2, 3, 1, 1, 0], atol=1e-14)
    np.testing.assert_allclose(values(channel, pulse, t, "left"), [0, 2, 3, 1, 1], atol=1e-14)
    shown = channel.response(pulse, t, "left").inputs
    np.testing.assert_array_equal(np.ravel(shown), [0, 1, 1, 0, 0])


def test_both_limits_of_a_neutral_loop():
    """y = (0.5 s + 1)/(s + 3)·(r − y(t − 0.2)): limits at k·0.1 from the oracle beside them."""
    lead = Block("lead", (s / 2 + 1) / (s + 3), "e -> y")
    parts = [Sum("e = r - w"), lead, Block("late", sp.exp(-s / 5), "y -> w")]
    channel = Diagram(parts, outputs=["y"]).at()["r", "y"]
    boxes = (Box((0.5, 1.0), (1.0, 3.0)), Box((1,), (1,), 2))
    oracle = Network(boxes, np.array([[0, -1], [1, 0]]), np.array([1, 0]))
    t, y = oracle.response(Pulse(0.3), 3.0)
    np.testing.assert_allclose(values(channel, Pulse(0.3), t[::5]), y[::5, 0], atol=1e-12)
    # Each cell's polynomial, taken to its ends.
    cells = y[:, 0].reshape(-1, 12)
    node = np.polynomial.legendre.leggauss(12)[0]
    back = np.linalg.inv(np.polynomial.legendre.legvander(node, 11))
    left, right = (np.polynomial.legendre.legvander([x], 11)[0] @ back for x in (1.0, -1.0))
    k = np.arange(1, 30)
    np.testing.assert_allclose(
        values(channel, Pulse(0.3), k / 10, "left"), (cells @ left)[:-1], atol=1e-11
    )
    np.testing.assert_allclose(values(channel, Pulse(0.3), k / 10), (cells @ right)[1:], atol=1e-11)


def test_a_pulse_against_the_inverse_transform():
    t = [0.7, 1.9]
    with mp.workdps(25):
        exact = [
            float(
                mp.invertlaplace(
                    lambda q: (
                        Pulse(0.3).laplace(q, mp.exp)
                        * RATE
                        / (q + RATE * mp.exp(-q * mp.mpf("0.08")))
                    ),
                    at,
                    method="talbot",
                    degree=40,
                )
            )
            for at in t
        ]
    np.testing.assert_allclose(values(H, Pulse(0.3), t), exact, atol=1e-9)


# Improper channels -----------------------------------------------------------------------------
def test_twist_of_figure_1_on_a_ramp():
    """T = (λ(r − S(t − τ)) + k_ff r′)/ℓ̂ is S′ here, so the series of S on a step of slope v."""
    T = LOOP["S_ref", "T"]
    for feed in (1.0, -0.4):
        channel = figure1().at(WORKING | {"k_ff": feed})["S_ref", "T"]
        exact = 0.04 * series("step", TIMES, feed)
        np.testing.assert_allclose(values(channel, Ramp(0.04), TIMES), exact, atol=ROUNDING)
    assert values(T, Ramp(0.04), [0.0], "left") == 0.0
    exact = series("ramp", TIMES, 1.0)
    np.testing.assert_allclose(values(T, Parabola(), TIMES), exact, atol=ROUNDING)
    wave = values(T, Sine(3.0, 0.5) + Ramp().delayed(0.3), [25.0])
    steady = np.imag(T(3j) * 0.5 * np.exp(75j)) + 1.0
    np.testing.assert_allclose(wave, steady, atol=1e-12)
    corners = Samples([0.0, 0.04, 0.0, 0.0], 0.5, "first")
    ramps = Ramp(0.08) - 2 * Ramp(0.08).delayed(0.5) + Ramp(0.08).delayed(1)
    np.testing.assert_allclose(values(T, corners, TIMES), values(T, ramps, TIMES), atol=ROUNDING)


def test_second_derivatives_and_what_stays_refused():
    plant = [Block("d", s, "u -> v"), Block("dd", s, "v -> y")]
    channel = Diagram(plant).at()["u", "y"]
    np.testing.assert_allclose(values(channel, Parabola(3.0), [0.0, 2.0]), 3.0, atol=1e-13)
    for signal in (Step(), Pulse(1.0), Ramp(), Sine(2.0), Samples([0.0, 1.0], 0.1)):
        with pytest.raises(InputError, match=r"'y' is improper.*'u'.*filter"):
            channel.response(signal, [1.0])


# Samples ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("hold", ["zero", "first"])
@pytest.mark.parametrize("n", [7, 400])
def test_samples_through_a_lag_are_those_of_scipy(hold, n):
    v = np.random.default_rng(n).normal(size=n)
    channel = Diagram([Block("lag", (s + 3) / (s**2 + s + 4), "u -> y")]).at()["u", "y"]
    t = 0.05 * np.arange(n)
    model = scipy_signal.lti([1, 3], [1, 1, 4])
    exact = scipy_signal.lsim(model, v, t, interp=hold == "first")[1]
    np.testing.assert_allclose(values(channel, Samples(v, 0.05, hold), t), exact, atol=1e-12)


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_many_samples_are_the_few_ones_superposed(hold, monkeypatch):
    """By convolution on even times, directly on others, piece by piece: all the same."""
    v = np.random.default_rng(3).normal(size=150)
    u = 2 * Samples(v, 0.04, hold).delayed(0.1) + Step()
    grids = [
        np.arange(7000) / 1000,
        np.linspace(0.01, 7.0, 700),
        0.03 * np.arange(5, 230),
        np.array([0.0, 0.1, 0.14, 1.2345, 6.06, 6.1, 6.2, 7.0]),
        np.array([3.0]),
    ]
    channel = LOOP["S_ref", "S"]
    quick = [values(channel, u, t, side) for t in grids for side in ("left", "right")]
    monkeypatch.setattr(superposition, "MANY_SAMPLES", 1000)
    slow = [values(channel, u, t, side) for t in grids for side in ("left", "right")]
    for a, b in zip(quick, slow, strict=True):
        np.testing.assert_allclose(a, b, atol=2e-12)


def test_samples_of_a_sine_tend_to_the_sine():
    """Straight lines between samples T apart miss a sine by ω²T²/8."""
    n, T, omega = 4000, 0.002, 3.0
    t = np.linspace(0, 7.9, 500)
    u = Samples(np.sin(omega * T * np.arange(n)), T, "first")
    gap = np.abs(values(H, u, t) - values(H, Sine(omega), t)).max()
    assert 1e-8 < gap < 2 * omega**2 * T**2 / 8


def test_ten_thousand_samples_take_few_pieces(monkeypatch):
    """Superposed, they cost one pulse; solved one by one, several pieces for each sample."""
    solved = []
    one_piece = collocation._Stepper._piece
    monkeypatch.setattr(
        collocation._Stepper, "_piece", lambda *given: solved.append(1) or one_piece(*given)
    )
    v = np.random.default_rng(1).normal(size=10_000)
    t = 0.04 * np.arange(10_000)
    y = values(H, Samples(v, 0.04), t)
    assert 0 < len(solved) < 2_000
    part = Samples(v[:60], 0.04)  # few enough to be solved piece by piece
    np.testing.assert_allclose(y[:60], values(H, part, t[:60]), atol=1e-12)
    # By the end of each sample S has moved by λ times the integral of v − S(t − τ); over all of
    # them: S(end) = λ (T Σ v − ∫ S up to τ before the end), S between samples by Gauss.
    node, weight = np.polynomial.legendre.leggauss(8)
    cells = 0.04 * np.arange(9997)  # even times for each node, so that they are quick too
    S = np.array([values(H, Samples(v, 0.04), cells + 0.02 * (x + 1)) for x in node])
    area = weight @ S * 0.02
    moved = RATE * (0.04 * v[:9999].sum() - area.sum())
    assert y[9999] == pytest.approx(moved, abs=1e-10)


# Limits on work --------------------------------------------------------------------------------
def test_a_lattice_that_never_thins_out_ends_with_a_sentence(monkeypatch):
    """Two incommensurate echoes without smoothing: ever more jumps, so it stops and says where."""
    parts = [
        Sum("e = r - a - b"),
        Block("half", sp.Rational(1, 2), "e -> y"),
        Block("first", sp.exp(-s / 10) * 9 / 10, "y -> a"),
        Block("second", sp.exp(-s * sp.Rational("0.1414213562")) * s / (s + 1), "y -> b"),
    ]
    channel = Diagram(parts, outputs=["y"]).at()["r", "y"]
    assert pieces(channel, Step(), 3.0) < 1000
    assert collocation.MAX_PIECES == 20_000  # some ten seconds of work: all of it with --long
    most = collocation.MAX_PIECES if effort.long else 2_000
    monkeypatch.setattr(collocation, "MAX_PIECES", most)
    with pytest.raises(LimitError, match=rf"{most} pieces by t = .* ask for a shorter time"):
        channel.response(Step(), [1000.0])
