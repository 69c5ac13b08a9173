"""The report's figures: each function draws one result object and computes nothing.

Figures are Matplotlib `Figure` objects, never pyplot's, so that drawing has no global state. Lines
that belong to a page's text (axes, labels) are drawn in `INK`, which the page turns into its own
text colour, so that a figure reads in light and dark.
"""

from __future__ import annotations

import io
import math
import re
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vsctrl.diagram.chart import Boundary, StabilityChart
from vsctrl.diagram.regions import Regions
from vsctrl.servo import Run
from vsctrl.study.curves import Frequency, Locus, Times
from vsctrl.study.stability import Stability

Array = NDArray[np.float64]

INK = "#010203"
EXACT = "#2f6fb7"
WITH, WITHOUT = "#1b9e77", "#d95f02"
PADE = {1: "#e0a030", 2: "#c0569b", 4: "#7a5fc0"}
GREY = "#8a8f98"

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
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.6,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "svg.fonttype": "path",
    "svg.hashsalt": "vsctrl",
}


def bode(data: Frequency, found: Stability) -> Figure:
    """Magnitude and phase of the opened loop, exact delay against Padé, margins marked."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 5.0), layout="constrained")
        top, bottom = figure.subplots(2, 1, sharex=True)
        margins = found.margins
        top.semilogx(data.omega, 20 * np.log10(np.abs(data.exact)), color=EXACT)
        top.axhline(0, color=INK, linewidth=0.8)
        top.set_ylabel("|L(jω)|, dB")
        for order, values in data.pade.items():
            bottom.semilogx(data.omega, _phase(values), color=PADE[order], label=f"Padé {order}")
        bottom.semilogx(data.omega, _phase(data.exact), color=EXACT, label="exact delay")
        bottom.axhline(-180, color=INK, linewidth=0.8)
        bottom.set_ylabel("arg L(jω), °")
        bottom.set_xlabel("ω, rad/s")
        low = max(float(_phase(data.exact).min()), -720.0)
        bottom.set_ylim(low - 20, -60)
        bottom.set_yticks(np.arange(-90, low - 20, -90)[::-1])
        if margins.gain_crossings:
            omega, phase = margins.gain_crossings[0]
            _mark(bottom, omega, -180, math.degrees(phase) - 180, WITH)
            bottom.annotate(
                f"phase margin {math.degrees(phase):.1f}°",
                (omega, -180),
                xytext=(0, -4),
                textcoords="offset points",
                ha="center",
                va="top",
            )
        if margins.phase_crossings:
            omega, factor = margins.phase_crossings[0]
            _mark(top, omega, -20 * math.log10(factor), 0, WITHOUT)
            top.annotate(
                f"gain margin ×{factor:.2f}",
                (omega, -10 * math.log10(factor)),
                xytext=(6, 0),
                textcoords="offset points",
                va="center",
            )
        bottom.legend(loc="lower left")
    return figure


def nyquist(data: Frequency, found: Stability) -> Figure:
    """L(jω) in the plane round −1, exact delay against Padé, with the circle of 1/Ms."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(4.9, 4.4), layout="constrained")
        axes = figure.subplots()
        turn = np.exp(1j * np.linspace(0, 2 * np.pi, 361))
        axes.plot(turn.real, turn.imag, color=GREY, linewidth=0.9, linestyle="--")
        distance = found.margins.modulus
        around = -1 + distance * turn
        axes.plot(around.real, around.imag, color=WITHOUT, linewidth=1.0)
        axes.plot(-1, 0, marker="+", color=INK, markersize=10, markeredgewidth=1.6)
        for order, values in data.pade.items():
            axes.plot(values.real, values.imag, color=PADE[order], label=f"Padé {order}")
        axes.plot(data.exact.real, data.exact.imag, color=EXACT, label="exact delay")
        axes.annotate(
            f"1/Ms = {distance:.3f}",
            (-1, distance),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center",
            color=WITHOUT,
        )
        axes.set(xlim=(-2.2, 1.2), ylim=(-2.2, 1.2), aspect="equal")
        axes.set_xlabel("Re L(jω)")
        axes.set_ylabel("Im L(jω)")
        axes.legend(loc="lower right")
    return figure


def responses(data: Times) -> Figure:
    """The step, what Padé gets wrong of it, and the tracking error on the ramp."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 5.6), layout="constrained")
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
            ramp.annotate(
                f"{level:+.2f} mm".replace("-", "−"),
                (data.t[-1], level),
                xytext=(-2, 4),
                textcoords="offset points",
                ha="right",
                color=colour,
            )
        ramp.plot([], [], color=GREY, linestyle="--", linewidth=0.8, label="closed form")
        ramp.plot([], [], color=INK, linestyle=":", linewidth=0.8, label="Padé 4")
        ramp.set(
            title=f"ramp of {1e3 * data.slope:g} mm/s: S − S*, mm", xlabel="t, s", xlim=(0, last)
        )
        ramp.margins(y=0.14)
        ramp.legend(loc="center right", ncols=2)
    return figure


def root_locus(data: Locus, found: Stability) -> Figure:
    """The rightmost characteristic roots as λ grows, exact delay against Padé."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(4.9, 4.4), layout="constrained")
        axes = figure.subplots()
        for branch in data.pade.T:
            axes.plot(branch.real, branch.imag, ".", color=PADE[4], markersize=2.2)
        axes.plot(data.exact.real, data.exact.imag, ".", color=EXACT, markersize=2.6)
        axes.plot(data.here.real, data.here.imag, "x", color=WITHOUT, markersize=7)
        tau = found.scenario.vision.latency
        axes.axvline(0, color=INK, linewidth=0.8)
        axes.set(xlim=(-4.5 / tau, 2.4 / tau), ylim=(-9.5 / tau, 9.5 / tau))
        axes.set_xlabel("Re s, rad/s")
        axes.set_ylabel("Im s, rad/s")
        for label, marker, colour in (
            ("exact delay", ".", EXACT),
            (f"Padé {data.pade_order}", ".", PADE[4]),
            (f"λ = {found.scenario.law.lam:g} s⁻¹", "x", WITHOUT),
        ):
            axes.plot([], [], marker, color=colour, label=label)
        axes.legend(loc="upper right")
    return figure


def errors(on: Run, off: Run) -> Figure:
    """Figure 5 of the paper: image error E with and without the derivative term, true and seen."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 3.4), layout="constrained")
        axes = figure.subplots()
        for run, colour, name in ((off, WITHOUT, "without"), (on, WITH, "with")):
            true = np.linalg.norm(run.error, axis=1)
            seen = np.linalg.norm(run.measured_error, axis=1)
            axes.plot(run.t, true, color=colour, label=f"{name} derivative term, true")
            axes.plot(run.t, seen, color=colour, linestyle=":", label=f"{name}, as measured")
            axes.annotate(
                f"{true[-1]:.1f} px",
                (run.t[-1], true[-1]),
                xytext=(-2, 4),
                textcoords="offset points",
                ha="right",
                color=colour,
            )
        axes.set(xlabel="t, s", ylabel="E, px", ylim=(0, None), xlim=(0, None))
        axes.margins(y=0.12)
        axes.legend(loc="center", ncols=2)
    return figure


def top_view(on: Run, off: Run) -> Figure:
    """Figure 6 of the paper: the camera's path from above, and where it is at the end."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 4.4), layout="constrained")
        whole, end = figure.subplots(1, 2, width_ratios=(1, 1.15))
        goal = 1e3 * on.reference_pose[:, :3, 3]
        for axes in (whole, end):
            axes.plot(goal[:, 0], goal[:, 2], color=INK, linewidth=0.9, label="reference")
            for run, colour, name in ((off, WITHOUT, "without"), (on, WITH, "with")):
                path = 1e3 * run.pose[:, :3, 3]
                axes.plot(path[:, 0], path[:, 2], color=colour, label=f"{name} derivative term")
                axes.plot(path[-1, 0], path[-1, 2], "o", color=colour, markersize=6, zorder=3)
            axes.plot(goal[-1, 0], goal[-1, 2], "x", color=INK, markersize=8, mew=1.6, zorder=4)
            axes.set_xlabel("x, mm (object frame)")
        leds = 1e3 * np.array(on.scenario.target.points)
        whole.plot(leds[:, 0], leds[:, 2], "^", color=GREY, label="LEDs")
        whole.set(ylabel="z, mm", aspect="equal")
        whole.margins(x=0.25)
        _end_of_path(end, on, off)
        figure.legend(*whole.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _end_of_path(axes: Axes, on: Run, off: Run) -> None:
    """Zoom to the last positions, each named by its distance along the motion."""
    goal = 1e3 * on.reference_pose[-1, :3, 3]
    half = 1.0
    for run, colour, below in ((off, WITHOUT, False), (on, WITH, True)):
        at = 1e3 * run.pose[-1, :3, 3]
        half = max(half, float(np.abs(at - goal).max()))
        if not run.status.ok or not any(run.scenario.motion.V):
            continue
        lag = 1e3 * float(run.lag_along_motion[-1])
        words = f"{abs(lag):.1f} mm {'behind' if lag < 0 else 'ahead'}"
        axes.annotate(
            words if abs(lag) > 5e-3 else "on the reference",
            (at[0], at[2]),
            xytext=(0, -9 if below else 9),
            textcoords="offset points",
            ha="center",
            va="top" if below else "bottom",
            color=colour,
        )
    axes.set(
        xlim=(goal[0] - 1.8 * half, goal[0] + 1.8 * half),
        ylim=(goal[2] - 1.8 * half, goal[2] + 1.8 * half),
        aspect="equal",
        title=f"the end, t = {on.t[-1]:g} s",
    )


def stability_chart(chart: StabilityChart) -> Figure:
    """Where over two parameters the loop is stable, how many roots are unstable elsewhere.

    Lines are the exact boundaries: solid where a pair of roots crosses, with its frequency in
    rad/s, dashed where a real root passes 0. The stable region is filled in `WITH`.
    """
    regions = chart.regions(1200, 800)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 4.8), layout="constrained")
        axes = figure.subplots()
        box = (chart.x[0], chart.x[-1], chart.y[0], chart.y[-1])
        shade = np.full((*regions.unstable.shape, 4), (*to_rgb(WITH), 0.28))
        unstable = regions.unstable > 0
        shade[unstable, :3] = to_rgb(WITHOUT)
        # Ever darker with every pair, never so dark that the words in it cannot be read.
        shade[unstable, 3] = 0.42 - 0.34 * 0.75 ** (regions.unstable[unstable] - 1)
        axes.imshow(shade, extent=box, origin="lower", aspect="auto", zorder=0)
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
        axes.set(xlim=box[:2], ylim=box[2:])
        axes.set_xlabel(_NAMES.get(chart.x_name, chart.x_name))
        axes.set_ylabel(_NAMES.get(chart.y_name, chart.y_name))
        axes.grid(False)
        figure.suptitle(_noticed(chart, regions), x=0.01, ha="left", fontsize=10)
    return figure


def to_svg(figure: Figure, title: str, prefix: str) -> str:
    """The figure as an SVG element to put into a page: text in the page's colour, no links.

    `title` is what a screen reader says; `prefix` keeps the ids of figures on one page apart.
    """
    buffer = io.StringIO()
    with mpl.rc_context(STYLE):
        figure.savefig(
            buffer,
            format="svg",
            transparent=True,
            metadata={"Date": None, "Creator": None, "Format": None, "Type": None},
        )
    svg = buffer.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\s(?:xmlns(?::\w+)?|version)="[^"]*"', "", svg)
    svg = svg.replace(INK, "currentColor").replace("xlink:href", "href")
    svg = re.sub(r'\bid="', f'id="{prefix}-', svg)
    svg = re.sub(r'(href="#|url\(#)', rf"\g<1>{prefix}-", svg)
    return svg.replace("<svg", f'<svg role="img" aria-label="{title}"', 1)


#: Axis labels for the parameters whose unit is known.
_NAMES = {
    "lam": "gain λ, s⁻¹",
    "tau": "latency τ, s",
    "tau_hat": "modelled latency τ̂, s",
    "T_i": "integral time Tᵢ, s",
    "h": "preview h, s",
}


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


def _phase(values: Any) -> Array:
    """Phase in degrees, unwound along the frequency axis."""
    return np.asarray(np.degrees(np.unwrap(np.angle(values))), float)


def _mark(axes: Axes, omega: float, low: float, high: float, colour: str) -> None:
    axes.plot([omega, omega], [low, high], color=colour, linewidth=2.4, solid_capstyle="butt")
