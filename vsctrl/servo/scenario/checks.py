"""What a whole experiment must satisfy before a frame of it is computed.

Single values are checked by ``fields``. Here: is the number of frames one that a machine can hold,
and do all points lie in front of the camera at both starts and along the whole reference? What
happens in the closed loop cannot be known beforehand and is a status of the run.
"""

from collections.abc import Iterator

import numpy as np

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.problems import Problem
from vsctrl.servo.camera.camera import NEAREST, Camera
from vsctrl.servo.motion.trajectory import Trajectory
from vsctrl.servo.pose import exp
from vsctrl.servo.scenario import assembly
from vsctrl.servo.scenario.description import Description

FEWEST_POINTS = 3
MOST_FRAMES = 1_000_000
MOST_POINT_FRAMES = 10_000_000


def frame_problems(
    duration: float, period: float, points: int, field: str = "motion.duration"
) -> Iterator[Problem]:
    """Sentences about a number of frames that is zero or absurd (s, s, count; the key to blame)."""
    word = field.rpartition(".")[2]
    frames = timing.last_frame(duration, period)
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


def image_problems(scenario: Description, oTc: Array) -> Iterator[Problem]:
    """A sentence about an image that shows fewer than three points at the true start, oTc (4, 4).

    All points lie in front of it; an image without a border, and a run that goes on without
    points, has no such problem.
    """
    size = scenario.camera.size_px
    if size is None or scenario.faults.on_lost == "continue":
        return
    sensor = assembly.sensor(scenario)
    image, _, visible = sensor.look(oTc, np.zeros(2 * len(sensor.points)))
    if visible is None or visible.sum() >= FEWEST_POINTS:
        return
    i = int(np.argmin(visible))
    X, Y = image[2 * i : 2 * i + 2]
    yield (
        "camera.size_px",
        f"{size[0]:g} × {size[1]:g} px show {visible.sum()} points at the start, and "
        f"{FEWEST_POINTS} are needed: point {i + 1} is at ({X:.4g}, {Y:.4g}) px from the centre; "
        'enlarge the image, start elsewhere, or set faults.on_lost = "continue"',
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


def plan_problems(scenario: Description) -> Iterator[Problem]:
    """A sentence about a reference image s*(t) that cannot be computed as the scenario has it.

    Where it is taken at the frames and with the true camera, ``path_problems`` has seen to that.
    """
    law, ages = scenario.law, assembly.delays(scenario)
    moved = law.preview or law.preview_ff or ages.reference
    if not moved and scenario.reference_image == type(scenario.reference_image)():
        return
    try:
        assembly.plan(scenario, assembly.sensor(scenario), scenario.t, ages)
    except InputError as error:
        field, _, sentence = str(error).partition(": ")
        yield field, sentence.rstrip(".")


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
