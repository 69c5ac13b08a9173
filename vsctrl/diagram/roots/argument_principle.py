"""How many characteristic roots lie right of a line, by the argument principle.

A list of roots, however well polished, does not say that none is missing. The turning of the
characteristic determinant along a line does, and is given with the answer; where it cannot be had,
a sentence says why. Of a neutral loop the chains of roots are located first (`neutral`): right of
them it is counted like any other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vsctrl.arrays import Complex
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.reduction import delays_in_loops
from vsctrl.diagram.roots.box import search_right_of
from vsctrl.diagram.roots.chain_on_line import ON_LINE, count_beside_chain
from vsctrl.diagram.roots.half_plane import count_without_roots
from vsctrl.diagram.roots.neutral import DifferenceOperator
from vsctrl.diagram.roots.order import first
from vsctrl.diagram.roots.rightmost import rightmost
from vsctrl.errors import InputError, LimitError
from vsctrl.tables import Lines, Numbers, roots_listed

MOST_LISTED = 64  #: roots that are worked out one by one


@dataclass(frozen=True)
class RootsRight(Lines, Numbers):
    """The characteristic roots right of Re s = `sigma` (rad/s).

    `count` is that of the argument principle if `certified`, infinite for a chain of a neutral
    loop; `roots` lists them, at most the rightmost `MOST_LISTED`; `sentence` says how it is known.
    """

    sigma: float
    roots: Complex
    count: float
    certified: bool
    sentence: str
    #: No chain of roots tends to a line right of this (rad/s), and one to it where the delays have
    #: a common divisor that is not too small; −inf where there are no chains.
    chain: float = -math.inf

    def _lines(self) -> dict[str, str]:
        how = "" if self.certified else " found, not certified"
        return {
            f"roots right of {self.sigma:g} rad/s": f"{self.count:.0f}{how}",
            "at": roots_listed(self.roots.tolist()),
        }

    def _sentences(self) -> list[str]:
        return [self.sentence]


def roots_right_of(system: DelaySystem, sigma: float = 0.0) -> RootsRight:
    """The roots right of a line, with the count that certifies them where there is one."""
    system = delays_in_loops(system)
    unit = float(max(system.delays, default=1))
    operator = DifferenceOperator.of(system.scaled(unit))
    chain = operator.spectral_abscissa() / unit
    count = count_without_roots(system, operator, sigma)
    roots = _listed(system, sigma, count)
    beside = _beside_chain(system, operator, sigma) if count is None else None
    if beside is not None and beside < math.inf:
        sentence = (
            f"A chain of roots tends to {sigma:g} rad/s from the left, as its roots at rising "
            f"heights show; {beside:g} lie on or right of it and {len(roots)} are listed."
        )
        return RootsRight(sigma, roots, beside, False, sentence, chain)
    if count is not None and len(roots) != count <= MOST_LISTED:
        roots = first(search_right_of(system, operator, sigma, roots), MOST_LISTED)
    if count is None:
        why = (
            "a root lies too near the line, or the determinant turns too often to follow"
            if operator.lower_bound(sigma * unit)
            else "this neutral loop has chains of roots, which cannot be told to lie left or right "
            f"of {sigma:g} rad/s (none lies right of {chain:g} rad/s)"
        )
        sentence = f"{len(roots)} were found; they are not certified, because {why}."
        return RootsRight(sigma, roots, len(roots), False, sentence, chain)
    if math.isinf(count):
        sentence = f"A neutral loop has a chain of roots right of {sigma:g} rad/s: infinitely many."
        return RootsRight(sigma, roots, count, True, sentence, chain)
    complete = len(roots) == count
    sentence = (
        f"The determinant turns as often as {count:g} roots make it; {len(roots)} are listed."
    )
    if not operator.is_identity:
        sentence += " " + _about(operator.is_strongly_stable(sigma * unit), chain, sigma)
    return RootsRight(sigma, roots, count, complete or count > MOST_LISTED, sentence, chain)


def _listed(system: DelaySystem, sigma: float, count: float | None) -> Complex:
    """The roots right of the line, found by ever finer discretisation until none is missing."""
    wanted = MOST_LISTED if count is None else int(min(count + 2, MOST_LISTED))
    while True:
        roots = rightmost(system, wanted)
        roots = roots[roots.real > sigma]
        if count is None or len(roots) >= min(count, MOST_LISTED) or wanted >= MOST_LISTED:
            return roots[:MOST_LISTED]
        wanted = min(2 * wanted + 6, MOST_LISTED)


def _beside_chain(system: DelaySystem, operator: DifferenceOperator, sigma: float) -> float | None:
    """The count where a chain tends to the line itself, None where none does."""
    if operator.is_identity:
        return None
    unit = float(max(system.delays))
    line = operator.spectral_abscissa()
    if not abs(line - sigma * unit) <= ON_LINE:
        return None
    return count_beside_chain(system.scaled(unit), operator, line)


def edge(system: DelaySystem) -> float:
    """The line (rad/s) right of which a root counts as on the axis: the rounding of 1/delay."""
    return -1e-12 / max(1.0, float(system.tau.max(initial=0.0)))


def _about(strongly: bool | None, line: float, sigma: float) -> str:
    """A sentence on chains left of the line of which the delays' ratios may be the only reason."""
    rest = {
        None: "; whether they stay left of {} if the delays change is not told.",
        True: ", strongly: small changes of the delays bring none right of {}.",
        False: ", but not strongly: arbitrarily small changes of the delays bring some right of "
        "{}.",
    }[strongly].format(f"{sigma:g} rad/s")
    return (
        f"The chains of roots of this neutral loop lie no further right than {line:g} rad/s{rest}"
    )


def count_right_of(system: DelaySystem, sigma: float = 0.0) -> float:
    """How many roots lie right of Re s = sigma (rad/s); infinite where a neutral loop has a chain.

    By the argument principle; where that cannot tell (a chain or a root on the line), by taking
    ever more of the rightmost roots. Errors: `LimitError` where all of those, 32, are right of it.
    """
    system = delays_in_loops(system)
    unit = float(max(system.delays, default=1))
    with np.errstate(all="ignore"):
        scaled = system.A * unit, system.B * unit, system.C, system.D
    if not all(np.isfinite(part).all() for part in scaled):
        raise InputError(
            "unstable roots: the loop's gains and rates times its longest delay exceed what "
            "numbers can hold; give smaller ones, or another unit of time."
        )
    operator = DifferenceOperator.of(system.scaled(unit))
    count = count_without_roots(system, operator, sigma)
    if (count is None or math.isinf(count)) and not operator.is_identity:
        beside = _beside_chain(system, operator, sigma)
        count = count if beside is None else beside
    if count is not None:
        return count
    right = 0
    for n in (8, 32):
        roots = rightmost(system, n)
        right = int((roots.real > sigma).sum())
        if right < len(roots) or len(roots) < n:
            return right
    raise LimitError(
        f"unstable roots: at least {right} lie right of {sigma:g} rad/s, too many to count as the "
        "phase turns too often there, or a chain of them is on the line; shorten the delay or "
        "lower the gain."
    )
