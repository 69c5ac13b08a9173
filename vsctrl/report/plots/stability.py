"""The opened loop in frequency, round −1, and its roots as the gain grows."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vsctrl.report.plots.style import (
    EXACT,
    GREY,
    INK,
    PADE,
    WITH,
    WITHOUT,
    drawing,
    label,
    phase,
    takes,
)
from vsctrl.study.plot_data import Frequency, Locus
from vsctrl.study.stability import Stability


@takes(Frequency, Stability)
def bode_against_pade(data: Frequency, stability: Stability) -> Figure:
    """Magnitude and phase of the opened loop, exact delay against Padé, margins marked.

    >>> from vsctrl.study.plot_data import curves
    >>> stability = vs.study.examine(vs.paper.sliding()).stability
    >>> data = curves(stability)
    >>> len(vs.plots.bode_against_pade(data.frequency, stability).axes)
    2
    """
    with drawing(7.2, 5.0) as figure:
        top, bottom = figure.subplots(2, 1, sharex=True)
        margins = stability.margins
        top.semilogx(data.omega, 20 * np.log10(np.abs(data.exact)), color=EXACT)
        top.axhline(0, color=INK, linewidth=0.8)
        top.set_ylabel("|L(jω)|, dB")
        for order, values in data.pade.items():
            bottom.semilogx(data.omega, phase(values), color=PADE[order], label=f"Padé {order}")
        bottom.semilogx(data.omega, data.phase, color=EXACT, label="exact delay")
        bottom.axhline(-180, color=INK, linewidth=0.8)
        bottom.set_ylabel("arg L(jω), °")
        bottom.set_xlabel("ω, rad/s")
        low = max(float(np.nan_to_num(data.phase, nan=-720.0).min()), -720.0)
        bottom.set_ylim(low - 20, -60)
        bottom.set_yticks(np.arange(-90, low - 20, -90)[::-1])
        if margins.gain_crossings:
            omega, margin = margins.gain_crossings[0]
            _mark(bottom, omega, -180, math.degrees(margin) - 180, WITH)
            words = f"phase margin {math.degrees(margin):.1f}°"
            label(bottom, words, (omega, -180), (0, -4), ha="center", va="top")
        if margins.phase_crossings:
            omega, factor = margins.phase_crossings[0]
            _mark(top, omega, -20 * math.log10(factor), 0, WITHOUT)
            middle = -10 * math.log10(factor)
            label(top, f"gain margin ×{factor:.2f}", (omega, middle), (6, 0), va="center")
        bottom.legend(loc="lower left")
    return figure


@takes(Frequency, Stability)
def nyquist_against_pade(data: Frequency, stability: Stability) -> Figure:
    """L(jω) in the plane round −1, exact delay against Padé, with the circle of 1/Ms.

    >>> from vsctrl.study.plot_data import curves
    >>> stability = vs.study.examine(vs.paper.sliding()).stability
    >>> data = curves(stability)
    >>> len(vs.plots.nyquist_against_pade(data.frequency, stability).axes)
    1
    """
    with drawing(4.9, 4.4) as figure:
        axes = figure.subplots()
        turn = np.exp(1j * np.linspace(0, 2 * np.pi, 361))
        axes.plot(turn.real, turn.imag, color=GREY, linewidth=0.9, linestyle="--")
        distance = stability.margins.modulus
        around = -1 + distance * turn
        axes.plot(around.real, around.imag, color=WITHOUT, linewidth=1.0)
        axes.plot(-1, 0, marker="+", color=INK, markersize=10, markeredgewidth=1.6)
        for order, values in data.pade.items():
            axes.plot(values.real, values.imag, color=PADE[order], label=f"Padé {order}")
        axes.plot(data.exact.real, data.exact.imag, color=EXACT, label="exact delay")
        words = f"1/Ms = {distance:.3f}"
        label(axes, words, (-1, distance), (0, 4), ha="center", color=WITHOUT)
        axes.set(xlim=(-2.2, 1.2), ylim=(-2.2, 1.2), aspect="equal")
        axes.set_xlabel("Re L(jω)")
        axes.set_ylabel("Im L(jω)")
        axes.legend(loc="lower right")
    return figure


@takes(Locus, Stability)
def locus_against_pade(data: Locus, stability: Stability) -> Figure:
    """The rightmost characteristic roots as λ grows, exact delay against Padé.

    >>> from vsctrl.study.plot_data import curves
    >>> stability = vs.study.examine(vs.paper.sliding()).stability
    >>> data = curves(stability)
    >>> len(vs.plots.locus_against_pade(data.locus, stability).axes)
    1
    """
    with drawing(4.9, 4.4) as figure:
        axes = figure.subplots()
        for branch in data.pade.T:
            axes.plot(branch.real, branch.imag, ".", color=PADE[4], markersize=2.2)
        axes.plot(data.exact.real, data.exact.imag, ".", color=EXACT, markersize=2.6)
        axes.plot(data.here.real, data.here.imag, "x", color=WITHOUT, markersize=7)
        tau = stability.scenario.vision.latency
        axes.axvline(0, color=INK, linewidth=0.8)
        axes.set(xlim=(-4.5 / tau, 2.4 / tau), ylim=(-9.5 / tau, 9.5 / tau))
        axes.set_xlabel("Re s, rad/s")
        axes.set_ylabel("Im s, rad/s")
        for name, marker, colour in (
            ("exact delay", ".", EXACT),
            (f"Padé {data.pade_order}", ".", PADE[4]),
            (f"λ = {stability.scenario.law.lam:g} s⁻¹", "x", WITHOUT),
        ):
            axes.plot([], [], marker, color=colour, label=name)
        axes.legend(loc="upper right")
    return figure


def _mark(axes: Axes, omega: float, low: float, high: float, colour: str) -> None:
    axes.plot([omega, omega], [low, high], color=colour, linewidth=2.4, solid_capstyle="butt")
