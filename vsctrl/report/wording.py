"""Numbers in sentences: each with the unit that suits its size, and never with an exponent."""

from __future__ import annotations

import math
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
    """A number to n significant digits; of what is very large or very small as 1.23·10⁻⁷."""
    found = float(f"{value:.{n}g}") + 0.0  # of −0, 0
    if math.isinf(found):
        shown = "∞" if found > 0 else "-∞"
    elif found and not SMALLEST <= abs(found) < LARGEST:
        leading, power = f"{found:.{n - 1}e}".split("e")
        shown = f"{float(leading):g}·10{str(int(power)).translate(RAISED)}"
    else:
        shown = f"{Decimal(f'{found:.{n}g}'):f}"
    return shown.replace("-", "−")


def percent(share: float) -> str:
    """A share to three digits, 0 of less than a millionth, which no one sees."""
    return f"{digits(100 * share, 3) if abs(share) >= UNSEEN else '0'} %"


UNSEEN = 1e-6
#: Between these a number is written out.
SMALLEST, LARGEST = 1e-5, 1e7
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

#: seconds in a unit of time in which a loop is told, and in those that are smaller
UNITS = {"ns": 1e-9, "µs": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}
FEW, MANY = 0.01, 1e4  #: of its unit, where a time is told in a smaller or a larger one


def time(value: float, unit: str) -> str:
    """A time (s) in the unit in which its loop is told, or in one that suits it much better."""
    names = list(UNITS)
    k = names.index(unit)
    if 0 < value < FEW * UNITS[unit]:
        k = max((i for i in range(k) if value >= UNITS[names[i]]), default=0)
    elif value >= MANY * UNITS[unit]:
        k = max((i for i in range(k, len(names)) if value >= UNITS[names[i]]), default=k)
    return f"{digits(value / UNITS[names[k]], 3)} {names[k]}"
