"""The camera that the law assumes: focal length, principal point and depths, right or wrong.

These errors enter L̂ only. What s*(t) was computed with is a matter of ``reference_image``.
"""

from dataclasses import dataclass

from vsctrl.arrays import Array
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.features.feature_sets import Measures


@dataclass(frozen=True, slots=True, eq=False)
class NominalCamera:
    """L̂ as the law computes it: ``L̂ = L(X + c, Ẑ; F̂)`` with ``Ẑ = ρ Z``, ``F̂ = φ F``.

    camera: with F̂; features: that the law servoes on, of that camera; shift: (2p,), c in px at
    every point, or None; ratios: ρ of every point, a number or (p,).
    """

    camera: Camera
    features: Measures
    shift: Array | None
    ratios: Array | float

    def shifted(self, image: Array) -> Array:
        """An image (..., 2p) in px from the principal point that the law assumes."""
        return image if self.shift is None else image + self.shift

    def interaction(self, image: Array, depths: Array) -> Array:
        """L̂ of images (..., 2p) in px with assumed depths Ẑ (..., p) in m: (..., m, 6)."""
        return self.features.interaction(self.shifted(image), depths)
