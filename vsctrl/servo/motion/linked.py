"""Motions one after another, with or without a smooth passage between them.

The paper leaves the linkage of elementary trajectories open. Where one constant twist follows
another the twist jumps, which no robot can follow; a blend leads from one to the other within
limits of acceleration. Its pose has no closed form (twists of different screws do not commute) and
is integrated on SE(3) (``magnus``).
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.magnus import MOST_STEPS, STEP, integrated, magnus
from vsctrl.servo.motion.trajectory import Jump, Trajectory
from vsctrl.servo.pose import exp, inverse

Profile = Literal["linear", "smooth"]
Blending = Literal["none", "linear", "smooth"]

# Greatest slope of a profile from 0 to 1 over 0..1.
STEEPEST: dict[Profile, float] = {"linear": 1.0, "smooth": 1.5}
# A change of twist below this share of the twists is rounding, not a jump.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Blend(Trajectory):
    """Passage from one twist to another on a straight line between them.

    ``T*(t) = A + (B − A) σ(t/duration)``, σ(u) = u (linear: constant acceleration), or
    ``3u² − 2u³`` (smooth: an acceleration that begins and ends at zero).

    oTc0: (4, 4); A, B: (6,) in m/s and rad/s; duration: s. Raises InputError for values out of
    range, and for a passage of more than 5000 rad.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> twist = np.array([0.2, 0, 0, 0, 0, 0])
    >>> print(vs.servo.Blend(start, 0 * twist, twist, 2.0).twist(1.0))
    [0.1 0.  0.  0.  0.  0. ]
    """

    oTc0: Array
    A: Array
    B: Array
    duration: float
    profile: Profile = "linear"
    _knots: Array = field(init=False, repr=False)
    _poses: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        A, B = checks.vector("A", self.A, 6), checks.vector("B", self.B, 6)
        checks.duration(self.duration)
        checks.choice("profile", self.profile, tuple(STEEPEST))
        turn = max(np.linalg.norm(A[3:]), np.linalg.norm(B[3:])) * self.duration
        if not turn <= STEP * MOST_STEPS:
            raise InputError(
                f"duration: in {self.duration:g} s the camera turns by up to {turn:.3g} rad, more "
                f"than a blend of {STEP * MOST_STEPS:g} rad can hold; raise the acceleration limit."
            )
        knots = np.linspace(0.0, self.duration, max(2, math.ceil(turn / STEP)) + 1)
        poses = integrated(self.oTc0, self._inside, knots)
        for name, value in {"A": A, "B": B, "_knots": knots, "_poses": poses}.items():
            object.__setattr__(self, name, value)

    def pose(self, t: ArrayLike) -> Array:
        """Pose at the times t: (...,) in s → (..., 4, 4)."""
        t = checks.times(t)
        inside = np.clip(t, 0.0, self.duration)
        k = np.searchsorted(self._knots, inside, side="right") - 1
        poses = self._poses[k] @ exp(magnus(self._inside, self._knots[k], inside))
        return self._carried_on(poses, t, inside)

    def twist(self, t: ArrayLike) -> Array:
        """Twist at the times t: (...,) in s → (..., 6), (V, Ω) in m/s and rad/s."""
        return self._inside(np.clip(checks.times(t), 0.0, self.duration))

    def acceleration(self, t: ArrayLike) -> Array:
        """Derivative of the twist: (...,) in s → (..., 6), m/s² and rad/s²."""
        t = checks.times(t)
        inside = np.clip(t, 0.0, self.duration)
        u = inside / self.duration
        slope = np.ones_like(u) if self.profile == "linear" else 6 * u * (1 - u)
        slope = np.where(t == inside, slope, 0.0)
        return slope[..., None] * ((self.B - self.A) / self.duration)

    def _inside(self, t: Array) -> Array:
        u = (t / self.duration)[..., None]
        share = u if self.profile == "linear" else u * u * (3 - 2 * u)
        return self.A + (self.B - self.A) * share


class _Segment(NamedTuple):
    """A part or a blend: when it begins, and the pose that its own motion is carried by."""

    start: float
    carrier: Array
    motion: Trajectory


@dataclass(frozen=True, eq=False)
class Linked(Trajectory):
    """Motions one after another, each from where the one before it ends.

    Only how a part moves counts, not where it was described to start. A blend takes the time that
    its limits need, between the parts, which keep their own durations:
    ``h = σ'max · max(|ΔV|/a, |ΔΩ|/α)``, σ'max = 1 (linear) or 1.5 (smooth). With linear blends
    the twist is continuous; with smooth ones the acceleration is so too wherever the parts begin
    and end without one. The limits hold in the blends; what parts do inside (their acceleration,
    the turning points of a triangle) is theirs. With "none" ``jumps`` tells what linking did.

    oTc0: (4, 4); parts: at least one, each of finite duration; blend: "none", "linear" or
    "smooth"; max_acceleration: (a, α), m/s² and rad/s²; from_rest, to_rest: blend from and to zero
    twist at the ends. Raises InputError for values out of range and for rests without a blend.

    >>> start = vs.paper.sliding().reference.oTc0
    >>> parts = [vs.servo.translation(start, (v, 0, 0), 1.0) for v in (0.1, 0.2)]
    >>> print(vs.servo.Linked(start, parts, blend="smooth").duration)
    3.5
    """

    oTc0: Array
    parts: Sequence[Trajectory]
    blend: Blending = "linear"
    max_acceleration: tuple[float, float] = (0.1, 0.5)
    from_rest: bool = False
    to_rest: bool = False
    duration: float = field(init=False)
    _segments: tuple[_Segment, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        checks.pose("oTc0", self.oTc0)
        listed = isinstance(self.parts, Sequence)
        if not (listed and self.parts and all(_finite(part) for part in self.parts)):
            raise InputError("parts: give at least one motion, each of finite duration.")
        checks.choice("blend", self.blend, ("none", *STEEPEST))
        limits = checks.vector("max_acceleration", self.max_acceleration, 2)
        if not (limits > 0).all():
            raise InputError(
                f"max_acceleration: {self.max_acceleration} must be above 0; give (m/s², rad/s²)."
            )
        if self.blend == "none" and (self.from_rest or self.to_rest):
            raise InputError(
                "from_rest, to_rest: without a blend nothing leads from or to rest; give blend = "
                '"linear" or "smooth", or leave them out.'
            )
        segments = []
        start, oTc = 0.0, np.array(self.oTc0, dtype=np.float64)
        for motion in self._chain():
            carrier = oTc @ inverse(motion.pose(0.0))
            segments.append(_Segment(start, carrier, motion))
            start, oTc = start + motion.duration, carrier @ motion.pose(motion.duration)
        object.__setattr__(self, "parts", tuple(self.parts))
        object.__setattr__(self, "_segments", tuple(segments))
        object.__setattr__(self, "duration", start)

    def _chain(self) -> Iterator[Trajectory]:
        """Parts and the blends between them, in order."""
        before = np.zeros(6) if self.from_rest else None
        for part in self.parts:
            if before is not None:
                yield from self._passage(before, part.twist(0.0))
            yield part
            before = part.end_twist
        if self.to_rest and before is not None:
            yield from self._passage(before, np.zeros(6))

    def _passage(self, A: Array, B: Array) -> Iterator[Blend]:
        if self.blend == "none" or not _differ(A, B):
            return
        # hypot, because the squares of the tiniest changes vanish.
        V, Omega = math.hypot(*(B[:3] - A[:3])), math.hypot(*(B[3:] - A[3:]))
        a, alpha = self.max_acceleration
        h = STEEPEST[self.blend] * max(V / a, Omega / alpha)
        yield Blend(np.eye(4), A, B, h, self.blend)

    def pose(self, t: ArrayLike) -> Array:
        """Pose at the times t: (...,) in s → (..., 4, 4)."""
        return self._each(t, (4, 4), lambda s, t: s.carrier @ s.motion.pose(t))

    def twist(self, t: ArrayLike) -> Array:
        """Twist at the times t: (...,) in s → (..., 6), (V, Ω) in m/s and rad/s."""
        return self._each(t, (6,), lambda s, t: s.motion.twist(t))

    def acceleration(self, t: ArrayLike) -> Array:
        """Derivative of the twist: (...,) in s → (..., 6), m/s² and rad/s²."""
        return self._each(t, (6,), lambda s, t: s.motion.acceleration(t))

    @property
    def jumps(self) -> tuple[Jump, ...]:
        """Where the twist jumps: inside the parts, and between them where there is no blend."""
        out: list[Jump] = []
        for number, (start, _, motion) in enumerate(self._segments):
            if number:
                before = self._segments[number - 1].motion.end_twist
                after = motion.twist(0.0)
                if _differ(before, after):
                    out.append(Jump(start, after - before))
            out += [Jump(start + t, size) for t, size in motion.jumps]
        return tuple(out)

    def _each(
        self, t: ArrayLike, shape: tuple[int, ...], ask: Callable[[_Segment, Array], Array]
    ) -> Array:
        """Ask every segment for the times that are its own."""
        t = checks.times(t)
        flat = t.ravel()
        starts = np.array([segment.start for segment in self._segments])
        owner = np.clip(np.searchsorted(starts, flat, side="right") - 1, 0, None)
        out = np.empty((flat.size, *shape))
        for k in np.unique(owner):
            mine = owner == k
            out[mine] = ask(self._segments[k], flat[mine] - starts[k])
        return out.reshape(*t.shape, *shape)


def _differ(A: Array, B: Array) -> bool:
    scale = ROUNDING * (np.abs(A) + np.abs(B)).max()
    return bool((np.abs(B - A) > scale).any())


def _finite(part: object) -> bool:
    """Whether this is a motion that ends."""
    return isinstance(part, Trajectory) and math.isfinite(part.duration)
