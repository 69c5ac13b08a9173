"""Controllers that differentiate, dead time before, between or behind: the order of blocks in
series changes no transfer function, and so no answer and no refusal of what it does not touch.

Oracles: integration of the neutral equation on a fine grid, and the gains of all blocks put into
one matrix at points of the right half plane, which knows nothing of states or derivatives.
"""

from itertools import pairwise, permutations

import numpy as np
import pytest
from effort import share
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Rational, exp, lambdify

from vsctrl.diagram import Block, Diagram, Ramp, Sine, Step, Sum
from vsctrl.errors import ImproperError, InputError
from vsctrl.symbols import s

LATE = 0.5
PD, LAG, DELAY = Rational("0.5") * (1 + Rational("0.36") * s), 1 / (s + 1), exp(-s / 2)
ORDERS = list(permutations([PD, LAG, DELAY]))
T = np.array([0.3, 0.8, 1.1, 2.2, 3.9])


def loop(chain, signals="eaby"):
    blocks = [
        Block(f"b{i}", gain, f"{u} -> {y}")
        for i, (gain, (u, y)) in enumerate(zip(chain, pairwise(signals), strict=True))
    ]
    return Diagram([Sum("e = r - y"), *blocks], ["r"], list(signals)).at()


def integrated(r, at):
    """y of y′ = −y + ½ e(t−τ) + 0.18 e′(t−τ), e = r − y: ξ = y − 0.18 e(t−τ) has no derivatives.

    ξ′ = −ξ + 0.32 e(t−τ), in which e is known from the delay before.
    """
    n = 4000
    h = LATE / n
    late, xi, y = np.zeros(n + 1), 0.0, []
    for start in np.arange(0.0, T.max(), LATE):
        times = start + h * np.arange(n + 1)
        # Exact where e is linear between the grid's times.
        a, b, decay = late[:-1], np.diff(late) / h, np.exp(-h)
        push = 0.32 * (a * (1 - decay) + b * (h - 1 + decay))
        values = [xi]
        for p in push:
            values.append(values[-1] * decay + p)
        out = np.array(values) + 0.18 * late
        xi, late = values[-1], r(times) - out
        y += out[:-1].tolist()
    return np.array([y[round(t / h)] for t in at])


@pytest.mark.parametrize("chain", ORDERS, ids=lambda c: " ".join(str(g) for g in c))
@pytest.mark.parametrize(
    ("signal", "r"),
    [(Step(), np.ones_like), (Ramp(), lambda t: t), (Sine(2.0), lambda t: np.sin(2 * t))],
)
def test_a_delay_anywhere_in_a_pd_loop_gives_the_same_answer(chain, signal, r):
    y = loop(chain)["r", "y"].response(signal, T).outputs
    # e is taken to be linear on h = 1e-4: h²/12 of its second derivative, 1e-9.
    np.testing.assert_allclose(y, integrated(r, T), atol=1e-8)


@pytest.mark.parametrize("chain", ORDERS, ids=lambda c: " ".join(str(g) for g in c))
def test_of_a_step_only_the_signals_that_hold_an_impulse_are_refused(chain):
    """Behind the PD and before the lag there is one; a ramp and a sine are answered everywhere."""
    system = loop(chain)
    for target, behind in zip("aby", (chain[:1], chain[:2], chain), strict=True):
        impulse = PD in behind and LAG not in behind
        if impulse:
            with pytest.raises(ImproperError, match=f"to '{target}' is improper.*of 'r'"):
                system["r", target].response(Step(), T)
        else:
            system["r", target].response(Step(), T)
        for signal in (Ramp(), Sine(2.0)):
            out = system["r", target].response(signal, T).outputs
            if behind == (PD,):
                e, beside = (
                    system["r", "e"].response(signal, at).outputs
                    for at in (T, np.concatenate([T + 1e-5, T - 1e-5]))
                )
                slope = (beside[: len(T)] - beside[len(T) :]) / 2e-5
                np.testing.assert_allclose(out, 0.5 * (e + 0.36 * slope), atol=1e-8)


@pytest.mark.parametrize("chain", ORDERS, ids=lambda c: " ".join(str(g) for g in c))
def test_the_channels_of_such_a_loop_pass_their_own_checks_and_share_their_poles(chain):
    system = loop(chain)
    H = system["r", "y"]
    assert H.poles(1)[0] == pytest.approx(system.poles(1)[0], rel=1e-9)
    assert H.pade(6).worst((0.01, 3.0))[1] < 1e-4
    w = np.geomspace(0.01, 100, 40) * 1j
    gain = PD * LAG * DELAY / (1 + PD * LAG * DELAY)
    np.testing.assert_allclose(
        H.realisation.transfer(w)[:, 0, 0], lambdify(s, gain, "numpy")(w), rtol=1e-10
    )


@pytest.mark.parametrize("second", [Rational(1, 10**9), Rational(1, 10**4), 1, 10**6])
@pytest.mark.parametrize("gain", [Rational(1, 10**8), 1, 10**5])
def test_neither_the_unit_of_time_nor_that_of_a_signal_decides_what_is_a_derivative(second, gain):
    """A PD controller in nanoseconds, or one from metres to newtons, is a PD controller."""
    pd = gain * (1 + Rational("0.36") * s * second) / 2
    for chain in permutations([pd, 1 / (1 + s * second) / gain, exp(-s * second / 2)]):
        y = loop(chain)["r", "y"].response(Step(), 1.1 * float(second) * np.ones(1)).outputs
        assert y[0] == pytest.approx(0.28053843377522, rel=1e-12)


def test_an_advanced_loop_is_refused_by_the_names_of_its_blocks():
    """x = PD(r − y), y = x(t − τ) and no lag: each pass differentiates once more."""
    parts = [
        Sum("e = r - y"),
        Block("derivative action", 1 + s / 3, "e -> u"),
        Block("dead time", exp(-s), "u -> y"),
        Block("meter", 1 / (s + 1), "y -> m"),
    ]
    with pytest.raises(InputError, match=r"derivative action, dead time differentiates.*advanced"):
        Diagram(parts, ["r"], ["y", "m"]).at()["r", "m"].response(Step(), T)
    with pytest.raises(InputError, match=r"filter 'derivative action'"):
        Diagram(parts, ["r"], ["y", "m"]).at().poles(2)


def test_what_no_input_reaches_does_not_disturb_a_channel():
    """Its rounding would: a fast loop that is not driven cuts the pieces of one that is."""
    parts = [
        Sum("e = r - y"),
        Block("plant", exp(-s / 10) / (s + 1), "e -> y"),
        Sum("d = w - z"),
        Block("advanced", s * exp(-s), "d -> z"),
        Sum("both = y + z"),
    ]
    system = Diagram(parts, ["r", "w"], ["y", "both"]).at()
    one = Diagram(parts[:2], ["r"], ["y"]).at()["r", "y"].response(Step(), T).outputs
    np.testing.assert_array_equal(system["r", "y"].response(Step(), T).outputs, one)
    np.testing.assert_array_equal(system["r", "both"].response(Step(), T).outputs, one)


# Random diagrams -------------------------------------------------------------------------------
tenths = st.integers(1, 20).map(lambda k: Rational(k, 10))
delays = st.integers(1, 9).map(lambda k: exp(-Rational(k, 10) * s))


@st.composite
def gains(draw):
    a, b, c = (draw(tenths) for _ in range(3))
    lags = [a / (1 + b * s), a / (s**2 + b * s + c), a / s, a * (1 + b * s) / (1 + c * s / 5)]
    pid = [a * (1 + b * s), a * (1 + b / s + c * s / 3), a * s, s * a / (1 + b * s / 10)]
    return draw(st.sampled_from([*lags, *lags, *pid, draw(delays), draw(delays)]))


@st.composite
def wired(draw):
    """(gains, wiring, drive) of a ring with one more connection, some inputs driven."""
    n = draw(st.integers(2, 6))
    wiring = np.diag(np.ones(n - 1), -1)
    wiring[0, -1] = -1
    wiring[draw(st.integers(0, n - 1)), draw(st.integers(0, n - 1))] = draw(
        st.sampled_from([-1, 1])
    )
    drive = np.eye(n)[0]
    drive[draw(st.integers(0, n - 1))] = 1
    return [draw(gains()) for _ in range(n)], wiring, drive


@settings(max_examples=share(200, 15))
@given(wired())
def test_every_random_channel_is_realised_or_is_improper(case):
    exprs, wiring, drive = case
    n = len(exprs)
    parts = []
    for i, expr in enumerate(exprs):
        terms = {"r": drive[i]} | {f"y{j}": w for j, w in enumerate(wiring[i])}
        text = " ".join(f"{'+' if w > 0 else '-'} {name}" for name, w in terms.items() if w)
        parts += [Sum(f"u{i} = {text}"), Block(f"b{i}", expr, f"u{i} -> y{i}")]
    system = Diagram(parts, ["r"], [f"y{i}" for i in range(n)]).at()
    functions = [lambdify(s, expr, "numpy") for expr in exprs]

    def channels(p):
        P = np.array([np.broadcast_to(np.asarray(f(p), complex), p.shape) for f in functions]).T
        return np.linalg.solve(np.eye(n) - P[:, :, None] * wiring, (P * drive)[..., None])[..., 0]

    points = np.array([0.3 + 0.7j, 1 + 2j, 2.5 + 5j])
    high = 3.0 + 1j * (np.array([1e5, 1e7])[:, None] + np.linspace(0, 60, 600))
    try:
        exact = channels(points)
        largest = [np.abs(channels(line)).max(axis=0) for line in high]
    except np.linalg.LinAlgError:
        return
    for i in range(n):
        try:
            got = system["r", f"y{i}"].realisation.transfer(points)[:, 0, 0]
        except ImproperError:
            assert largest[1][i] > 10 * largest[0][i] or largest[0][i] < 1e-8
        except InputError as refused:
            assert "advanced" in str(refused) or "singular" in str(refused)
        else:
            scale = np.abs(exact[:, i]).max() + 1e-9
            np.testing.assert_allclose(got, exact[:, i], atol=1e-7 * scale)
