"""A figure by itself or in somebody's axes: its size, its title, its legend, what it says."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vsctrl.checks import is_finite, quoted
from vsctrl.errors import InputError
from vsctrl.report.plots.style import STYLE, Picture, drawing
from vsctrl.tables import visible

Size = tuple[float, float] | None  #: width and height in inches

NOTEBOOK = (7.2, 4.6)  #: inches, of a figure that is as wide as a notebook's cell
LETTERS = 11.5  #: of a title to an inch
SMALLEST, LARGEST = 2.0, 60.0  #: inches


@contextmanager
def picture_of(size: Size, usual: tuple[float, float]) -> Iterator[Picture]:
    """A picture of a size in inches, or of the usual one, and the style to draw it in.

    Errors: `InputError` for what is no size.
    """
    width, height = usual if size is None else _checked(size)
    with drawing(width, height) as figure:
        yield figure


def _checked(size: Any) -> tuple[float, float]:
    try:
        width, height = size
    except (TypeError, ValueError):
        width = height = None
    if not all(is_finite(side) and SMALLEST <= side <= LARGEST for side in (width, height)):
        raise InputError(
            f"size = {quoted(size)} is not usable; give (width, height) in inches, "
            f"each from {SMALLEST:g} to {LARGEST:g}."
        )
    return float(width), float(height)


@contextmanager
def canvas(
    ax: Any, size: Size, usual: tuple[float, float], rows: int = 1, columns: int = 1, **how: Any
) -> Iterator[tuple[Figure, list[Axes]]]:
    """The figure and its axes, row by row: somebody's own, or those of a new `Picture`.

    Errors: `InputError` for axes that are none, too few or too many.
    """
    number = rows * columns
    if ax is None:
        with picture_of(size, usual) as figure:
            yield figure, list(figure.subplots(rows, columns, squeeze=False, **how).ravel())
        return
    given = [ax] if isinstance(ax, Axes) else list(ax) if isinstance(ax, Sequence) else None
    given = list(ax.ravel()) if given is None and hasattr(ax, "ravel") else given
    if given is None or len(given) != number or not all(isinstance(each, Axes) for each in given):
        wanted = "Matplotlib axes" if number == 1 else f"{number} Matplotlib axes, row by row"
        raise InputError(f"ax = {quoted(ax)} is not usable; give {wanted}.")
    owner = given[0].get_figure(root=True)
    if owner is None:
        raise InputError("ax: these axes were removed from their figure; give axes of a figure.")
    with mpl.rc_context(STYLE):
        yield owner, given


def say(figure: Figure, axes: Axes, title: str, caption: str, alt: str, room: float = 1.0) -> None:
    """Title above the axes; caption and alt where the figure is a `Picture` of our own.

    room: the share of the figure's width that is right of the labels of its y axis.
    """
    if title:
        wide = figure.get_figwidth() * axes.get_position(original=True).width / 0.775
        axes.set_title(textwrap.fill(title, max(int(LETTERS * wide * room), 20)))
    if isinstance(figure, Picture):
        figure.caption, figure.alt = caption, alt


def plain(text: object, longest: int = 60) -> str:
    """Somebody's text in a figure: no formula, no sign without a shape, at most a line."""
    line = " ".join(visible(str(text)).split())
    line = line if len(line) <= longest else f"{line[: longest - 1]}…"
    return line.replace("$", r"\$")


def named(what: str, given: Sequence[str], names: Any) -> list[str]:
    """What the curves are called: `names`, or what they are `given`, numbered where they are equal.

    Errors: `InputError` for names that are not one text for each.
    """
    if names is None:
        return [
            f"{name} ({i + 1})" if list(given).count(name) > 1 else name
            for i, name in enumerate(given)
        ]
    if not isinstance(names, Sequence) or isinstance(names, str) or len(names) != len(given):
        raise InputError(
            f"{what}: names = {quoted(names)} is not usable; give a list of "
            f"{len(given)} names, one for each of what is drawn."
        )
    return [plain(name) for name in names]


def legend(figure: Figure, axes: Axes, least: int = 2) -> None:
    """A legend of the axes' labels, where there are `least` or more, that covers no curve."""
    entries = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    if len(entries) < least:
        return
    if not isinstance(figure, Picture):
        axes.legend(entries.values(), entries.keys())
        return
    # As many columns as the widest entry leaves room for.
    room = LETTERS * figure.get_figwidth() / (max(map(len, entries)) + 6)
    columns = max(1, min(len(entries), int(room)))
    figure.legend(entries.values(), entries.keys(), loc="outside lower left", ncols=columns)
