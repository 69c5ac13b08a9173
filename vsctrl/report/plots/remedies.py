"""Remedies for dead time drawn side by side: what error each leaves, and what gain it allows."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vsctrl.report.plots.style import EXACT, GREY, INK, WITH, WITHOUT, drawing, label, takes
from vsctrl.study.compensation.results import Remedies, Treated
from vsctrl.study.experiments.experiment import Measured

ROW = 0.36  #: inches a remedy
NAME = 34  #: letters in a line of a name
ROOM = 1.12  #: of the widest value, so that marks do not touch the frame
LEGEND = ("true error", "error that the law sees", "gain limit", "gain of the scenario")
ENDLESS = 1.5  #: longest axis of gains, in limits of the sampled loop


@takes(Remedies)
def remedies(comparison: Remedies) -> Figure:
    """Error on a ramp (mm) and gain limit (s⁻¹) of each remedy: simulation over theory.

    Bars are closed forms, circles six degrees of freedom. A limit beyond the axis ends in an arrow.

    >>> found = vs.study.compare_remedies(vs.paper.sliding())
    >>> figure = vs.plots.remedies(found)
    >>> figure.alt
    'Steady error and gain limit of 12 remedies for dead time.'
    """
    rows = comparison.rows[::-1]  # the first one is drawn on top
    y = np.arange(len(rows))
    with drawing(9.4, 1.5 + ROW * len(rows)) as figure:
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        _errors(left, rows, y)
        _limits(right, rows, y, comparison.scenario.law.lam)
        names = [textwrap.fill(row.name.replace(" = ", "\u00a0=\u00a0"), NAME) for row in rows]
        left.set_yticks(y, names, fontsize=8)
        left.set_ylim(-0.7, len(rows) - 0.3)
        speed = f"{1e3 * comparison.speed:.3g} mm/s"
        left.set_title(f"error behind (−) or ahead (+) of a ramp of {speed}")
        left.set_xlabel("steady error, mm")
        right.set_title("gain limit")
        right.set_xlabel("λ, s⁻¹")
        for axes in (left, right):
            axes.grid(visible=False, axis="y")
            axes.tick_params(axis="y", length=0)
        handles = [h for axes in (left, right) for h in axes.get_legend_handles_labels()[0]]
        handles.sort(key=lambda handle: LEGEND.index(str(handle.get_label()).split(",")[0]))
        texts = [str(handle.get_label()) for handle in handles]
        figure.legend(handles, texts, loc="outside lower center", ncols=3)
        figure.alt = f"Steady error and gain limit of {len(rows)} remedies for dead time."
    return figure


def _errors(axes: Axes, rows: tuple[Treated, ...], y: Any) -> None:
    """True and seen errors, in mm; a remedy that is unstable has a word instead."""
    parts = (
        ("true error", [row.error for row in rows], EXACT, 0.17),
        ("error that the law sees", [row.seen for row in rows], WITHOUT, -0.17),
    )
    for name, errors, colour, aside in parts:
        bars = [i for i, error in enumerate(errors) if error is not None]
        some = [error for error in errors if error is not None]
        theory = [1e3 * _real(error.predicted) for error in some]
        axes.barh(
            y[bars] + aside, theory, 0.3, color=colour, alpha=0.35, label=f"{name}, closed form"
        )
        simulated = [1e3 * _real(error.simulated) for error in some]
        axes.plot(
            simulated, y[bars] + aside, "o", color=colour, mfc="none", ms=4.5,
            label=f"{name}, 6-DOF",
        )  # fmt: skip
    axes.axvline(0, color=INK, linewidth=0.8)
    low, high = axes.get_xlim()
    axes.set_xlim(low * ROOM, high * ROOM)
    for i, row in enumerate(rows):
        if row.error is None:
            words = "unstable at this gain"
            label(axes, words, (0, y[i]), (5, 0), va="center", fontsize=8, color=GREY)


def _limits(axes: Axes, rows: tuple[Treated, ...], y: Any, lam: float) -> None:
    """Sampled limits as bars, simulated ones as circles, those of continuous time as lines."""
    limits: list[Measured] = [row.limit for row in rows]
    sampled = [_real(limit.exact) for limit in limits]
    axes.barh(y, sampled, 0.5, color=WITH, alpha=0.35, label="gain limit, sampled")
    simulated = [_real(limit.simulated) for limit in limits]
    if not all(map(math.isnan, simulated)):
        axes.plot(simulated, y, "o", color=WITH, mfc="none", ms=5, label="gain limit, 6-DOF")
    most = ENDLESS * max([lam, *(value for value in sampled if math.isfinite(value))])
    name = "gain limit, continuous"
    for i, limit in enumerate(limits):
        value = _real(limit.predicted)
        if value <= most:
            axes.plot([value] * 2, [y[i] - 0.3, y[i] + 0.3], color=INK, lw=1.4, label=name)
        elif value > most:
            words = f"{'∞' if math.isinf(value) else f'{value:.3g}'} →"
            place: Any = {"ha": "right", "va": "center", "fontsize": 8, "color": INK}
            label(axes, words, (most, y[i]), (-2, 0), **place)
            continue
        name = "_"
    axes.axvline(lam, color=GREY, ls="--", lw=1.2, label=f"gain of the scenario, {lam:g} s⁻¹")
    axes.set_xlim(0, most)


def _real(value: complex | float | None) -> float:
    """A number to draw, which none is not."""
    return math.nan if value is None else float(value.real)
