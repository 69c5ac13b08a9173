"""Roots that are near each other beside the delay, near without being one, or one: which is which.

The oracle is the scalar characteristic function, written out by hand: Newton's method with 50
digits from each root given, and what its coefficients' rounding lets anybody see.
"""

import effort
import mpmath as mp
import numpy as np
import pytest
import sympy as sp

import vsctrl as vs
from vsctrl.symbols import s

R = sp.Rational


def unity(controller, plant):
    parts = [
        vs.Sum("e = r - y"),
        vs.Block("C", controller, "e -> u"),
        vs.Block("P", plant, "u -> y"),
    ]
    return vs.Diagram(parts, inputs=["r"], outputs=["y"]).at()


def beside_a_fast_loop(first, second):
    """Two lags 1/(s/a + 1) behind a loop of 100/s with a delay of 1 ms; a < 0 is unstable."""
    parts = [
        vs.Sum("e = r - y"),
        vs.Block("f", 100 / s, "e -> v"),
        vs.Block("d", sp.exp(-s / 1000), "v -> y"),
        vs.Block("a", 1 / (s / R(first) + 1), "y -> t1"),
        vs.Block("b", 1 / (s / R(second) + 1), "y -> t2"),
        vs.Sum("t = t1 + t2"),
    ]
    return vs.Diagram(parts, inputs=["r"], outputs=["t", "y"]).at()


def test_an_unstable_loop_much_slower_than_its_delay_is_seen_to_be_unstable():
    """s³ + s² + 3s + 1 + 4e^{−s/10⁶}: +0.2013 ± 1.877j and −1.4026."""
    poles = unity(4, sp.exp(-s / 10**6) / (s**3 + s**2 + 3 * s + 1)).poles(3)
    exact = np.roots([1, 1, 3 - 4e-6, 5])
    assert len(poles) == 3
    for root in exact:  # the delay's second order is 8e-12 s²
        assert np.abs(poles - root).min() < 1e-10


def test_a_pair_beside_a_delay_of_microseconds_is_certified_as_it_is():
    """s² + s + 3e^{−2·10⁻⁶ s}."""
    loop = unity(3, sp.exp(-R(2, 10**6) * s) / (s * (s + 1)))
    exact = np.roots([1 + 3 * 2e-12, 1 - 6e-6, 3])
    found = loop.roots_right_of(-1)
    assert (found.count, found.certified) == (2, True)
    for poles in (loop.poles(2), found.roots):
        assert np.abs(np.sort_complex(poles) - np.sort_complex(exact)).max() < 1e-12


@pytest.mark.parametrize(
    ("first", "second"), [("0.01", "0.02"), ("-0.003", "0.004"), ("0.001", "0.002")]
)
def test_two_slow_lags_beside_a_fast_loop_are_two_poles(first, second):
    """−a and −b, whatever is fast beside them; an unstable one is no mean of the two."""
    system = beside_a_fast_loop(first, second)
    exact = sorted([-float(first), -float(second)], reverse=True)
    for poles in (system.poles(2), system["r", "t"].poles(2)):
        np.testing.assert_allclose(poles, exact, rtol=1e-12)
    found = system.roots_right_of(0)
    assert found.certified
    assert found.count == len(found.roots) == sum(x > 0 for x in exact)


def test_a_slow_pole_beside_a_double_root_that_cancels():
    """Two finite integrals f in a loop: 0 twice, hidden, beside s(1 + f) + 0.21f² = 0."""
    late = (1 - sp.exp(-R("0.06") * s)) / s
    parts = [
        vs.Sum("e = r0 - y2"),
        vs.Sum("f = y0 - y1"),
        vs.Block("b0", R("0.21") / s, "e -> y0"),
        vs.Block("b1", late, "f -> y1"),
        vs.Block("b2", late, "y1 -> y2"),
    ]
    system = vs.Diagram(parts, inputs=["r0"], outputs=["y0", "y1", "y2"]).at()
    with mp.workdps(40):
        f = lambda p: (1 - mp.exp(-p * mp.mpf("0.06"))) / p  # noqa: E731
        # s (1 + f) + 0.21 f² = 0
        exact = mp.findroot(lambda p: p * (1 + f(p)) + mp.mpf("0.21") * f(p) ** 2, -7e-4)
    np.testing.assert_allclose(system["r0", "y2"].poles(1), [float(exact)], rtol=1e-9)


def test_an_unstable_pole_behind_a_delay_of_many_time_constants_is_a_pole():
    """r reaches it through e^{−4s}, which is 4e-11 at its 6 rad/s, and v shows as little of it."""
    parts = [
        vs.Sum("e = r - y"),
        vs.Block("late", sp.exp(-4 * s), "e -> u"),
        vs.Block("lag", 1 / (1 + s), "u -> v"),
        vs.Block("p", 1 / (s / 6 - 1), "v -> y"),
    ]
    system = vs.Diagram(parts, inputs=["r"], outputs=["u", "v", "y"]).at()
    for target in ("u", "v", "y"):
        assert system["r", target].poles(1)[0] == pytest.approx(6.0, rel=1e-9)


@pytest.mark.parametrize("order", [3, 4, 6, 10])
def test_a_multiple_pole_is_one_and_its_check_passes(order):
    """1/(s + 1)^m: rounding parts its eigenvalues by ε^{1/m}, their mean stands for all."""
    system = vs.Diagram([vs.Block("p", 1 / (s + 1) ** order, "u -> y")]).at()
    poles = system.poles(order)
    np.testing.assert_allclose(poles, np.full(order, -1.0), rtol=1e-12)
    if order == 3:
        lines = {line.faces: line for line in system.check().lines}
        assert lines["poles against symbolic denominator"].passed


def test_the_rightmost_roots_of_a_delay_far_longer_than_the_loop_rings():
    """½e^{−sτ}/(s² + 0.02s + 1), τ = 1000 s: near its resonance, Re s ≈ ln 25/τ, not near 0."""
    loop = unity(R(1, 2), sp.exp(-1000 * s) / (s**2 + s / 50 + 1))
    top = loop.poles(2)[0]
    with mp.workdps(30):
        value = lambda p: p**2 + p / 50 + 1 + mp.exp(-1000 * p) / 2  # noqa: E731
        exact = complex(mp.findroot(value, mp.mpc(top)))
    assert abs(top - exact) < 1e-12
    w = np.linspace(0.9, 1.1, 20_001)
    highest = np.log(np.abs(0.5 / (1 - w**2 + 0.02j * w))).max() / 1000
    assert 0.8 * highest < top.real < highest


def characteristic(rates, gain, late):
    """∏(s + a) + K e^{−sτ}, its slope, and the sum of its terms' moduli."""
    below = [mp.mpf(1)]
    for a in rates:
        below = [x + a * y for x, y in zip([*below, 0], [0, *below], strict=True)]

    def value(p):
        there, slope = mp.polyval(below, p, derivative=True)
        delayed = gain * mp.exp(-p * late)
        terms = sum(abs(c) * abs(p) ** (len(below) - 1 - k) for k, c in enumerate(below))
        return there + delayed, slope - late * delayed, terms + abs(delayed) * (1 + abs(p) * late)

    return value


@pytest.mark.parametrize("seed", range(effort.share(200, 25)))
def test_random_loops_at_any_ratio_of_delay_to_time_constant(seed):
    """Delays from 1e-9 to 1e9, rates apart by 1e-9 to 1e12: each root is one, and a different one.

    A root given once is where Newton's method with 50 digits ends, to 200 times what rounding of
    the coefficients moves it; one given more often zeroes the function to rounding.
    """
    rng = np.random.default_rng([9, seed])
    exact = lambda x: R(f"{x:.6g}")  # noqa: E731
    late, base = exact(10 ** rng.uniform(-9, 9)), rng.uniform(0.2, 2, rng.integers(1, 4))
    kind = seed % 3
    if kind == 1:
        base = base[0] * (1 + 10 ** rng.uniform(-9, -1) * np.arange(len(base)))
    elif kind == 2:
        base = base * 10 ** rng.uniform(-6, 6, len(base))
    rates = [exact(x * rng.choice([1, 1, 1, -1])) for x in base]
    size = float(abs(sp.prod(rates)))
    gain = exact(size * 10 ** rng.uniform(-8, 1) * rng.choice([-1, 1]))
    below = sp.expand(sp.prod([s + a for a in rates]))
    poles = unity(1, gain * sp.exp(-late * s) / below).poles(int(rng.integers(1, 6)))
    assert len(poles)
    with mp.workdps(50):
        numbers = [mp.mpf(x.p) / x.q for x in (*rates, gain, late)]
        value = characteristic(numbers[:-2], *numbers[-2:])
        for pole in np.unique(poles):
            p = mp.mpc(pole)
            at, slope, terms = value(p)
            if (poles == pole).sum() > 1:
                assert abs(at) < 1e-13 * terms
                continue
            doubt = 1e-15 * terms / abs(slope)
            for _ in range(60):
                at, slope, _ = value(p)
                p -= at / slope
            assert abs(p - mp.mpc(pole)) < max(1e-12 * abs(p), 200 * doubt)
