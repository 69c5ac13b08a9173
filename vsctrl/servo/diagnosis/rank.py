"""How many motions the features of these points tell apart at all, whatever noise makes of them."""

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.camera.camera import NEAREST
from vsctrl.servo.control.law import RANK_TOLERANCE
from vsctrl.servo.features.feature_sets import measures
from vsctrl.servo.pose import exp
from vsctrl.servo.scenario import Scenario, assembly

# Poses near the reference where the rank is taken, as twists in shares of the depth and rad: a set
# that is singular at all of them is so everywhere, and one that is regular nowhere helps no law.
_NUDGES = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.011, -0.017, 0.013, 0.019, 0.012, -0.023],
    [-0.021, 0.009, 0.015, -0.014, 0.022, 0.016],
])  # fmt: skip
# A share of the greatest distance between points: what strays less from a line lies on it.
_ON_A_LINE = 1e-9


def rank(scenario: Scenario) -> int:
    """Greatest rank of the true L of the law's features, at and about the reference's start.

    The pose scheme is judged by the points that it is fitted to.
    """
    sensor, start = assembly.sensor(scenario), scenario.reference.oTc0
    features = measures(scenario.law.features, sensor.camera, len(sensor.points))
    depth = float(sensor.camera.points(start, sensor.points)[:, 2].mean())
    most = 0
    for nudge in _NUDGES:
        near = start @ exp(nudge * np.array([depth] * 3 + [1.0] * 3))
        p = sensor.camera.points(near, sensor.points)
        if not p[:, 2].min() > NEAREST:
            continue
        with np.errstate(all="ignore"):
            image, z = sensor.camera.features(p), p[:, 2]
            rows = features.usable(image, z)
            most = max(most, _rank(features.interaction(image, z)[rows]))
        if most == 6:
            break
    return most


def on_a_line(scenario: Scenario) -> bool:
    """Whether all points lie on one line."""
    points = np.array(scenario.target.points)
    size = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(size[1] <= _ON_A_LINE * size[0])


def _rank(L: Array) -> int:
    if not len(L) or not np.isfinite(L).all():
        return 0
    size = np.linalg.svd(L, compute_uv=False)
    return int((size > RANK_TOLERANCE * size[0]).sum())
