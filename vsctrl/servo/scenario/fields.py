"""What counts as a number, a vector, a name: the checks of single values, in sentences.

Each check takes what a person typed and returns the clean value, or raises ``ValueError`` with the
second half of a sentence: the value, what is wrong with it and what to do. The first half, the
dotted name of the field, is added by ``scenario``; what several fields must satisfy together is
left to ``checks``.
"""

import math
import numbers
from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import TypeVar

import numpy as np

from vsctrl.errors import nearest
from vsctrl.problems import show

# Numbers beyond these (or positive ones below 1/LARGEST) are typing errors in any unit used here,
# and squares and products of a few of them must stay finite.
LARGEST = 1e9
SMALLEST = 1 / LARGEST

T = TypeVar("T")
Vector3 = tuple[float, float, float]


def number(value: object) -> float:
    """A finite number within ±1e9; booleans and text are not numbers, integers are."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ValueError(f"{show(value)} is not a number; write one without quotes, such as 2.5")
    try:
        out = float(value)
    except OverflowError:
        out = math.inf
    if not math.isfinite(out):
        raise ValueError(f"{show(value)} is not a finite number; give one")
    if abs(out) > LARGEST:
        raise ValueError(f"{show(out)} is beyond ±{LARGEST:g}; check the unit")
    return out + 0.0  # −0 and 0 are one value, with one digest


def positive(value: object) -> float:
    """A number above zero, no smaller than 1e-9."""
    out = number(value)
    if out <= 0:
        raise ValueError(f"{show(value)} is not positive; give a number above 0")
    if out < SMALLEST:
        raise ValueError(f"{show(out)} is below {SMALLEST:g}; check the unit")
    return out


def nonnegative(value: object) -> float:
    """A number that is zero or more."""
    out = number(value)
    if out < 0:
        raise ValueError(f"{show(value)} is negative; give 0 or more")
    return out


def seconds(value: object) -> float:
    """A time in s that is 0, or no smaller than 1e-9: no clock of a loop tells less from 0."""
    out = nonnegative(value)
    if 0 < out < SMALLEST:
        raise ValueError(f"{show(out)} s is below {SMALLEST:g} s; check the unit, or give 0")
    return out


def whole(value: object) -> int:
    """A whole number that is zero or more and fits 63 bits."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise ValueError(f"{show(value)} is not a whole number; write one such as 0 or 42")
    out = int(value)
    if not 0 <= out < 2**63:
        raise ValueError(f"{show(out)} is out of range; give a whole number from 0 to 2^63 - 1")
    return out


def text(value: object) -> str:
    """Text that can be written to a file in UTF-8."""
    if not isinstance(value, str):
        raise ValueError(f"{show(value)} is not text; write it in quotes")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValueError(
            f"{show(value)} cannot be written in UTF-8; remove the surrogate"
        ) from None
    return value


def vector(length: int) -> Callable[[object], tuple[float, ...]]:
    """A check for a list of exactly ``length`` numbers."""

    def check(value: object) -> tuple[float, ...]:
        entries = _entries(value, f"write {length} numbers in brackets")
        if len(entries) != length:
            raise ValueError(f"{show(value)} has {len(entries)} entries; give {length} numbers")
        return _each(entries, number, "entry")

    return check


def direction(length: int) -> Callable[[object], tuple[float, ...]]:
    """A check for a list of ``length`` numbers that are not all zero."""
    check = vector(length)

    def checked(value: object) -> tuple[float, ...]:
        out = check(value)
        if not any(out):
            raise ValueError(f"{show(value)} points nowhere; give at least one entry a value")
        return out

    return checked


def positives(length: int) -> Callable[[object], tuple[float, ...]]:
    """A check for a list of ``length`` numbers above zero."""
    check = vector(length)
    return lambda value: _each(check(value), positive, "entry")


def each_positive(value: object) -> tuple[float, ...]:
    """A list of at least one number, all above zero."""
    return _some(value, "numbers", positive, "entry")


def share(value: object) -> float:
    """A probability or share, 0 to below 1."""
    out = number(value)
    if not 0 <= out < 1:
        raise ValueError(f"{show(value)} is no share of frames; give 0 to below 1")
    return out


def times(value: object) -> tuple[float, ...]:
    """A list of times above 0 that increase."""
    out = _some(value, "times", positive, "entry", "times in s")
    for position, (before, after) in enumerate(pairwise(out), start=2):
        if after <= before:
            raise ValueError(
                f"entry {position}: {after:g} s does not come after {before:g} s; sort them"
            )
    return out


def rows(value: object) -> tuple[tuple[float, ...], ...]:
    """A list of at least one row of three numbers."""
    return _some(value, "rows", vector(3), "row", "rows of 3 numbers")


def maybe(check: Callable[[object], T]) -> Callable[[object], T | None]:
    """A check that lets None pass, which is a key left out."""
    return lambda value: None if value is None else check(value)


def switch(value: object) -> bool:
    """true or false."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{show(value)} is neither true nor false; write one of them, no quotes")
    return bool(value)


def points(value: object) -> tuple[tuple[float, ...], ...]:
    """A list of at least three points of three numbers."""
    entries = _entries(value, "write a list of points [x, y, z]")
    if len(entries) < 3:
        raise ValueError(
            f"too few points ({len(entries)}); give at least 3, because fewer cannot hold six "
            "degrees of freedom"
        )
    return _each(entries, vector(3), "point")


def choice(*names: str) -> Callable[[object], str]:
    """A check for one of the given words."""

    def check(value: object) -> str:
        if isinstance(value, str) and value in names:
            return value
        hint = nearest(value, names) if isinstance(value, str) else ""
        words = ", ".join(f'"{name}"' for name in names)
        raise ValueError(f"{show(value)} is not one of {words}; choose one of these{hint}")

    return check


def _each(entries: Iterable[object], check: Callable[[object], T], word: str) -> tuple[T, ...]:
    """All entries checked; the sentence about a bad one begins with its place, from 1."""
    out: list[T] = []
    for position, entry in enumerate(entries, start=1):
        try:
            out.append(check(entry))
        except ValueError as error:
            raise ValueError(f"{word} {position}: {error}") from None
    return tuple(out)


def _some(
    value: object, what: str, check: Callable[[object], T], word: str, wanted: str = ""
) -> tuple[T, ...]:
    """The entries of a list, at least one, all checked."""
    out = _each(_entries(value, f"write a list of {wanted or what}"), check, word)
    if not out:
        raise ValueError(f"no {what}; give at least one")
    return out


def _entries(value: object, remedy: str) -> list[object]:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        raise ValueError(f"{show(value)} is not a list; {remedy}")
    return list(value)
