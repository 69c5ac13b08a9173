"""Fields as text, from a command line: read as what they are in a scenario file.

A value is written as there, ``5``, ``[0.04, 0, 0]``, ``true``; a word needs no quotes. ``none``
leaves a field out that may be. Nothing is evaluated: the text is one value of TOML, or a word.
"""

import tomllib
from collections.abc import Mapping
from typing import Any

from vsctrl.servo.scenario.description import TABLE_OF, TABLES, Description
from vsctrl.servo.scenario.links import KINDS
from vsctrl.servo.scenario.tables import Table

NONE = "none"


def values(settings: Mapping[str, str], kind: str) -> dict[str, Any]:
    """The value of each field by its own name; kind: of the motion that has them.

    A key may have its table before it, as ``law.lam``. Keys and values are judged by ``with_``.
    """
    chosen = settings.get("kind", settings.get("motion.kind", kind)).strip("\"'")
    return {name: _value(name, text, chosen) for name, text in _named(settings).items()}


def _named(settings: Mapping[str, str]) -> dict[str, str]:
    out = {}
    for key, text in settings.items():
        table, _, name = key.rpartition(".")
        out[name if table and TABLE_OF.get(name) == table else key] = text
    return out


def _value(name: str, text: str, kind: str) -> Any:
    table = TABLE_OF.get(name, "")
    model: type[Table] = Description
    if table:
        model = KINDS.get(kind, Table) if table == "motion" else TABLES[table]
    field = model.model_fields.get(name)
    if field is not None and name in ("name", "description"):
        return text
    may_be_left = field is not None and not field.is_required() and field.default is None
    if may_be_left and text.casefold() == NONE:
        return None
    try:
        found = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return found["value"] if list(found) == ["value"] else text
