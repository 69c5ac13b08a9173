"""The explorer's script and style: plain files, one idea each, put one after the other."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

ENGINE = [
    *("expressions", "linear", "quasi", "count", "margins", "chebyshev", "response"),
    *("sampled", "loop"),
]
VIEW = ("svg", "figures", "chart", "controls", "challenges", "explorer")


@cache
def explorer_script() -> str:
    """All of the script, each part after those that it needs."""
    names = [*(f"engine/{name}.js" for name in ENGINE), *(f"view/{name}.js" for name in VIEW)]
    return '"use strict";\n(() => {\n' + "\n".join(map(_text, names)) + "\n})();\n"


@cache
def explorer_style() -> str:
    """The explorer's own part of a page's style."""
    return _text("explorer.css")


def _text(name: str) -> str:
    return files("vsctrl.report.explorer").joinpath(name).read_text(encoding="utf-8")
