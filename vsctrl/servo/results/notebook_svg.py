"""A run at a glance, for notebooks: a small SVG of the points' paths and of the error over time.

Written by hand, since the simulator needs NumPy alone. Whatever the run's length, a picture stays
below some 30 kB; it has no ids, so that any number of them share a page, and takes its text colour
from the page, so that it reads in light and dark. Figures to publish are in
``vsctrl.report.plots``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vsctrl.arrays import Array, Mask
from vsctrl.servo.results.columns import measured_in_pixels
from vsctrl.servo.results.frames import Frames
from vsctrl.tables import escaped

TRUE, SEEN, GREY = "#1b9e77", "#d95f02", "#8a8f98"
WIDTH, HEIGHT = 720, 292
_DASHED = ' stroke-dasharray="4 3" stroke-width="1.2"'
# Vertices of all paths in the image together, and of each curve over time.
PATHS, CURVE = 1200, 240
MOST_POINTS = 24


class _Frame(NamedTuple):
    """A rectangle of the picture and what it shows: x from a to b, y from c (below) to d."""

    left: float
    top: float
    width: float
    height: float
    a: float
    b: float
    c: float
    d: float

    def to(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Data to coordinates inside the frame."""
        return (
            (x - self.a) / (self.b - self.a) * self.width,
            (self.d - y) / (self.d - self.c) * self.height,
        )


def sketch(run: Frames) -> str:
    """The picture as an SVG element: left the image plane, right the norm of the error."""
    words = f"Run of {run.scenario.name}: paths of the points in the image, and error over time"
    return (
        f'<svg role="img" aria-label="{escaped(words)}" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'style="display:block;width:100%;max-width:{WIDTH}px" fill="none" stroke-width="1.5" '
        'stroke-linejoin="round" font-family="sans-serif" font-size="11">'
        f"{_image(run)}{_errors(run)}</svg>"
    )


def _image(run: Frames) -> str:
    points = min(run.depths.shape[1], MOST_POINTS)
    shown, goal = (e[:, : 2 * points].reshape(-1, points, 2) for e in (run.features, run.reference))
    seen = run.visible[:, :points]
    size = run.scenario.camera.size_px
    frame = _around(shown, goal, seen, size)
    stride = max(1, math.ceil(len(run.t) / max(2, PATHS // (2 * points))))
    kept = np.unique(np.append(np.arange(0, len(run.t), stride), len(run.t) - 1))
    parts = []
    if size is not None:
        x, y = frame.to(np.array([-0.5, 0.5]) * size[0], np.array([0.5, -0.5]) * size[1])
        box = f'x="{x[0]:.1f}" y="{y[1]:.1f}" width="{x[1] - x[0]:.1f}"'
        parts.append(f'<rect {box} height="{y[0] - y[1]:.1f}" stroke="{GREY}"/>')
    for i in range(points):
        x, y = frame.to(*np.where(seen[:, i, None], shown[:, i], np.nan)[kept].T)
        parts.append(_line(x, y, TRUE))
    for i in range(points):
        x, y = frame.to(*goal[kept, i].T)
        parts.append(_line(x, y, GREY, _DASHED))
    for k, fill in ((0, "none"), (-1, TRUE)):
        x, y = frame.to(*shown[k, seen[k]].T)
        parts += [_dot(*place, fill) for place in zip(x, y, strict=True)]
    x, y = frame.to(*goal[-1].T)
    parts += [_cross(*place) for place in zip(x, y, strict=True)]
    more = run.depths.shape[1] - points
    title = "image plane, px" + (f" ({points} of {points + more} points)" if more else "")
    legend = [("path", TRUE, ""), ("reference", GREY, _DASHED)]
    marks = "○ start   ● end   × where the reference ends"
    below = _text(frame.left, frame.top + frame.height + 32, marks, "start")
    return _panel(frame, "".join(parts), title, legend, (5, 5)) + below


def _around(shown: Array, goal: Array, seen: Mask, size: object) -> _Frame:
    """The frame of the image plane, y downwards, equal scales: the camera's image or all paths."""
    box = (46.0, 26.0, 250.0, 220.0)
    if isinstance(size, tuple):
        low, high = np.array([-0.5, -0.5]) * size, np.array([0.5, 0.5]) * size
    else:
        every = np.concatenate([goal.reshape(-1, 2), shown[seen]])
        low, high = every.min(axis=0), every.max(axis=0)
    middle = low / 2 + high / 2
    half = max(*(1.08 * (high - low) / 2 / np.array(box[2:])), 1e-9 * np.abs(middle).max(), 1e-6)
    x, y = half * box[2], half * box[3]
    return _Frame(*box, middle[0] - x, middle[0] + x, middle[1] + y, middle[1] - y)


def _errors(run: Frames) -> str:
    curves = [("true", TRUE, "", np.linalg.norm(run.error, axis=1))]
    if measured_in_pixels(run.scenario):
        seen = np.linalg.norm(run.measured_error, axis=1)
        curves.append(("measured", SEEN, ' stroke-dasharray="5 3"', seen))
    top = max(float(values.max()) for *_, values in curves)
    last = float(run.t[-1])
    frame = _Frame(
        366.0, 26.0, 340.0, 220.0, 0.0, last or 1.0, 0.0, 1.06 * top if top > 1e-6 else 1
    )
    parts = []
    for _, colour, style, values in curves:
        parts.append(_line(*frame.to(*_extremes(run.t, values)), colour, style))
    legend = [(f"{name}", colour, style) for name, colour, style, _ in curves]
    return _panel(frame, "".join(parts), "norm of the error, px, over t, s", legend, (6, 5))


def _extremes(t: Array, values: Array) -> tuple[Array, Array]:
    """The least and the greatest value of every short stretch, so that no peak is lost."""
    parts = np.array_split(np.arange(len(t)), min(len(t), CURVE // 2))
    kept = [{k[0] + int(np.argmin(values[k])), k[0] + int(np.argmax(values[k]))} for k in parts]
    chosen = np.array(sorted(set().union(*kept) | {0, len(t) - 1}))
    return t[chosen], values[chosen]


def _panel(
    frame: _Frame,
    inside: str,
    title: str,
    legend: list[tuple[str, str, str]],
    ticks: tuple[int, int],
) -> str:
    """A title with a legend, axes with their numbers, and the content cut off at the frame."""
    left, top, width, height, a, b, c, d = frame
    out = [f'<g transform="translate({left:g} {top:g})">', _text(0, -10, title, "start")]
    x = width
    for name, colour, style in reversed(legend):
        x -= 7.0 * len(name)
        out.append(_text(x, -10, name, "start"))
        out.append(f'<path d="M{x - 22:.1f} -14h17" stroke="{colour}"{style}/>')
        x -= 34
    grid, labels = [], []
    for value, text in _ticks(a, b, ticks[0]):
        x = (value - a) / (b - a) * width
        grid.append(f"M{x:.1f} 0v{height:g}")
        labels.append(_text(x, height + 15, text, "middle"))
    for value, text in _ticks(c, d, ticks[1]):
        y = (d - value) / (d - c) * height
        grid.append(f"M0 {y:.1f}h{width:g}")
        labels.append(_text(-6, y + 4, text, "end"))
    out.append(f'<path d="{"".join(grid)}" stroke="{GREY}" stroke-width=".6" opacity=".4"/>')
    # A nested svg element cuts off what lies outside, without an id that a clip path would need.
    out.append(f'<svg width="{width:g}" height="{height:g}">{inside}</svg>')
    out.append(f'<path d="M0 0V{height:g}H{width:g}" stroke="currentColor"/>')
    return "".join([*out, *labels, "</g>"])


def _ticks(a: float, b: float, most: int) -> list[tuple[float, str]]:
    """Round numbers between a and b, at most so many steps."""
    low, high = min(a, b), max(a, b)
    raw = (high - low) / most
    unit = 10.0 ** math.floor(math.log10(raw))
    step = next(unit * m for m in (1, 2, 2.5, 5, 10) if unit * m >= raw * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    values = [k * step for k in range(first, last + 1)]
    return [(value, f"{value + 0.0:.6g}".replace("-", "−")) for value in values]


def _text(x: float, y: float, text: str, anchor: str) -> str:
    place = f'x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"'
    return f'<text {place} fill="currentColor" stroke="none">{escaped(text)}</text>'


def _line(x: Array, y: Array, colour: str, style: str = "") -> str:
    """A path through the points, broken where one is not a number; far outside is near enough."""
    words, pen = [], "M"
    x, y = np.clip(x, -9999, 9999), np.clip(y, -9999, 9999)
    for u, v in zip(x.tolist(), y.tolist(), strict=True):
        if math.isnan(u):
            pen = "M"
            continue
        words.append(f"{pen}{u:.1f} {v:.1f}")
        pen = "L"
    return f'<path d="{"".join(words)}" stroke="{colour}"{style}/>'


def _dot(x: float, y: float, fill: str) -> str:
    x, y = np.clip((x, y), -9999, 9999).tolist()
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" stroke="{TRUE}" fill="{fill}"/>'


def _cross(x: float, y: float) -> str:
    x, y = np.clip((x, y), -9999, 9999).tolist()
    return f'<path d="M{x - 4:.1f} {y - 4:.1f}l8 8m0 -8l-8 8" stroke="currentColor"/>'
