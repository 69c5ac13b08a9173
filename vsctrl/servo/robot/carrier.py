"""What carries the camera: it is told a twist every video frame, moves, and remembers.

Between the command and the motion stand, in this order:

1. hand-eye: the command is meant for the camera where the controller assumes it, and is the
   twist ``T = Ad(cTĉ) T̂`` of the true one; all that follows is about the true one;
2. dead time: the twist waits, at zero before the first one arrives;
3. speed and rate of the whole camera, then speeds and ends of the joints: each scales the wanted
   twist, so that its direction is kept. They come before the axes because a robot's controller
   knows its limits and never asks for more; from there on the axes only move between twists that
   are allowed;
4. the limit of acceleration: the drives' set value moves straight towards the wanted twist, and
   where a frame ends before it is there, the robot did less than it was told (``saturated``);
5. first-order axes: what moves lags behind what is set, which is no limit that holds it back;
6. the brakes of the joints: where 4 and 5 cannot slow down in time, or the joints turn away under
   the twist within the frame, the whole frame is scaled, past any limit of acceleration.

All but 6 is solved in closed form and the pose is exact at any time, not only at frames.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from vsctrl import timing
from vsctrl.arrays import Array, Mask
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.pose import adjoint, exp_one
from vsctrl.servo.robot.axes import Axes, TwistSegment, along
from vsctrl.servo.robot.capability import Capability
from vsctrl.servo.robot.joints import Arm, Stop

__all__ = ["Capability", "Carrier", "Stop"]


# A command beyond this (m/s, rad/s; or no number at all) moves nothing: its square would overflow.
RUNAWAY = 1e100


class Carrier:
    """A camera that is carried: ``wTc(t)`` under twists that are commanded frame by frame.

    Without capability it moves as it is told, by the exact exponential of every frame's twist.

    start: (4, 4), wTc at t = 0; period: of the video, s; frames: how many can be moved; delay: dead
    time between command and motion in s, any share of frames; hand_eye: (4, 4), cTĉ, pose of the
    camera that the controller assumes, in the true one; capability: limits of the robot.
    Raises InputError for values out of range.
    """

    pose: Array
    """wTc at the frame that was reached, (4, 4)."""
    stopped: Stop | None
    """Why the last frame could not be moved; the carrier then stays where it last was allowed."""

    def __init__(
        self,
        start: ArrayLike,
        period: float,
        frames: int,
        *,
        delay: float = 0.0,
        hand_eye: ArrayLike | None = None,
        capability: Capability | None = None,
    ) -> None:
        for name, value, kept, problem in (
            ("period", period, 0 < period < math.inf, "video period; give seconds above 0."),
            ("frames", frames, frames >= 0, "number of frames; give 0 or more."),
            ("delay", delay, 0 <= delay < math.inf, "dead time; give finite seconds, 0 or more."),
        ):
            checks.require(kept, name, value, f"is no {problem}")
        self.pose, self.stopped = checks.rigid("start", start), None
        self._period, self._k = period, 0
        ratio = min(delay / period, frames + 1.0)  # what would come later never arrives
        self._whole_frames, fraction = timing.split(ratio)
        self._remainder_s = fraction * period
        self._adjoint = None if hand_eye is None else adjoint(checks.rigid("hand_eye", hand_eye))
        self._capability = capability or Capability()
        self._axes: Axes | None = None
        self._arm: Arm | None = None
        if self._remainder_s or not self._capability.unlimited:
            self._axes = Axes(self._capability)
        if self._capability.gantry is not None:
            self._arm = Arm(self._capability, self.pose, period)
        # Row k + 1 is the twist that arrives at frame k.
        self._arriving = np.zeros((frames + self._whole_frames + 2, 6))
        self._poses = np.empty((frames + 1, 4, 4))
        self._poses[0] = self.pose
        self._twists = self._arriving[1:] if self._axes is None else np.zeros((frames, 6))
        self._joints = None if self._arm is None else np.empty((frames + 1, 6))
        if self._joints is not None and self._arm is not None:
            self._joints[0] = self._arm.q
        self._saturated = np.zeros(frames, dtype=np.bool_)
        self._segments: list[list[TwistSegment]] = []

    def move(self, command: Array) -> None:
        """Move through one video period under a command given at its start: (6,), m/s and rad/s.

        What cannot be moved sets ``stopped``. Raises InputError after that, and beyond the last
        frame.
        """
        k = self._k
        if self.stopped is not None or k >= len(self._poses) - 1:
            raise self._ended()
        self._arriving[k + self._whole_frames + 1] = (
            command if self._adjoint is None else self._adjoint @ command
        )
        if self._axes is None:
            step = (self._arriving[k + 1] * self._period).tolist()
            if not sum(map(abs, step)) < RUNAWAY:
                self.stopped = _no_twist(k)
                return
            self.pose = self._poses[k + 1] = self.pose @ exp_one(step)
        elif not self._follow(self._axes, k):
            return
        self._k = k + 1

    def rest(self) -> None:
        """Stand still through the frame that could not be moved, and be ready for the next one."""
        k = self._k
        self.stopped = None
        self._arriving[k + 1] = 0.0
        self._poses[k + 1] = self.pose
        self._twists[k] = 0.0
        if self._axes is not None:
            self._axes.brake(0.0)
            self._segments.append([TwistSegment.constant(self._period, np.zeros(6))])
        if self._joints is not None:
            self._joints[k + 1] = self._joints[k]
        self._saturated[k] = True
        self._k = k + 1

    @property
    def applied(self) -> Array:
        """Mean twist of the last frame moved, (6,)."""
        return self._twists[max(self._k - 1, 0)]

    @property
    def held(self) -> bool:
        """Whether the robot did less in the last frame than it was told, as in ``saturated``."""
        return bool(self._saturated[max(self._k - 1, 0)])

    def at(self, t: float) -> Array:
        """Pose wTc at any time from 0 to now, exact: s → (4, 4); before 0 it is the start's.

        Raises InputError for a time that is not reached yet.
        """
        if not t > 0:
            if math.isnan(t):
                raise InputError("t: nan is no time; give seconds.")
            return self._poses[0].copy()
        now = self._k * self._period
        if t > now and timing.whole_periods(t, self._period) != self._k:
            raise InputError(
                f"t: the camera has moved until {now:g} s, its pose at {t:g} s is not known yet."
            )
        k = math.floor(t / self._period)
        rest = t - k * self._period
        if k >= self._k or rest <= 0:
            return self._poses[min(k, self._k)].copy()
        if self._axes is None:
            out: Array = self._poses[k] @ exp_one((self._twists[k] * rest).tolist())
        else:
            out = self._poses[k] @ along(self._segments[k], np.array([rest]))[0]
        return out

    @property
    def twists(self) -> Array:
        """Mean twist (1/period) ∫ T dt of every frame moved, (k, 6) in m/s and rad/s.

        In the frame of the moving camera; the twist itself where it does not change in a frame.
        """
        return self._twists[: self._k].copy()

    @property
    def joints(self) -> Array | None:
        """Joints at every frame reached, (k + 1, 6) in m and rad; None without a gantry."""
        return None if self._joints is None else self._joints[: self._k + 1].copy()

    @property
    def saturated(self) -> Mask:
        """Frames in which limits held the camera back, (k,).

        Those whose twist was scaled down by speed, rate, or the joints, and those at whose end the
        limit of acceleration has left the drives short of the twist that was wanted then. A
        first-order lag alone does not count, nor a limit of acceleration that costs time within
        the frame only.
        """
        return self._saturated[: self._k].copy()

    def _follow(self, axes: Axes, k: int) -> bool:
        """Frame k as far as the robot can follow; False if it is not able to at all."""
        wanted = self._wanted(k)
        if not all(np.abs(T).max() < RUNAWAY for _, T in wanted):
            self.stopped = _no_twist(k)
            return False
        allowed = [self._allowed(T) for _, T in wanted]
        limited = any(share < 1 for share in allowed)
        segments = axes.follow(
            [
                (span, T if share == 1 else share * T)
                for (span, T), share in zip(wanted, allowed, strict=True)
            ]
        )
        limited = limited or axes.short
        if self._arm is not None and self._joints is not None:
            share, q = self._arm.carry(self.pose, segments)
            self.stopped = self._arm.stop(q, k + 1, (k + 1) * self._period)
            if self.stopped is not None:
                return False
            if share < 1:
                segments, limited = [segment.scaled(share) for segment in segments], True
                axes.brake(share)
            self._arm.q = self._joints[k + 1] = q[-1]
        self._segments.append(segments)
        self.pose = self._poses[k + 1] = self.pose @ along(segments, np.array([self._period]))[0]
        self._saturated[k] = limited
        if len(segments) == 1 and segments[0].is_constant:
            self._twists[k] = segments[0].start
        else:
            self._twists[k] = np.sum([p.integral() for p in segments], axis=0) / self._period
        return True

    def _wanted(self, k: int) -> list[tuple[float, Array]]:
        """Spans of frame k and the twists that arrive in them: the last frame's first."""
        before, now = self._arriving[k], self._arriving[k + 1]
        if not self._remainder_s or np.array_equal(before, now):
            return [(self._period, now)]
        return [(self._remainder_s, before), (self._period - self._remainder_s, now)]

    def _allowed(self, T: Array) -> float:
        """Share of a wanted twist that the limits of the camera and of the joints leave."""
        share = self._capability.share(T)
        if self._arm is not None:
            share *= self._arm.share(share * T)
        return share

    def _ended(self) -> InputError:
        if self.stopped is not None:
            return InputError(f"stopped: {self.stopped.sentence}")
        return InputError(
            f"frames: the carrier was made for {self._k} frames and has moved them all; give more."
        )


def _no_twist(k: int) -> Stop:
    return Stop(
        f"In frame {k} the twist that arrives is beyond every number (above {RUNAWAY:g} m/s or "
        "rad/s, or not finite), and the camera stays where it is. Lower the gain of the law.",
        k + 1,
    )
