"""A report as one self-contained page: no link to another host, no script but its own.

The script is there where a part of the page needs it, and the page's policy names it by its hash.
It is rendered from entries by a template beside this module; all text is escaped, and figures and
formulas are elements of the page itself.
"""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import version

from vsctrl.report.explorer.script import Script
from vsctrl.report.rendering import render
from vsctrl.report.section import Entry, Scripted, Section

GENERATOR = "vsctrl"  #: in the page's <meta name="generator">, by which a report knows its own
_PACKAGES = ("numpy", "scipy", "sympy", "control", "matplotlib")


def page(title: str, entries: Sequence[Entry], together: Sequence[Section], command: str) -> str:
    """The text of ``index.html``; `together`: sections about all entries; `command`: its origin."""
    parts = [part for entry in entries for section in entry.sections for part in section.parts]
    return render(
        "page.html",
        generator=f"{GENERATOR} {version('vsctrl')}",
        title=title,
        entries=entries,
        together=together,
        script=Script.whole() if any(isinstance(part, Scripted) for part in parts) else None,
        command=command,
        versions=[("Python", platform.python_version())] + [(p, version(p)) for p in _PACKAGES],
    )
