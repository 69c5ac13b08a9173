"""The pinhole camera: what a pose of the camera does to the image of known points.

It arranges the generated kernels (which ``vsctrl.derive`` proved and printed) into the stacked
features and interaction matrix of several points. The formulas themselves are nowhere typed in
here. Noise, delay and wrong depths belong to the loop, not to the lens: see ``simulate`` and
``law``.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo.generated.kernels import point_interaction, point_projection

# A point nearer than this to the camera's plane (m) counts as not in front of it: the image of a
# point *in* that plane is infinite, and squares of coordinates must stay finite numbers.
NEAREST = 1e-9


class View(NamedTuple):
    """What the law may know of a frame: image and depths.

    features: (..., 2n) in px, ordered X1 Y1 X2 Y2 …; depths: (..., n) in m.

    >>> vs.servo.View(np.zeros(8), np.ones(4)).depths.shape
    (4,)
    """

    features: Array
    depths: Array


@dataclass(frozen=True, slots=True)
class Camera:
    """Pinhole camera with image coordinates from the principal point (eq. 15).

    Fx, Fy: focal lengths in px.

    >>> vs.servo.Camera(700, 700).interaction(np.zeros(2), np.ones(1)).shape
    (2, 6)
    """

    Fx: float
    Fy: float

    def points(self, oTc: ArrayLike, points: ArrayLike) -> Array:
        """Points of the object frame in the camera frame: ``p = Rᵀ (P − t)``.

        oTc: (..., 4, 4); points: (n, 3) in m. Returns (..., n, 3) in m.
        """
        oTc = np.asarray(oTc, dtype=np.float64)
        return (points - oTc[..., None, :3, 3]) @ oTc[..., :3, :3]

    def features(self, p: Array) -> Array:
        """Image of points of the camera frame: ``X = Fx x/z``, ``Y = Fy y/z`` (eq. 15).

        p: (..., n, 3) in m with every z > 0. Returns (..., 2n) in px.
        """
        image = point_projection(p[..., 0], p[..., 1], p[..., 2], self.Fx, self.Fy)
        return image.reshape(*p.shape[:-2], 2 * p.shape[-2])

    def view(self, oTc: ArrayLike, points: ArrayLike) -> View:
        """Image and depths of points of the object frame seen from ``oTc``.

        oTc: (..., 4, 4); points: (n, 3) in m. Returns features (..., 2n) and depths (..., n).
        Raises InputError when a point does not lie in front of the camera.
        """
        p = self.points(oTc, points)
        nearest = float(p[..., 2].min())
        if not nearest > NEAREST:
            raise InputError(
                f"oTc: a point lies at depth {nearest:.4g} m, not in front of the camera; "
                "choose a pose from which every point has z > 0."
            )
        return View(self.features(p), p[..., 2])

    def interaction(self, features: Array, depths: Array) -> Array:
        """Interaction matrix of the stacked points, ``s' = L T`` for a still target.

        features: (..., 2n) in px; depths: (..., n) in m. Returns (..., 2n, 6), columns
        Vx Vy Vz Ωx Ωy Ωz, in px/m and px/rad.
        """
        image = features.reshape(*depths.shape, 2)
        L = point_interaction(image[..., 0], image[..., 1], depths, self.Fx, self.Fy)
        return L.reshape(*features.shape, 6)
