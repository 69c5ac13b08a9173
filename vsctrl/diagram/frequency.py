"""Exact frequency response and the margins read from it, every crossing included.

L(jω) is followed by Chebyshev pieces in log ω, halved until they hold L to rounding; crossings and
extrema are then eigenvalues of small matrices, so that however often the phase winds round, none
is missed between two samples. No Padé model is involved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsctrl.diagram.chains import Through
from vsctrl.diagram.zeros import less, slope_matrix, squared, tables, zeros
from vsctrl.errors import LimitError

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Response = Callable[[Any], Any]  #: L as a function of complex s, any shape

DEGREE = 16
MAX_PIECES = 100_000
MOST_TURNED = 2e4  #: rad of delay up to which the crossings of an unstable loop are followed
EDGE = 1e-12  #: that near to −1, L is at the edge of stability
CLOSE = 1e-3  #: |L| or |T| at a crossing, from what it crosses; at a pole on the axis it is far off
NOTHING = 1e-9  #: a limit of |L| below this is rounding
LEAST = 0.01  #: the search may end where |L| has fallen below this


@dataclass(frozen=True)
class Margins:
    """How far the loop of a return difference 1 + L is from instability, exactly.

    Frequencies in rad/s, phases in rad, delays in s; infinity where nothing limits. `gain` is the
    least factor of 1 or more at which roots cross the axis, `gain_down` the largest below 1 (0 if
    there is none). For a loop that is not `stable`, `unstable_roots` are on or right of the
    imaginary axis, and `delay` is negative: the change of delay that brings the nearest crossing
    back to −1. Of a loop L = 0 the bandwidth is 0.
    """

    gain: float
    gain_down: float
    phase: float
    delay: float
    peak_sensitivity: float  #: max |1/(1 + L)|, also called Ms
    peak_frequency: float
    peak_complementary: float  #: max |L/(1 + L)|, also called Mt
    complementary_frequency: float
    bandwidth: float  #: where |L/(1 + L)| first falls 3 dB below its value at ω = 0, if not 0
    gain_crossings: tuple[tuple[float, float], ...]  #: (ω, phase margin there), by rising ω
    phase_crossings: tuple[tuple[float, float], ...]  #: (ω, gain margin there), by rising ω
    stable: bool
    unstable_roots: float  #: infinite where a neutral loop has a chain of them

    @property
    def modulus(self) -> float:
        """The least distance of L(jω) from −1, 1/Ms."""
        return 1 / self.peak_sensitivity

    def _repr_html_(self) -> str:
        rows = {
            "closed loop": "stable" if self.stable else f"unstable, {self.unstable_roots:g} roots",
            "gain margin": f"{self.gain:.4g}",
            "phase margin": f"{math.degrees(self.phase):.4g}°",
            "delay margin": f"{self.delay:.4g} s",
            "peak of S": f"{self.peak_sensitivity:.4g} at {self.peak_frequency:.4g} rad/s",
            "peak of T": (
                f"{self.peak_complementary:.4g} at {self.complementary_frequency:.4g} rad/s"
            ),
            "bandwidth": f"{self.bandwidth:.4g} rad/s",
        }
        body = "".join(f"<tr><th>{k}</th><td>{v}</td></tr>" for k, v in rows.items())
        return f"<table>{body}</table>"


def margins(
    L: Response, rates: Array, late: float, unstable_roots: float, far: Through | None = None
) -> Margins:
    """The margins of the loop transfer function L, a function of complex s.

    `rates` (rad/s) are the frequencies at which L bends: the moduli of its poles and the inverses
    of its delays; `late` (s) is the sum of its delays; `far` is what L tends to as ω → ∞, without
    which L itself is asked. The band searched reaches tenfold beyond those frequencies, and up to
    where |L| has fallen below `LEAST`; beyond `MOST_TURNED` an unstable loop is followed only
    beside its gain crossings. Of a loop that lets high frequencies through, what it tends to
    counts too, at ω = ∞: with |L(j∞)| ≥ 1 any further delay destabilises.
    """
    stable = unstable_roots == 0
    low, high = _band(L, rates)
    if not np.any(L(1j * np.geomspace(low, high, 32))):
        return _without_loop(unstable_roots)
    follow = high
    if not stable and late:
        follow = min(high, max(MOST_TURNED / late, 10 * low))
    limits = _limit(L, 1e-6 * low, 0.1), _limit(L, 1e6 * high, 10.0) if far is None else far.limit
    ends, pieces = _pieces(L, _grid(low, follow), late)
    if follow < high:
        parts = [(ends, pieces), *_beside_crossings(L, follow, high, late, _fallen(limits[0]))]
        ends, pieces = (np.vstack(side) for side in zip(*parts, strict=True))
    size, distance = squared(pieces, 0.0), squared(pieces, 1.0)
    tail = None if far is None or not far.turns else _tail(far)
    phase_at, at_phase = _with_limits(*_phase_crossings(L, ends, pieces), limits)
    if tail is not None:
        phase_at = np.append(phase_at, np.full(len(tail.real), math.inf))
        at_phase = np.append(at_phase, tail.real)
    factors = 1 / np.abs(at_phase)
    factors[np.abs(factors - 1) < EDGE] = 1.0
    gain_at = _gain_crossings(L, ends, size)
    on_it = phase_at[(factors == 1) & (phase_at > 0) & (phase_at < math.inf)]
    # Where L is −1 |L| may only touch 1, or be 1 everywhere.
    apart = [w for w in on_it if not (np.abs(gain_at / w - 1) < 1e-6).any()]
    gain_at = np.sort(np.append(gain_at, apart))
    phases: Array = np.angle(-L(1j * gain_at))
    # −157.8° is 202.2° of room for more delay; in an unstable loop look for less delay instead.
    room = phases % (2 * math.pi) - (0 if stable else 2 * math.pi)
    delays = np.where(np.abs(phases) < EDGE, 0.0, room) / gain_at
    delay = float(delays[np.abs(delays).argmin()]) if len(delays) else math.inf
    through = abs(limits[1]) if tail is None else tail.size
    if stable and far is not None and through >= 1 - EDGE:
        delay = 0.0
    inner = (phase_at > 0) & (phase_at < math.inf)
    close = phase_at[inner][np.abs(np.log(factors[inner])).argsort()[:4]]
    peak_at, peak = _peak(L, ends, None, distance, limits, close)
    top_at, top = _peak(L, ends, size, distance, limits, close)
    if tail is not None:
        peak_at, peak = max((peak_at, peak), (math.inf, tail.peak), key=lambda found: found[1])
        top_at, top = max((top_at, top), (math.inf, tail.top), key=lambda found: found[1])
    nearest = int(np.abs(phases).argmin()) if len(phases) else 0
    return Margins(
        gain=float(min((f for f in factors if f >= 1), default=math.inf)),
        gain_down=float(max((f for f in factors if f < 1), default=0.0)),
        phase=float(phases[nearest]) if len(phases) else math.inf,
        delay=delay,
        peak_sensitivity=peak,
        peak_frequency=peak_at,
        peak_complementary=top,
        complementary_frequency=top_at,
        bandwidth=_bandwidth(L, ends, size, distance, limits[0], top),
        gain_crossings=tuple(zip(gain_at.tolist(), phases.tolist(), strict=True)),
        phase_crossings=tuple(zip(phase_at.tolist(), factors.tolist(), strict=True)),
        stable=stable,
        unstable_roots=unstable_roots,
    )


def _without_loop(unstable_roots: float) -> Margins:
    """The margins of L = 0: S = 1, T = 0, and nothing that limits."""
    inf, n = math.inf, unstable_roots
    return Margins(inf, 0.0, inf, inf, 1.0, 0.0, 0.0, 0.0, 0.0, (), (), n == 0, n)


class _Tail(NamedTuple):
    """What an L that winds for ever comes near to again and again."""

    size: float  #: lim sup |L|
    real: Complex  #: where it crosses the negative real axis
    peak: float  #: of |1/(1 + L)|
    top: float  #: of |L/(1 + L)|


def _tail(far: Through) -> _Tail:
    """Crossings and extrema of L as ω → ∞, over one period of it."""

    def L(s: Any) -> Any:
        return far(far.stretch * np.log(np.imag(s)))  # log ω of the pieces stands for its periods

    ends, pieces = _pieces(L, np.linspace(0.0, 1.0, 4 * far.turns + 1), 0.0)
    size, distance = squared(pieces, 0.0), squared(pieces, 1.0)
    turning = _frequencies(ends, size @ slope_matrix(2 * DEGREE))
    most = np.abs(L(1j * np.append(turning, np.exp(ends[:, 0])))).max()
    real = _phase_crossings(L, ends, pieces)[1].real
    real = real[real < -NOTHING]
    _, first = np.unique(real.round(9), return_index=True)
    nowhere = complex(math.nan), complex(math.nan)
    peak, top = (_peak(L, ends, above, distance, nowhere, np.zeros(0))[1] for above in (None, size))
    return _Tail(float(most), real[first].astype(complex), peak, top)


def _gain_crossings(L: Response, ends: Array, size: Array, level: float = 1.0) -> Array:
    """Where |L| passes 1, by rising ω: not where it is 1 throughout, nor at a pole on the axis."""
    above = less(size, level**2)
    above[np.abs(above).max(axis=1) < 1e-12 * level**2] = 0.0
    at = _frequencies(ends, above)
    return np.asarray(at[np.abs(np.abs(L(1j * at)) / level - 1) < CLOSE])


def _phase_crossings(L: Response, ends: Array, pieces: Complex) -> tuple[Array, Complex]:
    """(ω, L) where L crosses the negative real axis, by rising ω; not through 0 or infinity."""
    at = _frequencies(ends, pieces.imag)
    values: Complex = L(1j * at)
    beside = np.abs(L(1j * at[:, None] * np.array([1 - 1e-7, 1 + 1e-7])))
    size = np.abs(values)
    # At a zero or a pole on the axis L turns by π in one place, where it is rounding.
    passes = (size > 0.03 * beside.min(axis=1)) & (size < 30 * beside.max(axis=1))
    crossing = passes & (np.abs(values.imag) < 1e-6 * size) & (values.real < 0)
    return at[crossing], values[crossing]


def _beside_crossings(
    L: Response, low: float, high: float, late: float, fallen: float
) -> list[tuple[Array, Complex]]:
    """The pieces of a band in which L turns too often to follow that decide on the margins.

    A delay in series turns L but leaves |L| smooth, so that |L| can be followed there: to where it
    is 1, and to where |T| ≥ |L|/(1 + |L|) may first fall below `fallen`.
    """
    ends, size = _pieces(lambda s: np.abs(L(s)) ** 2, _grid(low, high), 0.0)
    levels = [1.0, fallen / (1 - fallen)] if 0 < fallen < 1 else [1.0]
    found: list[tuple[Array, Complex]] = []
    past = low
    for at in np.sort(np.hstack([_gain_crossings(L, ends, size.real, x) for x in levels])):
        span = 16 * math.pi / late
        first, last = max(at - span, past), min(at + span, high)
        if last > first:
            found.append(_pieces(L, np.linspace(math.log(first), math.log(last), 17), late))
        past = max(past, last)
    return found


def _band(L: Response, rates: Array) -> tuple[float, float]:
    """From where L is a plain power of ω, not of size 1, up to where it no longer matters."""
    rates = rates[(rates > 0) & np.isfinite(rates)]
    low, high = (rates.min() * 1e-3, rates.max() * 10) if len(rates) else (1e-3, 1e1)
    size, power = _power(L, low, 1 / 16)
    if power:
        # |L| = size (ω/low)^power below `low`: go a hundredfold below the crossing it points to.
        low = min(low, 1e-2 * low * size ** (-1 / power))
    size, power = _power(L, high, 16.0)
    if power < 0:
        high = max(high, 2 * high * (size / LEAST) ** (-1 / power))
    return float(max(low, 1e-250)), float(min(high, 1e250))


def _power(L: Response, omega: float, step: float) -> tuple[float, int]:
    """|L| at a frequency and the whole power of ω that it follows from there on, one step away.

    Of an |L| that ripples, as one with a delay inside does, the largest of a few neighbours counts.
    """
    ripple = step ** np.linspace(0.0, 0.5, 24)
    size, away = (np.abs(L(1j * at * ripple)).max() for at in (omega, omega * step))
    if not (0 < size < math.inf and 0 < away < math.inf):
        return 1.0, 0
    return float(size), round(math.log(away / size) / math.log(step))


def _grid(low: float, high: float) -> Array:
    """Log ω where pieces are to begin and end, two to a decade."""
    number = max(4, math.ceil(2 * math.log10(high / low)))
    return np.linspace(math.log(low), math.log(high), number)


def _pieces(L: Response, grid: Array, late: float) -> tuple[Array, Complex]:
    """Intervals (k, 2) of log ω and L's Chebyshev coefficients (k, DEGREE + 1) on them.

    What is left of an interval around a pole on the axis, 1e-12 wide, is in none of them.
    """
    nodes, to_coefficients, _ = tables(DEGREE)
    todo = np.column_stack([grid[:-1], grid[1:]])
    before = np.full(len(todo), np.inf)  # what the piece that each is half of left unresolved
    done_ends, done = [], []
    total = 0
    while len(todo):
        mid, half = todo.mean(axis=1), np.diff(todo, axis=1)[:, 0] / 2
        values = L(1j * np.exp(mid[:, None] + half[:, None] * nodes))
        coefficients = values @ to_coefficients.T
        size = np.abs(values).max(axis=1)
        # e^{−jωτ} itself is only known to the rounding of ωτ, and L near a resonance to less; where
        # halving a piece no longer helps, what is left is rounding.
        known = 1e-13 + 1e-15 * late * np.exp(todo[:, 1])
        tail = np.abs(coefficients[:, -3:]).max(axis=1)
        tail = np.divide(tail, size, out=np.zeros_like(tail), where=size > 0)
        tail[~np.isfinite(tail)] = np.inf
        stuck = (tail < np.maximum(1e-9, 1e-12 / half)) & (tail > 0.1 * before)
        small = half < 1e-12
        fine = (tail <= known) | (stuck & (tail < 1e-2)) | small
        kept = fine & ~(small & (tail > 1e-2))
        done_ends.append(todo[kept])
        done.append(coefficients[kept])
        rest, mid, before = todo[~fine], mid[~fine], np.tile(tail[~fine], 2)
        todo = np.vstack([np.column_stack([rest[:, 0], mid]), np.column_stack([mid, rest[:, 1]])])
        total += int(fine.sum())
        if total + len(todo) > MAX_PIECES:
            raise LimitError(
                f"margins: the phase of L turns too often below {math.exp(grid[-1]):g} rad/s to "
                "follow; shorten the delay or lower the gain at high frequency."
            )
    ends, pieces = np.vstack(done_ends), np.vstack(done)
    order = np.argsort(ends[:, 0])
    return ends[order], pieces[order]


def _frequencies(ends: Array, coefficients: Array) -> Array:
    """All ω at which a real function, given by its pieces, crosses or touches zero, by rising ω."""
    k, xi = zeros(coefficients)
    x = ends[k].mean(axis=1) + xi * np.diff(ends[k], axis=1)[:, 0] / 2
    x = np.sort(x)
    once = np.diff(x, prepend=-np.inf) > 1e-11 * np.maximum(np.abs(x), 1.0)
    return np.asarray(np.exp(x[once]))


def _limit(L: Response, at: float, step: float) -> complex:
    """L where ω goes on from `at` by `step`: a number, infinity, or NaN where it has no limit."""
    near, far = (complex(value) for value in L(1j * at * np.array([1.0, step])))
    if not abs(far) < math.inf or (abs(far) > 1e3 and abs(far) > 2 * abs(near)):
        return complex(math.inf)
    if abs(far) < NOTHING or (abs(far) < 1e-3 and abs(far) <= abs(near) / 2):
        return 0j
    if abs(far - near) > 1e-3 * abs(far):
        return complex(math.nan)  # it turns for ever, as behind a delay
    return complex(far.real) if abs(far.imag) < 1e-5 * abs(far) else far


def _with_limits(
    omega: Array, values: Complex, limits: tuple[complex, complex]
) -> tuple[Array, Complex]:
    """The phase crossings with those at ω = 0 and ω = ∞, where L ends on the negative real axis."""
    for at, limit in zip((0.0, math.inf), limits, strict=True):
        if -math.inf < limit.real < 0 and limit.imag == 0:
            first = 0 if at == 0 else len(omega)
            omega, values = np.insert(omega, first, at), np.insert(values, first, limit.real)
    return omega, values


def _peak(
    L: Response,
    ends: Array,
    above: Array | None,
    below: Array,
    limits: tuple[complex, complex],
    also: Array,
) -> tuple[float, float]:
    """(ω, value) of the largest √(above/below), the limits of the band included.

    A peak too sharp for a piece's samples to show is looked for in the pieces that hold `also`.

    `below` holds |1 + L|²; `above` |L|² for T = L/(1 + L), or is None for S = 1/(1 + L).
    """
    degree = (2 if above is None else 4) * DEGREE
    _, to_coefficients, values = tables(degree)
    under = below @ values[:, : below.shape[1]].T
    over = np.ones_like(under) if above is None else above @ values[:, : below.shape[1]].T
    samples = (over / under).max(axis=1)
    # Only a piece whose largest possible value exceeds the best sample can hold the maximum.
    most = 1.0 if above is None else np.abs(above).sum(axis=1)
    least = below[:, 0] - np.abs(below[:, 1:]).sum(axis=1)
    close = np.argsort(-samples)[:8]
    holds = np.searchsorted(ends[:, 0], np.log(also), "right") - 1
    close = np.unique(np.concatenate([close, np.maximum(holds, 0)]))
    close = close[((least <= 0) | (most >= samples.max() * least))[close]]
    slope = below_slope = below[close] @ slope_matrix(2 * DEGREE)
    if above is not None:
        grid = values[:, : below_slope.shape[1]]
        turn = above[close] @ slope_matrix(2 * DEGREE) @ grid.T * under[close]
        slope = (turn - over[close] * (below_slope @ grid.T)) @ to_coefficients.T
    k, xi = zeros(slope)
    inner = ends[close[k]].mean(axis=1) + xi * np.diff(ends[close[k]], axis=1)[:, 0] / 2
    omega = np.exp(np.concatenate([inner, ends[[0, -1], [0, 1]]]))

    def height(at: Any) -> Any:
        # Where L is infinite S is 0 and T is 1.
        with np.errstate(all="ignore"):
            value = np.abs(np.divide(1 if above is None else at, 1 + np.asarray(at)))
        return np.where(np.isnan(value), float(above is not None), value)

    heights = height(L(1j * omega))
    best = int(heights.argmax())
    # The supremum may be a limit that is not reached, at ω = 0 or at ω = ∞.
    for at, limit in zip((0.0, math.inf), limits, strict=True):
        end = float(height(limit)) if abs(limit) < math.inf else float(above is not None)
        if not math.isnan(limit.real) and end > heights[best]:
            omega, heights, best = np.array([at]), np.array([end]), 0
    return float(omega[best]), float(heights[best])


def _fallen(at_zero: complex) -> float:
    """What is 3 dB below |T| at ω = 0."""
    if abs(1 + at_zero) < EDGE:
        return math.inf
    start = abs(at_zero / (1 + at_zero)) if abs(at_zero) < math.inf else 1.0
    return float(start * 10**-0.15)


def _bandwidth(
    L: Response, ends: Array, size: Array, distance: Array, at_zero: complex, top: float
) -> float:
    """The least ω at which |T|² = |L|²/|1 + L|² falls 3 dB below what it is at ω = 0."""
    fallen = _fallen(at_zero)
    if fallen == math.inf or fallen < 1e-6 * top:
        return (
            0.0  # T lets no constant through: there is nothing to fall from; or is infinite there
        )
    values = L(1j * (at := _frequencies(ends, size - fallen**2 * distance)))
    with np.errstate(all="ignore"):
        found = at[np.abs(np.abs(values / (1 + values)) / fallen - 1) < CLOSE]
    return float(min(found, default=math.inf))
