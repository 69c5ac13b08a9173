"""The band in which margins are looked for, and in which parts of it L is followed.

It reaches from where L is a plain power of ω to where |L| no longer matters. A delay that is long
beside the fastest corner turns L too often there to follow every turn; but it leaves |L| smooth,
and what decides is beside the places where |L| passes 1 or is largest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.frequency.crossings import gain_crossings_of
from vsctrl.diagram.frequency.piecewise import (
    DEGREE,
    Response,
    chebyshev_pieces,
    log_grid,
    zero_frequencies,
)
from vsctrl.diagram.numerics.chebyshev import slope_matrix
from vsctrl.errors import LimitError

LEAST = 0.01  #: the search may end where |L| has fallen below this
MOST_TURNED = 2e4  #: rad of delay up to which every turn of an unstable loop is followed
MOST_FOLLOWED = 2e5  #: the same of a stable one
MOST_SMOOTH = 2000  #: pieces of an |L| that is smooth
TURNS = 8  #: of all delays, that are followed on either side of a place that decides

Pieces = tuple[Array, Complex]


def band_of(L: Response, rates: Array, falls: bool) -> tuple[float, float]:
    """From where L is a plain power of ω, not of size 1, up to where it no longer matters.

    That is where |L| is below `LEAST`, if it `falls` at all, and tenfold beyond the rates.
    """
    rates = rates[(rates > 0) & np.isfinite(rates)]
    low, high = (rates.min() * 1e-3, rates.max() * 10) if len(rates) else (1e-3, 1e1)
    size, power = _power(L, low, 1 / 16)
    if power:
        # |L| = size (ω/low)^power below `low`: go a hundredfold below the crossing it points to.
        low = min(low, 1e-2 * low * size ** (-1 / power))
    size, power = _power(L, high, 16.0) if falls else (1.0, 0)
    if power < 0:
        high = max(high, 2 * high * (size / LEAST) ** (-1 / power))
    return float(max(low, 1e-250)), float(min(high, 1e250))


def _power(L: Response, omega: float, step: float) -> tuple[float, int]:
    """|L| at a frequency and the whole power of ω that it follows from there on, one step away.

    Of an |L| that ripples, as one with a delay inside does, the largest of a few neighbours counts.
    """
    ripple = step ** np.linspace(0.0, 0.5, 24)
    size, away = (np.abs(L(1j * w * ripple)).max() for w in (omega, omega * step))
    if not (0 < size < math.inf and 0 < away < math.inf):
        return 1.0, 0
    return float(size), round(math.log(away / size) / math.log(step))


def followed(
    L: Response, band: tuple[float, float], rates: Array, delay_s: float, stable: bool, level: float
) -> Pieces:
    """The pieces of L in a band, all or those that decide where its delays turn it too often.

    `rates` (rad/s) are the corners of L, `delay_s` (s) is the sum of its delays, and `level` the
    |T| down to which it matters.
    """
    low, high = band
    most = MOST_FOLLOWED if stable else MOST_TURNED
    if delay_s * high <= most:
        return chebyshev_pieces(L, log_grid(low, high), delay_s)
    every = min(high, max(most / delay_s, 10 * low))
    parts = [chebyshev_pieces(L, log_grid(low, every), delay_s)]
    try:
        parts += _deciding(L, every, high, delay_s, level)
    except LimitError:  # |L| turns too, as of a moving average: every turn up to where it is small
        high = _last_that_matters(L, every, high, rates)
        parts.append(chebyshev_pieces(L, log_grid(every, max(high, 2 * every)), delay_s))
    ends, pieces = zip(*parts, strict=True)
    return np.vstack(ends), np.vstack(pieces)


def _last_that_matters(L: Response, low: float, high: float, rates: Array) -> float:
    """The highest frequency at which |L| is not far below `LEAST`, by many samples a decade."""
    number = math.ceil(400 * math.log10(high / low))
    omega = np.geomspace(low, high, number)
    omega = np.sort(np.append(omega, rates[(rates > low) & (rates < high)]))
    matters = np.flatnonzero(~(np.abs(L(1j * omega)) < LEAST / 2))
    return 2 * float(omega[matters[-1]]) if len(matters) else low


def _deciding(L: Response, low: float, high: float, delay_s: float, level: float) -> list[Pieces]:
    """The pieces beside the frequencies at which |L| passes 1, or is largest or smallest.

    Also where |T| ≥ |L|/(1 + |L|) may first fall below `level`.
    """
    ends, squares = chebyshev_pieces(
        lambda s: np.abs(L(s)) ** 2, log_grid(low, high), 0.0, MOST_SMOOTH
    )
    size = squares.real
    levels = [1.0, level / (1 - level)] if 0 < level < 1 else [1.0]
    places: Sequence[Array] = [gain_crossings_of(L, ends, size, x) for x in levels]
    turning = zero_frequencies(ends, size @ slope_matrix(DEGREE))
    span = TURNS * 2 * math.pi / delay_s
    parts: list[Pieces] = []
    past = low
    for omega in np.sort(np.hstack([*places, turning, [low, high]])):
        first, last = max(omega - span, past), min(omega + span, high)
        if last > first * (1 + 1e-9):
            grid = np.linspace(math.log(first), math.log(last), 2 * TURNS + 1)
            parts.append(chebyshev_pieces(L, grid, delay_s))
        past = max(past, last)
    return parts
