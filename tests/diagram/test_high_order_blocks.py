"""A block of high order answers as the same blocks of low order in series do.

Its coefficients are exact, and so are its roots, as long as they are not made floats too early.
"""

import control
import numpy as np
import pytest
import sympy as sp
from sympy import Rational, exp

from vsctrl.diagram import Block, Diagram, Step, Sum
from vsctrl.diagram.description import cascade
from vsctrl.symbols import s

HALF = Rational(1, 2)


def unity(*gains):
    signals = ["e", *(f"x{i}" for i in range(1, len(gains))), "y"]
    blocks = [
        Block(f"b{i}", gain, f"{u} -> {y}")
        for i, (gain, u, y) in enumerate(zip(gains, signals, signals[1:], strict=False))
    ]
    return Diagram([Sum("e = r - y"), *blocks], ["r"], ["y"])


def test_thirty_lags_in_one_block_are_thirty_blocks():
    """Rounded, the coefficients of (s + 1)³⁰ have their roots up to 0.3 off −1."""
    one = unity(HALF, exp(-s) / (s + 1) ** 30).at()
    many = unity(HALF * exp(-s), *[1 / (s + 1)] * 30).at()
    got, want = one.open("y").margins(), many.open("y").margins()
    assert got.gain == pytest.approx(want.gain, rel=1e-9)
    assert got.peak_sensitivity == pytest.approx(want.peak_sensitivity, rel=1e-9)
    np.testing.assert_allclose(one.poles(6), many.poles(6), rtol=1e-9)
    left = one.roots_right_of(-0.2)
    assert left.certified and left.count == many.roots_right_of(-0.2).count
    t = np.array([10.0, 40.0, 60.0])
    # The step of 1/(s + 1)³⁰ is 1 − e^{−t} Σ tᵏ/k!, that of the loop follows by swapping blocks.
    swapped = unity(1 / (s + 1) ** 30, HALF * exp(-s)).at()
    np.testing.assert_allclose(
        one["r", "y"].response(Step(), t).outputs,
        swapped["r", "y"].response(Step(), t).outputs,
        atol=1e-10,
    )
    np.testing.assert_allclose(
        Diagram([Block("b", 1 / (s + 1) ** 30, "u -> y")]).at().poles(30), -np.ones(30), rtol=1e-14
    )


def test_a_parameter_in_the_root_is_kept_apart_too():
    a = sp.Symbol("a", positive=True)
    given = unity(HALF, (s + 3 * a) * exp(-s) / (3 * a * (s + a) ** 12)).at(a=2)
    fixed = unity(HALF, (s + 6) * exp(-s) / (6 * (s + 2) ** 12)).at()
    got, want = given.open("y").margins(), fixed.open("y").margins()
    assert got.gain == pytest.approx(want.gain, rel=1e-9)
    w = np.geomspace(0.01, 10, 30) * 1j
    direct = 0.5 * (w + 6) / 6 * np.exp(-w) / (w + 2) ** 12
    for system in (given, fixed):
        np.testing.assert_allclose(system["r", "y"](w), direct / (1 + direct), rtol=1e-12)
        state_space = system["r", "y"].realisation.transfer(w)[:, 0, 0]
        np.testing.assert_allclose(state_space, direct / (1 + direct), rtol=1e-11)


@pytest.mark.parametrize("order", [6, 18])
def test_a_state_space_of_high_order_keeps_its_poles_and_its_response(order):
    rng = np.random.default_rng(order)
    A = rng.normal(size=(order, order)) - 1.2 * np.sqrt(order) * np.eye(order)
    plant = control.ss(A, rng.normal(size=(order, 1)), rng.normal(size=(1, order)), 0)
    system = unity(HALF, plant).at()
    loop = control.feedback(0.5 * plant, 1)
    w = np.geomspace(0.01, 100, 50) * 1j
    np.testing.assert_allclose(system["r", "y"](w), loop(w), rtol=1e-8)
    np.testing.assert_allclose(
        system["r", "y"].realisation.transfer(w)[:, 0, 0], loop(w), rtol=1e-8
    )
    np.testing.assert_allclose(
        np.sort_complex(np.round(system.poles(order), 9)),
        np.sort_complex(np.round(loop.poles(), 9)),
        atol=1e-7,
    )
    t = np.array([0.0, 0.5, 1.0, 1.5])
    step = control.step_response(loop, np.linspace(0, 1.5, 4)).outputs
    np.testing.assert_allclose(system["r", "y"].response(Step(), t).outputs, step, atol=1e-9)


def test_twenty_blocks_of_sixteen_digits_are_numbers_still():
    """The product of their denominators' integers is 10³²⁰, which is no float."""
    rng = np.random.default_rng(0)
    gains = [float(a) / (float(b) + float(c) * s) for a, b, c in rng.uniform(0.5, 2, (20, 3))]
    system = unity(*gains).at()
    w = np.array([0.0, 0.3, 1.0]) * 1j
    direct = np.prod([[complex(g.subs(s, p)) for p in w] for g in gains], axis=0)
    np.testing.assert_allclose(system["r", "y"](w), direct / (1 + direct), rtol=1e-12)
    assert system.open("y").margins().gain > 1


A, B = sp.symbols("a b", positive=True)
LATE = sp.Symbol("q[1]")


@pytest.mark.parametrize(
    ("num", "den"),
    [
        (1, (s + 1) ** 5),
        (3 * (s + 2) ** 2 * LATE, (s + 1) ** 3 * (s**2 + s + 4)),
        ((2 * s - 1) ** 5, (3 * s + 1) ** 5),
        ((s**2 + 1) ** 3 * (s + 5), 7 * (s + 1) ** 7),
        ((s - A) ** 3, (B * s + A) ** 4),
        (s * (1 - LATE), (s + 1) ** 4 * (s**2 + 1)),
        ((s**5 + s + 1) * s**2, s**5 + 7 * s + 3),
    ],
)
def test_the_sections_multiply_up_to_the_block(num, den):
    num, den = sp.expand(num), sp.expand(den)
    sections = cascade.sections(num, den)
    assert len(sections) > 1
    assert all(sp.degree(below, s) <= 2 or B in below.free_symbols for _, below in sections)
    for point in ({s: Rational(1, 3)}, {s: 2 + 3 * sp.I}):
        at = {**point, A: Rational(3, 7), B: Rational(5, 4), LATE: Rational(2, 9)}
        product = sp.prod(above.subs(at) / below.subs(at) for above, below in sections)
        assert complex(product / (num / den).subs(at)) == pytest.approx(1, abs=1e-14)


def test_what_cannot_be_split_stays_whole():
    """A delay in the denominator, or a numerator of high order that holds one."""
    for num, den in (
        (1, (s + LATE) ** 5),
        (s**5 + LATE, (s + 1) ** 5),
        (1, (s + 1) ** 2),
        (0, s**6),
    ):
        assert cascade.sections(sp.sympify(num), sp.expand(den)) == ((num, sp.expand(den)),)
