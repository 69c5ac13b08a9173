"""Which depths the law assumes: true ones, those at the start, or those estimated in motion.

Called with a measurement each answers Ẑ, (p,) in m; ``of_reference`` is (n, p), that of the
reference images, or None where the estimated ones stand for it. Each has its error ρ, which of
estimated depths is that of the first guess.
"""

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.control.measurement import Measurement
from vsctrl.servo.control.nominal_camera import NominalCamera
from vsctrl.servo.estimation.depth_observer import DepthObserver
from vsctrl.servo.pose import inverse

# What the depth observer assumes of its first guess: a fifth of it, as one standard deviation.
FIRST_GUESS = 0.2
# Noise that it reckons with where the scenario has none (px): rounding must not count as certainty.
LEAST_NOISE = 0.01


class TrueDepths:
    """The true depths of the measured image, times ρ; of the reference its own."""

    def __init__(self, ratios: Array | float, reference: Array) -> None:
        self._ratios = ratios
        self.of_reference = ratios * reference

    def __call__(self, measurement: Measurement) -> Array:
        return self._ratios * measurement.depths


class ConstantDepths:
    """The depths of the reference at the start, times ρ, for ever and for every image."""

    def __init__(self, assumed: Array, frames: int) -> None:
        self._assumed = assumed
        self.of_reference = np.broadcast_to(assumed, (frames, len(assumed)))

    def __call__(self, measurement: Measurement) -> Array:
        return self._assumed


class EstimatedDepths:
    """Depths from motion: the image between two frames, and how the hand says the camera moved.

    They begin with the true ones times ρ; noise_px: of an image coordinate. ``estimates`` and
    ``excitation`` are (frames, p).
    """

    of_reference = None

    def __init__(self, nominal: NominalCamera, noise_px: float, depths: Array, frames: int) -> None:
        first = nominal.ratios * depths
        self._nominal = nominal
        self._observer = DepthObserver(
            nominal.camera.Fx, nominal.camera.Fy, first, max(noise_px, LEAST_NOISE), FIRST_GUESS
        )
        self._before: Array | None = None
        self.estimates = np.tile(first, (frames, 1))
        self.excitation = np.zeros((frames, len(first)))

    def __call__(self, measurement: Measurement) -> Array:
        if measurement.fresh:
            seen = measurement.visible
            if seen is None:
                seen = np.ones(len(measurement.depths), dtype=bool)
            here = measurement.odometry()
            motion = np.eye(4) if self._before is None else inverse(self._before) @ here
            self._observer.update(self._nominal.shifted(measurement.features), motion, seen)
            self._before = here
        self.estimates[measurement.frame :] = self._observer.depths
        self.excitation[measurement.frame :] = self._observer.excitation
        return self._observer.depths


Depths = TrueDepths | ConstantDepths | EstimatedDepths
