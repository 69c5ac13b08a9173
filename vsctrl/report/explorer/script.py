"""The explorer's script and style: plain files, one idea each, put one after the other."""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from markupsafe import Markup

ENGINE = ("expressions", "linear", "quasi", "count", "margins", "chebyshev", "response")
ENGINE += ("sampled", "loop")
VIEW = ("svg", "figures", "chart", "controls", "challenges", "explorer")


@dataclass(frozen=True)
class Script:
    """What a page with an explorer holds: the script, its style, and the script's hash."""

    source: Markup
    style: Markup
    hash: str  #: as a content-security-policy names it, sha256-…

    @classmethod
    @cache
    def whole(cls) -> Script:
        """All of it, each part after those that it needs."""
        names = [*(f"engine/{name}.js" for name in ENGINE), *(f"view/{name}.js" for name in VIEW)]
        source = '"use strict";\n(() => {\n' + "\n".join(map(_text, names)) + "\n})();\n"
        digest = base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()
        return cls(Markup(source), Markup(_text("explorer.css")), f"sha256-{digest}")


def _text(name: str) -> str:
    return files("vsctrl.report.explorer").joinpath(name).read_text(encoding="utf-8")
