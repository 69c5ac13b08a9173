"""What a signal was before t = 0: a function approximated by polynomials, and delayed.

An initial function is sampled on as many Chebyshev pieces as it needs. Where even short pieces do
not fit it there is a kink or a jump, which is searched for by halving and becomes an end of two
pieces. Behind a delay σ it is seen on [0, σ): `DelayedInitialFunction` is that as a signal, which
knows its kinks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from math import prod
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial import chebyshev

from vsctrl.arrays import Array
from vsctrl.caching import Caching
from vsctrl.diagram.numerics.chebyshev import inner_tables, slope
from vsctrl.diagram.signals.signal import Part, Primitive
from vsctrl.errors import InputError

Cell = tuple[Fraction, Fraction]

DEGREE = 20
NODES, TO_COEFFICIENTS = inner_tables(DEGREE)
BETWEEN = np.array([-0.6137, 0.1083, 0.7931])  #: where a piece is put to the test
TOLERANCE = 1e-13  #: of the last coefficients, relative to the largest value
NOISE = 1e-15  #: coefficients at the end of a piece that are rounding only
SMOOTH_DEPTH = 14  #: halvings after which a piece that is still rough must hold a kink
DEEPEST = 44  #: halvings that pin a jump down to rounding
MOST_KINKS = 256
MOST_PIECES = 4096


@dataclass(frozen=True, eq=False)
class InitialFunction(Caching):
    """A past: Chebyshev coefficients between ends (s, rising to 0), and the value from 0 on."""

    ends: tuple[Fraction, ...]
    coefficients: tuple[Array, ...]
    at_zero: float

    def __call__(self, t: Array, seen: Array) -> Array:
        """The value at times t (s), at a jump that on the side that `seen` is on."""
        out = np.full(np.shape(t), self.at_zero)
        last = len(self.coefficients) - 1
        before = np.searchsorted([float(end) for end in self.ends], seen, side="right") - 1
        piece = np.where(seen < 0, np.clip(before, 0, last), -1)
        for i in set(piece.ravel().tolist()) - {-1}:
            a, b = (float(end) for end in self.ends[i : i + 2])
            inside = piece == i
            xi = (2 * t[inside] - (a + b)) / (b - a)
            out[inside] = chebyshev.chebval(xi, self.coefficients[i])
        return out

    @property
    def scale(self) -> float:
        """A bound of its size."""
        return max([abs(self.at_zero), *(float(np.abs(c).sum()) for c in self.coefficients)])

    def slope(self, order: int = 1) -> InitialFunction:
        """Its derivative of some order, 0 from t = 0 on; itself for order 0."""
        if not order:
            return self
        pieces = zip(pairwise(self.ends), self.coefficients, strict=True)
        slopes = tuple(slope(c, float(b - a)) for (a, b), c in pieces)
        return InitialFunction(self.ends, slopes, 0.0).slope(order - 1)

    def derivatives(self, t: Fraction, side: str, orders: int) -> Array:
        """Those of order 0 … orders − 1 at a time ≤ 0 (s), "left" or "right" of it."""
        out = np.zeros(orders)
        if not self.coefficients or (t >= 0 and side == "right"):
            out[0] = self.at_zero
            return out
        if side == "right":
            i = max(k for k, end in enumerate(self.ends[:-1]) if end <= t or k == 0)
        else:
            i = next(k for k, end in enumerate(self.ends[1:]) if t <= end)
        a, b = self.ends[i], self.ends[i + 1]
        x, c = float(2 * (t - a) / (b - a) - 1), self.coefficients[i]
        for k in range(min(orders, len(c))):
            out[k] = chebyshev.chebval(x, c)
            c = slope(c, float(b - a))
        return out

    def jumps(self, t: Fraction, orders: int) -> Array:
        """The jumps of the derivatives there, those that rounding may have made taken as 0."""
        jump = self.derivatives(t, "right", orders) - self.derivatives(t, "left", orders)
        if abs(jump[0]) <= 10 * TOLERANCE * self.scale:
            jump[0] = 0.0
        return jump

    @cached_property
    def kinks(self) -> list[Fraction]:
        """The ends between two pieces at which it truly bends or jumps."""
        widths = [float(b - a) for a, b in pairwise(self.ends)]
        return [
            end
            for end, beside in zip(self.ends[1:-1], pairwise(widths), strict=True)
            if (np.abs(self.jumps(end, 5)) > self._rounding(min(beside), 5)).any()
        ]

    def _rounding(self, width: float, orders: int) -> Array:
        """What the error of a piece may make of its derivatives: T_N⁽ᵏ⁾(1) (2/h)ᵏ times that."""
        growth = [
            (2 / width) ** k * prod((DEGREE**2 - j**2) / (2 * j + 1) for j in range(k))
            for k in range(orders)
        ]
        return 100 * TOLERANCE * self.scale * np.array(growth)


def approximate(
    sample: Callable[[Array], Array], at_zero: float, back: Fraction, what: str
) -> InitialFunction:
    """The past on [−back, 0] (s) by polynomials, its value at 0 being `at_zero`.

    `sample` takes times (n,) and returns values (n,).
    Errors: `InputError` where it is too rough to be resolved.
    """
    if not back:
        return InitialFunction((Fraction(0),), (), at_zero)
    fit = _Fit(sample, abs(at_zero))
    rough = fit.refine([(-back, Fraction(0))], SMOOTH_DEPTH)
    if rough:
        edges = _apart(fit.pin_down(rough), back)
        fit.pieces = {}
        rough = fit.refine(list(pairwise([-back, *edges, Fraction(0)])), SMOOTH_DEPTH)
    if rough or fit.lost:
        near = float(rough[0][0]) if rough else float(-back)
        raise InputError(
            f"response: {what} is too rough to follow near t = {near:.6g} s; give a function that "
            f"is smooth between at most {MOST_KINKS} kinks or jumps."
        )
    cells = sorted(fit.pieces)
    ends = (*(a for a, _ in cells), Fraction(0))
    return InitialFunction(ends, tuple(fit.chopped(fit.pieces[cell]) for cell in cells), at_zero)


class _Fit:
    """Halves cells until a polynomial fits on each, all cells of one width in one call."""

    def __init__(self, sample: Callable[[Array], Array], scale: float) -> None:
        self.sample, self.scale = sample, scale
        self.pieces: dict[Cell, Array] = {}
        self.lost = False

    def refine(self, cells: list[Cell], depth: int) -> list[Cell]:
        """The cells that are still rough after so many halvings."""
        for _ in range(depth):
            cells = [half for cell in self._rough(cells) for half in _halves(cell)]
            if not cells or len(cells) + len(self.pieces) > MOST_PIECES:
                break
        return self._rough(cells) if cells else []

    def pin_down(self, cells: list[Cell]) -> list[Cell]:
        """For each kink in these cells one as short as it shows in."""
        located: list[Cell] = []
        for _ in range(DEEPEST - SMOOTH_DEPTH):
            if len(cells) + len(located) > 2 * MOST_KINKS:
                self.lost = True
                break
            halves = [_halves(cell) for cell in cells]
            rough = set(self._rough([half for pair in halves for half in pair]))
            located += [c for c, pair in zip(cells, halves, strict=True) if not rough & set(pair)]
            cells = sorted(rough)
            if not cells:
                break
        return sorted([*located, *cells])

    def _rough(self, cells: list[Cell]) -> list[Cell]:
        """Those that a polynomial does not fit; the others are kept as pieces."""
        if not cells:
            return []
        points = np.sort(np.concatenate([NODES, BETWEEN]))
        is_node = np.isin(points, NODES)
        a, b = np.array(cells, float).T[:, :, None]
        times = (a + b) / 2 + (b - a) / 2 * points
        values = self.sample(times.ravel()).reshape(times.shape)
        self.scale = max(self.scale, float(np.abs(values).max()))
        fits = values[:, is_node] @ TO_COEFFICIENTS.T
        tail = np.abs(fits[:, -3:]).max(axis=1)
        miss = np.abs(chebyshev.chebval(BETWEEN, fits.T) - values[:, ~is_node]).max(axis=1)
        fine = np.maximum(tail, miss / 10) <= TOLERANCE * self.scale
        self.pieces |= {cell: c for cell, c, ok in zip(cells, fits, fine, strict=True) if ok}
        return [cell for cell, ok in zip(cells, fine, strict=True) if not ok]

    def chopped(self, coefficients: Array) -> Array:
        """Without the last ones that are rounding, which derivatives would blow up."""
        kept = np.flatnonzero(np.abs(coefficients) > NOISE * self.scale)
        return coefficients[: kept[-1] + 1] if len(kept) else np.zeros(1)


def _halves(cell: Cell) -> tuple[Cell, Cell]:
    middle = (cell[0] + cell[1]) / 2
    return (cell[0], middle), (middle, cell[1])


def _apart(cells: list[Cell], back: Fraction) -> list[Fraction]:
    """A time in each cell, the simplest rational, without those that are too close to others."""
    near, kept = back / 10**10, [-back]
    for low, high in cells:
        edge = -_simplest(-high, -low)
        if edge - kept[-1] > near and edge < -near:
            kept.append(edge)
    return kept[1:]


def _simplest(low: Fraction, high: Fraction) -> Fraction:
    """The fraction of the smallest denominator in [low, high], 0 ≤ low."""
    whole = low.numerator // low.denominator
    if whole == low or whole + 1 <= high:
        return Fraction(whole if whole == low else whole + 1)
    return whole + 1 / _simplest(1 / (high - whole), 1 / (low - whole))


@dataclass(frozen=True, eq=False)
class DelayedInitialFunction(Part):
    """u(t) = amplitude · φ(t − delay): an initial function delayed, from t = delay on φ(0)."""

    function: InitialFunction
    delay: Fraction
    amplitude: float = 1.0

    @property
    def changes(self) -> list[tuple[Fraction, Primitive]]:
        """The stretches between its kinks, each up to the next."""
        inner = [kink for kink in self.function.kinks if kink > -self.delay]
        starts = [-self.delay, *inner, Fraction(0)]
        stops = [*starts[1:], None]
        return [
            (start + self.delay, _Stretch(self.function, start, stop, not i, self.amplitude))
            for i, (start, stop) in enumerate(zip(starts, stops, strict=True))
        ]

    def smooth(self, t: Array, seen: Array) -> Array:
        """The value at t after the start; at a jump within, on the side that `seen` is on."""
        delay_s = float(self.delay)
        return self.amplitude * self.function(t - delay_s, seen - delay_s)

    def scaled(self, factor: Any) -> DelayedInitialFunction:
        """The signal times a number."""
        return replace(self, amplitude=factor * self.amplitude)


@dataclass(frozen=True, eq=False)
class _Stretch(Primitive):
    """An initial function from one kink to the next, then zero; asked for on one side only."""

    function: InitialFunction
    begin: Fraction
    stop: Fraction | None
    first: bool
    amplitude: float = 1.0
    size: ClassVar[str] = "amplitude"

    def __post_init__(self) -> None:
        """Its fields were checked where the function was approximated."""

    @classmethod
    def formula(cls, t: Array, *values: Any) -> Array:
        """The value at t ≥ 0 after the start; all of t before its end, or all after."""
        function, begin, stop, _, amplitude = values
        if stop is None:
            return np.full(np.shape(t), amplitude * function.at_zero)
        a, b = float(begin), float(stop)
        x, h = a + t, b - a
        if t[0] + t[-1] > 2 * h:
            return np.zeros(np.shape(t))
        return np.asarray(amplitude * function(x, np.clip(x, a + 1e-9 * h, b - 1e-9 * h)))

    def onset(self, orders: int) -> Array:
        """The jumps of its derivatives at its start."""
        if self.first:
            return self.amplitude * self.function.derivatives(self.begin, "right", orders)
        return self.amplitude * self.function.jumps(self.begin, orders)
