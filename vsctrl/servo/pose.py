"""Rigid motions as plain 4×4 arrays: the geometry under everything that moves.

Poses are ``oTc`` (camera frame in the object frame) and twists are ``(v, ω)`` in the camera frame,
so that ``oTc' = oTc · exp(T dt)``. All functions work on leading axes at once; ``exp_one`` is the
same exponential for one twist in plain Python arithmetic, because a simulation takes one step at a
time and NumPy's overhead on 3-vectors would dominate it. What the camera sees from a pose is
left to ``camera``.

Source: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation (1994), chapter 2;
eq. (11)-(14) of the paper are the same motion seen from the camera.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array

# Taylor coefficients in θ² of (θ − sin θ)/θ³ and of (2(1 − cos θ) − θ sin θ)/θ⁴. Below θ = 1 the
# closed forms lose digits to cancellation while nine terms are exact to rounding; at θ = 1 both
# sides agree to rounding, so the change of formula cannot be seen.
_SERIES_BELOW = 1.0
_C_SERIES = tuple((-1.0) ** k / math.factorial(2 * k + 3) for k in range(9))
_D_SERIES = tuple((-1.0) ** k * (2 * k + 2) / math.factorial(2 * k + 4) for k in range(9))


def exp(T: ArrayLike) -> Array:
    """Exponential of a twist: the rigid motion after one unit of time.

    ``R = I + a ŵ + b ŵ²``, ``t = (I + b ŵ + c ŵ²) v`` with ``a = sin θ/θ``,
    ``b = (1 − cos θ)/θ²``, ``c = (θ − sin θ)/θ³``, ``θ = |ω|``.

    T: (..., 6), (v, ω) in m and rad. Returns (..., 4, 4). Source: eq. (13), (14) of the paper.
    """
    T = np.asarray(T, dtype=np.float64)
    v, w = T[..., :3], T[..., 3:]
    a, b, c = _coefficients(np.sqrt(np.sum(w * w, axis=-1)))
    W = _hat(w)
    WW = W @ W
    out = np.zeros((*T.shape[:-1], 4, 4))
    out[..., :3, :3] = np.eye(3) + _scale(a, W) + _scale(b, WW)
    out[..., :3, 3] = v + np.squeeze((_scale(b, W) + _scale(c, WW)) @ v[..., None], -1)
    out[..., 3, 3] = 1.0
    return out


def exp_one(T: Sequence[float]) -> Array:
    """Exponential of one twist, as ``exp`` but for six plain numbers and several times faster.

    T: 6 floats, (v, ω) in m and rad. Returns (4, 4).
    """
    vx, vy, vz, x, y, z = T
    tt = x * x + y * y + z * z
    theta = math.sqrt(tt)
    if theta < _SERIES_BELOW:
        c = 0.0
        for coefficient in reversed(_C_SERIES):
            c = c * tt + coefficient
    else:
        c = (theta - math.sin(theta)) / (theta * tt)
    a = math.sin(theta) / theta if theta else 1.0
    half = math.sin(theta / 2) / (theta / 2) if theta else 1.0
    b = half * half / 2
    # ω × v and ω × (ω × v)
    px, py, pz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    qx, qy, qz = y * pz - z * py, z * px - x * pz, x * py - y * px
    return np.array(
        (
            (1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y, vx + b * px + c * qx),
            (b * x * y + a * z, 1 - b * (x * x + z * z), b * y * z - a * x, vy + b * py + c * qy),
            (b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y), vz + b * pz + c * qz),
            (0.0, 0.0, 0.0, 1.0),
        )
    )


def log(oTc: ArrayLike) -> Array:
    """Twist whose exponential is the given motion, with the rotation angle in [0, π].

    ``ω`` from the quaternion (accurate near 0 and near π alike), then
    ``v = (I − ŵ/2 + d ŵ²) t`` with ``d = (2(1 − cos θ) − θ sin θ)/(2 θ² (1 − cos θ))``.

    oTc: (..., 4, 4). Returns (..., 6), (v, ω) in m and rad.
    """
    oTc = np.asarray(oTc, dtype=np.float64)
    q = _quaternion(oTc[..., :3, :3])
    sine = np.sqrt(np.sum(q[..., 1:] ** 2, axis=-1))
    theta = 2 * np.arctan2(sine, q[..., 0])
    # θ/sin(θ/2) → 2 at 0, where the quaternion's vector part is ω/2 already.
    w = q[..., 1:] * np.divide(theta, sine, out=np.full_like(sine, 2.0), where=sine > 0)[..., None]
    a, b, _ = _coefficients(theta)
    tt = np.where(theta < _SERIES_BELOW, 1.0, theta * theta)
    numerator = np.where(
        theta < _SERIES_BELOW, _horner(_D_SERIES, np.minimum(theta, 1.0)), (2 * b - a) / tt
    )
    t = oTc[..., :3, 3]
    wt = np.cross(w, t)
    v = t - wt / 2 + (numerator / (2 * b))[..., None] * np.cross(w, wt)
    return np.concatenate([v, w], axis=-1)


def inverse(oTc: ArrayLike) -> Array:
    """Inverse of a rigid motion: ``(R, t)⁻¹ = (Rᵀ, −Rᵀ t)``. (..., 4, 4) → (..., 4, 4)."""
    oTc = np.asarray(oTc, dtype=np.float64)
    Rt = np.swapaxes(oTc[..., :3, :3], -1, -2)
    out = np.zeros(oTc.shape)
    out[..., :3, :3] = Rt
    out[..., :3, 3] = -np.squeeze(Rt @ oTc[..., :3, 3:], -1)
    out[..., 3, 3] = 1.0
    return out


def adjoint(oTc: ArrayLike) -> Array:
    """Matrix that carries a twist through a motion: ``g exp(T) g⁻¹ = exp(Ad(g) T)``.

    ``Ad = [[R, t̂ R], [0, R]]`` for twists in (v, ω) order. (..., 4, 4) → (..., 6, 6).
    """
    oTc = np.asarray(oTc, dtype=np.float64)
    R = oTc[..., :3, :3]
    out = np.zeros((*oTc.shape[:-2], 6, 6))
    out[..., :3, :3] = R
    out[..., 3:, 3:] = R
    out[..., :3, 3:] = _hat(oTc[..., :3, 3]) @ R
    return out


def bracket(A: ArrayLike, B: ArrayLike) -> Array:
    """Lie bracket of twists, ``[A, B] = hat(A) hat(B) − hat(B) hat(A)``.

    ``(ω_A × v_B + v_A × ω_B, ω_A × ω_B)``. (..., 6), (..., 6) → (..., 6).
    """
    A, B = np.asarray(A, dtype=np.float64), np.asarray(B, dtype=np.float64)
    w = A[..., 3:]
    v = np.cross(w, B[..., :3]) + np.cross(A[..., :3], B[..., 3:])
    return np.concatenate([v, np.cross(w, B[..., 3:])], axis=-1)


def from_euler_xyz(position: ArrayLike, degrees: ArrayLike) -> Array:
    """Camera pose in the object frame from a position and intrinsic XYZ Euler angles.

    ``R = Rx(α) Ry(β) Rz(γ)``.

    position: (..., 3) in m; degrees: (..., 3), (α, β, γ). Returns (..., 4, 4).
    """
    position = np.asarray(position, dtype=np.float64)
    angles = np.deg2rad(np.asarray(degrees, dtype=np.float64))
    turns = np.zeros((3, *angles.shape[:-1], 6))
    for axis in range(3):
        turns[axis, ..., 3 + axis] = angles[..., axis]
    Rx, Ry, Rz = exp(turns)
    out = Rx @ Ry @ Rz
    out[..., :3, 3] = position
    return out


def _hat(w: Array) -> Array:
    """Cross-product matrix: ``ŵ p = w × p``. (..., 3) → (..., 3, 3)."""
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _scale(a: Array, M: Array) -> Array:
    return a[..., None, None] * M


def _horner(coefficients: Sequence[float], theta: Array) -> Array:
    tt = theta * theta
    total = np.zeros_like(tt)
    for coefficient in reversed(coefficients):
        total = total * tt + coefficient
    return total


def _coefficients(theta: Array) -> tuple[Array, Array, Array]:
    """``sin θ/θ``, ``(1 − cos θ)/θ²`` and ``(θ − sin θ)/θ³`` to rounding for every θ ≥ 0."""
    a = np.divide(np.sin(theta), theta, out=np.ones_like(theta), where=theta > 0)
    half = np.divide(np.sin(theta / 2), theta / 2, out=np.ones_like(theta), where=theta > 0)
    large = np.maximum(theta, _SERIES_BELOW)
    c = np.where(
        theta < _SERIES_BELOW,
        _horner(_C_SERIES, np.minimum(theta, _SERIES_BELOW)),
        (large - np.sin(large)) / large**3,
    )
    return a, half * half / 2, c


def _quaternion(R: Array) -> Array:
    """Unit quaternion (w ≥ 0, x, y, z) of a rotation: of Shepperd's four formulas the one whose
    pivot is largest, so that no digits cancel at any angle. (..., 3, 3) → (..., 4)."""
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    wx, wy, wz = (R[..., i, j] - R[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0)))
    xy, xz, yz = (R[..., i, j] + R[..., j, i] for i, j in ((1, 0), (2, 0), (2, 1)))
    # Row i is 4 qᵢ q.
    rows = [
        [1 + xx + yy + zz, wx, wy, wz],
        [wx, 1 + xx - yy - zz, xy, xz],
        [wy, xy, 1 - xx + yy - zz, yz],
        [wz, xz, yz, 1 - xx - yy + zz],
    ]
    table = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    pivot = np.argmax(np.diagonal(table, axis1=-2, axis2=-1), axis=-1)
    q = np.squeeze(np.take_along_axis(table, pivot[..., None, None], axis=-2), -2)
    q = q / np.sqrt(np.sum(q * q, axis=-1, keepdims=True))
    return np.where(q[..., :1] < 0, -q, q)
