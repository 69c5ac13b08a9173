"""From the delayed image to the present one, and to how the target moves.

A predictor takes the features of a delayed image and the L̂ of the law, and answers with the
features that the law should see now and the part ∂ŝ/∂t of their motion that the target causes,
which the law takes away: ``T = −λ L̂⁺ (ŝ − s*) + L̂⁺ (k_ff ds*/dt − ∂ŝ/∂t)``.
"""

import numpy as np

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.servo.control.measurement import Measurement
from vsctrl.servo.estimation.image_filter import Estimate, ImageFilter


class Smith:
    """Adds what the commands of the last τ̂ seconds will have done by now: ``ŝ = s_m + ∫ L̂ T dt``.

    The diagram ``loop.smith()`` in six degrees of freedom, with the sum over the last τ̂ in place
    of its integrator, so that nothing drifts. The target is taken to rest. period, latency: s.
    """

    def __init__(self, period: float, latency: float) -> None:
        full, share = timing.split(latency / period)
        # Seconds that each of the last commands acted in that time, the latest first.
        self._shares = period * np.array([1.0] * full + [share] * (share > 0))
        self._commands = np.zeros((len(self._shares), 6))

    def __call__(
        self, s: Array, L_hat: Array, measurement: Measurement, applied: Array
    ) -> Estimate:
        ahead = L_hat @ (self._shares @ self._commands)
        return Estimate(s + ahead, np.zeros_like(s))

    def commanded(self, T: Array) -> None:
        """The command of this frame, (6,)."""
        if len(self._commands):
            self._commands[1:] = self._commands[:-1]
            self._commands[0] = T


class Kalman:
    """The Kalman filter ``ImageFilter`` with the camera's own motion ``L̂ T`` as its input."""

    def __init__(self, image_filter: ImageFilter) -> None:
        self._filter = image_filter

    def __call__(
        self, s: Array, L_hat: Array, measurement: Measurement, applied: Array
    ) -> Estimate:
        rows = measurement.rows
        seen = rows if rows is not None else np.ones(len(s), dtype=bool)
        return self._filter.update(s, measurement.fresh, seen, L_hat @ applied)

    def commanded(self, T: Array) -> None:
        """The command of this frame: not needed, since the hand says how the camera moved."""


Predictor = Smith | Kalman
