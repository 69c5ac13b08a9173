"""What the law believes of its camera: focal length, principal point and depths, right or wrong.

These errors enter L̂ only. What s*(t) was computed with is a matter of ``plan``.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.features.feature_sets import Measures, measures

if TYPE_CHECKING:
    from vsctrl.servo.scenario import Scenario

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """L̂ as the law computes it: ``L̂ = L(X + c, Ẑ; F̂)`` with ``Ẑ = ρ Z``, ``F̂ = φ F``.

    camera: with F̂; features: that the law servoes on, of that camera; shift: (2p,), c in px at
    every point, or None; ratios: ρ of every point, a number or (p,).
    """

    camera: Camera
    features: Measures
    shift: Array | None
    ratios: Array | float

    @classmethod
    def of(cls, scenario: "Scenario") -> "Belief":
        """The belief of a scenario's law. Raises InputError for features that do not exist."""
        calibration, p = scenario.calibration, len(scenario.target.points)
        phi = calibration.focal_ratio
        camera = Camera(phi * scenario.camera.Fx, phi * scenario.camera.Fy)
        ratios: Array | float = scenario.law.depth_ratio
        if calibration.depth_ratios is not None:
            ratios = ratios * np.array(calibration.depth_ratios)
        centre = calibration.centre_px
        return cls(
            camera=camera,
            features=measures(scenario.law.features, camera, p),
            shift=np.tile(centre, p) if any(centre) else None,
            ratios=ratios,
        )

    def interaction(self, image: Array, believed: Array) -> Array:
        """L̂ of images (..., 2p) in px with depths Ẑ (..., p) in m: (..., m, 6)."""
        if self.shift is not None:
            image = image + self.shift
        return self.features.interaction(image, believed)
