"""Nyquist diagrams: L(jω) round −1, with the turns that exact roots ask for."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.frequency.followed import band_of
from vsctrl.report.plots.canvas import Size, canvas, legend, say
from vsctrl.report.plots.curves import TURNED, Curve, curve
from vsctrl.report.plots.encirclements import count
from vsctrl.report.plots.margin_words import nearest_gain, nearest_phase, sentence, short
from vsctrl.report.plots.style import GREY, INK, SERIES, label
from vsctrl.report.plots.subject import Subject, subjects

LARGEST, SMALLEST = 12.0, 1.35  #: half widths of the picture
POLE = 1e6  #: |L| that only a pole on the axis reaches, in half widths


class Locus(NamedTuple):
    """The curve up to the rim of the picture, the arcs that join it there, and what is left out."""

    curve: Complex
    arcs: list[Complex]
    poles: int  #: on the axis, as the arcs count them for ω ≥ 0
    beyond: float  #: the largest |L| that is out of the picture but no pole, 0 if none


def nyquist(
    *systems: Any,
    radius: float | None = None,
    names: Any = None,
    ax: Any = None,
    size: Size = None,
) -> Figure:
    """L(jω), or L(e^{jωT}), of one or several opened loops in the complex plane round −1.

    ``nyquist(system.open("y"))``; solid for ω > 0, dashed for ω < 0. Poles on the imaginary axis
    are passed on their right, which the dotted arcs at the rim stand for. Of one loop the circle
    of radius 1/Ms round −1 is drawn, and the title has Nyquist's sum Z = N + P by exact roots.
    radius: half the width of the picture, without it from the crossings. names: for the legend.
    ax: axes of yours. size: (width, height), inches. Returns the figure, with `caption` and `alt`.
    Errors: `InputError` for what is no such system; `LimitError` where delays turn too often.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.nyquist(loop.open("S_meas"))
    >>> figure.alt
    'Nyquist diagram of L, opened at S_meas round −1.'
    """
    drawn = subjects("nyquist", systems, names)
    curves = [_whole(each) for each in drawn]
    rim = _rim(drawn, curves, radius)
    with canvas(ax, size, (5.4, 5.4)) as (figure, (axes,)):
        turn = np.exp(1j * np.linspace(0, 2 * np.pi, 361))
        axes.plot(turn.real, turn.imag, color=GREY, linewidth=0.9, linestyle="--")
        loci = [_locus(found, rim) for found in curves]
        for i, (each, locus) in enumerate(zip(drawn, loci, strict=True)):
            _draw(axes, locus, each.name, SERIES[i % len(SERIES)], rim)
        axes.plot(-1, 0, marker="+", color=INK, markersize=10, markeredgewidth=1.6, zorder=5)
        if len(drawn) == 1:
            _marks(axes, drawn[0], turn, rim)
        edge = 1.06 * rim
        axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
        axes.set_xlabel("Re L")
        axes.set_ylabel("Im L")
        if poles := max(locus.poles for locus in loci):
            several = f"{poles} poles" if poles > 1 else "a pole"
            axes.plot(
                [],
                [],
                ":",
                color=SERIES[0],
                label=f"out of the picture, round {several} on the axis",
            )
        legend(figure, axes)
        title, words = _words(drawn, systems, loci)
        about = f"Nyquist diagram of {' and '.join(each.name for each in drawn)} round −1."
        say(figure, axes, title, words or about, about)
    return figure


def _whole(subject: Subject) -> Curve:
    """From where the subject is a plain power of ω up to where it no longer matters."""
    if subject.samples is not None:
        return curve(
            "nyquist", subject, float(subject.samples[0][0]), float(subject.samples[0][-1])
        )
    low, high = band_of(lambda s: subject.at(np.imag(s)), subject.rates, falls=True)
    if subject.top < math.inf:
        high = subject.top
    elif subject.delay_s:
        high = min(high, 0.999 * TURNED / subject.delay_s)
    return curve("nyquist", subject, min(low, 0.1 * high), high)


def _rim(drawn: list[Subject], curves: list[Curve], radius: float | None) -> float:
    """The radius that shows −1, the unit circle where L comes near it, and all crossings."""
    if radius is not None:
        from vsctrl.checks import positive

        return positive("nyquist: radius", radius)
    sizes = [np.abs(c.values[np.isfinite(c.values)]) for c in curves]
    largest = max(float(size.max(initial=0.0)) for size in sizes)
    if 1.12 * largest <= LARGEST / 2:
        return max(1.12 * largest, SMALLEST)
    crossings = [
        1 / f for each in drawn if each.margins for _, f in each.margins.phase_crossings if f > 0
    ]
    near = [x for x in crossings if x < LARGEST / 1.3]
    return min(max(1.3 * max(near, default=0.0), 2.4), LARGEST)


def _locus(found: Curve, rim: float) -> Locus:
    values = found.values.copy()
    size = np.abs(values)
    size[~np.isfinite(size)] = math.inf
    arcs: list[Complex] = []
    poles, beyond = 0, 0.0
    far = size > rim
    edges = np.flatnonzero(np.diff(np.concatenate([[0], far.astype(int), [0]])))
    for first, last in edges.reshape(-1, 2):
        out = size[first:last]
        if last < len(size) and first == 0 and (order := _order(found.omega, size)) > 0:
            # From ω = 0− to 0+ by half a turn clockwise for each pole, and what follows to the rim.
            lead = 180 * round((found.phase[0] + 90 * order) / 180)
            arcs.append(_arc(np.conj(values[last]), 2 * (found.phase[last] - lead), rim))
            poles += order
        elif first > 0 and last < len(size) and out.max() > POLE * rim:
            turn = found.phase[last] - found.phase[first - 1]
            arcs.append(_arc(values[first - 1], turn, rim))
            poles += max(1, round(abs(turn) / 180))
        else:
            beyond = max(beyond, float(out.max()))
            continue
        values[first:last] = np.nan
    return Locus(values, arcs, poles, beyond)


def _order(omega: Array, size: Array) -> int:
    """The order of the pole at 0, by the slope of |L|."""
    away = min(int(np.searchsorted(omega, 2 * omega[0])), len(omega) - 1)
    return -round(math.log(size[away] / size[0]) / math.log(omega[away] / omega[0]))


def _arc(start: complex, turn: float, rim: float) -> Complex:
    """From a place on the rim through an angle in degrees."""
    angles = np.angle(start) + np.radians(np.linspace(0.0, turn, max(int(abs(turn) / 3), 2)))
    return np.asarray(rim * np.exp(1j * angles))


def _draw(axes: Axes, locus: Locus, name: str, colour: str, rim: float) -> None:
    values = locus.curve
    axes.plot(values.real, values.imag, color=colour, label=name, zorder=3)
    axes.plot(values.real, -values.imag, color=colour, linewidth=0.9, linestyle=(0, (5, 2)))
    for arc in locus.arcs:
        for side in (arc, np.conj(arc[::-1])):
            axes.plot(side.real, side.imag, ":", color=colour, linewidth=1.3)
        middle = len(arc) // 2
        _arrow(axes, arc[middle - 1], arc[middle + 1], colour)
    shown = np.flatnonzero(np.isfinite(values) & (np.abs(values) < rim))
    if len(shown) < 3:
        return
    if np.ptp(values[shown].real) + np.ptp(values[shown].imag) < 1e-3 * rim:  # a static gain
        axes.plot(values[shown[0]].real, values[shown[0]].imag, "o", color=colour, markersize=6)
        return
    way = np.cumsum(np.abs(np.diff(values[shown], prepend=values[shown[0]])))
    k = int(np.searchsorted(way, 0.45 * min(float(way[-1]), 2 * rim)))
    k = min(max(k, 1), len(shown) - 1)
    if way[-1] > 1e-9 * rim and values[shown[k]] != values[shown[k - 1]]:
        _arrow(axes, values[shown[k - 1]], values[shown[k]], colour)


def _arrow(axes: Axes, start: complex, end: complex, colour: str) -> None:
    """An arrow's head from one point towards another."""
    head: Any = {"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0}
    way = (end - start) / abs(end - start) * 1e-3
    axes.annotate("", (end.real, end.imag), ((end - way).real, (end - way).imag), arrowprops=head)


def _marks(axes: Axes, subject: Subject, turn: Complex, rim: float) -> None:
    """The circle of 1/Ms, and where the margins are read."""
    m = subject.margins
    if m is None:
        return
    dot: Any = {"marker": "o", "color": SERIES[1], "markersize": 5, "zorder": 6, "linestyle": ""}
    if m.stable and m.modulus > 0:
        around = -1 + m.modulus * turn
        axes.plot(around.real, around.imag, color=SERIES[1], linewidth=1.0)
        words = f"1/Ms = {short(m.modulus)}"
        top = min(m.modulus, 0.93 * rim)
        label(
            axes,
            words,
            (-1, top),
            (0, 3),
            ha="center",
            va="bottom",
            color=INK,
            fontsize=8.5,
            zorder=5,
        )
    if (gain := nearest_gain(m)) is not None and 1 / gain[1] < rim:
        axes.plot(-1 / gain[1], 0, label="_gain margin", **dot)
    if (phase := nearest_phase(m)) is not None:
        angle = math.pi + phase[1]
        axes.plot(math.cos(angle), math.sin(angle), label="_phase margin", **dot)


def _words(drawn: list[Subject], systems: tuple[Any, ...], loci: list[Locus]) -> tuple[str, str]:
    """The title, of one loop, and the caption."""
    parts, title = [], ""
    for each, system, locus in zip(drawn, systems, loci, strict=True):
        found = None if each.trouble else count(system)
        if found is not None:
            title = found.words if len(drawn) == 1 else ""
            several = f"{each.name}: " if not each.margins else ""
            parts += [sentence(each), f"{several}{found.words[0].upper()}{found.words[1:]}."]
        else:
            parts.append(sentence(each))
        if locus.poles:
            parts.append(
                "The dotted arc stands for the way round the poles of L on the imaginary axis, "
                "which is infinitely far out."
            )
        if locus.beyond:
            parts.append(f"|L| reaches {short(locus.beyond)}, which is out of the picture.")
    return title, " ".join(dict.fromkeys(filter(None, parts)))
