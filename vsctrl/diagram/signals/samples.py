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
from vsctrl.checks import decimal, positive, quoted
from vsctrl.diagram.signals.elementary import Pulse, Ramp, Step
from vsctrl.diagram.signals.signal import Part, Primitive, Signal, lag
from vsctrl.errors import InputError

HOLDS = ("zero", "first")


@dataclass(frozen=True)
class Samples(Part):
    """Samples every `period` seconds from t = 0, the last of them kept for ever.

    hold="zero": each value is held until the next; "first": straight lines from value to value.
    Errors: `InputError` where there is no sample, or one is not finite, or the period is not
    positive, or the hold is unknown.
    """

    values: tuple[float, ...]
    period: float
    hold: str = "zero"

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", _samples(self.values))
        positive("Samples: period", self.period, "a finite number of seconds above 0")
        if self.hold not in HOLDS:
            raise InputError(f"Samples: hold = {self.hold!r} is unknown; give 'zero' or 'first'.")

    def __repr__(self) -> str:
        return f"Samples({len(self.values)} values, period={self.period!r}, hold={self.hold!r})"

    @property
    def spacing(self) -> Fraction:
        """The period as the decimal it prints as."""
        return decimal("period", self.period)

    @property
    def changes(self) -> list[tuple[Fraction, Primitive]]:
        """The steps, or the changes of slope, that it is made of."""
        v = np.array(self.values)
        changes: list[tuple[Fraction, Primitive]] = []
        kind: type[Primitive]
        if self.hold == "zero":
            sizes, kind = np.diff(v, prepend=0.0), Step
        else:
            slopes = np.append(np.diff(v) / self.period, 0.0)
            sizes, kind = np.diff(slopes, prepend=0.0), Ramp
            changes = [(Fraction(0), Step(float(v[0])))] if v[0] else []
        spacing = self.spacing
        return changes + [(int(k) * spacing, kind(float(sizes[k]))) for k in np.flatnonzero(sizes)]

    @property
    def train(self) -> tuple[Signal, Array, Signal]:
        """(unit, weights, rest): the signal is Σ weights[k] · unit(t − k·period) + rest."""
        T, v, n = self.spacing, np.array(self.values), len(self.values)
        up = 1 / float(T)
        if self.hold == "zero":
            return Pulse(self.period), v, v[-1] * Step().delayed(n * T)
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
        n = len(self.values)
        v, k = np.array(self.values), np.floor(np.clip(seen / self.period, 0, n - 1)).astype(int)
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
        slopes = np.append(np.diff(self.values) / self.period, 0.0)
        return Samples(tuple(slopes.tolist()), self.period)


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
