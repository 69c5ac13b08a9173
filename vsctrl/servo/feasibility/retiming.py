"""A reference at another pace: the same path, as fast as limits allow.

``slowed`` stretches time evenly; ``fastest`` finds the pace at which some limit is active all the
way, from rest to rest. Where the path has a corner (its twist jumps) it stops.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.checks import is_number, require_kind
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.camera.target import Target
from vsctrl.servo.feasibility.demands import Demands, Moving
from vsctrl.servo.feasibility.following import feasibility
from vsctrl.servo.feasibility.limits import Limits
from vsctrl.servo.feasibility.time_optimal import fastest_pace, knots
from vsctrl.servo.motion.trajectory import Jump, Trajectory
from vsctrl.servo.robot.gantry import FreeCamera, Robot

MOST_CORNERS = 1000
FEWEST_CELLS = 50
# How far inside a piece, as a share of the duration, its twist is asked for: before a jump.
INSIDE = 1e-12
# A twist below this share of the limits is rest.
STILL = 1e-9


@dataclass(frozen=True, eq=False)
class Retimed(Trajectory):
    """The path of another trajectory at its own pace: ``oTc*(σ(t))``.

    ``T = T*(σ) σ'``, ``T' = T*'(σ) σ'² + T*(σ) σ''``; σ'' is constant between the times of a
    table. Where the other trajectory rests σ may leap.

    trajectory: the path. starts: (n,) in s, where each part of the table begins; sigma, rate,
    bend: (n,) each, σ, σ' and σ'' there; ends: (n,), σ where it ends; asked: (n, 2), least and
    greatest σ at which the twist is asked for. duration: s. kept: the jumps of the twist.

    >>> slide = vs.paper.sliding()
    >>> vs.servo.slowed(slide.reference, 2.0).duration
    18.0
    """

    trajectory: Trajectory
    starts: Array
    sigma: Array
    rate: Array
    bend: Array
    ends: Array
    asked: Array
    duration: float
    kept: tuple[Jump, ...] = ()
    oTc0: Array = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "oTc0", self.trajectory.pose(self.sigma[0]))

    def pose(self, t: ArrayLike) -> Array:
        """Pose at the times t: (...,) in s → (..., 4, 4)."""
        t = checks.times(t)
        inside = np.clip(t, 0.0, self.duration)
        return self._carried_on(self.trajectory.pose(self.progress(inside)[0]), t, inside)

    def twist(self, t: ArrayLike) -> Array:
        """Twist at the times t: (...,) in s → (..., 6), (V, Ω) in m/s and rad/s."""
        _, rate, _, sigma = self._look(np.clip(checks.times(t), 0.0, self.duration))
        return self.trajectory.twist(sigma) * rate[..., None]

    def acceleration(self, t: ArrayLike) -> Array:
        """Derivative of the twist: (...,) in s → (..., 6), m/s² and rad/s²."""
        t = checks.times(t)
        _, rate, bend, sigma = self._look(np.clip(t, 0.0, self.duration))
        T, dT = self.trajectory.twist(sigma), self.trajectory.acceleration(sigma)
        within = ((t >= 0) & (t <= self.duration))[..., None]
        return np.where(within, dT * rate[..., None] ** 2 + T * bend[..., None], 0.0)

    def progress(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """σ, σ' and σ'' at the times t between 0 and the end: (...,) in s → (...,) each."""
        return self._look(np.clip(checks.times(t), 0.0, self.duration))[:3]

    @property
    def jumps(self) -> tuple[Jump, ...]:
        """Where the twist jumps: nowhere on a fastest path, at the path's own when only slowed."""
        return self.kept

    @property
    def end_twist(self) -> Array:
        """The twist with which the motion ends, (6,)."""
        if self.kept or len(self.starts) == 1:
            return self.trajectory.end_twist * self.rate[-1]
        return self.twist(self.duration)

    def stretched(self, factor: float) -> "Retimed":
        """The same at ``1/factor`` of the pace."""
        kept = tuple(Jump(t * factor, size / factor) for t, size in self.kept)
        return Retimed(
            self.trajectory,
            self.starts * factor,
            self.sigma,
            self.rate / factor,
            self.bend / factor**2,
            self.ends,
            self.asked,
            self.duration * factor,
            kept,
        )

    def _look(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """σ, σ', σ'' and the σ to ask for the twist."""
        k = np.maximum(np.searchsorted(self.starts, t, side="right") - 1, 0)
        since = t - self.starts[k]
        sigma = self.sigma[k] + since * (self.rate[k] + since * self.bend[k] / 2)
        sigma = np.clip(sigma, self.sigma[k], self.ends[k])
        rate = np.maximum(self.rate[k] + since * self.bend[k], 0.0)
        return sigma, rate, self.bend[k], np.clip(sigma, self.asked[k, 0], self.asked[k, 1])


def slowed(trajectory: Trajectory, factor: float) -> Retimed:
    """The trajectory stretched evenly in time: speeds by 1/factor, accelerations by 1/factor².

    With ``factor = feasibility(…).stretch`` it is the fastest even pace that keeps all limits of
    speed and acceleration. Raises InputError for a factor that is not finite and above 0 (as it is
    not where the twist jumps), and a trajectory without end.

    >>> slide = vs.paper.sliding()
    >>> vs.servo.slowed(slide.reference, 1.5).duration
    13.5
    """
    require_kind("trajectory", trajectory, Trajectory, "give a motion, as servo.hold is one")
    checks.require(
        is_number(factor) and 0 < factor < math.inf,
        "factor",
        factor,
        "is no finite number above 0; where the twist jumps no even pace will do, so blend the "
        "parts or use servo.fastest.",
    )
    checks.finite_duration(trajectory.duration)
    zero, end = np.zeros(1), np.array([trajectory.duration])
    asked = np.array([[0.0, trajectory.duration]])
    even = Retimed(
        trajectory, zero, zero, np.ones(1), zero, end, asked, trajectory.duration, trajectory.jumps
    )
    return even.stretched(factor)


def fastest(
    trajectory: Trajectory,
    limits: Limits | None = None,
    *,
    robot: Robot | None = None,
    camera: Camera | None = None,
    target: Target | None = None,
    rest: bool = True,
    cells: int = 1000,
) -> Retimed:
    """The same path as fast as limits of speed and acceleration allow.

    rest: it begins and ends at rest, else at any speed; cells: of the grid; the time lost to it
    falls at least in proportion to their number, with its square where limits are even along the
    path. Waits are left out. Where the
    twist jumps the camera stops. The result is verified against the limits and, were it beyond
    one between the nodes of the grid, slowed evenly. Other arguments as ``feasibility``. Raises
    InputError where the path itself leaves joints' ranges or image, where nothing moves, and for
    more than 1000 jumps.

    >>> slide = vs.paper.sliding()
    >>> quick = vs.servo.fastest(slide.reference, vs.servo.Limits(speed=0.2, acceleration=1.0))
    >>> print(round(quick.duration, 3))
    2.0
    """
    require_kind("trajectory", trajectory, Trajectory, "give a motion, as servo.hold is one")
    limits = limits or Limits()
    demands = Demands(trajectory, limits, robot or FreeCamera(), camera, target)
    own = feasibility(trajectory, limits, robot=robot, camera=camera, target=target)
    lasting = [r.sentence for r in own.readings if r.kind == "geometry" and not r.ok]
    if lasting:
        raise InputError("trajectory: no pace makes it feasible. " + " ".join(lasting))
    checks.at_least("cells", cells, FEWEST_CELLS)
    out = _assembled(trajectory, demands, rest, cells)
    stretch = feasibility(out, limits, robot=robot).stretch
    if stretch > 1:
        out = out.stretched(stretch * (1 + STILL))
    if not rest and own.stretch < math.inf:
        even = slowed(trajectory, own.stretch)
        out = min(out, even, key=lambda retimed: retimed.duration)
    return out


def _assembled(trajectory: Trajectory, demands: Demands, rest: bool, cells: int) -> Retimed:
    """The fastest pace of every piece between corners, one after another."""
    end = trajectory.duration
    jumps = trajectory.jumps
    if len(jumps) > MOST_CORNERS:
        raise InputError(
            f"trajectory: its twist jumps {len(jumps)} times, and the camera would stop each time; "
            f"give a part of it with at most {MOST_CORNERS} jumps."
        )
    corners = sorted({0.0, end, *(t for t, _ in jumps if 0 < t < end)})
    tables, asked, duration = [], [], 0.0
    for a, b in pairwise(corners):
        low, high = a + INSIDE * end, b - INSIDE * end

        def moving(s: Array, low: float = low, high: float = high) -> Moving:
            return demands.moving(np.clip(s, low, high))

        count = max(FEWEST_CELLS, round(cells * (b - a) / end))
        # Denser towards the ends, where a path that begins at rest changes most.
        sigma = a + (b - a) * (1 - np.cos(np.linspace(0, np.pi, count + 1))) / 2
        sigma[-1] = b
        sigma = np.union1d(sigma, knots(moving, sigma))
        stop = (_moves(moving, a) and (rest or a > 0), _moves(moving, b) and (rest or b < end))
        x = fastest_pace(moving, sigma, stop)
        if x is None:
            continue  # a wait
        rate = np.sqrt(x)
        h = np.diff(sigma)
        steps = 2 * h / (rate[1:] + rate[:-1])
        begins = duration + np.concatenate([[0.0], np.cumsum(steps)])
        bend = np.diff(rate) / steps
        tables.append(np.stack([begins[:-1], sigma[:-1], rate[:-1], bend, sigma[1:]]))
        asked.append(np.tile([low, high], (len(h), 1)))
        duration = float(begins[-1])
    if not tables:
        raise InputError("trajectory: nothing moves, so there is no pace to find; give a motion.")
    starts, sigma, rate, bend, ends = np.concatenate(tables, axis=1)
    return Retimed(trajectory, starts, sigma, rate, bend, ends, np.concatenate(asked), duration)


def _moves(moving: Callable[[Array], Moving], sigma: float) -> bool:
    """Whether the twist at a parameter is more than rounding, where a limit asks for it at all."""
    asked = moving(np.array([sigma]))
    return bool(max(np.abs(asked.v_speed).max(), np.abs(asked.v_acceleration).max()) > STILL)
