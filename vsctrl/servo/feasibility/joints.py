"""What the joints of a gantry do while the camera follows a trajectory."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.motion.trajectory import Trajectory
from vsctrl.servo.robot.gantry import ALIGNED, Gantry


@dataclass(frozen=True, eq=False)
class JointPath:
    """q(t), q'(t), q''(t) of the gantry whose camera follows a trajectory.

    Of the wrist's two solutions the one that is continuous from the start, also where axes 4 and 6
    become one and part again; of the two starts the one that uses the least of its joints' ranges.
    Beyond them q is not bounded: see ``feasibility``.

    gantry; trajectory: of finite duration; samples: number of times between which continuity is
    judged. Raises InputError for a trajectory that does not end and one that is all singular.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> gantry = vs.servo.Gantry.seeing(start, (0, 0, 0.2, 0, 0.5, 0))
    >>> path = vs.servo.JointPath(gantry, vs.paper.sliding().reference)
    >>> print(path.position([9.0]).round(3)[0, 2])
    0.516
    """

    gantry: Gantry
    trajectory: Trajectory
    samples: int = 2000
    _t: Array = field(init=False, repr=False)
    _q: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        checks.finite_duration(self.trajectory.duration)
        t = np.linspace(0.0, self.trajectory.duration, self.samples + 1)
        first, second = np.moveaxis(self.gantry.both(self._camera(t)), -2, 0)
        told = self.gantry.singularity(first) > 10 * ALIGNED
        if not told.any():
            raise InputError(
                "trajectory: axes 4 and 6 of the wrist are one all along, so their angles cannot "
                "be told apart; mount the camera (eTc) or place the object (bTo) otherwise."
            )
        t, first, second = t[told], first[told], second[told]
        crossed = _distance(first[1:], first[:-1]) > _distance(second[1:], first[:-1])
        other = np.concatenate([[False], np.cumsum(crossed) % 2 == 1])[:, None]
        paths = [
            self._unwrapped(np.where(other, second, first)),
            self._unwrapped(np.where(other, first, second)),
        ]
        object.__setattr__(self, "_t", t)
        object.__setattr__(
            self, "_q", min(paths, key=lambda q: float(self.gantry.range_share(q).max()))
        )

    def position(self, t: ArrayLike) -> Array:
        """Joints at the times t: (...,) in s → (..., 6) in m and rad."""
        t = checks.times(t)
        k = np.clip(np.searchsorted(self._t, t), 1, max(1, len(self._t) - 1))
        k = np.where(np.abs(t - self._t[k - 1]) <= np.abs(t - self._t[k % len(self._t)]), k - 1, k)
        return self.gantry.nearest(self._camera(t), self._q[k])

    def motion(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """q, q', q'' at the times t: (...,) in s → (..., 6) each, m, rad and per s, s²."""
        q = self.position(t)
        T, dT = self.trajectory.twist(t), self.trajectory.acceleration(t)
        return q, *self.gantry.rates(q, T, dT)

    def share(self, q: Array) -> Array:
        """Share of its range that each joint uses, 0 in the middle and 1 at a limit: (..., 6)."""
        return self.gantry.range_share(q)

    def _camera(self, t: Array) -> Array:
        return self.gantry.bTo @ self.trajectory.pose(t)

    def _unwrapped(self, q: Array) -> Array:
        theta = self.gantry.without_gears(q)
        theta[:, 3:] = np.unwrap(theta[:, 3:], axis=0)
        return self.gantry.with_gears(theta)


def _distance(a: Array, b: Array) -> Array:
    """Distance of two wrists, whole turns not counted: (..., 6) twice → (...,) in rad."""
    turn = (a - b)[..., 3:]
    return np.abs(turn - 2 * np.pi * np.round(turn / (2 * np.pi))).sum(axis=-1)
