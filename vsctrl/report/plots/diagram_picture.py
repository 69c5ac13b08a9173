"""A block diagram as a Matplotlib figure: the picture that `Diagram` draws as SVG."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle

from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.picture.draw import MATH, NAME, SIGNAL, draft
from vsctrl.diagram.picture.layout import RADIUS, Path
from vsctrl.diagram.picture.typeset import Line, symbol, width, words
from vsctrl.report.plots.canvas import Size, canvas, plain, say
from vsctrl.report.plots.style import INK
from vsctrl.tables import visible

PIXEL = 1 / 96  #: inches
FONTS = {"math": ["STIXGeneral"], "name": ["DejaVu Sans"]}
BAR = 0.5  #: em from a fraction's bar to the ink beside it


def block_diagram(diagram: Any, *, ax: Any = None, size: Size = None) -> Figure:
    """The blocks, sums and wires of a diagram.

    ``block_diagram(vs.figure1)``. ax: axes of yours. size: (width, height), inches. Returns the
    figure, with `caption` and `alt`.

    >>> figure = vs.plots.block_diagram(vs.figure1)
    >>> figure.alt
    'Block diagram from S_ref to S.'
    """
    grid, picture, formulas = draft(diagram)
    usual = (max(picture.width * PIXEL, 2.0), max(picture.height * PIXEL, 1.0))
    with canvas(ax, size, usual) as (figure, (axes,)):
        axes.set(xlim=(0, picture.width), ylim=(picture.height, 0), aspect="equal")
        axes.axis("off")
        wide, high = size or (figure.get_figwidth(), figure.get_figheight())
        # Points of type to a pixel of the picture.
        scale = 72 * min(float(wide) / picture.width, float(high) / picture.height)
        for path in picture.paths:
            _wire(axes, path)
        for x, y in picture.dots:
            axes.add_patch(Circle((x, y), 2.6, color=INK))
        for box in picture.boxes:
            part = grid.graph.nodes[box.node].part
            if isinstance(part, Block):
                corner = (box.x - box.width / 2, box.y - box.height / 2)
                axes.add_patch(Rectangle(corner, box.width, box.height, fill=False, edgecolor=INK))
                _line(axes, words(part.name), box.x, corner[1] - 5, NAME, scale, "name")
                _formula(axes, formulas[box.node], box.x, box.y, scale)
            elif box.width:
                axes.add_patch(Circle((box.x, box.y), RADIUS, fill=False, edgecolor=INK))
        for x, y, sign in picture.signs:
            axes.plot([x - 3.5, x + 3.5], [y, y], color=INK, linewidth=1.2)
            if sign > 0:
                axes.plot([x, x], [y - 3.5, y + 3.5], color=INK, linewidth=1.2)
        for each in picture.labels:
            line = symbol(each.signal)
            wide_px = line.width * SIGNAL
            shift = {"start": wide_px / 2, "end": -wide_px / 2}.get(each.anchor, 0.0)
            _line(axes, line, each.x + shift, each.y, SIGNAL, scale)
        about = _about(diagram)
        say(figure, axes, "", about, about)
    return figure


def _about(diagram: Wiring) -> str:
    inputs = ", ".join(map(plain, diagram.inputs)) or "no input"
    outputs = ", ".join(map(plain, diagram.outputs)) or "no output"
    return f"Block diagram from {inputs} to {outputs}."


def _wire(axes: Axes, path: Path) -> None:
    """A wire and the head of its arrow."""
    *_, (a, b), (x, y) = path.points
    dx, dy = (x > a) - (x < a), (y > b) - (y < b)
    line = [*path.points[:-1], (x - 6 * dx, y - 6 * dy)]
    axes.plot(*zip(*line, strict=True), color=INK, linewidth=1.1, solid_joinstyle="miter")
    sides = [(x - 9 * dx + 3.6 * k * dy, y - 9 * dy + 3.6 * k * dx) for k in (-1, 1)]
    axes.add_patch(Polygon([(x, y), *sides], color=INK, linewidth=0))


def _formula(axes: Axes, formula: Any, x: float, y: float, scale: float) -> None:
    """A formula centred on a point: lines, and fractions with a bar."""
    x -= width(formula) * MATH / 2
    for piece in formula:
        wide = piece.width * MATH
        if isinstance(piece, Line):
            _line(axes, piece, x + wide / 2, y + 0.3 * MATH, MATH, scale)
        else:
            _line(axes, piece.num, x + wide / 2, y - BAR * MATH + 1.5, MATH, scale)
            axes.plot([x + 1, x + wide - 1], [y, y], color=INK, linewidth=0.8)
            _line(axes, piece.den, x + wide / 2, y + 1.08 * MATH, MATH, scale)
        x += wide


def _line(
    axes: Axes, line: Line, x: float, y: float, em: float, scale: float, kind: str = "math"
) -> None:
    """Runs of text on a baseline, centred on x; em in pixels of the picture."""
    x -= line.width * em / 2
    for run in line.runs:
        inside = run.width - run.skip
        middle = x + (run.skip + inside / 2) * em
        if run.text.strip():
            axes.text(
                middle,
                y - run.rise * em,
                visible(run.text).replace("$", r"\$"),
                fontsize=0.93 * run.size * em * scale,
                family=FONTS[kind],
                style="italic" if run.italic else "normal",
                ha="center",
                va="baseline",
            )
        x += run.width * em
