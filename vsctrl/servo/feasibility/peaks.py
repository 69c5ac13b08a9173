"""Largest values of functions of time, and when they are above 1, found between samples too.

Several functions are asked at once, because what a trajectory demands is computed together.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsctrl.arrays import Array
from vsctrl.servo.feasibility.golden_section import GOLDEN, golden_section

Functions = Callable[[Array], Array]  # (n,) → (rows, n)

MOST_PEAKS = 8  # of one function, the highest: those whose true top could be the greatest
STEPS = 45  # of golden section: 4e-10 of the bracket, so that a cliff is found as well


class Peaks(NamedTuple):
    """Largest value of each function and when, (rows,) each; the samples, (n,) and (rows, n)."""

    t: Array
    top: Array
    times: Array
    samples: Array


def uneven(end: float, count: int) -> Array:
    """Times from 0 to end, one in each of ``count`` equal cells, (count + 1,).

    Their place in the cell moves on by the golden ratio, so that no period can hide between them.
    """
    k = np.arange(count)
    inside = end * (k + np.remainder(k * GOLDEN, 1.0)) / count
    return np.append(inside, end)


def peaks(functions: Functions, end: float, count: int) -> Peaks:
    """Largest values on [0, end]: the highest of ``count`` samples, refined by golden section."""
    t = uneven(end, count)
    samples = functions(t)
    best = np.argmax(samples, axis=1)
    when, top = t[best], samples[np.arange(len(samples)), best]
    rows, places = _brackets(samples)
    if not rows.size:
        return Peaks(when, top, t, samples)
    a, d = t[np.maximum(places - 1, 0)], t[np.minimum(places + 1, len(t) - 1)]
    pick = np.arange(rows.size)

    def tried(x: Array, f: Array) -> None:
        for k in np.flatnonzero(f > top[rows]):
            if f[k] > top[rows[k]]:
                when[rows[k]], top[rows[k]] = x[k], f[k]

    golden_section(lambda x: functions(x)[rows, pick], a, d, STEPS, tried)
    return Peaks(when, top, t, samples)


def above(functions: Functions, row: int, tops: Peaks, level: float) -> list[tuple[float, float]]:
    """Intervals on which one function is above a level, ends by bisection."""
    t = np.append(tops.times, tops.t[row])
    value = np.append(tops.samples[row], tops.top[row])
    order = np.argsort(t, kind="stable")
    t, over = t[order], value[order] > level
    turns = np.flatnonzero(over[1:] != over[:-1])
    low, high, rising = t[turns], t[turns + 1], over[turns + 1]
    for _ in range(60 if turns.size else 0):
        middle = (low + high) / 2
        passed = (functions(middle)[row] > level) == rising
        low, high = np.where(passed, low, middle), np.where(passed, middle, high)
    edges = [float(x) for x in np.where(rising, high, low)]
    if over[0]:
        edges.insert(0, float(t[0]))
    if over[-1]:
        edges.append(float(t[-1]))
    return list(zip(edges[::2], edges[1::2], strict=True))


def _brackets(samples: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and places of the samples that are local maxima, the highest of each row."""
    rows, places = [], []
    padded = np.pad(samples, ((0, 0), (1, 1)), constant_values=-np.inf)
    local = (samples >= padded[:, :-2]) & (samples >= padded[:, 2:])
    for row, values in enumerate(samples):
        spread = values.max() - values.min()
        if not np.isfinite(spread) or spread <= 1e-12 * np.abs(values).max():
            continue  # constant but for rounding, or infinite already
        mine = np.flatnonzero(local[row])
        mine = mine[np.argsort(-values[mine], kind="stable")[:MOST_PEAKS]]
        places += mine.tolist()
        rows += [row] * len(mine)
    return np.array(rows, dtype=np.intp), np.array(places, dtype=np.intp)
