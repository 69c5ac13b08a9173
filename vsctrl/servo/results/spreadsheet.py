"""A run as comma-separated values: one row a frame, every column named with its unit.

In this order, with the names of ``Frames`` in front of all but the camera's own pose and image:

    t_s
    x_m y_m z_m rx_rad ry_rad rz_rad       the camera in the object frame: position, θu of oRc
    reference_x_m … reference_rz_rad       the same of its reference
    lag_x_m … lag_rz_rad                   the twist from the reference pose to the true one
    command_Vx_m_per_s … _Wz_rad_per_s     what the law asked for; twist_… what the camera did
    X1_px Y1_px …                          image of the points; reference_X1_px …, error_X1_px …
    measured_error_X1_px … or measured_error_1 …, in the law's features where these are no points
    depth_1_m …, visible_1 …               and of runs that have them joint_1_m … joint_6_rad,
                                           depth_estimate_1_m …, excitation_1 …

Numbers are the shortest decimals that are read back as the same float; visible is 1 or 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl.arrays import Array
from vsctrl.servo.pose import log
from vsctrl.servo.results.columns import feature_names, measured_in_pixels
from vsctrl.servo.results.frames import Frames

_AXES = "xyz"
_SCREW = [f"{a}_m" for a in _AXES] + [f"r{a}_rad" for a in _AXES]
_SPEEDS = [f"V{a}_m_per_s" for a in _AXES] + [f"W{a}_rad_per_s" for a in _AXES]
_JOINTS = [f"{i}_{'m' if i <= 3 else 'rad'}" for i in range(1, 7)]


def table(run: Frames) -> str:
    """The run as text: a row of names, then a row a frame."""
    columns: dict[str, list[float]] = {}
    for names, values in _groups(run):
        wide = values.reshape(len(run.t), -1)
        columns |= zip(names, wide.T.tolist(), strict=True)
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    return "\n".join(lines) + "\n"


def _groups(run: Frames) -> Iterator[tuple[list[str], NDArray[Any]]]:
    """Names with units, and the columns that bear them."""
    points = range(1, run.depths.shape[1] + 1)
    images = [f"{name}_px" for name in feature_names(len(points))]
    yield ["t_s"], run.t
    yield _SCREW, _pose(run.pose)
    yield [f"reference_{name}" for name in _SCREW], _pose(run.reference_pose)
    yield [f"lag_{name}" for name in _SCREW], run.lag
    yield [f"command_{name}" for name in _SPEEDS], run.command
    yield [f"twist_{name}" for name in _SPEEDS], run.twist
    yield images, run.features
    yield [f"reference_{name}" for name in images], run.reference
    yield [f"error_{name}" for name in images], run.error
    m = run.measured_error.shape[1]
    in_pixels = measured_in_pixels(run.scenario) and m == len(images)
    seen = images if in_pixels else [str(i) for i in range(1, m + 1)]
    yield [f"measured_error_{name}" for name in seen], run.measured_error
    yield [f"depth_{i}_m" for i in points], run.depths
    yield [f"visible_{i}" for i in points], run.visible.astype(int)
    if run.joints is not None:
        yield [f"joint_{name}" for name in _JOINTS], run.joints
    if run.depth_estimate is not None:
        yield [f"depth_estimate_{i}_m" for i in points], run.depth_estimate
    if run.excitation is not None:
        yield [f"excitation_{i}" for i in points], run.excitation


def _pose(poses: Array) -> Array:
    """Position (m) and rotation vector θu (rad) of poses, (n, 6)."""
    turned = poses.copy()
    turned[:, :3, 3] = 0.0
    return np.concatenate([poses[:, :3, 3], log(turned)[:, 3:]], axis=1)
