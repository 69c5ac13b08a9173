"""Nichols charts: gain over continuous phase, with the lines of constant |T|."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from vsctrl.report.plots.canvas import Size, canvas, legend, say
from vsctrl.report.plots.curves import band, curve
from vsctrl.report.plots.margin_words import nearest_gain, nearest_phase, sentence, title
from vsctrl.report.plots.style import GREY, INK, SERIES, label
from vsctrl.report.plots.subject import subjects

LEVELS = (-20.0, -12.0, -6.0, -3.0, -1.0, 0.5, 1.0, 3.0, 6.0, 12.0)  #: |T|, dB
GAINS = (-40.0, 40.0)  #: dB
TURNS = 3  #: that are shown at most


def nichols(
    *systems: Any, omega: Any = None, names: Any = None, ax: Any = None, size: Size = None
) -> Figure:
    """Gain (dB) over continuous phase (°) of one or several opened loops L.

    ``nichols(system.open("y"))``; thin lines are those of constant |L/(1 + L)|, in dB, + is −1.
    omega: (low, high), rad/s. names: for the legend. ax: axes of yours. size: (width, height),
    inches. Returns the figure, with `caption` and `alt`.
    Errors: `InputError` and `LimitError` as of `bode`.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.nichols(loop.open("S_meas"))
    >>> figure.alt
    'Nichols chart of L, opened at S_meas, with lines of |T|.'
    """
    drawn = subjects("nichols", systems, names)
    low, high = band("nichols", drawn, omega)
    with canvas(ax, size, (6.4, 5.0)) as (figure, (axes,)):
        lowest, highest = math.inf, -math.inf
        for i, each in enumerate(drawn):
            found = curve("nichols", each, low, high)
            with np.errstate(divide="ignore"):
                gain = 20 * np.log10(np.abs(found.values))
            axes.plot(found.phase, gain, color=SERIES[i % len(SERIES)], label=each.name, zorder=3)
            inside = np.isfinite(found.phase) & (gain > GAINS[0]) & (gain < GAINS[1])
            if inside.any():
                lowest = min(lowest, float(found.phase[inside].min()))
                highest = max(highest, float(found.phase[inside].max()))
            _marks(axes, each.margins, found, SERIES[1] if len(drawn) == 1 else INK)
        if lowest > highest:
            lowest, highest = -180.0, -90.0
        lowest = max(math.floor((min(lowest, -180.0) - 20) / 90) * 90, highest - 360.0 * TURNS)
        highest = math.ceil((max(highest, -90.0) + 20) / 90) * 90
        _closed_loop(axes, lowest, highest)
        axes.set(xlim=(lowest, highest), ylim=GAINS)
        axes.xaxis.set_major_locator(MultipleLocator(45 if highest - lowest < 300 else 180))
        axes.axhline(0, color=INK, linewidth=0.8)
        axes.set_xlabel("phase of L, °")
        axes.set_ylabel("gain of L, dB")
        legend(figure, axes)
        about = f"Nichols chart of {' and '.join(each.name for each in drawn)}, with lines of |T|."
        heading = title(drawn[0]) if len(drawn) == 1 else ""
        say(figure, axes, heading, " ".join(filter(None, map(sentence, drawn))) or about, about)
    return figure


def _closed_loop(axes: Axes, lowest: float, highest: float) -> None:
    """Lines of constant |T| round each place where L is −1."""
    first, last = math.ceil((lowest + 180) / 360) - 1, math.floor((highest + 180) / 360) + 1
    turn = np.exp(1j * np.linspace(-math.pi, math.pi, 721)[1:-1])
    for level in LEVELS:
        T = 10 ** (level / 20) * turn
        L = T / (1 - T)
        phase, gain = np.degrees(np.angle(L)), 20 * np.log10(np.abs(L))
        phase = np.where(phase > 0, phase - 360, phase)  # round −180°
        cut = np.flatnonzero(np.abs(np.diff(phase)) > 180) + 1
        phase, gain = np.insert(phase, cut, np.nan), np.insert(gain, cut, np.nan)
        for k in range(first, last + 1):
            axes.plot(phase + 360 * k, gain, color=GREY, linewidth=0.6, zorder=1)
        at = int(np.nanargmin(np.abs(phase + (330 if level < 0 else 180)) + 0.01 * np.abs(gain)))
        for k in range(first, last + 1):
            x, y = float(phase[at]) + 360 * k, float(gain[at])
            if lowest < x < highest and GAINS[0] < y < GAINS[1]:
                words = f"{level:+g} dB".replace("-", "−")
                label(axes, words, (x, y), (0, 1), fontsize=6.5, color=INK, ha="center", zorder=2)
    for k in range(first, last + 1):
        axes.plot(360 * k - 180, 0, "+", color=INK, markersize=10, markeredgewidth=1.6, zorder=5)


def _marks(axes: Axes, margins: Any, found: Any, colour: str) -> None:
    """Where the gain and phase margins are read."""
    if margins is None:
        return
    dot: Any = {"marker": "o", "color": colour, "markersize": 5, "zorder": 6, "linestyle": ""}
    at = np.log(found.omega)
    for kind, near in (("gain", nearest_gain(margins)), ("phase", nearest_phase(margins))):
        if near is None or not found.omega[0] <= near[0] <= found.omega[-1]:
            continue
        phase = float(np.interp(math.log(near[0]), at, found.phase))
        gain = -20 * math.log10(near[1]) if kind == "gain" else 0.0
        axes.plot(phase, gain, label=f"_{kind} margin", **dot)
