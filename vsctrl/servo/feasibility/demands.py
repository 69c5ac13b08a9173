"""What a trajectory asks of camera, joints and view, at any times: the numbers that limits bound.

Whatever moves (the camera's centre, its orientation, each joint) has a velocity v and an
acceleration a along the given timing. Run through at another pace σ(t) it has ``v σ'`` and
``a σ'² + v σ''``; so ``moving`` is all that re-timing needs to know. What depends on the pose alone
(joint positions, the wrist, the image, depths) no pace can change.
"""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.camera.target import Target
from vsctrl.servo.feasibility.joints import JointPath
from vsctrl.servo.feasibility.limits import Limits
from vsctrl.servo.motion.trajectory import Trajectory
from vsctrl.servo.robot.gantry import FreeCamera, Gantry, Robot

Kind = Literal["speed", "acceleration", "geometry"]


class Row(NamedTuple):
    """One limit: its name, how it changes with the pace, its value, unit and who sets it."""

    name: str
    kind: Kind
    limit: float
    unit: str
    owner: str


class Moving(NamedTuple):
    """Velocities v and accelerations a of all that moves, each as shares of its limits.

    (m, n, 3): movers, times, components (joints have one, the others are zero).
    """

    v_speed: Array
    v_acceleration: Array
    a_acceleration: Array


class Asked(NamedTuple):
    """Values in the units of the rows, and their shares of the limits: (rows, n) each."""

    values: Array
    shares: Array


@dataclass(frozen=True, eq=False)
class Demands:
    """The demands of one trajectory under one set of limits.

    Raises InputError for a trajectory without end, and a field of view without camera or target.
    """

    trajectory: Trajectory
    limits: Limits
    robot: Robot = field(default_factory=FreeCamera)
    camera: Camera | None = None
    target: Target | None = None
    joints: JointPath | None = field(init=False)
    movers: tuple[tuple[Row, Row], ...] = field(init=False)  #: speed and acceleration of each
    shapes: tuple[Row, ...] = field(init=False)  #: what depends on the pose alone

    def __post_init__(self) -> None:
        checks.finite_duration(self.trajectory.duration)
        view = self.limits.field_of_view
        if view is not None and (self.camera is None or self.target is None):
            missing = "camera" if self.camera is None else "target"
            raise InputError(f"field_of_view: what is in it needs a {missing}; give {missing}=….")
        gantry = self.robot if isinstance(self.robot, Gantry) else None
        joints = JointPath(gantry, self.trajectory) if gantry else None
        object.__setattr__(self, "joints", joints)
        object.__setattr__(self, "movers", _movers(self.limits, gantry))
        object.__setattr__(self, "shapes", _shapes(self.limits, gantry, self.target is not None))

    @property
    def rows(self) -> tuple[Row, ...]:
        """All limits, in the order of ``ask``: speeds and accelerations by turns, then shapes."""
        return (*(row for pair in self.movers for row in pair), *self.shapes)

    def ask(self, t: Array) -> Asked:
        """What is asked at the times t, (n,) in s."""
        v, a, q = self._velocities(t)
        values = np.empty((len(self.rows), len(t)))
        shares = np.empty_like(values)
        for k, (speed, acceleration) in enumerate(self.movers):
            for i, row, vector in ((2 * k, speed, v[k]), (2 * k + 1, acceleration, a[k])):
                values[i] = np.linalg.norm(vector, axis=-1)
                shares[i] = values[i] / row.limit
        if self.shapes:
            first = 2 * len(self.movers)
            values[first:], shares[first:] = self._pose_demands(t, q)
        return Asked(values, shares)

    def shares(self, t: Array) -> Array:
        """Shares of the limits at the times t: (n,) in s → (rows, n)."""
        return self.ask(t).shares

    def moving(self, t: Array) -> Moving:
        """Velocities and accelerations at the times t, (n,) in s, as shares of the limits."""
        v, a, _ = self._velocities(t)
        speed = np.array([pair[0].limit for pair in self.movers])[:, None, None]
        acceleration = np.array([pair[1].limit for pair in self.movers])[:, None, None]
        return Moving(v / speed, v / acceleration, a / acceleration)

    def jump_in(self, t: float, size: Array) -> Array:
        """Sizes of what jumps with a jump of the twist at t: (movers,) in m/s, rad/s."""
        out = [np.linalg.norm(size[:3]), np.linalg.norm(size[3:])]
        if self.joints is not None:
            q = self.joints.position(np.array([t]))
            out += list(np.abs(self.joints.gantry.rates(q, size[None], np.zeros((1, 6)))[0][0]))
        return np.array(out)

    def _velocities(self, t: Array) -> tuple[Array, Array, Array | None]:
        """v and a of each mover, (m, n, 3), and the joints (n, 6) if there are any."""
        T, dT = self.trajectory.twist(t), self.trajectory.acceleration(t)
        v = np.zeros((len(self.movers), len(t), 3))
        a = np.zeros_like(v)
        v[0], v[1] = T[:, :3], T[:, 3:]
        # The camera frame turns with the camera: the centre's acceleration in space is V' + Ω × V.
        a[0], a[1] = dT[:, :3] + np.cross(T[:, 3:], T[:, :3]), dT[:, 3:]
        q = None
        if self.joints is not None:
            q, dq, ddq = self.joints.motion(t)
            v[2:, :, 0], a[2:, :, 0] = dq.T, ddq.T
        return v, a, q

    def _pose_demands(self, t: Array, q: Array | None) -> tuple[list[Array], list[Array]]:
        values: list[Array] = []
        shares: list[Array] = []
        if self.joints is not None and q is not None:
            gantry = self.joints.gantry
            values += list(q.T)
            shares += list(gantry.range_share(q).T)
            values.append(gantry.singularity(q))
            shares.append(_over(np.full(len(t), gantry.wrist_margin), values[-1]))
        if self.target is not None:
            camera = self.camera or Camera(1.0, 1.0)
            p = camera.points(self.trajectory.pose(t), self.target.points)
            z = p[..., 2]
            values += [z.min(axis=-1), z.max(axis=-1)]
            shares.append(_over(np.full(len(t), self.limits.nearest), values[-2]))
            shares.append(values[-1] / self.limits.farthest)
            for axis, half in enumerate(self.limits.field_of_view or ()):
                focal = (camera.Fx, camera.Fy)[axis]
                # Behind the camera there is no image: infinitely far outside.
                image = _over(focal * np.abs(p[..., axis]), z).max(axis=-1)
                values.append(image)
                shares.append(image / half)
        return values, shares


def _movers(limits: Limits, gantry: Gantry | None) -> tuple[tuple[Row, Row], ...]:
    a, alpha = limits.acceleration, limits.angular_acceleration
    out = [
        _mover("speed", "acceleration", (limits.speed, a), "m/s"),
        _mover("rate", "angular_acceleration", (limits.rate, alpha), "rad/s"),
    ]
    if gantry is None:
        return tuple(out)
    owners = "robot.speeds", "robot.accelerations"
    for k, pair in enumerate(
        zip(gantry.speeds.tolist(), gantry.accelerations.tolist(), strict=True)
    ):
        names = f"speed of joint {k + 1}", f"acceleration of joint {k + 1}"
        out.append(_mover(*names, pair, "m/s" if k < 3 else "rad/s", owners))
    return tuple(out)


def _mover(
    speed: str,
    acceleration: str,
    most: tuple[float, float],
    unit: str,
    owners: tuple[str, str] | None = None,
) -> tuple[Row, Row]:
    """The rows of one mover, whose limits are set by ``limits`` where nothing else is said."""
    first, second = owners or (f"limits.{speed}", f"limits.{acceleration}")
    return (
        Row(speed, "speed", most[0], unit, first),
        Row(acceleration, "acceleration", most[1], f"{unit}²", second),
    )


def _shapes(limits: Limits, gantry: Gantry | None, target: bool) -> tuple[Row, ...]:
    out: list[Row] = []
    if gantry is not None:
        out += [
            Row(
                f"position of joint {k + 1}",
                "geometry",
                float(gantry.upper[k]),
                "m" if k < 3 else "rad",
                "robot.lower, robot.upper",
            )
            for k in range(6)
        ]
        out.append(Row("wrist", "geometry", gantry.wrist_margin, "", "robot.wrist_margin"))
    if target:
        out.append(Row("nearest", "geometry", limits.nearest, "m", "limits.nearest"))
        out.append(Row("farthest", "geometry", limits.farthest, "m", "limits.farthest"))
        for name, half in zip(("width", "height"), limits.field_of_view or (), strict=False):
            out.append(Row(f"half {name} of view", "geometry", half, "px", "limits.field_of_view"))
    return tuple(out)


def _over(a: Array, b: Array) -> Array:
    """a/b where b > 0, else infinite (0 where a is 0)."""
    out = np.where(a > 0, np.inf, 0.0)
    return np.divide(a, b, out=out, where=b > 0)
