"""Characteristic roots in the plane: those of a system, and their loci as a parameter changes."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment

from vsctrl.arrays import Array, Complex
from vsctrl.checks import quoted, reals
from vsctrl.diagram.channel import Channel
from vsctrl.diagram.roots.locus import RootLocus
from vsctrl.diagram.sampled.channel import SampledChannel
from vsctrl.diagram.sampled.system import SampledSystem
from vsctrl.diagram.system import System
from vsctrl.errors import InputError, nearest
from vsctrl.report.plots.canvas import Size, canvas, legend, named, plain, say
from vsctrl.report.plots.margin_words import roots as so_many
from vsctrl.report.plots.margin_words import short
from vsctrl.report.plots.style import EXACT, GREY, INK, SERIES, WITHOUT

DAMPING = (0.2, 0.4, 0.6, 0.8)  #: ratios ζ that rays are drawn for
SHOWN = 4  #: roots of the system itself that a locus is cut to
STEPS = 81  #: values of a parameter where none are given
MARKS = "xo+sD^"


def pole_map(
    *systems: Any, n: int = 12, names: Any = None, ax: Any = None, size: Size = None
) -> Figure:
    """The n rightmost roots of systems or channels in s (rad/s), or those of twins in z.

    ``pole_map(system, other)``: systems of a diagram, channels, sampled twins, python-control's
    systems; those in z with the unit circle, of the n largest. Rays are of equal damping ζ. ax:
    axes of yours. size: (width, height), inches. Returns the figure, with `caption` and `alt`.
    Errors: `InputError` for other things, and for s and z in one picture.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.pole_map(loop)
    >>> figure.alt
    'Roots in s of system.'
    """
    if not systems:
        raise InputError("pole_map: there is nothing to draw; give a system, diagram.at(…).")
    found = [_roots(each, n) for each in systems]
    if len({discrete for _, discrete, _ in found}) > 1:
        raise InputError(
            "pole_map: roots in s and in z do not fit into one picture; draw each by itself."
        )
    discrete = found[0][1]
    labels = named("pole_map", [name for _, _, name in found], names)
    with canvas(ax, size, (5.4, 5.0)) as (figure, (axes,)):
        words = []
        for i, ((poles, _, _), name) in enumerate(zip(found, labels, strict=True)):
            style: Any = {"color": SERIES[i % len(SERIES)], "markersize": 7, "markeredgewidth": 1.6}
            style |= {"mfc": "none", "linestyle": "", "label": name, "zorder": 4}
            axes.plot(poles.real, poles.imag, MARKS[i % len(MARKS)], **style)
            words.append(_said(poles, discrete, name))
        every = np.concatenate([poles for poles, _, _ in found])
        _circle(axes, every) if discrete else _half_plane(axes, every)
        legend(figure, axes)
        about = f"{'Poles in z' if discrete else 'Roots in s'} of {' and '.join(labels)}."
        say(figure, axes, words[0] if len(words) == 1 else "", " ".join(words), about)
    return figure


def root_locus(
    system: Any,
    parameter: Any,
    values: ArrayLike | None = None,
    *,
    n: int = 6,
    ax: Any = None,
    size: Size = None,
) -> Figure:
    """The n rightmost characteristic roots (rad/s) of a system as one of its parameters changes.

    ``root_locus(system, "lam", [1, …, 20])``, delays exact. Arrows point the way the roots move as
    the parameter grows, ○ is at its first value, × at the system's own. values: of the parameter,
    without them from a twentieth of the system's own to five times it. Rays are of equal damping ζ.
    ax: axes of yours. size: (width, height), inches. Returns the figure, with `caption` and `alt`.
    Errors: `InputError` for an unknown parameter and for values that are none.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.root_locus(loop, "lam", np.linspace(1, 20, 5))
    >>> figure.alt
    'Root locus over lam from 1 to 20.'
    """
    if not isinstance(system, System):
        raise InputError(f"root_locus: {quoted(system)} is no system; give diagram.at(…).")
    grid = values_of("root_locus", system, parameter, values, STEPS)
    return locus_figure(system.root_locus(parameter, grid, n), ax=ax, size=size)


def locus_figure(locus: RootLocus, *, ax: Any = None, size: Size = None) -> Figure:
    """A root locus that is worked out, as `root_locus` draws it.

    ax: axes of yours. size: (width, height), inches. Returns the figure, with `caption` and `alt`.
    """
    rows, here = locus.roots, locus.here
    parameter, grid = locus.parameter, locus.values
    branches = _branches(rows)
    with canvas(ax, size, (5.6, 5.2)) as (figure, (axes,)):
        axes.plot([], [], color=EXACT, label=f"as {plain(parameter)} grows")
        for branch in branches.T:
            for side in (branch, np.conj(branch)):
                axes.plot(side.real, side.imag, color=EXACT, linewidth=1.4, zorder=3)
                _direction(axes, side)
        first = rows[0][np.isfinite(rows[0])]
        dots: Any = {"linestyle": "", "zorder": 4, "mfc": "none", "color": INK}
        start = f"{plain(parameter)} = {short(float(grid[0]))}"
        axes.plot(first.real, first.imag, "o", markersize=5, label=start, **dots)
        dots |= {"color": WITHOUT, "markersize": 8, "markeredgewidth": 1.8}
        own = f"{plain(parameter)} = {short(locus.own)}"
        axes.plot(here.real, here.imag, "x", label=own, **dots)
        # The picture is of the roots that decide; those farther left are cut off.
        shown = here[:SHOWN] if len(here) else rows[-1][:SHOWN]
        right = rows[np.isfinite(rows) & (rows.real > 0)]
        _half_plane(axes, np.concatenate([1.3 * shown[np.isfinite(shown)], right]))
        legend(figure, axes)
        words = _crossing(rows, grid, plain(parameter))
        about = f"Root locus over {plain(parameter)} from {short(grid[0])} to {short(grid[-1])}."
        say(figure, axes, words, f"{about} {words}", about)
    return figure


def values_of(what: str, system: System, parameter: Any, values: Any, number: int) -> Array:
    """The values of a parameter, by default around the system's own.

    Errors: `InputError` for an unknown parameter, and for values that are not finite and real.
    """
    if not isinstance(parameter, str) or parameter not in system.values:
        known = ", ".join(system.values) or "none"
        hint = nearest(parameter, system.values) if isinstance(parameter, str) else ""
        raise InputError(
            f"{what}: there is no parameter {quoted(parameter)}{hint}; the diagram has {known}."
        )
    if values is None:
        own = system.values[parameter]
        if not own:
            raise InputError(
                f"{what}: {parameter} = 0 tells no range; give values, like np.linspace(0, 2, 100)."
            )
        return own * np.geomspace(0.05, 5, number)
    found = reals(values)
    if found is None or found.ndim != 1 or len(found) < 2:
        raise InputError(
            f"{what}: values = {quoted(values)} is not usable; give two finite numbers or more."
        )
    return found


def _roots(system: Any, n: int) -> tuple[Complex, bool, str]:
    if isinstance(system, System):
        return system.poles(n), False, "system"
    if isinstance(system, Channel):
        return system.poles(n), False, plain(system.label)
    if isinstance(system, SampledSystem | SampledChannel):
        name = "" if isinstance(system, SampledSystem) else f"{system.source} to {system.target}, "
        return system.poles(n), True, plain(f"{name}sampled")
    control = sys.modules.get("control")
    if control and isinstance(system, control.TransferFunction | control.StateSpace):
        poles = np.atleast_1d(system.poles()).astype(complex)
        return poles, bool(system.isdtime(strict=True)), plain(system.name)
    raise InputError(
        f"pole_map: {quoted(system)} has no roots to draw; give a system, diagram.at(…), a channel "
        "of one, a sampled twin, or python-control's transfer function or state space."
    )


def _said(poles: Complex, discrete: bool, name: str) -> str:
    if not len(poles):
        return f"{name}: no roots."
    if discrete:
        outside = int((np.abs(poles) >= 1 - 1e-12).sum())
        words = f"{name}: the largest modulus is {short(float(np.abs(poles).max()))}"
        place = "on or outside the unit circle"
    else:
        outside = int((poles.real >= 0).sum())
        words = f"{name}: the rightmost root is at Re s = {short(float(poles.real.max()))} rad/s"
        place = "on or right of the axis"
    return f"{words}, {so_many(outside) if outside else 'no root'} {place}."


def _half_plane(axes: Axes, roots: Complex) -> None:
    """Limits around the roots and the axis, rays of equal damping, the axes themselves."""
    axes.axvline(0, color=INK, linewidth=0.8)
    axes.axhline(0, color=INK, linewidth=0.5)
    size = float(np.abs(roots).max(initial=0.0)) or 1.0
    left = min(float(roots.real.min(initial=0.0)), -0.15 * size)
    right = max(float(roots.real.max(initial=0.0)), 0.1 * size)
    top = max(float(np.abs(roots.imag).max(initial=0.0)), 0.3 * size)
    room = 0.08 * (right - left)
    left, right, top = left - room, right + room, 1.08 * top
    axes.set(xlim=(left, right), ylim=(-top, top))
    for zeta in DAMPING:
        slope = math.sqrt(1 - zeta * zeta) / zeta
        for side in (1, -1):
            axes.plot(
                [0, 2 * left], [0, -2 * side * slope * left], color=GREY, linewidth=0.6, zorder=1
            )
        x = left if -slope * left < top else -top / slope
        words: Any = {"fontsize": 7, "color": INK, "ha": "left", "va": "top", "zorder": 2}
        axes.annotate(
            f"ζ = {zeta:g}", (x, -slope * x), (2, -2), textcoords="offset points", **words
        )
    axes.set_xlabel("Re s, rad/s")
    axes.set_ylabel("Im s, rad/s")


def _circle(axes: Axes, poles: Complex) -> None:
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 361))
    axes.plot(turn.real, turn.imag, color=INK, linewidth=0.9, linestyle="--")
    axes.axvline(0, color=INK, linewidth=0.5)
    axes.axhline(0, color=INK, linewidth=0.5)
    edge = 1.1 * max(1.0, float(np.abs(poles).max(initial=0.0)))
    axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
    axes.set_xlabel("Re z")
    axes.set_ylabel("Im z")


def _branches(rows: Complex) -> Complex:
    """The roots of Im s ≥ 0 in the order of the row before, NaN where a branch begins or jumps.

    The last of the rightmost roots change places with others that are not asked for.
    """
    rows = np.where(rows.imag < 0, complex(np.nan, np.nan), rows)
    out = np.full((len(rows), 2 * rows.shape[1]), complex(np.nan, np.nan))
    out[0, : rows.shape[1]] = rows[0]
    scale = float(np.nanmax(np.abs(rows))) if np.isfinite(rows).any() else 1.0
    for k in range(1, len(rows)):
        new = rows[k][np.isfinite(rows[k])]
        before = out[k - 1]
        alive = np.flatnonzero(np.isfinite(before))
        distance = np.abs(before[alive][:, None] - new[None, :])
        taken, given = linear_sum_assignment(distance)
        left = set(range(len(new)))
        for i, j in zip(taken.tolist(), given.tolist(), strict=True):
            if distance[i, j] < 0.12 * scale:
                out[k, alive[i]] = new[j]
                left.discard(int(j))
        free = [c for c in range(out.shape[1]) if np.isnan(out[k, c]) and np.isnan(before[c])]
        for j, column in zip(sorted(left), free, strict=False):
            out[k, column] = new[j]
    return out


def _direction(axes: Axes, branch: Complex) -> None:
    """An arrow's head halfway along the longest way of a branch."""
    known = np.flatnonzero(np.isfinite(branch))
    if len(known) < 5:
        return
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(branch[known])))])
    k = int(np.searchsorted(way, way[-1] / 2))
    k = min(max(k, 1), len(known) - 1)
    start, end = branch[known[k - 1]], branch[known[k]]
    if known[k] - known[k - 1] == 1 and start != end:
        head: Any = {"arrowstyle": "-|>", "color": EXACT, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (end.real, end.imag), (start.real, start.imag), arrowprops=head)


def _crossing(rows: Complex, grid: Array, name: str) -> str:
    """Where along the parameter stability is lost or won."""
    right = np.array([float(np.nanmax(row.real, initial=-np.inf)) for row in rows])
    stable = right < 0
    change = np.flatnonzero(stable[1:] != stable[:-1])
    if not len(change):
        return f"{'Stable' if stable[0] else 'Unstable'} at all values of {name} shown."
    k = int(change[0])
    share = right[k] / (right[k] - right[k + 1])
    edge = float(grid[k] + share * (grid[k + 1] - grid[k]))
    way = "Stable up to" if stable[k] else "Unstable up to"
    more = ", then again" if len(change) > 1 else ""
    return f"{way} about {name} = {short(edge)}{more}."
