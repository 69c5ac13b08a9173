"""Numbers in sentences: each with the unit that suits its size, and never with an exponent."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal


def per_second(value: float) -> str:
    """A gain with its unit: to a hundredth, and three digits of what is less than a tenth."""
    text = f"{value:.2f}" if value >= 0.1 else f"{Decimal(f'{value:.3g}'):f}"
    return f"{text} s⁻¹"


def seconds(value: float) -> str:
    """A time, in s or ms."""
    if value < 0.9995:
        return f"{digits(1e3 * value, 3)} ms"
    return f"{digits(value, 3)} s"


def length(value: float) -> str:
    """A length in the unit that suits it, from nanometres to metres."""
    if value >= 0.9995:
        return f"{digits(value, 3)} m"
    if value >= 0.9995e-3:
        return f"{digits(1e3 * value, 3)} mm"
    if value >= 1e-9:
        return f"{digits(1e6 * value, 2)} µm"
    return "less than a nanometre"


def listed(names: Sequence[str]) -> str:
    """Names in a sentence: a, b and c."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def digits(value: float, n: int) -> str:
    """A number to n significant digits."""
    return f"{Decimal(f'{value:.{n}g}'):f}".replace("-", "−")


#: seconds in a unit of time in which a loop is told
UNITS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


def time(value: float, unit: str) -> str:
    """A time (s) in the unit in which its loop is told."""
    return f"{digits(value / UNITS[unit], 3)} {unit}"
