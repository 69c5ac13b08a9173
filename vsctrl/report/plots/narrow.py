"""A figure laid out anew for a phone: axes below each other, words in more lines."""

from __future__ import annotations

import textwrap
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from vsctrl.report.plots.style import STYLE

NARROW = 3.72  #: inches, the width of a figure that fits a phone of 390 px
INSIDE = 2.9  #: of them, those right of the labels of the y axis
LEAST, TALLEST = 1.0, 3.3  #: inches of axes
MAGNIFIED = 1.5  #: times its size that a picture in equal axes may get
WORDS, LINE = 0.6, 0.19  #: inches for the words about axes, and for a line of text
LETTERS = 11.5  #: of a title to an inch
LONGEST = 40  #: letters of a line that is as wide as the figure
KEY = 6  #: letters that the key of a legend's entry is wide
EDGE = 4.0  #: pixels that a label keeps from the right edge


def narrow(figure: Figure) -> None:
    """Make the figure as wide as a phone and as high as it then needs to be."""
    with mpl.rc_context(STYLE):
        figure.draw_without_rendering()
        lines = _words(figure)
        for legend in list(figure.legends):
            lines += _legend_below(figure, legend)
        for axes in figure.axes:
            lines += _words_about(axes)
        _stack(figure, LINE * lines)
        figure.draw_without_rendering()
        for axes in figure.axes:
            for words in axes.texts:
                _keep_inside(figure, axes, words)


# Words -------------------------------------------------------------------------------------------
def _words(figure: Figure) -> int:
    """Titles of the whole figure in more lines; how many more."""
    before = after = 0
    for get, put in (
        (figure.get_suptitle, figure.suptitle),
        (figure.get_supxlabel, figure.supxlabel),
    ):
        if text := get():
            wrapped = "\n".join(textwrap.fill(line, LONGEST + 6) for line in text.split("\n"))
            wrapped = wrapped if put == figure.suptitle else textwrap.fill(_line(text), LONGEST + 6)
            put(wrapped, x=0.01, ha="left", fontsize=9.5)
            before, after = before + text.count("\n"), after + wrapped.count("\n")
    return after - before


def _words_about(axes: Any) -> int:
    """Title, label and legend of axes in lines that fit, the legend above them; lines more."""
    lines = _legend_above(axes)
    for place in ("left", "center", "right"):
        if title := axes.get_title(place):
            wrapped = textwrap.fill(_line(title), int(LETTERS * INSIDE))
            axes.set_title(wrapped, loc=place, pad=6 + 72 * LINE * lines)
            lines += wrapped.count("\n") - title.count("\n")
    axes.set_xlabel(textwrap.fill(_line(axes.get_xlabel()), LONGEST))
    return lines


def _legend_above(axes: Any) -> int:
    """The legend of axes between them and their title, where it covers no curve; its lines."""
    legend = axes.get_legend()
    if legend is None:
        return 0
    handles, words, columns = _entries(legend, INSIDE)
    legend.remove()
    place: Any = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.1}
    axes.legend(handles, words, ncols=columns, columnspacing=1.0, **place)
    return -(-len(words) // columns)


def _legend_below(figure: Figure, legend: Any) -> int:
    """The same legend of a figure with as many columns as there is room for; its lines."""
    handles, words, columns = _entries(legend, NARROW)
    legend.remove()
    figure.legend(handles, words, loc="outside lower left", ncols=columns)
    return -(-len(words) // columns)


def _entries(legend: Any, width: float) -> tuple[list[Any], list[str], int]:
    handles = list(legend.legend_handles)
    words = [textwrap.fill(_line(text.get_text()), LONGEST) for text in legend.get_texts()]
    longest = max((len(line) for each in words for line in each.splitlines()), default=1)
    return handles, words, max(1, min(len(words), int(LETTERS * width / (longest + KEY))))


def _keep_inside(figure: Figure, axes: Any, words: Any) -> None:
    """Shift the words of a label that would leave the axes, or the figure, to a side."""
    box = words.get_window_extent()
    left, right = axes.get_window_extent().x0, figure.bbox.x1 - EDGE
    shift = max(left - box.x0, 0.0) - max(box.x1 - right, 0.0)
    if shift and hasattr(words, "xyann") and box.width < right - left:
        x, y = words.xyann
        words.xyann = (x + shift * 72 / figure.dpi, y)


def _line(text: str) -> str:
    return " ".join(text.split())


# Axes --------------------------------------------------------------------------------------------
def _stack(figure: Figure, more: float) -> None:
    """Axes below each other, each as high as it was, and the figure as high as they need.

    more: inches for words that take more lines than before.
    """
    placed = [axes for axes in figure.axes if axes.get_subplotspec() is not None]
    columns = {round(axes.get_position(original=True).x0, 2) for axes in placed}
    if len(columns) < 2:
        square = any(axes.get_aspect() != "auto" for axes in placed)
        tallest = NARROW if square else TALLEST * len(placed)
        figure.set_size_inches(NARROW, min(figure.get_figheight(), tallest) + more)
        return
    # Column by column, since those of a column share their x axis.
    order = sorted(placed, key=_column_first)
    heights = [_height(figure, axes) for axes in order]
    below = GridSpec(len(order), 1, figure=figure, height_ratios=heights)
    for i, axes in enumerate(order):
        axes.set_subplotspec(below[i])
        axes.set_anchor("C")
    figure.set_size_inches(NARROW, sum(heights) + WORDS * len(order) + more)


def _height(figure: Figure, axes: Any) -> float:
    """Inches of what is inside the axes."""
    box = axes.get_position()
    high = float(box.height * figure.get_figheight())
    if axes.get_aspect() != "auto":
        high *= min(INSIDE / float(box.width * figure.get_figwidth()), MAGNIFIED)
    return min(max(high, LEAST), TALLEST)


def _column_first(axes: Any) -> tuple[float, float]:
    box = axes.get_position(original=True)
    return round(box.x0, 2), -box.y0
