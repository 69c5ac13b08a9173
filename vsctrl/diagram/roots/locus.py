"""The rightmost roots along a parameter, and how they show themselves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.tables import Lines, Numbers, escaped, roots_listed

WIDTH, HEIGHT = 420, 300  #: of the picture, pixels
LARGEST = 4  #: roots of each value that the picture is cut to
MOST_DOTS = 2000


@dataclass(frozen=True, eq=False)
class RootLocus(Lines, Numbers):
    """The n rightmost roots (rad/s) at each value of a parameter, all others as they are.

    `roots` (len(values), n) fall by real part along each row; NaN stands where there are fewer than
    n. `own` is the system's own value, with the roots `here`. As an array it is its roots.
    """

    parameter: str
    values: Array
    roots: Complex
    own: float
    here: Complex

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.array(self.roots, dtype=dtype) if copy or dtype else self.roots

    def __getitem__(self, index: Any) -> Any:
        return self.roots[index]

    def __iter__(self) -> Iterator[Complex]:
        return iter(self.roots)

    def __len__(self) -> int:
        return len(self.roots)

    @property
    def shape(self) -> tuple[int, ...]:
        """(len(values), n)."""
        return self.roots.shape

    @property
    def rightmost(self) -> Array:
        """The largest Re s (rad/s) at each value, −∞ where there is no root."""
        return np.asarray(np.nan_to_num(self.roots.real, nan=-np.inf).max(axis=1, initial=-np.inf))

    def _lines(self) -> dict[str, str]:
        right, values, name = self.rightmost, self.values, self.parameter
        worst = int(right.argmax())
        low, high = f"{values[0]:.5g}", f"{values[-1]:.5g}"
        return {
            "root locus": f"{self.shape[1]} rightmost roots over {name}",
            f"{name}": f"{low} to {high}, {len(values)} values; its own is {self.own:.5g}",
            f"roots at {low}": self._at(0),
            f"roots at {high}": self._at(-1),
            "farthest right": f"Re s = {right[worst]:.4g} rad/s at {name} = {values[worst]:.5g}",
            "stable": self._stable(),
        }

    def _at(self, k: int) -> str:
        row = self.roots[k]
        return roots_listed(row[np.isfinite(row)].tolist())

    def _stable(self) -> str:
        """At which of the values."""
        stable = self.rightmost < 0
        edges = np.flatnonzero(np.diff(stable)) + 1
        parts = [
            f"{part[0]:.5g}{f' to {part[-1]:.5g}' if len(part) > 1 else ''}"
            for part, yes in zip(
                np.split(self.values, edges), stable[[0, *edges.tolist()]], strict=True
            )
            if yes
        ]
        if len(parts) == 1 and stable.all():
            return "at all of them"
        return f"at {', '.join(parts)}" if parts else "at none of them"

    def _repr_html_(self) -> str:
        return _picture(self) + super()._repr_html_()


def _picture(locus: RootLocus) -> str:
    """The roots as dots in the plane, darker as the parameter grows; × at its own value."""
    rows = locus.roots[:: max(1, locus.roots.size // MOST_DOTS)]
    near = np.concatenate([rows[:, :LARGEST].ravel(), locus.here[:LARGEST]])
    near = near[np.isfinite(near)]
    size = float(np.abs(near).max(initial=0.0)) or 1.0
    left = 1.1 * min(float(near.real.min(initial=0.0)), -0.2 * size)
    right = 1.1 * max(float(near.real.max(initial=0.0)), 0.1 * size)
    top = 1.1 * max(float(np.abs(near.imag).max(initial=0.0)), 0.2 * size)

    def place(root: complex) -> tuple[float, float]:
        return (
            (root.real - left) / (right - left) * WIDTH,
            (top - root.imag) / (2 * top) * HEIGHT,
        )

    dots = []
    for k, row in enumerate(rows):
        shade = 0.25 + 0.75 * k / max(len(rows) - 1, 1)
        for x, y in (place(complex(root)) for root in row if np.isfinite(root)):
            if 0 <= x <= WIDTH and 0 <= y <= HEIGHT:
                dots.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2" opacity="{shade:.2f}"/>')
    crosses = "".join(
        f'<path d="M{x - 5:.1f} {y - 5:.1f}l10 10m0-10l-10 10"/>'
        for x, y in (place(complex(root)) for root in locus.here[:LARGEST])
    )
    x, y = place(0j)
    words = f"Roots in s over {locus.parameter} from {locus.values[0]:g} to {locus.values[-1]:g}"
    note = f"{words}, darker as it grows; × at {locus.own:g}"
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT + 18}" width="{WIDTH}" role="img" '
        f'style="max-width:100%" aria-label="{escaped(words)}">'
        f'<g stroke="currentColor" stroke-width="0.7" opacity="0.6">'
        f'<path d="M{x:.1f} 0V{HEIGHT}M0 {y:.1f}H{WIDTH}"/></g>'
        f'<g fill="#1f77b4">{"".join(dots)}</g>'
        f'<g stroke="#d95f02" stroke-width="1.8" fill="none">{crosses}</g>'
        f'<text x="0" y="{HEIGHT + 14}" font-size="11" fill="currentColor">{escaped(note)}</text>'
        "</svg>"
    )
