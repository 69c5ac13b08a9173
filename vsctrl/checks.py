"""One way to check a value and to quote it: every refusal names field, value and remedy.

It holds what several rooms ask of numbers and arrays; what only one of them can judge, as whether a
signal exists, is checked there.
"""

from __future__ import annotations

import math
from fractions import Fraction
from numbers import Real
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from vsctrl.errors import InputError, cut

LONGEST = 60  #: characters of a value in a sentence


def quoted(value: object) -> str:
    """The value as it is typed, on one line, without its middle where it would fill the screen."""
    if isinstance(value, np.generic):
        value = value.item()
    try:
        return cut(repr(value), LONGEST)
    except ValueError:  # an integer with more digits than Python prints
        return "a number of thousands of digits"
    except RecursionError:
        return f"a {type(value).__name__} nested hundreds of levels deep"


def unusable(name: str, value: object, remedy: str) -> InputError:
    """The refusal of a value, ``name = value is not usable; give remedy.``"""
    return InputError(f"{name} = {quoted(value)} is not usable; give {remedy}.")


def require_kind(name: str, value: object, kind: type, remedy: str) -> None:
    """Raises InputError, ``name: value is no Kind; remedy.``, for a value of another type."""
    if not isinstance(value, kind):
        raise InputError(f"{name}: {quoted(value)} is no {kind.__name__}; {remedy}.")


def is_symbolic(value: Any) -> bool:
    """Whether a value is an expression with symbols in it, rather than a number."""
    return hasattr(value, "free_symbols") and not getattr(value, "is_number", False)


def is_finite(value: Any) -> bool:
    """Whether this is a real number that a float can hold; SymPy's exact numbers are."""
    if isinstance(value, bool):
        return False
    exact = getattr(value, "is_number", False) and getattr(value, "is_real", None) is True
    try:
        return (isinstance(value, Real) or exact) and math.isfinite(value)
    except (OverflowError, TypeError):  # an integer that no float can hold; a positive symbol
        return False


def is_number(value: object) -> TypeGuard[float]:
    """Whether this is a real number, finite or not, and no truth value."""
    return isinstance(value, Real) and not isinstance(value, bool | np.bool_)


def is_whole(value: object) -> TypeGuard[int]:
    """Whether this is a whole number of any size, and no truth value."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def number(name: str, value: Any, remedy: str = "a finite number") -> float:
    """A finite real number as a float."""
    if not is_finite(value):
        raise unusable(name, value, remedy)
    return float(value)


def positive(name: str, value: Any, remedy: str = "a number above 0") -> float:
    """A finite number above 0."""
    if not number(name, value, remedy) > 0:
        raise unusable(name, value, remedy)
    return float(value)


def delay(name: str, value: Any) -> float:
    """A finite number of seconds, 0 or more."""
    if number(name, value) < 0:
        raise InputError(f"{name} = {quoted(value)} s is not usable; give a delay of 0 s or more.")
    return float(value)


def decimal(name: str, value: Any) -> Fraction:
    """The decimal that a float prints as (0.08 → 2/25), so that delays add up exactly."""
    if isinstance(value, Fraction | int):
        return Fraction(value)
    if not abs(value) < math.inf:
        raise InputError(f"{name}: {value} is not finite; give a finite number.")
    return Fraction(repr(float(value)))


def reals(value: object) -> NDArray[np.float64] | None:
    """The value as an array of finite real numbers of its shape, None where it is no such thing."""
    return _array(value, "iuf", float)


def complexes(value: object) -> NDArray[np.complex128] | None:
    """The value as an array of finite complex numbers of its shape, None where it is no such."""
    return _array(value, "iufc", complex)


def _array(value: object, kinds: str, kind: type) -> NDArray[Any] | None:
    try:
        array = np.asarray(value)
        if array.dtype.kind == "O":  # fractions, SymPy's numbers and integers of any length
            if any(isinstance(x, str | bytes | bool | None) for x in array.ravel()):
                return None
        elif array.dtype.kind not in kinds:
            return None
        array = np.asarray(array.astype(kind, copy=False), kind)
    except (TypeError, ValueError, OverflowError):  # ragged, no numbers, or beyond a float
        return None
    return array if np.isfinite(array).all() else None


def frequencies(name: str, omega: object) -> NDArray[np.float64]:
    """Frequencies (rad/s) as a list, a single one as a list of one."""
    w = reals(omega)
    if w is None or w.ndim > 1 or not w.size:
        raise unusable(name, omega, "a list of finite frequencies in rad/s")
    return np.atleast_1d(w)


def points(name: str, value: object) -> NDArray[np.complex128]:
    """Points of the complex plane, any shape."""
    array = complexes(value)
    if array is None:
        raise unusable(name, value, "a finite complex number or an array of such")
    return array


def side(what: str, value: object) -> str:
    """A side of a jump, "right" or "left"."""
    if not isinstance(value, str) or value not in {"right", "left"}:
        raise InputError(f"{what}: side = {quoted(value)} is unknown; give 'right' or 'left'.")
    return value
