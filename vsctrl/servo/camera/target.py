"""The target: points of the object frame, and how that frame moves in the world.

The world is where the object is at t = 0. Which points the camera sees is asked of ``sensor``.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo import checks
from vsctrl.servo.pose import exp


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """Points of an object that rests, drifts, or swings to and fro.

    ``wTo(t) = exp(D g(t))`` with D the drift and ``g = t``, or ``g = P/2π sin(2πt/P)`` of a target
    that swings with period P.

    points: (n, 3) in m; drift: (6,), twist in the object's own frame, m/s and rad/s (of a swinging
    target its greatest); sway: P in s or None. Arrays are kept as read-only copies. Raises
    InputError for other shapes.

    >>> vs.servo.Target(vs.servo.CUBE_LEDS.points).points.shape
    (4, 3)
    """

    points: Array
    drift: Array = field(default_factory=lambda: np.zeros(6))
    sway: float | None = None

    def __post_init__(self) -> None:
        points = checks.array("points", self.points)
        checks.point_list("points", points)
        drift = checks.array("drift", self.drift)
        if drift.shape != (6,):
            raise InputError(
                f"drift: an array of shape {drift.shape} is no twist; give (6,), m/s and rad/s."
            )
        checks.keep(self, points=points, drift=drift)

    @property
    def still(self) -> bool:
        """Whether the object never moves."""
        return not self.drift.any()

    def pose(self, t: ArrayLike) -> Array:
        """wTo at the times t: (...,) in s → (..., 4, 4)."""
        g = np.asarray(t, dtype=np.float64)
        if self.sway is not None:
            g = self.sway / (2 * math.pi) * np.sin(2 * math.pi * g / self.sway)
        return exp(g[..., None] * self.drift)


CUBE_LEDS = Target(
    np.array(
        [
            [-0.125, -0.075, -0.125],
            [+0.125, -0.075, -0.125],
            [+0.125, +0.075, -0.125],
            [-0.125, +0.075, -0.125],
        ]
    )
)
"""The paper's four LEDs (section 4) on the face z = −12.5 cm of the 25 cm cube, in m.

Order: round the face, (−x, −y), (+x, −y), (+x, +y), (−x, +y). A camera in front of that face with
the object's orientation (x right, y down) sees them as upper left, upper right, lower right, lower
left; the first one is the paper's "first point" here.
"""
