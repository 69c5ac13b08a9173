"""One entry [[block]] of a loop file: a sum, or a block by one of the ways to give one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy as sp

from vsctrl.checks import quoted
from vsctrl.diagram.description.blocks import Block, Part, Sum
from vsctrl.diagram.document import keys, templates
from vsctrl.diagram.document.formula import parse
from vsctrl.diagram.document.templates import number_or_formula
from vsctrl.errors import InputError, cut
from vsctrl.problems import Problem, show
from vsctrl.symbols import s

MOST_COEFFICIENTS = 100
LONGEST_NAME = 100  #: characters of a block's name

_TEXTS = ("name", "wiring", "sum")


def read(entry: Any, number: int) -> tuple[Part | None, list[Problem]]:
    """The part that an entry describes, None where it is wrong, and what is wrong with it.

    number: of the entry, from 1, by which one without a name is called.
    """
    if not isinstance(entry, Mapping):
        return None, [(f"block {number}", f"{show(entry)} is no table; write [[block]]")]
    name = entry.get("name")
    where = (
        f"block {quoted(cut(name, 40))}" if isinstance(name, str) and name else f"block {number}"
    )
    problems = keys.strangers(entry, keys.BLOCK, where)
    problems += [
        (f"{where}.{key}", f"{show(entry[key])} is not text; write it in quotes")
        for key in _TEXTS
        if key in entry and not isinstance(entry[key], str)
    ]
    if not problems and "sum" in entry:
        return _sum(entry, where)
    if not problems:
        problems = [(f"{where}.{key}", sentence) for key, sentence in _missing(entry)]
    return (None, problems) if problems else _block(entry, where)


def _sum(entry: Mapping[str, Any], where: str) -> tuple[Part | None, list[Problem]]:
    more = [key for key in entry if key not in ("sum", "name")]
    if more:
        return None, [(f"{where}.{more[0]}", "belongs to a block, and this is a sum; drop it")]
    try:
        return Sum(entry["sum"]), []
    except InputError as error:
        return None, [(f"{where}.sum", _sentence(error, "Sum: "))]


def _missing(entry: Mapping[str, Any]) -> list[Problem]:
    """What a block lacks, or has twice."""
    problems: list[Problem] = [
        (key, f"missing; give {keys.BLOCK[key]}") for key in ("name", "wiring") if key not in entry
    ]
    if len(entry.get("name", "")) > LONGEST_NAME:
        problems.append(("name", f"has more than {LONGEST_NAME} characters; shorten it"))
    kinds = [key for key in keys.KINDS_OF_BLOCK if key in entry]
    if "numerator" in kinds and "delay" in kinds:
        kinds.remove("delay")  # a factor of it
    if not kinds:
        problems.append(
            ("transfer", f"missing; give it, or one of {', '.join(keys.KINDS_OF_BLOCK[1:])}")
        )
    if len(kinds) > 1:
        problems.append((kinds[1], f"is a second description beside {kinds[0]}; keep one"))
    if ("numerator" in entry) != ("denominator" in entry):
        there = "numerator" if "numerator" in entry else "denominator"
        problems.append((there, "stands alone; give numerator and denominator"))
    return problems


def _block(entry: Mapping[str, Any], where: str) -> tuple[Part | None, list[Problem]]:
    kind = next(key for key in keys.KINDS_OF_BLOCK if key in entry)
    try:
        expr = _expression(kind, entry)
    except ValueError as error:
        problem = f"{show(entry[kind])} {error}" if kind == "transfer" else str(error)
        return None, [(f"{where}.{kind}", problem)]
    try:
        return Block(entry["name"], expr, entry["wiring"]), []
    except InputError as error:
        text = _sentence(error, f"Block {quoted(entry['name'])}: ")
        key = "wiring" if text.startswith(("the wiring", repr(entry["wiring"]))) else kind
        return None, [(f"{where}.{key}", text)]


def _expression(kind: str, entry: Mapping[str, Any]) -> sp.Expr:
    if kind == "transfer":
        return parse(entry["transfer"])
    if kind != "numerator":
        return templates.expression(kind, entry[kind])
    above, below = (_polynomial(side, entry[side]) for side in ("numerator", "denominator"))
    if below.is_zero:
        raise ValueError("the denominator is 0; give it a coefficient other than 0")
    late = templates.expression("delay", entry["delay"]) if "delay" in entry else sp.Integer(1)
    return above / below * late


def _polynomial(side: str, value: Any) -> sp.Expr:
    listed = value if isinstance(value, list) else [value]
    if not 1 <= len(listed) <= MOST_COEFFICIENTS:
        raise ValueError(f"{side}: {len(listed)} coefficients; give 1 to {MOST_COEFFICIENTS}")
    coefficients = [number_or_formula(side, entry) for entry in listed]
    return sp.Add(*(c * s**k for k, c in enumerate(reversed(coefficients))))


def _sentence(error: InputError, front: str) -> str:
    """What a part says of itself, without its own name and full stop."""
    return cut(str(error).removeprefix(front).rstrip("."), 400)
