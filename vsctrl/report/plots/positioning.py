"""How a camera arrives at a goal, and how a run compares with what its linear loop predicts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vsctrl.arrays import Array
from vsctrl.report.plots.canvas import plain
from vsctrl.report.plots.run import AXES
from vsctrl.report.plots.style import EXACT, GREY, INK, SERIES, WITHOUT, drawing, takes
from vsctrl.servo import Run
from vsctrl.study.examination.examination import Examination

LEAST = 1e-3  #: of the first error, to which a decay is drawn at least
DOTS = 60  #: of a predicted curve


@takes(Examination)
def arrival(x: Examination) -> Figure:
    """Paths of the points in the image, that of the camera from above, and the decay of the error.

    Dotted: straight lines from start to goal. Dots: the linear loop.

    >>> from vsctrl.study.examination.examination import examination
    >>> slide = vs.paper.sliding().with_(kind="hold", duration=2.0, offset=(0.02, 0, 0, 0, 0, 0))
    >>> len(vs.plots.arrival(examination(slide)).axes)
    3
    """
    run = x.run
    with drawing(7.2, 6.0) as figure:
        grid = figure.add_gridspec(2, 2)
        _image(figure.add_subplot(grid[0, 0]), run)
        _space(figure.add_subplot(grid[0, 1]), run)
        _decay(figure.add_subplot(grid[1, :]), run, x.predicted)
    return figure


@takes(Examination)
def predicted_lag(x: Examination) -> Figure:
    """The lag of the run, lines, and of the linear loop, dots: translations and rotations.

    >>> from vsctrl.study.examination.examination import examination
    >>> slide = vs.paper.sliding().with_(kind="hold", duration=2.0, offset=(0.02, 0, 0, 0, 0, 0))
    >>> len(vs.plots.predicted_lag(examination(slide)).axes)
    2
    """
    run, predicted = x.run, x.predicted
    with drawing(7.2, 4.6) as figure:
        for axes, part, names, unit in zip(
            figure.subplots(2, 1, sharex=True),
            (slice(0, 3), slice(3, 6)),
            (("x", "y", "z"), ("about x", "about y", "about z")),
            ("mm", "mrad"),
            strict=True,
        ):
            assert isinstance(axes, Axes)
            seen = 1e3 * run.lag[:, part]
            for column, (name, colour) in enumerate(zip(names, AXES, strict=True)):
                axes.plot(run.t, seen[:, column], color=colour, linewidth=1.3, label=name)
                if predicted is not None:
                    dots = _dots(len(predicted))
                    values = 1e3 * predicted[dots, part][:, column]
                    axes.plot(run.t[dots], values, ".", color=colour, markersize=4.5)
            axes.set_ylabel(f"lag, {unit}")
            low, high = float(seen.min()), float(seen.max())
            edge = 0.12 * max(high - low, 0.1)
            axes.set_ylim(low - edge, high + 2 * edge)  # room for the legend above
            axes.legend(loc="upper right", ncols=3)
        axes.set_xlabel("t, s")
        axes.set_xlim(0, float(run.t[-1]) or None)
    return figure


def distances(runs: Sequence[Run], names: Sequence[str]) -> Figure:
    """The distance of the camera from its reference over time, of several runs.

    >>> run = vs.simulate(vs.paper.sliding())
    >>> len(vs.plots.distances([run], ["slide"]).axes)
    1
    """
    with drawing(7.2, 3.6) as figure:
        axes = figure.subplots()
        top = 0.1
        for i, (run, name) in enumerate(zip(runs, names, strict=True)):
            away = 1e3 * np.linalg.norm(run.pose[:, :3, 3] - run.reference_pose[:, :3, 3], axis=1)
            axes.plot(run.t, away, color=SERIES[i % len(SERIES)], label=plain(name))
            if run.status.complete:
                top = max(top, float(away.max()))
            else:  # what runs away would hide all others
                top = max(top, float(np.median(away)))
        axes.set(xlabel="t, s", ylabel="distance, mm", ylim=(0, 1.1 * top), xlim=(0, None))
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2)
        figure.caption = "Distance of the camera from its reference, of each run."
        figure.alt = "Distances from the reference over time."
    return figure


def _dots(n: int) -> Any:
    # At odd steps, so that the dots do not keep to one place of every cycle.
    return np.arange(0, n, max(1, n // DOTS) | 1)


def _image(axes: Axes, run: Run) -> None:
    points = run.features.reshape(len(run.t), -1, 2)
    goals = run.reference[-1].reshape(-1, 2)
    for i in range(points.shape[1]):
        line = np.array([points[0, i], goals[i]])
        axes.plot(*line.T, ":", color=GREY, linewidth=1)
        axes.plot(points[:, i, 0], points[:, i, 1], color=EXACT, linewidth=1.4)
        axes.plot(*points[0, i], "o", color=EXACT, markersize=4)
        axes.plot(*goals[i], "+", color=INK, markersize=9, mew=1.4)
    axes.set(title="points in the image, px (+ goal)", aspect="equal")
    axes.invert_yaxis()  # as the image is seen
    axes.margins(0.12)


def _space(axes: Axes, run: Run) -> None:
    path, goal = 1e3 * run.pose[:, :3, 3], 1e3 * run.reference_pose[-1, :3, 3]
    axes.plot([path[0, 0], goal[0]], [path[0, 2], goal[2]], ":", color=GREY, linewidth=1)
    axes.plot(path[:, 0], path[:, 2], color=EXACT, linewidth=1.4)
    axes.plot(path[0, 0], path[0, 2], "o", color=EXACT, markersize=4)
    axes.plot(goal[0], goal[2], "+", color=INK, markersize=9, mew=1.4)
    axes.set(title="camera from above, x and z, mm", aspect="equal")
    axes.margins(0.15)


def _decay(axes: Axes, run: Run, predicted: Array | None) -> None:
    sizes: list[tuple[str, str, Any, Array]] = [
        ("distance, mm", EXACT, slice(0, 3), 1e3 * run.lag),
        ("angle, mrad", WITHOUT, slice(3, 6), 1e3 * run.lag),
    ]
    top = 1.0
    for name, colour, part, lag in sizes:
        size = np.linalg.norm(lag[:, part], axis=1)
        if not size[0]:
            continue
        top = max(top, float(size.max()))
        axes.semilogy(run.t, np.maximum(size, 1e-12), color=colour, label=name)
        if predicted is not None:
            dots = _dots(len(predicted))
            values = 1e3 * np.linalg.norm(predicted[dots, part], axis=1)
            axes.semilogy(run.t[dots], np.maximum(values, 1e-12), ".", color=colour, markersize=4.5)
    axes.plot([], [], ".", color=GREY, label="linear loop")
    end = float(np.linalg.norm(1e3 * run.lag[-1, :3]))
    axes.set_ylim(max(1e-6, min(LEAST * top, 0.3 * max(end, 1e-9))), 2 * top)
    axes.set(title="how far from the goal", xlabel="t, s", xlim=(0, float(run.t[-1])))
    axes.legend(loc="upper right", ncols=3)
