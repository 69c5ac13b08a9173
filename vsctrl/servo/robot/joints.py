"""The joints under a camera whose twist is controlled: their speeds, their ends, and keeping away.

The joints follow the camera by inverse kinematics. A twist that asks too much of one joint is
scaled as a whole, so that the camera keeps its path and only slows down. Avoidance is a velocity
damper: within a zone before its limit a joint may approach by

    q' ≤ speed · (d − s)/(z − s),    d the distance left, z the zone, s a safety distance

so that it comes to rest there. A frame is not infinitely short: in its course the joint may use up
``γ (d − s)`` at most, ``γ = min(speed · period/(z − s), 1/2)``, and this is judged by the exact
joints within the frame. Because one joint at its end holds the whole twist, a camera that keeps
being sent there stands still; it leaves as soon as it is sent elsewhere.

Source: Faverjon and Tournassoud, A local based approach for path planning of manipulators with a
high number of degrees of freedom (IEEE ICRA 1987, pp. 1152-1159), the velocity damper.
"""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo.robot.axes import TwistSegment, along
from vsctrl.servo.robot.capability import Capability
from vsctrl.servo.robot.gantry import Gantry

# Shares of a joint's range: the damper's zone at either end, and the distance never used, which
# covers how far a joint may bulge between the times at which a frame is judged.
ZONE = 0.1
SAFETY = 1e-4
# At most this share of the distance left in one frame, however fast the joint or slow the video.
MOST = 0.5
# A frame is judged at four times, and at four times as many while a joint near its end bends
# between them by more than half the safety distance.
TIMES, MOST_TIMES = 4, 256
# The camera at joints0 may be this far from where it is said to start, m and rad.
SAME = 1e-6
# Joints come out of a pose: rounding (m, rad), times what a wrist near its singularity makes of it.
ROUNDING, BEYOND = 1e-12, 1e-9
# Wrist angles (rad) within which the nearest solution is told from the start of the frame alone.
CLEAR = 1.0
# Up to so many poses plain arithmetic is the faster one.
FEW = 16
# The brakes are sought by trial: less by the margin than the last trial seemed to allow, but not by
# more than this at once, for what a long way meets a short one may not.
MARGIN, LEAST, TRIALS = 1e-9, 0.25, 50


class Stop(NamedTuple):
    """Why the robot went no further.

    sentence; frame: that could not be reached, the one before it is the last legal one; joint:
    1..6 with its value and limit in m or rad, None where no joint is to blame.
    """

    sentence: str
    frame: int
    joint: int | None = None
    value: float | None = None
    limit: float | None = None


class Arm:
    """The joints of a gantry that carries a camera, from frame to frame.

    capability: whose gantry is moved; start: (4, 4), pose of the camera in the frame that
    ``gantry.bTo`` places; period: of the video, s. Raises InputError where the joints do not put
    the camera there or lie outside their ranges.
    """

    def __init__(self, capability: Capability, start: Array, period: float) -> None:
        gantry = capability.gantry or Gantry()
        self._gantry, self._period, self._avoidance = gantry, period, capability.avoidance
        reach = gantry.upper - gantry.lower
        self._safety = SAFETY * reach
        self._zone = (ZONE - SAFETY) * reach
        self._gamma = np.minimum(gantry.speeds * period / self._zone, MOST)
        self.q = _begin(gantry, start, capability.joints0)

    def share(self, T: Array) -> float:
        """Share 0..1 of a twist that the joints let through where they are: (6,) → float.

        The joints' speeds ``J⁻¹ T`` against their limits and, with avoidance, the damper's.
        """
        speed = self._gantry.speeds_one(self.q, T)
        most = self._gantry.speeds
        if self._avoidance:
            distance = np.where(speed > 0, *self._distances(self.q))
            damped = self._gamma * np.clip(distance, 0.0, self._zone) / self._period
            most = np.where(distance < self._zone, np.minimum(most, damped), most)
        return _least(most, np.abs(speed))

    def carry(self, pose: Array, segments: Sequence[TwistSegment]) -> tuple[float, Array]:
        """Share of the segments' twist that the brakes leave, and the joints in the frame's course.

        The share is 1 unless a joint, by its exact motion, would be too fast in the mean between
        two times of the frame or come too near to its limit: the brakes are stronger than the
        limits of acceleration and than the lag. pose: (4, 4). Returns the share 0..1 and (n, 6).
        """
        share, n = 1.0, TIMES
        for _ in range(TRIALS):
            tried = segments if share == 1 else [segment.scaled(share) for segment in segments]
            q = self._joints(pose @ along(tried, _times(self._period, n)))
            if self._avoidance and n < MOST_TIMES and self._hides(q):
                n *= TIMES
                continue
            less = self._admissible(q, self._period / n)
            if less == 1:
                return share, q
            share, n = share * max(less, LEAST) * (1 - MARGIN), TIMES
            if not share > ROUNDING:
                break
        return 0.0, np.repeat(self.q[None], TIMES, axis=0)

    def stop(self, q: Array, frame: int, t: float) -> Stop | None:
        """The first joint beyond its range in the course of a frame, (n, 6), which ends at t."""
        gantry = self._gantry
        out = (q < gantry.lower - BEYOND) | (q > gantry.upper + BEYOND)
        if not out.any():
            return None
        row = int(np.argmax(out.any(axis=1)))
        joint = int(np.argmax(out[row]))
        value = float(q[row, joint])
        limit = float((gantry.upper if value > gantry.upper[joint] else gantry.lower)[joint])
        unit = "m" if joint < 3 else "rad"
        return Stop(
            f"On the way to frame {frame} (t = {t:g} s) joint {joint + 1} would pass the end of "
            f"its range: it would stand at {value:.6g} {unit}, the limit is {limit:.6g} {unit}. "
            "Move less far, place the object (bTo) or begin (joints0) elsewhere, or turn on "
            "avoidance.",
            frame,
            joint + 1,
            value,
            limit,
        )

    def _joints(self, wTc: Array) -> Array:
        """Joints at the poses of a frame, in order: (n, 4, 4) → (n, 6) in m and rad."""
        bTc = self._gantry.bTo @ wTc
        if len(bTc) <= FEW:
            begin = self.q.tolist()
            out = np.array([self._gantry.nearest_one(pose, begin) for pose in bTc])
        else:
            out = self._gantry.nearest(bTc, np.broadcast_to(self.q, (len(bTc), 6)))
        if np.abs(out - self.q)[:, 3:].max() < CLEAR:
            return out
        near = self.q  # the wrist has come far: each time is nearest to the one before it
        for k, pose in enumerate(bTc):
            near = out[k] = self._gantry.nearest(pose, near)
        return out

    def _hides(self, q: Array) -> bool:
        """Whether joints may pass their ends unseen between the times of a course: (n, 6).

        An arc is by an eighth of its second difference away from its chord.
        """
        course = np.concatenate([self.q[None], q])
        steps = course[1:] - course[:-1]
        arc = np.abs(steps[1:] - steps[:-1]).max(axis=0) / 8
        distance = np.minimum(*self._distances(course)).min(axis=0)
        return bool(((arc > self._safety / 2) & (distance < 2 * arc)).any())

    def _admissible(self, q: Array, between: float) -> float:
        """1 if the joints of a frame's course are allowed, else how much less to try: (n, 6)."""
        course = np.concatenate([self.q[None], q])
        less = _least(self._gantry.speeds * between, np.abs(course[1:] - course[:-1]))
        if self._avoidance:
            for distance, used in zip(
                self._distances(self.q), (q - self.q, self.q - q), strict=True
            ):
                # Within the zone a share of what is left, outside all but what the damper of a
                # joint at the zone's edge would leave.
                free = np.clip(distance - self._zone, 0.0, None)
                allowed = free + self._gamma * np.clip(distance, 0.0, self._zone)
                less = min(less, _least(allowed, used))
        return less

    def _distances(self, q: Array) -> tuple[Array, Array]:
        """Distances to the upper and the lower limit, less the safety distance, (6,) each."""
        gantry = self._gantry
        return gantry.upper - q - self._safety, q - gantry.lower - self._safety


@cache
def _times(period: float, n: int) -> Array:
    """The times at which a frame is judged, (n,) in s, the last of them its end."""
    t = np.linspace(0.0, period, n + 1)[1:]
    t.setflags(write=False)
    return t


def _least(most: Array, asked: Array) -> float:
    """Least share ``most/asked``, 1 where everything asked is allowed; NaN leaves 0."""
    over = ~(asked <= most * (1 + ROUNDING) + ROUNDING)
    if not over.any():
        return 1.0
    share = float(np.min(np.broadcast_to(most, asked.shape)[over] / asked[over]))
    return share if share >= 0 else 0.0


def _begin(gantry: Gantry, start: Array, joints0: ArrayLike | None) -> Array:
    """The joints at t = 0: those given if they agree with the pose, else the most central ones."""
    bTc = gantry.bTo @ start
    if joints0 is None:
        candidates = gantry.nearest(bTc, (gantry.upper + gantry.lower) / 2), *gantry.both(bTc)
        q = min(candidates, key=lambda q: float(gantry.range_share(q).max()))
    else:
        q = np.array(joints0)
        away = float(np.abs(gantry.forward(q) - bTc).max())
        if not away <= SAME:
            raise InputError(
                f"joints0: at these joints the camera is {away:.3g} m or rad from its start; give "
                "joints that agree with it, or place the object by Gantry.seeing."
            )
        q = gantry.nearest(bTc, q)
    out = (q < gantry.lower - BEYOND) | (q > gantry.upper + BEYOND)
    if out.any():
        k = int(np.argmax(out))
        raise InputError(
            f"joints0: joint {k + 1} begins at {q[k]:.6g}, outside its range {gantry.lower[k]:g} "
            f"to {gantry.upper[k]:g}; place the object (bTo) or begin elsewhere."
        )
    return q
