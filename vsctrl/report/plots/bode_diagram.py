"""Bode diagrams: gain and continuous phase over ω, with the margins of opened loops."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from vsctrl.arrays import Array
from vsctrl.report.plots.canvas import NOTEBOOK, Size, canvas, legend, say
from vsctrl.report.plots.curves import Curve, band, curve
from vsctrl.report.plots.margin_words import nearest_gain, nearest_phase, sentence, short, title
from vsctrl.report.plots.style import INK, SERIES, label
from vsctrl.report.plots.subject import Subject, subjects

NARROW = 5.0  #: inches of a figure of one column, below which marks have numbers only
DEEPEST = 80.0  #: dB below the highest gain that are shown of a notch or a roll-off


def bode(
    *systems: Any,
    omega: Any = None,
    dB: bool = True,
    names: Any = None,
    ax: Any = None,
    size: Size = None,
) -> Figure:
    """Gain and phase of H(jω), or H(e^{jωT}), of one or several systems over ω in rad/s.

    ``bode(system.open("y"))``; channels, opened loops, those of a sampled twin up to the Nyquist
    frequency, python-control's systems. The phase is continuous, whatever the delay: no turn of
    360° is lost. Of opened loops the margins are marked, with their numbers where there is one
    loop. omega: (low, high) or a list of frequencies, rad/s; without it the corners, delays and
    crossings choose. dB: decibels, else absolute. names: for the legend. ax: two axes of yours.
    size: (width, height), inches. Returns the figure, with `caption` and `alt`.
    Errors: `InputError` for what is no such system; `LimitError` for a band in which the delays
    turn the phase too often to be followed.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.bode(loop.open("S_meas"))
    >>> figure.alt
    'Bode diagram of L, opened at S_meas: gain and phase from 0.25 to 125 rad/s.'
    """
    drawn = subjects("bode", systems, names)
    low, high = band("bode", drawn, omega)
    curves = [curve("bode", each, low, high) for each in drawn]
    with canvas(ax, size, NOTEBOOK, 2, 1, sharex=True) as (figure, (top, bottom)):
        for i, (each, found) in enumerate(zip(drawn, curves, strict=True)):
            colour = SERIES[i % len(SERIES)]
            with np.errstate(divide="ignore"):
                gain = np.abs(found.values)
                gain = 20 * np.log10(gain) if dB else gain
            style: Any = {"color": colour, "label": each.name, "zorder": 3 - 0.1 * i}
            style["linestyle"] = "-" if i < len(SERIES) else "--"
            top.plot(found.omega, np.where(np.isfinite(gain), gain, np.nan), **style)
            bottom.plot(found.omega, found.phase, **style)
            if each.top < math.inf and each.top <= high * (1 + 1e-9):
                for axes in (top, bottom):
                    axes.axvline(each.top, color=colour, linewidth=0.8, linestyle=":")
        _scales(top, bottom, drawn, curves, dB)
        for each, found in zip(drawn, curves, strict=True):
            _gain_margin(top, each, found, dB, len(drawn) == 1)
            _phase_margin(bottom, each, found, len(drawn) == 1)
        legend(figure, top)
        heading = title(drawn[0]) if len(drawn) == 1 else ""
        listed = " and ".join(each.name for each in drawn)
        about = f"Bode diagram of {listed}: gain and phase from {low:.3g} to {high:.3g} rad/s."
        say(figure, top, heading, " ".join(filter(None, map(sentence, drawn))) or about, about)
    return figure


def _scales(top: Axes, bottom: Axes, drawn: list[Subject], curves: list[Curve], dB: bool) -> None:
    low = min(c.omega[0] for c in curves)
    high = max(c.omega[-1] for c in curves)
    for axes in (top, bottom):
        axes.set_xscale("log")
        axes.set_xlim(low, high)
        axes.grid(visible=True, which="minor", axis="x", linewidth=0.4)
    top.set_ylabel("gain, dB" if dB else "gain")
    bottom.set_ylabel("phase, °")
    bottom.set_xlabel("ω, rad/s")
    top.axhline(0 if dB else 1, color=INK, linewidth=0.8)
    ranges = [found for c in curves if (found := _decibels(c)) is not None]
    if ranges:
        lowest, highest = (
            f(column) for f, column in zip((min, max), zip(*ranges, strict=True), strict=True)
        )
        for m in (each.margins for each in drawn if each.margins):
            if near := nearest_gain(m):  # a margin is shown, however deep
                deep = 20 * math.log10(near[1]) + 0.2 * (highest - lowest)
                lowest = min(lowest, max(-deep, -300.0))
        room = max(0.06 * (highest - lowest), 2.0)
        limits = lowest - room, highest + room
        if dB:
            top.set_ylim(limits)
            top.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        else:
            top.set_yscale("log")
            top.set_ylim(10 ** (limits[0] / 20), 10 ** (limits[1] / 20))
    phases = np.concatenate([c.phase[np.isfinite(c.phase)] for c in curves])
    if len(phases):
        _degrees(bottom, phases)


def _decibels(found: Curve) -> tuple[float, float] | None:
    """The gains worth showing, without the top of a pole on the axis and without a notch's end."""
    size = np.abs(found.values)
    known = np.isfinite(size) & (size > 0)
    if not known.any():
        return None
    x, gain = np.log(found.omega[known]), 20 * np.log10(size[known])
    usual = np.interp(np.linspace(x[0], x[-1], 300), x, gain)
    # The points of a curve crowd round its poles; a pole on the axis is as high as it was sampled.
    high = min(float(gain.max()), float(np.quantile(usual, 0.97)) + 40)
    return max(float(gain.min()), high - DEEPEST, float(np.quantile(usual, 0.03)) - 40), high


def _degrees(axes: Axes, phases: Array) -> None:
    """Multiples of 45° or of 90°, a few of them."""
    low, high = float(phases.min()), float(phases.max())
    low, high = low - max(5.0, 0.04 * (high - low)), high + max(5.0, 0.04 * (high - low))
    if high - low < 60:
        low, high = (low + high) / 2 - 30, (low + high) / 2 + 30
    axes.set_ylim(low, high)
    steps = (15, 45, 90, 180, 360, 720, 1800, 3600)
    axes.yaxis.set_major_locator(
        MultipleLocator(next((n for n in steps if (high - low) / n < 7), 36000))
    )


def _inside(omega: float, found: Curve) -> bool:
    return bool(found.omega[0] <= omega <= found.omega[-1])


def _gain_margin(axes: Axes, subject: Subject, found: Curve, dB: bool, named: bool) -> None:
    """A bar from |L| to 1 where L is on the negative real axis, its number where it is alone."""
    near = nearest_gain(subject.margins) if subject.margins else None
    if near is None or not _inside(near[0], found):
        return
    omega, factor = near
    ends = [-20 * math.log10(factor), 0.0] if dB else [1 / factor, 1.0]
    axes.plot([omega, omega], ends, label="_gain margin", **_bar(named))
    if not named:
        return
    brief = _brief(axes)
    words = short(factor) if brief else f"gain margin {short(factor)} at {short(omega, ' rad/s')}"
    right = _place(axes, omega) < 0.55
    middle = sum(ends) / 2 if dB else math.sqrt(ends[0])
    # Beside the bar a falling L leaves room on the right, below the bar's end on the left.
    level = middle if right else min(ends)
    _words(axes, words, (omega, level), right, "center" if right else "top")


def _phase_margin(axes: Axes, subject: Subject, found: Curve, named: bool) -> None:
    """A bar from the phase to −180°, or that some turns on, where |L| = 1."""
    at = nearest_phase(subject.margins) if subject.margins else None
    if at is None or not _inside(at[0], found):
        return
    omega, margin = at[0], math.degrees(at[1])
    here = float(np.interp(math.log(omega), np.log(found.omega), found.phase))
    level = here - margin
    axes.plot([omega, omega], [level, here], label="_phase margin", **_bar(named))
    axes.axhline(level, color=INK, linewidth=0.8)
    if not named:
        return
    words = f"{short(margin)}°"
    words = words if _brief(axes) else f"phase margin {words} at {short(omega, ' rad/s')}"
    below = margin > -1e-9
    _words(axes, words, (omega, level), _place(axes, omega) < 0.45, "top" if below else "bottom")


def _bar(named: bool) -> Any:
    colour = SERIES[1] if named else INK
    return {"color": colour, "linewidth": 2.4, "solid_capstyle": "butt", "zorder": 4}


def _brief(axes: Axes) -> bool:
    figure = axes.get_figure(root=True)
    # A single column of axes has 0.775 of a figure's width.
    share = axes.get_position(original=True).width / 0.775
    return figure is not None and share * figure.get_figwidth() < NARROW


def _place(axes: Axes, omega: float) -> float:
    """How far to the right, from 0 to 1."""
    low, high = axes.get_xlim()
    return math.log(omega / low) / math.log(high / low)


def _words(axes: Axes, words: str, point: tuple[float, float], right: bool, va: str) -> None:
    shift = (6.0 if right else -6.0, {"center": 0.0, "top": -4.0, "bottom": 4.0}[va])
    align: Any = {"ha": "left" if right else "right", "va": va, "zorder": 5, "fontsize": 8.5}
    label(axes, words, point, shift, **align)
