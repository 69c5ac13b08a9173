"""Exact frequency response and the margins read from it, every crossing included.

L(jω) is followed by Chebyshev pieces in log ω, halved until they hold L to rounding; crossings and
extrema are then eigenvalues of small matrices, so that however often the phase winds round, none
is missed between two samples. No Padé model is involved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl.diagram.zeros import slope_matrix, tables, zeros
from vsctrl.errors import LimitError

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Response = Callable[[Any], Any]  #: L as a function of complex s, any shape

DEGREE = 16
MAX_PIECES = 100_000
MOST_TURNED = 2e4  #: rad of delay up to which the crossings of an unstable loop are followed
LEAST = 0.01  #: the search may end where |L| has fallen below this


@dataclass(frozen=True)
class Margins:
    """How far the loop of a return difference 1 + L is from instability, exactly.

    Frequencies in rad/s, phases in rad, delays in s; infinity where nothing limits. `gain` is the
    least factor above 1 at which roots cross the axis, `gain_down` the largest below 1 (0 where
    there is none). For a loop that is not
    `stable`, `unstable_roots` are on or right of the imaginary axis, and `delay` is negative: the
    change of delay that brings the nearest crossing back to −1.
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


def margins(L: Response, rates: Array, late: float, unstable_roots: float) -> Margins:
    """The margins of the loop transfer function L, a function of complex s.

    `rates` (rad/s) are the frequencies at which L bends: the moduli of its poles and the inverses
    of its delays; `late` (s) is the sum of its delays. The band searched reaches tenfold beyond
    those frequencies, and up to where |L| has fallen below `LEAST`; in an unstable loop no further
    than `MOST_TURNED`.
    """
    stable = unstable_roots == 0
    low, high = _band(L, rates)
    if not stable and late:
        high = min(high, max(MOST_TURNED / late, 10 * low))
    ends, pieces = _pieces(L, low, high, late)
    size, distance = _abs2(pieces, 0.0), _abs2(pieces, 1.0)
    gain_at = _frequencies(ends, _less(size, 1.0))
    phase_at = _frequencies(ends, pieces.imag)
    at_phase: Complex = L(1j * phase_at)
    real = np.abs(at_phase.imag) < 1e-6 * np.abs(at_phase)
    crossing = real & (at_phase.real < 0)
    limits = _limits(L, ends)
    phase_at, at_phase = _with_limits(phase_at[crossing], at_phase[crossing], limits)
    factors = 1 / np.abs(at_phase)
    phases: Array = np.angle(-L(1j * gain_at))
    # −157.8° is 202.2° of room for more delay; in an unstable loop look for less delay instead.
    delays = (phases % (2 * math.pi) - (0 if stable else 2 * math.pi)) / gain_at
    peak_at, peak = _peak(L, ends, None, distance, limits)
    top_at, top = _peak(L, ends, size, distance, limits)
    nearest = int(np.abs(phases).argmin()) if len(phases) else 0
    return Margins(
        gain=float(min((f for f in factors if f > 1), default=math.inf)),
        gain_down=float(max((f for f in factors if f < 1), default=0.0)),
        phase=float(phases[nearest]) if len(phases) else math.inf,
        delay=float(delays[np.abs(delays).argmin()]) if len(delays) else math.inf,
        peak_sensitivity=peak,
        peak_frequency=peak_at,
        peak_complementary=top,
        complementary_frequency=top_at,
        bandwidth=_bandwidth(ends, size, distance, limits[0], top),
        gain_crossings=tuple(zip(gain_at.tolist(), phases.tolist(), strict=True)),
        phase_crossings=tuple(zip(phase_at.tolist(), factors.tolist(), strict=True)),
        stable=stable,
        unstable_roots=unstable_roots,
    )


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


def _pieces(L: Response, low: float, high: float, late: float) -> tuple[Array, Complex]:
    """Intervals (k, 2) of log ω and L's Chebyshev coefficients (k, DEGREE + 1) on them."""
    nodes, to_coefficients, _ = tables(DEGREE)
    grid = np.linspace(math.log(low), math.log(high), max(4, math.ceil(2 * math.log10(high / low))))
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
        tail = np.abs(coefficients[:, -3:]).max(axis=1) / size
        stuck = (tail < 1e-9) & (tail > 0.1 * before)
        fine = (tail <= known) | stuck | (half < 1e-12)
        done_ends.append(todo[fine])
        done.append(coefficients[fine])
        rest, mid, before = todo[~fine], mid[~fine], np.tile(tail[~fine], 2)
        todo = np.vstack([np.column_stack([rest[:, 0], mid]), np.column_stack([mid, rest[:, 1]])])
        total += int(fine.sum())
        if total + len(todo) > MAX_PIECES:
            raise LimitError(
                f"margins: the phase of L turns too often below {high:g} rad/s to follow; "
                "shorten the delay or lower the gain at high frequency."
            )
    ends, pieces = np.vstack(done_ends), np.vstack(done)
    order = np.argsort(ends[:, 0])
    return ends[order], pieces[order]


def _abs2(c: Complex, offset: float) -> Array:
    """Chebyshev coefficients of |L + offset|² from those of L."""
    _, to_coefficients, values = tables(2 * DEGREE)
    at = c @ values[:, : DEGREE + 1].T + offset
    return np.asarray((np.abs(at) ** 2) @ to_coefficients.T)


def _less(coefficients: Array, constant: float) -> Array:
    out = coefficients.copy()
    out[:, 0] -= constant
    return out


def _frequencies(ends: Array, coefficients: Array) -> Array:
    """All ω at which a real function, given by its pieces, crosses or touches zero, by rising ω."""
    k, xi = zeros(coefficients)
    x = ends[k].mean(axis=1) + xi * np.diff(ends[k], axis=1)[:, 0] / 2
    x = np.sort(x)
    once = np.diff(x, prepend=-np.inf) > 1e-11 * np.maximum(np.abs(x), 1.0)
    return np.asarray(np.exp(x[once]))


def _limits(L: Response, ends: Array) -> tuple[complex, complex]:
    """L as ω → 0 and as ω → ∞: a number, infinity, or NaN where it has no limit there."""
    low, high = np.exp(ends[[0, -1], [0, 1]])
    return _limit(L, 1e-6 * low, 0.1), _limit(L, 1e6 * high, 10.0)


def _limit(L: Response, at: float, step: float) -> complex:
    near, far = (complex(value) for value in L(1j * at * np.array([1.0, step])))
    if not abs(far) < math.inf or (abs(far) > 1e3 and abs(far) > 2 * abs(near)):
        return complex(math.inf)
    if abs(far) < 1e-3:
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
    L: Response, ends: Array, above: Array | None, below: Array, limits: tuple[complex, complex]
) -> tuple[float, float]:
    """(ω, value) of the largest √(above/below), the limits of the band included.

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
        return np.abs((1 if above is None else at) / (1 + at))

    heights = height(L(1j * omega))
    best = int(heights.argmax())
    # The supremum may be a limit that is not reached, at ω = 0 or at ω = ∞.
    for at, limit in zip((0.0, math.inf), limits, strict=True):
        end = float(height(limit)) if abs(limit) < math.inf else float(above is not None)
        if not math.isnan(limit.real) and end > heights[best]:
            omega, heights, best = np.array([at]), np.array([end]), 0
    return float(omega[best]), float(heights[best])


def _bandwidth(ends: Array, size: Array, distance: Array, at_zero: complex, top: float) -> float:
    """The least ω at which |T|² = |L|²/|1 + L|² falls 3 dB below what it is at ω = 0."""
    start = abs(at_zero / (1 + at_zero)) if abs(at_zero) < math.inf else 1.0
    if start < 1e-6 * top:
        return 0.0  # T lets no constant through: there is nothing to fall from
    return float(min(_frequencies(ends, size - start**2 * 10**-0.3 * distance), default=math.inf))
