"""Where |L| = 1 and where L crosses the negative real axis."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.frequency.piecewise import (
    CLOSE,
    NOTHING,
    Response,
    chebyshev_pieces,
    zero_frequencies,
)
from vsctrl.diagram.numerics.chebyshev import less

STRETCHES = 8  #: each twice as long as the last, in which a later crossing is looked for
AHEAD = 4001  #: samples that say how large |L| is beyond
FURTHEST = 1e12  #: times the highest corner, up to which a loop without delays is followed


def gain_crossings_of(L: Response, ends: Array, size: Array, level: float = 1.0) -> Array:
    """Where |L| passes 1, by rising ω: not where it is 1 throughout, nor at a pole on the axis."""
    above = less(size, level**2)
    above[np.abs(above).max(axis=1) < 1e-12 * level**2] = 0.0
    omega = zero_frequencies(ends, above)
    return np.asarray(omega[np.abs(np.abs(L(1j * omega)) / level - 1) < CLOSE])


def phase_crossings(L: Response, ends: Array, pieces: Complex) -> tuple[Array, Complex]:
    """(ω, L) where L crosses the negative real axis, by rising ω; not through 0 or infinity."""
    omega = zero_frequencies(ends, pieces.imag)
    values: Complex = L(1j * omega)
    beside = np.abs(L(1j * omega[:, None] * np.array([1 - 1e-7, 1 + 1e-7])))
    size = np.abs(values)
    # At a zero or a pole on the axis L turns by π in one place, where it is rounding.
    passes = (size > 0.03 * beside.min(axis=1)) & (size < 30 * beside.max(axis=1))
    crossing = passes & (np.abs(values.imag) < 1e-6 * size) & (values.real < 0)
    return omega[crossing], values[crossing]


def next_phase_crossing(
    L: Response, start: float, delay_s: float, known: float
) -> tuple[Array, Complex]:
    """(ω, L) beyond `start` where an L that falls to 0 is negative and largest, if there is one.

    However small |L| is there, it is what limits the gain where nothing before does: no crossing
    of |L| ≤ 1, or none but such of |L| ≤ `known`. It is looked for in ever longer stretches until
    |L| is nowhere larger beyond, as its samples over a doubling of ω say: a moving average's |L|
    ripples, and may be larger at a later crossing.
    """
    at, value = np.zeros(0), np.zeros(0, complex)
    if delay_s:  # it turns at least once in 2π/delay_s, but for lags that turn back
        ends = start + np.cumsum(np.r_[0.0, 4 * math.pi / delay_s * 2.0 ** np.arange(STRETCHES)])
    else:
        ends = start * np.array([1.0, 1e6, FURTHEST])
    for low, high in pairwise(ends):
        if known and (
            not delay_s or known >= np.abs(L(1j * np.linspace(low, 2 * low, AHEAD))).max()
        ):
            break
        grid = np.linspace(math.log(low), math.log(high), 9)
        more_at, more = phase_crossings(L, *chebyshev_pieces(L, grid, delay_s))
        larger = np.abs(more) > known
        if larger.any():
            largest = [int(np.abs(more).argmax())]
            at, value = more_at[largest], more[largest]
            known = float(np.abs(value[0]))
    return at, value


def limit_towards(L: Response, omega: float, step: float) -> complex:
    """L as ω moves on from `omega` by factors `step`: its limit, infinite or not; NaN for none."""
    near, far = (complex(value) for value in L(1j * omega * np.array([1.0, step])))
    if not abs(far) < math.inf or (abs(far) > 1e3 and abs(far) > 2 * abs(near)):
        return complex(math.inf)
    if abs(far) < NOTHING or (abs(far) < 1e-3 and abs(far) <= abs(near) / 2):
        return 0j
    if abs(far - near) > 1e-3 * abs(far):
        return complex(math.nan)  # it turns for ever, as behind a delay
    return complex(far.real) if abs(far.imag) < 1e-5 * abs(far) else far


def with_limits(
    omega: Array, values: Complex, limits: tuple[complex, complex]
) -> tuple[Array, Complex]:
    """The phase crossings with those at ω = 0 and ω = ∞, where L ends on the negative real axis."""
    for end, limit in zip((0.0, math.inf), limits, strict=True):
        if -math.inf < limit.real < 0 and limit.imag == 0:
            first = 0 if end == 0 else len(omega)
            omega, values = np.insert(omega, first, end), np.insert(values, first, limit.real)
    return omega, values
