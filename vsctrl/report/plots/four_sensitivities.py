"""The gang of four: what a loop makes of disturbances, noise and errors of its model."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from vsctrl.arrays import Array, Complex
from vsctrl.checks import quoted
from vsctrl.diagram.channel import Channel
from vsctrl.diagram.system import System
from vsctrl.errors import InputError
from vsctrl.report.plots.canvas import Size, canvas, say
from vsctrl.report.plots.curves import Curve, band, curve
from vsctrl.report.plots.margin_words import short
from vsctrl.report.plots.style import INK, SERIES
from vsctrl.report.plots.subject import Subject, subjects

NAMES = {
    "S": "S = 1/(1 + L)",
    "PS": "PS: load to output",
    "CS": "CS: noise to control",
    "T": "T = L/(1 + L)",
}
DEEPEST = 1e-4  #: of its highest value, that is shown of a panel


def gang_of_four(
    loop: Any,
    second: Any,
    third: Any = None,
    *,
    omega: Any = None,
    ax: Any = None,
    size: Size = None,
) -> Figure:
    """|S|, |T|, |PS| and |CS| of a loop over ω, in rad/s.

    ``gang_of_four(system, "u", "y")``: the plant's input and output signals in a closed loop; then
    P is from u to y with u broken, C from y to −u with y broken, S = 1/(1 + L), T = L/(1 + L) and
    CS = C/(1 + L) with L broken at y, PS = P/(1 + L) with L broken at u, which is the same L where
    the plant has no other way back. ``gang_of_four(P, C)``: a plant and its controller, channels or
    systems of python-control, L = P C. omega: (low, high), rad/s. ax: four axes of yours, S, PS,
    CS, T. size: (width, height), inches. Returns the figure, with `caption` and `alt`.
    Errors: `InputError` for other things; `LimitError` as of `bode`.
    Source: Åström & Murray, Feedback Systems, section 12.1.

    >>> from vsctrl.symbols import s
    >>> C, P = vs.Block("C", 2, "e -> u"), vs.Block("P", 1 / (s + 1), "u -> y")
    >>> system = vs.Diagram([vs.Sum("e = r - y"), C, P]).at()
    >>> figure = vs.plots.gang_of_four(system, "u", "y")
    >>> figure.alt
    'Gains of the sensitivity S, of load to output, of noise to control and of T.'
    """
    L, four = _of_system(loop, second, third) if isinstance(loop, System) else _of_two(loop, second)
    low, high = band("gang_of_four", [L], omega)
    high = max(high, 3 * low)
    curves = {
        name: curve("gang_of_four", replace(L, name=name, at=at, margins=None), low, high)
        for name, at in four.items()
    }
    usual = (7.2, 5.0)
    narrow = size is not None and np.size(size) == 2 and size[0] < 5
    rows, columns = (4, 1) if narrow else (2, 2)
    with canvas(ax, size, usual, rows, columns, sharex=True) as (figure, panels):
        peaks = []
        for axes, (name, found) in zip(panels, curves.items(), strict=True):
            peaks.append(_panel(axes, name, found))
            axes.set_xlim(low, high)
        for axes in panels[-columns:]:
            axes.set_xlabel("ω, rad/s")
        about = "Gains of the sensitivity S, of load to output, of noise to control and of T."
        words = [f"|{n}| is at most {short(p)} at {short(w, ' rad/s')}" for n, w, p in peaks if p]
        say(figure, panels[0], NAMES["S"], "; ".join(words) + "." if words else about, about)
    return figure


def _panel(axes: Axes, name: str, found: Curve) -> tuple[str, float, float]:
    """One gain, and where it is largest."""
    gain = np.abs(found.values)
    known = np.isfinite(gain)
    axes.loglog(found.omega[known], gain[known], color=SERIES[0])
    axes.set_title(NAMES[name])
    axes.set_ylabel(f"|{name}|")
    if not known.any() or not gain[known].max() > 0:
        return name, 0.0, 0.0
    k = int(np.flatnonzero(known)[gain[known].argmax()])
    top, least = float(gain[k]), float(gain[known & (gain > 0)].min())
    axes.set_ylim(min(max(least, DEEPEST * top) / 1.5, 0.12 * top), 2.5 * top)
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.axhline(1, color=INK, linewidth=0.8)
    if 2 < k < len(gain) - 3:
        axes.plot(found.omega[k], top, "o", color=SERIES[1], markersize=5)
        place: Any = {"ha": "center", "va": "bottom", "fontsize": 8.5}
        x = math.log(found.omega[k] / found.omega[0]) / math.log(found.omega[-1] / found.omega[0])
        place["ha"] = "right" if x > 0.75 else "left" if x < 0.25 else "center"
        axes.annotate(
            f"{short(top)}", (found.omega[k], top), (0, 4), textcoords="offset points", **place
        )
    return name, float(found.omega[k]), top


Values = Callable[[Array], Complex]


def _four(L: Values, P: Values, C: Values, at_input: Values) -> dict[str, Values]:
    """S, PS, CS and T; where L is infinite S is 0 and T is 1."""

    def over(top: Values, loop: Values) -> Values:
        def quotient(w: Array) -> Complex:
            with np.errstate(all="ignore"):
                above, below = top(w), loop(w)
                value = above / (1 + below)
            # A pole of L on the axis: the limit is that from beside it.
            lost = ~np.isfinite(value) & (w > 0)
            if lost.any():
                near = w[lost] * (1 + 1e-7)
                value[lost] = top(near) / (1 + loop(near))
            return np.asarray(value)

        return quotient

    one: Values = lambda w: np.ones(len(w), complex)  # noqa: E731
    return {"S": over(one, L), "PS": over(P, at_input), "CS": over(C, L), "T": over(L, L)}


def _of_system(system: System, u: Any, y: Any) -> tuple[Subject, dict[str, Values]]:
    for name in (u, y):
        if not isinstance(name, str):
            raise InputError(
                f"gang_of_four: {quoted(name)} is no signal; name the plant's input and output, "
                "gang_of_four(system, 'u', 'y')."
            )
    at_y, at_u = system.open(y), system.open(u)
    P = Channel(at_u.system, at_u.source, y)
    C = Channel(at_y.system, at_y.source, u, sign=-1)
    (L,) = subjects("gang_of_four", (at_y,))
    values: Any = [lambda w, H=H: H(1j * w) for H in (at_y, P, C, at_u)]
    return L, _four(*values)


def _of_two(plant: Any, controller: Any) -> tuple[Subject, dict[str, Values]]:
    P, C = subjects("gang_of_four", (plant, controller))
    if P.samples is not None or C.samples is not None:
        raise InputError(
            "gang_of_four: a frequency response is known at its samples only; give channels, "
            "transfer functions or state spaces."
        )

    def L(w: Array) -> Complex:
        with np.errstate(all="ignore"):
            return np.asarray(P.at(w) * C.at(w))

    both = Subject(
        "L",
        L,
        np.concatenate([P.rates, C.rates]),
        P.delay_s + C.delay_s,
        min(P.top, C.top),
    )
    return both, _four(L, P.at, C.at, L)
