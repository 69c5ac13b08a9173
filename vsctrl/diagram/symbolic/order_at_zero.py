"""How a channel behaves as s → 0, from the lowest powers of its blocks alone.

Numerator and denominator are sums of products of the blocks' own; what vanishes slowest in each
sum decides, unless it cancels. Then nothing is told here, and `None` says so.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from vsctrl.diagram.symbolic.coefficients import BlockCoefficients

CANCELS = 1e-9  #: of the terms that are added up, below which their sum may be rounding


class Leading(NamedTuple):
    """H(s) → value · s^power as s → 0; value 0 where H is 0 throughout."""

    power: int
    value: float
    common: int  #: zeros at 0 that numerator and denominator have in common


class Terms(NamedTuple):
    """A polynomial of first degree in each gain: which gains each term holds, and its factor."""

    holds: NDArray[np.bool_]  #: (terms, gains)
    factor: NDArray[np.float64]  #: (terms,)


def terms(polynomial: sp.Expr, letters: tuple[sp.Symbol, ...]) -> Terms:
    """The terms of N or Δ, polynomials in the block gains."""
    pairs = sp.Poly(polynomial, *letters).terms() if letters else [((), polynomial)]
    holds = np.array([powers for powers, _ in pairs], bool).reshape(len(pairs), len(letters))
    return Terms(holds, np.array([float(c) for _, c in pairs]))


def leading(sides: tuple[Terms, Terms], blocks: list[BlockCoefficients]) -> Leading | None:
    """The lowest power of s in N/Δ and its factor, None where terms cancel."""
    lowest = [[_lowest(side) for side in (block.num, block.den)] for block in blocks]
    if any(pair is None for block in lowest for pair in block):
        return None
    array = np.array(lowest, float).reshape(len(blocks), 2, 2)
    num, den = (_sum(side, array) for side in sides)
    if num is None or den is None:
        return None
    (above, size, sign), (below, unit, other) = num, den
    if not sign:
        return Leading(0, 0.0, below)
    with np.errstate(over="ignore"):
        factor = float(sign * other * np.exp(size - unit))
        return Leading(above - below, factor, min(above, below))


def common_zeros(block: BlockCoefficients) -> int:
    """How often numerator and denominator of a block are both 0 at s = 0, as a moving average's."""
    return min(_zeros(side) for side in (block.num, block.den)) if block.num else 0


def _zeros(side: dict[tuple[int, Any], float]) -> int:
    """The order of the zero at s = 0 of Σ c sᵏ e^{−sτ}: the first power whose factor is not 0."""
    top = max(k for k, _ in side) + len(side)
    for power in range(top):
        parts = [
            c * (-float(tau)) ** (power - k) / math.factorial(power - k)
            for (k, tau), c in side.items()
            if k <= power
        ]
        if abs(math.fsum(parts)) > CANCELS * math.fsum(map(abs, parts)):
            return power
    return top


def _lowest(side: dict[tuple[int, Any], float]) -> tuple[int, float] | None:
    """The lowest power of s on one side of a block, whose exponentials are 1 there."""
    if not side:
        return 0, 0.0
    power = min(k for k, _ in side)
    values = [c for (k, _), c in side.items() if k == power]
    total = math.fsum(values)
    return (power, total) if abs(total) > CANCELS * math.fsum(map(abs, values)) else None


def _sum(side: Terms, lowest: NDArray[np.float64]) -> tuple[int, float, float] | None:
    """(power, log |factor|, sign) of the lowest power in a sum of products of n and d."""
    powers, factors = lowest[:, :, 0], lowest[:, :, 1]
    with np.errstate(divide="ignore"):
        logs, signs = np.log(np.abs(factors)), np.sign(factors)
        log = np.where(side.holds, logs[:, 0], logs[:, 1]).sum(1) + np.log(np.abs(side.factor))
    sign = np.where(side.holds, signs[:, 0], signs[:, 1]).prod(1) * np.sign(side.factor)
    power = np.where(side.holds, powers[:, 0], powers[:, 1]).sum(1)
    there = sign != 0
    if not there.any():
        return 0, 0.0, 0.0
    least = there & (power == power[there].min())
    unit = log[least].max()
    parts = sign[least] * np.exp(log[least] - unit)
    total = float(parts.sum())
    if abs(total) <= CANCELS * float(np.abs(parts).sum()):
        return None
    return int(power[least][0]), float(unit + math.log(abs(total))), math.copysign(1.0, total)
