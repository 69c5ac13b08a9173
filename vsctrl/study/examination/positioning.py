"""Positioning, the commonest task of visual servoing: how fast and how straight a camera arrives.

Measured on the run of a reference that is held, and by the linear loop from the same start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from vsctrl.arrays import Array
from vsctrl.loop import ScenarioLoop
from vsctrl.servo import Run
from vsctrl.tables import plain

IMAGE, SPACE = 1.0, 1e-3  #: px of the worst coordinate and m, within which a camera has arrived
HIGH, LOW = 0.1, 1e-3  #: shares of the first error between which its decay is fitted
NOTHING = 1e-12  #: m, of a start that is at its reference


@dataclass(frozen=True)
class Arrival:
    """How a camera arrives; times in s, None for what it never does within the run.

    `decay`: rate of the last decades of the error, 1/s; `to_image`, `to_space`: after which every
    image coordinate stays within 1 px, and the camera within 1 mm; `overshoot`: beyond the
    reference, as a share of the distance at the start; `peak_speed` in m/s, `peak_rate` in rad/s.
    """

    decay: float | None
    to_image: float | None
    to_space: float | None
    overshoot: float
    peak_speed: float
    peak_rate: float


@dataclass(frozen=True)
class Positioning:
    """What a run shows and the linear loop predicts, and the paths against straight lines.

    `distance` (m) and `angle` (rad) at the start, `image` the greatest image error there, px;
    `image_bend`: how far a point leaves its straight line in the image, px, and `space_bend`: the
    camera its own, m; `image_detour`, `space_detour`: lengths of the paths over those of the lines,
    of the point with the longest one; `lost`: the least number of points that the image showed.
    """

    distance: float
    angle: float
    image: float
    simulated: Arrival
    predicted: Arrival | None
    image_bend: float
    image_detour: float
    space_bend: float
    space_detour: float
    visible: int
    points: int

    def data(self) -> dict[str, Any]:
        """As JSON takes it; lengths in m, angles in rad, image in px, times in s."""
        return dict(plain(self))


def positioning(run: Run, loop: ScenarioLoop | None) -> Positioning | None:
    """How the run of a reference that is held arrives; None of other motions, or without offset."""
    lag = run.lag
    if run.scenario.motion.kind != "hold" or np.abs(lag[0]).max() < NOTHING:
        return None
    predicted = loop.predicted if loop is not None and loop.is_stable else None
    image_bend, image_detour = _image_paths(run)
    camera = run.pose[:, :3, 3] - run.reference_pose[:, :3, 3]
    return Positioning(
        distance=float(np.linalg.norm(camera[0])),
        angle=float(np.linalg.norm(lag[0, 3:])),
        image=float(np.abs(run.error[0]).max()),
        simulated=_arrival(run, lag, run.twist, run.error),
        predicted=None if predicted is None else _predicted(run, predicted),
        image_bend=image_bend,
        image_detour=image_detour,
        space_bend=_bend(camera),
        space_detour=_detour(camera),
        visible=int(run.visible.sum(axis=1).min()),
        points=run.visible.shape[1],
    )


def _predicted(run: Run, lag: Array) -> Arrival:
    """By the linear loop: the image moves with L at the start's reference, the camera with ξ′."""
    period = run.scenario.vision.period
    twist = np.vstack([np.diff(lag, axis=0) / period, np.zeros((1, 6))])
    # What a unit of each lag does to the image near the goal, by least squares on the run's end.
    near = np.linalg.norm(run.lag, axis=1) < HIGH * np.linalg.norm(run.lag[0])
    error = None
    if near.sum() > 2 * lag.shape[1]:
        L = np.linalg.lstsq(run.lag[near], run.error[near], rcond=None)[0]
        error = lag @ L
    return _arrival(run, lag, twist, error)


def _arrival(run: Run, lag: Array, twist: Array, error: Array | None) -> Arrival:
    t, unit = run.t[: len(lag)], np.array([float(run.depths[0].mean())] * 3 + [1.0] * 3)
    size = np.linalg.norm(lag / unit, axis=1)
    along = (lag / unit) @ (lag[0] / unit) / size[0] ** 2
    return Arrival(
        decay=_decay(t, size),
        to_image=None if error is None else _within(t, np.abs(error).max(axis=1), IMAGE),
        to_space=_within(t, np.linalg.norm(lag[:, :3], axis=1), SPACE),
        overshoot=max(0.0, -float(along.min())),
        peak_speed=float(np.linalg.norm(twist[:, :3], axis=1).max()),
        peak_rate=float(np.linalg.norm(twist[:, 3:], axis=1).max()),
    )


def _decay(t: Array, size: Array) -> float | None:
    """Rate of the decay from a tenth to a thousandth of the first size, 1/s; None of none."""
    late = np.flatnonzero(size < HIGH * size[0])
    if not len(late):
        return None
    done = np.flatnonzero(size < LOW * size[0])
    part = slice(late[0], (done[0] if len(done) else len(size) - 1) + 1)
    if len(t[part]) < 3:
        return None
    return float(-np.polyfit(t[part], np.log(np.maximum(size[part], 1e-300)), 1)[0])


def _within(t: Array, size: Array, limit: float) -> float | None:
    """The time from which on a size stays within a limit; None where it does not at the end."""
    outside = np.flatnonzero(size > limit)
    if not len(outside):
        return float(t[0])
    return float(t[outside[-1] + 1]) if outside[-1] + 1 < len(t) else None


def _image_paths(run: Run) -> tuple[float, float]:
    """The greatest distance of a point from its line (px), and the greatest detour of one."""
    points = run.features.reshape(len(run.t), -1, 2).transpose(1, 0, 2)
    return max(map(_bend, points)), max(map(_detour, points))


def _bend(path: Array) -> float:
    """The greatest distance of a path (n, d) from the straight way between its ends, no further."""
    chord = path[-1] - path[0]
    length = float(np.linalg.norm(chord))
    from_start = path - path[0]
    if not length:
        return float(np.linalg.norm(from_start, axis=1).max())
    along = np.clip(from_start @ (chord / length), 0, length)
    return float(np.linalg.norm(from_start - np.outer(along, chord / length), axis=1).max())


def _detour(path: Array) -> float:
    """The length of a path over that of the line between its ends; 1 is straight, inf a loop."""
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    chord = float(np.linalg.norm(path[-1] - path[0]))
    return length / chord if chord else (math.inf if length else 1.0)
