"""Loops whose blocks have a pole that the loop has not: moving averages, predictors, integrators.

Expected values are limits and closed forms written beside each, and the random loops' own L(jω).
"""

import math

import mpmath
import numpy as np
import pytest
from effort import some
from oracles.random_loops import averaging
from sympy import Rational, exp

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.loop import smith
from vsctrl.symbols import s

INF = math.inf
DOUBLE = (1 - (1 + s) * exp(-s)) / s**2  # 1/2 at 0


def loop(*blocks, sign="-"):
    names = ["e", *(f"x{i}" for i in range(len(blocks) - 1)), "y"]
    parts = [Sum(f"e = r {sign} y")]
    parts += [Block(f"b{i}", b, f"{names[i]} -> {names[i + 1]}") for i, b in enumerate(blocks)]
    return Diagram(parts, inputs=["r"], outputs=["y", *names[1:-1]]).at()


def average(T):
    return (1 - exp(-T * s)) / (T * s)


def smith_loop(**values):
    known = {"lam": 2.5, "tau": 0.08, "tau_hat": 0.08, "ell": 1, "ell_hat": 1, "k_ff": 0}
    return smith().at(**known | values)


# Values ----------------------------------------------------------------------------------------
def test_two_infinities_that_cancel_leave_their_limit():
    parts = [Sum("e = r - y"), Block("a", 1 / s, "e -> y1"), Block("b", exp(-s) / s, "e -> y2")]
    H = Diagram([*parts, Sum("y = y1 - y2")], inputs=["r"], outputs=["y"]).at()["r", "y"]
    assert H(0) == pytest.approx(1 / 2, rel=1e-14)
    # y1 − y2 → 1 − s/2, so that H → 1/2 − s/8.
    for w in np.geomspace(1e-12, 1e-4, 9):
        assert H(1j * w) == pytest.approx(1 / 2 - 1j * w / 8, rel=1e-14, abs=w**2)


@pytest.mark.parametrize(
    ("system", "expected"),
    [
        (loop(Rational(3, 4) / (s + 1), average(Rational("0.55"))), 3 / 7),
        (loop((1 - exp(-s)) / s, (1 - exp(-s)) / s), 1 / 2),
        (loop((1 - exp(-s)) / (2 * s), exp(-s), sign="+"), 1),
        (loop(1 + 1 / s, 1 / s, s), 1),
        (loop(Rational("0.29") / s**2, -Rational("0.47") * s / (1 + Rational("0.11") * s)), 1),
        (loop(-DOUBLE / 2), -1 / 3),
        (loop(-(((1 - exp(-s)) / s) ** 2) / 2), -1),
        (loop(1 / s, s / (s + 1), sign="+"), INF),
        (loop(s / (s + 1)), 0),
    ],
)
def test_the_value_at_zero_is_a_limit_or_infinite(system, expected):
    found = system["r", "y"](0)
    assert found == pytest.approx(expected, rel=1e-14) if expected < INF else np.isinf(found)


def test_what_stands_between_cancelling_blocks_has_its_own_limit():
    system = loop(1 + 1 / s, 1 / s, s)
    assert [system["r", x](0) for x in ("y", "e", "x0")] == pytest.approx([1, 0, 1], abs=1e-15)


def test_a_finite_spectrum_predictor_is_smooth_at_its_pole():
    """(1 − e^{−(s−1)})/(s − 1) is 1 at s = 1, and 1 − x/2 beside it."""
    H = loop((1 - exp(-(s - 1))) / (s - 1))["r", "y"]
    assert H(1) == pytest.approx(1 / 2, rel=1e-14)
    for x in (1e-9, 1e-7j, -1e-5):
        assert H(1 + x) == pytest.approx(1 / 2 - x / 8, rel=1e-9)


def test_beside_an_undamped_pole_that_cancels_the_value_is_that_of_the_rest():
    H = loop(1 / (s**2 + 1), (s**2 + 1) / (s + 1) ** 2)["r", "y"]
    L = 1 / (1 + 1j) ** 2
    assert H(1j) == pytest.approx(L / (1 + L), rel=1e-14)


def test_the_double_predictor_keeps_all_digits_at_low_frequencies():
    H = loop(-DOUBLE / 2)["r", "y"]
    for w in np.geomspace(1e-10, 1.0, 21):
        with mpmath.workdps(60):
            p = mpmath.mpc(0, w)
            L = -(1 - (1 + p) * mpmath.exp(-p)) / p**2 / 2
            expected = complex(L / (1 + L))
        assert H(1j * w) == pytest.approx(expected, rel=1e-13)


# Verdicts and margins --------------------------------------------------------------------------
def test_a_smith_predictor_of_an_integrator_is_stable_with_a_hidden_root():
    """L = 2.5(1 − e^{−0.08s} + …)/s at S_meas; 2.5/s at S_pred, where 90° last 1.571/2.5 s."""
    found = smith_loop().open("S_meas").margins()
    assert found.stable and found.unstable_roots == 0 and found.hidden_roots == (0,)
    assert found.delay == pytest.approx(0.680, abs=1e-3)
    assert math.degrees(found.phase) == pytest.approx(81.24, abs=0.01)
    assert found.gain_crossings[0][0] == pytest.approx(2.0847, abs=1e-4)
    ideal = smith_loop(k_ff=1).open("S_pred").margins()
    assert ideal.stable and ideal.delay == pytest.approx(math.pi / 2 / 2.5, rel=1e-10)
    assert "hidden: 0 rad/s" in found._repr_html_()


def test_a_smith_predictor_is_stable_as_sampled_too():
    twin = smith_loop().sampled(0.04, hold="T")
    assert twin.is_stable and twin.hidden_roots == (0,)
    # L(z) = λTₛ/(z − 1): 1 + L = 0 at z = −1 where λTₛ = 2.
    assert twin.open().margins().gain == pytest.approx(2 / (2.5 * 0.04), rel=1e-9)


def test_a_moving_average_in_an_integral_loop_delays_by_half_its_length():
    """|L| = 2/ω sinc(ω/20), arg L = −π/2 − ω/20."""
    system = loop(2, 1 / s, average(Rational(1, 10)))
    found = system.open("y").margins()
    assert found.stable and found.hidden_roots == (0,)
    ((w, phase),) = found.gain_crossings
    assert 2 / w * math.sin(w / 20) / (w / 20) == pytest.approx(1, rel=1e-12)
    assert phase == pytest.approx(math.pi / 2 - w / 20, rel=1e-12)
    assert found.delay == pytest.approx(phase / w, rel=1e-12) == pytest.approx(0.7367, abs=1e-4)


def test_a_moving_average_is_stable_as_sampled_and_has_its_gain_at_dc():
    twin = loop(Rational(3, 4) / (s + 1), average(Rational("0.55"))).sampled(0.01, hold="e")
    assert twin.is_stable and twin["r", "y"](1) == pytest.approx(3 / 7, rel=1e-12)
    assert twin["r", "y"](1 + 1e-9) == pytest.approx(3 / 7, rel=1e-7)
    assert twin.open().margins().stable


@pytest.mark.parametrize(
    ("L", "gain"),
    [(-(((1 - exp(-s)) / s) ** 2) / 2, 2), (-DOUBLE / 2, 4)],
    ids=["one", "two"],
)
def test_a_real_root_leaves_through_zero_where_the_gain_is_one_there(L, gain):
    found = loop(L).open("y").margins()
    assert found.stable and found.gain == pytest.approx(gain, rel=1e-12)
    assert found.phase_crossings[0] == (0, pytest.approx(gain, rel=1e-12))


def test_an_unstable_root_that_one_block_cancels_for_another_still_decides():
    found = loop((s - 1) / (s + 1), 2 / (s - 1)).open("y").margins()
    assert not found.stable and found.unstable_roots == 1


def test_an_unstable_pole_that_a_block_removes_itself_does_not():
    """∫₀¹ e^{t} u dt of a finite-spectrum predictor: (1 − e^{1−s})/(s − 1), at 0 equal to e − 1."""
    found = loop(-(1 - exp(1 - s)) / (s - 1) / 4).open("y").margins()
    assert found.stable and found.hidden_roots == (pytest.approx(1),)
    assert found.gain == pytest.approx(4 / (math.e - 1), rel=1e-10)


def test_random_averaging_loops_against_their_own_response():
    for seed in some(range(1000), 4):
        assert_as_its_own_response(seed)


def assert_as_its_own_response(seed):
    rng = np.random.default_rng(seed)
    drawn = averaging(rng)
    system = drawn.system()
    found = system.open("y").margins()
    omega = np.geomspace(1e-4, 1e3, 20_001)
    L = drawn.L(1j * omega)
    for w, phase in found.gain_crossings:
        at = drawn.L(np.array([1j * w]))[0]
        assert abs(at) == pytest.approx(1, rel=1e-9)
        assert np.exp(1j * phase) == pytest.approx(-at / abs(at), abs=1e-9)
    assert len(found.gain_crossings) == (np.diff(np.sign(np.abs(L) - 1)) != 0).sum()
    resolved = np.abs(1 / (1 + L))[omega * drawn.delay < 300].max()
    assert found.peak_sensitivity >= resolved * (1 - 1e-9)
    # Nyquist: the encirclements of −1 by L, from the grid, close on the right of a pole at 0.
    turned = np.unwrap(np.angle(1 + L))
    assert found.stable == (abs(turned[-1] - turned[0]) < math.pi), seed
    if found.stable and found.delay < INF:
        assert_edge_is_at(drawn, found.delay)


def assert_edge_is_at(drawn, delay):
    """With a little less delay than the margin all is well; with a little more a pair is not."""
    for factor, unstable in ((0.999, 0), (1.001, 2)):
        more = exp(-Rational(f"{delay * factor:.9g}") * s)
        assert drawn.system(more).open("y").margins().unstable_roots == unstable


@pytest.mark.parametrize(("rate", "late"), [(1, "1/2"), (2, "1/5"), (1, "3"), (20, "1/100")])
def test_a_smith_predictor_of_an_undamped_plant_hides_its_oscillation(rate, late):
    """L = C/(s² + ω²) as without delay, stable; ±jω of the model, late and not, are in no signal.

    The lead C = s/(1 + s/20) makes s³/20 + s² + s + ω² + ω² s/20, by Routh's rule stable.
    """
    late, lead = Rational(late), s / (1 + s / 20)
    lag = exp(-late * s)
    plant = 1 / (s**2 + rate**2)
    parts = [
        Sum("e = r - z"),
        Block("C", lead, "e -> u"),
        Block("P", lag * plant, "u -> y"),
        Block("M", plant, "u -> m"),
        Block("M late", lag * plant, "u -> n"),
        Sum("z = y + m - n"),
    ]
    found = Diagram(parts, inputs=["r"], outputs=["y"]).at().open("z").margins()
    assert found.stable
    assert np.allclose(sorted(root.imag for root in found.hidden_roots), [-rate] * 2 + [rate] * 2)
    assert all(root.real == 0 for root in found.hidden_roots)
    alone = loop(lead, plant).open("y").margins()
    assert alone.hidden_roots == ()
    assert found.delay == pytest.approx(alone.delay, rel=1e-6)
