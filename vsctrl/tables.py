"""How results show themselves: as text at a prompt, as HTML in a notebook, as numbers in JSON.

A table is rows of cells that are text already; how a number is written is each result's own affair.
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from html import escape
from typing import Any, Protocol

Row = Sequence[str]

# Control characters, halves of pairs and what is no character: XML knows none of them, or none
# that a reader could see, and a terminal obeys some.
_UNSEEN = re.compile("[^\t\n\r -~\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_LEFT, _TOP = " style='text-align:left'", " style='vertical-align:top'"


ROUNDING = 1e-12  #: of the largest root, below which a part of one is shown as 0


class Printed:
    """A result whose `repr` is its text, which is what somebody at a prompt wants to see."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


class Numbers:
    """A result whose fields are its numbers."""

    __slots__ = ()

    def data(self) -> dict[str, Any]:
        """Its fields as JSON takes them, null for infinity; the units are those of the fields."""
        return {each.name: plain(getattr(self, each.name)) for each in fields(self)}  # type: ignore[arg-type]


class Lines(ABC):
    """What shows itself as lines of a name and a text, with sentences below; its `repr` stays."""

    __slots__ = ()

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        # IPython takes the first class that has either, and a dataclass has a `repr` of its own.
        cls._repr_pretty_ = Lines._repr_pretty_  # type: ignore[method-assign]

    @abstractmethod
    def _lines(self) -> Mapping[str, str]:
        """Name → text, in their order."""

    def _sentences(self) -> Iterable[str]:
        return ()

    def __str__(self) -> str:
        rows = list(self._lines().items())
        return "\n".join([text(rows, fitting(rows, "<<")), *self._sentences()])

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        printer.text(str(self))

    def _repr_html_(self) -> str:
        return html(self._lines().items(), labels=True, remarks=self._sentences())


def limit(value: float, unit: str = "", form: str = ".4g") -> str:
    """A number with its unit, "no limit" for infinity."""
    if math.isinf(value):
        return "no limit" if value > 0 else "no limit below"
    return f"{value:{form}}{f' {unit}' if unit else ''}"


def angle(radians: float) -> str:
    """An angle in degrees and rad, "no limit" for infinity."""
    if math.isinf(radians):
        return "no limit"
    return f"{math.degrees(radians):.4g}° ({radians:.4g} rad)"


def listed(entries: Sequence[str], most: int = 6) -> str:
    """Entries on one line, at most so many of them, and then how many there are in all."""
    if not entries:
        return "none"
    more = f", … ({len(entries)} in all)" if len(entries) > most else ""
    return ", ".join(entries[:most]) + more


def roots_listed(roots: Iterable[complex], unit: str = "rad/s") -> str:
    """Roots on one line, each pair once, parts that are but rounding as 0."""
    every = list(roots)
    least = ROUNDING * max((abs(root) for root in every), default=0.0)
    least = least if least > ROUNDING**2 else 1.0  # of nothing but roots at 0
    shown = []
    for root in every:
        real, imag = (0.0 if abs(part) <= least else part for part in (root.real, root.imag))
        if imag >= 0:
            shown.append(f"{real:.4g} ± {imag:.4g}j" if imag else f"{real:.4g}")
    return f"{listed(shown)}{f' {unit}' if shown and unit else ''}"


class Shown(Protocol):
    """What shows itself in a notebook."""

    def _repr_html_(self) -> str: ...


class Tables(Printed, ABC):
    """A result that shows itself as several tables (`_tables`) with paragraphs below (`_words`)."""

    __slots__ = ()

    @abstractmethod
    def _tables(self) -> Iterable[Shown]: ...

    @abstractmethod
    def _words(self) -> Iterable[str]: ...

    def __str__(self) -> str:
        return "\n\n".join([*map(str, self._tables()), *self._words()])

    def _repr_html_(self) -> str:
        parts = [table._repr_html_() for table in self._tables()]
        return "".join([*parts, paragraphs(self._words())])


def visible(text: str) -> str:
    """The text with a sign in the place of each character that no page or picture can hold."""
    return _UNSEEN.sub("\ufffd", text)


def escaped(text: str) -> str:
    """Text as character data of HTML and SVG."""
    return escape(visible(text))


def text(rows: Iterable[Row], form: str) -> str:
    """Rows as lines, whose cells `form` places, as "{:24}{:>9}  {}"; the last may be left out."""
    return "\n".join(form.format(*row, *[""] * form.count("{")).rstrip() for row in rows)


def fitting(rows: Sequence[Row], sides: str) -> str:
    """The form whose columns are as wide as their widest cell; `sides`: < or > of each column."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(sides))]
    return "  ".join(f"{{:{side}{width}}}" for side, width in zip(sides, widths, strict=True))


def html(
    rows: Iterable[Row],
    *,
    heads: Row = (),
    caption: str = "",
    remarks: Iterable[str] = (),
    labels: bool = False,
    left: int = 0,
    top: bool = False,
) -> str:
    """Rows as an HTML table, whose cells are escaped, with a line break for each newline in them.

    `heads`: of the columns; `remarks`: paragraphs below the table; `labels`: whether the first
    cell of a row names it; `left`: the number of columns, from the first on, that are aligned to
    the left; `top`: whether cells are aligned to the top.
    """

    def cells(row: Row, first: str, tag: str, left: int) -> str:
        tags = [first] + [tag] * (len(row) - 1)
        return "".join(
            f"<{tag}{_LEFT * (column < left)}>{escaped(cell).replace(chr(10), '<br>')}</{tag}>"
            for column, (tag, cell) in enumerate(zip(tags, row, strict=True))
        )

    title = f"<caption>{escaped(caption)}</caption>" if caption else ""
    head = f"<tr>{cells(heads, 'th', 'th', 0)}</tr>" if heads else ""
    name = "th" if labels else "td"
    body = "".join(f"<tr{_TOP * top}>{cells(row, name, 'td', left)}</tr>" for row in rows)
    return f"<table>{title}{head}{body}</table>{paragraphs(remarks)}"


def paragraphs(texts: Iterable[str]) -> str:
    """Texts as HTML paragraphs, escaped."""
    return "".join(f"<p>{escaped(each)}</p>" for each in texts)


def finite(value: float | None) -> float | None:
    """A number as JSON takes it: None where there is none, or an infinite one."""
    return float(value) if value is not None and math.isfinite(value) else None


def plain(value: Any) -> Any:
    """A value as JSON takes it: text and truth as they are, tuples as lists, numbers as `finite`.

    A complex number is its real and imaginary part, an array a list, a result the numbers of its
    fields, a formula its text.
    """
    if is_dataclass(value):
        return {each.name: plain(getattr(value, each.name)) for each in fields(value)}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, tuple | list):
        return [plain(entry) for entry in value]
    if hasattr(value, "free_symbols"):
        return str(value)
    if isinstance(value, complex):
        return [finite(value.real), finite(value.imag)]
    return value if value is None or isinstance(value, str | bool) else finite(value)
