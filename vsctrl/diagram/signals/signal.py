"""Test signals: what a channel can be asked to respond to, and how they are put together.

A signal is a sum of terms, each a primitive that starts at its own time and is smooth from there
on, so that the response engine can ask for the smooth sum of what has begun on a piece and for the
jumps of its derivatives at each start, and closed forms for its Laplace transform, for which sizes
may be symbols. Starts are rationals, as the delays are: a shifted signal and the echo of an earlier
one meet at exactly the same time or do not meet at all.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from numbers import Real
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.checks import decimal, is_finite, is_symbolic, number, reals, unusable
from vsctrl.checks import side as side_of
from vsctrl.errors import InputError


def beside(t: Array, side: str, span: float) -> Array:
    """Times moved off a jump to the side that is asked for, by far more than they are rounded."""
    return t + 1e-12 * span if side == "right" else t - 1e-12 * span


class Signal(ABC):
    """Zero before t = 0, and from there on a sum of terms; ``a + b``, ``-a``, ``2 * a``."""

    __array_ufunc__ = None  # so that a NumPy number times a signal is left to the signal

    @property
    @abstractmethod
    def terms(self) -> tuple[tuple[Fraction, Part], ...]:
        """(start in seconds, what starts there), each a term of the sum."""

    def scaled(self, factor: Any) -> Signal:
        """The signal times a number."""
        return _total((start, part.scaled(factor)) for start, part in self.terms)

    def delayed(self, seconds: float | Fraction) -> Signal:
        """The same signal, starting later by some seconds ≥ 0, kept as the decimal they print as.

        Errors: `InputError` where the delay is no such number.
        """
        if not is_finite(seconds) or seconds < 0:
            raise unusable("delayed: seconds", seconds, "0 s or more, as signals begin at 0 s")
        delay = decimal("seconds", seconds)
        return _total((start + delay, part) for start, part in self.terms)

    def derivative(self) -> Signal | None:
        """Its derivative, None where that would hold an impulse."""
        terms: list[tuple[Fraction, Part]] = []
        for start, part in self.terms:
            slope = part.derivative()
            if slope is None:
                return None
            terms += [(start + more, term) for more, term in slope.terms]
        return _total(terms)

    @property
    def primitives(self) -> list[tuple[Fraction, Primitive]]:
        """The terms with samples taken apart, in the order of their starts."""
        flat = [(start + more, p) for start, part in self.terms for more, p in part.changes]
        return sorted(flat, key=lambda term: term[0])

    def jumps(self, orders: int, start: Fraction | int = 0) -> Array:
        """The jumps of the derivatives of order 0 … orders − 1 at a start (s)."""
        return self.onsets(orders).get(Fraction(start), np.zeros(orders))

    def onsets(self, orders: int) -> dict[Fraction, Array]:
        """The jumps of the derivatives of order 0 … orders − 1 at each start (s)."""
        jumps: dict[Fraction, Array] = {}
        for start, primitive in self.primitives:
            jumps[start] = jumps.get(start, np.zeros(orders)) + primitive.onset(orders)
        return jumps

    def __call__(self, t: ArrayLike, side: str = "right") -> Array:
        """The value at times t (s): zero before it starts, at a jump the limit from that side.

        Errors: `InputError` for times that are not finite and for a side that is none.
        """
        times = reals(t)
        if times is None:
            raise unusable("signal: t", t, "finite times in s")
        side_of("signal", side)
        seen = beside(times, side, float(np.abs(times).max(initial=0.0)))
        total = np.zeros(times.shape)
        for start, part in self.terms:
            begin = float(start)
            total = total + np.where(seen >= begin, part.smooth(times - begin, seen - begin), 0.0)
        return np.asarray(total)

    def laplace(self, s: Any, exp: Callable[[Any], Any] = np.exp) -> Any:
        """Its Laplace transform at s, a number or a symbol.

        Where a term starts later than 0, a symbol also needs its own exponential, ``exp=sympy.exp``
        (and mpmath numbers ``exp=mpmath.exp``).
        """
        return sum(lag(start, s, exp) * part.laplace(s, exp) for start, part in self.terms)

    def __add__(self, other: object) -> Signal:
        """The sum of two signals; 0 may be one of them, as in Python's ``sum``."""
        if isinstance(other, Signal):
            return _total((*self.terms, *other.terms))
        return self if isinstance(other, int) and other == 0 else NotImplemented

    __radd__ = __add__

    def __neg__(self) -> Signal:
        return self.scaled(-1)

    def __sub__(self, other: object) -> Signal:
        return self + -other if isinstance(other, Signal) else NotImplemented

    def __mul__(self, factor: object) -> Signal:
        """The signal times a number or a symbol."""
        number = _multiple("factor", factor)
        return NotImplemented if number is None else self.scaled(number)

    __rmul__ = __mul__

    def __truediv__(self, divisor: object) -> Signal:
        """The signal divided by a number or a symbol; 0 is refused."""
        number = _multiple("divisor", divisor)
        return NotImplemented if number is None else self.scaled(1 / number)


class Part(Signal):
    """What a term can be: a signal that is not a sum of others to those who add up terms."""

    @property
    def terms(self) -> tuple[tuple[Fraction, Part], ...]:
        """Itself, from t = 0."""
        return ((Fraction(0), self),)

    @property
    @abstractmethod
    def changes(self) -> list[tuple[Fraction, Primitive]]:
        """(start in seconds, primitive) of all that it is made of."""

    @abstractmethod
    def smooth(self, t: Array, seen: Array) -> Array:
        """The value at t after the start; at a jump within, on the side that `seen` is on."""

    @abstractmethod
    def scaled(self, factor: Any) -> Self:
        """The signal times a number."""

    def derivative(self) -> Signal | None:
        """Its derivative, None where that would hold an impulse, as that of what starts above 0."""
        return None


class Primitive(Part):
    """A term that starts at t = 0 and is smooth from there on; all are frozen dataclasses.

    `size` names the field it is proportional to.
    """

    size: ClassVar[str]
    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __post_init__(self) -> None:
        for field in fields(self):
            check_number(type(self).__name__, field.name, getattr(self, field.name))

    @property
    def changes(self) -> list[tuple[Fraction, Primitive]]:
        """Itself, from t = 0."""
        return [(Fraction(0), self)]

    @property
    def values(self) -> tuple[Any, ...]:
        """The values of its fields, in their order."""
        return tuple(getattr(self, field.name) for field in fields(self))

    @property
    def kind(self) -> tuple[Any, ...]:
        """What two primitives must share for their sizes to add up."""
        others = (f.name for f in fields(self) if f.name != self.size)
        return (type(self), *(getattr(self, name) for name in others))

    def scaled(self, factor: Any) -> Self:
        """The signal times a number."""
        return replace(self, **{self.size: factor * getattr(self, self.size)})

    @classmethod
    @abstractmethod
    def formula(cls, t: Array, *values: Any) -> Array:
        """The value t ≥ 0 after the start, as a function of t and of the fields in their order."""

    def smooth(self, t: Array, seen: Array) -> Array:
        """The value at t after the start, continued smoothly before it."""
        # A fraction times an array would be an array of objects.
        numbers = (float(v) if isinstance(v, Real) else v for v in self.values)
        return self.formula(t, *numbers)

    @abstractmethod
    def onset(self, orders: int) -> Array:
        """The jumps of its derivatives at its start."""


@dataclass(frozen=True)
class Combination(Signal):
    """A sum of terms; made by ``+``, ``-``, ``*`` and `delayed`."""

    parts: tuple[tuple[Fraction, Part], ...]

    @property
    def terms(self) -> tuple[tuple[Fraction, Part], ...]:
        """(start in seconds, what starts there)."""
        return self.parts


def _total(terms: Iterable[tuple[Fraction, Part]]) -> Signal:
    """The sum of terms, those of one kind and start added up."""
    sums: dict[Any, tuple[Fraction, Part]] = {}
    for start, part in terms:
        key = (start, *part.kind) if isinstance(part, Primitive) else (start, id(part), len(sums))
        if isinstance(part, Primitive) and key in sums:
            before = getattr(sums[key][1], part.size)
            part = replace(part, **{part.size: before + getattr(part, part.size)})
        sums[key] = (start, part)
    sizes = [getattr(p, p.size) if isinstance(p, Primitive) else 1 for _, p in sums.values()]
    rest = tuple(term for term, size in zip(sums.values(), sizes, strict=True) if size != 0)
    return rest[0][1] if len(rest) == 1 and rest[0][0] == 0 else Combination(rest)


def lag(start: Fraction, s: Any, exp: Callable[[Any], Any]) -> Any:
    """e^{−start·s}; 1 without an exponential for what starts at 0."""
    if start == 0:
        return 1
    try:
        return exp(-(start if hasattr(s, "free_symbols") else float(start)) * s)
    except TypeError as error:
        raise InputError(
            f"laplace: s = {s} is a symbol and the signal starts late; give exp=sympy.exp."
        ) from error


def check_number(what: str, name: str, value: Any) -> None:
    """Refuse what is neither a finite number nor a symbol."""
    if not is_symbolic(value):
        number(f"{what}: {name}", value)


def _multiple(name: str, value: Any) -> Any:
    """A factor or divisor, None where it is neither a number nor a symbol."""
    if not isinstance(value, Real) and not hasattr(value, "free_symbols"):
        return None
    if name == "factor" and isinstance(value, float):
        return value  # the signal names its own field if the product is not finite
    check_number("signal", name, value)
    if name == "divisor" and value == 0:
        raise InputError("signal: divisor = 0 is not usable; give a number other than 0.")
    # A NumPy number would warn where its inverse overflows.
    return value if name == "factor" or is_symbolic(value) else float(value)
