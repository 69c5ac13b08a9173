"""Where characteristic roots may be: starts for Newton's method, at every scale of time.

Each delay channel is a transport equation; on Chebyshev nodes the whole system becomes one matrix
whose rightmost eigenvalues are close to the rightmost roots. Roots far slower than the delays drown
in the rounding of that matrix, whose entries are of the order of the fastest rate, and so do those
of a long delay beside a far shorter one: at each scale of its own the shorter delays are left out
as 1, and the longer ones, whose e^{−sτ} right of the axis vanishes there, as 0.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.numerics.chebyshev import differentiation_matrix
from vsctrl.diagram.realisation.delay_system import DelaySystem

APART = 1e3  #: ratio of two neighbouring delays from which on they have scales of their own

Chosen = NDArray[np.bool_]  #: (m,), which of the delays


def candidates(system: DelaySystem, nodes: int) -> Complex:
    """Approximate roots s (rad/s), Im s ≥ 0, the better the more nodes; some are none."""
    if not system.delays:
        roots = _spectrum(system.A)
        return roots[roots.imag >= 0]
    lengths = np.array(sorted({float(tau) for tau in system.delays}))
    every = np.isfinite(system.tau)
    parts = [_spectrum(_without(system, ~every, every)), _spectrum(system.A)]
    cuts = [0, *(k + 1 for k, (a, b) in enumerate(pairwise(lengths)) if b > APART * a)]
    for first, end in pairwise([*cuts, len(lengths)]):
        parts.append(_at_scale(system, lengths[first], lengths[end - 1], nodes))
    if len(cuts) > 1:
        parts.append(discretised(system, nodes))
    parts.append(_of_resonances(system, nodes))
    roots = np.concatenate(parts)
    return roots[roots.imag >= 0]


def _of_resonances(system: DelaySystem, nodes: int) -> Complex:
    """Those of a delay many times longer than a mode of the loop lives, near its resonances.

    With one delay the roots are where e^{sτ} is an eigenvalue μ(s) of C₂(sI − A)⁻¹B₂ + D₂₂, and
    far up the axis Re s ≈ ln |μ(jω)|/τ: the rightmost are where |μ| is largest, 2π/τ apart.
    Source: M. Lichtner, M. Wolfrum, S. Yanchuk, SIAM J. Math. Anal. 43 (2011) 788–802.
    """
    tau, modes = float(system.tau[0]), _spectrum(system.A)
    modes = modes[(modes.imag >= 0) & (np.abs(modes) * tau > nodes / 4)]
    if len(set(system.delays)) > 1 or not len(modes):
        return np.zeros(0, complex)
    B2, C2, D22 = system.inner

    def largest(omega: Array) -> Complex:
        shifted = 1j * omega[:, None, None] * np.eye(len(system.A)) - system.A
        through = np.linalg.solve(shifted, np.broadcast_to(B2, (len(omega), *B2.shape)))
        mu = np.linalg.eigvals(C2 @ through + D22)
        return np.asarray(mu[np.arange(len(omega)), np.abs(mu).argmax(1)], complex)

    # Beside each mode, never on it.
    beside = np.outer(np.abs(modes.real) + 1e-9 * np.abs(modes), np.linspace(-4, 4, 32))
    omega = np.concatenate([np.abs(modes)[:, None] + beside, modes.imag[:, None] + beside]).ravel()
    omega = omega[omega > 0]
    step = 2 * np.pi / tau
    with np.errstate(all="ignore"):
        try:
            peaks = omega[np.argsort(-np.abs(largest(omega)))[:3]]
            along = (peaks[:, None] + step * np.arange(-nodes // 4, nodes // 4)).ravel()
            turn = np.log(largest(along)) / tau
        except np.linalg.LinAlgError:
            return np.zeros(0, complex)
    out = turn + 1j * step * np.round((along - turn.imag) / step)
    return np.asarray(out[np.isfinite(out)], complex)


def _spectrum(matrix: Array) -> Complex:
    return np.asarray(np.linalg.eigvals(matrix), complex)


def _at_scale(system: DelaySystem, low: float, high: float, nodes: int) -> Complex:
    """Those of the system with the delays from low to high as they are."""
    keep = (system.tau >= low) & (system.tau <= high)
    if keep.all():
        return discretised(system, nodes)
    short, long = system.tau < low, system.tau > high
    w = np.flatnonzero(keep)
    rows = _closed(system, short, long)
    if rows is None:
        return np.zeros(0, complex)
    n = len(system.A)
    states, z = rows[:n], rows[n:][w]
    columns = n + w
    part = DelaySystem(
        states[:, :n],
        states[:, columns],
        z[:, :n],
        z[:, columns],
        tuple(system.delays[k] for k in w),
    )
    return discretised(part, nodes)


def _without(system: DelaySystem, long: Chosen, short: Chosen) -> Array:
    """x' = A x with the short delays 1 and the long ones 0; empty where that has no solution."""
    rows = _closed(system, short, long)
    n = len(system.A)
    return np.zeros((0, 0)) if rows is None else rows[:n, :n]


def _closed(system: DelaySystem, short: Chosen, long: Chosen) -> Array | None:
    """[A, B₂; C₂, D₂₂] with w = z for the short delays, w = 0 for the long ones."""
    B2, C2, D22 = system.inner
    rows = np.block([[system.A, B2], [C2, D22]])
    n = len(system.A)
    at = n + np.flatnonzero(short)
    # z = K [x; w], w_short = z_short: (I − K_ss) w_s = K_s,rest [x; w_rest].
    loop = np.eye(len(at)) - rows[np.ix_(at, at)]
    if len(at) and not np.linalg.cond(loop) < 1e12:
        return None
    free = rows[at].copy()
    free[:, at] = 0.0
    solved = np.linalg.solve(loop, free) if len(at) else free
    through = rows[:, at] @ solved
    rows = rows.copy()
    rows[:, at] = 0.0
    rows += through
    rows[:, n + np.flatnonzero(long)] = 0.0
    return rows


def discretised(system: DelaySystem, nodes: int) -> Complex:
    """Eigenvalues of the system with each delay as a transport equation on Chebyshev nodes."""
    B2, C2, D22 = system.inner
    n, m = len(system.A), len(system.delays)
    derivative = differentiation_matrix(nodes)
    # φ_j(θ) = z_j(t + θ) on nodes −τ … 0; the last, φ_j(0) = z_j, is eliminated.
    size = n + m * nodes
    matrix = np.zeros((size, size))
    w = np.zeros((m, size))  # w_j = φ_j(−τ_j), the first node
    w[range(m), n + nodes * np.arange(m)] = 1.0
    matrix[:n, :n] = system.A
    matrix[:n] += B2 @ w
    z = D22 @ w
    z[:, :n] += C2
    for j, tau in enumerate(system.delays):
        rows = slice(n + j * nodes, n + (j + 1) * nodes)
        slope = derivative[:-1] * (2 / float(tau))
        matrix[rows, rows] += slope[:, :-1]
        matrix[rows] += np.outer(slope[:, -1], z[j])
    return _spectrum(matrix)
