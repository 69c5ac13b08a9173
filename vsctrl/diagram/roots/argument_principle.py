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
from vsctrl.diagram.roots import box
from vsctrl.diagram.roots.neutral import DifferenceOperator, perron
from vsctrl.diagram.roots.rightmost import first, rightmost
from vsctrl.diagram.roots.winding import MOST_SAMPLES, phase
from vsctrl.errors import InputError, LimitError
from vsctrl.tables import Lines, Numbers, roots_listed

MOST_LISTED = 64  #: roots that are worked out one by one
FURTHEST = 5_000  #: height, times the delays, of a rectangle that is searched by halving


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
            f"roots right of {self.sigma:g} rad/s": f"{self.count:g}{how}",
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
    count = _count(system, operator, sigma)
    roots = _listed(system, sigma, count)
    if count is not None and len(roots) != count <= MOST_LISTED:
        roots = _searched(system, operator, sigma, roots)
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


def _searched(
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
    found = box.search(scaled, (sigma * unit, top), (-top, top), roots * unit)
    return roots if found.held is None else first(found.roots / unit, MOST_LISTED)


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
    count = _count(system, DifferenceOperator.of(system.scaled(unit)), sigma)
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


def _count(system: DelaySystem, operator: DifferenceOperator, sigma: float) -> float | None:
    """The number of roots right of sigma without listing them; None where it cannot be told."""
    if not system.delays:
        return int((np.linalg.eigvals(system.A).real > sigma).sum())
    unit = float(max(system.delays))
    least = operator.lower_bound(sigma * unit)
    if not least:
        return None if least is None else math.inf
    return _winding_count(system.scaled(unit), sigma * unit, least)


def _winding_count(system: DelaySystem, sigma: float, least: float) -> int | None:
    """Roots right of sigma: N = n/2 − (arg g(σ + jω) from ω = 0 to ∞)/π, g = det M / det E.

    E = I − Δ D₂₂, |det E| ≥ `least`, and M the characteristic matrix: g = det(sI − A − B₂ E⁻¹ Δ C₂)
    tends to sⁿ. Where |g/sⁿ − 1| < 1 for good, the rest of the turn is known. None where a root
    lies so near the line that its side cannot be told, or g turns too often to follow.
    """
    n = len(system.A)
    if n == 0:
        return 0
    with np.errstate(over="ignore", invalid="ignore"):
        top = frequency_bound(system, sigma, least)
    if not top * system.tau.sum() <= MOST_SAMPLES:
        return None
    omega = np.linspace(0.0, top, 33)
    turn, reach = phase(system, sigma, omega)
    while True:
        # Between two points no nearer root than that can hide, so the shorter way round is it.
        gap = np.diff(omega)
        rough = np.flatnonzero(gap > np.maximum(reach[:-1], reach[1:]))
        if not len(rough):
            break
        if len(omega) + len(rough) > MOST_SAMPLES or gap[rough].min() < 1e-15 * top:
            return None
        middle = (omega[rough] + omega[rough + 1]) / 2
        new, near = phase(system, sigma, middle)
        omega = np.insert(omega, rough + 1, middle)
        turn, reach = np.insert(turn, rough + 1, new, 1), np.insert(reach, rough + 1, near)
    step = np.angle(np.exp(1j * np.diff(turn)))
    end = sigma + 1j * top
    ratio = float(turn[0, -1] - turn[1, -1]) - n * float(np.angle(end))
    rest = n * (math.pi / 2 - float(np.angle(end))) - math.remainder(ratio, 2 * math.pi)
    turned = n / 2 - (float((step[0] - step[1]).sum()) + rest) / math.pi
    count = round(turned)
    return count if abs(turned - count) < 0.01 and count >= 0 else None


def frequency_bound(system: DelaySystem, sigma: float, least: float) -> float:
    """A frequency beyond which |g/sⁿ − 1| < 1.

    g = det(sI − X), |X| ≤ |A| + |B₂| |E⁻¹Δ| |C₂| =: P in each entry, so no eigenvalue of X is
    larger than the Perron root ρ of P and |g/sⁿ − 1| ≤ (1 + ρ/|s|)ⁿ − 1.
    """
    B2, C2, D22 = system.inner
    n, m, lag = len(system.A), len(D22), np.exp(-sigma * system.tau)
    through = lag[:, None] * np.abs(D22)
    if perron(through) < 1 - 1e-9:
        most = np.linalg.solve(np.eye(m) - through, np.diag(lag))  # Neumann's series
    else:
        # The m − 1 largest singular values of E make its adjugate, 1/det E at most 1/least.
        size = (np.eye(m) + through) ** 2
        adjugate = (size.sum() / max(m - 1, 1)) ** ((m - 1) / 2)
        most = np.full((m, m), adjugate / least) * lag
    P = np.abs(system.A) + np.abs(B2) @ most @ np.abs(C2)
    return 1.01 * perron(P) / (2 ** (1 / n) - 1) + 1e-300
