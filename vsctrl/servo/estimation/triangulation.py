"""Where the points of a still target are, from images taken along the way of the camera.

The poses are known, so that each point is a least-squares problem of its own with three unknowns;
all points are solved at once. The rays of a point's images are intersected linearly first, then
the image error is minimised, which is what noise in pixels asks for. Points whose rays are nearly
parallel have no depth: the angle between the rays says which.

Source: Hartley, Sturm, Triangulation (CVIU 68(2), 1997); Hartley, Zisserman, Multiple View
Geometry (2nd ed., 2004), section 12.2 and appendix 6; Schönberger, Frahm, Structure-from-motion
revisited (CVPR 2016) for the angle as the test.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array, Mask
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.camera.camera import NEAREST, Camera
from vsctrl.servo.least_squares import minimise

# Rays that meet at less than this angle (deg) are not trusted to have a depth: at 700 px of focal
# length it is a shift of 12 px, of which a pixel of noise is a twelfth.
LEAST_PARALLAX_DEG = 1.0

# Least squares is done once a step moves no point by more than this share of its distance from the
# cameras: what is left is the square of that.
_SETTLED = 1e-8
_ITERATIONS = 50

# A direction whose information is below this share of the best known one's is not determined.
_RANK_TOLERANCE = 1e-12

# Images beyond this (px) are no images: their squares must stay finite numbers.
_FARTHEST = 1e12

# Rays compared with all others at a time: bounds the memory of long runs.
_BLOCK = 512


class Structure(NamedTuple):
    """Points (p, 3) in m in the frame of the poses, and how well each is known.

    covariance_per_px2: (p, 3, 3) in m²/px², times the variance of an image coordinate the
    covariance of the point, ∞ on the diagonal where the images do not determine it; parallax_deg:
    (p,) greatest angle between two of its rays; ok: (p,) whether it may be relied on.

    >>> run = vs.simulate(vs.paper.sliding())
    >>> found = vs.servo.target_from_motion(run.features, run.pose, run.visible, Fx=700, Fy=700)
    >>> print(found.points[0].round(3))
    [-0.125 -0.075 -0.125]
    """

    points: Array
    covariance_per_px2: Array
    parallax_deg: Array
    ok: Mask


def target_from_motion(
    images: ArrayLike, poses: ArrayLike, visible: ArrayLike, Fx: float, Fy: float
) -> Structure:
    """Points that fit their images from known poses best: ``min Σ_k |s(wTc_k, P) − s_k|²``.

    images: (n, 2p) in px, X1 Y1 X2 Y2 …; poses: (n, 4, 4), wTc of the camera at each image;
    visible: (n, p), images that are not (or are no finite numbers) are left out; Fx, Fy: in px.
    Returns Structure; a point is ok when its parallax is ``LEAST_PARALLAX_DEG`` or more, the fit
    has settled, and it lies in front of every camera that saw it. The others keep a finite place
    that fits their rays. Raises InputError when the shapes do not belong together.

    >>> run = vs.simulate(vs.paper.sliding())
    >>> found = vs.servo.target_from_motion(run.features, run.pose, run.visible, Fx=700, Fy=700)
    >>> bool(found.ok.all())
    True
    """
    images, poses = checks.array("images", images), checks.array("poses", poses)
    visible = checks.array("visible", visible).astype(bool)
    _check(images, poses, visible)
    for name, F in (("Fx", Fx), ("Fy", Fy)):
        checks.positive(name, F, "a focal length above 0 px")
    n, p = visible.shape
    image = images.reshape(n, p, 2)
    seen = visible & (np.abs(image) < _FARTHEST).all(axis=-1)
    image = np.where(seen[..., None], image, 0.0)
    camera = Camera(Fx, Fy)
    with np.errstate(all="ignore"):  # what overflows is refused as a step that does not help
        start = _intersection(image / np.array([Fx, Fy]), poses, seen)
        fit = _Fit(start, image, poses, seen, camera)
        cost = fit.cost()
        fit.accept(np.ones(p, dtype=bool))
        settled = minimise(fit, cost, _ITERATIONS).settled
        parallax = _parallax(fit.points, poses, seen)
        determined, covariance = _inverse(fit.information)
        ok = settled & determined & (parallax >= LEAST_PARALLAX_DEG)
        return Structure(fit.points, covariance, parallax, ok)


def _intersection(rays: Array, poses: Array, seen: Mask) -> Array:
    """Points nearest to their rays, ``(R₁ − x R₃)·(P − t) = 0`` and the same for y.

    rays: (n, p, 2) normalised. Of least distance from the middle of the cameras where the rays are
    parallel. Returns (p, 3).
    """
    R, t = poses[:, None, :3, :3], poses[:, :3, 3]
    middle = t.mean(axis=0)
    # Rows (n, p, 2, 3), each weighted by the length of its ray: angles rather than plane offsets.
    rows = R[..., :2].swapaxes(-1, -2) - rays[..., None] * R[..., None, :, 2]
    rows = rows * (seen / np.sqrt(1 + np.sum(rays**2, axis=-1)))[..., None, None]
    right = np.squeeze(rows @ (t - middle)[:, None, :, None], -1)
    normal = np.einsum("npij,npik->pjk", rows, rows)
    out: Array = np.einsum("npij,npi->pj", rows, right)
    inverse = np.linalg.pinv(normal, rcond=_RANK_TOLERANCE, hermitian=True)
    return middle + np.squeeze(inverse @ out[..., None], -1)


class _Fit:
    """The image error of points (p, 3) that are tried, and of the best ones so far.

    information: (p, 3, 3), ``JᵀJ`` in px²/m² of the best ones.
    """

    def __init__(
        self, points: Array, image: Array, poses: Array, seen: Mask, camera: Camera
    ) -> None:
        self._image, self._poses, self._seen, self._camera = image, poses, seen, camera
        self._tried = self.points = points
        self.information = np.zeros((len(points), 3, 3))
        self._gradient = np.zeros((len(points), 3))  # −Jᵀe

    def cost(self) -> Array:
        """Squared image error (p,) in px², ∞ for a point behind a camera that saw it."""
        n, p = self._seen.shape
        q = self._camera.points(self._poses, self._tried)
        front = q[..., 2] > NEAREST
        use = self._seen & front
        q[..., 2] = np.where(front, q[..., 2], 1.0)
        features = self._camera.features(q)
        error = (features.reshape(n, p, 2) - self._image) * use[..., None]
        # A camera that moves by V sees the point move by −V: ∂s/∂q = −(translation's columns of L).
        L = self._camera.interaction(features, q[..., 2]).reshape(n, p, 2, 6)
        R = self._poses[:, None, :3, :3]
        J = -(L[..., :3] @ R.swapaxes(-1, -2)) * use[..., None, None]
        cost = np.sum(error * error, axis=(0, 2))
        self._new = np.einsum("npij,npik->pjk", J, J), -np.einsum("npij,npi->pj", J, error)
        hidden = (self._seen & ~front).any(axis=0)
        return np.where(hidden | ~np.isfinite(cost), np.inf, cost)

    def accept(self, better: Mask) -> None:
        """Take the points that are tried as the best ones, where they are better: (p,)."""
        information, gradient = self._new
        self.points = np.where(better[:, None], self._tried, self.points)
        self.information = np.where(better[:, None, None], information, self.information)
        self._gradient = np.where(better[:, None], gradient, self._gradient)

    def step(self, damping: Array) -> Mask:
        """Try a damped step; of least length where a point's images leave a direction open."""
        curvature = np.diagonal(self.information, axis1=1, axis2=2)
        A = self.information + (damping[:, None] * curvature)[..., None] * np.eye(3)
        inverse = np.linalg.pinv(A, rcond=_RANK_TOLERANCE, hermitian=True)
        step = np.squeeze(inverse @ self._gradient[..., None], -1)
        self._tried = self.points + step
        away = np.sum((self.points - self._poses[:, None, :3, 3]) ** 2, axis=-1)
        reach = np.sqrt(away).min(axis=0)
        return np.sqrt(np.sum(step * step, axis=-1)) <= _SETTLED * reach


def _parallax(points: Array, poses: Array, seen: Mask) -> Array:
    """Greatest angle (p,) in deg between two rays from cameras that saw a point to it."""
    out = np.zeros(len(points))
    for i, point in enumerate(points):
        rays = point - poses[seen[:, i], :3, 3]
        lengths = np.sqrt(np.sum(rays * rays, axis=1))
        rays = rays[lengths > 0] / lengths[lengths > 0, None]
        least = 1.0
        for k in range(0, len(rays), _BLOCK):
            least = min(least, float((rays[k : k + _BLOCK] @ rays.T).min()))
        out[i] = np.degrees(2 * np.arcsin(np.sqrt(np.clip((1 - least) / 2, 0.0, 1.0))))
    return out


def _inverse(information: Array) -> tuple[Mask, Array]:
    """Which points (p,) are determined in all directions, and their covariance (p, 3, 3)."""
    values = np.linalg.eigvalsh(information)
    determined = (values[:, 0] > _RANK_TOLERANCE * values[:, 2]) & (values[:, 0] > 0)
    covariance = np.empty_like(information)
    covariance[:] = np.diag(np.full(3, np.inf))
    covariance[determined] = np.linalg.inv(information[determined])
    return determined, covariance


def _check(images: Array, poses: Array, visible: Mask) -> None:
    n = len(images)
    if visible.ndim != 2 or images.shape != (n, 2 * visible.shape[1]) or len(visible) != n:
        raise InputError(
            f"images: shape {images.shape} does not belong to visible {visible.shape}; "
            "give (n, 2p) and (n, p)."
        )
    if poses.shape != (n, 4, 4):
        raise InputError(f"poses: shape {poses.shape} is not one pose per image; give {(n, 4, 4)}.")
    if n == 0 or not np.isfinite(poses).all():
        raise InputError("poses: some are missing or not finite; give the pose of every image.")
