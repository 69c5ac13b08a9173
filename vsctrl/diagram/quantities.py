"""The numbers a signal is made of: refused with a sentence, or kept as exact rationals."""

from __future__ import annotations

import math
from fractions import Fraction
from numbers import Real
from typing import Any

from vsctrl.errors import InputError


def is_finite(value: object) -> bool:
    """Whether this is a real number that a float can hold."""
    real = isinstance(value, Real) and not isinstance(value, bool)
    try:
        return real and math.isfinite(value)  # type: ignore[arg-type]
    except OverflowError:  # an integer that no float can hold
        return False


def check_number(what: str, name: str, value: object) -> None:
    """Refuse what is neither a finite number nor a symbol."""
    if not hasattr(value, "free_symbols") and not is_finite(value):  # symbols: for closed forms
        raise InputError(f"{what}: {name} = {value!r} is not usable; give a finite number.")


def positive(what: str, name: str, value: Any) -> None:
    """Refuse what is no number of seconds above 0."""
    if not is_finite(value) or not float(value) > 0:
        raise InputError(
            f"{what}: {name} = {value!r} is not usable; give a finite number of seconds above 0."
        )


def late_by(what: str, name: str, value: Any) -> Fraction:
    """A start as a rational; what is no number of 0 s or more is refused."""
    if not is_finite(value) or value < 0:
        raise InputError(
            f"{what}: {name} = {value!r} is not usable; give 0 s or more, as signals begin at 0 s."
        )
    return rational(value)


def rational(value: Any) -> Fraction:
    """The decimal that a float prints as (0.08 → 2/25)."""
    exact = isinstance(value, Fraction | int)
    return Fraction(value) if exact else Fraction(repr(float(value)))
