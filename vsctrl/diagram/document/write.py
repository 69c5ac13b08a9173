"""A diagram, with its numbers and what is asked of it, as the text of a loop file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from vsctrl import toml
from vsctrl.checks import quoted
from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.document import keys
from vsctrl.diagram.document.applied import Applied
from vsctrl.diagram.document.names import ascii_name
from vsctrl.diagram.document.render import name_of, render
from vsctrl.diagram.document.units import written
from vsctrl.errors import InputError


def diagram_tables(
    diagram: Wiring,
    values: Mapping[str, float] | None = None,
    units: Mapping[str, str] | None = None,
    meanings: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """The keys of a diagram: inputs, outputs, parameters (None where there is no value), blocks."""
    return {
        "inputs": diagram.inputs,
        "outputs": diagram.outputs,
        "parameters": _parameters(diagram, values, units or {}, meanings or {}),
        "block": tuple(
            {"name": part.name, "wiring": f"{part.input} -> {part.output}"}
            | {"transfer": render(part.expr)}
            if isinstance(part, Block)
            else {"sum": str(part)}
            for part in diagram.parts
        ),
    }


def applied_tables(applied: Iterable[Applied], unit: str) -> tuple[dict[str, Any], ...]:
    """The entries [[apply]], times in a unit where that is exact."""
    tables = []
    for one in applied:
        table: dict[str, Any] = {"input": one.input, "kind": one.kind, "size": float(one.size)}
        for key in ("omega", "rate"):
            if getattr(one, key) is not None:
                table[key] = float(getattr(one, key))
        if one.width is not None:
            table["width"] = time(one.width, unit)
        tables.append(table | {"at": time(one.at, unit)})
    return tuple(tables)


def time(seconds: float, unit: str) -> float | str:
    """A time as it is written, ``"5.0 min"``; in s, as a number, where no unit has it exactly."""
    amount = written(float(seconds), unit)
    return (
        float(seconds)
        if unit == "s" or amount is None
        else f"{repr(amount).removesuffix('.0')} {unit}"
    )


def text(tables: Mapping[str, Any]) -> str:
    """The file of these tables, with a comment on every key, of blocks on the first of a kind."""
    comments = dict(keys.TOP)
    for name in tables.get("parameters", {}):
        comments[f"parameters.{name}"] = "give it a number"
    for table, known in (("block", keys.BLOCK), ("apply", keys.APPLY)):
        told: set[str] = set()
        for number, entry in enumerate(tables.get(table, ())):
            comments |= {f"{table}.{number}.{k}": known[k] for k in entry if k not in told}
            told |= set(entry)
    comments |= {f"sampling.{key}": meaning for key, meaning in keys.SAMPLING.items()}
    given = {name: value for name, value in tables["parameters"].items() if value is not None}
    comments = {k: m for k, m in comments.items() if k.removeprefix("parameters.") not in given}
    return toml.emit({k: v for k, v in tables.items() if v != ()}, comments)


def _parameters(
    diagram: Wiring,
    values: Mapping[str, float] | None,
    units: Mapping[str, str],
    meanings: Mapping[str, str],
) -> dict[str, Any]:
    numbers = None if values is None else diagram.numbers(values)
    out: dict[str, Any] = {}
    for name, symbol in diagram.parameters.items():
        called = name_of(symbol)
        if called in out:
            raise InputError(
                f"to_toml: two parameters would be called {quoted(called)} in a file; rename one."
            )
        out[called] = None if numbers is None else _value(numbers[name], units.get(name, ""),
                                                         meanings.get(name, ""))  # fmt: skip
    return out


def _value(value: float, unit: str, meaning: str) -> Any:
    amount = written(value, unit)
    shown: dict[str, Any] = {"value": value if amount is None else amount}
    shown |= {"unit": unit} if unit and amount is not None else {}
    shown |= {"meaning": meaning} if meaning else {}
    return toml.Inline(shown) if len(shown) > 1 else value


def called(diagram: Wiring) -> dict[str, str]:
    """The name that each parameter of a diagram has in a file → its keyword."""
    return {ascii_name(name): name for name in diagram.parameters}
