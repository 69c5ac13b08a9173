"""Values for closed forms: numbers that can be, or symbols; never text."""

import math
from numbers import Real
from typing import Any

import sympy as sp

from vsctrl.errors import InputError


def is_symbolic(value: Any) -> bool:
    """Whether a value is an expression with symbols in it, rather than a number."""
    return isinstance(value, sp.Expr) and not value.is_number


def number(name: str, value: Any) -> float:
    """A finite real number; SymPy's own numbers count. Errors name the value and the remedy."""
    real = isinstance(value, Real) or (isinstance(value, sp.Expr) and value.is_real is True)
    if isinstance(value, bool) or not real or not math.isfinite(float(value)):
        raise InputError(f"{name} = {value!r} is not usable; give a finite number.")
    return float(value)


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


def whole_periods(late: float, period: float) -> int:
    """A delay (s) in samples; a delay of no whole number of periods has no such closed form."""
    samples = round(late / period)
    if abs(late - samples * period) > 1e-9 * period:
        raise InputError(
            f"tau = {late:g} s is {late / period:.4g} periods of {period:g} s; "
            f"give a delay of a whole number of periods, such as {samples * period:g} s."
        )
    return samples
