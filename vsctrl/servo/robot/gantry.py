"""The robots that carry the camera: none at all, or a gantry with a wrist of three rotations.

The gantry has the kinematics of Inria's AFMA6, on which the paper's kind of experiment is run:
three crossed slides, then a vertical axis (4), a horizontal one (5) and the tool's own (6), where
turning joint 5 also turns the tool a little through the gears. It is written as a product of
exponentials. Left out: the robot's dynamics, its friction and the play of its gears.

Sources: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation (1994), chapter 3;
the geometry and its constants are those documented by ViSP for its class vpAfma6.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.caching import Caching
from vsctrl.checks import quoted
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.pose import adjoint, bracket, exp, inverse

# Below this |cos q5| axes 4 and 6 are one to rounding, and only their sum can be told.
ALIGNED = 1e-9
_TURN = 2 * math.pi
# Orientation of the end effector with every joint at 0: its x, y, z along z, x, y of the base.
_HOME = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


@dataclass(frozen=True, slots=True)
class FreeCamera:
    """A camera that moves as it is told: no joints, so no limits of joints.

    >>> slide = vs.paper.sliding()
    >>> vs.servo.feasibility(slide.reference, robot=vs.servo.FreeCamera()).feasible
    True
    """


@dataclass(frozen=True, eq=False)
class Gantry(Caching):
    """Cartesian robot with a wrist: ``bTc(q) = e^{ξ₁θ₁} … e^{ξ₆θ₆} · home · eTc``.

    Joints 1-3 slide along x, y, z of the base; 4 turns about the vertical, 5 about a horizontal
    axis, 6 about the tool's z. ``θ = q`` but for the gears: ``θ₆ = q₆ − coupling · q₅``. Axes 5 and
    6 meet at the end effector, ``offset`` away from axis 4. The wrist is singular at cos q₅ = 0.

    bTo: (4, 4), the object in the frame of the robot's base; eTc: (4, 4), the camera in the frame
    of the end effector (hand-eye). offset: m; coupling: rad/rad. lower, upper: (6,), m and rad;
    speeds: (6,), m/s and rad/s; accelerations: (6,), m/s² and rad/s² (no figure is published for
    this robot: the default reaches full speed in 0.2 s). wrist_margin: least |cos q₅| allowed; 0
    lets a path cross the singularity. Raises InputError for values out of range.

    >>> print(vs.servo.Gantry().upper)
    [0.6001 0.6701 0.4601 2.7301 2.4801 1.5901]
    """

    bTo: Array = field(default_factory=lambda: np.eye(4))
    eTc: Array = field(default_factory=lambda: np.eye(4))
    offset: float = -0.06924
    coupling: float = 0.009091
    lower: Array = field(
        default_factory=lambda: np.array([-0.7501, -0.6501, -0.5001, -2.7301, -0.3001, -1.5901])
    )
    upper: Array = field(
        default_factory=lambda: np.array([0.6001, 0.6701, 0.4601, 2.7301, 2.4801, 1.5901])
    )
    speeds: Array = field(default_factory=lambda: np.array([0.2] * 3 + [0.7] * 3))
    accelerations: Array = field(default_factory=lambda: np.array([1.0] * 3 + [3.5] * 3))
    wrist_margin: float = 0.02

    def __post_init__(self) -> None:
        for name in ("bTo", "eTc"):
            checks.keep(self, **{name: checks.rigid(name, getattr(self, name))})
        for name in ("lower", "upper"):
            checks.keep(self, **{name: checks.vector(name, getattr(self, name), 6)})
        for name in ("speeds", "accelerations"):
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.shape != (6,) or not (value > 0).all():
                raise InputError(
                    f"{name}: {quoted(getattr(self, name))} does not limit six joints; give 6 "
                    "numbers "
                    "above 0 (infinite where there is no limit)."
                )
            checks.keep(self, **{name: value})
        checks.vector("offset, coupling", [self.offset, self.coupling], 2)
        if not (self.lower < self.upper).all():
            k = int(np.argmin(self.lower < self.upper))
            raise InputError(
                f"lower: joint {k + 1} begins at {self.lower[k]:g} and ends at {self.upper[k]:g}; "
                "give lower limits below the upper ones."
            )
        margin, problem = self.wrist_margin, "is no share |cos q5|; give 0 to below 1."
        checks.require(0 <= margin < 1, "wrist_margin", margin, problem)

    @classmethod
    def seeing(cls, oTc: ArrayLike, q: ArrayLike, eTc: ArrayLike | None = None) -> Self:
        """The gantry with the object put where its camera, at joints q, has the pose oTc.

        oTc: (4, 4); q: (6,) in m and rad; eTc: (4, 4), identity where left out.
        """
        mount = cls(eTc=np.eye(4) if eTc is None else np.asarray(eTc, dtype=np.float64))
        return cls(
            bTo=mount.forward(checks.vector("q", q, 6)) @ inverse(checks.rigid("oTc", oTc)),
            eTc=mount.eTc,
        )

    def forward(self, q: ArrayLike) -> Array:
        """Pose bTc of the camera in the base for joints q: (..., 6) in m, rad → (..., 4, 4)."""
        return self._suffixes(q)[0]

    def jacobian(self, q: ArrayLike) -> Array:
        """Jacobian of the camera, ``T = J(q) q'`` in the camera frame: (..., 6) → (..., 6, 6)."""
        return self._screws_seen(q) @ self._gears

    def both(self, bTc: ArrayLike) -> Array:
        """Both solutions of the wrist, cos q₅ ≥ 0 first: (..., 4, 4) → (..., 2, 6) in m, rad.

        Angles θ lie in [−π, π], whatever the limits. Where axes 4 and 6 are one, θ₄ = 0 or ±π.
        """
        return np.stack([self._solve(bTc, sign) for sign in (1.0, -1.0)], axis=-2)

    def nearest(self, bTc: ArrayLike, q: ArrayLike) -> Array:
        """The solution nearest to joints q in its wrist, whole turns included.

        (..., 4, 4), (..., 6) in m and rad → (..., 6). Where axes 4 and 6 are one q₄ stays.
        """
        q = np.asarray(q, dtype=np.float64)
        near = self.without_gears(q)
        best = np.zeros(q.shape)
        least = np.full(q.shape[:-1], np.inf)
        for sign in (1.0, -1.0):
            theta = self.without_gears(self._solve(bTc, sign, near[..., 3]))
            theta[..., 3:] += 2 * np.pi * np.round((near - theta)[..., 3:] / (2 * np.pi))
            away = np.abs(theta - near)[..., 3:].sum(axis=-1)
            best = np.where((away < least)[..., None], theta, best)
            least = np.minimum(away, least)
        return self.with_gears(best)

    def nearest_one(self, bTc: Array, q: Sequence[float]) -> list[float]:
        """As ``nearest``, but for one pose, in plain arithmetic and several times faster.

        (4, 4), 6 numbers in m and rad → 6 numbers; zeros for a pose that is none (NaN).
        """
        (xx, xy, x, px), (yx, yy, y, py), (_, _, z, pz), _ = (bTc @ self._cTe).tolist()
        near = q[3], q[4], q[5] - self.coupling * q[4]
        c5 = math.hypot(x, y)
        best, least = [0.0] * 6, math.inf
        for sign in (1.0, -1.0):
            theta4 = math.atan2(-sign * x, sign * y) if c5 > ALIGNED else near[0]
            c4, s4 = math.cos(theta4), math.sin(theta4)
            theta5 = math.atan2(z, sign * c5)
            theta6 = math.atan2(c4 * xx + s4 * yx, c4 * xy + s4 * yy)
            wrist = [
                theta + _TURN * _rounded((now - theta) / _TURN)
                for theta, now in zip((theta4, theta5, theta6), near, strict=True)
            ]
            away = sum(abs(theta - now) for theta, now in zip(wrist, near, strict=True))
            if away < least:
                wrist[2] += self.coupling * wrist[1]
                best, least = [px - self.offset * c4, py - self.offset * s4, pz, *wrist], away
        return best

    def speeds_one(self, q: Array, T: Array) -> Array:
        """Speeds of the joints, ``q' = J⁻¹ T`` as in ``rates``, at one time and in closed form.

        Seen along axis 5, across it and along axis 6, the end effector turns by ``Ω = θ₅' e₁ +
        (θ₆' + θ₄' sin θ₅) e₂ + θ₄' cos θ₅ e₃``; the slides make up for what axis 4 displaces. (6,)
        in m and rad, (6,) → (6,).
        """
        _, _, _, q4, q5, q6 = q.tolist()
        c4, s4, c5, s5 = math.cos(q4), math.sin(q4), math.cos(q5), math.sin(q5)
        if abs(c5) < ALIGNED:
            return self.rates(q, T, np.zeros(6))[0]
        theta6 = q6 - self.coupling * q5
        c6, s6 = math.cos(theta6), math.sin(theta6)
        vx, vy, vz, wx, wy, wz = (self._mounted @ T).tolist()
        dtheta4 = (c6 * wz - s6 * wx) / c5
        dtheta5 = c6 * wx + s6 * wz
        dtheta6 = wy - s5 * dtheta4
        v1, v3 = c6 * vx + s6 * vz, c6 * vz - s6 * vx
        v2 = c5 * vy - s5 * v3  # level and across axis 5
        return np.array(
            (
                c4 * v1 - s4 * v2 + self.offset * s4 * dtheta4,
                s4 * v1 + c4 * v2 - self.offset * c4 * dtheta4,
                s5 * vy + c5 * v3,
                dtheta4,
                dtheta5,
                dtheta6 + self.coupling * dtheta5,
            )
        )

    def rates(self, q: Array, T: Array, dT: Array) -> tuple[Array, Array]:
        """Speeds and accelerations of the joints: ``q' = J⁻¹ T``, ``q'' = J⁻¹ (T' − J' q')``.

        q, T, dT: (..., 6), joints, twist of the camera and its derivative. Where axes 4 and 6 are
        one the least solution. Returns (..., 6) twice.
        """
        J = self._screws_seen(q)
        dtheta = _solve_linear(J, T, q[..., 4])
        moved = J * dtheta[..., None, :]
        # A screw is carried by the joints after it: J_j' = [J_j, Σ_{k>j} J_k θ_k'].
        later = np.cumsum(moved[..., ::-1], axis=-1)[..., ::-1] - moved
        turning = np.swapaxes(bracket(np.swapaxes(J, -1, -2), np.swapaxes(later, -1, -2)), -1, -2)
        carried = np.squeeze(turning @ dtheta[..., None], -1)
        ddtheta = _solve_linear(J, dT - carried, q[..., 4])
        return self.with_gears(dtheta), self.with_gears(ddtheta)

    def range_share(self, q: ArrayLike) -> Array:
        """Share of its range that each joint uses, 0 in the middle and 1 at a limit: (..., 6)."""
        middle, half = (self.upper + self.lower) / 2, (self.upper - self.lower) / 2
        return np.abs(np.asarray(q) - middle) / half

    def singularity(self, q: ArrayLike) -> Array:
        """How far the wrist is from its singularity, |cos q₅|: (..., 6) → (...,)."""
        return np.abs(np.cos(np.asarray(q, dtype=np.float64)[..., 4]))

    @property
    def _gears(self) -> Array:
        out = np.eye(6)
        out[5, 4] = -self.coupling
        return out

    def without_gears(self, q: ArrayLike) -> Array:
        """θ of joints q: (..., 6) in m and rad."""
        theta = np.array(q, dtype=np.float64)
        theta[..., 5] -= self.coupling * theta[..., 4]
        return theta

    def with_gears(self, theta: Array) -> Array:
        """q of θ, and q', q'' of its derivatives: (..., 6)."""
        q = np.array(theta)
        q[..., 5] += self.coupling * q[..., 4]
        return q

    @cached_property
    def _cTe(self) -> Array:
        return inverse(self.eTc)

    @cached_property
    def _mounted(self) -> Array:
        """From a twist of the camera to that of the end effector, seen along the axes at home."""
        home = np.eye(4)
        home[:3, :3] = _HOME
        return adjoint(home @ self.eTc)

    @cached_property
    def _screws(self) -> Array:
        """ξ of the six joints in the base with every joint at 0, (6, 6), one a row."""
        screws = np.eye(6)
        screws[3:] = 0.0
        screws[3, 5] = screws[4, 3] = screws[5, 4] = 1.0
        screws[5, 2] = self.offset  # axis 6 passes through (offset, 0, 0): v = −ω × p
        return screws

    def _suffixes(self, q: ArrayLike) -> list[Array]:
        """From each joint j on: ``e^{ξ_j θ_j} … e^{ξ₆θ₆} · home · eTc``, (..., 4, 4) each."""
        theta = self.without_gears(q)
        home = np.eye(4)
        home[:3, :3], home[0, 3] = _HOME, self.offset
        last = np.broadcast_to(home @ self.eTc, (*theta.shape[:-1], 4, 4))
        turns = exp(theta[..., None] * self._screws)
        out: list[Array] = []
        for k in reversed(range(6)):
            last = turns[..., k, :, :] @ last
            out.insert(0, last)
        return out

    def _screws_seen(self, q: ArrayLike) -> Array:
        """Screws of the joints in the camera frame, (..., 6, 6), one a column: T = S θ'."""
        columns = [
            adjoint(inverse(suffix)) @ screw
            for suffix, screw in zip(self._suffixes(q), self._screws, strict=True)
        ]
        return np.stack(columns, axis=-1)

    def _solve(self, bTc: ArrayLike, sign: float, theta4: ArrayLike = 0.0) -> Array:
        """One solution, with ``sign cos q₅ ≥ 0``; theta4 stands in where axes 4 and 6 are one."""
        bTe = np.asarray(bTc, dtype=np.float64) @ self._cTe
        R = bTe[..., :3, :3]
        x, y, z = R[..., 0, 2], R[..., 1, 2], R[..., 2, 2]  # (−s₄c₅, c₄c₅, s₅)
        c5 = np.hypot(x, y)
        theta4 = np.where(c5 > ALIGNED, np.arctan2(-sign * x, sign * y), theta4)
        theta5 = np.arctan2(z, sign * c5)
        c4, s4 = np.cos(theta4), np.sin(theta4)
        # y of the end effector seen along axis 5, and x along it: cos and sin of θ₆.
        theta6 = np.arctan2(
            c4 * R[..., 0, 0] + s4 * R[..., 1, 0], c4 * R[..., 0, 1] + s4 * R[..., 1, 1]
        )
        arm = np.stack([c4, s4, np.zeros_like(c4)], axis=-1)
        slides = bTe[..., :3, 3] - self.offset * arm
        wrist = np.stack([theta4, theta5, theta6], axis=-1)
        return self.with_gears(np.concatenate([slides, wrist], axis=-1))


Robot = FreeCamera | Gantry


def _rounded(x: float) -> float:
    """The nearest whole number, also of what is none: NaN stays NaN."""
    return x - math.remainder(x, 1.0)


def _solve_linear(J: Array, b: Array, q5: Array) -> Array:
    """J⁻¹ b; the least solution where the wrist is singular. (..., 6, 6), (..., 6) → (..., 6)."""
    aligned = np.abs(np.cos(q5)) < ALIGNED
    safe = np.where(aligned[..., None, None], np.eye(6), J)
    out: Array = np.squeeze(np.linalg.solve(safe, b[..., None]), -1)
    if aligned.any():
        out[aligned] = np.squeeze(
            np.linalg.pinv(J[aligned], rcond=10 * ALIGNED) @ b[aligned][..., None], -1
        )
    return out
