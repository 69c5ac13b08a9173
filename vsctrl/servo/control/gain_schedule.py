"""Gains that are more than a number: adaptive, eased in, and with an integral.

The feedback is ``−λ(e) (L̂⁺ẽ + (1/Tᵢ) Σ L̂⁺ẽ Tₛ)`` with ``ẽ = e − e(0) exp(−μ t)``. Each part is left
out where the scenario has none of it, and then this is ``−λ L̂⁺e``. What is summed up is the twist
that the error asks for, not the error itself: points that come and go leave no sums behind.

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
    """The gains of a law that are more than a number; call its parts once a frame, in order."""

    def __init__(self, law: "LawTable", period: float) -> None:
        self._law = law
        self._period = period
        self._first: Array | None = None
        self._sum = np.zeros(6)

    @classmethod
    def of(cls, law: "LawTable", period: float) -> "Shaping | None":
        """The shaping of a law, or None where its feedback is −λ L̂⁺e."""
        if law.smooth is None and law.T_i is None and law.lam_zero is None:
            return None
        return cls(law, period)

    def eased(self, e: Array, t: float) -> Array:
        """ẽ at time t (s), where e is the error: (m,) → (m,)."""
        if self._law.smooth is None:
            return e
        if self._first is None:
            self._first = e
        return e - self._first * math.exp(-self._law.smooth * t)

    def factor(self, e: Array) -> float:
        """λ(e)/λ, by the error (m,) of all that is seen."""
        law = self._law
        if law.lam_zero is None or law.lam_slope is None:
            return 1.0
        size = float(np.abs(e).max(initial=0.0))
        return adaptive(law.lam, law.lam_zero, law.lam_slope, size) / law.lam

    def summed(self, asked: Array, held: bool) -> Array:
        """``(1/Tᵢ) Σ L̂⁺ẽ Tₛ`` up to the frame that asks for L̂⁺ẽ, (6,) → (6,).

        held: the robot does less than it was told, so that the integral waits (anti-windup).
        """
        if self._law.T_i is None:
            return np.zeros(6)
        if not held:
            self._sum = self._sum + self._period * asked
        return self._sum / self._law.T_i

    @property
    def sums(self) -> bool:
        """Whether there is an integral."""
        return self._law.T_i is not None
