"""From the tables of a loop file to what they say, with everything that is wrong at once.

What a loop must satisfy as a whole, that signals exist and parameters are used, is left to `loop`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from vsctrl.checks import quoted
from vsctrl.diagram.description.blocks import Part
from vsctrl.diagram.document import blocks, keys
from vsctrl.diagram.document.applied import Applied
from vsctrl.diagram.document.names import ascii_name
from vsctrl.diagram.document.units import TIME_UNITS, quantity
from vsctrl.errors import nearest
from vsctrl.problems import Problem, show

MOST_PARTS = 500
MOST_ENTRIES = 1000  #: of a list of signals, parameters or signals applied


@dataclass
class Contents:
    """What a file says, by the names of a loop's fields, and what is wrong with it."""

    parts: list[Part] = field(default_factory=list)
    inputs: list[str] | None = None
    outputs: list[str] | None = None
    fields: dict[str, Any] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    @property
    def whole(self) -> bool:
        """Whether every block could be read, so that it can be told what the diagram lacks."""
        return not any(name.startswith(("block", "inputs", "outputs")) for name, _ in self.problems)


def read(tables: Mapping[str, Any]) -> Contents:
    """The contents of a file's tables."""
    found = Contents()
    found.problems += keys.strangers(tables, keys.TOP, "")
    _blocks(tables.get("block"), found)
    found.inputs, found.outputs = (_names(tables, side, found) for side in ("inputs", "outputs"))
    for key, name in (("name", "name"), ("description", "description"), ("open", "opened")):
        if key in tables:
            found.fields[name] = _checked(found, key, _text, tables[key])
    if "time_unit" in tables:
        found.fields["time_unit"] = _checked(found, "time_unit", _time_unit, tables["time_unit"])
    if "duration" in tables:
        found.fields["duration"] = _checked(found, "duration", _seconds, tables["duration"])
    found.fields["watched"] = tuple(_names(tables, "watch", found) or ())
    _parameters(tables.get("parameters", {}), found)
    _applied(tables.get("apply", []), found)
    _sampling(tables.get("sampling"), found)
    # What could not be read is left at its default, and its problem is told.
    found.fields = {name: value for name, value in found.fields.items() if value is not None}
    return found


def _checked(found: Contents, where: str, check: Callable[[Any], Any], value: Any) -> Any:
    try:
        return check(value)
    except ValueError as error:
        found.problems.append((where, str(error)))
        return None


def _blocks(entries: Any, found: Contents) -> None:
    if not isinstance(entries, list) or not entries or len(entries) > MOST_PARTS:
        what = "missing" if entries is None else "no list of blocks"
        if isinstance(entries, list) and entries:
            what = f"there are {len(entries)} blocks, more than {MOST_PARTS}"
        found.problems.append(("block", f"{what}; write a table [[block]] for each block"))
        return
    for number, entry in enumerate(entries, start=1):
        part, problems = blocks.read(entry, number)
        found.problems += problems
        if part is not None:
            found.parts.append(part)


def _parameters(table: Any, found: Contents) -> None:
    if not isinstance(table, Mapping) or len(table) > MOST_ENTRIES:
        found.problems.append(("parameters", "is no table of a few numbers; write K = 2.5 in it"))
        return
    values: dict[str, float] = {}
    units: dict[str, str] = {}
    meanings: dict[str, str] = {}
    for key, value in table.items():
        read = _checked(found, f"parameters.{key}", quantity, value)
        name = ascii_name(key)
        if name in values:
            found.problems.append((f"parameters.{key}", f"{quoted(name)} has two values; give one"))
        if read is not None:
            values[name] = read.value
            units |= {name: read.unit} if read.unit else {}
            meanings |= {name: read.meaning} if read.meaning else {}
    found.fields |= {"values": values, "units": units, "meanings": meanings}


def _applied(entries: Any, found: Contents) -> None:
    if not isinstance(entries, list) or len(entries) > MOST_ENTRIES:
        found.problems.append(("apply", "is no list of tables; write [[apply]] for each signal"))
        return
    applied = []
    for number, entry in enumerate(entries, start=1):
        where = f"apply {number}"
        if not isinstance(entry, Mapping):
            found.problems.append((where, f"{show(entry)} is no table; write [[apply]]"))
            continue
        found.problems += keys.strangers(entry, keys.APPLY, where)
        if "input" not in entry:
            found.problems.append((f"{where}.input", "missing; name the input"))
        given: dict[str, Any] = {}
        for key, measures in _MEASURES.items():
            if key in entry:
                check = _text if measures is None else _amount(measures)
                given[key] = _checked(found, f"{where}.{key}", check, entry[key])
        if "input" in given and None not in given.values():
            applied.append(Applied(**given))
    found.fields["applied"] = tuple(applied)


#: of the keys of a signal applied, None for text
_MEASURES = {"input": None, "kind": None, "size": "", "at": "time"} | {
    "omega": "rate", "rate": "rate", "width": "time",
}  # fmt: skip


def _sampling(table: Any, found: Contents) -> None:
    if table is None:
        return
    if not isinstance(table, Mapping):
        found.problems.append(("sampling", f"{show(table)} is no table; write [sampling]"))
        return
    found.problems += keys.strangers(table, keys.SAMPLING, "sampling")
    checks = {"period": _seconds, "hold": _text, "digital": _methods}
    for key, check in checks.items():
        if key in table:
            found.fields[key] = _checked(found, f"sampling.{key}", check, table[key])
        elif key != "digital":
            found.problems.append((f"sampling.{key}", f"missing; give it: {keys.SAMPLING[key]}"))


def _names(tables: Mapping[str, Any], key: str, found: Contents) -> list[str] | None:
    def check(value: Any) -> list[str]:
        if isinstance(value, str):
            value = [value]
        if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
            raise ValueError(f'{show(value)} is no list of signals; write one like ["r", "d"]')
        twice = next((name for name in value[:MOST_ENTRIES] if value.count(name) > 1), None)
        if twice is not None or len(value) > MOST_ENTRIES:
            raise ValueError(f"{show(twice or value)} is listed too often; list each signal once")
        return value

    return _checked(found, key, check, tables[key]) if key in tables else None


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{show(value)} is not text; write it in quotes")
    return value


def _time_unit(value: Any) -> str:
    if not isinstance(value, str) or value not in TIME_UNITS:
        hint = nearest(value, TIME_UNITS)
        raise ValueError(f"{show(value)} is unknown{hint}; choose {', '.join(TIME_UNITS)}")
    return value


def _seconds(value: Any) -> float:
    return quantity(value, "time").value


def _amount(measures: str) -> Callable[[Any], float]:
    return lambda value: quantity(value, measures).value


def _methods(value: Any) -> dict[str, str]:
    if not isinstance(value, Mapping) or not all(isinstance(v, str) for v in value.values()):
        raise ValueError(f'{show(value)} is not usable; write digital = {{ PI = "tustin" }}')
    return dict(value)
