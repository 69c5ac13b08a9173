"""Newton's method on the characteristic matrix, and how far rounding lets it see.

Of a root s of det M(s) the rounding of M leaves open a disc: with the null vectors uᴴM = 0, Mv = 0
its radius is

    ρ = ε Σᵢⱼ |uᵢ| Sᵢⱼ |vⱼ| / |uᴴ M′(s) v|,   S = Σ |terms| of each entry of M,

whatever the units of time and of the signals. It grows without bound where roots merge.
Source: F. Tisseur, "Backward error and condition of polynomial eigenvalue problems", Linear Algebra
Appl. 309 (2000), for matrices that are not polynomials.
"""

from __future__ import annotations

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.realisation.delay_system import DelaySystem

EPS = 2.2e-16
MOST_STEPS = 50
NOISE = 0.15  #: relative doubt of det M beyond which its argument says nothing
FARTHEST = 300.0  #: −Re s times the longest delay; further left e^{−sτ} nears what a double holds


def log_slope(system: DelaySystem, s: Complex) -> Complex:
    """d/ds log det characteristic(s) = tr(M⁻¹ M′); infinite on a root."""
    matrix, slope = system.characteristic_and_slope(s)
    try:
        return np.asarray(np.trace(np.linalg.solve(matrix, slope), axis1=-2, axis2=-1))
    except np.linalg.LinAlgError:  # one of them is on a root to the last digit
        singular = np.linalg.det(matrix) == 0
        matrix[singular] = np.eye(matrix.shape[-1])
        out = np.trace(np.linalg.solve(matrix, slope), axis1=-2, axis2=-1)
        return np.where(singular, np.inf, out)


def polished(system: DelaySystem, start: Complex) -> tuple[Complex, Array]:
    """Where Newton's method from each start ended, and the length of its last step (rad/s).

    Those that still took long steps did not start near a root and are left out; near a multiple
    root each step is a fraction of the last, until rounding makes them grow again.
    """
    tau, rate = float(system.tau.max(initial=0.0)), rate_of(system)
    out_of_reach = start.real * tau < -FARTHEST
    roots = start[~out_of_reach & np.isfinite(start)]
    step = np.full(roots.shape, np.inf)
    active = np.arange(len(roots))
    with np.errstate(all="ignore"):
        for count in range(MOST_STEPS):
            if not len(active):
                break
            slope = log_slope(system, roots[active])
            new = np.where(np.isfinite(1 / slope), 1 / slope, 0.0)
            longer = np.abs(new) > np.abs(step[active])
            lost = longer & (step[active] < 0.02 * np.abs(roots[active])) & (count > 2)
            active, new = active[~lost], new[~lost]
            moved = roots[active] - new
            inside = moved.real * tau >= -FARTHEST
            step[active] = np.where(inside, np.abs(new), np.inf)
            active, moved = active[inside], moved[inside]
            roots[active] = moved
            on = step[active] > 0.5 * EPS * np.abs(moved)
            if count >= 12:
                on &= step[active] <= 0.3 * np.abs(moved) + 1e-3 * rate
            active = active[on]
    good = (step <= 0.01 * np.abs(roots)) | (step + np.abs(roots) < 1e-8 * rate)
    return roots[good], step[good]


def resolution(system: DelaySystem, s: Complex) -> Array:
    """ρ, how far from s (rad/s) a root may be whose last Newton step was rounding."""
    if not len(s):
        return np.zeros(0)
    matrix, slope = system.characteristic_and_slope(s)
    size = system.rounding(s)
    with np.errstate(all="ignore"):
        for axis in (-1, -2, -1, -2):
            # Units of signals and equations are nobody's business.
            scale = 1 / np.maximum(size.max(axis=axis, keepdims=True), 1e-300)
            matrix, slope, size = matrix * scale, slope * scale, size * scale
        left, _, right = np.linalg.svd(matrix)
        u, v = left[:, :, -1].conj(), right[:, -1, :].conj()
        doubt = np.einsum("ki,kij,kj->k", np.abs(u), size, np.abs(v))
        grows = np.abs(np.einsum("ki,kij,kj->k", u, slope, v))
        rho = EPS * (doubt / grows + np.abs(s))
    return np.where(np.isfinite(rho), rho, np.inf)


def log_slope_and_doubt(system: DelaySystem, s: Complex) -> tuple[Complex, Array]:
    """`log_slope`, and the relative error that rounding of M makes in det M: ε Σ |M⁻¹|ᵀ S.

    Errors: `LinAlgError` on a root.
    """
    matrix, slope = system.characteristic_and_slope(s)
    inverse = np.linalg.inv(matrix)
    doubt = EPS * np.einsum("kji,kij->k", np.abs(inverse), system.rounding(s))
    return np.einsum("kji,kij->k", inverse, slope), np.asarray(doubt, float)


def rate_of(system: DelaySystem) -> float:
    """A rate of the system (rad/s), for what has none of its own: 1/τ of the longest delay."""
    if system.delays:
        return 1 / float(max(system.delays))
    return float(np.abs(system.A).max(initial=0.0)) or 1.0
