"""The stability chart over two parameters: how many roots are unstable where, and the exact edges.

What the chart is and what may be asked of it stands here; how the boundaries are found is left to
`d_partition`, how the regions between them are filled to `raster`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vsctrl.arrays import Array
from vsctrl.checks import is_finite, is_whole, quoted
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.stability_chart import raster
from vsctrl.diagram.stability_chart.d_partition import DPartition
from vsctrl.errors import InputError, nearest
from vsctrl.tables import Lines, Numbers, listed

MOST_CORNERS = 40_000


@dataclass(frozen=True)
class Boundary:
    """A curve on which a root (ω = 0) or a pair of roots ±jω lies on the imaginary axis.

    `points` (k, 2) are (x, y), `omega` (k,) in rad/s. Walking along it, the side with more
    unstable roots is on the left (x to the right, y up). `closed` repeats the first point at the
    end. `roots` is how many cross: 2 for a pair, 1 for a real root, times the loops that are equal.
    """

    points: Array
    omega: Array
    closed: bool
    roots: int

    @property
    def pair(self) -> bool:
        """Whether a pair ±jω crosses, not a real root."""
        return bool(self.omega.any())


@dataclass(frozen=True)
class StabilityChart(Lines, Numbers):
    """The number of unstable roots over a rectangle of two parameters, and its boundaries.

    `unstable` (len(y), len(x)) counts roots right of the imaginary axis at the grid's corners,
    infinite for the chain of a neutral loop. `boundaries` separate them, right to rounding.
    `complete` is whether they explain every change on the grid, `sentence` says so in words.
    """

    x_name: str
    y_name: str
    x: Array
    y: Array
    unstable: Array
    boundaries: tuple[Boundary, ...]
    complete: bool
    sentence: str

    def _lines(self) -> dict[str, str]:
        counts = [f"{count:g}" for count in np.unique(self.unstable)]
        share = float((self.unstable == 0).mean())
        pairs = sum(boundary.pair for boundary in self.boundaries)
        return {
            self.x_name: f"{self.x[0]:g} to {self.x[-1]:g}, {len(self.x)} values",
            self.y_name: f"{self.y[0]:g} to {self.y[-1]:g}, {len(self.y)} values",
            "unstable roots": listed(counts),
            "stable": f"{100 * share:.3g} % of the grid's corners",
            "boundaries": f"{len(self.boundaries)}, {pairs} of them of pairs",
        }

    def _sentences(self) -> list[str]:
        return [self.sentence]

    def regions(self, width: int = 600, height: int = 400) -> raster.Regions:
        """The chart as a raster: each region between the boundaries filled with its count."""
        return raster.flood(
            self.x, self.y, self.unstable, [b.points for b in self.boundaries], width, height
        )


def stability_chart(
    system: Numeric, ranges: Mapping[str, tuple[float, float]], grid: tuple[int, int]
) -> StabilityChart:
    """See `System.stability_chart`."""
    names, box = _ranges(system, ranges)
    columns, rows = _grid(grid)
    x, y = np.linspace(*box[0], columns), np.linspace(*box[1], rows)
    partition = DPartition(system, names, box, x, y)
    boundaries = tuple(Boundary(*boundary) for boundary in partition.run())
    missed = partition.missed
    change = "the count changes nowhere"
    if boundaries:
        change = f"{len(boundaries)} boundar{'y' if len(boundaries) == 1 else 'ies'}"
        change += " explain" + ("s" if len(boundaries) == 1 else "") + " every change of the count"
    sentence = f"On a grid of {columns} × {rows}, {change}."
    if missed:
        sentence = (
            f"{missed} changes of the count between neighbours of a {columns} × {rows} grid could "
            f"not be traced to a root on the axis; {len(boundaries)} boundaries could."
        )
    if np.isinf(partition.unstable).any():
        sentence += " Where the count is infinite, the edge is that of the grid."
    return StabilityChart(*names, x, y, partition.unstable, boundaries, not missed, sentence)


def _ranges(
    system: Numeric, ranges: Mapping[str, Any]
) -> tuple[tuple[str, str], tuple[tuple[float, float], tuple[float, float]]]:
    known = system.diagram.parameters
    for name in ranges:
        if name not in known:
            raise InputError(
                f"stability_chart: there is no parameter {quoted(name)}{nearest(name, known)}; "
                f"the diagram has {', '.join(known) or 'none'}."
            )
    if len(ranges) != 2:
        raise InputError(
            f"stability_chart: {', '.join(ranges) or 'no parameter'} given; give exactly two "
            "parameters with their ranges, the x axis first, like lam=(0.5, 30), tau=(0, 0.3)."
        )
    (x_name, x_range), (y_name, y_range) = ranges.items()
    return (x_name, y_name), (_range(x_name, x_range), _range(y_name, y_range))


def _range(name: str, limits: Any) -> tuple[float, float]:
    low, high = _two(limits)
    if not (is_finite(low) and is_finite(high)):
        raise InputError(
            f"stability_chart: {name} = {quoted(limits)} is no range; "
            "give two finite numbers (low, high)."
        )
    if not float(low) < float(high) or not math.isfinite(float(high) - float(low)):
        raise InputError(
            f"stability_chart: {name} = {quoted(limits)} is empty; give the lower number first."
        )
    return float(low), float(high)


def _grid(corners: Any) -> tuple[int, int]:
    columns, rows = _two(corners)
    if not (is_whole(columns) and is_whole(rows)) or min(columns, rows) < 2:
        raise InputError(
            f"stability_chart: grid = {quoted(corners)} is not usable; give two whole numbers of "
            "2 or "
            "more, the corners along x and along y."
        )
    if columns * rows > MOST_CORNERS:
        raise InputError(
            f"stability_chart: grid = {quoted(corners)} has {columns * rows} corners; give at most "
            f"{MOST_CORNERS}, as the boundaries are exact on any grid that meets them."
        )
    return int(columns), int(rows)


def _two(values: Any) -> Any:
    """Both of two values, or None twice."""
    try:
        first, second = values
    except (TypeError, ValueError):
        return None, None
    return first, second
