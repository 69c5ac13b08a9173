"""Diagrams beyond figure 1: each answer against a closed form or an oracle without shared code."""

import math

import control
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from oracles.delay import Box, Network
from scipy import signal as scipy_signal

from vsctrl.diagram import Block, Diagram, Parabola, Ramp, Sine, Step, Sum
from vsctrl.diagram.time import collocation
from vsctrl.errors import InputError
from vsctrl.symbols import s

T1, T2, K = sp.symbols("T_1 T_2 K", positive=True)


def pieces(channel, horizon=10.0):
    return len(collocation.solve(channel.realisation, Step(), horizon).ends) - 1


def values(channel, times, signal=None):
    return np.asarray(channel.response(signal or Step(), times).outputs)


def characteristic_zero(f, roots, digits=30):
    """Newton corrections |f/f′| at each root, f in mpmath: how far each is from a true zero."""
    with mp.workdps(digits):
        return max(float(abs(f(mp.mpc(p)) / mp.diff(f, mp.mpc(p))) / (1 + abs(p))) for p in roots)


# Retarded loops --------------------------------------------------------------------------------
def pi_with_two_delays(first=T1, second=T2):
    return Diagram(
        [
            Sum("e = r - y1 - y2"),
            Block("PI", sp.Rational(1, 2) + sp.Rational(3, 10) / s, "e -> u"),
            Block("plant", 1 / (s + 1), "u -> y"),
            Block("first", sp.exp(-first * s), "y -> y1"),
            Block("second", sp.exp(-second * s), "y -> y2"),
        ],
        outputs=["y"],
    )


def pi_network(a, b, delta):
    """The same loop for the collocation oracle."""
    boxes = (Box((0.5, 0.3), (1.0, 0.0)), Box((1.0,), (1.0, 1.0)), Box((1,), (1,), a))
    wiring = np.array([[0, 0, -1, -1], [1, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0]])
    return Network((*boxes, Box((1,), (1,), b)), wiring, np.array([1, 0, 0, 0]), delta)


def test_pi_with_two_incommensurate_delays():
    """0.3 s and 0.424 s; their sums fill the time axis ever more densely, their kinks fade."""
    delta = 0.42426 / 99  # √2 ≈ 99/70, so that 70 δ and 99 δ have a mesh in common
    oracle = pi_network(70, 99, delta)
    channel = pi_with_two_delays().at(T_1=70 * delta, T_2=99 * delta)["r", "y"]
    t, y = oracle.response(np.ones_like, 6.0)
    at = slice(3, None, 97)
    # The oracle's own order is far below rounding at h = 4 ms; 1400 steps round 1e-16 each.
    np.testing.assert_allclose(values(channel, t[at]), y[at, 1], atol=1e-12, rtol=0)
    assert pieces(channel) < 200
    roots = channel.poles(8)

    def below(p):
        late = mp.exp(-p * 70 * delta) + mp.exp(-p * 99 * delta)
        return p * (p + 1) + (0.5 * p + 0.3) * late

    assert characteristic_zero(below, roots) < 1e-12


@pytest.mark.parametrize(
    ("first", "second"), [(0.08, 0.16), (0.3, 0.1 + 0.2), (0.1, 0.3), (0.08, 0.08)]
)
def test_commensurate_delays_share_their_kinks(first, second):
    """n τ and its decimal differ by an ulp at most; pieces must not double for it."""
    channel = pi_with_two_delays().at(T_1=first, T_2=second)["r", "y"]
    assert pieces(channel) < 60
    ratio = sp.nsimplify(second / first, tolerance=1e-12)
    single = pi_with_two_delays(T1, ratio * T1).at(T_1=first)["r", "y"]
    assert pieces(channel) <= pieces(single) + 2
    t, y = pi_network(round(first / 0.02), round(second / 0.02), 0.02).response(np.ones_like, 5.0)
    np.testing.assert_allclose(values(channel, t[::61]), y[::61, 1], atol=1e-12, rtol=0)


def test_powers_and_multiples_of_a_delay_are_one_thing():
    late = sp.exp(-T1 * s)
    twice = [sp.exp(-2 * T1 * s), late**2, late * late, sp.exp(-T1 * s - T1 * s)]
    loops = [
        Diagram(
            [
                Sum("e = r - v - w"),
                Block("G", 1 / (s + K), "e -> y"),
                Block("once", late, "y -> v"),
                Block("twice", q, "y -> w"),
            ],
            outputs=["y"],
        )
        for q in twice
    ]
    assert len({str(loop.transfer("r", "y")) for loop in loops}) == 1
    at = {"T_1": 0.3, "K": 0.7}
    for loop in loops:
        channel = loop.at(at)["r", "y"]
        p = np.array([0.4j, 3j, 1 + 2j])
        exact = 1 / (p + 0.7 + np.exp(-0.3 * p) + np.exp(-0.6 * p))
        np.testing.assert_allclose(channel(p), exact, rtol=1e-14)
        assert pieces(channel) < 60


def test_delays_cancel_where_they_are_written_as_powers():
    """e^{−2Ts}/e^{−Ts} is e^{−Ts}, and (1 − q²)/(1 − q) is 1 + q."""
    q = sp.exp(-T1 * s)
    assert sp.simplify(Block("b", (1 - q**2) / (1 - q), "u -> y").rational.den_expr) == 1
    channel = Diagram([Block("b", (1 - q**2) / (1 - q), "u -> y")]).at(T_1=0.5)["u", "y"]
    np.testing.assert_allclose(values(channel, [0.0, 0.4, 0.5, 2.0]), [1, 1, 2, 2], atol=1e-15)


@pytest.mark.parametrize(
    "expr",
    [
        sp.exp(-1) * sp.exp(-s),
        sp.exp(-s - 1),
        sp.powsimp(sp.exp(-1) * sp.exp(-s)),
        sp.exp(-(s + 1)),
    ],
    ids=sp.srepr,
)
def test_an_exponential_constant_merged_with_a_delay(expr):
    """exp(−s − 1), which SymPy also makes of exp(−1)·exp(−s): a delay of 1 s, a gain of 1/e."""
    channel = Diagram([Block("b", expr / (s + 1), "u -> y")]).at()["u", "y"]
    p = np.array([0.1j, 2j, 1 + 1j])
    np.testing.assert_allclose(channel(p), np.exp(-1 - p) / (p + 1), rtol=1e-14)
    t = np.array([0.5, 1.0, 1.5, 3.0])
    exact = np.where(t > 1, (1 - np.exp(1 - t)) / np.e, 0.0)
    np.testing.assert_allclose(values(channel, t), exact, atol=1e-15)


def test_an_exponential_of_a_parameter_merged_with_a_delay():
    a = sp.Symbol("a", real=True)
    for expr in (
        sp.exp(a - T1 * s),
        sp.exp(a) * sp.exp(-T1 * s),
        sp.exp(2 * a - T1 * s) / sp.exp(a),
    ):
        channel = Diagram([Block("b", expr, "u -> y")]).at(a=0.5, T_1=0.2)["u", "y"]
        assert channel(1j) == pytest.approx(np.exp(0.5 - 0.2j), rel=1e-14, abs=0)


def test_a_signal_that_reaches_a_sum_twice_counts_twice():
    """Two sums without a block between them: b = (r − y) − (y + d) = r − d − 2y."""
    diagram = Diagram(
        [
            Sum("a = r - y"),
            Sum("c = y + d"),
            Sum("b = a - c"),
            Block("G", 1 / (s + 1), "b -> y"),
        ],
        outputs=["y"],
    )
    assert sp.simplify(diagram.transfer("r", "y") - 1 / (s + 3)) == 0
    system = diagram.at()
    np.testing.assert_allclose(system.poles(), [-3.0])
    t = np.array([0.0, 0.3, 2.0])
    for name, sign in (("r", 1), ("d", -1)):
        np.testing.assert_allclose(
            values(system[name, "y"], t), sign * (1 - np.exp(-3 * t)) / 3, atol=1e-15
        )
    # And one that cancels on its way is not there.
    gone = Diagram(
        [Sum("a = r - y"), Sum("b = a + y"), Block("G", 1 / (s + 1), "b -> y")], outputs=["y"]
    )
    np.testing.assert_allclose(gone.at().poles(), [-1.0])


def test_smith_predictor():
    """C = 2 + 1/s, G = 1/(s+1): y = e^{−Ts} C G/(1 + C G) r, as if there were no delay."""
    q = sp.exp(-T1 * s)
    diagram = Diagram(
        [
            Sum("e = r - y - c"),
            Block("controller", 2 + 1 / s, "e -> u"),
            Block("plant", q / (s + 1), "u -> y"),
            Block("predictor", (1 - q) / (s + 1), "u -> c"),
        ],
        outputs=["y"],
    )
    exact = (2 * s + 1) * q / (s**2 + 3 * s + 1)
    assert sp.simplify(diagram.transfer("r", "y") - exact) == 0
    system = diagram.at(T_1=0.7)
    t = np.array([0.0, 0.5, 0.69, 0.8, 1.4, 2.1, 5.0, 9.0])
    residues, poles, _ = scipy_signal.residue([2, 1], [1, 3, 1, 0])
    late = np.maximum(t - 0.7, 0)
    free = (residues * np.exp(np.outer(late, poles))).sum(axis=1).real
    np.testing.assert_allclose(values(system["r", "y"], t), free, atol=1e-13, rtol=0)
    np.testing.assert_allclose(
        np.sort(system["r", "y"].poles(6).real)[-1], (-3 + np.sqrt(5)) / 2, rtol=1e-12
    )
    # The diagram as a whole also holds the two copies of the lag that cancel: s = −1.
    roots = system.poles(6)
    assert np.abs(roots + 1).min() < 1e-9
    f = lambda p: (p * p + 3 * p + 1) * (p + 1)  # noqa: E731
    assert characteristic_zero(f, roots) < 1e-9


def test_a_wrong_smith_predictor_against_the_oracle():
    """The predictor believes in 0.5 s where the plant has 0.7 s: two delays in the loop."""
    diagram = Diagram(
        [
            Sum("e = r - y - c"),
            Block("controller", 2 + 1 / s, "e -> u"),
            Block("lag", 1 / (s + 1), "u -> x"),
            Block("plant", sp.exp(-sp.Rational(7, 10) * s), "x -> y"),
            Block("model", sp.exp(-s / 2), "x -> m"),
            Sum("c = x - m"),
        ],
        outputs=["y"],
    )
    wiring = np.zeros((4, 4))
    wiring[0, [1, 2, 3]] = [-1, -1, 1]
    wiring[1, 0] = wiring[2, 1] = wiring[3, 1] = 1
    boxes = (Box((2, 1), (1, 0)), Box((1,), (1, 1)), Box((1,), (1,), 7), Box((1,), (1,), 5))
    t, y = Network(boxes, wiring, np.array([1, 0, 0, 0])).response(np.ones_like, 8.0)
    np.testing.assert_allclose(
        values(diagram.at()["r", "y"], t[::17]), y[::17, 2], atol=1e-12, rtol=0
    )


@pytest.mark.parametrize(
    ("signal", "laplace"),
    [
        (Step(2.0), lambda p: 2 / p),
        (Ramp(0.5), lambda p: 0.5 / p**2),
        (Parabola(3.0), lambda p: 3 / p**3),
        (Sine(2.0, 0.7), lambda p: 1.4 / (p * p + 4)),
    ],
)
def test_numerator_and_denominator_with_delays(signal, laplace):
    """(1 + q₁/2)/(s + 1 + q₂/3), by mpmath's inverse Laplace transform well after the kinks."""
    expr = (1 + sp.exp(-s / 5) / 2) / (s + 1 + sp.exp(-s * 2 / 5) / 3)
    channel = Diagram([Block("b", expr, "u -> y")]).at()["u", "y"]
    f = lambda p: (1 + mp.exp(-p / 5) / 2) / (p + 1 + mp.exp(-2 * p / 5) / 3)  # noqa: E731
    p = np.array([0.3j, 4j, 1 - 2j])
    np.testing.assert_allclose(channel(p), [complex(f(mp.mpc(complex(q)))) for q in p], rtol=1e-13)
    times = [2.3, 4.9]
    with mp.workdps(25):
        exact = [
            float(mp.invertlaplace(lambda q: f(q) * laplace(q), t, method="talbot", degree=40))
            for t in times
        ]
    # Talbot's sum with 40 nodes is good to about 10^{−0.6·40}, less what e^{−sτ} costs.
    np.testing.assert_allclose(values(channel, times, signal), exact, rtol=0, atol=1e-9)
    # And the same block as a feedback network, to rounding: v = (u − q₂ v/3)/(s + 1).
    boxes = (Box((1.0,), (1.0, 1.0)), Box((1 / 3,), (1.0,), 4), Box((0.5,), (1.0,), 2))
    wiring = np.array([[0, -1, 0], [1, 0, 0], [1, 0, 0]])
    t, y = Network(boxes, wiring, np.array([1, 0, 0])).response(signal, 5.0)
    at = slice(2, None, 29)
    np.testing.assert_allclose(
        values(channel, t[at], signal), (y[:, 0] + y[:, 2])[at], rtol=0, atol=1e-12
    )


def test_inner_and_outer_loops():
    """Cascade: an inner rate loop with its own latency inside an outer position loop."""
    diagram = Diagram(
        [
            Sum("e = r - late_y"),
            Block("outer", sp.Rational(3, 2), "e -> rate"),
            Sum("e2 = rate - late_v"),
            Block("inner", 4, "e2 -> u"),
            Block("drive", 1 / (s + 2), "u -> v"),
            Block("gyro", sp.exp(-s / 10), "v -> late_v"),
            Block("position", 1 / s, "v -> y"),
            Block("camera", sp.exp(-3 * s / 10), "y -> late_y"),
        ],
        outputs=["y"],
    )
    system = diagram.at()
    boxes = (Box((4.0,), (1.0, 2.0)), Box((1,), (1,), 1), Box((1,), (1, 0)), Box((1,), (1,), 3))
    wiring = np.zeros((4, 4))
    wiring[0, [1, 3]] = [-1, -1.5]
    wiring[1, 0] = wiring[2, 0] = wiring[3, 2] = 1
    oracle = Network(boxes, wiring, np.array([1.5, 0, 0, 0]))
    t, y = oracle.response(np.ones_like, 6.0)
    for j, name in ((0, "v"), (1, "late_v"), (2, "y"), (3, "late_y")):
        np.testing.assert_allclose(
            values(system["r", name], t[::13]), y[::13, j], rtol=0, atol=1e-12
        )
    p = np.array([0.2j, 1j, 9j])
    inner = 4 / (p + 2 + 4 * np.exp(-p / 10))
    # L at the camera sees the inner loop closed; L at the gyro sees the outer loop closed.
    np.testing.assert_allclose(system.open("y")(p), 1.5 * inner / p * np.exp(-0.3 * p), rtol=1e-13)
    G = 4 / (p + 2)
    outer = 1.5 * G / p * np.exp(-0.3 * p)
    np.testing.assert_allclose(
        system.open("late_v")(p), G * np.exp(-p / 10) / (1 + outer), rtol=1e-13
    )


# Jumps and neutral loops -----------------------------------------------------------------------
def test_a_delay_in_a_feedthrough_path_jumps():
    diagram = Diagram([Block("b", 2 + sp.exp(-s / 10), "r -> y")])
    channel = diagram.at()["r", "y"]
    t = [0.0, 0.05, 0.0999, 0.1, 0.2]
    np.testing.assert_allclose(values(channel, t), [2, 2, 2, 3, 3], atol=1e-15)
    np.testing.assert_allclose(values(channel, t, Ramp()), [0, 0.1, 0.1998, 0.2, 0.5], atol=1e-15)


@pytest.mark.parametrize("gain", [0.5, -0.5, 0.9])
def test_a_difference_equation(gain):
    """y(t) = g (1 − y(t − T)) on a step: the partial sums of a geometric series, jumps forever."""
    g = sp.Symbol("g", real=True)
    diagram = Diagram(
        [Sum("e = r - w"), Block("g", g, "e -> y"), Block("late", sp.exp(-T1 * s), "y -> w")],
        outputs=["y"],
    )
    system = diagram.at(g=gain, T_1=0.1)
    k = np.arange(60)
    partial = gain * np.cumsum((-gain) ** k)
    np.testing.assert_allclose(values(system["r", "y"], 0.1 * k + 0.03), partial, atol=1e-14)
    # t = k T itself: the right limit, also where 0.1 k is not a decimal in binary.
    np.testing.assert_allclose(
        values(system["r", "y"], np.append(0.1 * k, 7.0))[:-1], partial, atol=1e-14
    )
    # 1 + g e^{−sT} = 0: a vertical chain at Re s = ln|g|/T
    roots = system.poles(7)
    np.testing.assert_allclose(roots.real, np.log(abs(gain)) / 0.1, rtol=1e-10)
    np.testing.assert_allclose(1 + gain * np.exp(-0.1 * roots), 0, atol=1e-9)
    assert system.unstable_roots == 0


def test_a_neutral_loop_against_the_oracle():
    """y = (b s + 1)/(s + 3)·(r − y(t − 0.2)): it jumps for ever, by b at each delay."""
    b = sp.Symbol("b", positive=True)
    diagram = Diagram(
        [
            Sum("e = r - w"),
            Block("lead", (b * s + 1) / (s + 3), "e -> y"),
            Block("late", sp.exp(-s / 5), "y -> w"),
        ],
        outputs=["y"],
    )
    for top in (0.5, 0.8):
        boxes = (Box((top, 1.0), (1.0, 3.0)), Box((1,), (1,), 2))
        oracle = Network(boxes, np.array([[0, -1], [1, 0]]), np.array([1, 0]))
        t, y = oracle.response(np.ones_like, 6.0)
        system = diagram.at(b=top)
        np.testing.assert_allclose(values(system["r", "y"], t[::7]), y[::7, 0], rtol=0, atol=1e-12)
        f = lambda p, top=top: p + 3 + (top * p + 1) * mp.exp(-p / 5)  # noqa: E731
        assert characteristic_zero(f, system.poles(7)) < 1e-10
        assert system.unstable_roots == 0


# Differentiators -------------------------------------------------------------------------------
def test_a_differentiator_in_a_feedback_path_with_a_proper_closed_loop():
    """Velocity feedback: 1/(s² + s + 1 + s/2), no derivative left in the channel."""
    diagram = Diagram(
        [
            Sum("e = r - y - v"),
            Block("plant", 1 / (s**2 + s), "e -> y"),
            Block("tacho", s / 2, "y -> v"),
        ],
        outputs=["y"],
    )
    system = diagram.at()
    t = np.linspace(0, 10, 41)
    _, step = control.step_response(control.tf([1], [1, 1.5, 1]), t)
    np.testing.assert_allclose(values(system["r", "y"], t), step, atol=1e-12)
    _, rate = control.step_response(control.tf([0.5, 0], [1, 1.5, 1]), t)
    np.testing.assert_allclose(values(system["r", "v"], t), rate, atol=1e-12)
    np.testing.assert_allclose(np.sort_complex(system.poles()), np.roots([1, 1.5, 1])[::-1])


def test_a_delayed_differentiator_in_feedback():
    """1/(s² + s + 1 + s e^{−s/10}/2): a retarded loop although s e^{−sτ} stands alone in it."""
    diagram = Diagram(
        [
            Sum("e = r - y - v"),
            Block("plant", 1 / (s**2 + s), "e -> y"),
            Block("tacho", s * sp.exp(-s / 10) / 2, "y -> v"),
        ],
        outputs=["y"],
    )
    system = diagram.at()
    # The same with the derivative taken from the plant: x = 1/(s+1), y = x/s, v = x(t − 0.1)/2.
    boxes = (Box((1,), (1, 1)), Box((1,), (1, 0)), Box((0.5,), (1,), 1))
    oracle = Network(boxes, np.array([[0, -1, -1], [1, 0, 0], [1, 0, 0]]), np.array([1, 0, 0]))
    t, y = oracle.response(np.ones_like, 8.0)
    np.testing.assert_allclose(values(system["r", "y"], t[::11]), y[::11, 1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(values(system["r", "v"], t[::11]), y[::11, 2], rtol=0, atol=1e-12)
    f = lambda p: p * p + p + 1 + p * mp.exp(-p / 10) / 2  # noqa: E731
    assert characteristic_zero(f, system.poles(6)) < 1e-12


def test_a_differentiator_around_a_differentiator():
    """PD on a double integrator with acceleration feedback: 1.3 s² + 2 s + 4."""
    diagram = Diagram(
        [
            Sum("e = r - y"),
            Block("PD", 4 + 2 * s, "e -> f"),
            Sum("u = f - a"),
            Block("mass", 1 / s**2, "u -> y"),
            Block("accelerometer", sp.Rational(3, 10) * s**2, "y -> a"),
        ],
        outputs=["y"],
    )
    t = np.linspace(0, 8, 17)
    _, step = control.step_response(control.tf([2, 4], [1.3, 2, 4]), t)
    np.testing.assert_allclose(values(diagram.at()["r", "y"], t), step, atol=1e-12)


def test_an_improper_channel_is_refused_with_a_sentence():
    diagram = Diagram([Block("derivative", s, "u -> y"), Block("lag", 1 / (s + 1), "y -> z")])
    system = diagram.at()
    for ask in (
        lambda: system["u", "y"].response(Step(), [0.0, 1.0]),
        lambda: system["u", "y"].pade(3),
        lambda: system["u", "y"].poles(),
    ):
        with pytest.raises(InputError, match=r"'y' is improper.*'u'.*filter"):
            ask()
    np.testing.assert_allclose(system["u", "y"](2j), 2j)
    # What follows is proper: s/(s + 1) = 1 − 1/(s + 1)
    t = np.array([0.0, 0.5, 2.0])
    np.testing.assert_allclose(values(system["u", "z"], t), np.exp(-t), atol=1e-14)


def test_an_advanced_loop_is_refused():
    """y = r − 2 ẏ(t − T): it would need ever higher derivatives of its past."""
    diagram = Diagram(
        [Sum("e = r - w"), Block("d", 2 * s * sp.exp(-T1 * s), "e -> w")], outputs=["w"]
    )
    with pytest.raises(InputError, match=r"advanced|improper"):
        diagram.at(T_1=0.1)["r", "w"].response(Step(), [0.0, 1.0])


# Algebraic loops -------------------------------------------------------------------------------
def test_an_algebraic_loop_is_solved():
    diagram = Diagram(
        [Sum("e = r - y"), Block("gain", K, "e -> v"), Block("half", 0.5, "v -> y")],
        outputs=["y"],
    )
    channel = diagram.at(K=3.0)["r", "y"]
    assert sp.simplify(diagram.transfer("r", "y") - K / (K + 2)) == 0
    np.testing.assert_allclose(values(channel, [0.0, 1.0]), 0.6, rtol=1e-15)
    assert channel(1j) == pytest.approx(0.6, rel=1e-15, abs=0)


def test_a_singular_algebraic_loop_names_its_blocks():
    diagram = Diagram(
        [
            Sum("e = r + y"),
            Block("gain", K, "e -> v"),
            Block("half", 0.5, "v -> y"),
            Block("bystander", 7, "r -> z"),
        ],
        outputs=["y", "z"],
    )
    system = diagram.at(K=1.0)
    assert system["r", "y"](0.0) == pytest.approx(1.0)
    for ask in (
        lambda: diagram.at(K=2.0)["r", "y"].response(Step(), [0.0, 1.0]),
        lambda: diagram.at(K=2.0)["r", "y"].pade(2),
        lambda: diagram.at(K=2.0).poles(),
        lambda: diagram.at(K=2.0)["r", "y"](1j),
    ):
        with pytest.raises(InputError, match=r"gain.*half.*singular") as caught:
            ask()
        assert "bystander" not in str(caught.value)


def test_a_loop_that_is_singular_for_all_values_is_refused_in_symbols():
    diagram = Diagram(
        [Sum("e = r + y"), Block("one", K, "e -> v"), Block("inverse", 1 / K, "v -> y")],
        outputs=["y"],
    )
    with pytest.raises(InputError, match=r"one.*inverse.*singular"):
        diagram.transfer("r", "y")


def test_a_delayless_limit_may_be_singular_where_the_delayed_loop_is_not():
    """y = r + y(t − T) is a staircase; at T = 0 it is a contradiction."""
    diagram = Diagram(
        [Sum("e = r + w"), Block("one", 1, "e -> y"), Block("late", sp.exp(-T1 * s), "y -> w")],
        outputs=["y"],
    )
    np.testing.assert_allclose(
        values(diagram.at(T_1=0.5)["r", "y"], [0.0, 0.4, 0.5, 1.7]), [1, 1, 2, 4], atol=1e-14
    )
    with pytest.raises(InputError, match=r"one.*singular"):
        diagram.at(T_1=0.0)["r", "y"].response(Step(), [0.0, 1.0])


# Size and shape --------------------------------------------------------------------------------
def test_several_inputs_are_separate_channels():
    diagram = Diagram(
        [
            Sum("e = r - m"),
            Block("C", 2, "e -> u"),
            Sum("f = u + d"),
            Block("G", 1 / (s + 1), "f -> y"),
            Sum("n = y + noise"),
            Block("late", sp.exp(-s / 4), "n -> m"),
        ],
        inputs=["r", "d", "noise"],
        outputs=["y"],
    )
    system = diagram.at()
    p = np.array([0.3j, 2j])
    below = p + 1 + 2 * np.exp(-p / 4)
    for name, above in (("r", 2), ("d", 1), ("noise", -2 * np.exp(-p / 4))):
        np.testing.assert_allclose(system[name, "y"](p), above / below, rtol=1e-14)
    t = np.linspace(0.1, 5, 12)
    np.testing.assert_allclose(
        values(system["r", "y"], t), 2 * values(system["d", "y"], t), atol=1e-14
    )


def test_a_channel_keeps_only_what_it_can_reach():
    """Modes behind the output or beside the input are no poles of the channel."""
    diagram = Diagram(
        [
            Block("fast", 1 / (s + 5), "u -> y"),
            Block("behind", 1 / (s - 1), "y -> z"),
            Block("beside", 1 / (s - 2), "w -> x"),
        ],
        inputs=["u", "w"],
        outputs=["y", "z", "x"],
    )
    system = diagram.at()
    np.testing.assert_allclose(system["u", "y"].poles(), [-5.0])
    np.testing.assert_allclose(system["u", "z"].poles(), [1.0, -5.0])
    np.testing.assert_allclose(system.poles(), [2.0, 1.0, -5.0])
    assert system.unstable_roots == 2


def test_a_large_spread_of_rates():
    """A pole at −1e4 beside a delay of 5 s: S = 1 − … settles before the first echo."""
    diagram = Diagram(
        [
            Sum("e = r - w"),
            Block("plant", 10000 / (s + 10000), "e -> y"),
            Block("late", sp.exp(-5 * s) / 2, "y -> w"),
        ],
        outputs=["y"],
    )
    t = np.array([1e-5, 1e-4, 1e-3, 1.0, 4.9, 5.0001, 6.0, 12.0])
    a = 1e4

    def lag(k, u):
        """The step response of (a/(s + a))^k."""
        series = sum((a * u) ** i / math.factorial(i) for i in range(k))
        return np.where(u > 0, 1 - np.exp(-a * u) * series, 0.0)

    exact = lag(1, t) - lag(2, np.maximum(t - 5, 0)) / 2 + lag(3, np.maximum(t - 10, 0)) / 4
    np.testing.assert_allclose(values(diagram.at()["r", "y"], t), exact, atol=1e-12)


def test_fourteen_blocks_are_solved_without_multiplying_out():
    """A chain of fourteen blocks with four delayed feedbacks, against a numeric solve."""
    a = sp.symbols("a1:15", positive=True)
    parts, numbers = [], {}
    feedbacks = ((0, 3), (2, 6), (5, 10), (8, 13))
    for i in range(14):
        parts.append(Block(f"b{i}", a[i] / (s + a[i]), f"u{i} -> y{i}"))
        numbers[a[i].name] = 1.0 + i / 7
    for target, source in feedbacks:
        late = sp.exp(-s * (target + 1) / 10)
        parts.append(Block(f"f{target}", late / 3, f"y{source} -> w{target}"))
    for i in range(14):
        before = "r" if i == 0 else f"y{i - 1}"
        parts.append(Sum(f"u{i} = {before}" + (f" - w{i}" if i in dict(feedbacks) else "")))
    channel = Diagram(parts, inputs=["r"], outputs=["y13"]).at(numbers)["r", "y13"]
    for w in (0.1, 1.0, 7.0):
        p = 1j * w
        M, b = np.eye(14, dtype=complex), np.zeros(14, complex)
        g = [(1 + i / 7) / (p + 1 + i / 7) for i in range(14)]
        for i in range(1, 14):
            M[i, i - 1] -= g[i]
        for target, source in feedbacks:
            M[target, source] += g[target] * np.exp(-p * (target + 1) / 10) / 3
        b[0] = g[0]
        exact = np.linalg.solve(M, b)[13]
        assert channel(p) == pytest.approx(exact, rel=1e-12, abs=0)
        assert channel.realisation.transfer(np.array([p]))[0, 0, 0] == pytest.approx(
            exact, rel=1e-10, abs=0
        )


@pytest.mark.parametrize(("gain", "count"), [(0.5, 0), (1.5, np.inf)])
def test_a_neutral_loop_has_no_roots_or_infinitely_many_on_the_right(gain, count):
    """1 + k e^{−τs} = 0 has its roots on Re s = ln(k)/τ: all left, or all right, of the axis."""
    loop = Diagram(
        [Sum("e = r - w"), Block("k", gain, "e -> y"), Block("late", sp.exp(-s / 10), "y -> w")],
        outputs=["y"],
    ).at()
    assert loop.unstable_roots == count
    np.testing.assert_allclose(loop.poles(4).real, 10 * np.log(gain), rtol=1e-12)
    margins = loop.open("y").margins()
    assert margins.stable == (count == 0)
    assert margins.unstable_roots == count
