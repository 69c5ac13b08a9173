"""The keys of a loop file: what each means, for comments, for refusals and for editors."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from vsctrl.diagram.document.applied import KINDS
from vsctrl.diagram.document.templates import TEMPLATES
from vsctrl.diagram.document.units import TIME_UNITS, UNITS
from vsctrl.problems import Problem, remedy, show

TOP = {
    "name": "short name",
    "description": "what it is for",
    "time_unit": "in which times are shown and asked for: " + ", ".join(TIME_UNITS),
    "inputs": "signals that come from outside: set-points, disturbances",
    "outputs": "signals that are of interest; the first leads the drawing",
    "open": "signal at which L of the margins is broken",
    "watch": "signals whose responses are shown; left out: the outputs",
    "duration": "of the responses that are shown",
    "parameters": "numbers for the names in the blocks",
    "block": "blocks and sums, joined wherever a signal has the same name",
    "apply": "what is applied to the inputs",
    "sampling": "the computer that closes the loop",
}
BLOCK = {
    "name": "of the block, each its own",
    "wiring": 'the signals that it joins, "input -> output"',
    "sum": 'a summing point, in place of all other keys: "e = r - y"',
    "transfer": "transfer function in s (rad/s), a formula of s and parameters",
    "numerator": "coefficients of a transfer function, highest power of s first",
    "denominator": "coefficients, highest power of s first",
} | {kind: template.meaning for kind, template in TEMPLATES.items()}
APPLY = {
    "input": "where it is applied",
    "kind": ", ".join(KINDS),
    "size": "amplitude; of a ramp its slope, 1/s",
    "at": "when it begins",
    "omega": "of a sine, rad/s",
    "rate": "of an exponential, 1/s",
    "width": "of a pulse",
}
SAMPLING = {
    "period": "of the computer",
    "hold": "signal that is held over each period",
    "digital": "blocks that the computer runs, each by forward, backward or tustin",
}
#: those of a block that say what it does, one of which it has
KINDS_OF_BLOCK = ("transfer", "numerator", *TEMPLATES)


def strangers(table: Mapping[str, Any], known: Mapping[str, str], where: str) -> list[Problem]:
    """Keys that the table cannot have, each with the nearest that it can."""
    at = f"{where}." if where else ""
    return [
        (f"{at}{key}", f"unknown key with value {show(value)}{remedy(key, known)}")
        for key, value in table.items()
        if key not in known
    ]


def schema() -> str:
    """JSON Schema of a loop file, for editors that complete and check TOML or JSON."""
    text: dict[str, Any] = {"type": "string"}
    amount = {
        "anyOf": [
            {"type": "number"},
            {"type": "string", "description": 'with its unit, as "5 min"'},
            {
                "type": "object",
                "properties": {
                    "value": {"type": "number"},
                    "unit": {"enum": [*UNITS]},
                    "meaning": text,
                },
                "required": ["value"],
                "additionalProperties": False,
            },
        ]
    }
    short = {"type": ["number", "string"]}
    coefficients = {"type": ["array", "number", "string"], "items": short}
    names = {"type": "array", "items": text, "uniqueItems": True}
    blocks: dict[str, Any] = dict.fromkeys(("name", "wiring", "sum", "transfer"), text)
    blocks |= dict.fromkeys(("numerator", "denominator"), coefficients)
    for kind, template in TEMPLATES.items():
        table = _object(dict.fromkeys(template.names, ""), dict.fromkeys(template.names, short))
        table["required"] = [n for n in template.names if n not in template.defaults]
        blocks[kind] = {"anyOf": [short, table]} if len(template.names) == 1 else table
    apply: dict[str, Any] = dict.fromkeys(APPLY, amount)
    apply |= {"input": text, "kind": {"enum": [*KINDS]}}
    sampling = {
        "period": amount,
        "hold": text,
        "digital": {
            "type": "object",
            "additionalProperties": {"enum": ["forward", "backward", "tustin"]},
        },
    }
    top: dict[str, Any] = dict.fromkeys(("name", "description", "open"), text)
    top |= {"time_unit": {"enum": [*TIME_UNITS]}, "inputs": names, "outputs": names}
    top |= {"watch": names, "duration": amount}
    top["parameters"] = {"type": "object", "additionalProperties": amount}
    top["block"] = {"type": "array", "items": _object(BLOCK, blocks), "minItems": 1}
    top["apply"] = {"type": "array", "items": _object(APPLY, apply) | {"required": ["input"]}}
    top["sampling"] = _object(SAMPLING, sampling) | {"required": ["period", "hold"]}
    whole = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Loop"}
    whole |= _object(TOP, top) | {"required": ["block"]}
    return json.dumps(whole, indent=2, ensure_ascii=False) + "\n"


def _object(meanings: Mapping[str, str], kinds: Mapping[str, Any]) -> dict[str, Any]:
    properties = {
        key: kinds[key] | ({"description": meaning} if meaning else {})
        for key, meaning in meanings.items()
    }
    return {"type": "object", "properties": properties, "additionalProperties": False}
