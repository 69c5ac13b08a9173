"""When a time is a whole number of sampling periods: decided here, for every part of vsctrl.

The twin in z, the closed forms, the simulator and the comparisons all ask `whole`, and what it
calls whole they take as n·Tₛ: an image of three periods is that of three frames ago.

The tolerance is relative, |q − n| ≤ 2⁻²¹ n ≈ 4.8·10⁻⁷ n for a quotient q of two times, because

- it is for decimals: 1/30 s typed with seven digits is wrong by 10⁻⁷ of itself, and then so is a
  quotient of any size: 0.1 s are 3.0000003 such periods, and a run of 100 s 3000.0003;
- sums and multiples of whole delays stay whole, as the delays along a loop are added up;
- what is whole moves a delay by less than half a unit of its seventh digit, and results as little.
  Without a delay nothing but 0 is whole, since there results can change like the root of it.

Six digits and fewer are taken as they were typed (0.0333333 s: 3.000003 periods), which is a split
of a period and no error. A power of two is no decimal of few digits, so that no value that people
type lies on the bound, where rounding would decide. Past 20 000 periods the bound is a hundredth of
one, or every long time would be whole. Where a time is no whole number of periods, nothing may
jump: the exact quotient is used.
"""

import math
from fractions import Fraction
from typing import Any, TypeVar

import numpy as np

from vsctrl.arrays import Array

Time = float | Fraction
T = TypeVar("T", float, Fraction)

TOLERANCE = 2.0**-21  #: of the number of periods …
MOST = 0.01  #: … and never more than this, in periods
ROUNDING = 1e-12  #: relative, by which two times differ that are one
BEHIND = 1 + 2.0**-50  #: by which a time is moved off an instant: a few roundings


def whole(periods: Time) -> int | None:
    """The number n that a quotient of two times is taken for, |q − n| ≤ 2⁻²¹ n, or None."""
    nearest = round(periods)
    return nearest if _near(periods, nearest) else None


def whole_periods(time: Time, period: Time) -> int | None:
    """A time (s) as a whole number of periods (s), or None where it is none."""
    return whole(time / period)


def in_periods(time: float, period: float) -> float:
    """A time (s) in periods (s), a whole number of them without what it misses that by."""
    n = whole_periods(time, period)
    return time / period if n is None else float(n)


def settled(time: float, period: float) -> float:
    """A time (s), or the n·period (s) that it is taken for where these are more than rounded."""
    n = whole_periods(time, period)
    if n is None or math.isclose(n * period, time, rel_tol=ROUNDING):
        return time
    return n * period


def split(periods: T) -> tuple[int, T]:
    """(d, f) of d + f periods, d whole and 0 ≤ f < 1, where f is 0 if their number is whole."""
    n = whole(periods)
    if n is not None:
        return n, periods * 0
    d = math.floor(periods)
    return d, periods - d


def last_frame(time: float, period: float) -> int:
    """Number k of the last frame k·period at or before a time, both in s."""
    return split(time / period)[0]


def first_frame(time: float, period: float) -> int:
    """Number k of the first frame k·period at or after a time, both in s."""
    d, f = split(time / period)
    return d + 1 if f else d


def to_whole(periods: Array) -> Array:
    """Quotients of two times of any shape, those that are whole as the number that they are."""
    nearest = np.rint(periods)
    return np.where(_near(periods, nearest), nearest, periods)


def after(t: Array, instants: Array) -> Array:
    """Times t in s, (n,), but just after an instant (m,) where they are at one: right limits.

    A time is at an instant if it is before it by no more than the relative tolerance.
    """
    instants = np.sort(instants)
    if not len(instants):
        return t
    # The next instant after a time, or the last one, which then is not ahead.
    ahead = instants[np.minimum(np.searchsorted(instants, t), len(instants) - 1)]
    on = (ahead >= t) & (ahead - t <= TOLERANCE * ahead)
    return np.where(on, ahead * BEHIND, t)


def shown(periods: Time) -> str:
    """A number of periods in a sentence, with as many digits as tell a broken one from a whole."""
    value = float(periods)
    short = f"{value:g}"
    return short if whole(value) is not None or whole(float(short)) is None else f"{value:.10g}"


def _near(periods: Any, nearest: Any) -> Any:
    missed = abs(periods - nearest)
    return (missed <= TOLERANCE * abs(nearest)) & (missed <= MOST)
