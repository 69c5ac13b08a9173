"""A report as one self-contained page: no script, no link to another host.

It is rendered from entries by a template beside this module; all text is escaped, and figures and
formulas are elements of the page itself.
"""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import version

from vsctrl.report.rendering import render
from vsctrl.report.section import Entry, Section

GENERATOR = "vsctrl"  #: in the page's <meta name="generator">, by which a report knows its own
_PACKAGES = ("numpy", "scipy", "sympy", "control", "matplotlib")


def page(title: str, entries: Sequence[Entry], together: Sequence[Section], command: str) -> str:
    """The text of ``index.html``; `together`: sections about all entries; `command`: its origin."""
    return render(
        "page.html",
        generator=f"{GENERATOR} {version('vsctrl')}",
        title=title,
        entries=entries,
        together=together,
        command=command,
        versions=[("Python", platform.python_version())] + [(p, version(p)) for p in _PACKAGES],
    )
