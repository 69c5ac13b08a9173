"""How many roots of a loop with one delay lie right of a line, however often e^{−sτ} turns.

Along the line det M = det(sI − A) (1 − x) with x = e^{−sτ} r(s), r a rational function. Where
|x| < 1 the factor 1 − x turns by no more than its ends say, and where |x| > 1 as x itself does,
which is known: so that what counts is where |r| passes e^{στ}, the imaginary eigenvalues of a
Hamiltonian matrix.
Source: K. Walton, J. E. Marshall, IEE Proc. D 134 (1987) 101–107; S. Boyd, V. Balakrishnan,
P. Kabamba, Math. Control Signals Systems 2 (1989) 207–219.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.linalg import eigvals
from scipy.optimize import brentq

from vsctrl.arrays import Array
from vsctrl.diagram.realisation.delay_system import DelaySystem

ON_ROOT = 1e-7  #: |1 − x| below which the line may pass a root on either side
SAME = 1e-6  #: relative, within which two frequencies are looked at as one


def count_of_one_delay(system: DelaySystem, sigma: float) -> int | None:
    """The number right of Re s = sigma (rad/s); None for several delays, and where rounding rules.

    Retarded systems only: the delay does not feed through to itself.
    """
    B2, C2, D22 = system.inner
    if len(system.delays) != 1 or D22.any():
        return None
    tau, n = float(system.tau[0]), len(system.A)
    A, b, c = system.A - sigma * np.eye(n), B2, C2 * math.exp(-sigma * tau)
    poles = np.linalg.eigvals(A)
    zeros = eigvals(np.block([[A, b], [c, 0.0]]), np.diag([1.0] * n + [0.0]))
    zeros = zeros[np.isfinite(zeros)]

    def r(omega: float) -> complex:
        return complex((c @ np.linalg.solve(1j * omega * np.eye(n) - A, b.astype(complex)))[0, 0])

    def turned(start: float, end: float) -> float:
        """arg r from one frequency to another."""
        ways = [np.angle((1j * end - z) / (1j * start - z)).sum() for z in (zeros, poles)]
        return float(ways[0] - ways[1])

    try:
        at = _crossings(A, b, c, r)
        x = np.array([np.exp(-1j * tau * w) * r(w) for w in at])
        sides = [abs(r(w)) > 1 for w in _between(at)]
    except np.linalg.LinAlgError:
        return None
    if np.abs(1 - x).min() < ON_ROOT:
        return None
    total = 0.0
    for k, (start, end) in enumerate(pairwise(at)):
        if sides[k]:
            ends = np.angle(1 - 1 / x[k : k + 2])
            total += turned(start, end) - tau * (end - start) + float(ends[1] - ends[0])
        else:
            total += float(np.angle(1 - x[k + 1]) - np.angle(1 - x[k]))
    if sides[-1]:  # beyond all crossings r falls to 0
        return None
    total -= float(np.angle(1 - x[-1]))
    count = int((poles.real > 0).sum()) - total / math.pi
    return round(count) if abs(count - round(count)) < 0.01 and count > -0.5 else None


def _crossings(A: Array, b: Array, c: Array, r: Callable[[float], complex]) -> Array:
    """0 and the frequencies (rad/s) at which |r| passes 1, by rising ω."""
    hamiltonian = np.block([[A, b @ b.T], [-c.T @ c, -A.T]])
    omega = np.sort(np.abs(np.linalg.eigvals(hamiltonian).imag))
    omega = omega[omega > 0]
    if not len(omega):
        return np.zeros(1)
    omega = omega[np.diff(omega, prepend=0.0) > SAME * omega]
    # |r| passes 1 at no other place, so that between two of them one look is enough.
    looks = [0.0, *np.sqrt(omega[:-1] * omega[1:]), 2 * omega[-1]]
    levels = [abs(r(w)) - 1 for w in looks]
    found = [
        float(brentq(lambda w: abs(r(w)) - 1, low, high, xtol=1e-300, rtol=1e-15))
        for low, high, one, other in zip(looks, looks[1:], levels, levels[1:], strict=False)
        if (one > 0) != (other > 0)
    ]
    return np.array([0.0, *found])


def _between(at: Array) -> Array:
    """A frequency in each interval, and one beyond the last."""
    if len(at) == 1:
        return np.ones(1)
    inner = np.sqrt(np.maximum(at[:-1], at[1] * 1e-3) * at[1:])
    return np.append(inner, 2 * at[-1])
