"""The motion that the camera is asked to make.

A trajectory answers ``pose(t)`` and ``twist(t)`` for arrays of times; the reference image s*(t) and
its derivative follow from these two through ``camera`` (eq. 16, 17 are special cases).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vsctrl.servo.pose import exp

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ConstantScrew:
    """Motion with a constant twist in the camera frame: translation, rotation or both (eq. 14).

    ``oTc*(t) = oTc0 · exp(T t)``.

    oTc0: (4, 4), the pose at t = 0; T: (6,), (V, Ω) in m/s and rad/s.
    """

    oTc0: Array
    T: Array

    def pose(self, t: ArrayLike) -> Array:
        """Pose at the times t: (...,) in s → (..., 4, 4)."""
        out: Array = self.oTc0 @ exp(np.asarray(t, dtype=np.float64)[..., None] * self.T)
        return out

    def twist(self, t: ArrayLike) -> Array:
        """Twist at the times t: (...,) in s → (..., 6), (V, Ω) in m/s and rad/s."""
        return np.broadcast_to(self.T, (*np.shape(t), 6))
