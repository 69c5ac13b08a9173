"""Figures on a page: drawn for a desktop and anew for a phone, with what each is said to show."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from vsctrl.report import plots
from vsctrl.report.section import Picture
from vsctrl.tables import escaped


def figure(
    drawing: Any, prefix: str, name: str, of: str = "", alt: str = "", caption: str = ""
) -> Picture:
    """A figure of `plots` with its alternative text and caption, its own where none are given.

    `prefix` and `name` make its ids unique on the page; `of`: what it is a figure of.
    """
    alt = alt or getattr(drawing, "alt", "")
    caption = caption or getattr(drawing, "caption", "")
    title = escaped(f"{of}: {alt}" if of else alt)
    wide, narrow = plots.to_svgs(drawing, title, f"{prefix}-{name}")
    return Picture(Markup(wide), caption, Markup(narrow))
