"""The numbers a signal is made of: refused with a sentence, or kept as exact rationals."""

from __future__ import annotations

import math
from fractions import Fraction
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl.errors import InputError

SIDES = ("left", "right")


def shown(value: object) -> str:
    """The value as it is typed, on one line and cut where it would fill the screen."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "…"


def reals(value: object) -> NDArray[np.float64] | None:
    """The value as an array of finite real numbers of its shape, None where it is no such thing."""
    found = _array(value, "iuf", float)
    return None if found is None else np.asarray(found, float)


def complexes(value: object) -> NDArray[np.complex128] | None:
    """The value as an array of finite complex numbers of its shape, None where it is no such."""
    found = _array(value, "iufc", complex)
    return None if found is None else np.asarray(found, complex)


def _array(value: object, kinds: str, kind: type) -> NDArray[Any] | None:
    try:
        given = np.asarray(value)
        if given.dtype.kind == "O":  # fractions, SymPy's numbers and integers of any length
            if any(isinstance(x, str | bytes | bool | None) for x in given.ravel()):
                return None
        elif given.dtype.kind not in kinds:
            return None
        found: NDArray[Any] = given.astype(kind, copy=False)
    except (TypeError, ValueError, OverflowError):  # ragged, no numbers, or beyond a float
        return None
    return found if np.isfinite(found).all() else None


def real_number(what: str, name: str, value: object, unit: str) -> float:
    """A finite real number as a float, else a sentence."""
    if not is_finite(value):
        raise InputError(
            f"{what}: {name} = {shown(value)} is not usable; give a finite number of {unit}."
        )
    return float(value)  # type: ignore[arg-type]


def frequencies(omega: object) -> NDArray[np.float64]:
    """Frequencies of a response as a list (a single one as a list of one), else a sentence."""
    w = reals(omega)
    if w is None or w.ndim > 1 or not w.size:
        raise InputError(
            f"frequency_response: omega = {shown(omega)} is not usable; "
            "give a list of finite frequencies in rad/s."
        )
    return np.atleast_1d(w)


def points(letter: str, value: object) -> NDArray[np.complex128]:
    """Points of the complex plane at which a channel is asked for, else a sentence."""
    at = complexes(value)
    if at is None:
        raise InputError(
            f"channel: {letter} = {shown(value)} is not usable; "
            "give a finite complex number or an array of such."
        )
    return at


def instants(t: object, side: object) -> NDArray[np.float64]:
    """Times (s) at which a signal is asked for from a side, else a sentence."""
    times = reals(t)
    if times is None:
        raise InputError(f"signal: t = {shown(t)} is not usable; give finite times in s.")
    check_side("signal", side)
    return times


def multiple(name: str, value: Any) -> Any:
    """A factor or divisor of a signal, None where it is neither a number nor a symbol."""
    if not isinstance(value, Real) and not hasattr(value, "free_symbols"):
        return None
    if name == "factor" and isinstance(value, float):
        return value  # the signal names its own field if the product is not finite
    check_number("signal", name, value)
    if name == "divisor" and value == 0:
        raise InputError("signal: divisor = 0 is not usable; give a number other than 0.")
    # A NumPy number would warn where its inverse overflows.
    kept = name == "factor" or (hasattr(value, "free_symbols") and not value.is_number)
    return value if kept else float(value)


def check_side(what: str, side: object) -> None:
    """Refuse what names no side of a jump."""
    if not isinstance(side, str) or side not in SIDES:
        raise InputError(f"{what}: side = {shown(side)} is unknown; give 'right' or 'left'.")


def is_finite(value: object) -> bool:
    """Whether this is a real number that a float can hold."""
    real = isinstance(value, Real) and not isinstance(value, bool)
    try:
        return real and math.isfinite(value)  # type: ignore[arg-type]
    except OverflowError:  # an integer that no float can hold
        return False


def check_number(what: str, name: str, value: Any) -> None:
    """Refuse what is neither a finite number nor a symbol."""
    if hasattr(value, "free_symbols"):  # symbols: for closed forms
        usable = not getattr(value, "is_number", False) or bool(value.is_finite and value.is_real)
    else:
        usable = is_finite(value)
    if not usable:
        raise InputError(f"{what}: {name} = {shown(value)} is not usable; give a finite number.")


def positive(what: str, name: str, value: Any) -> None:
    """Refuse what is no number of seconds above 0."""
    if not is_finite(value) or not float(value) > 0:
        raise InputError(
            f"{what}: {name} = {shown(value)} is not usable; "
            "give a finite number of seconds above 0."
        )


def late_by(what: str, name: str, value: Any) -> Fraction:
    """A start as a rational; what is no number of 0 s or more is refused."""
    if not is_finite(value) or value < 0:
        raise InputError(
            f"{what}: {name} = {shown(value)} is not usable; "
            "give 0 s or more, as signals begin at 0 s."
        )
    return rational(value)


def rational(value: Any) -> Fraction:
    """The decimal that a float prints as (0.08 → 2/25)."""
    exact = isinstance(value, Fraction | int)
    return Fraction(value) if exact else Fraction(repr(float(value)))
