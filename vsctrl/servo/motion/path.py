"""A path through given poses, with a continuous twist.

Between two poses the curve is Bézier's cubic in the group, a product of three exponentials, so that
it passes through every pose exactly and its twist is known in closed form.

Source: Kim, Kim, Shin, A general construction scheme for unit quaternion curves with simple high
order derivatives (SIGGRAPH 1995), written here for SE(3).
"""

from dataclasses import dataclass, field
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.motion.trajectory import Trajectory
from vsctrl.servo.pose import adjoint, bracket, exp, inverse, log

Ends = Literal["rest", "free"]

# Between poses that turn by more than this (rad) the way round is a guess.
MOST_TURN = 2.0


@dataclass(frozen=True, eq=False)
class Path(Trajectory):
    """Motion through poses at given times, with given twists there; C¹, so the twist never jumps.

    On each piece ``oTc*(u) = oTc_i · exp(b₁(u) w₁) · exp(b₂(u) w₂) · exp(b₃(u) w₃)`` with
    ``b₁ = 1 − (1 − u)³``, ``b₂ = 3u² − 2u³``, ``b₃ = u³``, ``w₁ = h T_i/3``, ``w₃ = h T_{i+1}/3``
    and the w₂ that ends at the next pose. The acceleration is bounded; it may jump at the poses.

    t: (n,) in s, increasing from 0; poses: (n, 4, 4); twists: (n, 6) in the camera frame, m/s and
    rad/s. ``Path.through`` chooses the twists. Raises InputError for times that do not increase,
    other shapes, and neighbours that turn by more than 2 rad.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> vs.servo.Path(np.array([0, 1.0]), np.stack([start, start]), np.zeros((2, 6))).duration
    1.0
    """

    t: Array
    poses: Array
    twists: Array
    oTc0: Array = field(init=False)
    duration: float = field(init=False)
    _w: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        t, poses = _checked(self.t, self.poses)
        twists = checks.array("twists", self.twists)
        if twists.shape != (len(t), 6) or not np.isfinite(twists).all():
            raise InputError(
                f"twists: an array of shape {twists.shape} for {len(t)} poses; give finite numbers "
                f"of shape ({len(t)}, 6)."
            )
        h = np.diff(t)[:, None]
        first, last = h * twists[:-1] / 3, h * twists[1:] / 3
        middle = log(exp(-first) @ inverse(poses[:-1]) @ poses[1:] @ exp(-last))
        w = np.stack([first, middle, last])
        checks.keep(self, t=t, poses=poses, twists=twists, oTc0=poses[0], _w=w)
        object.__setattr__(self, "duration", float(t[-1]))

    @classmethod
    def through(cls, t: ArrayLike, poses: ArrayLike, ends: Ends = "rest") -> Self:
        """The path through poses, with the twists of parabolas through three neighbours each.

        ``T_i = (h_i D_{i−1} + h_{i−1} D_i)/(h_{i−1} + h_i)`` with D the constant twist from pose to
        pose. At the ends: "rest" (zero), or "free" (the parabola's, ``2 D_0 − T_1``; two poses are
        joined by a constant twist). Arguments and errors as ``Path``.
        """
        checks.choice("ends", ends, ("rest", "free"))
        t, poses = _checked(t, poses)
        h = np.diff(t)[:, None]
        D = log(inverse(poses[:-1]) @ poses[1:]) / h
        T = np.zeros((len(t), 6))
        T[1:-1] = (h[1:] * D[:-1] + h[:-1] * D[1:]) / (h[1:] + h[:-1])
        if ends == "free":
            T[0] = 2 * D[0] - T[1] if len(D) > 1 else D[0]
            T[-1] = 2 * D[-1] - T[-2] if len(D) > 1 else D[0]
        return cls(t, poses, T)

    def pose(self, t: ArrayLike) -> Array:
        """Pose at the times t: (...,) in s → (..., 4, 4)."""
        t = checks.times(t)
        inside = np.clip(t, 0.0, self.duration)
        i, _, u = self._piece(inside)
        first, middle, last = self._w[:, i]
        b, _, _ = _basis(u)
        poses = self.poses[i] @ exp(b[0] * first) @ exp(b[1] * middle) @ exp(b[2] * last)
        return self._carried_on(poses, t, inside)

    def twist(self, t: ArrayLike) -> Array:
        """Twist at the times t: (...,) in s → (..., 6), (V, Ω) in m/s and rad/s."""
        return self._rates(np.clip(checks.times(t), 0.0, self.duration))[0]

    def acceleration(self, t: ArrayLike) -> Array:
        """Derivative of the twist: (...,) in s → (..., 6), after a pose where it jumps there."""
        t = checks.times(t)
        inside = np.clip(t, 0.0, self.duration)
        return np.where((t == inside)[..., None], self._rates(inside)[1], 0.0)

    def _rates(self, t: Array) -> tuple[Array, Array]:
        """Twist and its derivative, exponential by exponential:

        ``X ← b' w + Ad(e^{−b w}) X``, and X' by the product rule with ``Ad' = −b' ad(w) Ad``.
        """
        i, h, u = self._piece(t)
        b, db, ddb = _basis(u)
        X = dX = np.zeros((*u.shape, 6))
        for k, w in enumerate(self._w[:, i]):
            Ad = adjoint(exp(-b[k] * w))
            carried = _apply(Ad, X)
            rate = db[k] / h[..., None] * w
            dX = ddb[k] / h[..., None] ** 2 * w + _apply(Ad, dX) - bracket(rate, carried)
            X = rate + carried
        return X, dX

    def _piece(self, t: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Number of the piece that times fall in, its length (s) and the fraction u of it."""
        i = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 2)
        h = self.t[i + 1] - self.t[i]
        return i, h, (t - self.t[i]) / h


def _basis(u: Array) -> tuple[Array, Array, Array]:
    """b₁, b₂, b₃ and their first and second derivatives by u, each (3, ..., 1)."""
    u = u[..., None]
    v = 1 - u
    return (
        np.stack([1 - v**3, u * u * (3 - 2 * u), u**3]),
        3 * np.stack([v * v, 2 * u * v, u * u]),
        6 * np.stack([-v, 1 - 2 * u, u]),
    )


def _apply(M: Array, x: Array) -> Array:
    return np.squeeze(M @ x[..., None], -1)


def _checked(t: ArrayLike, poses: ArrayLike) -> tuple[Array, Array]:
    """Times and poses as arrays of their own, or InputError."""
    t, poses = checks.array("t", t), checks.array("poses", poses)
    if t.ndim != 1 or len(t) < 2 or t[0] != 0 or not (np.diff(t) > 0).all():
        raise InputError(
            "t: the times of a path are at least two that increase from 0; sort them and subtract "
            "the first."
        )
    if poses.shape != (len(t), 4, 4) or not (np.isfinite(poses).all() and np.isfinite(t).all()):
        raise InputError(
            f"poses: an array of shape {poses.shape} for {len(t)} times; give finite numbers of "
            f"shape ({len(t)}, 4, 4)."
        )
    turns = np.linalg.norm(log(inverse(poses[:-1]) @ poses[1:])[:, 3:], axis=-1)
    if turns.max() > MOST_TURN:
        k = int(np.argmax(turns))
        raise InputError(
            f"poses: from t = {t[k]:g} s to {t[k + 1]:g} s the camera turns by "
            f"{np.rad2deg(turns[k]):.0f}°, and which way round is a guess; give poses in between "
            f"that turn by less than {np.rad2deg(MOST_TURN):.0f}°."
        )
    return t, poses
