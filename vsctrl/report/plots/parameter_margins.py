"""The margins of a loop as one of its parameters changes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.checks import quoted
from vsctrl.diagram.frequency.margins import Margins
from vsctrl.diagram.system import System
from vsctrl.errors import InputError
from vsctrl.report.plots.canvas import NOTEBOOK, Size, canvas, plain, say
from vsctrl.report.plots.letters import lettered
from vsctrl.report.plots.margin_words import short
from vsctrl.report.plots.root_maps import values_of
from vsctrl.report.plots.style import EXACT, INK, WITHOUT

STEPS = 61  #: values of a parameter where none are given
HIGHEST = 20.0  #: gain margin and Ms that are shown
PANELS = ("gain margin", "phase margin, °", "delay margin, s", "peak of S, Ms")


def margins(
    system: Any,
    signal: str,
    parameter: str,
    values: ArrayLike | None = None,
    *,
    ax: Any = None,
    size: Size = None,
) -> Figure:
    """Gain, phase and delay margin and Ms of the loop opened at a signal, over one parameter.

    ``margins(system, "y", "K", np.linspace(1, 8, 60))``, each of them exact. Where the closed loop
    is unstable it has no margins, and the strip is shaded. The dotted line is the system's own
    value. values: without them from a twentieth of the own value to five times it. ax: four axes
    of yours. size: (width, height), inches. Returns the figure, with `caption` and `alt`.
    Errors: `InputError` for an unknown signal or parameter and for values that are none.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.margins(loop, "S_meas", "lam", np.linspace(1, 5, 5))
    >>> figure.alt
    'Margins of the loop opened at S_meas over lam.'
    """
    if not isinstance(system, System):
        raise InputError(f"margins: {quoted(system)} is no system; give diagram.at(…).")
    grid = np.sort(values_of("margins", system, parameter, values, STEPS))
    found = [system.with_(**{parameter: float(v)}).open(signal).margins() for v in grid]
    stable = np.array([m.stable for m in found])
    columns = np.array([_row(m) for m in found])
    columns[~stable] = np.nan
    narrow = size is not None and np.size(size) == 2 and size[0] < 5
    shape = (4, 1) if narrow else (2, 2)
    with canvas(ax, size, (NOTEBOOK[0], 5.0), *shape, sharex=True) as (figure, panels):
        for axes, column, name in zip(panels, columns.T, PANELS, strict=True):
            axes.plot(grid, np.where(np.isfinite(column), column, np.nan), color=EXACT)
            axes.axvline(system.values[parameter], color=INK, linewidth=0.9, linestyle=":")
            axes.set_title(name)
            axes.set_xlim(grid[0], grid[-1])
            for first, last in _unstable(grid, stable):
                axes.axvspan(first, last, color=WITHOUT, alpha=0.18, linewidth=0)
            top = float(np.nanmax(column[np.isfinite(column)], initial=0.0))
            low = 1.0 if name in (PANELS[0], PANELS[3]) else 0.0
            capped = min(top, HIGHEST) if low else top
            axes.set_ylim(low, low + 1.08 * (capped - low) if capped > low else low + 1)
        for axes in panels[-shape[1] :]:
            axes.set_xlabel(lettered(parameter))
        words = _words(grid, stable, plain(parameter), plain(signal))
        about = f"Margins of the loop opened at {plain(signal)} over {plain(parameter)}."
        say(figure, panels[0], PANELS[0], words, about)
    return figure


def _row(m: Margins) -> tuple[float, float, float, float]:
    return m.gain, math.degrees(m.phase), m.delay, m.peak_sensitivity


def _unstable(grid: Array, stable: np.ndarray[Any, Any]) -> list[tuple[float, float]]:
    """Strips of unstable values, up to halfway to the next stable one."""
    middle = (grid[1:] + grid[:-1]) / 2
    ends = np.concatenate([grid[:1], middle, grid[-1:]])
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (~stable).astype(int), [0]])))
    return [(float(ends[a]), float(ends[b])) for a, b in edges.reshape(-1, 2)]


def _words(grid: Array, stable: np.ndarray[Any, Any], name: str, signal: str) -> str:
    here = f"of the loop opened at {signal}, {name} from {short(grid[0])} to {short(grid[-1])}"
    if stable.all():
        return f"Margins {here}: stable throughout."
    if not stable.any():
        return f"Margins {here}: stable nowhere."
    runs = np.flatnonzero(np.diff(np.concatenate([[0], stable.astype(int), [0]]))).reshape(-1, 2)
    parts = [f"{short(grid[a])} to {short(grid[b - 1])}" for a, b in runs]
    return f"Margins {here}: stable at the values {', '.join(parts)}; shaded, unstable."
