"""Figures 5 to 11 of the paper, each clean and as a bench might have measured it, side by side.

Left is the experiment without any error but its latency, right the same with wrong depths, noise
and a start beside the reference. Colours are the two laws; what is dotted the law is shown, and
what is black it is asked to do.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vsctrl.report.plots.style import GREY, INK, WITH, WITHOUT, drawing, label, takes
from vsctrl.servo import Run
from vsctrl.study.statements import Pair, Traces
from vsctrl.study.statements.runs import EDGE, sideways, size

PANELS = ("clean", "as it might be measured")
LAWS = ((False, WITHOUT, "without derivative term"), (True, WITH, "with derivative term"))
THIN = 0.9
LOOK = 120.0  #: mm, length of the line that shows where a camera looks


@takes(Traces)
def error_traces(traces: Traces) -> Figure:
    """Figures 5 and 7: E over time with and without the derivative term, true and as measured.

    >>> from vsctrl.study.statements import Bench
    >>> traces = Bench().traces(vs.paper.sliding(), 3)
    >>> len(vs.plots.error_traces(traces).axes)
    2
    """
    with drawing(9.0, 3.7) as figure:
        panels, top = figure.subplots(1, 2, sharey=True), _ceiling(traces)
        for axes, pair, title in zip(panels, traces, PANELS, strict=True):
            for run, colour, name in _laws(pair):
                true, seen = size(run.error), size(run.measured_error)
                axes.plot(run.t, seen, color=colour, linestyle=":", linewidth=1.2)
                axes.plot(run.t, true, color=colour, label=name)
            _ends(axes, pair, top)
            axes.set(title=title, xlabel="t, s", xlim=(0, float(pair.on.t[-1])))
        panels[0].set(ylabel="E, px", ylim=(0, top))
        panels[0].plot([], [], color=GREY, label="true")
        panels[0].plot([], [], color=GREY, linestyle=":", linewidth=1.2, label="as measured")
        _legend(figure, panels[0], 4)
    return figure


@takes(Traces)
def paths(traces: Traces) -> Figure:
    """Figures 6 and 9: the camera's path from above, and how far it is along and across it.

    >>> from vsctrl.study.statements import Bench
    >>> traces = Bench().traces(vs.paper.sliding(), 3)
    >>> len(vs.plots.paths(traces).axes)
    5
    """
    with drawing(9.6, 5.4) as figure:
        grid = figure.add_gridspec(2, 3, width_ratios=(0.75, 1, 1), height_ratios=(1, 1))
        whole = figure.add_subplot(grid[:, 0])
        _from_above(whole, traces.clean)
        near = [figure.add_subplot(grid[0, column]) for column in (1, 2)]
        far = [figure.add_subplot(grid[1, column]) for column in (1, 2)]
        for axes, below, pair, title in zip(near, far, traces, PANELS, strict=True):
            _path(axes, pair)
            axes.set(title=f"{title}, z enlarged", xlabel="x, mm (object frame)")
            below.axhline(0, color=INK, linewidth=THIN)
            for run, colour, _ in _laws(pair):
                below.plot(run.t, 1e3 * run.lag_along_motion, color=colour)
                below.plot(run.t, 1e3 * sideways(run), color=colour, linestyle="--", linewidth=1.1)
            below.set(xlabel="t, s", xlim=(0, float(pair.on.t[-1])))
        near[0].set_ylabel("z, mm")
        far[0].set_ylabel("distance, mm")
        for which in ("x", "y"):
            _share(near, which)
        _share(far, "y")
        near[0].plot([], [], color=GREY, label="distance along the path")
        near[0].plot([], [], color=GREY, linestyle="--", linewidth=1.1, label="across it")
        _legend(figure, near[0], 5)
    return figure


@takes(Traces)
def first_point(traces: Traces) -> Figure:
    """Figure 8: the abscissa of the first point and its reference, and the difference enlarged.

    >>> from vsctrl.study.statements import Bench
    >>> traces = Bench().traces(vs.paper.sliding(), 3)
    >>> len(vs.plots.first_point(traces).axes)
    4
    """
    with drawing(9.0, 5.4) as figure:
        grid = figure.subplots(2, 2, sharex=True, height_ratios=(1.2, 1))
        for axes, below, pair, title in zip(grid[0], grid[1], traces, PANELS, strict=True):
            below.axhline(0, color=INK, linewidth=THIN)
            for run, colour, name in _laws(pair):
                axes.plot(run.t, run.features[:, 0], color=colour, label=name)
                below.plot(run.t, run.error[:, 0], color=colour)
                seen = run.measured_error[:, 0]
                below.plot(run.t, seen, color=colour, linestyle=":", linewidth=1.1)
            on = pair.on
            style: Any = {"color": INK, "linewidth": THIN, "linestyle": (0, (5, 3))}
            axes.plot(on.t, on.reference[:, 0], label="reference X1*", **style)
            axes.set(title=title, xlim=(0, float(on.t[-1])))
            below.set(xlabel="t, s")
        grid[0, 0].set_ylabel("X1, px")
        grid[1, 0].set_ylabel("X1 − X1*, px")
        _share(grid[0], "y")
        off = traces.clean.off
        bound = 1.9 * float(np.abs(off.measured_error[off.t > 1, 0]).max())
        for axes in grid[1]:  # the start is far outside: what stays is to be seen
            axes.set_ylim(-bound, bound)
        grid[0, 0].plot([], [], color=GREY, linestyle=":", linewidth=1.1, label="as measured")
        _legend(figure, grid[0, 0], 4)
    return figure


@takes(Traces)
def velocities(traces: Traces, rotation: bool = False) -> Figure:
    """Figures 10 and 11: the camera's translation or rotation velocity in its own frame.

    >>> from vsctrl.study.statements import Bench
    >>> traces = Bench().traces(vs.paper.sliding(), 3)
    >>> len(vs.plots.velocities(traces).axes)
    6
    """
    first, factor = 3 if rotation else 0, 1e3  # mm/s and mrad/s alike
    names = ("Ωx", "Ωy", "Ωz") if rotation else ("Vx", "Vy", "Vz")
    unit = "mrad/s" if rotation else "mm/s"
    with drawing(9.0, 5.4) as figure:
        main = 1 if rotation else 0
        heights = [1.8 if row == main else 1.0 for row in range(3)]
        grid = figure.subplots(3, 2, sharex=True, height_ratios=heights)
        target = factor * traces.clean.on.scenario.reference.twist(traces.clean.on.t)
        for row, name in enumerate(names):
            column = first + row
            for axes, pair in zip(grid[row], traces, strict=True):
                axes.plot(pair.on.t, target[:, column], color=INK, linewidth=THIN, label="asked")
                for run, colour, law in _laws(pair):
                    axes.plot(
                        run.t, factor * run.twist[:, column], color=colour, label=law, linewidth=1.0
                    )
            grid[row, 0].set_ylabel(f"{name}, {unit}")
            _share(grid[row], "y", least=0.2 * factor * 0.04)
        for axes, title in zip(grid[0], PANELS, strict=True):
            axes.set_title(title)
        for axes in grid[2]:
            axes.set(xlabel="t, s", xlim=(0, float(traces.clean.on.t[-1])))
        _legend(figure, grid[0, 0], 3)
    return figure


def _laws(pair: Pair) -> list[tuple[Run, str, str]]:
    return [(pair.on if on else pair.off, colour, name) for on, colour, name in LAWS]


def _ends(axes: Axes, pair: Pair, top: float) -> None:
    """The true E of the last second in words, right of the axes, where no line can be."""
    values = [float(np.median(size(run.error)[run.t > run.t[-1] - 1])) for run in pair]
    least = 0.07 * top  # a line of text
    low, high = sorted(values)
    below = max(min(low, (low + high - least) / 2), least / 2)
    places = {low: below, high: max(high, below + least)}
    for value, colour in zip(values, (WITH, WITHOUT), strict=True):
        axes.annotate(
            f"{value:.1f} px",
            (1, places[value]),
            (4, 0),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            va="center",
            fontsize=8.5,
            color=colour,
        )


def _path(axes: Axes, pair: Pair) -> None:
    """The path asked for and those of the two cameras, each with its end."""
    goal = 1e3 * pair.on.reference_pose[:, :3, 3]
    for run, colour, name in _laws(pair):
        path = 1e3 * run.pose[:, :3, 3]
        axes.plot(path[:, 0], path[:, 2], color=colour, linewidth=1.3, label=name)
        axes.plot(path[-1, 0], path[-1, 2], "o", color=colour, markersize=5, zorder=3)
    axes.plot(goal[:, 0], goal[:, 2], color=INK, linewidth=THIN, label="desired")
    axes.plot(goal[-1, 0], goal[-1, 2], "x", color=INK, markersize=7, mew=1.4, zorder=4)


def _from_above(axes: Axes, pair: Pair) -> None:
    """The scene of figure 4 to scale: cube, LEDs, path, and where the reference looks."""
    edge = 1e3 * EDGE
    axes.fill([-edge, edge, edge, -edge], [-edge, -edge, edge, edge], color=GREY, alpha=0.18)
    axes.annotate("cube", (0, 0), ha="center", va="center", color=GREY)
    leds = 1e3 * np.array(pair.on.scenario.target.points)
    axes.plot(leds[:, 0], leds[:, 2], "v", color=GREY, markersize=5)
    label(axes, "LEDs", (0, -edge), (0, -4), ha="center", va="top", color=GREY)
    _path(axes, pair)
    poses = pair.on.reference_pose
    for pose in poses[:: max(1, (len(poses) - 1) // 4)]:
        foot, tip = 1e3 * pose[:3, 3], 1e3 * pose[:3, 3] + LOOK * pose[:3, 2]
        axes.plot([foot[0], tip[0]], [foot[2], tip[2]], color=INK, linewidth=0.7)
    axes.set(title="top view, to scale", xlabel="x, mm", ylabel="z, mm", aspect="equal")
    axes.margins(x=0.12)


def _ceiling(traces: Traces) -> float:
    """Top of an axis of E: a start that is far off is left out, so that what stays can be seen."""
    clean = max(float(size(run.measured_error).max()) for run in traces.clean)
    measured = max(float(size(run.error).max()) for run in traces.measured)
    return max(1.15 * clean, 1.05 * measured if measured < 3 * clean else 1.8 * clean)


def _share(panels: Any, which: str, least: float = 0.0) -> None:
    """The same limits for panels side by side, at least ± `least` about the middle."""
    limits = np.array([getattr(axes, f"get_{which}lim")() for axes in panels])
    low, high = float(limits[:, 0].min()), float(limits[:, 1].max())
    middle = (low + high) / 2
    low, high = min(low, middle - least), max(high, middle + least)
    for axes in panels:
        getattr(axes, f"set_{which}lim")(low, high)


def _legend(figure: Figure, axes: Axes, columns: int) -> None:
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=columns)
