"""Values for closed forms: numbers that can be, or symbols; never text."""

import math
from contextlib import suppress
from numbers import Real
from typing import Any

import sympy as sp

from vsctrl.errors import InputError

LONGEST = 60  #: characters of a value in a sentence


def is_symbolic(value: Any) -> bool:
    """Whether a value is an expression with symbols in it, rather than a number."""
    return isinstance(value, sp.Expr) and not value.is_number


def number(name: str, value: Any) -> float:
    """A finite real number; SymPy's own numbers count. Errors name the value and the remedy."""
    # A positive symbol is real too, and no number.
    exact = isinstance(value, sp.Expr) and value.is_number and value.is_real is True
    found = math.nan
    if (isinstance(value, Real) or exact) and not isinstance(value, bool):
        with suppress(OverflowError):  # an integer beyond all floats
            found = float(value)
    if not math.isfinite(found):
        raise InputError(f"{name} = {shown(value)} is not usable; give a finite number.")
    return found


def shown(value: Any) -> str:
    """What a sentence quotes of a value: its text on one line, without the middle if it is long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 15]} … {text[-12:]}"


def positive(name: str, value: Any) -> float:
    """A finite number above 0."""
    if (found := number(name, value)) <= 0:
        raise InputError(f"{name} = {value} is not usable; give a number above 0.")
    return found


def delay(name: str, value: Any) -> float:
    """A finite number of seconds, 0 or more."""
    if (found := number(name, value)) < 0:
        raise InputError(f"{name} = {value} s is not usable; give a delay of 0 s or more.")
    return found
