"""Responses from a given past, against the method of steps and against themselves, restarted."""

import itertools
import math

import effort
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import vsctrl as vs
from vsctrl import InputError
from vsctrl.diagram import Block, Diagram, Parabola, Pulse, Ramp, Samples, Sine, Step, Sum
from vsctrl.diagram.signals.elementary import Cosine
from vsctrl.diagram.time import collocation, initial_function
from vsctrl.symbols import s

K, T1, T2 = sp.symbols("K T_1 T_2", positive=True)
REST = Step(0.0)
T = np.linspace(0.0, 5.0, 83)
ROUNDING = 2e-13  # a few hundred operations of order one
INTEGRATED = 1e-11  # what DOP853 at its smallest tolerances keeps over a few seconds


def values(channel, history, signal=REST, t=T, side="right"):
    return np.asarray(channel.response(signal, t, side, history=history).outputs)


# Oracles -----------------------------------------------------------------------------------------
def steps(slope, past, delays, kinks=(), t=T):
    """x′ = slope(t, x, late), late(i, lag) = xᵢ(t − lag), piecewise between all kinks."""
    reach = [range(int(t.max() / lag) + 2) for lag in delays]
    sums = {
        kink + sum(n * lag for n, lag in zip(counts, delays, strict=True))
        for kink in (0.0, *kinks)
        for counts in itertools.product(*reach)
    }
    ends = np.unique(np.round([0.0, *(x for x in sums if 0 < x < t.max()), t.max() + 1e-6], 12))
    pieces = []

    def at(time, i):
        if time <= 0 and not (pieces and time > -1e-13):
            return past(time)[i]
        k = min(max(np.searchsorted(ends, time + 1e-13, side="right") - 1, 0), len(pieces) - 1)
        return pieces[k](time)[i]

    x, out = np.array(past(0.0), float), np.zeros((len(t), len(past(0.0))))
    for a, b in itertools.pairwise(ends):
        middle = (a + b) / 2

        def late(i, lag, now, middle=middle, h=b - a):
            # On the side of a kink that the inside of the interval is on.
            inside = middle + (now - middle) * (1 - 1e-12 / h)
            return at(inside - lag, i)

        run = solve_ivp(
            lambda now, x, late=late: slope(now, x, lambda i, lag: late(i, lag, now)),
            (a, b), x, method="DOP853", rtol=2.3e-14, atol=1e-15, dense_output=True,
            first_step=(b - a) / 8, max_step=0.05,
        )  # fmt: skip
        pieces.append(run.sol)
        x = run.y[:, -1]
        on = (t >= a) & (t < b)
        if on.any():
            out[on] = run.sol(t[on]).T
    return out


def symbolic_steps(phi, k, tau, intervals):
    """x′ = −k x(t − τ) with past φ(t): one expression an interval, by integration."""
    t, v = sp.symbols("t v", real=True)
    before, x, pieces = phi(t), phi(sp.Integer(0)), []
    for n in range(intervals):
        x = x - k * sp.integrate(sp.expand(before.subs(t, v - tau)), (v, n * tau, t))
        pieces.append(sp.expand(x))
        before, x = pieces[-1], pieces[-1].subs(t, (n + 1) * tau)
    return [sp.lambdify(t, piece, "mpmath") for piece in pieces]


# The delay equation x′ = −K x(t − T₁) -------------------------------------------------------------
def lagging():
    return Diagram(
        [
            Sum("e = r - z"),
            Block("gain", K, "e -> v"),
            Block("integrator", 1 / s, "v -> x"),
            Block("lag", sp.exp(-T1 * s), "x -> z"),
        ],
        inputs=["r"],
        outputs=["x"],
    )


LAGGING = lagging().at(K=1.3, T_1=0.7)


@pytest.mark.parametrize("given", [2.0, lambda t: 2.0 + 0 * t])
def test_a_constant_past_gives_the_closed_form(given):
    """x = x₀ Σ (−K)ⁿ (t − (n−1)τ)ⁿ/n!, summed where t > (n−1)τ."""
    series = sum(
        (-1.3) ** n * np.where((n - 1) * 0.7 < T, T - (n - 1) * 0.7, 0.0) ** n / math.factorial(n)
        for n in range(1, 10)
    )
    y = values(LAGGING["r", "x"], {"x": given})
    np.testing.assert_allclose(y, 2 * (1 + series), atol=ROUNDING, rtol=0)


@pytest.mark.parametrize(
    ("numeric", "exact"),
    [
        (np.cos, sp.cos),
        (np.exp, sp.exp),
        (lambda t: 1 + t - 3 * t**3, lambda t: 1 + t - 3 * t**3),
    ],
    ids=["cos", "exp", "cubic"],
)
def test_a_smooth_past_gives_the_method_of_steps(numeric, exact):
    k, tau = sp.Rational(13, 10), sp.Rational(7, 10)
    pieces = symbolic_steps(exact, k, tau, 5)
    at = np.linspace(0.0, 3.49, 36)
    with mp.workdps(40):  # the powers of t cancel
        truth = [float(pieces[int(t / 0.7)](mp.mpf(t))) for t in at]
    y = values(LAGGING["r", "x"], {"x": numeric}, t=at)
    np.testing.assert_allclose(y, truth, atol=ROUNDING, rtol=0)


@pytest.mark.parametrize("kink", [-0.3, -math.pi / 10, -0.35, -0.699])
def test_a_past_with_a_kink_or_a_jump(kink):
    """The integral of the past alone on the first interval; nothing but the location matters."""
    at = np.linspace(0, 0.7, 57)
    y = values(LAGGING["r", "x"], {"x": lambda t: np.abs(t - kink)}, t=at)

    def half_square(v):
        return (v - kink) * abs(v - kink) / 2

    truth = [abs(kink) - 1.3 * (half_square(t - 0.7) - half_square(-0.7)) for t in at]
    np.testing.assert_allclose(y, truth, atol=1e-12, rtol=0)
    y = values(LAGGING["r", "x"], {"x": lambda t: np.where(t < kink, 2.0, -1.0)}, t=at)
    area = 2 * np.minimum(at, 0.7 + kink) - np.maximum(at - 0.7 - kink, 0)
    np.testing.assert_allclose(y, -1 - 1.3 * area, atol=1e-12, rtol=0)


def test_a_recorded_past_is_joined_by_straight_lines():
    """65 of them, on a grid that no halving of the delay meets; trapezia are their integral."""
    grid = np.linspace(-0.9, 0, 66)
    record = np.cos(9 * grid) + 0.1 * np.sin(200 * grid**2)

    def line(t):
        return np.interp(t, grid, record)

    at = np.linspace(0, 0.7, 15)
    y = values(LAGGING["r", "x"], {"x": line}, t=at)
    truth = []
    for t in at:
        mesh = np.unique([-0.7, *grid[(grid > -0.7) & (grid < t - 0.7)], t - 0.7])
        truth.append(record[-1] - 1.3 * np.trapezoid(line(mesh), mesh))
    np.testing.assert_allclose(y, truth, atol=1e-12, rtol=0)


def test_the_value_at_zero_may_differ_from_the_past():
    """Zero before and 1 at 0: the fundamental solution, one echo later than a constant past."""
    start = values(LAGGING["r", "x"], {"x": lambda t: np.where(t < 0, 0.0, 1.0)}, t=T)
    impulse = sum(
        (-1.3) ** n * np.where(n * 0.7 < T, T - n * 0.7, 0.0) ** n / math.factorial(n)
        for n in range(9)
    )
    np.testing.assert_allclose(start, impulse, atol=ROUNDING, rtol=0)


def test_the_delayed_signal_shows_its_past():
    at = np.array([0.0, 0.2, 0.69])
    late = values(LAGGING["r", "z"], {"x": np.sin}, t=at)
    np.testing.assert_allclose(late, np.sin(at - 0.7), atol=1e-14)
    open_loop = LAGGING.open("z")
    np.testing.assert_allclose(
        values(open_loop, {"x": np.sin}, t=at), -np.sin(at - 0.7), atol=1e-14
    )


def test_the_left_limit_at_zero_is_the_past():
    answer = LAGGING["r", "z"].response(Step(), [0.0], "left", {"x": np.cos, "r": 3.0})
    assert answer.outputs == pytest.approx(math.cos(0.7), abs=1e-14)
    assert answer.inputs == pytest.approx(3.0)
    assert values(LAGGING["r", "e"], {"r": 3.0}, Step(), [0.0], "left") == pytest.approx(3.0)
    assert values(LAGGING["r", "e"], {"r": 3.0}, Step(), [0.0]) == pytest.approx(1.0)


# Other loops -------------------------------------------------------------------------------------
def test_a_second_order_block_starts_with_the_slope_of_its_past():
    """x″ + 0.4 x′ + x = 0.8 (1 − x(t − 0.9)), x = cos(2t) before 0."""
    diagram = Diagram(
        [
            Sum("e = r - z"),
            Block("plant", 0.8 / (s**2 + 0.4 * s + 1), "e -> x"),
            Block("lag", sp.exp(-0.9 * s), "x -> z"),
        ],
        outputs=["x"],
    )
    truth = steps(
        lambda t, x, late: [x[1], 0.8 * (1 - late(0, 0.9)) - 0.4 * x[1] - x[0]],
        lambda t: (math.cos(2 * t + 0.3), -2 * math.sin(2 * t + 0.3)),
        [0.9],
    )[:, 0]
    y = values(diagram.at()["r", "x"], {"x": lambda t: np.cos(2 * t + 0.3)}, Step())
    np.testing.assert_allclose(y, truth, atol=INTEGRATED, rtol=0)


@pytest.mark.parametrize("order", [2, 3, 4])
def test_a_block_alone_swings_freely(order):
    """φ = e^{−t/2} solves (2s + 1)ⁿ y = 0, and goes on doing so; no delay tells how far to look."""
    diagram = Diagram([Block("plant", 3 / (2 * s + 1) ** order, "u -> y")])
    y = values(diagram.at()["u", "y"], {"y": lambda t: np.exp(-t / 2)})
    # Slope n − 1 of a fit of degree 10 on h = 2 s: 1e-16 (2/h)ⁿ⁻¹ 10²ⁿ⁻²/(2n−3)!!, times 2ⁿ⁻¹.
    np.testing.assert_allclose(y, np.exp(-T / 2), atol=10.0 ** (2 * order - 17), rtol=0)


def test_two_incommensurate_delays():
    """One after the other, so that the past is looked back at by both, and one alone."""
    a, b = 0.3, math.sqrt(0.5)
    diagram = Diagram(
        [
            Sum("e = r - far - near"),
            Block("plant", 1 / (s + 1), "e -> x"),
            Block("first", 1.5 * sp.exp(-T1 * s), "x -> z"),
            Block("second", sp.exp(-T2 * s), "z -> far"),
            Block("half", sp.Rational(1, 2), "z -> near"),
        ],
        outputs=["x"],
    )
    truth = steps(
        lambda t, x, late: [math.sin(t) - x[0] - 1.5 * late(0, a + b) - 0.75 * late(0, a)],
        lambda t: (1 + t**2,),
        [a, a + b],
        t=T[:60],
    )
    y = values(diagram.at(T_1=a, T_2=b)["r", "x"], {"x": lambda t: 1 + t**2}, Sine(1.0), T[:60])
    np.testing.assert_allclose(y, truth[:, 0], atol=INTEGRATED, rtol=0)


@pytest.mark.parametrize("wave", [math.sin, math.cos])
def test_a_neutral_loop(wave):
    """x′ = −x(t − ½) − 0.4 x′(t − ½): on each interval an integral of the one before.

    With y = x + 0.4 x(t − ½) it is y′ = −x(t − ½): the mesh below is the trapezium rule with
    Richardson's extrapolation to sixth order, error about (½/200)⁶.
    """
    diagram = Diagram(
        [
            Sum("v = r - a - b"),
            Block("integrator", 1 / s, "v -> x"),
            Block("a", sp.exp(-s / 2), "x -> a"),
            Block("b", 0.4 * s * sp.exp(-s / 2), "x -> b"),
        ],
        outputs=["x"],
    )

    def coarse(n):
        h, total = 0.5 / n, 10 * n
        x = [wave(3 * h * (i - n)) for i in range(n + 1)]
        for i in range(n, n + total):
            x.append(x[i] - 0.4 * (x[i - n + 1] - x[i - n]) - h / 2 * (x[i - n + 1] + x[i - n]))
        return np.array(x[n :: n // 4])

    rough, half, quarter = (coarse(n) for n in (100, 200, 400))
    fine, finer = (4 * half - rough) / 3, (4 * quarter - half) / 3
    truth = (16 * finer - fine) / 15
    at = 0.125 * np.arange(len(truth))
    y = values(diagram.at()["r", "x"], {"x": lambda t: np.array([wave(3 * v) for v in t])}, t=at)
    np.testing.assert_allclose(y, truth, atol=1e-11, rtol=0)


def test_an_input_and_a_second_input_have_pasts():
    """y = r(t − 0.4) + d(t − 0.7), d zero from 0 on."""
    diagram = Diagram(
        [
            Block("late r", sp.exp(-0.4 * s), "r -> a"),
            Block("late d", sp.exp(-0.7 * s), "d -> b"),
            Sum("y = a + b"),
        ]
    )
    at = np.linspace(0.01, 1.5, 31)
    y = values(diagram.at()["r", "y"], {"r": np.cos, "d": np.exp}, Ramp(), at)
    truth = np.where(at < 0.4, np.cos(at - 0.4), at - 0.4) + np.where(at < 0.7, np.exp(at - 0.7), 0)
    np.testing.assert_allclose(y, truth, atol=1e-14)


def test_a_differentiated_and_delayed_input():
    diagram = Diagram([Block("D", 2 * s * sp.exp(-0.4 * s), "r -> y")])
    at = np.array([0.0, 0.1, 0.39, 0.41, 1.0])
    y = values(diagram.at()["r", "y"], {"r": np.sin}, Sine(2.0), at)
    truth = np.where(at < 0.4, 2 * np.cos(at - 0.4), 4 * np.cos(2 * (at - 0.4)))
    np.testing.assert_allclose(y, truth, atol=1e-11)  # a slope of a fit loses N²/h


# Operating points --------------------------------------------------------------------------------
def pi_loop():
    return Diagram(
        [
            Sum("e = r - z"),
            Block("PI", 0.5 + 0.25 / s, "e -> c"),
            Sum("u = c + d"),
            Block("plant", 2 * sp.exp(-0.3 * s) / (s + 4), "u -> y"),
            Block("filter", s / (s / 10 + 1), "y -> rate"),
            Block("sensor", sp.exp(-T1 * s), "y -> z"),
        ],
        inputs=["r", "d"],
        outputs=["y", "rate"],
    )


@pytest.mark.parametrize("target", ["y", "c", "e", "z", "rate"])
def test_a_loop_in_steady_state_stays_there_exactly(target):
    """y = r, u = 2 r; the PI holds 2 r − d although its own input is zero."""
    rest = {"y": 1.5, "c": 3.0, "e": 0.0, "z": 1.5, "rate": 0.0}
    y = values(pi_loop().at(T_1=0.5)["r", target], {"r": 1.5, "y": 1.5, "c": 3.0}, Step(1.5))
    assert set(y) == {rest[target]}


def test_around_a_steady_state_all_is_as_around_zero():
    channel = pi_loop().at(T_1=0.5)["r", "y"]
    lifted = values(channel, {"r": 1.5, "y": 1.5, "c": 3.0}, Step(1.5) + Sine(2.0))
    np.testing.assert_allclose(lifted - 1.5, values(channel, None, Sine(2.0)), atol=ROUNDING)


def test_a_derivative_filter_was_in_steady_state_with_what_it_was_fed():
    channel = pi_loop().at(T_1=0.5)["r", "rate"]
    after = values(channel, {"r": 1.5, "y": 1.5, "c": 3.0}, Step(2.5))
    np.testing.assert_allclose(after, values(channel, None, Step()), atol=ROUNDING)


def test_a_loop_without_dynamics_holds_its_steady_state():
    diagram = Diagram(
        [
            Sum("e = r - z"),
            Block("half", sp.Rational(1, 2), "e -> y"),
            Block("lag", sp.exp(-0.3 * s), "y -> z"),
        ],
        outputs=["y"],
    )
    np.testing.assert_allclose(values(diagram.at()["r", "y"], {"r": 3.0}, Step(3.0)), 1.0)
    y = values(diagram.at()["r", "y"], {"r": 3.0}, t=[0.1, 0.4, 0.7])
    np.testing.assert_allclose(y, [-0.5, 0.25, -0.125])


@pytest.mark.parametrize("k_ff", [0.0, 1.0])
def test_figure_1_from_where_it_stood(k_ff):
    """S held at 0.2 behind a reference at 0.5 that then moves: x = S, S′ = λ(r − S(t−τ)) + k r′."""
    loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=k_ff)
    moving, at = Step(0.5) + Ramp(0.04), T[:40]
    history = {"S_ref": 0.5, "S": lambda t: 0.2 + 0.1 * t}
    truth = steps(
        lambda t, x, late: [2.5 * (0.5 + 0.04 * t - late(0, 0.08)) + 0.04 * k_ff],
        lambda t: (0.2 + 0.1 * t,),
        [0.08],
        t=at,
    )[:, 0]
    y = values(loop["S_ref", "S"], history, moving, at)
    np.testing.assert_allclose(y, truth, atol=INTEGRATED, rtol=0)
    late = np.interp(at - 0.08, [-1.0, 0.0], [0.1, 0.2])
    late[at > 0.08] = values(loop["S_ref", "S"], history, moving, at[at > 0.08] - 0.08)
    speed = 2.5 * (0.5 + 0.04 * at - late) + 0.04 * k_ff
    np.testing.assert_allclose(values(loop["S_ref", "T"], history, moving, at), speed, atol=1e-12)


# What always holds -------------------------------------------------------------------------------
def test_a_zero_past_is_rest():
    channel = LAGGING["r", "x"]
    for history in ({}, {"x": 0}, {"r": 0.0, "x": np.zeros_like}):
        np.testing.assert_array_equal(
            values(channel, history, Step()), values(channel, None, Step())
        )


def test_signals_and_pasts_add_up():
    channel = pi_loop().at(T_1=0.5)["r", "y"]
    both = values(channel, {"r": 2.0, "y": -1.0, "d": 0.5}, Pulse(0.4) + Parabola(2.0))
    parts = [
        values(channel, {"r": 1.0}, Pulse(0.4)),
        values(channel, {"r": 1.0, "y": -2.0}, Parabola(2.0)),
        values(channel, {"y": 1.0, "d": 0.5}),
    ]
    np.testing.assert_allclose(both, sum(parts), atol=ROUNDING * np.abs(both).max())


@settings(max_examples=effort.share(25), deadline=None)
@given(
    st.floats(-0.5, 3.0),
    st.floats(0.2, 2.0),
    st.sampled_from([0.1, 0.25, 0.4, 1.1]),
    st.sampled_from([0.3, 0.777, 0.5]),
    st.sampled_from([0.2, 0.6, 1.0, 2.345]),
    st.floats(0.5, 4.0),
)
def test_stopping_and_starting_again_changes_nothing(pole, gain, first, second, stop, omega):
    """At `stop` the input was on its way too, so that its past is needed as well."""
    diagram = Diagram(
        [
            Block("link", sp.exp(-T2 * s), "r -> q"),
            Sum("e = q - z"),
            Block("plant", K / (s + T1), "e -> x"),
            Block("lag", sp.exp(-sp.Symbol("L") * s), "x -> z"),
        ],
        inputs=["r"],
        outputs=["x"],
    )
    system = diagram.at(K=gain, T_1=pole, T_2=second, L=first)
    signal = Step() + Sine(omega)
    after = Step() + Sine(omega, math.cos(omega * stop)) + Cosine(omega, math.sin(omega * stop))
    recorded = collocation.solve(system["r", "x"].realisation, signal, stop + 2.0)
    history = {"r": lambda t: signal(t + stop), "x": lambda t: recorded(t + stop)[:, 0]}
    at = np.linspace(0, 1.99, 67)
    y = values(system["r", "x"], history, after, at)
    whole = recorded(at + stop)[:, 0]
    np.testing.assert_allclose(y, whole, atol=1e-11 * np.abs(whole).max(), rtol=0)


def test_long_samples_start_from_a_past_too():
    samples = Samples(np.sin(np.arange(150) / 10), 0.02)
    channel = LAGGING["r", "x"]
    both = values(channel, {"x": np.cos}, samples)
    parts = values(channel, {"x": np.cos}) + values(channel, None, samples)
    np.testing.assert_allclose(both, parts, atol=ROUNDING)


def test_a_past_is_asked_no_further_back_than_the_delay():
    asked = []

    def phi(t):
        asked.extend(t)
        return np.cos(t)

    values(LAGGING["r", "x"], {"x": phi})
    assert min(asked) > -0.7
    assert max(asked) == 0.0


def test_a_smooth_past_is_one_piece_and_a_kink_is_found_where_it_is():
    smooth = initial_function.approximate(np.cos, 1.0, sp.Rational(1, 2), "φ")
    assert len(smooth.coefficients) == 1
    bent = initial_function.approximate(
        lambda t: np.abs(t + 0.3), 0.3, initial_function.Fraction(7, 10), "φ"
    )
    assert bent.kinks == [initial_function.Fraction(-3, 10)]


# Refusals ----------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("history", "sentence"),
    [
        (3.0, r"names no signals; give a mapping"),
        ({"y": 1.0}, r"no such signal.*the diagram has"),
        ({"X": 1.0}, r"did you mean 'x'\?"),
        ({"z": 1.0}, r"'lag' has no dynamics and follows from what it is fed; name 'x' instead"),
        ({"e": 1.0}, r"the sum e = r - z has no dynamics .* name 'r' or 'x' instead"),
        ({"x": "one"}, r"'x' = 'one' is unusable; give a finite number"),
        ({"x": math.nan}, r"'x' = nan is unusable"),
        ({"x": True}, r"'x' = True is unusable"),
        ({"x": 1j}, r"is unusable"),
        ({"x": Step()}, r"is a signal, which is zero before 0"),
        ({"x": lambda t: 1.0}, r"returns float64 of shape \(\) for times of shape \(1,\)"),
        ({"x": lambda t: 1j * t}, r"returns complex128"),
        ({"x": lambda t: np.where(t < -0.5, np.nan, 1.0)}, r"is nan at t = -0\..* finite as far"),
        ({"x": math.cos}, r"cannot be called with"),
        ({"x": lambda t: np.sqrt(-t)}, r"history of 'x' is too rough to follow near t = -"),
        (
            {"x": lambda t: np.random.default_rng(1).normal(size=len(t))},
            r"too rough to follow",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:Conversion of an array:DeprecationWarning")
def test_an_unusable_history_is_refused_with_a_sentence(history, sentence):
    with pytest.raises(InputError, match=sentence):
        values(LAGGING["r", "x"], history)


@pytest.mark.parametrize(
    ("expr", "history", "sentence"),
    [
        ((s + 2) / (s + 1), {"y": np.cos}, r"zero or a delay of its own; give a number, or split"),
        (sp.exp(-s) / (s + 1), {"y": np.cos}, r"'G', as it has a zero or a delay of its own"),
        (s / (s + 1), {"y": 1.0}, r"never rests at anything but 0; leave it out"),
        (s / (s + 1), {"u": np.cos}, r"its own past does not tell its state"),
        ((s**2 + 1) / (s + 1), {"u": 1.0}, r"split it into a differentiator"),
        (s * sp.exp(-s), {"u": lambda t: np.where(t < -0.5, 1.0, 0)}, r"jumps and is differentia"),
        (s**2 * sp.exp(-s), {"u": np.cos}, r"differentiated twice"),
    ],
)
def test_a_past_that_a_block_cannot_take_is_refused(expr, history, sentence):
    diagram = Diagram([Block("G", expr, "u -> y")])
    with pytest.raises(InputError, match=sentence):
        values(diagram.at()["u", "y"], history, Parabola())


def test_functions_cannot_feed_a_loop_without_dynamics():
    diagram = Diagram(
        [Sum("e = r - z"), Block("lag", 0.5 * sp.exp(-0.3 * s), "e -> z")], outputs=["e"]
    )
    with pytest.raises(InputError, match=r"the loop .* has no dynamics.* give numbers"):
        values(diagram.at()["r", "e"], {"r": np.cos})


def test_an_impulse_behind_a_block_that_does_not_go_with_its_past_is_refused():
    """(s + 2)/(s + 1) jumps where what it is fed is not what it was in steady state with."""
    parts = [Block("lead", (s + 2) / (s + 1), "u -> y"), Block("D", s, "y -> v")]
    channel = Diagram(parts).at()["u", "v"]
    with pytest.raises(InputError, match=r"'y' jumps at t = 0, and 'v' holds a derivative of it"):
        values(channel, {"y": 1.0}, Ramp())
    assert set(values(channel, {"u": 0.5, "y": 1.0}, Step(0.5))) == {0.0}


def test_an_impulse_that_a_past_makes_is_refused():
    """A step from 0.5 to 1.5 through k s is an impulse in T; a constant reference is none."""
    channel = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1.0)["S_ref", "T"]
    with pytest.raises(InputError):
        values(channel, {"S_ref": 0.5, "S": 0.5}, Step(1.5))
    assert set(values(channel, {"S_ref": 0.5, "S": 0.5}, Step(0.5))) == {0.0}
