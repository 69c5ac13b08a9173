"""How the axes follow a wanted twist: with bounded acceleration, then with a first-order lag.

Both are solved in closed form, so that a frame is a few segments of ``T(t)``, each

    T(t) = T₀ + (B − T₀) g(t) + S (t − τ g(t)),   g(t) = 1 − e^{−t/τ}

the answer of ``T' = (B + S t − T)/τ`` to the ramp ``B + S t`` (g = 1, τ = 0 without lag, and S = 0
where nothing is limited). The pose under such a segment has no closed form unless the twist keeps
its screw, and is integrated by Magnus steps of order six.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.magnus import MOST_STEPS, NODE, STEP, integrated, magnus_one
from vsctrl.servo.pose import exp, exp_one
from vsctrl.servo.robot.capability import Capability

# Magnus steps per time constant, n: three Gauss nodes then integrate e^{−t/τ} to n⁻⁷/2·10⁶ of the
# change of the twist times τ, for n = 8 to 3e-13 of it. Less where that is a hundredth of the
# rounding of a pose all the same: most of the time nearly nothing is left of a change.
STEPS_PER_LAG = 8
_GAUSS, _TINY = 1 / 2e6, 2.0**-53 / 100
# After so many time constants e^{−t/τ} is below rounding, and below that share a lag has ended.
SETTLED = 40.0
ENDED = 2.0**-54
# Twists that only a decay from greater ones leaves behind, m/s and rad/s.
NOTHING = 1e-30
# A wanted twist that is reached this share of its span too late is reached in time: rounding.
IN_TIME = 1e-9
# Up to so many exponentials, and Magnus steps, plain arithmetic is the faster one.
FEW, FEW_STEPS = 16, 40


class TwistSegment(NamedTuple):
    """A twist over ``span`` seconds: from ``start`` after the ramp ``aim + slope t`` (see above).

    span, tau: s; start, aim: (6,) in m/s and rad/s; slope: (6,) per s.
    """

    span: float
    start: Array
    aim: Array
    slope: Array
    tau: float = 0.0

    @classmethod
    def constant(cls, span: float, T: Array) -> Self:
        """The same twist all along."""
        return cls(span, T, T, np.zeros(6))

    @property
    def is_constant(self) -> bool:
        """Whether the twist stays as it is."""
        return self.start is self.aim and not self.slope.any()

    def twist(self, t: Array) -> Array:
        """Twist at the times t from the start of the segment: (...,) in s → (..., 6)."""
        t = np.asarray(t)[..., None]
        if not self.tau:
            out: Array = self.aim + self.slope * t
        else:
            g = -np.expm1(-t / self.tau)
            out = self.start + (self.aim - self.start) * g + self.slope * (t - self.tau * g)
        return out

    def integral(self) -> Array:
        """∫ T dt over the segment, (6,) in m and rad."""
        h, tau = self.span, self.tau
        if self.is_constant:
            return h * self.start
        decay = tau * -math.expm1(-h / tau) if tau else 0.0  # ∫ e^{−t/τ} dt
        return (
            h * self.start
            + (h - decay) * (self.aim - self.start)
            + (h * h / 2 - tau * (h - decay)) * self.slope
        )

    def scaled(self, share: float) -> Self:
        """The segment with ``share`` times its twist: direction and time kept."""
        if self.start is self.aim:
            T = share * self.start
            return self._replace(start=T, aim=T, slope=share * self.slope)
        return self._replace(
            start=share * self.start, aim=share * self.aim, slope=share * self.slope
        )

    def motions(self, t: Array) -> Array:
        """Motions from the start of the segment to the times t: (n,) in s → (n, 4, 4)."""
        if self.is_constant:
            steps = t[:, None] * self.start
            return exp(steps) if len(t) > FEW else np.array([exp_one(T) for T in steps.tolist()])
        asked: list[float] = t.tolist()
        times = sorted({*self._knots(max(asked)), *asked})
        if len(times) <= FEW_STEPS:
            reached, pose = {times[0]: np.eye(4)}, np.eye(4)
            parts = [part.tolist() for part in (self.start, self.aim - self.start, self.slope)]
            for before, now in pairwise(times):
                reached[now] = pose = pose @ exp_one(
                    magnus_one(*_nodes(parts, self.tau, before, now))
                )
            return np.array([reached[moment] for moment in asked])
        knots = np.array(times)
        poses = integrated(np.eye(4), self.twist, knots)
        return poses[np.searchsorted(knots, t)]

    def _knots(self, end: float) -> list[float]:
        """Times between which one Magnus step is exact to rounding, from 0 to the end, s."""
        ends = self.start, self.aim, self.aim + self.slope * end
        rate = max(math.hypot(*T[3:].tolist()) for T in ends)
        # The lagging twist stays between its start and the ramp's ends.
        turning = math.ceil(min(rate * end / STEP, MOST_STEPS)) + 1
        if not self.tau:
            return _even(end, turning)
        change = float(np.abs(self.start - self.aim + self.tau * self.slope).max())
        needed = (change * self.tau * _GAUSS / _TINY) ** (1 / 7)
        swing = min(SETTLED * self.tau, end)
        lagging = math.ceil(min(needed, STEPS_PER_LAG) * swing / self.tau) + 1
        if swing == end:
            return _even(end, max(turning, lagging))
        return [*_even(end, turning), *_even(swing, lagging)]


def _nodes(
    parts: Sequence[Sequence[float]], tau: float, t0: float, t1: float
) -> Iterator[list[float]]:
    """−h T at the nodes of a step from t0 to t1, of a segment with ``(T₀, B − T₀, S)``: (6,)."""
    h, middle = t1 - t0, (t0 + t1) / 2
    for t in (middle - NODE * h, middle, middle + NODE * h):
        g = -math.expm1(-t / tau) if tau else 1.0
        ramp = t - tau * g
        yield [-h * (x + y * g + z * ramp) for x, y, z in zip(*parts, strict=True)]


def _even(end: float, steps: int) -> list[float]:
    """Evenly spaced from 0 to the end."""
    return [*(end * k / steps for k in range(steps)), end]


def along(segments: Sequence[TwistSegment], t: Array) -> Array:
    """Motions from the start of the segments, one after another, to times in order.

    t: (n,) in s, not beyond the last segment by more than rounding. Returns (n, 4, 4).
    """
    if len(segments) == 1:
        return segments[0].motions(t)
    out = np.empty((len(t), 4, 4))
    begin, done = 0.0, np.eye(4)
    for number, segment in enumerate(segments, 1):
        mine = t >= begin
        if number < len(segments):
            mine &= t < begin + segment.span
        motions = segment.motions(np.append(t[mine] - begin, segment.span))
        out[mine] = done @ motions[:-1]
        done = done @ motions[-1]
        begin += segment.span
    return out


class Axes:
    """The twist of the camera, which follows wanted twists as the axes can; at rest at t = 0."""

    short: bool
    """Whether the limit of acceleration left the set value short of the last twist wanted.

    What a first-order lag leaves is not counted: axes that lag still do what they are told.
    """

    def __init__(self, capability: Capability) -> None:
        self._a, self._alpha = capability.twist_accelerations
        self._tau = capability.time_constant or 0.0
        self._aim = np.zeros(6)  # behind the limit of acceleration, before the lag
        self._twist = np.zeros(6)
        self.short = False

    def follow(self, wanted: Sequence[tuple[float, Array]]) -> list[TwistSegment]:
        """Segments that answer wanted twists, each (6,) in m/s and rad/s over its span in s."""
        return [self._lagging(ramp) for span, T in wanted if span for ramp in self._ramps(span, T)]

    def brake(self, share: float) -> None:
        """Take up again from ``share`` times the twist: something stronger held the camera."""
        self._aim, self._twist = share * self._aim, share * self._twist

    def _ramps(self, span: float, wanted: Array) -> Iterator[TwistSegment]:
        """Straight towards the wanted twist: ``T' = (B − A)/max(|ΔV|/a, |ΔΩ|/α)``, then B."""
        change = wanted - self._aim
        V, Omega = math.hypot(*change[:3].tolist()), math.hypot(*change[3:].tolist())
        needed = max(V / self._a, Omega / self._alpha)
        self.short = bool(needed > span * (1 + IN_TIME))
        if needed > 0:
            slope = change / needed
            end = wanted if needed <= span else self._aim + span * slope
            yield TwistSegment(min(span, needed), self._aim, self._aim, slope)
            self._aim = end
        else:
            self._aim = wanted
        if needed < span:
            yield TwistSegment.constant(span - needed, wanted)

    def _lagging(self, ramp: TwistSegment) -> TwistSegment:
        """The answer of the axes to a ramp, from the twist that they have."""
        if not self._tau:
            self._twist = self._aim
            return ramp
        difference, size = np.abs(ramp.aim - self._twist).max(), np.abs(ramp.aim).max()
        if not ramp.slope.any() and difference <= max(ENDED * size, NOTHING):
            self._twist = ramp.aim
            return ramp
        segment = ramp._replace(start=self._twist, tau=self._tau)
        self._twist = segment.twist(np.array(ramp.span))
        return segment
