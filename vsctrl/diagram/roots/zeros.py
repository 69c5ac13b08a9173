"""The zeros of a channel: those roots of its numerator that its denominator does not share.

The numerator is a quasi-polynomial N(s) = Σ c sᵏ e^{−sτ}. Its roots are those of the autonomous
system N(d/dt) ξ = 0, which the machinery for poles finds; a delay that all terms share has none.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from vsctrl.arrays import Complex
from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.realisation.assembly import realise
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.roots import box, rectangle, rightmost
from vsctrl.diagram.roots.order import first, ordered
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients
from vsctrl.diagram.symbolic.quasi_polynomial import QuasiPolynomial
from vsctrl.errors import InputError

POINTS = 64  #: on the circle round a root on which the denominator's turns are counted
NEAR = (1e-6, 1e-3)  #: its radius relative to the root's size, of simple and of multiple roots
MOST_SHARED = 8  #: rounds in which more roots are asked for in the place of shared ones


def zeros(sides: tuple[QuasiPolynomial, QuasiPolynomial], n: int) -> Complex:
    """The n rightmost zeros (rad/s) of N/Δ, pairs whole. Errors: see `Channel.zeros`."""
    num, den = sides
    system = _dynamics(num)
    if system is None:
        raise InputError(
            "zeros: the highest power of s in the numerator is delayed, so that infinitely many "
            "zeros lie ever further right; ask for those in a rectangle, zeros_in(re, im)."
        )
    rightmost.check_roots(system, n)
    asked = n
    for _ in range(MOST_SHARED):
        found = rightmost.rightmost(system, asked)
        own = _unshared(found, den, num)
        if len(own) >= n or len(found) < asked:
            break
        asked = asked + 2 * (n - len(own)) + 2
    return first(own, n)


def zeros_in(sides: tuple[QuasiPolynomial, QuasiPolynomial], re: object, im: object) -> Complex:
    """The zeros (rad/s) of N/Δ in a rectangle. Errors: see `Channel.zeros_in`."""
    num, den = sides
    across, up = rectangle.sides("zeros_in", re, im)
    system, mirror = _dynamics(num), 1
    if system is None:
        system, mirror = _dynamics(num.reflected()), -1
        across, up = (-across[1], -across[0]), (-up[1], -up[0])
    if system is None:
        raise InputError(
            "zeros_in: the highest power of s in the numerator lies between its delays, so that "
            "chains of zeros run off to both sides; approximate a delay by pade(…)."
        )
    if not len(system.A) and not system.delays:
        return np.zeros(0, complex)
    rectangle.check_reach("zeros_in", across, system, "re" if mirror > 0 else "−re")
    found = mirror * box.roots_in(system, across, up).roots
    return ordered(_unshared(found, den, num))


def _dynamics(num: QuasiPolynomial) -> DelaySystem | None:
    """The autonomous system whose roots are those of N; None where N is of advanced type."""
    if not num.terms:
        raise InputError("zeros: the channel is 0 for all s, so that every s is a zero of it.")
    den = num.advanced(num.least_delay).terms
    top = max(k for k, _ in den)
    if (top, Fraction(0)) not in den:
        return None
    if len(den) == 1 and top == 0:
        return DelaySystem(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0)), np.eye(0), ())
    shift = math.frexp(max(map(abs, den.values())))[1]
    level = {key: math.ldexp(c, -shift) for key, c in den.items()}
    wiring = Wiring([Block("numerator", 1, "input -> output")], ["input"], ["output"])
    one = {(0, Fraction(0)): 1.0}
    return realise(wiring, [BlockCoefficients("numerator", one, level)], (), ())


def _unshared(roots: Complex, den: QuasiPolynomial, num: QuasiPolynomial) -> Complex:
    """The roots of N as often as they are more than roots of Δ: both are counted by their turns."""
    out: list[complex] = []
    delay_s = max((float(tau) for _, tau in num.terms), default=0.0)
    typical = 1 / delay_s if delay_s else float(np.abs(roots).max(initial=0.0)) or 1.0
    for root in np.unique(roots):
        times = int((roots == root).sum())
        # A root at 0 is found to rounding only.
        size = abs(root) if abs(root) > 1e-9 * typical else 1e-3 * typical
        radius = NEAR[times > 1] * size
        circle = root + radius * np.exp(2j * np.pi * np.arange(POINTS) / POINTS)
        with np.errstate(all="ignore"):
            values = den(circle)
            turns = np.angle(np.roll(values, -1) / values).sum() / (2 * np.pi)
        shared = round(float(turns)) if math.isfinite(turns) else 0
        out += [complex(root)] * max(times - shared, 0)
    return np.array(out, complex)
