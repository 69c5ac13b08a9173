"""What the robot that carries the camera can do: its limits of twist, acceleration and joints."""

import math
from dataclasses import dataclass

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.robot.gantry import Gantry

_LIMITS = {
    "speed": "m/s",
    "rate": "rad/s",
    "twist_acceleration": "m/s²",
    "angular_acceleration": "rad/s²",
}


@dataclass(frozen=True, eq=False)
class Capability:
    """Limits of the robot; what is left out is not limited.

    They hold for the twist (V, Ω) of the camera in its own frame, whatever joints make it.

    speed: |V| in m/s, and rate: |Ω| in rad/s; a twist beyond either is scaled as a whole, so that
    its direction is kept. twist_acceleration: |V'| in m/s², and angular_acceleration: |Ω'| in
    rad/s², of the twist's components in the camera frame (see ``axes``): what it feels on a circle
    at constant twist, Ω × V, does not count here, but does in ``feasibility.Limits.acceleration``.
    time_constant: of first-order axes, in s; 0 for axes without lag. gantry: whose joints move the
    camera, with their ranges and speeds; its ``accelerations`` do not act here, for the two limits
    of acceleration above do. joints0: (6,) in m and rad at t = 0; left out, the wrist's solution
    that uses the least of its ranges. avoidance: slow down before the end of a joint's range
    instead of running into it (``joints``).
    Raises InputError for values out of range and for joints or avoidance without a gantry.
    """

    speed: float | None = None
    rate: float | None = None
    twist_acceleration: float | None = None
    angular_acceleration: float | None = None
    time_constant: float | None = None
    gantry: Gantry | None = None
    joints0: Array | None = None
    avoidance: bool = False

    def __post_init__(self) -> None:
        for name, unit in _LIMITS.items():
            value = getattr(self, name)
            problem = f"is no limit; give a number of {unit} above 0, or leave it out."
            checks.require(value is None or value > 0, name, value, problem)
        lag = self.time_constant
        problem = "is no time; give a finite number of seconds, 0 or more."
        checks.require(lag is None or 0 <= lag < math.inf, "time_constant", lag, problem)
        if self.gantry is None and (self.joints0 is not None or self.avoidance):
            name = "avoidance" if self.joints0 is None else "joints0"
            raise InputError(f"{name}: a free camera has no joints; give a gantry or leave it out.")
        if self.joints0 is not None:
            checks.keep(self, joints0=checks.vector("joints0", self.joints0, 6))

    @property
    def twist_accelerations(self) -> tuple[float, float]:
        """Limits of |V'| and |Ω'|, m/s² and rad/s², infinite where there is none."""
        a, alpha = self.twist_acceleration, self.angular_acceleration
        return math.inf if a is None else a, math.inf if alpha is None else alpha

    @property
    def unlimited(self) -> bool:
        """Whether the camera moves exactly as it is told."""
        free = all(getattr(self, name) in (None, math.inf) for name in _LIMITS)
        return free and not self.time_constant and self.gantry is None

    def share(self, T: Array) -> float:
        """Share 0..1 of a twist that the limits of speed and rate let through: (6,) → float.

        ``min(1, speed/|V|, rate/|Ω|)``.
        """
        out = 1.0
        for limit, part in ((self.speed, T[:3]), (self.rate, T[3:])):
            if limit is not None and (size := math.hypot(*part.tolist())) > limit:
                out = min(out, limit / size)
        return out
