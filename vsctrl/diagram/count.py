"""How many characteristic roots lie right of a line, by the argument principle.

A list of roots, however well polished, does not say that none is missing. The turning of the
characteristic determinant along a line does, and is given with the answer; where it cannot be had,
a sentence says why.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vsctrl.diagram.delay import DelaySystem
from vsctrl.diagram.roots import delays_in_loops, rightmost

Complex = NDArray[np.complex128]

MOST_SAMPLES = 1_000_000
MOST_LISTED = 64  #: roots that are worked out one by one


@dataclass(frozen=True)
class RootsRight:
    """The characteristic roots right of Re s = `sigma` (rad/s).

    `count` is that of the argument principle if `certified`, infinite for a chain of a neutral
    loop; `roots` lists them, at most the rightmost `MOST_LISTED`; `sentence` says how it is known.
    """

    sigma: float
    roots: Complex
    count: float
    certified: bool
    sentence: str


def roots_right_of(system: DelaySystem, sigma: float = 0.0) -> RootsRight:
    """The roots right of a line, with the count that certifies them where there is one."""
    system = delays_in_loops(system)
    count = _count(system, sigma)
    wanted = MOST_LISTED if count is None else int(min(count + 2, MOST_LISTED))
    roots = rightmost(system, wanted)
    roots = roots[roots.real > sigma]
    if count is None:
        sentence = (
            f"{len(roots)} were found; they are not certified, because delays feed through (a "
            "neutral loop) or a root lies too near the line."
        )
        return RootsRight(sigma, roots, len(roots), False, sentence)
    if math.isinf(count):
        sentence = f"A neutral loop has a chain of roots right of {sigma:g} rad/s: infinitely many."
        return RootsRight(sigma, roots, count, True, sentence)
    complete = len(roots) == count
    sentence = (
        f"The determinant turns as often as {count:g} roots make it; {len(roots)} are listed."
    )
    return RootsRight(sigma, roots, count, complete or count > MOST_LISTED, sentence)


def count_right_of(system: DelaySystem, sigma: float = 0.0) -> float:
    """How many roots lie right of Re s = sigma (rad/s); infinite where a neutral loop has a chain.

    By the argument principle where no delay feeds through (retarded systems), otherwise by taking
    ever more of the rightmost roots; beyond 32 that are too many to count it is "at least".
    """
    system = delays_in_loops(system)
    count = _count(system, sigma)
    if count is not None:
        return count
    right = 0
    for n in (8, 32):
        roots = rightmost(system, n)
        right = int((roots.real > sigma).sum())
        if right < len(roots) or len(roots) < n:
            break
    return right


def _count(system: DelaySystem, sigma: float) -> float | None:
    """The number of roots right of sigma without listing them; None where it cannot be told."""
    if not system.delays:
        return int((np.linalg.eigvals(system.A).real > sigma).sum())
    if system.D[system.outputs :, system.inputs :].any():
        return math.inf if _chain(system) > sigma else None
    unit = float(max(system.delays))
    return _turns(system.scaled(unit), sigma * unit)


def _chain(system: DelaySystem) -> float:
    """The line that a neutral system's chains of roots tend to: its roots without its states."""
    r, p = system.inputs, system.outputs
    frozen = DelaySystem(
        np.zeros((0, 0)),
        np.zeros((0, len(system.delays))),
        np.zeros((len(system.delays), 0)),
        system.D[p:, r:],
        system.delays,
    )
    roots = rightmost(frozen, 4)
    return float(roots.real.max(initial=-math.inf))


def _turns(system: DelaySystem, sigma: float) -> int | None:
    """Roots right of sigma: N = n/2 − (arg D(σ + jω) from ω = 0 to ∞)/π, D the determinant.

    D tends to sⁿ, so beyond a frequency where |D/sⁿ − 1| is small only sⁿ turns. None where a root
    lies so near the line that its side cannot be told, or D turns too often to follow.
    """
    n = len(system.A)
    loop = np.abs(system.B[:, system.inputs :]) @ np.abs(system.C[system.outputs :])
    bound = np.abs(system.A).sum() + loop.sum() * math.exp(abs(sigma)) + abs(sigma) + 1.0
    late = sum(float(tau) for tau in system.delays)
    # Below `bound` the delays turn D by up to Σ τ per rad/s; far beyond it only sⁿ is left.
    if 4 * late * bound > MOST_SAMPLES:
        return None
    inner = np.linspace(0.0, bound, math.ceil(4 * late * bound) + 200)
    omega = np.concatenate([inner, np.geomspace(bound, 100.0 * max(n, 1) * bound, 200)[1:]])
    top = float(omega[-1])
    phase = np.angle(_determinant(system, sigma + 1j * omega))
    for _ in range(60):
        step = np.angle(np.exp(1j * np.diff(phase)))
        rough = np.flatnonzero(np.abs(step) > 0.8)
        if not len(rough):
            break
        if len(omega) > 500_000 or np.diff(omega)[rough].min() < 1e-13 * top:
            return None
        middle = (omega[rough] + omega[rough + 1]) / 2
        omega = np.insert(omega, rough + 1, middle)
        phase = np.insert(phase, rough + 1, np.angle(_determinant(system, sigma + 1j * middle)))
    else:
        return None
    rest = n * (math.pi / 2 - np.angle(sigma + 1j * omega[-1]))
    turned = (float(step.sum()) + rest) / math.pi
    count = round(n / 2 - turned)
    return count if abs(n / 2 - turned - count) < 0.2 and count >= 0 else None


def _determinant(system: DelaySystem, at: Complex) -> Complex:
    return np.asarray(np.linalg.det(system.characteristic(at)), complex)
