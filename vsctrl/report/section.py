"""What a page is made of: entries, one a result, with sections of text, tables and figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from markupsafe import Markup

Colour = Literal["good", "warning", "bad"]


@dataclass(frozen=True)
class Verdict:
    """The first lines about a result; `kind` colours them and is None where nothing is judged.

    `advice`: those of the sentences that say what to change; `word`: what tables call it.
    """

    kind: Colour | None
    sentences: tuple[str, ...]
    advice: tuple[str, ...] = ()
    word: str = ""

    @property
    def findings(self) -> tuple[str, ...]:
        """The sentences that are no advice."""
        return tuple(each for each in self.sentences if each not in self.advice)


@dataclass(frozen=True)
class Tile:
    """One question answered by a number: what is asked, the value with its unit, what it means.

    `anchor`: of the section that proves it; `kind` colours the value.
    """

    question: str
    value: str
    meaning: str
    anchor: str
    kind: Colour | None = None


@dataclass(frozen=True)
class Table:
    """Rows of text below heads, the first `left` columns aligned to the left.

    A cell may be Markup, a formula or a coloured word.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    left: int = 1
    remarks: Sequence[str] = ()


@dataclass(frozen=True)
class Picture:
    """A figure as an SVG element, with a caption that says what to notice.

    `narrow`: the same drawn for a phone; None where the one serves both.
    """

    svg: Markup
    caption: str = ""
    narrow: Markup | None = None


@dataclass(frozen=True)
class Verbatim:
    """Text to be read as it is, under a summary that opens it."""

    summary: str
    text: str


@dataclass(frozen=True)
class Scripted:
    """An element that the page's script brings to life, and what stands there without script."""

    html: Markup


#: A paragraph is plain text; Markup is an element of the page that some module has made.
Part = str | Markup | Table | Picture | Verbatim | Scripted


@dataclass(frozen=True)
class Section:
    """A heading and what follows it; `anchor` is unique within an entry.

    `appendix`: closed on a screen until it is asked for, and open on paper.
    """

    anchor: str
    title: str
    parts: Sequence[Part]
    appendix: bool = False


@dataclass(frozen=True)
class Entry:
    """One result on a page: what it is, what is said first, and its sections.

    `kind`: in a word, as "scenario" or "loop"; `data`: its numbers as JSON takes them; `source`:
    what was examined, from which figures of several are drawn; `note`: for the page's footer;
    `paper`: sections for the page about the paper.
    """

    kind: str
    name: str
    about: str
    verdict: Verdict
    sections: Sequence[Section]
    data: dict[str, Any]
    source: Any = field(default=None, repr=False)
    note: str = ""
    tiles: Sequence[Tile] = ()
    paper: Sequence[Section] = ()
