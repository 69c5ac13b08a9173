"""Can a reference be followed? Which limit binds, when, and what to do about it.

The paper leaves "dynamic feasibility" open. Every limit is compared with the most that the
trajectory asks of it, found between samples too; what is too fast can be slowed down
(``retiming``), what leaves the joints' ranges or the image cannot.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from vsctrl.arrays import Array
from vsctrl.checks import quoted, require_kind
from vsctrl.servo import checks
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.camera.target import Target
from vsctrl.servo.feasibility.demands import Demands, Kind, Row
from vsctrl.servo.feasibility.limits import Limits
from vsctrl.servo.feasibility.peaks import Peaks, above, peaks
from vsctrl.servo.motion.trajectory import Trajectory
from vsctrl.servo.robot.gantry import FreeCamera, Robot
from vsctrl.tables import escaped, html, plain, text

Intervals = tuple[tuple[float, float], ...]

# A share above 1 by less than this is rounding.
ROUNDING = 1e-9
# A jump below this share of its limit is rounding.
STILL = 1e-9
FEWEST_SAMPLES = 10
HEADS = ("limit of", "most asked", "limit", "share", "at")


@dataclass(frozen=True, slots=True)
class Reading:
    """The most that is asked of one limit.

    share: largest value/limit (for a least value limit/value; for a joint's position 0 in the
    middle of its range and 1 at the end); value, limit: in unit; t: when, s; violated: the
    intervals in which the limit is not kept, s (a jump is an interval of length 0); jump: the
    share is infinite because the twist jumps.

    >>> slide = vs.paper.sliding()
    >>> vs.servo.feasibility(slide.reference).binding.name
    'speed'
    """

    name: str
    kind: Kind
    share: float
    value: float
    limit: float
    unit: str
    t: float
    violated: Intervals
    owner: str
    jump: bool = False

    @property
    def ok(self) -> bool:
        """Whether the limit is kept."""
        return self.share <= 1 + ROUNDING

    @property
    def stretch(self) -> float:
        """Factor on the duration at which this limit is just kept: the share of a speed, the root
        of an acceleration's; 0 for geometry that is kept, infinite for geometry that is not."""
        if self.kind == "geometry":
            return 0.0 if self.ok else math.inf
        return self.share if self.kind == "speed" else math.sqrt(self.share)

    @property
    def sentence(self) -> str:
        """What is asked, when, and the remedy where it is too much."""
        field = self.owner if self.owner == f"limits.{self.name}" else self.name
        asked = f"{field}: {self.value:.4g} {self.unit}".rstrip()
        if self.jump:
            return (
                f"{field}: at t = {self.t:.4g} s the twist jumps, by {self.value:.4g} "
                f"{self.unit.removesuffix('²')}, which is an infinite acceleration at any pace; "
                "blend the parts, or let servo.fastest stop there."
            )
        if self.ok:
            return (
                f"{asked} at t = {self.t:.4g} s is within {self.limit:.4g} {self.unit}".rstrip()
                + "."
            )
        said = f"{asked} at t = {self.t:.4g} s is beyond {self.limit:.4g} {self.unit}".rstrip()
        if self.kind == "geometry":
            return f"{said}, at any pace; choose another path, or change {self.owner}."
        return (
            f"{said}; make the motion {self.stretch:.4g} times as long (servo.slowed, or "
            f"servo.fastest), or raise {self.owner}."
        )


@dataclass(frozen=True, slots=True, eq=False)
class Feasibility:
    """Whether a trajectory can be followed within limits, and what is asked of each.

    feasible: every limit is kept; readings: one for every limit; binding: the limit that the
    motion meets first when it is sped up (or is the furthest beyond); trajectory, limits: what was
    asked.

    >>> slide = vs.paper.sliding()
    >>> vs.servo.feasibility(slide.reference).feasible
    True
    """

    trajectory: Trajectory
    limits: Limits
    readings: tuple[Reading, ...]

    @property
    def feasible(self) -> bool:
        """Whether every limit is kept, within 1e-9."""
        return all(reading.ok for reading in self.readings)

    @property
    def binding(self) -> Reading:
        """The limit with the largest ``stretch``; of several infinite ones the first in time."""
        return max(self.readings, key=lambda r: (r.stretch, -_since(r)))

    @property
    def first(self) -> Reading | None:
        """The limit that is left first in time, or None."""
        broken = [reading for reading in self.readings if not reading.ok]
        return min(broken, key=_since, default=None)

    @property
    def stretch(self) -> float:
        """Least factor on the duration that keeps all limits of speed and acceleration.

        ``max(speed shares, √(acceleration shares))``; infinite where the twist jumps. Below 1 the
        motion could be faster. Geometry has no say in it.
        """
        return max(r.stretch for r in self.readings if r.kind != "geometry")

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is wrong and what to do, in order of time; or which limit is nearest."""
        broken = sorted((r for r in self.readings if not r.ok), key=_since)
        if broken:
            return tuple(reading.sentence for reading in broken)
        b = self.binding
        return (f"every limit is kept; nearest, at {100 * b.share:.3g} %, is {b.sentence}",)

    def data(self) -> dict[str, Any]:
        """What is asked of each limit as JSON takes it, null for infinity; units as in readings."""
        return {
            "feasible": self.feasible,
            "binding": self.binding.name,
            "stretch": plain(self.stretch),
            "sentences": list(self.sentences),
            "readings": plain(self.readings),
        }

    def __getitem__(self, name: str) -> Reading:
        """The reading of a limit by its name."""
        for reading in self.readings:
            if reading.name == name:
                return reading
        raise KeyError(f"{quoted(name)}; the limits are {', '.join(r.name for r in self.readings)}")

    def __repr__(self) -> str:
        """A table of the limits, and what is wrong or which limit is nearest."""
        form = "{:<24}{:>12}{:>16}{:>10}   {}  {}"
        return "\n".join([text([HEADS, *self._rows()], form), *self.sentences])

    def _repr_html_(self) -> str:
        """A table of the limits for notebooks."""
        said = "<br>".join(escaped(sentence) for sentence in self.sentences)
        return f"<p>{said}</p>{html(self._rows(), heads=HEADS, left=1)}"

    def _rows(self) -> list[tuple[str, ...]]:
        return [
            (
                r.name,
                f"{r.value:.4g}",
                f"{r.limit:.4g} {r.unit}",
                f"{100 * r.share:.3g} %",
                f"{r.t:.4g} s",
                "" if r.ok else "not kept",
            )
            for r in self.readings
        ]


def feasibility(
    trajectory: Trajectory,
    limits: Limits | None = None,
    *,
    robot: Robot | None = None,
    camera: Camera | None = None,
    target: Target | None = None,
    rest: bool = False,
    samples: int = 4000,
) -> Feasibility:
    """Hold a trajectory against limits of speed, acceleration, joints and view.

    limits: ``Limits()`` where left out; robot: ``FreeCamera()`` or a ``Gantry``; camera, target:
    needed for a field of view (the target alone for depths); rest: the camera stands still before
    and after, so that a twist at the ends counts as a jump; samples: how many times are looked at
    before the peaks between them are refined (a peak narrower than two of them may be missed).
    Raises InputError for a trajectory of
    infinite duration, and a field of view without camera or target.

    >>> slide = vs.paper.sliding()
    >>> vs.servo.feasibility(slide.reference, vs.servo.Limits(speed=0.03)).feasible
    False
    """
    checks.at_least("samples", samples, FEWEST_SAMPLES)
    require_kind("trajectory", trajectory, Trajectory, "give a motion, as servo.hold is one")
    limits = limits or Limits()
    demands = Demands(trajectory, limits, robot or FreeCamera(), camera, target)

    tops = peaks(demands.shares, trajectory.duration, samples)
    jumps = _jumps(demands, rest)
    readings = []
    for k, row in enumerate(demands.rows):
        readings.append(_reading(demands, row, k, tops, jumps.get(k, [])))
    return Feasibility(trajectory, limits, tuple(readings))


def _reading(
    demands: Demands, row: Row, k: int, tops: Peaks, jumps: list[tuple[float, float]]
) -> Reading:
    share, t = float(tops.top[k]), float(tops.t[k])
    violated: list[tuple[float, float]] = []
    if share > 1 + ROUNDING:
        violated = above(demands.shares, k, tops, 1 + ROUNDING)
    value = float(demands.ask(np.array([t])).values[k, 0])
    limit = row.limit
    if row.name.startswith("position of joint"):
        gantry = demands.joints.gantry if demands.joints else None
        assert gantry is not None
        joint = int(row.name[-1]) - 1
        lower, upper = float(gantry.lower[joint]), float(gantry.upper[joint])
        limit = upper if value > (lower + upper) / 2 else lower
    if jumps:
        t, value = max(jumps, key=lambda jump: jump[1])
        share = math.inf
        violated = sorted([*violated, *((when, when) for when, _ in jumps)])
    return Reading(
        row.name,
        row.kind,
        share,
        value,
        limit,
        row.unit,
        t,
        tuple(violated),
        row.owner,
        bool(jumps),
    )


def _jumps(demands: Demands, rest: bool) -> dict[int, list[tuple[float, float]]]:
    """Jumps of what moves, (s, size), by the number of its row of acceleration."""
    out: dict[int, list[tuple[float, float]]] = {}
    for t, size in _jumps_of(demands.trajectory, rest):
        for mover, height in enumerate(demands.jump_in(t, size)):
            speed, acceleration = demands.movers[mover]
            still = STILL * (speed.limit if math.isfinite(speed.limit) else 1.0)
            if height > still and math.isfinite(acceleration.limit):
                out.setdefault(2 * mover + 1, []).append((t, float(height)))
    return out


def _jumps_of(trajectory: Trajectory, rest: bool) -> Iterator[tuple[float, Array]]:
    if rest:
        yield 0.0, np.asarray(trajectory.twist(0.0))
    yield from trajectory.jumps
    if rest:
        yield trajectory.duration, -np.asarray(trajectory.end_twist)


def _since(reading: Reading) -> float:
    return reading.violated[0][0] if reading.violated else math.inf
