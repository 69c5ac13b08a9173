"""All characteristic roots in a rectangle, with the count that certifies them.

The argument round the rectangle says how many there are. Where the list falls short of that, the
rectangle is halved, and its halves, until each holds what is known of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.reduction import delays_in_loops
from vsctrl.diagram.roots.candidates import candidates
from vsctrl.diagram.roots.half_plane import frequency_bound
from vsctrl.diagram.roots.multiplicity import distinct
from vsctrl.diagram.roots.neutral import DifferenceOperator
from vsctrl.diagram.roots.newton import polished
from vsctrl.diagram.roots.order import ordered
from vsctrl.diagram.roots.winding import count_in
from vsctrl.errors import LimitError
from vsctrl.tables import Lines, Numbers, roots_listed

Side = tuple[float, float]

MOST_ROOTS = 1000
MOST_BOXES = 300
FURTHEST = 5_000  #: height, times the delays, of a rectangle that is searched by halving
MOST_NODES = 400  #: of a delay, where its matrix is taken for a first list
CUTS = (0.5, 0.47, 0.54, 0.39)  #: where a rectangle may be cut, some of which miss the roots


@dataclass(frozen=True)
class RootsIn(Lines, Numbers):
    """The characteristic roots with re[0] < Re s < re[1], im[0] < Im s < im[1] (rad/s).

    `count` is that of the argument principle, or how many were found where it cannot be had;
    `certified` says that it was, that as many are listed and that each of them is a root;
    `sentence` says how it is known.
    """

    re: Side
    im: Side
    roots: Complex
    count: int
    certified: bool
    sentence: str

    def _lines(self) -> dict[str, str]:
        (a, b), (c, d) = self.re, self.im
        return {
            "rectangle": f"{a:g} < Re s < {b:g}, {c:g} < Im s < {d:g} rad/s",
            "roots": f"{self.count}{'' if self.certified else ' found, not certified'}",
            "at": roots_listed(self.roots.tolist()),
        }

    def _sentences(self) -> list[str]:
        return [self.sentence]


class Found(NamedTuple):
    """Roots in a rectangle; `held`, how many it has, is None where that cannot be told."""

    roots: Complex
    held: int | None


def roots_in(system: DelaySystem, re: Side, im: Side) -> RootsIn:
    """The roots in a rectangle. Errors: `LimitError` for more than `MOST_ROOTS`."""
    system = delays_in_loops(system)
    unit = float(max(system.delays, default=1))
    scaled = system.scaled(unit) if system.delays else system
    unit = unit if system.delays else 1.0
    a, b, c, d = (edge * unit for edge in (*re, *im))
    found = search(scaled, (a, b), (c, d), np.zeros(0, complex))
    roots = ordered(found.roots) / unit
    if found.held is None:
        sentence = (
            f"{len(roots)} were found; they are not certified, because a root lies too near an "
            "edge, or the determinant turns too often along one to follow."
        )
        return RootsIn(re, im, roots, len(roots), False, sentence)
    sentence = (
        f"Round the rectangle the determinant turns as often as {found.held} roots make it; "
        f"{len(roots)} are listed."
    )
    return RootsIn(re, im, roots, found.held, len(roots) == found.held, sentence)


def search(system: DelaySystem, re: Side, im: Side, known: Complex) -> Found:
    """The roots in a rectangle, some of which may be known; times in units of the longest delay."""
    if not len(system.A) and not system.delays:
        return Found(np.zeros(0, complex), 0)  # gains alone have no roots
    count = count_in(system, re, im)
    if count is not None and count > MOST_ROOTS:
        raise LimitError(
            f"roots_in: the rectangle holds {count} roots and {MOST_ROOTS} is the limit; give a "
            "smaller one."
        )
    ends = _Ends(system)
    ends.add(known)
    if count is None or len(ends.inside(re, im)) != count:
        ends.add(_first_list(system, re, im))
    if count is not None and len(ends.inside(re, im)) < count:
        _halve(ends, re, im, count)
    return Found(ends.inside(re, im), count)


class _Ends:
    """Where Newton's method ended so far, and the roots that they are."""

    def __init__(self, system: DelaySystem) -> None:
        self.system = system
        self.roots = self.ends = np.zeros(0, complex)
        self.steps = np.zeros(0)
        self.boxes = 0

    def add(self, starts: Complex) -> None:
        """Newton's method from more starts."""
        if not len(starts):
            return
        ends, steps = polished(self.system, starts)
        self.ends, self.steps = np.r_[self.ends, ends], np.r_[self.steps, steps]
        self.roots = distinct(self.system, self.ends, self.steps)

    def inside(self, re: Side, im: Side) -> Complex:
        """Those in a rectangle."""
        z = self.roots
        within = (re[0] < z.real) & (z.real < re[1]) & (im[0] < z.imag) & (z.imag < im[1])
        return z[within]


def _first_list(system: DelaySystem, re: Side, im: Side) -> Complex:
    high = max(abs(im[0]), abs(im[1]))
    nodes = 24 + math.ceil(0.8 * min(high, MOST_NODES))
    starts = candidates(system, min(nodes, MOST_NODES // max(1, len(system.delays))))
    near = (starts.real > re[0] - 1) & (starts.real < re[1] + 1) & (starts.imag < 1.2 * high + 1)
    return starts[near]


def _halve(ends: _Ends, re: Side, im: Side, count: int) -> None:
    """Look for what is missing from a rectangle: from a grid of starts, then in its halves."""
    ends.add(_grid(re, im))
    ends.boxes += 1
    if len(ends.inside(re, im)) >= count or ends.boxes > MOST_BOXES:
        return
    if max(re[1] - re[0], im[1] - im[0]) < 1e-10 * max(map(abs, (*re, *im))):
        return
    for part in CUTS:
        halves = _halves(re, im, part)
        counts = [count_in(ends.system, *half) for half in halves]
        if None not in counts and sum(c or 0 for c in counts) == count:
            for half, held in zip(halves, counts, strict=True):
                if held and len(ends.inside(*half)) < held:
                    _halve(ends, *half, held)
            return


def _halves(re: Side, im: Side, part: float) -> list[tuple[Side, Side]]:
    if re[1] - re[0] > im[1] - im[0]:
        cut = re[0] + part * (re[1] - re[0])
        return [((re[0], cut), im), ((cut, re[1]), im)]
    cut = im[0] + part * (im[1] - im[0])
    return [(re, (im[0], cut)), (re, (cut, im[1]))]


def _grid(re: Side, im: Side) -> Complex:
    at: Array = (np.arange(4) + 0.5) / 4
    x, y = re[0] + at * (re[1] - re[0]), im[0] + at * (im[1] - im[0])
    return np.asarray(x[:, None] + 1j * y, complex).ravel()


def search_right_of(
    system: DelaySystem, operator: DifferenceOperator, sigma: float, roots: Complex
) -> Complex:
    """The roots right of the line by halving the rectangle that holds them all, or those given."""
    unit = float(max(system.delays, default=1))
    scaled = system.scaled(unit)
    least = operator.lower_bound(sigma * unit)
    if not least:
        return roots
    with np.errstate(over="ignore", invalid="ignore"):
        top = frequency_bound(scaled, sigma * unit, least)
    if not top * scaled.tau.sum() <= FURTHEST or not top > sigma * unit:
        return roots
    found = search(scaled, (sigma * unit, top), (-top, top), roots * unit)
    return roots if found.held is None else found.roots / unit
