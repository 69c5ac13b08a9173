"""The response to any signal, long trains of samples by superposition.

What a thousand samples set ringing is the same response a thousand times, shifted: it is computed
once and convolved. Everything else is left to `collocation` as it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.signals.samples import Samples
from vsctrl.diagram.signals.signal import Combination, Signal
from vsctrl.diagram.time.collocation import Trajectory, solve

MANY_SAMPLES = 100  #: from there on samples are superposed instead of solved one by one


def respond(system: DelaySystem, signal: Signal, t: Array, side: str = "right") -> Array:
    """The response of a one-input delay system to a signal, from rest, at times t ≥ 0 (s).

    Long samples are answered by superposition of the response to one hold pulse, so that their
    cost does not grow with what each of them would set ringing.
    Errors: `LimitError` as `solve`.
    """
    # A little further, so that a jump at the last time is seen from its right.
    horizon = max(float(t.max()) * (1 + 1e-6), 1e-12)
    short, trains = [], []
    for start, part in signal.terms:
        many = isinstance(part, Samples) and len(part.values) > MANY_SAMPLES
        if isinstance(part, Samples) and many and part.period is not None:
            unit, weights, rest = part.train
            short += [(start + offset, primitive) for offset, primitive in rest.terms]
            trains.append((start, _Train(unit, weights, part.period)))
        else:
            short.append((start, part))
    y = solve(system, Combination(tuple(short)), horizon)(t, side)
    for start, train in trains:
        y = y + train.response(system, t - float(start), side, horizon)
    return y


@dataclass(frozen=True)
class _Train:
    """Σ weights[k] · unit(t − k·period), answered through the response to one `unit`."""

    unit: Signal
    weights: Array
    period: float

    def response(self, system: DelaySystem, t: Array, side: str, horizon: float) -> Array:
        """The response at times t, zero for those before 0."""
        one = solve(system, self.unit, horizon)
        y = np.zeros((len(t), system.outputs))
        on = np.flatnonzero(t >= -1e-12 * horizon)
        if len(on):
            grid = _common_grid(t[on], self.period)
            y[on] = self._direct(one, t[on], side) if grid is None else self._fast(one, grid, side)
        return y

    def _fast(self, one: Trajectory, grid: tuple[int, int, float, int, int], side: str) -> Array:
        """By convolution: row a, column r of h is the response at offset + (a P + r) period/P."""
        from scipy.signal import fftconvolve

        P, Q, offset, first, count = grid
        rows = (first + (count - 1) * Q) // P + 1
        fine = np.asarray(offset + np.arange(rows * P) * (self.period / P), float)
        h = one(fine, side)
        y = fftconvolve(h.reshape(rows, -1), self.weights[:rows, None], axes=0)[:rows]
        return np.asarray(y.reshape(rows * P, -1)[first + Q * np.arange(count)])

    def _direct(self, one: Trajectory, t: Array, side: str) -> Array:
        """On any times, a number of samples at once."""
        y = np.zeros((len(t), one.coefficients.shape[2]))
        last = min(len(self.weights), int(t.max() / self.period * (1 + 1e-9)) + 1)
        chunk = max(1, 1_000_000 // len(t))
        for k in range(0, last, chunk):
            w = self.weights[k : min(k + chunk, last)]
            since = t - (k + np.arange(len(w)))[:, None] * self.period
            y += np.einsum("k,ktp->tp", w, one(since.ravel(), side).reshape(*since.shape, -1))
        return y


def _common_grid(t: Array, period: float) -> tuple[int, int, float, int, int] | None:
    """(P, Q, offset, first, count): t = offset + (first + Q i) period/P, i < count, or None."""
    count = len(t)
    step = (t[-1] - t[0]) / (count - 1) if count > 1 else 0.0
    even = t[0] + step * np.arange(count)
    # Times may be off the grid by what jumps are told apart by, not more.
    if step <= 0 or np.abs(t - even).max() > 1e-12 * t[-1]:
        return None
    ratio = Fraction(period / step).limit_denominator(64)
    P, Q = ratio.numerator, ratio.denominator
    if not P or abs(P * step / (Q * period) - 1) > 1e-12 or t[-1] / period * P > 4e6:
        return None
    first = max(math.floor(t[0] / (period / P) + 1e-9), 0)
    return P, Q, float(t[0] - first * (period / P)), first, count
