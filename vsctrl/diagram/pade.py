"""The bridge to python-control: every delay channel replaced by a Padé model of one order.

Each delay gets a balanced state-space Padé model of its own, put into its channel before the loop
is closed: that stays well conditioned at orders where polynomials have long lost their digits, and
needs as many states as there are, where L/(1 + L) on transfer functions doubles them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from vsctrl.diagram.delay import DelaySystem
from vsctrl.errors import InputError

if TYPE_CHECKING:
    import control

Array = NDArray[np.float64]


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
    return (
        -(2 / tau) * inverse,
        (2 / tau) * inverse @ e1,
        2 * e1.T @ inverse,
        np.array([[(-1.0) ** order]]),
    )


def pade_model(system: DelaySystem, order: int, **names: Any) -> control.StateSpace:
    """The delay system with every delay channel a Padé model of this order, loops closed.

    Errors: `InputError` for an order that is no whole number from 1 to 40.
    """
    import control

    if isinstance(order, bool) or not isinstance(order, int | np.integer) or not 1 <= order <= 40:
        raise InputError(f"pade: order = {order!r} is not usable; give a whole number 1 to 40.")
    r, p, m = system.inputs, system.outputs, len(system.delays)
    A, B, C, D = system.A, system.B[:, :r], system.C[:p], system.D[:p, :r]
    if m:
        parts = [pade_delay(float(tau), int(order)) for tau in system.delays]
        Ad, Bd, Cd, Dd = (block_diag(*matrices) for matrices in zip(*parts, strict=True))
        Bw, Cz = system.B[:, r:], system.C[p:]
        Dyw, Dzu, Dzw = system.D[:p, r:], system.D[p:, :r], system.D[p:, r:]
        # w = Cd ξ + Dd z and z = Cz x + Dzu u + Dzw w, solved for z.
        K = np.linalg.inv(np.eye(m) - Dzw @ Dd)
        zx, zxi, zu = K @ Cz, K @ Dzw @ Cd, K @ Dzu
        wx, wxi, wu = Dd @ zx, Cd + Dd @ zxi, Dd @ zu
        A = np.block([[A + Bw @ wx, Bw @ wxi], [Bd @ zx, Ad + Bd @ zxi]])
        B = np.vstack([B + Bw @ wu, Bd @ zu])
        C, D = np.hstack([C + Dyw @ wx, Dyw @ wxi]), D + Dyw @ wu
    return control.ss(A, B, C, D, **names)
