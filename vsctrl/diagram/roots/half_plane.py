"""How many roots lie right of a line, none of them known: how often the determinant turns."""

from __future__ import annotations

import math

import numpy as np

from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.roots.neutral import DifferenceOperator, perron
from vsctrl.diagram.roots.one_delay import count_of_one_delay
from vsctrl.diagram.roots.winding import MOST_SAMPLES, phase


def count_without_roots(
    system: DelaySystem, operator: DifferenceOperator, sigma: float, most: int = MOST_SAMPLES
) -> float | None:
    """The number of roots right of sigma without listing them; None where it cannot be told.

    `operator` is that of the system with its longest delay as the unit of time; `most` bounds the
    points at which the determinant is looked at.
    """
    if not system.delays:
        return int((np.linalg.eigvals(system.A).real > sigma).sum())
    unit = float(max(system.delays))
    least = operator.lower_bound(sigma * unit)
    if not least:
        return None if least is None else math.inf
    scaled = system.scaled(unit)
    count = _winding_count(scaled, sigma * unit, least, most)
    return count_of_one_delay(scaled, sigma * unit) if count is None else count


def _winding_count(system: DelaySystem, sigma: float, least: float, most: int) -> int | None:
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
    if not top * system.tau.sum() <= most:
        return None
    omega = np.linspace(0.0, top, 33)
    turn, reach = phase(system, sigma, omega)
    while True:
        # Between two points no nearer root than that can hide, so the shorter way round is it.
        if np.isnan(reach).any():
            return None
        gap = np.diff(omega)
        rough = np.flatnonzero(gap > np.maximum(reach[:-1], reach[1:]))
        if not len(rough):
            break
        if len(omega) + len(rough) > most or gap[rough].min() < 1e-15 * top:
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
