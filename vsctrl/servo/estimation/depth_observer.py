"""Depths of the image points, observed while the camera moves.

A rotation moves all points of a ray alike; a translation moves near ones farther in the image than
distant ones. What the known motion of the camera between two images leaves open of a point's image
is therefore its inverse depth ``χ = 1/z``. A point ``(x, y, 1)/χ`` is moved by the motion
``(R, t)`` of the camera exactly to

    ``q = Rᵀ (x, y, 1) − χ Rᵀ t``,  ``(x, y) ← (q_x, q_y)/q_z``,  ``χ ← χ/q_z``,

which is the solution over a frame of ``χ' = χ² V_z + χ (y Ω_x − x Ω_y)`` and its image's motion
under a constant twist. No difference quotient enters, so frames may be far apart.

Each point is a nonlinear least-squares problem of its own with three unknowns, solved recursively:
``(x, y, χ)`` at the last image is what all images so far say, with the information matrix (inverse
covariance) of that. Estimating x and y as well is what makes the baseline that counts the whole
path and not the step between two frames. The target is still and the motion known; what that
motion is (commanded, measured) is the caller's to choose.

Source: De Luca, Oriolo, Robuffo Giordano, Feature depth observation for image-based visual
servoing: theory and experiments (IJRR 27(10), 2008) for state, motion and observability; Bell and
Cathey, The iterated Kalman filter update as a Gauss-Newton method (IEEE TAC 38(2), 1993).
"""

from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vsctrl.arrays import Array, Mask
from vsctrl.errors import InputError
from vsctrl.servo import checks

# A depth stays within this factor of the first guess of it, however bad the images are: the law
# divides by it, and neither a point in the lens nor one on the horizon can be servoed on. One that
# would leave it contradicts what is known, and is begun afresh from the guess.
RANGE = 50.0

# Images that are said to have less noise than this (px) are taken to have it: weights stay finite.
LEAST_NOISE = 1e-5

# Gauss-Newton is repeated until no depth changes by more than this share (what is left after such
# a step is its square), or as often as this.
_SETTLED = 1e-4
_ITERATIONS = 6


class DepthObserver:
    """Depth of every point from its images and the motion of the camera between them.

    Fx, Fy: focal lengths, px; depths0: (p,) first guess of the depths, m; noise_px: standard
    deviation of an image coordinate, px; relative_uncertainty: standard deviation of the guess
    over the guess itself (0.5: half of it), equally of z and 1/z.
    Raises InputError for a value that is not a positive number (noise_px may be 0).

    >>> observer = vs.servo.DepthObserver(700, 700, [1.0] * 4, 0.5, 0.3)
    """

    def __init__(
        self,
        Fx: float,
        Fy: float,
        depths0: ArrayLike,
        noise_px: float,
        relative_uncertainty: float,
    ) -> None:
        z = np.array(depths0, dtype=np.float64).reshape(-1)
        if not (z.size and np.all(np.isfinite(z) & (z > 0))):
            raise InputError(f"depths0: {z} are no depths; give one above 0 m for every point.")
        checks.positive("Fx", Fx, "a focal length above 0 px")
        checks.positive("Fy", Fy, "a focal length above 0 px")
        checks.positive(
            "relative_uncertainty", relative_uncertainty, "a share above 0, such as 0.5"
        )
        if noise_px != 0:
            checks.positive("noise_px", noise_px, "a standard deviation of 0 px or more")
        self._F = np.array([Fx, Fy], dtype=np.float64)
        self._weight = (self._F / max(float(noise_px), LEAST_NOISE)) ** 2  # of x, y
        self._prior = float(relative_uncertainty) ** -2  # of ln χ
        self._least, self._most = 1 / (RANGE * z), RANGE / z
        self._guess = 1 / z
        self._state = np.column_stack([np.zeros((len(z), 2)), 1 / z])  # x, y, χ
        self._information = np.zeros((len(z), 3, 3))
        self._known = np.zeros(len(z), dtype=bool)
        self._excitation = np.zeros(len(z))

    @property
    def depths(self) -> Array:
        """Depths (p,) in m at the last image, within a factor ``RANGE`` of the first guess.

        A point that was never seen keeps its guess. One that leaves that range or passes the
        camera's plane starts again from its guess, with excitation 0.
        """
        return 1 / self._state[:, 2]

    @property
    def excitation(self) -> Array:
        """Information (p,) that the images have brought about the logarithm of each depth.

        ``Σ χ² Δ(1/var χ)``, dimensionless: the images alone know the depth to a relative standard
        deviation of about ``1/√excitation`` (100: a tenth). It grows with the squared share of
        depth in the image motion over the noise, hence with linear velocity only. A camera that
        merely turns or stands leaves it at 0; later on such images add no more than what the mean
        of their noise tells about the end of the path.
        """
        return self._excitation.copy()

    def update(self, image: ArrayLike, motion: ArrayLike, visible: ArrayLike) -> None:
        """Take in a fresh image.

        image: (2p,) in px, X1 Y1 X2 Y2 …; motion: (4, 4), pose of the camera at this image in its
        frame at the previous one (no matter at the first); visible: (p,). Points that are not
        visible (or not finite) are moved along.
        """
        measured = np.asarray(image, dtype=np.float64).reshape(-1, 2) / self._F
        motion = np.asarray(motion, dtype=np.float64)
        seen = np.asarray(visible, dtype=bool) & np.isfinite(measured).all(axis=1)
        self._correct(np.where(seen[:, None], measured, 0.0), seen & self._known, motion)
        self._move(motion)
        first = seen & ~self._known
        if first.any():
            self._begin(measured, first)

    def _begin(self, measured: Array, first: Mask) -> None:
        """Points that are seen for the first time: their image, and the guess of their depth."""
        self._state[first, :2] = measured[first]
        information = np.zeros((int(first.sum()), 3, 3))
        information[:, 0, 0], information[:, 1, 1] = self._weight
        information[:, 2, 2] = self._prior / self._state[first, 2] ** 2
        self._information[first] = information
        self._known |= first

    def _correct(self, measured: Array, use: Mask, motion: Array) -> None:
        """State at the *previous* image that fits its past and this image best (Gauss-Newton).

        Fitting the previous state makes the depth that the motion of the image is worth exact: it
        is linearised where it ends, not where the old depth would have put it.
        """
        if not use.any():
            return
        past, before = self._state[use], self._information[use]
        state, z = past.copy(), measured[use]
        for _ in range(_ITERATIONS):
            moved, jacobian = _carry(state, motion)
            H = jacobian[:, :2]
            weighted = H.transpose(0, 2, 1) * self._weight
            after = before + weighted @ H
            pull = before @ (past - state)[..., None] + weighted @ (z - moved[:, :2])[..., None]
            step = _solve(after, pull)[..., 0]
            state = state + step
            state[:, 2] = np.clip(state[:, 2], self._least[use], self._most[use])
            if np.all(np.abs(step[:, 2]) <= _SETTLED * state[:, 2]):
                break
        gained = np.maximum(_of_depth(after) - _of_depth(before), 0.0)
        self._excitation[use] += state[:, 2] ** 2 * gained
        self._state[use], self._information[use] = state, after
        told = np.isfinite(state).all(axis=1) & np.isfinite(gained)
        self._forget(np.flatnonzero(use)[~told])

    def _move(self, motion: Array) -> None:
        """Carry the points that were seen once to the new frame, with what is known of them."""
        known = self._known
        if not known.any():
            return
        before = self._state[known]
        state, jacobian = _carry(before, motion)
        back = _solve(jacobian, np.eye(3))
        self._state[known] = state
        self._information[known] = back.transpose(0, 2, 1) @ self._information[known] @ back
        # χ shrinks by the scale of the point's approach, held at 1/RANGE by _carry.
        stays = state[:, 2] < RANGE * before[:, 2] * (1 - 1e-12)
        for chi in (before[:, 2], state[:, 2]):
            stays &= (chi > self._least[known]) & (chi < self._most[known])
        self._forget(np.flatnonzero(known)[~stays])

    def _forget(self, lost: NDArray[np.intp]) -> None:
        """Points whose images contradict what is known, or whose numbers are none any more."""
        self._state[lost, 2] = self._guess[lost]
        self._excitation[lost] = 0.0
        self._known[lost] = False


def _carry(state: Array, motion: Array) -> tuple[Array, Array]:
    """Points (x, y, χ) seen after the camera's motion, and the Jacobian of that.

    state: (p, 3); motion: (4, 4). Returns (p, 3) and (p, 3, 3).
    """
    R, b = motion[:3, :3], motion[:3, 3] @ motion[:3, :3]
    chi = state[:, 2:]
    q = state[:, :1] * R[0] + state[:, 1:2] * R[1] + R[2] - chi * b
    # A point that would come behind the camera is held before it, as near as its bound allows.
    scale = np.maximum(q[:, 2:], 1 / RANGE)
    moved = np.concatenate([q[:, :2], chi], axis=1) / scale
    rows = np.stack([R[0], R[1], -b])  # ∂q/∂(x, y, χ)
    jacobian = -moved[:, :, None] * rows[:, 2]
    jacobian[:, :2] += rows[:, :2].T
    jacobian[:, 2, 2] += 1.0
    return moved, jacobian / scale[:, :, None]


def _of_depth(information: Array) -> Array:
    """What is known of χ when x and y are not given: 1/var χ. (p, 3, 3) → (p,)."""
    return 1 / _solve(information, np.eye(3))[:, 2, 2]


def _solve(A: Array, b: Array) -> Array:
    """A⁻¹ b of every point, NaN where A is singular to rounding.

    A: (p, 3, 3); b: (p, 3, n), or (3, n) for all. Returns (p, 3, n).
    """
    b = np.broadcast_to(b, (len(A), *b.shape[-2:]))
    try:
        return np.asarray(np.linalg.solve(A, b), dtype=np.float64)
    except np.linalg.LinAlgError:  # of one point at least; the others have their solution still
        out = np.full(b.shape, np.nan)
        for k in range(len(A)):
            with suppress(np.linalg.LinAlgError):
                out[k] = np.linalg.solve(A[k], b[k])
        return out
