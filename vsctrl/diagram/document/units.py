"""Units: a number as people write it, ``"5 min"``, in SI and back, exactly."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from vsctrl.checks import decimal, is_number
from vsctrl.errors import nearest
from vsctrl.problems import show

#: unit → (what it measures, its size in SI)
UNITS: dict[str, tuple[str, Fraction]] = {
    "1": ("number", Fraction(1)),
    "%": ("number", Fraction(1, 100)),
    "ms": ("time", Fraction(1, 1000)),
    "s": ("time", Fraction(1)),
    "min": ("time", Fraction(60)),
    "h": ("time", Fraction(3600)),
    "1/ms": ("rate", Fraction(1000)),
    "1/s": ("rate", Fraction(1)),
    "1/min": ("rate", Fraction(1, 60)),
    "1/h": ("rate", Fraction(1, 3600)),
    "rad/s": ("rate", Fraction(1)),
    "rad/min": ("rate", Fraction(1, 60)),
}
TIME_UNITS = ("ms", "s", "min", "h")
LARGEST = 1e300

_QUANTITY = re.compile(r"\s*(?P<number>[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)"
                       r"\s*(?P<unit>\S*)\s*")  # fmt: skip
_LONGEST = 60  #: characters of a number with its unit


@dataclass(frozen=True)
class Quantity:
    """A number in SI, the unit in which it was written ("" for none), and what it means."""

    value: float
    unit: str = ""
    meaning: str = ""


def quantity(value: object, measures: str = "") -> Quantity:
    """A number, ``"5 min"`` or ``{value = 5, unit = "min", meaning = "…"}``, in SI.

    measures: "time" or "rate" (1/s) where no other unit will do. Raises ValueError with the second
    half of a sentence.
    """
    if isinstance(value, Mapping):
        return _of_table(value, measures)
    if isinstance(value, str):
        match = _QUANTITY.fullmatch(value) if len(value) <= _LONGEST else None
        if not match:
            raise ValueError(f'{show(value)} is no number with a unit; write it like "5 min"')
        return _of(Fraction(match["number"]), match["unit"], measures, value)
    if not is_number(value):
        raise ValueError(f'{show(value)} is not a number; write one such as 2.5 or "5 min"')
    if not abs(value) < LARGEST:
        raise ValueError(f"{show(value)} is not a finite number; give one")
    return Quantity(float(value) + 0.0)


def has_unit(value: object) -> bool:
    """Whether this is text of a number and a unit that there is, and so no formula."""
    if not isinstance(value, str) or len(value) > _LONGEST:
        return False
    match = _QUANTITY.fullmatch(value)
    return match is not None and match["unit"] in UNITS


def written(value: float, unit: str) -> float | None:
    """A number in SI in another unit, None where it would not be read back as the same."""
    amount = float(decimal("value", value) / UNITS[unit][1]) if unit else value
    return amount if math.isfinite(amount) and in_si(amount, unit) == value else None


def in_si(amount: float, unit: str) -> float:
    """A number of a unit in SI, by its decimal and then rounded once."""
    return float(decimal("value", amount) * UNITS[unit][1]) if unit else amount


def _of(amount: Fraction, unit: str, measures: str, typed: object) -> Quantity:
    if unit and unit not in UNITS:
        known = ", ".join(UNITS)
        raise ValueError(f"unit {show(unit)} is unknown{nearest(unit, UNITS)}; choose {known}")
    if unit and measures and UNITS[unit][0] != measures:
        fitting = ", ".join(name for name, (kind, _) in UNITS.items() if kind == measures)
        raise ValueError(f"{show(typed)} is no {measures}; give it in {fitting}")
    size = UNITS[unit][1] if unit else Fraction(1)
    try:
        value = float(amount * size)
    except OverflowError:
        value = math.inf
    if not abs(value) < LARGEST:
        raise ValueError(f"{show(typed)} is too large; give a smaller number")
    return Quantity(value, unit)


def _of_table(table: Mapping[str, object], measures: str) -> Quantity:
    known = ("value", "unit", "meaning")
    for key in table:
        if key not in known:
            hint = nearest(key, known)
            raise ValueError(f"unknown key {show(key)}{hint}; it may have {', '.join(known)}")
    if "value" not in table:
        raise ValueError("has no value; write { value = 2.5 }")
    value, unit, meaning = table["value"], table.get("unit", ""), table.get("meaning", "")
    if not isinstance(unit, str) or not isinstance(meaning, str):
        raise ValueError('unit and meaning are text; write them in quotes, like unit = "min"')
    if not is_number(value) or not abs(value) < LARGEST:
        raise ValueError(f"value {show(value)} is not a finite number; give one")
    found = _of(decimal("value", value), unit, measures, dict(table))
    return Quantity(found.value, unit, meaning)
