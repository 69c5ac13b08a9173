"""What a whole experiment must satisfy before a frame of it is computed.

Single values are checked by ``fields``. Here: is the number of frames one that a machine can hold,
and do all points lie in front of the camera at both starts and along the whole reference? What
happens in the closed loop cannot be known beforehand and is a status of the run.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from vsctrl.servo.clock import WHOLE
from vsctrl.servo.motion.trajectory import Trajectory
from vsctrl.servo.plant.camera import NEAREST, Camera
from vsctrl.servo.pose import exp

Array = NDArray[np.float64]
Problem = tuple[str, str]

FEWEST_POINTS = 3
MOST_FRAMES = 1_000_000
MOST_POINT_FRAMES = 10_000_000


def count_frames(duration: float, period: float) -> int:
    """Number N of the last frame at or before the end: ``⌊duration/period⌋`` within rounding."""
    return math.floor(duration / period + WHOLE)


def frame_problems(
    duration: float, period: float, points: int, field: str = "motion.duration"
) -> Iterator[Problem]:
    """Sentences about a number of frames that is zero or absurd (s, s, count; the key to blame)."""
    word = field.rpartition(".")[2]
    frames = count_frames(duration, period)
    if frames < 1:
        yield (
            field,
            f"{duration:g} s is shorter than one video period of {period:g} s; "
            f"lengthen the {word} or shorten vision.period",
        )
    elif frames > MOST_FRAMES or frames * points > MOST_POINT_FRAMES:
        yield (
            field,
            f"{duration:g} s at a video period of {period:g} s are {frames} frames of {points} "
            f"points; the limit is {MOST_FRAMES} frames and {MOST_POINT_FRAMES} points in all, "
            f"so shorten the {word} or lengthen vision.period",
        )


def start_problems(points: Array, position: Array, oTc0: Array, offset: Array) -> Iterator[Problem]:
    """Sentences about points that do not lie in front of the camera at t = 0.

    points: (n, 3) in m; position: (3,) in m as typed; oTc0: (4, 4); offset: (6,) in m and rad.
    """
    depths = _depths(oTc0, points)
    if depths.min() <= NEAREST:
        yield (
            "start.position",
            f"from ({', '.join(f'{c:g}' for c in position)}) m {_behind(depths)}; move the start "
            "back along the optical axis until every point has a positive depth"
            + _slipped_decimal(points, position, oTc0),
        )
        return
    depths = _depths(oTc0 @ exp(offset), points)
    if depths.min() <= NEAREST:
        yield (
            "start.offset",
            f"from the true start {_behind(depths)}; choose a smaller offset",
        )


def image_problems(
    camera: Camera, size: tuple[float, float], points: Array, oTc: Array
) -> Iterator[Problem]:
    """A sentence about an image that shows fewer than three points at the true start.

    size: width and height in px; points: (n, 3) in m; oTc: (4, 4), all points in front of it.
    """
    image = camera.view(oTc, points).features.reshape(-1, 2)
    outside = np.flatnonzero((np.abs(image) > np.array(size) / 2).any(axis=1))
    if len(points) - outside.size < FEWEST_POINTS:
        i = int(outside[0])
        yield (
            "camera.size_px",
            f"{size[0]:g} × {size[1]:g} px show {len(points) - outside.size} points at the start, "
            f"and {FEWEST_POINTS} are needed: point {i + 1} is at ({image[i, 0]:.4g}, "
            f"{image[i, 1]:.4g}) px from the centre; enlarge the image, start elsewhere, or set "
            'faults.on_lost = "continue"',
        )


def path_problems(
    points: Array, reference: Trajectory, t: Array, field: str = "motion"
) -> Iterator[Problem]:
    """A sentence about the first frame of the reference with a point not in front of the camera.

    points: (n, 3) in m; t: (n_frames,) in s; field: the key to blame.
    """
    depths = _depths(reference.pose(t), points)
    hidden = np.flatnonzero(~(depths.min(axis=-1) > NEAREST))  # NaN is hidden too
    if hidden.size:
        k = int(hidden[0])
        remedy = "motion.duration or choose another V or Omega"
        if field != "motion.V":
            remedy = "the motion or choose another one"
        yield (field, f"at t = {t[k]:g} s of the reference {_behind(depths[k])}; shorten {remedy}")


def _depths(oTc: Array, points: Array) -> Array:
    return Camera(1.0, 1.0).points(oTc, points)[..., 2]


def _behind(depths: Array) -> str:
    """``point 1 lies at depth -0.05 m, point 3 at -0.06 m, behind the camera``."""
    hidden = np.flatnonzero(depths <= NEAREST)
    listed = ", ".join(f"point {i + 1} lies at depth {depths[i]:.3g} m" for i in hidden[:4])
    rest = f" and {hidden.size - 4} more" if hidden.size > 4 else ""
    return f"{listed}{rest}, behind the camera"


def _slipped_decimal(points: Array, position: Array, oTc0: Array) -> str:
    """A hint when ten times one coordinate would do, as with the paper's printed z = −0.077 m."""
    for axis in (2, 1, 0):
        moved = np.array(oTc0)
        moved[axis, 3] *= 10
        if _depths(moved, points).min() > NEAREST:
            name = "xyz"[axis]
            return (
                f". Has a decimal point slipped? With {name} = {10 * position[axis]:g} m instead "
                f"of {position[axis]:g} m every point lies in front"
            )
    return ""
