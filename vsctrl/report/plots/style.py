"""What all figures share: colours, type, and the way into a page.

Lines that belong to a page's text (axes, labels) are drawn in `INK`, which the page turns into its
own text colour, so that a figure reads in light and dark.
"""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from inspect import signature
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vsctrl.arrays import Array
from vsctrl.checks import require_kind
from vsctrl.tables import escaped

P = ParamSpec("P")
T = TypeVar("T")

INK = "#010203"
PAPER = "#fefdfc"  #: behind words; the page turns it into its own background
EXACT = "#2f6fb7"
WITH, WITHOUT = "#1b9e77", "#d95f02"
PADE = {1: "#b47b12", 2: "#c0569b", 4: "#7a5fc0"}
GREY = "#8a8f98"
#: Systems side by side, each at a contrast of 3:1 or more on white; used anew when there are more.
SERIES = (EXACT, WITHOUT, WITH, PADE[4], PADE[2], PADE[1])

STYLE: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.grid": True,
    "grid.color": GREY,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.6,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "svg.fonttype": "path",
    "svg.hashsalt": "vsctrl",
}

DPI = 160  #: of the picture that a notebook shows

_ID = re.compile(r'\sid="([^"]*)"')
_REFERENCE = re.compile(r'(href="#|url\(#)([^")]*)')
_FRACTION = re.compile(r"-?\d+\.\d{3,}")


class Picture(Figure):
    """A Matplotlib figure that pyplot knows nothing of, shown by a notebook once, by itself.

    `caption` says what to notice, `alt` what is drawn, for those who cannot see it: plain text.
    """

    caption: str = ""
    alt: str = ""

    def _repr_html_(self) -> str:
        out = io.BytesIO()
        with mpl.rc_context(STYLE):
            self.savefig(out, format="png", dpi=DPI, metadata={"Software": None})
        data = base64.b64encode(out.getvalue()).decode()
        width = round(96 * self.get_figwidth())
        image = (
            f'<img src="data:image/png;base64,{data}" alt="{escaped(self.alt)}" '
            f'style="width:{width}px;max-width:100%">'
        )
        words = f"<figcaption>{escaped(self.caption)}</figcaption>" if self.caption else ""
        return f'<figure style="margin:0">{image}{words}</figure>'


def to_svg(figure: Figure, title: str, prefix: str) -> str:
    """The figure as an SVG element to put into a page: text in the page's colour, no links.

    `title` is what a screen reader says; `prefix` keeps the ids of figures on one page apart.

    >>> figure = vs.plot(vs.figure1)
    >>> vs.plots.to_svg(figure, "Figure 1", "one")[:4]
    '<svg'
    """
    buffer = io.StringIO()
    with mpl.rc_context(STYLE):
        figure.savefig(
            buffer,
            format="svg",
            transparent=True,
            metadata={"Date": None, "Creator": None, "Format": None, "Type": None},
        )
    svg = buffer.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\s(?:xmlns(?::\w+)?|version)="[^"]*"', "", svg)
    svg = svg.replace(INK, "currentColor").replace("xlink:href", "href")
    svg = svg.replace(PAPER, "var(--paper, #fff)")
    used = dict.fromkeys(found[2] for found in _REFERENCE.finditer(svg))
    name = {old: f"{prefix}-{number}" for number, old in enumerate(used)}
    svg = _ID.sub(lambda found: f' id="{name[found[1]]}"' if found[1] in name else "", svg)
    svg = _REFERENCE.sub(lambda found: found[1] + name[found[2]], svg)
    svg = re.sub(r"<!--.*?-->|^ +", "", svg, flags=re.DOTALL | re.MULTILINE)
    svg = _FRACTION.sub(_short, svg)
    return svg.replace("<svg", f'<svg role="img" aria-label="{title}"', 1)


def _short(number: re.Match[str]) -> str:
    """A position to a hundredth of a point, finer than any screen, and a factor to six places."""
    value = float(number[0])
    return f"{value:.{2 if abs(value) >= 1 else 6}f}".rstrip("0").rstrip(".")


@contextmanager
def drawing(width: float, height: float) -> Iterator[Picture]:
    """A figure of a size in inches, and the style to draw it in."""
    with mpl.rc_context(STYLE):
        yield Picture(figsize=(width, height), layout="constrained")


def label(axes: Axes, words: str, point: Any, shift: tuple[float, float], **style: Any) -> None:
    """Words beside a point (x, y in data), `shift` points right of and above it.

    What is drawn below them stays faintly visible.
    """
    behind = {"boxstyle": "round,pad=0.1", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.75}
    style.setdefault("bbox", behind)
    axes.annotate(words, point, shift, textcoords="offset points", **style)


def phase(values: Any) -> Array:
    """Phase in degrees, unwound along the frequency axis."""
    return np.asarray(np.degrees(np.unwrap(np.angle(values))), float)


def takes(*kinds: type) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """A figure of values of these types, in the order of its arguments: others are refused."""

    def wrap(draw: Callable[P, T]) -> Callable[P, T]:
        names = signature(draw)

        @wraps(draw)
        def checked(*args: P.args, **kwargs: P.kwargs) -> T:
            given = names.bind(*args, **kwargs).arguments
            for (name, value), kind in zip(given.items(), kinds, strict=False):
                require_kind(name, value, kind, f"{draw.__name__} draws a {kind.__name__}")
            return draw(*args, **kwargs)

        return checked

    return wrap
