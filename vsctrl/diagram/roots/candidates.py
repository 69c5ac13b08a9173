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

RESOLVED = 0.8  #: rad a node, of what nodes on a delay can follow
ITERATIONS = 6  #: after which Newton's method goes on
FARTHEST = 300.0  #: −Re s times the longest delay, further left than which nothing is told
APART = 1e3  #: ratio of two neighbouring delays from which on they have scales of their own

Chosen = NDArray[np.bool_]  #: (m,), which of the delays


def candidates(system: DelaySystem, nodes: int, neutral: bool = False) -> Complex:
    """Approximate roots s (rad/s), Im s ≥ 0, the better the more nodes; some are none.

    Of a neutral system the nodes' own matrix has roots of high frequency beside its chains that
    are nobody's start: those are left out.
    """
    if not system.delays:
        roots = _spectrum(system.A)
        return roots[roots.imag >= 0]
    lengths = np.array(sorted({float(tau) for tau in system.delays}))
    every = np.isfinite(system.tau)
    parts = [_spectrum(_without(system, ~every, every)), _spectrum(system.A)]
    cuts = [0, *(k + 1 for k, (a, b) in enumerate(pairwise(lengths)) if b > APART * a)]
    for first, end in pairwise([*cuts, len(lengths)]):
        low, high = lengths[first], lengths[end - 1]
        part = _at_scale(system, low, high, nodes)
        parts.append(part[part.imag * high < RESOLVED * nodes] if neutral else part)
    if len(cuts) > 1:
        part = discretised(system, nodes)
        parts.append(part[part.imag * lengths[-1] < RESOLVED * nodes] if neutral else part)
    parts.append(_along_chains(system, nodes))
    roots = np.concatenate(parts)
    return roots[roots.imag >= 0]


def _along_chains(system: DelaySystem, nodes: int) -> Complex:
    """Those of the longest delay τ, by the number k of turns that e^{sτ} has made.

    Let μ(s) be an eigenvalue of what leads from that delay's end back to its start, all other
    delays as they are. The roots are where e^{sτ} = μ(s): s = (ln μ(s) + 2πjk)/τ, which is iterated
    from s = 2πjk/τ, also for the k round each resonance of μ, where the rightmost may be.
    Source: M. Lichtner, M. Wolfrum, S. Yanchuk, SIAM J. Math. Anal. 43 (2011) 788–802.
    """
    back, tau = _round_the_longest(system)
    modes = _spectrum(system.A)
    modes = modes[modes.imag >= 0]
    # Beside each mode, never on it.
    beside = np.outer(np.abs(modes.real) + 1e-9 * np.abs(modes), np.linspace(-4, 4, 32))
    omega = np.concatenate([np.abs(modes)[:, None] + beside, modes.imag[:, None] + beside]).ravel()
    omega = omega[omega * tau > nodes / 4]
    step = 2 * np.pi / tau
    turns = np.arange(nodes // 2)
    with np.errstate(all="ignore"):
        try:
            if len(omega):
                peaks = omega[
                    np.argsort(-np.abs(_largest(back, np.asarray(1j * omega, complex))))[:3]
                ]
                near = np.round(peaks[:, None] / step) + np.arange(-nodes // 4, nodes // 4)
                turns = np.unique(np.r_[turns, near.ravel()[near.ravel() > 0]])
            s = np.asarray(1j * step * turns + 0.1 / tau, complex)
            for _ in range(ITERATIONS):
                s = np.asarray(np.log(_largest(back, s)) / tau + 1j * step * turns, complex)
                told = np.isfinite(s)
                s, turns = s[told], turns[told]
        except (np.linalg.LinAlgError, ValueError):
            return np.zeros(0, complex)
    return np.asarray(s[s.real * tau > -FARTHEST], complex)


def _round_the_longest(system: DelaySystem) -> tuple[DelaySystem, float]:
    """The loop cut at its longest delays: their ends are inputs, their starts outputs."""
    longest = system.tau == system.tau.max()
    order = np.r_[np.flatnonzero(longest), np.flatnonzero(~longest)]
    B2, C2, D22 = system.inner
    shorter = tuple(system.delays[k] for k in order[int(longest.sum()) :])
    D = D22[np.ix_(order, order)]
    return DelaySystem(system.A, B2[:, order], C2[order], D, shorter), float(system.tau.max())


def _largest(back: DelaySystem, s: Complex) -> Complex:
    """The eigenvalue of largest modulus of a transfer matrix at each point."""
    mu = np.linalg.eigvals(back.transfer(s))
    return np.asarray(mu[np.arange(len(s)), np.abs(mu).argmax(1)], complex)


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
