"""Which characteristic roots are poles of a transfer function, and of which order.

H = D + left M⁻¹ right. At a simple root, uᴴM = 0, Mv = 0, the residue is left v · uᴴ right / uᴴM′v:
a pole, unless left v (the output does not show the mode) or uᴴ right (the input does not excite it)
vanishes. How far rounding of M leaves each open is worked out entry by entry, because a mode behind
a delay of many of its time constants is shown by e^{−sτ} ~ 1e-11 of it only, and is a pole still.
Of a multiple root the coefficients of 1/(s − z)ᵏ are integrated round it.
"""

from __future__ import annotations

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.roots.newton import EPS, FARTHEST, rate_of

SAFE = 50.0  #: times what rounding explains, below which a product of vectors is 0


def as_poles(system: DelaySystem, roots: Complex, every: Complex) -> Complex:
    """The roots that are poles of the one-input, one-output system, as often as their order.

    `every` holds all that are known, which circles round some of them are to keep clear of.
    """
    distinct = np.unique(roots)
    out: list[complex] = []
    for root in distinct:
        times = int((roots == root).sum())
        if -root.real * float(system.tau.max(initial=0.0)) > FARTHEST:
            order = times  # e^{−sτ} is too large for a double to judge it by
        elif times == 1:
            order = int(_excited_and_shown(system, complex(root)))
        else:
            gap = float(np.abs(every - root)[every != root].min(initial=np.inf))
            order = _order(system, complex(root), times, gap)
        out += [complex(root)] * order
    return np.array(out, complex)


def _ends(system: DelaySystem, s: Complex) -> tuple[Array, Complex]:
    """(left (n+m,), right (…, n+m)) of H = D + left M⁻¹ right."""
    n = len(system.A)
    right = np.zeros((*s.shape, n + len(system.delays)), complex)
    right[..., :n] = system.B[:, 0]
    right[..., n:] = np.exp(-s[..., None] * system.tau) * system.D[1:, 0]
    return np.concatenate([system.C[0], system.D[0, 1:]]), right


def _excited_and_shown(system: DelaySystem, root: complex) -> bool:
    """Whether neither product of a simple root's residue is explained by rounding."""
    s = np.array([root])
    matrix, slope = (part[0] for part in system.characteristic_and_slope(s))
    size = system.rounding(s)[0]
    left, right = _ends(system, s)
    lag = 1 + abs(root) * float(system.tau.max(initial=0.0))
    with np.errstate(all="ignore"):
        return _differs(matrix, slope, size, left.astype(complex), 1.0) and _differs(
            matrix.T, slope.T, size.T, right[0], lag
        )


def _differs(matrix: Complex, slope: Complex, size: Array, row: Complex, lag: float) -> bool:
    """Whether row · v, Mv = 0, differs from 0 by more than rounding of M and of the row makes.

    (M + δM + M′δs)(v + δv) = 0 with |δM| ≤ ε S gives |row δv| ≤ ε |row N| S |v|, where N is what
    the inverse of M bordered by M′v, which a change of s takes up, has in the place of M.
    """
    v = _null_vector(matrix, size)
    n = len(v)
    bordered = np.zeros((n + 1, n + 1), complex)
    bordered[:n, :n], bordered[:n, n] = matrix, slope @ v
    bordered[n, int(np.argmax(np.abs(v)))] = 1.0
    try:
        inner = np.linalg.solve(bordered.T, np.append(row, 0.0))[:n]
    except np.linalg.LinAlgError:
        return True
    doubt = EPS * (np.abs(inner) @ (size @ np.abs(v)) + lag * np.abs(row) @ np.abs(v))
    return bool(abs(row @ v) > SAFE * doubt)


def _null_vector(matrix: Complex, size: Array) -> Complex:
    """v with Mv = 0, each entry known relative to what makes it, by inverse iteration."""
    rows = 1 / np.maximum(size.max(axis=1), 1e-300)
    columns = 1 / np.maximum((rows[:, None] * size).max(axis=0), 1e-300)
    scaled = rows[:, None] * matrix * columns
    left, _, right = np.linalg.svd(scaled)
    u, v = np.abs(left[:, -1]), right[-1].conj()
    # What is left of M v is then no more than the rounding of that one row.
    weight = u * (rows[:, None] * size * columns @ np.abs(v))
    unit = np.zeros(len(v), complex)
    unit[int(np.argmax(weight))] = 1.0
    try:
        better = np.linalg.solve(scaled, unit)
        better = better + np.linalg.solve(scaled, unit - scaled @ better)
    except np.linalg.LinAlgError:  # singular to the last digit
        better = v
    better = better if np.isfinite(better).all() else v
    better = better * columns
    return np.asarray(better / np.abs(better).max())


def _order(system: DelaySystem, root: complex, most: int, gap: float) -> int:
    """The order of a pole, from H on a circle: aₖ belongs to (s − root)^−(k+1)."""
    radius = min(0.3 * gap, 0.3 * max(abs(root), rate_of(system)))
    turn = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)
    s = root + radius * turn
    left, right = _ends(system, s)
    inverse = np.linalg.inv(system.characteristic(s))
    inner = np.einsum("kij,kj->ki", inverse, right)
    values = inner @ left
    lag = 1 + np.abs(s) * float(system.tau.max(initial=0.0))
    rough = np.einsum("kij,kj->ki", system.rounding(s), np.abs(inner))
    rough = rough + lag[:, None] * np.abs(right)
    doubt = EPS * np.einsum("i,kij,kj->k", np.abs(left), np.abs(inverse), rough)
    doubt = doubt + EPS * np.abs(inner) @ np.abs(left)
    found = [abs((values * turn ** (k + 1)).mean()) > SAFE * doubt.max() for k in range(most)]
    return max((k + 1 for k in range(most) if found[k]), default=0)
