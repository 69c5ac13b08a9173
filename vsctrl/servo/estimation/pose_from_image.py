"""The camera's pose from one image of known points: virtual visual servoing.

A virtual camera is servoed until its image of the target is the measured one. The step is that of
Gauss and Newton with the interaction matrix as Jacobian, ``oTc ← oTc exp(δ)``; where that would
not bring the images together it is shortened (``least_squares``), so that far guesses still end in
a minimum. Which minimum that is depends on the guess (three points have up to four
poses, a plane seen from afar has two); a residual far above the noise tells of a wrong one.

Source: Marchand, Chaumette, Virtual visual servoing: a framework for real-time augmented reality
(Computer Graphics Forum 21(3), 2002).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array, Mask
from vsctrl.checks import quoted
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.camera.camera import NEAREST, Camera
from vsctrl.servo.least_squares import minimise
from vsctrl.servo.pose import exp_one

# The fit is done once a step moves no image coordinate by more than this (px). What is left then is
# the square of the step for exact images, and a small share of it for noisy ones.
SETTLED_PX = 1e-5

# Steps in all, refused ones included.
ITERATIONS = 100

# The pose is undetermined where a twist, in units of each column's effect, moves the image by less
# than this share of the most.
RANK_TOLERANCE = 1e-7


class PoseFit(NamedTuple):
    """Pose (4, 4) of the camera in the object frame, how well it fits, and whether to trust it.

    residual_px: root mean square over the image coordinates, ∞ if the pose shows no image;
    iterations: steps tried; ok: whether a pose was found, else oTc is the best one on the way.

    >>> slide = vs.paper.sliding()
    >>> run = vs.simulate(slide.with_(duration=0.2))
    >>> points = slide.target.points
    >>> fit = vs.servo.pose_from_image(run.features[0], points, 700, 700, run.pose[0])
    >>> fit.ok
    True
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

    >>> slide = vs.paper.sliding()
    >>> run = vs.simulate(slide.with_(duration=0.2))
    >>> points = slide.target.points
    >>> fit = vs.servo.pose_from_image(run.features[0], points, 700, 700, run.pose[0])
    >>> bool(np.allclose(fit.oTc, run.pose[0]))
    True
    """
    image, points, oTc = _numbers("image", image), _numbers("points", points), _guess(guess)
    checks.point_list("points", points, "p")
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
        fit = _Fit(image, points, camera, oTc)
        cost = fit.cost()
        if not np.isfinite(cost):
            return failed
        fit.accept(np.array(True))
        ended = minimise(fit, cost, ITERATIONS)
        ok = bool(ended.settled) and _determined(fit.L)
        return PoseFit(fit.oTc, float(np.sqrt(fit.squares / len(image))), ended.steps, ok)


def _numbers(name: str, value: ArrayLike) -> Array:
    """An array of real numbers, a copy. Raises InputError where the value is none."""
    try:
        array = np.asarray(value)
        if array.dtype.kind in "biuf":
            return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):  # rows of different lengths, and the like
        pass
    raise InputError(f"{name}: this is no array of real numbers; give one, without gaps.")


def _guess(value: ArrayLike) -> Array:
    """The pose to begin with, rigid where it is finite, (4, 4)."""
    oTc = _numbers("guess", value)
    if oTc.shape != (4, 4):
        raise InputError(f"guess: an array of shape {oTc.shape} is no pose; give oTc, (4, 4).")
    if np.isfinite(oTc).all() and not checks.is_rigid(oTc):
        raise checks.not_rigid("guess")
    return oTc


def _focal_length(name: str, value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not 0 < number < math.inf:
        raise InputError(
            f"{name}: {quoted(value)} is no focal length; give a finite number of px above 0."
        )
    return number


class _Fit:
    """The image error of a pose oTc that is tried, and of the best one so far."""

    L: Array
    squares: float

    def __init__(self, image: Array, points: Array, camera: Camera, oTc: Array) -> None:
        self._image, self._points, self._camera = image, points, camera
        self._tried = self.oTc = oTc
        self._moved = False

    def cost(self) -> Array:
        """Squared image error of the pose that is tried, in px²; ∞ with a point behind it."""
        self._p = self._camera.points(self._tried, self._points)
        self._error = self._camera.features(self._p) - self._image
        squares = self._error @ self._error
        return np.asarray(squares if self._p[:, 2].min() > NEAREST else np.inf)

    def accept(self, better: Mask) -> None:
        """Take the pose that is tried as the best one."""
        if better:
            self.oTc, self._moved = self._tried, True
            self._best = self._p, self._error
            self.squares = float(self._error @ self._error)

    def step(self, damping: Array) -> Mask:
        """Try the pose after a twist of the damped normal equations."""
        p, error = self._best
        if self._moved:
            self.L, self._moved = self._camera.interaction(error + self._image, p[:, 2]), False
        L = self.L
        A = L.T @ L
        curvature = np.diagonal(A)
        if damping:
            A = A + np.diag(damping * curvature)
        try:
            twist = np.asarray(np.linalg.solve(A, -(L.T @ error)), dtype=np.float64)
        except np.linalg.LinAlgError:
            twist = np.full(6, np.nan)
        if not np.isfinite(twist).all():  # exactly singular: along the gradient instead
            twist = -(L.T @ error) / np.where(curvature > 0, 6 * curvature, 1.0)
        self._tried = self.oTc @ exp_one(twist.tolist())
        return np.asarray(np.abs(L @ twist).max() <= SETTLED_PX)


def _determined(L: Array) -> bool:
    """Whether every twist moves the image, whatever the units of metres and radians are."""
    norms = np.sqrt(np.sum(L * L, axis=0))
    if not norms.min() > 0:
        return False
    values = np.linalg.svd(L / norms, compute_uv=False)
    return len(L) >= 6 and bool(values[-1] > RANK_TOLERANCE * values[0])
