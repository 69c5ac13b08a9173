"""Radial distortion: where the lens puts what a pinhole would see.

One coefficient, ``X_d = X (1 + k₁ r²)`` with ``r² = (X/Fx)² + (Y/Fy)²``: the first term of the
model of Brown. Source: Brown, Close-range camera calibration, Photogrammetric Engineering 37
(1971) 855–866.
"""

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.camera.camera import Camera

# Of the fixed point that undoes a distortion; it gains a factor of about 3 k₁ r² each time.
ROUNDS = 60


def distorted(camera: Camera, image: Array, k1: float) -> Array:
    """Image (..., 2n) in px of a pinhole, as a lens with ``k1`` shows it."""
    if not k1:
        return image
    X = image.reshape(*image.shape[:-1], -1, 2)
    return (X * (1 + k1 * _squares(camera, X))[..., None]).reshape(image.shape)


def undistorted(camera: Camera, image: Array, k1: float) -> Array:
    """The pinhole's image of what a lens with ``k1`` shows, (..., 2n) in px: the inverse.

    By fixed point; where the lens folds the image over itself (3 k₁ r² near −1) it is the last
    of its iterates.
    """
    out = image
    for _ in range(ROUNDS if k1 else 0):
        X = out.reshape(*image.shape[:-1], -1, 2)
        scale = np.repeat(1 + k1 * _squares(camera, X), 2, axis=-1)
        out = image / np.where(np.abs(scale) > 0.1, scale, 0.1)
    return out


def distorted_rate(camera: Camera, image: Array, rate: Array, k1: float) -> Array:
    """Derivative in time of ``distorted``: (..., 2n) in px and px/s → (..., 2n) in px/s.

    ``Ẋ_d = Ẋ (1 + k₁ r²) + 2 k₁ X (x ẋ + y ẏ)`` with ``x = X/Fx``.
    """
    if not k1:
        return rate
    X = image.reshape(*image.shape[:-1], -1, 2)
    dX = rate.reshape(X.shape)
    F = np.array([camera.Fx, camera.Fy])
    turning = np.sum(X * dX / F**2, axis=-1, keepdims=True)
    out: Array = dX * (1 + k1 * _squares(camera, X))[..., None] + 2 * k1 * X * turning
    return out.reshape(image.shape)


def _squares(camera: Camera, X: Array) -> Array:
    return (X[..., 0] / camera.Fx) ** 2 + (X[..., 1] / camera.Fy) ** 2
