"""Which depths the law believes in: true ones, those at the start, or those seen in motion.

Each with its error ρ, which of observed depths is that of the first guess.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vsctrl.servo.estimation.depth_observer import DepthObserver
from vsctrl.servo.pose import inverse

if TYPE_CHECKING:
    from vsctrl.servo.control.controller import Shown
    from vsctrl.servo.control.nominal_camera import Belief
    from vsctrl.servo.control.reference_image import Plan
    from vsctrl.servo.scenario import Scenario

Array = NDArray[np.float64]

# What the depth observer believes of its first guess: a fifth of it, as one standard deviation.
FIRST_GUESS = 0.2
# Noise that it reckons with where the scenario has none (px): rounding must not count as certainty.
LEAST_NOISE = 0.01


class TrueDepths:
    """The depths of the image that the law is shown, times ρ; of the reference its own."""

    def __init__(self, ratios: Array | float, reference: Array) -> None:
        self._ratios = ratios
        self.of_reference = ratios * reference

    def __call__(self, shown: "Shown") -> Array:
        return self._ratios * shown.depths


class ConstantDepths:
    """The depths of the reference at the start, times ρ, for ever and for every image."""

    def __init__(self, believed: Array, frames: int) -> None:
        self._believed = believed
        self.of_reference = np.broadcast_to(believed, (frames, len(believed)))

    def __call__(self, shown: "Shown") -> Array:
        return self._believed


class SeenDepths:
    """Depths from motion: the image between two frames, and how the hand says the camera moved.

    They begin with the true ones times ρ, so ρ is the error of the first guess; the record of
    estimates and excitation is (frames, p).
    """

    def __init__(self, scenario: "Scenario", belief: "Belief", depths: Array, frames: int) -> None:
        noise = max(scenario.vision.noise_px, scenario.vision.quantum_px / 12**0.5, LEAST_NOISE)
        first = belief.ratios * depths
        self._shift = belief.shift
        self._observer = DepthObserver(
            belief.camera.Fx, belief.camera.Fy, first, noise, FIRST_GUESS
        )
        self._before: Array | None = None
        self.estimates = np.tile(first, (frames, 1))
        self.excitation = np.zeros((frames, len(first)))

    def __call__(self, shown: "Shown") -> Array:
        if shown.fresh:
            visible = shown.visible
            everything = np.ones(len(shown.depths), dtype=bool) if visible is None else visible
            image = shown.features if self._shift is None else shown.features + self._shift
            here = shown.odometry()
            motion = np.eye(4) if self._before is None else inverse(self._before) @ here
            self._observer.update(image, motion, everything)
            self._before = here
        self.estimates[shown.frame :] = self._observer.depths
        self.excitation[shown.frame :] = self._observer.excitation
        return self._observer.depths

    @property
    def of_reference(self) -> None:
        """Not known beforehand: what is observed stands for the depths of the reference too."""
        return None


Depths = TrueDepths | ConstantDepths | SeenDepths


def depths_of(scenario: "Scenario", belief: "Belief", plan: "Plan") -> Depths:
    """The depths Ẑ that the law of a scenario believes in.

    Called with what the law is shown at a frame they answer (p,) in m; ``of_reference`` is (n, p),
    those of the reference images, or None where they are the ones observed.
    """
    frames = len(plan.s)
    if scenario.law.depth == "estimated":
        return SeenDepths(scenario, belief, plan.depths0, frames)
    if scenario.law.depth == "constant":
        return ConstantDepths(belief.ratios * plan.depths0, frames)
    return TrueDepths(belief.ratios, plan.shown.depths)
