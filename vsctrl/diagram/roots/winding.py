"""How often the characteristic determinant turns along a line, and so what a rectangle holds.

Along a line steps are so short that, whatever the determinant does between two points, it turns by
less than half a turn. Round a rectangle its turns are then the number of roots inside, as an entire
function has no poles.
"""

from __future__ import annotations

import math

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.roots.newton import NOISE, log_slope_and_doubt

MOST_SAMPLES = 500_000
MOST_ON_EDGE = 60_000
SHORT = 0.05  #: of the distance from the real axis: a reach below it may be that of a cluster


def count_in(system: DelaySystem, re: tuple[float, float], im: tuple[float, float]) -> int | None:
    """The roots in a rectangle (rad/s); None where one lies too near an edge, or too many turns."""
    (a, b), (c, d) = re, im
    total = 0.0
    # A step to the right makes e^{−sτ} smaller, so that rows go that way.
    for start, way, length, sign in (
        (complex(a, c), 1.0, b - a, 1),
        (complex(b, c), 1j, d - c, 1),
        (complex(a, d), 1.0, b - a, -1),
        (complex(a, c), 1j, d - c, -1),
    ):
        turned = _turned(system, start, way, length)
        if turned is None:
            return None
        total += sign * turned
    count = total / (2 * math.pi)
    return round(count) if abs(count - round(count)) < 0.01 else None


def _turned(system: DelaySystem, start: complex, way: complex, length: float) -> float | None:
    """How far arg det M turns along a straight line, right or up."""
    at = np.linspace(0.0, length, 33)
    turn, reach = _argument_at(system, np.asarray(start + way * at, complex))
    while True:
        if np.isnan(reach).any():
            return None
        gap = np.diff(at)
        far = reach[:-1] if way == 1.0 else np.maximum(reach[:-1], reach[1:])
        rough = np.flatnonzero(gap > far)
        if not len(rough):
            return float(np.angle(np.exp(1j * np.diff(turn))).sum())
        if len(at) + len(rough) > MOST_ON_EDGE or gap[rough].min() < 1e-13 * length:
            return None
        middle = (at[rough] + at[rough + 1]) / 2
        new, near = _argument_at(system, np.asarray(start + way * middle, complex))
        at = np.insert(at, rough + 1, middle)
        turn, reach = np.insert(turn, rough + 1, new), np.insert(reach, rough + 1, near)


def _argument_at(system: DelaySystem, s: Complex) -> tuple[Array, Array]:
    """arg det M at points, and how far right of or above them it turns by less than π; or NaN."""
    n = len(system.A)
    _, C2, D = system.inner
    change = np.block([[np.eye(n), np.zeros((n, len(D)))], [C2, D]])
    lag = system.tau * np.exp(-np.outer(s.real, system.tau))
    weight = np.hstack([np.ones((len(s), n)), lag])
    rank = n + (int(np.linalg.matrix_rank(D)) if D.any() else 0)
    turn, reach = _argument(system.characteristic(s), change, weight, rank)
    return turn, _beside_roots(system, s, reach)


def phase(system: DelaySystem, sigma: float, omega: Array) -> tuple[Array, Array]:
    """arg det M, arg det E at points σ + jω, and how far along the line neither turns by π.

    NaN where det M is its own rounding.

    M(s + jδ) = M(s) (I + Y), the eigenvalues of Y at most δ times the Perron root y of
    |[[I, 0], [−C₂, −D₂₂]] M⁻¹| diag(1, τ|Δ|), and each turns det M by asin(δ y) at most.
    """
    n = len(system.A)
    _, C2, D = system.inner
    weight = np.r_[np.ones(n), system.tau * np.exp(-sigma * system.tau)]
    matrix = system.characteristic(np.asarray(sigma + 1j * omega))
    change = np.block([[np.eye(n), np.zeros((n, len(D)))], [C2, D]])
    rank = int(np.linalg.matrix_rank(D)) if D.any() else 0
    phase = np.zeros((2, len(omega)))
    phase[0], reach = _argument(matrix, change, weight, n + rank)
    reach = _beside_roots(system, np.asarray(sigma + 1j * omega), reach)
    if rank:
        phase[1], near = _argument(matrix[:, n:, n:], D, weight[n:], rank)
        reach = np.minimum(reach, near)
    return phase, reach


def _argument(matrix: Complex, change: Array, weight: Array, rank: int) -> tuple[Array, Array]:
    """The argument of a determinant and the δ up to which I + δY turns it by less than π.

    Y has `rank` eigenvalues that are not zero; on a root δ is 0.
    """
    det, _ = np.linalg.slogdet(matrix)  # of modulus 1, or 0
    matrix = np.where((det == 0)[:, None, None], np.eye(matrix.shape[-1]), matrix)
    with np.errstate(all="ignore"):
        power = np.abs(change @ np.linalg.inv(matrix)) * weight[..., None, :]
        for _ in range(3):
            power = power @ power
        y = power.sum(-1).max(-1) ** 0.125  # the Perron root, from above
        reach = 0.99 * math.sin(math.pi / max(rank, 2)) / (y + 1e-300)
    return np.angle(det), np.where((det == 0) | ~np.isfinite(y), 0.0, reach)


def _beside_roots(system: DelaySystem, s: Complex, reach: Array) -> Array:
    """The same reach, or a longer one where f = det M nears a multiple root; NaN in its rounding.

    There |M⁻¹| is as 1/|s|ᵐ, though f turns no more than over |s|. With |f| ≤ F in a circle of
    radius r Cauchy's estimates of the Taylor coefficients give

        |f(s + z)/f(s) − 1 − z f'(s)/f(s)| ≤ F/|f(s)| · 2 (|z|/r)²,   |z| ≤ r/2,

    so that f turns by less than π/2 where that and |z f'/f| are below 1 together. F is Hadamard's
    bound of a determinant by its rows or its columns.
    """
    short = np.flatnonzero((reach < SHORT * np.abs(s.imag)) & (reach > 0))
    if not len(short):
        return reach
    at = s[short]
    log_f = np.linalg.slogdet(system.characteristic(at))[1]
    with np.errstate(all="ignore"):
        slope, doubt = log_slope_and_doubt(system, at)
        most = np.zeros(len(at))
        for radius in (np.full(len(at), 0.5 / float(system.tau.max())), 2 * np.abs(at)):
            over = np.exp(np.minimum((log_f - _log_most(system, at, radius)) / 2, 0.0))
            most = np.maximum(most, np.minimum(0.47 * over, 0.5) * radius)
        longer = np.minimum(0.5 / np.abs(slope), most)
    out = reach.copy()
    out[short] = np.fmax(reach[short], longer)
    out[short[~(doubt < NOISE)]] = np.nan
    return out


def _log_most(system: DelaySystem, s: Complex, radius: Array) -> Array:
    """log F, F ≥ |det M| in circles: Hadamard's bound after rows and columns are balanced."""
    largest = system.most(s, radius)
    balance = np.zeros(len(s))
    for axis in (-1, -2, -1, -2):
        unit = np.maximum(np.linalg.norm(largest, axis=axis, keepdims=True), 1e-300)
        largest = largest / unit
        balance += np.log(unit).sum((-2, -1))
    rows, columns = (np.log(np.linalg.norm(largest, axis=k)).sum(-1) for k in (-1, -2))
    return np.asarray(balance + np.minimum(rows, columns), float)
