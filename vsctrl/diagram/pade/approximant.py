"""The Padé approximant of a delay in balanced state space, put into the delay channels."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from vsctrl.arrays import Array
from vsctrl.diagram.realisation.delay_system import DelaySystem


def pade_delay(tau: float, order: int) -> tuple[Array, Array, Array, Array]:
    """(A, B, C, D) of the all-pass (order, order) Padé model of e^{−τs}, balanced.

    With J skew, J[k, k+1] = 1/√((2k−1)(2k+1)) for k = 1, 2, …, and M = J + e₁e₁ᵀ:
    A = −(2/τ) M⁻¹, B = (2/τ) M⁻¹e₁, C = 2e₁ᵀM⁻¹, D = (−1)^order. `tau` in s, > 0.
    """
    k = np.arange(1, order)
    above = 1 / np.sqrt((2.0 * k - 1) * (2.0 * k + 1))
    M = np.diag(above, 1) - np.diag(above, -1)
    M[0, 0] = 1.0
    e1 = np.eye(order)[:, :1]
    inverse = np.asarray(np.linalg.inv(M), float)
    B, C = (2 / tau) * inverse @ e1, 2 * e1.T @ inverse
    return -(2 / tau) * inverse, B, C, np.array([[(-1.0) ** order]])


def matrices(system: DelaySystem, order: int) -> tuple[Array, Array, Array, Array]:
    """(A, B, C, D) of the delay system with each delay a Padé model of this order, loops closed."""
    r, p = system.inputs, system.outputs
    A, B, C, D = system.A, system.B[:, :r], system.C[:p], system.D[:p, :r]
    if not system.delays:
        return A, B, C, D
    parts = [pade_delay(float(tau), order) for tau in system.delays]
    Ad, Bd, Cd, Dd = (block_diag(*each) for each in zip(*parts, strict=True))
    Bw, Cz, Dzw = system.inner
    Dyw, Dzu = system.D[:p, r:], system.D[p:, :r]
    # w = Cd ξ + Dd z and z = Cz x + Dzu u + Dzw w, solved for z.
    K = np.linalg.inv(np.eye(len(Dzw)) - Dzw @ Dd)
    zx, zxi, zu = K @ Cz, K @ Dzw @ Cd, K @ Dzu
    wx, wxi, wu = Dd @ zx, Cd + Dd @ zxi, Dd @ zu
    A = np.block([[A + Bw @ wx, Bw @ wxi], [Bd @ zx, Ad + Bd @ zxi]])
    C = np.hstack([C + Dyw @ wx, Dyw @ wxi])
    return A, np.vstack([B + Bw @ wu, Bd @ zu]), C, D + Dyw @ wu
