"""The loop in time: its responses, and the runs of the simulator as the paper shows them."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vsctrl.report.plots.style import EXACT, GREY, INK, PADE, WITH, WITHOUT, drawing, label, takes
from vsctrl.servo import Run
from vsctrl.study.plot_data import Times


@takes(Times)
def responses(data: Times) -> Figure:
    """The step, what Padé gets wrong of it, and the tracking error on the ramp.

    >>> from vsctrl.study.plot_data import curves
    >>> stability = vs.study.examine(vs.paper.sliding()).stability
    >>> data = curves(stability)
    >>> len(vs.plots.responses(data.times).axes)
    3
    """
    with drawing(7.2, 5.6) as figure:
        grid = figure.add_gridspec(2, 2)
        step, wrong = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
        ramp = figure.add_subplot(grid[1, :])
        step.axhline(1, color=INK, linewidth=0.8)
        step.plot(data.t, data.step, color=EXACT)
        last = float(data.t[-1])
        step.set(title="unit step, no feed-forward: S(t)", xlabel="t, s", xlim=(0, last))
        for order, values in data.step_pade.items():
            error = np.maximum(np.abs(values - data.step), 1e-16)
            wrong.semilogy(data.t, error, color=PADE[order], label=f"Padé {order}", linewidth=1.1)
        wrong.set(
            title="|Padé − exact| of that step", xlabel="t, s", xlim=(0, last), ylim=(1e-8, 1)
        )
        if data.step_pade:
            wrong.legend(loc="upper right", ncols=3)
        ramp.axhline(0, color=INK, linewidth=0.8)
        for on, colour, name in ((False, WITHOUT, "without"), (True, WITH, "with")):
            ramp.plot(data.t, 1e3 * data.ramp[on], color=colour, label=f"{name} feed-forward")
            ramp.plot(data.t, 1e3 * data.ramp_pade[on], color=INK, linewidth=0.8, linestyle=":")
            level = 1e3 * data.steady[on]
            ramp.axhline(level, color=colour, linewidth=0.8, linestyle="--")
            words = f"{level:+.2f} mm".replace("-", "−")
            label(ramp, words, (data.t[-1], level), (-2, 4), ha="right", color=colour)
        ramp.plot([], [], color=GREY, linestyle="--", linewidth=0.8, label="closed form")
        ramp.plot([], [], color=INK, linestyle=":", linewidth=0.8, label="Padé 4")
        ramp.set(
            title=f"ramp of {1e3 * data.slope:g} mm/s: S − S*, mm", xlabel="t, s", xlim=(0, last)
        )
        ramp.margins(y=0.14)
        ramp.legend(loc="center right", ncols=2)
    return figure


@takes(Run, Run)
def errors(on: Run, off: Run) -> Figure:
    """Figures 5 and 7 of the paper: image error E with and without k_ff, true and as measured.

    >>> on, off = (vs.simulate(vs.paper.sliding(feedforward=term)) for term in (True, False))
    >>> len(vs.plots.errors(on, off).axes)
    1
    """
    with drawing(7.2, 3.8) as figure:
        axes = figure.subplots()
        for run, colour, name in ((off, WITHOUT, "without"), (on, WITH, "with")):
            true = np.linalg.norm(run.error, axis=1)
            seen = np.linalg.norm(run.measured_error, axis=1)
            axes.plot(run.t, true, color=colour, label=f"{name} derivative term, true")
            axes.plot(run.t, seen, color=colour, linestyle=":", label=f"{name}, as measured")
            words, end = f"{true[-1]:.1f} px", (run.t[-1], true[-1])
            label(axes, words, end, (-2, 4), ha="right", color=colour)
        axes.set(xlabel="t, s", ylabel="E, px", ylim=(0, None), xlim=(0, None))
        axes.margins(y=0.12)
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


@takes(Run, Run)
def top_view(on: Run, off: Run) -> Figure:
    """Figure 6 of the paper: the camera's path from above, and where it is at the end.

    Where one run ends before the other, both cameras and their reference are shown at its end.

    >>> on, off = (vs.simulate(vs.paper.sliding(feedforward=term)) for term in (True, False))
    >>> len(vs.plots.top_view(on, off).axes)
    2
    """
    with drawing(7.2, 4.4) as figure:
        whole, end = figure.subplots(1, 2, width_ratios=(1, 1.15))
        last = min(len(on.t), len(off.t)) - 1
        longer = on if len(on.t) > len(off.t) else off
        goal = 1e3 * longer.reference_pose[:, :3, 3]
        for axes in (whole, end):
            axes.plot(goal[:, 0], goal[:, 2], color=INK, linewidth=0.9, label="reference")
            for run, colour, name in ((off, WITHOUT, "without"), (on, WITH, "with")):
                path = 1e3 * run.pose[:, :3, 3]
                axes.plot(path[:, 0], path[:, 2], color=colour, label=f"{name} derivative term")
                axes.plot(*path[last, ::2], "o", color=colour, markersize=6, zorder=3)
            axes.plot(*goal[last, ::2], "x", color=INK, markersize=8, mew=1.6, zorder=4)
            axes.set_xlabel("x, mm (object frame)")
            axes.locator_params(axis="x", nbins=4)
        leds = 1e3 * np.array(on.scenario.target.points)
        whole.plot(leds[:, 0], leds[:, 2], "^", color=GREY, label="LEDs")
        whole.set(ylabel="z, mm", aspect="equal", anchor="N")
        whole.margins(x=0.25)
        _end_of_path(end, on, off, last)
        figure.legend(*whole.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _end_of_path(axes: Axes, on: Run, off: Run, last: int) -> None:
    """Zoom to the positions at the frame `last`, each named by its distance along the motion."""
    goal = 1e3 * on.reference_pose[last, :3, 3]
    half = 1.0
    for run, colour, below in ((off, WITHOUT, False), (on, WITH, True)):
        end = 1e3 * run.pose[last, :3, 3]
        half = max(half, float(np.abs(end - goal).max()))
        if not run.scenario.speed:
            continue
        lag = 1e3 * float(run.lag_along_motion[last])
        words = f"{abs(lag):.1f} mm {'behind' if lag < 0 else 'ahead'}"
        words = words if abs(lag) > 5e-3 else "on the reference"
        place: Any = {"ha": "center", "va": "top" if below else "bottom", "color": colour}
        label(axes, words, (end[0], end[2]), (0, -9 if below else 9), **place)
    which = "the end" if len(on.t) == len(off.t) else "the earlier end"
    axes.set(
        xlim=(goal[0] - 1.8 * half, goal[0] + 1.8 * half),
        ylim=(goal[2] - 1.8 * half, goal[2] + 1.8 * half),
        aspect="equal",
        anchor="N",  # at the top, where the layout has kept room for the title
        title=f"{which}, t = {on.t[last]:g} s",
    )
