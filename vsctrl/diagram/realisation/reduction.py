"""A delay system without what its roots do not depend on."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.numerics.graphs import closure, on_cycles
from vsctrl.diagram.realisation.delay_system import DelaySystem


def pruned(system: DelaySystem) -> DelaySystem:
    """Drop the states and delay channels that the inputs do not reach or the outputs do not see."""
    n, r, p = len(system.A), system.inputs, system.outputs
    depends = closure(_dependences(system))
    driven = np.concatenate([system.B[:, :r].any(1), system.D[p:, :r].any(1)])
    shown = np.concatenate([system.C[:p].any(0), system.D[:p, r:].any(0)])
    keep = depends[:, driven].any(1) & depends[shown].any(0)
    x, w = np.flatnonzero(keep[:n]), np.flatnonzero(keep[n:])
    columns, rows = np.r_[0:r, r + w].astype(int), np.r_[0:p, p + w].astype(int)
    A, B = system.A[np.ix_(x, x)], system.B[np.ix_(x, columns)]
    C, D = system.C[np.ix_(rows, x)], system.D[np.ix_(rows, columns)]
    return DelaySystem(A, B, C, D, tuple(system.delays[j] for j in w))


def _dependences(system: DelaySystem) -> Array:
    """At (i, j) how i depends on j: the states come first, then the delay channels."""
    B2, C2, D22 = system.inner
    return np.block([[system.A, B2], [C2, D22]])


def delays_in_loops(system: DelaySystem) -> DelaySystem:
    """The autonomous system without the delay channels that do not act on themselves.

    They make the characteristic matrix block triangular and leave its determinant alone.
    """
    w = np.flatnonzero(on_cycles(_dependences(system))[len(system.A) :])
    B2, C2, D22 = system.inner
    delays = tuple(system.delays[j] for j in w)
    return _merged(DelaySystem(system.A, B2[:, w], C2[w], D22[np.ix_(w, w)], delays))


def _merged(system: DelaySystem) -> DelaySystem:
    """Equal delays that act alike, or delay the same signal, as one, with the same determinant.

    det(I − e^{−sτ} P Q) = det(I − e^{−sτ} Q P). Signals that cancel, as the plant's and the model's
    in a Smith predictor, then do so before e^{−sτ}, which is large far left, multiplies their
    rounding.
    """
    into, out = np.vstack([system.B, system.D]), np.hstack([system.C, system.D])
    for i, j in combinations(range(len(system.delays)), 2):
        if system.delays[i] != system.delays[j]:
            continue
        alike, same = _ratio(into[:, i], into[:, j]), _ratio(out[i], out[j])
        if alike is None and same is None:
            continue
        B, C, D = system.B.copy(), system.C.copy(), system.D.copy()
        if alike is not None:
            C[i], D[i] = C[i] + alike * C[j], D[i] + alike * D[j]
        elif same is not None:
            B[:, i], D[:, i] = B[:, i] + same * B[:, j], D[:, i] + same * D[:, j]
        others = np.delete(np.arange(len(system.delays)), j)
        delays = tuple(system.delays[k] for k in others)
        return _merged(
            DelaySystem(system.A, B[:, others], C[others], D[np.ix_(others, others)], delays)
        )
    return system


def _ratio(one: Array, other: Array) -> float | None:
    """The factor that takes one vector to the other, exactly; None where there is none."""
    first = int(np.flatnonzero(one)[0]) if one.any() else 0
    if one[first] == 0:
        return None
    ratio = float(other[first] / one[first])
    return ratio if (ratio * one == other).all() else None
