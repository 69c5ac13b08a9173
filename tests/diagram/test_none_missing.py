"""Lists of the rightmost roots from which none is missing, by an argument principle in mpmath.

Delays from a billionth of the slowest time constant to a billion of them, resonances that ring for
longer than the delay, chains far to the left, and roots that nearly meet.
"""

import math

import effort
import mpmath as mp
import numpy as np
import pytest
from oracles.argument_principle import Quasipolynomial
from sympy import Rational, exp

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.diagram.realisation.reduction import delays_in_loops
from vsctrl.diagram.roots.winding import phase
from vsctrl.symbols import s


def polynomial(coefficients):
    return sum(c * s ** (len(coefficients) - 1 - k) for k, c in enumerate(coefficients))


def loop(below, *late):
    """y = (r − Σ qₖ(s) e^{−s Tₖ} y)/p(s), as blocks, and its characteristic function."""
    names = [f"m{k}" for k in range(len(late))]
    parts = [Sum(f"e = r - {' - '.join(names)}")]
    if len(late) == 1:
        (above, delay), *_ = late
        parts.append(Block("plant", polynomial(above) / polynomial(below), "e -> y"))
        parts.append(Block("late", exp(-delay * s), "y -> m0"))
    else:
        parts.append(Block("plant", 1 / polynomial(below), "e -> y"))
        for name, ((gain,), delay) in zip(names, late, strict=True):
            parts.append(Block(f"late {name}", gain * exp(-delay * s), f"y -> {name}"))
    system = Diagram(parts, inputs=["r"], outputs=["y"]).at()
    return system, Quasipolynomial(((below, Rational(0)), *late))


def decimals(*texts):
    return [Rational(text) for text in texts]


def assert_zero(function, root):
    at = mp.mpc(complex(root))
    assert abs(function(at)) < 1e-9 * function.size(at), root


@pytest.mark.parametrize(
    ("below", "late", "n", "expected"),
    [
        # A resonance at 0.1028 rad/s that rings thrice as long as the delay.
        (
            decimals("1", "0.000658121", "0.0105733"),
            [(decimals("0.6831"), Rational(901))],
            7,
            [0.006752020630867602 + 0.09985325994360139j, 0.0067168101868660774 + 0.105924536896j],
        ),
        # A chain at −35/τ, behind four slow roots.
        (
            decimals("1", "0.828852", "0.08553830", "0.06223870", "0.000618689"),
            [(decimals("-0.0001176"), Rational("0.05713"))],
            8,
            [-0.0020921717332930538 + 0.27466583486550405j, -0.008134040249170608],
        ),
        # Two roots that differ by a part in 6000, far slower than all else.
        (
            decimals("1", "19.5525", "985.347826086956521", "0"),
            [(decimals("3.690677225549683e-5"), Rational(11300000))],
            6,
            None,
        ),
        # A neutral loop late by many turns of its resonance.
        (
            decimals("1", "0.000215853", "0.000168395"),
            [(decimals("0.713", "-0.614661614", "0.0334392009"), Rational(4263))],
            5,
            [0.0015448120795439363 + 0.012222078482843788j],
        ),
        # Two delays of nanoseconds round two lags of milliseconds.
        (
            decimals("1", "0.000658735", "0"),
            [
                (decimals("0.1068"), Rational("5.031e-8")),
                (decimals("-1.923"), Rational("4.305e-10")),
            ],
            6,
            None,
        ),
    ],
)
def test_the_rightmost_roots_are_listed_and_none_is_missing(below, late, n, expected):
    system, function = loop(below, *late)
    roots = system.poles(n)
    assert len(roots) >= n
    for root in roots:
        assert_zero(function, root)
    for root in expected or ():
        assert np.abs(roots - root).min() < 1e-9 * abs(root)
    assert_as_many(system, function, roots, np.random.default_rng(0))


def assert_as_many(system, function, roots, rng):
    """As many as the argument principle finds right of lines between the listed ones."""
    delay = max(float(T) for _, T in function.terms)
    real = np.unique(roots.real)[::-1]
    gaps = real[:-1] - real[1:]
    chosen = np.flatnonzero(gaps > 2e-3 * np.maximum(np.abs(real[:-1]), np.abs(real[1:])))
    counted = 0
    for k in rng.permutation(chosen)[:2]:
        line = float((real[k] + real[k + 1]) / 2)
        edge = bound(function, line)
        if not edge < math.inf:
            continue
        top = edge if edge * delay < 150 else 10 ** rng.uniform(-1, 1.6) / delay
        if np.abs(np.abs(roots.imag) - top).min() < 0.02 * top:
            continue
        with mp.workdps(28):
            count = function.count_in(line, 1.1 * edge, top, roots)
        if count is not None:
            counted += 1
            listed = ((roots.real > line) & (np.abs(roots.imag) < top)).sum()
            assert listed == count, (function.terms, line, top)
    return counted


def bound(function, line):
    """|s| beyond which the highest power of the undelayed part outweighs all the rest."""
    (below, _), *late = function.terms
    n, size = len(below) - 1, 1e-12
    while size < 1e40:
        rest = sum(abs(float(c)) * size ** (n - k) for k, c in enumerate(below) if k)
        for above, delay in late:
            if -line * float(delay) > 600:
                return math.inf
            power = len(above) - 1
            parts = sum(abs(float(c)) * size ** (power - k) for k, c in enumerate(above))
            rest += math.exp(-line * float(delay)) * parts
        if rest < 0.999 * size**n:
            return size
        size *= 2
    return math.inf


def drawn(rng):
    """Random poles, slow and fast, with one delay, two, or a double root but for a little."""
    spread, poles = rng.choice([0.5, 2, 4]), []
    while len(poles) < rng.integers(1, 5):
        rate = 10 ** rng.uniform(-spread, spread) * (1 if rng.random() < 0.15 else -1)
        if rng.random() < 0.4:
            damping = 10 ** rng.uniform(-3, 0)
            turn = abs(rate) * complex(-damping, math.sqrt(1 - damping**2))
            poles += [turn, turn.conjugate()]
        else:
            poles.append(rate)
    below = [Rational(f"{c:.6g}") for c in np.real(np.poly(poles))]
    slowest = min(abs(p) for p in poles)
    delay = Rational(f"{10 ** rng.uniform(-9, 9 if rng.random() < 0.5 else 2) / slowest:.4g}")
    gain = rng.choice([-1, 1]) * 10 ** rng.uniform(-2, 2) * float(abs(below[-1]))
    kind = rng.integers(3)
    if kind == 1:
        shorter = Rational(f"{float(delay) * 10 ** rng.uniform(-6, 0):.4g}")
        other = gain * rng.choice([-1, 1]) * 10 ** rng.uniform(-2, 2)
        return loop(
            below, ([Rational(f"{gain:.4g}")], delay), ([Rational(f"{other:.4g}")], shorter)
        )
    if kind == 2:
        # p(s) + K e^{−sτ} has a double root where p′ + τ p = 0.
        numbers, tau = np.array([float(c) for c in below]), float(delay)
        double = np.roots(np.polyadd(np.polyder(numbers), tau * numbers))
        double = double[
            (np.abs(double.imag) < 1e-9 * np.abs(double)) & (np.abs(double) * tau < 200)
        ]
        if len(double):
            at = rng.choice(double.real)
            off = 1 + rng.choice([-1, 1]) * 10 ** rng.uniform(-14, -2)
            gain = -np.polyval(numbers, at) * math.exp(at * tau) * off
    return loop(below, ([Rational(repr(float(gain)))], delay))


def test_random_lists_hold_as_many_roots_as_there_are():
    cases = effort.share(160)
    assert sum(lists_all(seed) for seed in range(cases)) > cases / 2


def lists_all(seed):
    """Assert that each listed root is one; how many counts right of a line confirmed the list."""
    rng = np.random.default_rng([1, seed])
    system, function = drawn(rng)
    roots = system.poles(int(rng.integers(2, 9)))
    for root in np.unique(roots):
        at, turns = mp.mpc(complex(root)), abs(root) * max(float(T) for _, T in function.terms)
        rounding = 1e-12 * (1 + turns) * function.size(at)
        assert abs(function(at)) < rounding or (roots == root).sum() > 1, seed
    return assert_as_many(system, function, roots, rng)


def test_steps_along_a_line_never_turn_the_determinant_by_half_a_turn():
    """Beside double roots, hidden ones among them, a step is a share of their distance."""
    rng = np.random.default_rng(4)
    average = (1 - exp(-s / 2)) / (s / 2)
    for block in (
        average**2 / 3,
        Rational(1, 10) / s * average**2,
        (1 - (1 + s) * exp(-s)) / s**2 / 2,
    ):
        parts = [Sum("e = r - y"), Block("b", block, "e -> y")]
        system = delays_in_loops(Diagram(parts, inputs=["r"], outputs=["y"]).at().autonomous)
        for line in (1e-6, 1e-3, 0.1):
            omega = 10 ** rng.uniform(-7, 1, 40)
            _, reach = phase(system, line, omega)
            assert (reach > 1e-5 * np.minimum(np.hypot(line, omega), 1)).all()
            along = omega[:, None] + reach[:, None] * np.linspace(0, 1, 33)
            matrix = system.characteristic(line + 1j * along)
            sign, _ = np.linalg.slogdet(matrix)
            turned = np.angle(sign[:, 1:] / sign[:, :-1]).cumsum(1)
            assert np.abs(turned).max() < math.pi
