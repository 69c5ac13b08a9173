"""Random small loops: every face of a diagram against an oracle that knows only its wiring."""

import effort
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from oracles.delay import Box, Network

from vsctrl.diagram import Ramp, Sine, Step
from vsctrl.symbols import s

FEW = settings(
    max_examples=effort.share(20),
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
POINTS = [0.05j, 0.9j, 7.3j, 0.4 + 2j, -0.3 + 1j]

tenths = st.integers(1, 30).map(lambda k: k / 10)
signed = st.integers(-20, 20).filter(bool).map(lambda k: k / 10)
lags = st.integers(0, 9)


@st.composite
def boxes(draw):
    """A gain, a first-order or a second-order block, each stable, most of them delayed."""
    kind = draw(st.sampled_from(["gain", "lag", "lead", "second"]))
    steps = draw(lags)
    if kind == "gain":
        return Box((draw(signed),), (1.0,), steps)
    if kind == "lag":
        return Box((draw(signed),), (1.0, draw(tenths)), steps)
    if kind == "lead":
        # |gain at infinity| ≤ 0.3: with at most three boxes in a loop it stays below 1.
        return Box((draw(st.integers(-3, 3)) / 10, draw(signed)), (1.0, draw(tenths)), steps)
    return Box((draw(signed), draw(signed)), (1.0, draw(tenths), draw(tenths)), steps)


@st.composite
def networks(draw):
    """A chain of one to three boxes with a feedback box around it, and perhaps a bypass."""
    chain = draw(st.lists(boxes(), min_size=1, max_size=3))
    back = draw(boxes())
    # One strictly proper box in the loop keeps it retarded and free of algebraic singularities.
    lag = Box((draw(signed),), (1.0, draw(tenths)), draw(lags))
    n = len(chain)
    wiring = np.zeros((n + 2, n + 2))
    for i in range(1, n):
        wiring[i, i - 1] = 1
    wiring[n, n - 1] = 1
    wiring[n + 1, n] = 1
    wiring[0, n + 1] = draw(st.sampled_from([-1, 1]))
    drive = np.zeros(n + 2)
    drive[0] = 1
    if draw(st.booleans()):
        drive[n] = draw(st.sampled_from([-1, 1]))
    return Network((*chain, lag, back), wiring, drive)


def evaluate(expr, p):
    return sp.lambdify(s, expr, "mpmath")(p)


@FEW
@given(networks())
def test_symbols_evaluation_realisation_and_wiring_agree(network):
    diagram = network.diagram()
    system = diagram.at()
    target = f"y{len(network.boxes) - 2}"
    channel = system["r", target]
    formula, numbers = diagram.transfer("r", target), channel.expr
    got = channel(np.array(POINTS))
    real = channel.realisation.transfer(np.array(POINTS))[:, 0, 0]
    with mp.workdps(30):
        for k, p in enumerate(mp.mpc(q) for q in POINTS):
            exact = network.outputs(p)[len(network.boxes) - 2]
            # The condition of the loop equations is that of 1/|det|, of order 1e3 at most here.
            share = 1e-15 * (1 + 1 / float(abs(network.determinant(p))))
            scale = 100 * share * (1 + abs(complex(exact)))
            # 30 digits, of which the loop equations may cost as many as the condition has.
            assert abs(evaluate(formula, p) - exact) < 1e-20 * (1 + abs(exact))
            assert abs(evaluate(numbers, p) - exact) < 1e-20 * (1 + abs(exact))
            assert abs(got[k] - complex(exact)) < scale
            assert abs(real[k] - complex(exact)) < scale


@FEW
@given(networks())
def test_every_pole_is_a_zero_of_the_characteristic_function(network):
    system = network.diagram().at()
    target = f"y{len(network.boxes) - 2}"
    for roots in (system.poles(6), system["r", target].poles(6)):
        with mp.workdps(40):
            for p in map(mp.mpc, roots):
                f, df, d2f = (mp.diff(network.characteristic, p, k) for k in (0, 1, 2))
                # A simple root to 1e-9, or one of a cluster to the root of 1e-16.
                step = abs(f / df) if df else mp.inf
                pair = mp.sqrt(abs(2 * f / d2f)) if d2f else mp.inf
                assert min(step, pair) < 1e-6 * (1 + abs(p))
                assert step < 1e-9 * (1 + abs(p)) or abs(df) < 1e-4 * (1 + abs(d2f))
        assert len(roots) == 0 or np.abs(
            np.sort_complex(roots.conj()) - np.sort_complex(roots)
        ).max() < 1e-6 * (1 + np.abs(roots).max())


@FEW
@given(networks())
def test_unstable_roots_are_counted_as_by_nyquist(network):
    """Every block is stable, so det(I − P W) winds once round 0 per root on the right."""
    system = network.diagram().at()
    # Sampled so finely that its phase turns by less than a radian from point to point, which is
    # checked: closer near 0, where the slowest poles are, then by delay · dω ≤ 5 s · 0.01 rad/s.
    omega = np.concatenate([[0.0], np.geomspace(1e-4, 1, 3000), np.linspace(1, 60, 5901)[1:]])
    around = network.determinant_on_axis(omega)
    if np.abs(around).min() < 0.05:  # too near the axis to count in samples
        return
    turn = np.angle(around[1:] / around[:-1])
    assert np.abs(turn).max() < 1
    rest = np.angle(around[-1])
    roots = -(turn.sum() - rest) / np.pi  # from 0 to 60 rad/s, then back to det(∞) = 1
    if abs(roots - round(roots)) > 0.02:
        return
    assert system.unstable_roots == round(roots)
    right = system.poles(12)
    assert (right.real > 0).sum() == round(roots)


@FEW
@given(networks(), st.sampled_from([Step(1.0), Ramp(2.0), Sine(1.7, 0.8)]))
def test_the_response_is_that_of_fine_collocation(network, signal):
    t, y = network.response(signal, 4.0)
    system = network.diagram().at()
    at = slice(1, None, 31)
    for i in range(len(network.boxes)):
        got = system["r", f"y{i}"].response(signal, t[at]).outputs
        # Errors grow like the solution, from 1e-15 of what the loop carries.
        scale = max(1.0, np.abs(y).max())
        assert np.abs(got - y[at, i]).max() < 1e-12 * scale


@FEW
@given(networks(), st.data())
def test_the_opened_loop_closes_to_the_same_determinant(network, data):
    """1 + L = det(I − P W)/det(the same, with one use of one signal cut)."""
    cut = data.draw(st.integers(0, len(network.boxes) - 1))
    loop = network.diagram().at().open(f"y{cut}")
    got = loop(np.array(POINTS))
    with mp.workdps(30):
        for k, p in enumerate(mp.mpc(q) for q in POINTS):
            ratio = network.determinant(p) / network.determinant(p, cut)
            assert abs(1 + got[k] - complex(ratio)) < 1e-12 * (1 + abs(complex(ratio)))


@settings(FEW, max_examples=8)
@given(networks())
def test_margins_against_a_fine_grid(network):
    """Nothing on a grid of 40 000 frequencies undercuts the margins reported."""
    system = network.diagram().at()
    target = f"y{len(network.boxes) - 2}"
    loop = system.open(target)
    m = loop.margins()
    omega = np.geomspace(1e-3, 60, 40_001)
    L = loop(1j * omega)
    # Where the peak is approached as ω → 0 only, the band ends 1e-3 below the slowest rate, at
    # which |L| has all but (1e-3)² of its limit.
    assert m.peak_sensitivity >= (1 - 1e-6) / np.abs(1 + L).min()
    crossings = np.flatnonzero(np.diff(np.sign(np.abs(L) - 1)))
    inside = [w for w, _ in m.gain_crossings if omega[0] < w < omega[-1]]
    assert len(inside) >= len(crossings)
    for k in crossings:
        near = min(m.gain_crossings, key=lambda c: abs(c[0] - omega[k]))
        assert omega[k] * (1 - 1e-9) <= near[0] <= omega[k + 1] * (1 + 1e-9)
        assert abs(loop(1j * near[0])) == pytest.approx(1.0, abs=1e-9)
    flips = np.flatnonzero((np.diff(np.sign(L.imag)) != 0) & (L.real[1:] < 0) & (L.real[:-1] < 0))
    for k in flips[np.abs(L[flips]) > 0.011]:  # the search may end where |L| < 0.01
        near = min(m.phase_crossings, key=lambda c: abs(c[0] - omega[k]))
        assert omega[k] * (1 - 1e-9) <= near[0] <= omega[k + 1] * (1 + 1e-9)
        assert loop(1j * near[0]) == pytest.approx(-1 / near[1], rel=1e-9, abs=0)
