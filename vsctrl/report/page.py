"""A report as self-contained pages: no link to another host, complete without its script.

They are rendered from entries by templates beside this module; all text is escaped, figures and
formulas are elements of the page itself, and nothing may run or style but what is hashed here.
"""

from __future__ import annotations

import base64
import hashlib
import platform
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from typing import Any

from markupsafe import Markup

from vsctrl.report.explorer.script import explorer_script, explorer_style
from vsctrl.report.rendering import render
from vsctrl.report.section import Entry, Scripted, Section

GENERATOR = "vsctrl"  #: in the page's <meta name="generator">, by which a report knows its own
_PACKAGES = ("numpy", "scipy", "sympy", "control", "matplotlib")
_POLICY = "POLICY"  #: stands for the policy until the page that it is of is there
_INLINE = re.compile(r"<(style|script)>(.*?)</\1>", re.DOTALL)


def page(
    title: str, entries: Sequence[Entry], together: Sequence[Section], command: str, paper: str
) -> str:
    """The text of ``index.html``.

    `together`: sections about all entries; `command`: its origin; `paper`: the file of the page
    about the paper, empty where there is none.
    """
    parts = [part for entry in entries for section in entry.sections for part in section.parts]
    return _guarded(
        "page.html",
        title=title,
        entries=entries,
        together=together,
        explored=any(isinstance(part, Scripted) for part in parts),
        command=command,
        paper=paper,
        versions=[("Python", platform.python_version())] + [(p, version(p)) for p in _PACKAGES],
    )


def paper_page(title: str, entries: Sequence[Entry], command: str, back: str) -> str:
    """The text of the page about the paper, empty where none of the entries is from it.

    What several entries have in common is there once; `back`: the report's own page.
    """
    sections: dict[str, Section] = {}
    for number, entry in enumerate(entries, 1):
        for part in entry.paper:
            anchor = f"e{number}-{part.anchor}"
            sections.setdefault(str(part.parts), replace(part, anchor=anchor))
    if not sections:
        return ""
    parts = list(sections.values())
    return _guarded("paper.html", title=title, sections=parts, command=command, back=back)


def _guarded(template: str, explored: bool = False, **values: Any) -> str:
    """A page that allows the styles and scripts that are in it, each by its hash.

    explored: whether it holds an explorer, which has a script and a style of its own.
    """
    styles, scripts = [_own("templates/page.css")], [_own("scripts/page.js")]
    if explored:
        styles.append(explorer_style())
        scripts.append(explorer_script())
    text = render(
        template,
        generator=f"{GENERATOR} {version('vsctrl')}",
        policy=_POLICY,
        style=Markup("".join(styles)),
        script=Markup("".join(scripts)),
        **values,
    )
    text = text.lstrip()
    return text.replace(f'content="{_POLICY}"', f'content="{_policy(text)}"', 1)


def _policy(text: str) -> str:
    hashes: dict[str, dict[str, None]] = {"style": {}, "script": {}}
    for kind, content in _INLINE.findall(text):
        digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        hashes[kind][f"'sha256-{digest}'"] = None
    styles, scripts = (" ".join(hashes[kind]) for kind in ("style", "script"))
    return (
        f"default-src 'none'; style-src {styles}; script-src {scripts}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


@cache
def _own(name: str) -> str:
    return (files("vsctrl.report") / name).read_text(encoding="utf-8")
