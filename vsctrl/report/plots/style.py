"""What all figures share: colours, type, and the way into a page.

Lines that belong to a page's text (axes, labels) are drawn in `INK`, which the page turns into its
own text colour, so that a figure reads in light and dark.
"""

from __future__ import annotations

import base64
import io
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
# At a contrast of 4.5:1 or more on white, so that words may have the colour of their line.
EXACT = "#2f6fb7"
WITH, WITHOUT = "#147a5b", "#b84f00"
PADE = {1: "#77690c", 2: "#b0458b", 4: "#7a5fc0"}
GREY = "#6b717b"
#: Their names, by which a page sets each anew on a dark background.
PALETTE = {
    "exact": EXACT,
    "with": WITH,
    "without": WITHOUT,
    "pade-1": PADE[1],
    "pade-2": PADE[2],
    "pade-4": PADE[4],
    "grey": GREY,
}
#: Systems side by side; used anew when there are more.
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
    "grid.alpha": 0.22,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.6,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "svg.fonttype": "none",
    "svg.hashsalt": "vsctrl",
}

DPI = 160  #: of the picture that a notebook shows


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
