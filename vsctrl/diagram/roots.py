"""Characteristic roots of a delay system: the rightmost ones, polished, none split from its pair.

Each delay channel is a transport equation; on Chebyshev nodes the whole system becomes one matrix
whose rightmost eigenvalues are close to the rightmost roots. Newton's method on the exact
characteristic matrix then polishes them, and a contour integral settles what a cluster is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vsctrl.diagram.delay import DelaySystem
from vsctrl.errors import InputError

Complex = NDArray[np.complex128]

CLUSTER = 1e-5  #: relative distance below which two approximations may be one multiple root


def rightmost(system: DelaySystem, n: int) -> Complex:
    """The n rightmost roots of det characteristic(s) = 0, by falling real part, with multiplicity.

    One more is given where the nth would be split from its conjugate; fewer where the system has
    no more. Simple roots are right to about 1e-12 relative.
    """
    _check_number(n)
    system = delays_in_loops(system)
    if not system.delays:
        return _first(np.linalg.eigvals(system.A).astype(complex), n)
    # With the longest delay as the unit of time nothing depends on the user's units.
    unit = float(max(system.delays))
    system = system.scaled(unit)
    found: list[complex] = []
    for nodes in (20 + 3 * n, 40 + 6 * n, 80 + 12 * n):
        candidates = _ordered(_discretised(system, nodes))[: 4 * n + 12]
        found = _distinct(system, *_polished(system, candidates))
        if len(found) >= n or len(system.A) == 0:
            break
    return _first(np.array(found, complex), n) / unit


def _check_number(n: int) -> None:
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 0:
        raise InputError(f"poles: n = {n!r} is not usable; give a whole number of 0 or more.")


def poles(system: DelaySystem, n: int) -> Complex:
    """The n rightmost poles of a one-input, one-output system: those roots that its response shows.

    A root that cancels against a zero, as the plant's own in a perfect Smith predictor, leaves no
    residue: the transfer function is integrated round each, order by order.
    """
    _check_number(n)
    hidden = 0
    while True:
        found = rightmost(system, n + hidden)
        shown = _shown(system, found)
        missing = min(n, len(found)) - len(shown)
        if missing <= 0 or len(found) < n + hidden:
            return _first(shown, n)
        hidden += missing


def _shown(system: DelaySystem, found: Complex) -> Complex:
    """The roots that are poles of the transfer function, as often as their order there."""
    unit = 1 / float(max(system.delays, default=1))
    out: list[complex] = []
    distinct: list[complex] = []
    for root in found:
        if all(abs(root - other) > CLUSTER * (abs(root) + unit) for other in distinct):
            distinct.append(root)
    turn = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)
    for root in distinct:
        others = [abs(root - other) for other in distinct if other != root]
        radius = 0.2 * min([*others, abs(root) + unit])
        values = system.transfer(root + radius * turn)[:, 0, 0]
        size = np.abs(values).mean()
        most = int((np.abs(found - root) <= CLUSTER * (np.abs(root) + unit)).sum())
        # a_k, the coefficient of (s − root)^−(k+1), relative to |H| on the circle.
        order = [abs((values * turn ** (k + 1)).mean()) > 1e-9 * size for k in range(most)]
        out += [root] * max((k + 1 for k in range(most) if order[k]), default=0)
    return _ordered(np.array(out, complex))


def delays_in_loops(system: DelaySystem) -> DelaySystem:
    """The autonomous system without the delay channels that do not act on themselves.

    They make the characteristic matrix block triangular and leave its determinant alone.
    """
    n, r, p, m = len(system.A), system.inputs, system.outputs, len(system.delays)
    reach = np.zeros((n + m, n + m), bool)
    reach[:n, :n], reach[:n, n:] = system.A != 0, system.B[:, r:] != 0
    reach[n:, :n], reach[n:, n:] = system.C[p:] != 0, system.D[p:, r:] != 0
    for _ in range((n + m).bit_length()):
        reach = reach | (reach @ reach)
    w = np.flatnonzero(np.diag(reach)[n:])
    B, C, D = system.B[:, r + w], system.C[p + w], system.D[np.ix_(p + w, r + w)]
    return DelaySystem(system.A, B, C, D, tuple(system.delays[j] for j in w))


def _discretised(system: DelaySystem, nodes: int) -> Complex:
    """Eigenvalues of the system with each delay as a transport equation on Chebyshev nodes."""
    n, r, p, m = len(system.A), system.inputs, system.outputs, len(system.delays)
    derivative = _differentiation(nodes)
    # φ_j(θ) = z_j(t + θ) on nodes −τ … 0; the last, φ_j(0) = z_j, is eliminated.
    size = n + m * nodes
    matrix = np.zeros((size, size))
    late = np.zeros((m, size))  # w_j = φ_j(−τ_j), the first node
    for j in range(m):
        late[j, n + j * nodes] = 1.0
    matrix[:n, :n] = system.A
    matrix[:n] += system.B[:, r:] @ late
    now = system.D[p:, r:] @ late
    now[:, :n] += system.C[p:]
    for j, tau in enumerate(system.delays):
        rows = slice(n + j * nodes, n + (j + 1) * nodes)
        slope = derivative[:-1] * (2 / float(tau))
        matrix[rows, rows] += slope[:, :-1]
        matrix[rows] += np.outer(slope[:, -1], now[j])
    return np.linalg.eigvals(matrix).astype(complex)


def _differentiation(nodes: int) -> NDArray[np.float64]:
    """The differentiation matrix on nodes + 1 Chebyshev points of [−1, 1], ascending."""
    x = -np.cos(np.pi * np.arange(nodes + 1) / nodes)
    c = np.where((np.arange(nodes + 1) % nodes) == 0, 2.0, 1.0) * (-1.0) ** np.arange(nodes + 1)
    gaps = x[:, None] - x[None, :] + np.eye(nodes + 1)
    matrix = np.outer(c, 1 / c) / gaps
    return np.asarray(matrix - np.diag(matrix.sum(axis=1)))


def _log_slope(system: DelaySystem, at: Complex) -> Complex:
    """d/ds log det characteristic(s) = tr(M⁻¹ M′); infinite on a root."""
    matrix, slope = system.characteristic(at), system.characteristic_slope(at)
    singular = np.abs(np.linalg.det(matrix)) == 0
    matrix[singular] = np.eye(matrix.shape[-1])
    out = np.trace(np.linalg.solve(matrix, slope), axis1=-2, axis2=-1)
    return np.where(singular, np.inf, out)


def _polished(system: DelaySystem, start: Complex) -> tuple[Complex, NDArray[np.bool_]]:
    """Newton's method from each candidate: where it ended, and whether it converged."""
    at = start.copy()
    step = np.full(at.shape, np.inf, complex)
    # Roots far left have e^{−sτ} too large for doubles; candidates there are not roots anyway.
    tau = max(float(delay) for delay in system.delays)
    at = np.where(at.real * tau < -300, -300 / tau + 1j * at.imag, at)
    with np.errstate(all="ignore"):
        for _ in range(40):
            step = np.nan_to_num(1 / _log_slope(system, at), nan=0.0, posinf=0.0, neginf=0.0)
            at = at - step
            at = np.where(at.real * tau < -300, start, at)
            if (np.abs(step) <= 1e-15 * (np.abs(at) + 1e-300)).all():
                break
    near = np.abs(at - start) <= 0.2 * (np.abs(start) + 1 / tau)
    return at, (np.abs(step) <= 1e-6 * (np.abs(at) + 1 / tau)) & near


def _distinct(system: DelaySystem, at: Complex, converged: NDArray[np.bool_]) -> list[complex]:
    """Merge approximations of one root and repeat it as often as a contour integral says."""
    unit = 1 / max(float(delay) for delay in system.delays)
    left = list(at[converged])
    out: list[complex] = []
    while left:
        first = left.pop(0)
        close = [b for b in left if abs(b - first) <= CLUSTER * (abs(first) + unit)]
        if not close:
            out.append(_real_if_close(first, unit))
            continue
        left = [b for b in left if b not in close]
        gap = min((abs(b - first) for b in left), default=unit)
        count, mean = _enclosed(
            system, complex(np.mean([first, *close])), min(0.3 * gap, 0.05 * unit)
        )
        out += [_real_if_close(first if count == 1 else mean, unit)] * max(count, 1)
    return list(_ordered(np.array(out, complex)))


def _enclosed(system: DelaySystem, centre: complex, radius: float) -> tuple[int, complex]:
    """How many roots lie in a circle, and their mean, by the argument principle."""
    turn = np.exp(2j * np.pi * (np.arange(64) + 0.5) / 64)
    weight = _log_slope(system, centre + radius * turn) * radius * turn / 64
    count = round(float(weight.sum().real))
    return count, centre + complex((weight * radius * turn).sum()) / max(count, 1)


def _real_if_close(root: complex, unit: float) -> complex:
    return complex(root.real, 0.0) if abs(root.imag) < 1e-9 * (abs(root) + unit) else root


def _ordered(roots: Complex) -> Complex:
    return roots[np.lexsort((roots.imag, np.abs(roots.imag).round(9), -roots.real.round(9)))]


def _first(roots: Complex, n: int) -> Complex:
    roots = _ordered(roots)
    if 0 < n < len(roots) and roots[n - 1].imag < 0:
        pair = np.abs(roots[n] - roots[n - 1].conj()) < 1e-6 * (1 + np.abs(roots[n]))
        n += int(pair)
    return roots[:n]
