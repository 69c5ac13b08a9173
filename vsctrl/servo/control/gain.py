"""Gains that are more than a number: adaptive, eased in, and with an integral.

What multiplies L̂⁺ is ``−λ(e) (ẽ + (1/Tᵢ) Σ ẽ Tₛ)`` with ``ẽ = e − e(0) exp(−μ t)``. Each part is
left out where the scenario has none of it, and then this is ``−λ e``.

Sources: the adaptive gain is that of ViSP (vpAdaptiveGain), the smooth start that of Mansard and
Chaumette, Task sequencing for high-level sensor-based control, IEEE Trans. Robotics 23 (2007).
"""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from vsctrl.servo.scenario.experiment import LawTable

Array = NDArray[np.float64]


def adaptive(lam: float, lam_zero: float, slope: float, size: float) -> float:
    """``λ(x) = (λ₀ − λ) exp(−λ'₀ x/(λ₀ − λ)) + λ``: λ₀ at no error, λ at a great one.

    lam, lam_zero: s⁻¹; slope: λ'₀ > 0, s⁻¹ per unit of the error; size: x, the greatest error.
    """
    span = lam_zero - lam
    return span * math.exp(-slope / span * size) + lam


class Shaping:
    """The error as the law weighs it: an integral and a smooth start, frame by frame.

    It evolves: call it once for each frame, in order.
    """

    def __init__(self, law: "LawTable", period: float) -> None:
        self._law = law
        self._period = period
        self._first: Array | None = None
        self._sum: Array | float = 0.0

    @classmethod
    def of(cls, law: "LawTable", period: float) -> "Shaping | None":
        """The shaping of a law, or None where the error is taken as it is."""
        if law.smooth is None and law.T_i is None and law.lam_zero is None:
            return None
        return cls(law, period)

    def __call__(self, e: Array, t: float, held: bool) -> Array:
        """What λ multiplies at time t (s), where e is the error: (m,) → (m,).

        held: the robot does less than it was told, so that the integral waits (anti-windup).
        """
        law = self._law
        out = e
        if law.smooth is not None:
            if self._first is None:
                self._first = e
            out = out - self._first * math.exp(-law.smooth * t)
        if law.T_i is not None:
            if not held:
                self._sum = self._sum + self._period * out
            out = out + self._sum / law.T_i
        if law.lam_zero is not None and law.lam_slope is not None:
            size = float(np.abs(e).max(initial=0.0))
            out = out * (adaptive(law.lam, law.lam_zero, law.lam_slope, size) / law.lam)
        return out
