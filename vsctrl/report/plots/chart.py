"""Stability over two parameters: regions, exact boundaries, and the roots that cross them."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from vsctrl.diagram.stability_chart.chart import Boundary, StabilityChart
from vsctrl.diagram.stability_chart.raster import Regions
from vsctrl.report.plots.canvas import LETTERS, Size, picture_of, plain
from vsctrl.report.plots.letters import lettered
from vsctrl.report.plots.style import INK, WITH, WITHOUT, takes


@takes(StabilityChart)
def stability_chart(
    chart: StabilityChart, *, here: tuple[float, float] | None = None, size: Size = None
) -> Figure:
    """Where over two parameters the loop is stable, how many roots are unstable elsewhere.

    Lines are the exact boundaries: solid where a pair of roots crosses, with its frequency in
    rad/s, dashed where a real root passes 0. The stable region is filled in `WITH`. here: (x, y) of
    the loop itself, a dot. size: (width, height), inches.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> chart = loop.stability_chart(lam=(1, 25), tau=(0.02, 0.2), grid=(6, 4))
    >>> figure = vs.plots.stability_chart(chart)
    >>> figure.alt
    'Unstable roots over lam and tau.'
    """
    regions = chart.regions(1200, 800)
    with picture_of(size, (7.2, 4.8)) as figure:
        axes = figure.subplots()
        box = (chart.x[0], chart.x[-1], chart.y[0], chart.y[-1])
        shade = np.full((*regions.unstable.shape, 4), (*to_rgb(WITH), 0.28))
        unstable = regions.unstable > 0
        shade[unstable, :3] = to_rgb(WITHOUT)
        # Ever darker with every pair, never so dark that the words in it cannot be read.
        shade[unstable, 3] = 0.42 - 0.34 * 0.75 ** (regions.unstable[unstable] - 1)
        # As it is: resampled it would be ten times as large in a page, with noise in every colour.
        how: Any = {"interpolation": "none", "aspect": "auto", "zorder": 0}
        axes.imshow((255 * shade).round().astype("u1"), extent=box, origin="lower", **how)
        for boundary in chart.boundaries:
            axes.plot(
                *boundary.points.T,
                color=INK,
                linewidth=1.4,
                linestyle="-" if boundary.pair else "--",
                solid_joinstyle="round",
            )
            _frequencies(axes, chart, boundary)
        _counts(axes, regions)
        if here is not None:
            axes.plot(*here, "o", color=INK, markersize=6, zorder=6)
        axes.set(xlim=box[:2], ylim=box[2:])
        axes.set_xlabel(lettered(chart.x_name))
        axes.set_ylabel(lettered(chart.y_name))
        axes.grid(False)
        words = _noticed(chart, regions)
        letters = int(LETTERS * figure.get_figwidth())
        wrapped = "\n".join(textwrap.fill(line, letters) for line in words.split("\n"))
        figure.suptitle(wrapped, x=0.01, ha="left", fontsize=10)
        figure.caption = f"{words.replace(chr(10), '; ')}. {chart.sentence}"
        figure.alt = f"Unstable roots over {plain(chart.x_name)} and {plain(chart.y_name)}."
    return figure


def _noticed(chart: StabilityChart, regions: Regions) -> str:
    """What the chart shows, as its title."""
    share = float((regions.unstable == 0).mean())
    pairs = [b for b in chart.boundaries if b.pair]
    words = f"Stable in the green {100 * share:.0f} %; figures count unstable roots"
    words = "Stable everywhere" if share == 1 else "Stable nowhere here" if not share else words
    kinds = ["solid: a pair of roots crosses at jω, ω on the line in rad/s"] if pairs else []
    kinds += ["dashed: a real root passes 0"] if len(pairs) < len(chart.boundaries) else []
    return "\n".join([words, *(["; ".join(kinds)] if kinds else [])])


def _frequencies(axes: Axes, chart: StabilityChart, boundary: Boundary) -> None:
    """The frequency at a few places of a pair's boundary, apart along the drawn line."""
    if not boundary.pair:
        return
    size = np.array([np.ptp(chart.x), np.ptp(chart.y)])
    place = (boundary.points - [chart.x[0], chart.y[0]]) / size
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(place, axis=0), axis=1))])
    number = min(int(way[-1] / 0.35), 4)
    for share in (np.arange(number) + 0.5) / max(number, 1):
        k = int(np.searchsorted(way, share * way[-1]))
        if not (place[k] > 0.04).all() or not (place[k] < 0.96).all():
            continue
        axes.annotate(
            f"{boundary.omega[k]:.3g}",
            boundary.points[k],
            ha="center",
            va="center",
            fontsize=7.5,
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"},
            color="black",
        )


def _counts(axes: Axes, regions: Regions) -> None:
    """How many roots are unstable, in the middle of every region that has room for it."""
    for x, y, count, share in regions.places:
        if share > 0.004:
            words = "stable" if count == 0 else f"{count:g}" if math.isfinite(count) else "∞"
            many = "" if count == 0 or share < 0.04 else " unstable root" + "s" * (count != 1)
            weight = "bold" if count == 0 else "normal"
            axes.annotate(words + many, (x, y), ha="center", va="center", fontweight=weight)
