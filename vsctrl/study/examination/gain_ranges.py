"""By what the gain of a loop may be multiplied: the ranges in which it is stable.

Roots cross the axis, or the unit circle, at the factors that the margins list; between two of them
one loop with such a factor is built and its roots are counted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram import Block, Diagram, Loop
from vsctrl.diagram.frequency.margins import Margins
from vsctrl.errors import InputError, LimitError

MOST = 8  #: factors beside which roots are counted
BESIDE = 2.0  #: by which the last factor is exceeded
NEAR = (0.9, 1.1)  #: factors by which a gain is changed on trial
POINTS = 2000  #: of the grid on which the peak of a sensitivity is sought, …
CLOSER = 4  #: … and how often a tenth of them is laid about the highest one
LESS = 0.98  #: of a peak, below which another one is lower

Range = tuple[float, float]


def scaled(loop: Loop, at: str, factor: float) -> Loop:
    """The loop with its gain multiplied, at a signal."""
    times = f"{at}__times"
    parts = [part.rewired({at: times}, {}) for part in loop.diagram.parts]
    back = Block(f"times of {at}", factor, f"{at} -> {times}")
    diagram = Diagram([*parts, back], loop.diagram.inputs, loop.diagram.outputs)
    return Loop(diagram, loop.values, period=loop.period, hold=loop.hold, digital=loop.digital)


def is_stable(loop: Loop) -> bool:
    """Whether all of a loop is, as a computer closes it where one does."""
    if loop.sampled is not None:
        return loop.sampled.is_stable
    return loop.system.unstable_roots == 0


def stable_ranges(loop: Loop, at: str, margins: Margins) -> tuple[list[Range], bool]:
    """The ranges of factors above 0 in which a loop is stable, and whether these are all.

    `margins`: of the loop opened there, in z where a computer closes it. Of many factors at which
    roots cross those nearest to 1 are looked at. Errors: `InputError`, `LimitError` of a loop whose
    roots cannot be counted.
    """
    factors = sorted({f for _, f in margins.phase_crossings if 0 < f < math.inf})
    near = sorted(sorted(factors, key=lambda f: abs(math.log(f)))[:MOST])
    ends = [*([0.0] if near[:1] == factors[:1] else []), *near]
    ends += [math.inf] if near[-1:] == factors[-1:] else []
    found: list[Range] = []
    for low, high in pairwise(ends):
        if not is_stable(scaled(loop, at, _between(low, high))):
            continue
        if found and found[-1][1] == low:
            low = found.pop()[0]
        found.append((low, high))
    return found, len(near) == len(factors)


def _between(low: float, high: float) -> float:
    if low == 0:
        return 1.0 if math.isinf(high) else high / BESIDE
    return low * BESIDE if math.isinf(high) else math.sqrt(low * high)


def turned(loop: Loop, at: str) -> bool:
    """Whether the loop is stable with the opposite sign. Errors: see `stable_ranges`."""
    return is_stable(scaled(loop, at, -1.0))


def calmer(L: Callable[[Complex], Any], margins: Margins, period: float | None) -> str:
    """What lowers the peak of the sensitivity, "lower" or "raise" the gain; "" for neither.

    `L`: the open loop, of s or, with a `period` (s), of z.
    """
    own = _peak(L, margins, period, 1.0)
    less, more = (_peak(L, margins, period, factor) for factor in NEAR)
    lower = margins.gain_down < NEAR[0] and less < LESS * own
    higher = margins.gain > NEAR[1] and more < LESS * own
    if lower and (not higher or less <= more):
        return "lower"
    return "raise" if higher else ""


def _peak(
    L: Callable[[Complex], Any], margins: Margins, period: float | None, factor: float
) -> float:
    """The greatest |1/(1 + factor · L)| on a grid over all that the margins name, then closer."""
    pairs = (*margins.gain_crossings, *margins.phase_crossings, (margins.peak_frequency, 0.0))
    named = [w for w, _ in pairs if 0 < w < math.inf] or [1.0]
    top = 100 * max(named) if period is None else math.pi / period
    w: Array = np.union1d(np.geomspace(0.01 * min(named), top, POINTS), named)

    def distance(w: Array) -> Array:
        at: Complex = np.asarray(1j * w if period is None else np.exp(1j * w * period))
        with np.errstate(all="ignore"):
            return np.asarray(np.abs(1 + factor * np.asarray(L(at))))

    found = distance(w)
    for _ in range(CLOSER):
        k = int(np.nanargmin(found))
        w = np.linspace(w[max(k - 1, 0)], w[min(k + 1, len(w) - 1)], POINTS // 10)
        found = distance(w)
    return float(1 / max(np.nanmin(found), 1e-300))


def known(make: Callable[[], Any]) -> Any:
    """What a question has for an answer; None where it has none."""
    try:
        return make()
    except (InputError, LimitError):
        return None
