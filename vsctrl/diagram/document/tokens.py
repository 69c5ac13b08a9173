"""The words of a formula: numbers, names and signs, with the place of each."""

from __future__ import annotations

import re
from dataclasses import dataclass

from vsctrl.checks import quoted
from vsctrl.diagram.document.names import ascii_name

LARGEST_EXPONENT = 300  #: of a decimal, as in 1e300
MOST_DIGITS = 1000

_NUMBER = re.compile(r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_SIGNS = {c: c for c in "+-*/^()"} | {"−": "-", "·": "*", "×": "*"}


@dataclass(frozen=True)
class Token:
    """A word: `kind` is "number", "name", "end" or the sign itself; `place` counts from 1."""

    kind: str
    text: str
    place: int


def read(text: str) -> list[Token]:
    """The words of a text, "end" the last. Raises ValueError for what is none."""
    found: list[Token] = []
    at = 0
    while at < len(text):
        c = text[at]
        if c.isspace():
            at += 1
        elif text.startswith("**", at):
            found.append(Token("^", "**", at + 1))
            at += 2
        elif c in _SIGNS:
            found.append(Token(_SIGNS[c], c, at + 1))
            at += 1
        elif match := _NUMBER.match(text, at):
            found.append(Token("number", _checked(match[0], at + 1), at + 1))
            at = match.end()
        elif c.isidentifier():
            end = at + 1
            while end < len(text) and text[end] not in _SIGNS and ("a" + text[end]).isidentifier():
                end += 1
            found.append(Token("name", ascii_name(text[at:end]), at + 1))
            at = end
        else:
            raise ValueError(
                f"character {at + 1}: {quoted(c)} has no meaning here; write numbers, names and "
                "+ - * / ^ ( )"
            )
    return [*found, Token("end", "", len(text) + 1)]


def _checked(number: str, place: int) -> str:
    if len(number) > MOST_DIGITS:
        raise ValueError(f"character {place}: the number has more than {MOST_DIGITS} digits")
    _, _, exponent = number.lower().partition("e")
    if exponent and (len(exponent) > 8 or abs(int(exponent)) > LARGEST_EXPONENT):
        raise ValueError(
            f"character {place}: the number has an exponent beyond ±{LARGEST_EXPONENT}; "
            "choose a unit in which it is of usual size"
        )
    return number
