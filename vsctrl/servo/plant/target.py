"""The target: points that never move, in the object frame.

Which of them the camera sees, and whether they lie in front of it, is asked of ``camera``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vsctrl.errors import InputError


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """Still points of the object frame.

    points: (n, 3) in m; kept as a read-only copy. Raises InputError for any other shape.
    """

    points: NDArray[np.float64]

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(
                f"points: an array of shape {points.shape} is no list of points; give (n, 3), "
                "x y z in m for every point."
            )
        points.setflags(write=False)
        object.__setattr__(self, "points", points)


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
