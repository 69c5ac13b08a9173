"""The lag over time where there is no single number for it: predicted, and simulated over it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vsctrl.report.plots.style import GREY, INK, WITH, WITHOUT, drawing, takes
from vsctrl.servo import Run
from vsctrl.study import Comparison, History

DOTS = 90  #: of a simulated run, so that each can be told from the next


@takes(Comparison)
def histories(comparison: Comparison, chosen: Sequence[History], runs: Sequence[Run]) -> Figure:
    """Above, the first point in the image and where it should be; below, the lag of the camera.

    `chosen`: the histories to draw, dots on a line each; `runs`: with and without the derivative
    term. Dashed: the closed form on a leg, or the amplitude of the sine.

    >>> found = vs.validate(vs.paper.oscillation())
    >>> runs = [vs.simulate(vs.paper.oscillation(feedforward=term)) for term in (False, True)]
    >>> len(vs.plots.histories(found, found.own_histories, runs).axes)
    3
    """
    with drawing(7.2, 6.0) as figure:
        grid = figure.add_gridspec(2, 2, height_ratios=(1, 1.4), width_ratios=(1.6, 1))
        image, turn = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
        lag = figure.add_subplot(grid[1, :])
        for axes in (image, turn):
            for run in runs:
                colour = WITH if run.scenario.law.k_ff else WITHOUT
                axes.plot(run.t, run.features[:, 0], color=colour, linewidth=1.2)
            axes.plot(runs[0].t, runs[0].reference[:, 0], color=INK, linewidth=0.8, linestyle="--")
        image.set(title="first point in the image, X₁ and X₁* (dashed), px", xlim=(0, None))
        _enlarge(turn, runs)
        lag.axhline(0, color=INK, linewidth=0.8)
        for each in chosen:
            colour, name = (WITH, "with") if each.feedforward else (WITHOUT, "without")
            level = _level(comparison, each)
            for side in (level, -level) if level else ():
                lag.axhline(1e3 * side, color=colour, linewidth=0.8, linestyle="--")
            lag.plot(each.t, 1e3 * each.predicted, color=colour, label=f"{name} derivative term")
            n = len(each.simulated)
            # At odd steps, so that the dots do not keep to one place of every cycle.
            dots = np.arange(0, n, max(1, n // DOTS) | 1)
            style: Any = {"color": colour, "mfc": "none", "markersize": 3.6}
            lag.plot(each.t[dots], 1e3 * each.simulated[dots], "o", **style)
        lag.plot([], [], color=GREY, label="figure 1, velocity held")
        lag.plot([], [], "o", color=GREY, mfc="none", markersize=3.6, label="6-DOF simulation")
        if any(_level(comparison, each) for each in chosen):
            lag.plot([], [], color=GREY, linestyle="--", linewidth=0.8, label="closed form, ±")
        straight = (
            "along its direction" if comparison.rows or comparison.waves else "along the motion"
        )
        lag.set(title=f"lag of the camera {straight}, mm", xlabel="t, s")
        lag.set_xlim(0, float(max(each.t[-1] for each in chosen)) if chosen else None)
        lag.margins(y=0.08)
        figure.legend(*lag.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _enlarge(axes: Axes, runs: Sequence[Run]) -> None:
    """Zoom to the reference's last turn in the image, or to its end where it does not turn."""
    t = runs[0].t
    X = runs[0].reference[: min(len(run.t) for run in runs), 0]
    slope = np.diff(X)
    turns = np.flatnonzero(slope[1:] * slope[:-1] < 0) + 1
    half = 0.04 * float(t[-1])
    middle = float(t[turns[-1]]) if len(turns) else float(t[len(X) - 1]) - half
    inside = (t[: len(X)] >= middle - half) & (t[: len(X)] <= middle + half)
    seen = [X[inside], *(run.features[: len(X), 0][inside] for run in runs)]
    low, high = min(map(np.min, seen)), max(map(np.max, seen))
    edge = 0.1 * max(high - low, 1e-3)
    axes.set(title="enlarged", xlim=(middle - half, middle + half), ylim=(low - edge, high + edge))


def _level(comparison: Comparison, each: History) -> float:
    """The steady lag of a leg, or the amplitude of the sine, by closed form in m; 0 without one."""
    names = ("feedforward", "delay", "placement")
    case: Any = {name: getattr(each, name) for name in names}
    if comparison.rows:
        return abs(comparison.row(**case).analytic or 0.0)
    return abs(comparison.wave(**case).analytic or 0.0) if comparison.waves else 0.0
