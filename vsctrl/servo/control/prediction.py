"""From the late image to the one of now, and to how the target moves.

A predictor takes the features of a late image and the L̂ of the law, and answers with the features
that the law should see now and the share ∂ŝ/∂t of their motion that the target causes, which the
law takes away: ``T = −λ L̂⁺ (ŝ − s*) + L̂⁺ (k_ff ds*/dt − ∂ŝ/∂t)``.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vsctrl import timing
from vsctrl.servo.estimation.image_filter import Estimate, ImageFilter

if TYPE_CHECKING:
    from vsctrl.servo.control.controller import Shown
    from vsctrl.servo.scenario import Scenario

Array = NDArray[np.float64]


class Smith:
    """Adds what the commands of the last τ̂ seconds will have done by now: ``ŝ = s_m + ∫ L̂ T dt``.

    The diagram ``loop.smith()`` in six degrees of freedom, with the sum over the last τ̂ in place
    of its integrator, so that nothing drifts. The target is taken to rest.
    """

    def __init__(self, period: float, latency: float) -> None:
        full, share = timing.split(latency / period)
        # Seconds that each of the last commands acted in that time, the latest first.
        self._shares = period * np.array([1.0] * full + [share] * (share > 0))
        self._commands = np.zeros((len(self._shares), 6))

    def __call__(self, s: Array, L_hat: Array, shown: "Shown", applied: Array) -> Estimate:
        ahead = L_hat @ (self._shares @ self._commands)
        return Estimate(s + ahead, np.zeros_like(s))

    def told(self, T: Array) -> None:
        """The command of this frame, (6,)."""
        if len(self._commands):
            self._commands[1:] = self._commands[:-1]
            self._commands[0] = T


class Kalman:
    """The Kalman filter of ``kalman`` with the camera's own motion ``L̂ T`` as its input."""

    def __init__(self, scenario: "Scenario", latency: float) -> None:
        table, kind = scenario.predictor, scenario.predictor.predictor
        self._filter = ImageFilter(
            "velocity" if kind == "velocity" else "acceleration",
            scenario.vision.period,
            latency,
            table.process,
            table.measurement_px,
        )

    def __call__(self, s: Array, L_hat: Array, shown: "Shown", applied: Array) -> Estimate:
        seen = shown.rows if shown.rows is not None else np.ones(len(s), dtype=bool)
        return self._filter.update(s, shown.fresh, seen, L_hat @ applied)

    def told(self, T: Array) -> None:
        """The command of this frame: not needed, since the hand says how the camera moved."""


Predictor = Smith | Kalman


def predictor_of(scenario: "Scenario") -> Predictor | None:
    """The predictor of a scenario; by default it believes in the true latency."""
    table = scenario.predictor
    latency = scenario.vision.latency if table.tau_hat is None else table.tau_hat
    if table.predictor == "none":
        return None
    if table.predictor == "smith":
        if table.tau_hat is None:
            latency += scenario.robot.dead_time
        # Before the run nothing was commanded, so that no more can have acted than all of it.
        whole_run = (scenario.frames + 1) * scenario.vision.period
        return Smith(scenario.vision.period, min(latency, whole_run))
    return Kalman(scenario, latency)
