"""The frequencies at which a loop bends: its corners, those of its blocks, and of its delays."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from scipy.linalg import eigvals

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients

UNDAMPED = 1e-7  #: relative damping that a multiple pole may seem to have by rounding

Side = dict[tuple[int, Fraction], float]


def corners(blocks: list[BlockCoefficients]) -> Array:
    """Moduli (rad/s) of the zeros and poles of blocks, taken between delays, and 1/delays."""
    found = [np.zeros(0)]
    for block in blocks:
        for side in (block.num, block.den):
            found += [np.abs(_roots(side, tau)) for tau in {tau for _, tau in side}]
        found.append(np.array([1 / float(tau) for tau in block.delays if tau]))
    rates = np.concatenate(found)
    return np.asarray(rates[(rates > 0) & np.isfinite(rates)])


def slow_corners(system: DelaySystem) -> Array:
    """Moduli (rad/s) of poles and zeros of a loop as it is far below 1/delay, and once closed.

    There e^{−sτ} is 1, and the loop L = C (sI − A)⁻¹ B + D of order n: what a slow inner loop
    brings is in no block. Zeros are eigenvalues of the pencil [[A − sI, B], [C, D]].
    """
    m = len(system.delays)
    r, p = system.inputs, system.outputs
    B2, C2, D22 = system.inner
    through = np.eye(m) - D22
    if m and np.linalg.cond(through) > 1e12:
        return np.zeros(0)
    back = np.linalg.solve(through, np.hstack([C2, system.D[p:, :r]])) if m else np.zeros((0, 0))
    n = len(system.A)
    inner = np.vstack([np.hstack([B2, np.zeros((n, 0))]), system.D[:p, r:]])
    whole = np.block([[system.A, system.B[:, :r]], [system.C[:p], system.D[:p, :r]]])
    whole = whole + inner @ back if m else whole
    unit = np.diag(np.r_[np.ones(n), np.zeros(len(whole) - n)])
    closed = whole - np.diag(np.r_[np.zeros(n), np.ones(len(whole) - n)])
    found = [np.linalg.eigvals(whole[:n, :n])]
    found += [eigvals(pencil, unit) for pencil in (whole, closed)]
    rates = np.abs(np.concatenate(found))
    return np.asarray(rates[(rates > 0) & np.isfinite(rates)])


def removable_poles(block: BlockCoefficients) -> list[complex]:
    """The poles (rad/s) other than 0 at which a block with delays is finite, as its zeros are."""
    if {tau for _, tau in block.den} != {Fraction(0)} or not any(block.delays):
        return []
    return [complex(p) for p in _roots(block.den, Fraction(0)) if p and _vanishes(block.num, p)]


def undamped_poles(block: BlockCoefficients) -> list[complex]:
    """The poles (rad/s) other than 0 that a block has on the imaginary axis to rounding."""
    if any(tau for _, den in block.sections for _, tau in den):
        return []
    poles = np.concatenate([_roots(den, Fraction(0)) for _, den in block.sections])
    return [complex(0, p.imag) for p in poles if p and abs(p.real) <= UNDAMPED * abs(p)]


def _roots(side: Side, tau: Fraction) -> Complex:
    """The roots of the polynomial in s that stands beside one delay."""
    polynomial = {k: c for (k, delay), c in side.items() if delay == tau}
    top = max(polynomial)
    return np.asarray(np.roots([polynomial.get(k, 0.0) for k in range(top, -1, -1)]), complex)


def _vanishes(side: Side, s: complex) -> bool:
    with np.errstate(all="ignore"):
        parts = np.array([c * s**k * np.exp(-s * float(tau)) for (k, tau), c in side.items()])
    return bool(abs(parts.sum()) <= 1e-8 * np.abs(parts).sum())
