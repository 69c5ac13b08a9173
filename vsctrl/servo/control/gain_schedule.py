"""Gains that are more than a number: adaptive, smoothly started, and with an integral.

The feedback is ``−λ(e) (L̂⁺ẽ + (1/Tᵢ) Σ L̂⁺ẽ Tₛ)`` with ``ẽ = e − e(0) exp(−μ t)``. Each part is left
out where the scenario has none of it, and then this is ``−λ L̂⁺e``. What is summed up is the twist
that the error asks for, not the error itself: points that come and go leave no sums behind.

Sources: the adaptive gain is the curve of ViSP (vpAdaptiveGain) over another argument: ViSP takes
the greatest |L̂⁺e|, in m and rad whatever the features, this law the greatest |e|, in px for points
(in m and rad with ``scheme = "pose"``). So its constants λ'₀ are not ViSP's: (4, 0.4, 30) of ViSP,
copied, would fall by 30 s⁻¹ a pixel and be 0.4 s⁻¹ at any error that is seen. The smooth start
follows Mansard and Chaumette, Task sequencing for high-level sensor-based control, IEEE Trans.
Robotics 23 (2007), who ease the task e(0), as here; ViSP eases the velocity, (L̂⁺e)(0). Both are
one while L̂ stays as it was at the start.
"""

import math

import numpy as np

from vsctrl.arrays import Array


def adaptive(lam: float, lam_zero: float, slope: float, size: float) -> float:
    """``λ(x) = (λ₀ − λ) exp(−λ'₀ x/(λ₀ − λ)) + λ``: λ₀ at no error, λ at a great one.

    lam, lam_zero: s⁻¹; slope: λ'₀ > 0, s⁻¹ per unit of x; size: x, the greatest |e|, px for points.
    """
    span = lam_zero - lam
    return span * math.exp(-slope / span * size) + lam


class GainSchedule:
    """The gains of a law that are more than a number; call its parts once a frame, in order.

    lam: λ in s⁻¹; period: Tₛ in s; smooth: μ in s⁻¹, T_i: Tᵢ in s, lam_zero: λ₀ in s⁻¹ and
    lam_slope: λ'₀, each None where the law has none.
    """

    def __init__(
        self,
        lam: float,
        period: float,
        *,
        smooth: float | None = None,
        T_i: float | None = None,
        lam_zero: float | None = None,
        lam_slope: float | None = None,
    ) -> None:
        self._lam, self._period = lam, period
        self._smooth, self._T_i = smooth, T_i
        self._lam_zero, self._lam_slope = lam_zero, lam_slope
        self._first: Array | None = None
        self._sum = np.zeros(6)

    def smooth_started(self, e: Array, t: float) -> Array:
        """ẽ at time t (s), where e is the error: (m,) → (m,)."""
        if self._smooth is None:
            return e
        if self._first is None:
            self._first = e
        return e - self._first * math.exp(-self._smooth * t)

    def factor(self, e: Array) -> float:
        """λ(e)/λ, by the error (m,) of all that is seen."""
        if self._lam_zero is None or self._lam_slope is None:
            return 1.0
        size = float(np.abs(e).max(initial=0.0))
        return adaptive(self._lam, self._lam_zero, self._lam_slope, size) / self._lam

    def integral(self, wanted: Array, saturated: bool) -> Array:
        """``(1/Tᵢ) Σ L̂⁺ẽ Tₛ`` up to the frame that wants L̂⁺ẽ, (6,) → (6,).

        saturated: the robot does less than its command, so that the integral waits (anti-windup).
        """
        if self._T_i is None:
            return np.zeros(6)
        if not saturated:
            self._sum = self._sum + self._period * wanted
        return self._sum / self._T_i

    @property
    def integrates(self) -> bool:
        """Whether there is an integral."""
        return self._T_i is not None
