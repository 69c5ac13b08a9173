"""Rigid motions by SciPy's dense matrix functions: no formula of Rodrigues, nothing of vsctrl."""

import numpy as np
from scipy.linalg import logm


def hat(T):
    """The 4×4 generator of a twist (V, Ω)."""
    vx, vy, vz, x, y, z = T
    return np.array([[0, -z, y, vx], [z, 0, -x, vy], [-y, x, 0, vz], [0, 0, 0, 0]])


def vee(A):
    """The twist (V, Ω) of a 4×4 generator."""
    return np.array([*A[:3, 3], A[2, 1], A[0, 2], A[1, 0]])


def log(M):
    """The twist whose exponential is the rigid motion M, of less than half a turn."""
    return vee(np.real(logm(M)))


def carried(M, T):
    """Ad(M) T, from hat(Ad(M) T) = M hat(T) M⁻¹."""
    return vee(M @ hat(T) @ np.linalg.inv(M))
