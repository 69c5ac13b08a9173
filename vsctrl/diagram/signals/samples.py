"""Samples as a signal: a held sequence, as a recording or a digital controller makes it.

Few samples are steps or changes of slope like any other signal; of many, the response engine asks
for one hold pulse, with which the rest is a convolution (`train`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from vsctrl.arrays import Array
from vsctrl.checks import decimal, positive, quoted, reals
from vsctrl.diagram.signals.elementary import Pulse, Ramp, Step
from vsctrl.diagram.signals.signal import Part, Primitive, Signal, lag
from vsctrl.errors import InputError

HOLDS = ("zero", "first")


@dataclass(frozen=True)
class Samples(Part):
    """Samples every `period` seconds from t = 0, or at `times`, the last of them kept for ever.

    hold="zero": each value is held until the next; "first": straight lines from value to value.
    ``Samples(values, times=t)`` serves recordings whose time stamps (s) are not evenly spaced; they
    are kept as the decimals they print as, and before the first of them the signal is 0.
    Errors: `InputError` where there is no sample, or one is not finite, or the period is not
    positive, or times are negative, do not rise or are not as many; where not just one of period
    and times is given; where the hold is unknown.

    >>> vs.Samples([0, 1, 4], period=0.5)(np.array([0.2, 0.7]))
    array([0., 1.])
    """

    values: tuple[float, ...]
    period: float | None = None
    hold: str = "zero"
    times: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", _samples(self.values))
        if (self.period is None) == (self.times is None):
            raise InputError(
                "Samples: give either a period, Samples(values, 0.04), or the time of each value, "
                "Samples(values, times=t)."
            )
        if self.times is None:
            positive("Samples: period", self.period, "a finite number of seconds above 0")
        else:
            object.__setattr__(self, "times", _times(self.times, len(self.values)))
        if self.hold not in HOLDS:
            raise InputError(
                f"Samples: hold = {quoted(self.hold)} is unknown; give 'zero' or 'first'."
            )

    def __repr__(self) -> str:
        when = f"period={quoted(self.period)}"
        if self.times is not None:
            when = f"times={quoted(self.times[0])} … {quoted(self.times[-1])}"
        return f"Samples({len(self.values)} values, {when}, hold={quoted(self.hold)})"

    @property
    def starts(self) -> list[Fraction]:
        """The time of each value (s), as the decimal it prints as."""
        if self.times is not None:
            return [decimal("times", t) for t in self.times]
        spacing = decimal("period", self.period)
        return [k * spacing for k in range(len(self.values))]

    @property
    def changes(self) -> list[tuple[Fraction, Primitive]]:
        """The steps, or the changes of slope, that it is made of."""
        v = np.array(self.values)
        changes: list[tuple[Fraction, Primitive]] = []
        kind: type[Primitive]
        if self.hold == "zero":
            sizes, kind = np.diff(v, prepend=0.0), Step
        else:
            sizes, kind = np.diff(self._slopes, prepend=0.0), Ramp
            changes = [(self.starts[0], Step(float(v[0])))] if v[0] else []
        starts = self.starts
        return changes + [(starts[k], kind(float(sizes[k]))) for k in np.flatnonzero(sizes)]

    @property
    def _slopes(self) -> Array:
        """Those of the straight lines (1/s), the last being 0."""
        widths = self.period if self.times is None else np.diff(self.times)
        return np.append(np.diff(self.values) / widths, 0.0)

    @property
    def train(self) -> tuple[Signal, Array, Signal]:
        """(unit, weights, rest): with a period it is Σ weights[k] · unit(t − k·period) + rest."""
        T, v, n = decimal("period", self.period), np.array(self.values), len(self.values)
        up = 1 / float(T)
        if self.hold == "zero":
            return Pulse(float(T)), v, v[-1] * Step().delayed(n * T)
        rise, fall = Ramp(up), Step() - Ramp(up) + Ramp(up).delayed(T)
        unit = rise - rise.scaled(2).delayed(T) + rise.delayed(2 * T)
        keep = rise.delayed((n - 1) * T) - rise.delayed(n * T)
        # With one sample it falls and is kept at once, so that it is simply a step.
        return unit, v[1:], v[0] * fall + v[-1] * keep

    def scaled(self, factor: Any) -> Samples:
        """The signal times a number."""
        return replace(self, values=tuple(factor * value for value in self.values))

    def smooth(self, t: Array, seen: Array) -> Array:
        """The value at times t on the side of a sample that `seen` is on."""
        n, v = len(self.values), np.array(self.values)
        if self.period is None:
            begins = np.array(self.times)
            k = np.searchsorted(begins, seen, "right") - 1
            since = np.where(self.hold == "first", t - begins[k], 0.0)
            return np.where(k < 0, 0.0, v[k] + since * self._slopes[k])
        k = np.floor(np.clip(seen / self.period, 0, n - 1)).astype(int)
        if self.hold == "zero":
            return np.asarray(v[k])
        ahead = np.where(k < n - 1, t / self.period - k, 0.0)
        return np.asarray(v[k] + ahead * (v[np.minimum(k + 1, n - 1)] - v[k]))

    def laplace(self, s: Any, exp: Callable[[Any], Any] = np.exp) -> Any:
        """Its Laplace transform at s, a number or a symbol."""
        return sum(lag(start, s, exp) * part.laplace(s, exp) for start, part in self.changes)

    def derivative(self) -> Signal | None:
        """The slopes as samples, None where it jumps."""
        if self.hold == "zero" or self.values[0]:
            return None
        return replace(self, values=tuple(self._slopes.tolist()), hold="zero")


def _samples(values: Any) -> tuple[float, ...]:
    try:
        array = np.asarray(values)
        usable = array.dtype.kind in "iuf" and array.ndim == 1 and len(array) > 0
    except ValueError:  # a ragged list
        usable = False
    if not usable:
        raise InputError(
            f"Samples: values = {quoted(values)} is not usable; give a list of one number or more."
        )
    lost = np.flatnonzero(~np.isfinite(array))
    if len(lost):
        raise InputError(
            f"Samples: values[{lost[0]}] = {array[lost[0]]} is not finite; repair or drop it."
        )
    return tuple(array.astype(float).tolist())


def _times(times: Any, count: int) -> tuple[float, ...]:
    array = reals(times)
    if array is None or array.ndim != 1:
        raise InputError(
            f"Samples: times = {quoted(times)} is not usable; give a list of finite seconds."
        )
    if len(array) != count:
        raise InputError(
            f"Samples: there are {len(array)} times for {count} values; give one for each."
        )
    if array[0] < 0:
        raise InputError(
            f"Samples: times[0] = {array[0]:g} s is negative, and signals begin at 0 s; count from "
            "the first sample, times − times[0]."
        )
    back = np.flatnonzero(np.diff(array) <= 0)
    if len(back):
        k = int(back[0]) + 1
        raise InputError(
            f"Samples: times[{k}] = {array[k]:.9g} s does not come after times[{k - 1}] = "
            f"{array[k - 1]:.9g} s; sort the samples and drop what was recorded twice."
        )
    return tuple(array.tolist())
