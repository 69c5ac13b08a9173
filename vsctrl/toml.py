"""Files of scenarios and loops: TOML text in and out.

Reading is Python's own ``tomllib``. Writing is fifty lines here, because a file needs its units as
comments and an exact round trip, and no more of TOML than tables of numbers, text and lists.
What the keys mean is left to those who read them.
"""

import re
import tomllib
from collections.abc import Mapping
from typing import Any

from vsctrl.errors import InputError, cut
from vsctrl.problems import FieldsError

DEEPEST = 100  #: parts of a dotted key
_QUOTED = re.compile(r"""(?:"(?:[^"\\]|\\.)*"|'[^']*')""")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
LONGEST_REASON = 200  #: characters of what the parser says

_ESCAPES = {"\b": "\\b", "\t": "\\t", "\n": "\\n", "\f": "\\f", "\r": "\\r"} | {
    '"': '\\"',
    "\\": "\\\\",
}


class Inline(dict[str, Any]):
    """A table that is written on the line of its key, ``{ value = 5, unit = "min" }``."""


def parse(text: str) -> dict[str, Any]:
    """Tables of a TOML text. Raises InputError with the line where it breaks."""
    if not isinstance(text, str):
        raise InputError(f"TOML text: {type(text).__name__} is not text; decode it as UTF-8 first.")
    try:
        _check_keys(text)
        return tomllib.loads(text)
    except RecursionError:
        raise FieldsError([("TOML", "brackets are nested too deeply; write plain lists")]) from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        said = cut(str(error), LONGEST_REASON)
        raise FieldsError(
            [("TOML", f"{said}; correct it, as in: key = 2.5, text in quotes, lists in [ ]")]
        ) from None


def _check_keys(text: str) -> None:
    """Refuse keys of hundreds of parts, of which Python's parser keeps every beginning.

    They are told from lists of decimals, which have as many commas as points.
    """
    for number, line in enumerate(text.split("\n"), start=1):
        if line.count(".") <= DEEPEST or line.lstrip().startswith("#"):
            continue
        pieces = _QUOTED.sub("", line).split("=")
        if max(piece.count(".") - piece.count(",") for piece in pieces) > DEEPEST:
            problem = f"line {number}: a key of more than {DEEPEST} parts; tables have one or two"
            raise FieldsError([("TOML", problem)])


def emit(data: Mapping[str, Any], comments: Mapping[str, str]) -> str:
    """TOML text of values, tables and lists of tables, each key with its comment.

    comments: by dotted name, list entries by their number from 0. Values: text, booleans, integers,
    finite floats, sequences and `Inline` tables of these; None is a key left out, shown as a
    comment.
    """
    return "\n".join(_table(data, comments, "")) + "\n"


def _table(values: Mapping[str, Any], comments: Mapping[str, str], path: str) -> list[str]:
    """Keys first, then tables: a key after a table's heading would belong to that table."""
    lines: list[str] = []
    nested: list[str] = []
    for key, value in values.items():
        name = f"{path}{key}"
        if isinstance(value, Mapping) and not isinstance(value, Inline):
            nested += ["", f"[{name}]", *_table(value, comments, f"{name}.")]
        elif _is_list_of(value, Mapping):
            for number, entry in enumerate(value):
                heading = f"[[{name}]]"
                nested += ["", heading, *_table(entry, comments, f"{name}.{number}.")]
        elif value is None:
            lines.append(f"# {_bare(key)} =  # {comments[name]}")
        else:
            comment = comments.get(name)
            lines += _key(_bare(key), value, f"  # {comment}" if comment else "")
    return lines + nested


def _key(key: str, value: object, comment: str) -> list[str]:
    if isinstance(value, tuple) and _is_list_of(value, tuple):
        return [f"{key} = [{comment}", *(f"    {_value(row)}," for row in value), "]"]
    return [f"{key} = {_value(value)}{comment}"]


def _bare(key: str) -> str:
    return key if _BARE.fullmatch(key) else _value(key)


def _is_list_of(value: object, kind: type) -> bool:
    return isinstance(value, tuple) and bool(value) and isinstance(value[0], kind)


def _value(value: object) -> str:
    if isinstance(value, str):
        return '"' + "".join(_escaped(c) for c in value) + '"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return "[" + ", ".join(_value(entry) for entry in value) + "]"
    if isinstance(value, Inline):
        return "{ " + ", ".join(f"{_bare(k)} = {_value(v)}" for k, v in value.items()) + " }"
    return repr(value)  # Python writes numbers as TOML does, with the digits that give them back


def _escaped(c: str) -> str:
    if c in _ESCAPES:
        return _ESCAPES[c]
    return f"\\u{ord(c):04X}" if ord(c) < 0x20 or ord(c) == 0x7F else c
