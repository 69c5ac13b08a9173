"""Characteristic roots of a delay system: the rightmost ones, polished, none split from its pair.

Each delay channel is a transport equation; on Chebyshev nodes the whole system becomes one matrix
whose rightmost eigenvalues are close to the rightmost roots. Newton's method on the exact
characteristic matrix then polishes them, and a contour integral settles what a cluster is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vsctrl.arrays import Complex
from vsctrl.checks import is_whole
from vsctrl.diagram.numerics.chebyshev import differentiation_matrix
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.reduction import delays_in_loops
from vsctrl.errors import InputError, LimitError

Real = NDArray[np.float64]

CLUSTER = 1e-5  #: relative distance below which two approximations may be one multiple root


def rightmost(system: DelaySystem, n: int) -> Complex:
    """The n rightmost roots of det characteristic(s) = 0, by falling real part, with multiplicity.

    One more is given where the nth would be split from its conjugate; fewer where the system has
    no more. Simple roots are right to about 1e-12 relative; of m roots in one place each is known
    to ε^{1/m} only, whatever the method (1e-8 for a double root, 2e-3 for a sixfold one), as
    rounding the coefficients by ε parts them so far; their mean is better, and stands for all.
    """
    _check_number(n)
    system = delays_in_loops(system)
    if not system.delays:
        return _first(np.linalg.eigvals(system.A).astype(complex), n)
    # With the longest delay as the unit of time nothing depends on the user's units.
    unit = float(max(system.delays))
    system = system.scaled(unit)
    roots: list[complex] = []
    for nodes in (20 + 3 * n, 40 + 6 * n, 80 + 12 * n):
        candidates = _ordered(_discretised(system, nodes))[: 4 * n + 12]
        roots = _distinct(system, *_polished(system, candidates))
        if len(roots) >= n or len(system.A) == 0:
            break
    return _first(np.array(roots, complex), n) / unit


def _check_number(n: object) -> None:
    if not is_whole(n) or n < 0:
        raise InputError(f"poles: n = {n!r} is not usable; give a whole number of 0 or more.")


def poles(system: DelaySystem, n: int) -> Complex:
    """The n rightmost poles of a one-input, one-output system: those roots that its response shows.

    A root that cancels against a zero, as the plant's own in a perfect Smith predictor, leaves no
    residue: the transfer function is integrated round each, order by order. Accuracy: see
    `rightmost`; a pole of order m is known to ε^{1/m}.
    Errors: `LimitError` for more than can be worked out.
    """
    check_roots(system, n)
    _check_number(n)
    hidden = 0
    while True:
        roots = rightmost(system, n + hidden)
        shown = _controllable_and_observable(system, roots)
        missing = min(n, len(roots)) - len(shown)
        if missing <= 0 or len(roots) < n + hidden:
            return _first(shown, n)
        hidden += missing


def _controllable_and_observable(system: DelaySystem, roots: Complex) -> Complex:
    """The roots that are poles of the transfer function, as often as their order there."""
    unit = 1 / float(max(system.delays, default=1))
    out: list[complex] = []
    distinct: list[complex] = []
    for root in roots:
        if all(abs(root - other) > CLUSTER * (abs(root) + unit) for other in distinct):
            distinct.append(root)
    turn = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)
    for root in distinct:
        others = [abs(root - other) for other in distinct if other != root]
        radius = 0.2 * min([*others, abs(root) + unit])
        values = system.transfer(root + radius * turn)[:, 0, 0]
        size = np.abs(values).mean()
        most = int((np.abs(roots - root) <= CLUSTER * (np.abs(root) + unit)).sum())
        # a_k, the coefficient of (s − root)^−(k+1), relative to |H| on the circle.
        order = [abs((values * turn ** (k + 1)).mean()) > 1e-9 * size for k in range(most)]
        out += [root] * max((k + 1 for k in range(most) if order[k]), default=0)
    return _ordered(np.array(out, complex))


def _discretised(system: DelaySystem, nodes: int) -> Complex:
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
    return np.linalg.eigvals(matrix).astype(complex)


def _log_slope(system: DelaySystem, s: Complex) -> Complex:
    """d/ds log det characteristic(s) = tr(M⁻¹ M′); infinite on a root."""
    matrix, slope = system.characteristic_and_slope(s)
    try:
        return np.asarray(np.trace(np.linalg.solve(matrix, slope), axis1=-2, axis2=-1))
    except np.linalg.LinAlgError:  # one of them is on a root to the last digit
        singular = np.linalg.det(matrix) == 0
        matrix[singular] = np.eye(matrix.shape[-1])
        out = np.trace(np.linalg.solve(matrix, slope), axis1=-2, axis2=-1)
        return np.where(singular, np.inf, out)


def _polished(system: DelaySystem, start: Complex) -> tuple[Complex, Complex]:
    """Newton's method from each candidate: where it ended near its start, and where it stalled.

    Near a multiple root rounding stops it before it is there.
    """
    roots = start.copy()
    step = np.full(roots.shape, np.inf, complex)
    # Roots far left have e^{−sτ} too large for doubles; candidates there are not roots anyway.
    tau = system.tau.max()
    roots = np.where(roots.real * tau < -300, -300 / tau + 1j * roots.imag, roots)
    active = np.arange(len(roots))
    with np.errstate(all="ignore"):
        for count in range(40):
            slope = _log_slope(system, roots[active])
            new = np.where(np.isfinite(1 / slope), 1 / slope, 0.0)
            small = 0.02 * (np.abs(roots[active]) + 1 / tau)
            # Close to a multiple root rounding makes steps grow again, or the matrix singular.
            lost = (np.abs(step[active]) < small) & (
                (np.abs(new) > np.abs(step[active])) | ((new == 0) & (np.abs(step[active]) > 1e-6))
            )
            active, new = active[~lost], new[~lost]
            step[active] = new
            roots[active] -= step[active]
            roots[active] = np.where(roots[active].real * tau < -300, start[active], roots[active])
            # A step this small was of a simple root, and squared it is below rounding; at a
            # multiple root each step is a fraction of the last, and rounding ends them. One that
            # still takes long steps did not start near a root.
            on = np.abs(step[active]) > 1e-10 * (np.abs(roots[active]) + 1e-300)
            if count >= 8:
                on &= np.abs(step[active]) <= 0.02 * (np.abs(roots[active]) + 1 / tau)
            active = active[on]
            if not len(active):
                break
    near = np.abs(roots - start) <= 0.2 * (np.abs(start) + 1 / tau)
    step = np.abs(step) / (np.abs(roots) + 1 / tau)
    return roots[near & (step <= 1e-6)], roots[near & (step > 1e-6) & (step <= 0.02)]


def _distinct(system: DelaySystem, roots: Complex, stalled: Complex) -> list[complex]:
    """Merge approximations of one root and repeat it as often as a contour integral says."""
    unit = 1 / system.tau.max()
    distance = np.abs(roots[:, None] - roots) / (np.abs(roots) + unit)
    unlike = ((distance > CLUSTER) & (distance < 0.01)).any(0)
    remaining, doubtful = list(roots), [*stalled, *roots[unlike]]
    out: list[complex] = []
    while doubtful:
        first = doubtful[0]
        every = np.array([*doubtful, *remaining])
        inside = np.abs(every - first) <= 0.03 * (abs(first) + unit)
        group = list(every[inside])
        doubtful = [b for b in doubtful if b not in group]
        if len(group) == 1:
            continue
        centre = complex(every[inside].mean())
        radius = max(3 * float(np.abs(every[inside] - centre).max()), 0.05 * unit)
        radius = min(radius, 0.6 * float(np.abs(every[~inside] - centre).min(initial=np.inf)))
        count, mean = _enclosed(system, centre, radius)
        simple: list[complex] = []
        for b in (b for b in remaining if b in group):
            if all(abs(b - other) > CLUSTER * (abs(b) + unit) for other in simple):
                simple.append(b)
        if len(simple) < count <= len(group) and count > 1:
            remaining = [b for b in remaining if b not in group]
            out += [_real_if_close(mean, unit)] * count
    while remaining:
        first = remaining.pop(0)
        close = [b for b in remaining if abs(b - first) <= CLUSTER * (abs(first) + unit)]
        if not close:
            out.append(_real_if_close(first, unit))
            continue
        remaining = [b for b in remaining if b not in close]
        gap = min((abs(b - first) for b in remaining), default=unit)
        count, mean = _enclosed(
            system, complex(np.mean([first, *close])), min(0.3 * gap, 0.05 * unit)
        )
        out += [_real_if_close(first if count == 1 else mean, unit)] * max(count, 1)
    return list(_ordered(np.array(out, complex)))


def _enclosed(system: DelaySystem, centre: complex, radius: float) -> tuple[int, complex]:
    """How many roots lie in a circle, and their mean, by the argument principle."""
    turn = np.exp(2j * np.pi * (np.arange(64) + 0.5) / 64)
    with np.errstate(all="ignore"):
        weight = _log_slope(system, centre + radius * turn) * radius * turn / 64
    if not np.isfinite(weight).all() or abs(weight.sum() - round(weight.sum().real)) > 0.05:
        return 0, centre
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


#: delays times roots beyond which their matrix, of 12 times that, takes minutes and gigabytes
MOST_ROOTS = 2000


def check_roots(system: DelaySystem, n: object) -> None:
    """Refuse a number of roots whose discretised matrix would not fit the machine.

    What is no number of roots is left to `rightmost`. Errors: `LimitError`.
    """
    count = len(delays_in_loops(system).delays)
    if is_whole(n) and count and n * count > MOST_ROOTS:
        many = f"{n}" if n < 10**9 else "more than 10⁹"
        raise LimitError(
            f"poles: n = {many} roots of a loop with {count} delay{'s' if count > 1 else ''} are "
            f"too many to work out; ask for {MOST_ROOTS // count} or fewer."
        )
