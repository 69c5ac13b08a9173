"""What the arrays of a run are: the dimensions, the unit and the meaning of each, in one table.

Files and datasets of runs are made and checked by it. The arrays themselves are in ``frames``.
"""

from typing import NamedTuple

from vsctrl.servo.scenario import Scenario

TWIST = ("Vx", "Vy", "Vz", "Ωx", "Ωy", "Ωz")


class Column(NamedTuple):
    """One array of a run.

    dims: names of its dimensions, the frames first; units; meaning: for a reader; optional: runs
    may have None instead; truth: it holds booleans, else finite numbers.
    """

    dims: tuple[str, ...]
    units: str
    meaning: str
    optional: bool = False
    truth: bool = False


_POSE = ("frame", "row", "column")
_SPEEDS, _SCREW = "m/s (V), rad/s (Ω)", "m (V), rad (Ω)"

COLUMNS: dict[str, Column] = {
    "t": Column(("frame",), "s", "time"),
    "pose": Column(_POSE, "1 (rotation), m (translation)", "camera in the object frame, oTc"),
    "reference_pose": Column(
        _POSE, "1 (rotation), m (translation)", "reference of the camera in the object frame, oTc*"
    ),
    "features": Column(("frame", "feature"), "px", "image of the points, s"),
    "reference": Column(("frame", "feature"), "px", "image that the law is given to follow, s*"),
    "error": Column(("frame", "feature"), "px", "true error s - s*"),
    "measured_error": Column(
        ("frame", "measured"), "of the law's features", "error that the law was shown"
    ),
    "command": Column(("frame", "component"), _SPEEDS, "twist that the law asked for"),
    "twist": Column(
        ("frame", "component"), _SPEEDS, "twist of the camera, mean from this frame to the next"
    ),
    "lag": Column(
        ("frame", "component"), _SCREW, "twist from the reference pose to the true one, log"
    ),
    "depths": Column(("frame", "point"), "m", "depth of the points in the camera frame"),
    "visible": Column(("frame", "point"), "1", "whether the image shows the point", truth=True),
    "joints": Column(
        ("frame", "joint"), "m (1-3), rad (4-6)", "joints of the gantry", optional=True
    ),
    "depth_estimate": Column(
        ("frame", "point"), "m", "depth that the law believed in", optional=True
    ),
    "excitation": Column(
        ("frame", "point"), "1", "how well the motion shows the depth", optional=True
    ),
}


def sizes(scenario: Scenario) -> dict[str, int]:
    """Length of every dimension that the scenario fixes: all but ``frame`` and ``measured``."""
    p = len(scenario.target.points)
    return {"row": 4, "column": 4, "component": 6, "joint": 6, "point": p, "feature": 2 * p}


def feature_names(points: int) -> list[str]:
    """Names of the image coordinates of so many points: X1, Y1, X2, …"""
    return [f"{axis}{i}" for i in range(1, points + 1) for axis in "XY"]


def measured_in_pixels(scenario: Scenario) -> bool:
    """Whether the error that the law is shown is one of image points, like the true error."""
    return scenario.law.scheme == "image" and scenario.law.features == "points"
