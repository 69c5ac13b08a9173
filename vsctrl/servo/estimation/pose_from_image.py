"""The camera's pose from one image of known points: virtual visual servoing.

A virtual camera is servoed until its image of the target is the measured one. The step is that of
Gauss and Newton with the interaction matrix as Jacobian, ``oTc ← oTc exp(δ)``; where that would
not bring the images together it is shortened as Levenberg and Marquardt do, so that far guesses
still end in a minimum. Which minimum that is depends on the guess (three points have up to four
poses, a plane seen from afar has two); a residual far above the noise tells of a wrong one.

Source: Marchand, Chaumette, Virtual visual servoing: a framework for real-time augmented reality
(Computer Graphics Forum 21(3), 2002); Moré, The Levenberg-Marquardt algorithm (1978).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vsctrl.errors import InputError
from vsctrl.servo.camera.camera import NEAREST, Camera
from vsctrl.servo.pose import exp_one

Array = NDArray[np.float64]

# The fit is done once a step moves no image coordinate by more than this (px). What is left then is
# the square of the step for exact images, and a small share of it for noisy ones.
SETTLED_PX = 1e-5

# Steps in all, refused ones included.
ITERATIONS = 100

# Damping as a share of the curvature: at first, when a step is refused, and how it changes. Below
# the least it is none, and the last steps are those of Gauss and Newton.
_DAMPING, _LEAST, _MORE, _LESS = 1e-3, 1e-5, 8.0, 0.1

# A rise of the cost by less than this share is rounding, no reason to refuse a step.
_ROUNDING = 1e-13

# The pose is undetermined where a twist, in units of each column's effect, moves the image by less
# than this share of the most.
RANK_TOLERANCE = 1e-7

# A guess may be this far from a rigid motion: what many products of rotations gather is far less.
RIGID = 1e-6


class PoseFit(NamedTuple):
    """Pose (4, 4) of the camera in the object frame, how well it fits, and whether to trust it.

    residual_px: root mean square over the image coordinates, ∞ if the pose shows no image;
    iterations: steps tried; ok: whether a pose was found, else oTc is the best one on the way.
    """

    oTc: Array
    residual_px: float
    iterations: int
    ok: bool


def pose_from_image(
    image: ArrayLike, points: ArrayLike, Fx: float, Fy: float, guess: ArrayLike
) -> PoseFit:
    """Pose that minimises the image error, ``min Σ |s(oTc) − s|²``, from a guess.

    The covariance of the twist from the true to the found pose is ``σ² (LᵀL)⁻¹`` for noise of
    standard deviation σ on each coordinate.

    image: (2p,) in px, X1 Y1 X2 Y2 …; points: (p, 3) in m in the object frame, only those that
    are seen, three or more; Fx, Fy: in px; guess: (4, 4), oTc. Returns PoseFit, with ok False when
    fewer points are given, a number in an array is not finite, the guess has a point behind the
    camera, the points do not determine the pose there (all on a line, a critical circle), or no
    minimum is reached within ``ITERATIONS``.
    Raises InputError for arguments that no image leads to: arrays of another shape or not of
    numbers, an Fx or Fy that is not above 0, a finite guess that is no rigid motion.
    """
    image, points, oTc = _numbers("image", image), _numbers("points", points), _guess(guess)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(
            f"points: an array of shape {points.shape} is no list of points; give (p, 3), x y z "
            "in m for every point."
        )
    if image.shape != (2 * len(points),):
        raise InputError(
            f"image: an array of shape {image.shape} is no image of {len(points)} points; give "
            f"({2 * len(points)},), X1 Y1 X2 Y2 … in px."
        )
    camera = Camera(_focal_length("Fx", Fx), _focal_length("Fy", Fy))
    failed = PoseFit(oTc, math.inf, 0, False)
    if len(points) < 3 or not all(np.isfinite(a).all() for a in (image, points, oTc)):
        return failed
    with np.errstate(all="ignore"):  # what overflows is refused as a step that does not help
        return _fit(image, points, camera, oTc) or failed


def _numbers(name: str, value: ArrayLike) -> Array:
    """An array of real numbers, a copy. Raises InputError where the value is none."""
    try:
        found = np.asarray(value)
        if found.dtype.kind in "biuf":
            return found.astype(np.float64)
    except (TypeError, ValueError, OverflowError):  # rows of different lengths, and the like
        pass
    raise InputError(f"{name}: this is no array of real numbers; give one, without gaps.")


def _guess(value: ArrayLike) -> Array:
    """The pose to begin with, rigid where it is finite, (4, 4)."""
    oTc = _numbers("guess", value)
    if oTc.shape != (4, 4):
        raise InputError(f"guess: an array of shape {oTc.shape} is no pose; give oTc, (4, 4).")
    if not np.isfinite(oTc).all():
        return oTc
    R = oTc[:3, :3]
    with np.errstate(all="ignore"):
        off = max(np.abs(R.T @ R - np.eye(3)).max(), np.abs(oTc[3] - (0, 0, 0, 1)).max())
    if not off <= RIGID or np.linalg.det(R) < 0:
        raise InputError(
            "guess: the matrix is no rigid motion; give a rotation, a translation and the row "
            "0 0 0 1."
        )
    return oTc


def _focal_length(name: str, value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not 0 < number < math.inf:
        raise InputError(
            f"{name}: {value!r} is no focal length; give a finite number of px above 0."
        )
    return number


def _fit(image: Array, points: Array, camera: Camera, oTc: Array) -> PoseFit | None:
    p = camera.points(oTc, points)
    if not p[:, 2].min() > NEAREST:
        return None
    error = camera.features(p) - image
    cost, damping = float(error @ error), 0.0
    if not np.isfinite(cost):
        return None
    L = camera.interaction(error + image, p[:, 2])
    done, k = False, 0
    while not done and k < ITERATIONS:
        k += 1
        step, settled = _step(L, error, damping)
        tried = oTc @ exp_one(step.tolist())
        q = camera.points(tried, points)
        new_error = camera.features(q) - image
        new_cost = float(new_error @ new_error)
        better = new_cost <= cost * (1 + _ROUNDING) and q[:, 2].min() > NEAREST
        if better:
            oTc, p, error, cost = tried, q, new_error, new_cost
            damping = damping * _LESS if damping * _LESS > _LEAST else 0.0
            if not settled:
                L = camera.interaction(error + image, p[:, 2])
        elif not settled:
            damping = max(_DAMPING, _MORE * damping)
        # A step within rounding need not lower the cost: it is the end all the same.
        done = settled
    # Where only a crawl was accepted, small steps are no sign of a minimum.
    ok = done and damping < 1 and _determined(L)
    return PoseFit(oTc, float(np.sqrt(cost / len(image))), k, ok)


def _step(L: Array, error: Array, damping: float) -> tuple[Array, bool]:
    """Twist of the damped normal equations, and whether its effect is within ``SETTLED_PX``."""
    A = L.T @ L
    curvature = np.diagonal(A)
    if damping:
        A = A + np.diag(damping * curvature)
    try:
        step = np.asarray(np.linalg.solve(A, -(L.T @ error)), dtype=np.float64)
    except np.linalg.LinAlgError:
        step = np.full(6, np.nan)
    if not np.isfinite(step).all():  # exactly singular: along the gradient instead
        step = -(L.T @ error) / np.where(curvature > 0, 6 * curvature, 1.0)
    return step, bool(np.abs(L @ step).max() <= SETTLED_PX)


def _determined(L: Array) -> bool:
    """Whether every twist moves the image, whatever the units of metres and radians are."""
    norms = np.sqrt(np.sum(L * L, axis=0))
    if not norms.min() > 0:
        return False
    values = np.linalg.svd(L / norms, compute_uv=False)
    return len(L) >= 6 and bool(values[-1] > RANK_TOLERANCE * values[0])
