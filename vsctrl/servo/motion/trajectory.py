"""The motion that the camera is asked to make.

A trajectory answers ``pose(t)``, ``twist(t)`` and ``acceleration(t)`` for arrays of times; the
reference image s*(t) and its derivative ``L(s*, Z*) T*`` follow from these through ``camera`` (eq.
16, 17 are special cases). Here are the elementary motions, along one screw; ``path`` goes through
given poses and ``linked`` puts motions one after another.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.checks import is_number
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.pose import exp

Waveform = Literal["sine", "triangle"]
MOST_JUMPS = 1_000_000
# Rotation per translation (rad/m) beyond which a direction's translation cannot be meant.
STEEPEST_SCREW = 1e6


class Jump(NamedTuple):
    """A sudden change of the twist: when (s), and by how much, (6,) in m/s and rad/s.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> parts = [vs.servo.translation(start, (v, 0, 0), 1.0) for v in (0.1, 0.2)]
    >>> vs.servo.Linked(start, parts, blend="none").jumps[0].t
    1.0
    """

    t: float
    size: Array


class Trajectory(ABC):
    """A reference motion ``oTc*(t)`` on 0 ≤ t ≤ duration, as a frozen value.

    ``oTc*' = oTc* · hat(T*)``, so that T* is the twist in the camera frame. At a jump ``twist`` is
    the value after it. Outside its interval a motion goes on as it ends: an oscillation goes on
    oscillating, all others keep the twist of that end.

    >>> slide = vs.paper.sliding()
    >>> isinstance(slide.reference, vs.servo.Trajectory)
    True
    """

    oTc0: Array  #: (4, 4), the pose at t = 0
    duration: float  #: s

    @abstractmethod
    def pose(self, t: ArrayLike) -> Array:
        """Pose at the times t: (...,) in s → (..., 4, 4)."""

    @abstractmethod
    def twist(self, t: ArrayLike) -> Array:
        """Twist at the times t: (...,) in s → (..., 6), (V, Ω) in m/s and rad/s."""

    @abstractmethod
    def acceleration(self, t: ArrayLike) -> Array:
        """Derivative of the twist in the camera frame: (...,) in s → (..., 6), m/s² and rad/s²."""

    @property
    def jumps(self) -> tuple[Jump, ...]:
        """Where the twist jumps between start and end, in order of time."""
        return ()

    def twist_at_frames(self, t: ArrayLike) -> Array:
        """Twist at frames t: (...,) in s → (..., 6); after the jump that a frame is at.

        Times and periods are typed with few digits, and rounding must not choose the side.
        """
        return self.twist(timing.after(checks.times(t), np.array([jump.t for jump in self.jumps])))

    @property
    def end_twist(self) -> Array:
        """The twist with which the motion ends, (6,): before a jump at that very moment."""
        return self.twist(self.duration)

    def _carried_on(self, poses: Array, t: Array, inside: Array) -> Array:
        """Poses at the times inside the motion, carried on to t with the twist of its ends."""
        if (t == inside).all():
            return poses
        return poses @ exp((t - inside)[..., None] * self.twist(inside))


@dataclass(frozen=True, slots=True, eq=False)
class ConstantScrew(Trajectory):
    """Motion with a constant twist in the camera frame: translation, rotation or both (eq. 14).

    ``oTc*(t) = oTc0 · exp(T t)``.

    oTc0: (4, 4), the pose at t = 0; T: (6,), (V, Ω) in m/s and rad/s; duration: s.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> vs.servo.ConstantScrew(start, np.array([0.1, 0, 0, 0, 0, 0]), 2.0).twist(1.0)
    array([0.1, 0. , 0. , 0. , 0. , 0. ])
    """

    oTc0: Array
    T: Array
    duration: float = math.inf

    def __post_init__(self) -> None:
        checks.pose("oTc0", self.oTc0)
        checks.vector("T", self.T, 6)
        checks.duration(self.duration)

    def pose(self, t: ArrayLike) -> Array:
        """Pose at the times t: (...,) in s → (..., 4, 4)."""
        return self.oTc0 @ exp(checks.times(t)[..., None] * self.T)

    def twist(self, t: ArrayLike) -> Array:
        """Twist at the times t: (...,) in s → (..., 6), (V, Ω) in m/s and rad/s."""
        return np.broadcast_to(self.T, (*np.shape(checks.times(t)), 6))

    def acceleration(self, t: ArrayLike) -> Array:
        """Zero: (...,) in s → (..., 6)."""
        return np.zeros((*np.shape(checks.times(t)), 6))


def hold(oTc0: Array, duration: float) -> ConstantScrew:
    """Rest at a pose: (4, 4), s. Raises InputError for a duration that is not above 0.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> vs.servo.hold(start, 2.0).twist(1.0)
    array([0., 0., 0., 0., 0., 0.])
    """
    return ConstantScrew(oTc0, np.zeros(6), duration)


def translation(oTc0: Array, V: ArrayLike, duration: float) -> ConstantScrew:
    """Translation at a constant velocity of the camera frame (eq. 16).

    oTc0: (4, 4); V: (3,) in m/s; duration: s. Raises InputError for values out of range.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> print(vs.servo.translation(start, V=(0.1, 0, 0), duration=2).twist(0.0))
    [0.1 0.  0.  0.  0.  0. ]
    """
    return ConstantScrew(oTc0, np.concatenate([checks.vector("V", V, 3), np.zeros(3)]), duration)


def rotation(
    oTc0: Array, axis: ArrayLike, arm: ArrayLike, speed: float, duration: float
) -> ConstantScrew:
    """Rotation about an axis that is fixed in the camera frame, and so in space (eq. 17).

    ``Ω = ω r``, ``V = −ω r × d``: the paper prints the opposite sign of V, against its eq. 17.

    oTc0: (4, 4); axis: (3,), direction of r; arm: (3,), d from the camera to a point of the axis in
    the camera frame, m; speed: ω in rad/s; duration: s. Raises InputError for an axis of no length.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> turn = vs.servo.rotation(start, axis=(0, 1, 0), arm=(0, 0, 0.8), speed=0.1, duration=3)
    >>> print(turn.twist(0.0))
    [-0.08  0.    0.    0.    0.1   0.  ]
    """
    r = checks.unit("axis", checks.vector("axis", axis, 3))
    (omega,) = checks.vector("speed", [speed], 1)
    V = -omega * np.cross(r, checks.vector("arm", arm, 3))
    return ConstantScrew(oTc0, np.concatenate([V, omega * r]) + 0.0, duration)


@dataclass(frozen=True, slots=True, eq=False)
class Oscillation(Trajectory):
    """To and fro along one screw, from the middle and with positive speed at first.

    ``oTc*(t) = oTc0 · exp(D a w(t/period))`` with w(x) = sin 2πx, or the triangle of the same zeros
    and peaks, whose speed ``4 a/period`` is constant between its turning points.

    oTc0: (4, 4), the middle; direction: (6,), any length: D has a translation of 1 m, or where it
    has none a rotation of 1 rad; amplitude: a in m or rad accordingly; period, duration: s.
    Raises InputError for a direction of no length, and numbers that are not above 0.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> sway = vs.servo.Oscillation(start, np.eye(6)[0], amplitude=0.1, period=4, duration=8)
    >>> print(sway.twist(0.0)[0].round(4))
    0.1571
    """

    oTc0: Array
    direction: Array
    amplitude: float
    period: float
    duration: float
    waveform: Waveform = "sine"

    def __post_init__(self) -> None:
        checks.pose("oTc0", self.oTc0)
        D = checks.vector("direction", self.direction, 6)
        part = D[:3] if D[:3].any() else D[3:]
        checks.unit("direction", part)
        size = np.abs(part).max()
        with np.errstate(over="ignore"):  # refused below
            D = D / size / np.linalg.norm(part / size)
        if not np.abs(D).max() <= STEEPEST_SCREW:
            raise InputError(
                f"direction: a translation of {math.hypot(*part):.3g} beside a rotation of "
                f"{math.hypot(*self.direction[3:]):.3g} is rounding; set it to 0."
            )
        object.__setattr__(self, "direction", D)
        for name in ("amplitude", "period"):
            value = getattr(self, name)
            kept = is_number(value) and 0 < value < math.inf
            checks.require(kept, name, value, "is not a number above 0; give one.")
        checks.duration(self.duration)
        known = isinstance(self.waveform, str) and self.waveform in ("sine", "triangle")
        problem = "is no waveform; choose 'sine' or 'triangle'."
        checks.require(known, "waveform", self.waveform, problem)

    def pose(self, t: ArrayLike) -> Array:
        """Pose at the times t: (...,) in s → (..., 4, 4)."""
        # The wave of the phase rather than of t: no digits are lost after many periods.
        x = self._phase(t)
        if self.waveform == "sine":
            w = np.sin(2 * np.pi * x)
        else:
            w = np.where(x < 0.25, 4 * x, np.where(x < 0.75, 2 - 4 * x, 4 * x - 4))
        return self.oTc0 @ exp((self.amplitude * w)[..., None] * self.direction)

    def twist(self, t: ArrayLike) -> Array:
        """Twist at the times t: (...,) in s → (..., 6), (V, Ω) in m/s and rad/s."""
        return self._moving(self._phase(t))

    def twist_at_frames(self, t: ArrayLike) -> Array:
        """Twist at frames t: (...,) in s → (..., 6); after the turn that a frame is at."""
        if self.waveform == "sine":
            return self.twist(t)
        quarters = timing.to_whole(4 * checks.times(t) / self.period)  # turns are at 1, 3, 5, …
        return self._moving(quarters % 4 / 4)

    def _moving(self, x: Array) -> Array:
        """Twist at the phases x: (...,) of a cycle → (..., 6)."""
        if self.waveform == "sine":
            slope = 2 * np.pi * np.cos(2 * np.pi * x)
        else:
            slope = np.where((x < 0.25) | (x >= 0.75), 4.0, -4.0)
        return (self.amplitude / self.period * slope)[..., None] * self.direction

    def acceleration(self, t: ArrayLike) -> Array:
        """Derivative of the twist: (...,) in s → (..., 6); of the triangle zero between jumps."""
        x = self._phase(t)
        bend = np.zeros_like(x)
        if self.waveform == "sine":
            bend = -((2 * np.pi) ** 2) * np.sin(2 * np.pi * x)
        return (self.amplitude / self.period**2 * bend)[..., None] * self.direction

    @property
    def jumps(self) -> tuple[Jump, ...]:
        """The turning points of the triangle. Raises InputError where they are too many to list."""
        if self.waveform == "sine":
            return ()
        if not self._turns < MOST_JUMPS:
            raise InputError(
                f"duration: {self.duration:g} s has more than {MOST_JUMPS} turning points at a "
                f"period of {self.period:g} s; give a shorter one."
            )
        size = 8 * self.amplitude / self.period * self.direction
        return tuple(
            Jump((0.25 + k / 2) * self.period, size if k % 2 else -size)
            for k in range(int(self._turns))
        )

    @property
    def end_twist(self) -> Array:
        """The twist with which the motion ends, (6,): before a jump at that very moment."""
        if self.waveform == "sine":
            return self.twist(self.duration)
        speed = 4 * self.amplitude / self.period
        return (-speed if self._turns % 2 else speed) * self.direction

    @property
    def _turns(self) -> float:
        """Turning points before the end; one at the very end, by `timing.whole`, is none."""
        if not math.isfinite(4 * self.duration / self.period):
            return math.inf
        quarters = timing.in_periods(4 * self.duration, self.period)
        return float(max(0, math.ceil((quarters - 1) / 2)))

    def _phase(self, t: ArrayLike) -> Array:
        x = checks.times(t) / self.period
        return x - np.floor(x)
