"""The runs that statements and figures of the paper are made from, and what is read off them.

Every experiment is run clean, as its preset says, and as a bench of the time might have shown it:
depths and focal length wrong in L̂, noise in the image, a start beside the reference. The paper
prints none of these; each is a constant here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo import Run, Scenario, simulate

FOCAL_RATIO = 1.03  #: "no specific calibrations have been done": nor is this
DEPTH_RATIO = 0.9  #: "the estimation of the depth … is not accurate": by how much is not printed
NOISE_PX = 0.15  #: of a centre of gravity of an LED, standard deviation per coordinate
REACH = (0.02, 2.0)  #: m and degrees, of a start that was set up by hand
FAR = (0.06, 4.0)  #: m and degrees, of a start "at random position"
NEXT = 1000  #: from the seed of one run to that of its neighbour
EDGE = 0.125  #: m, half the edge of the cube
FINE = 10  #: points of the reference path per frame, among which the nearest is looked for


class Pair(NamedTuple):
    """The same experiment with the derivative term and without."""

    on: Run
    off: Run


class Traces(NamedTuple):
    """An experiment clean, and as it might have been measured."""

    clean: Pair
    measured: Pair


@dataclass(frozen=True)
class Bench:
    """Runs scenarios, and each of them once."""

    kept: dict[Scenario, Run] = field(default_factory=dict)

    def __call__(self, scenario: Scenario) -> Run:
        """The run of a scenario, which must complete: a statement is read off all its frames."""
        if scenario not in self.kept:
            run = simulate(scenario)
            if not run.status.complete:
                raise InputError(f"{scenario.name}: {run.status.sentence}")
            self.kept[scenario] = run
        return self.kept[scenario]

    def pair(self, scenario: Scenario) -> Pair:
        """The scenario with the derivative term and without."""
        return Pair(self(scenario.with_(k_ff=1.0)), self(scenario.with_(k_ff=0.0)))

    def traces(self, scenario: Scenario, seed: int, reach: tuple[float, float] = REACH) -> Traces:
        """The scenario clean and as measured, each with the derivative term and without.

        As measured both start at the same place, and each has noise of its own.
        """
        measured = as_measured(scenario, seed, reach)
        on, off = measured.with_(k_ff=1.0), measured.with_(k_ff=0.0, seed=seed + NEXT)
        return Traces(self.pair(scenario), Pair(self(on), self(off)))

    def lag(self, scenario: Scenario) -> float:
        """Where the camera is at the end of the run, m along the motion; negative is behind."""
        return float(self(scenario).lag_along_motion[-1])


def as_measured(scenario: Scenario, seed: int = 1, reach: tuple[float, float] = REACH) -> Scenario:
    """The scenario with wrong depths and focal length, noise and a start beside its reference.

    `seed` draws the noise and the start, each entry of which is even within ± `reach` (m, degrees).
    """
    return scenario.with_(
        depth_ratio=DEPTH_RATIO,
        focal_ratio=FOCAL_RATIO,
        noise_px=NOISE_PX,
        seed=seed,
        offset=random_start(seed, reach),
    )


def random_start(seed: int, reach: tuple[float, float] = FAR) -> tuple[float, ...]:
    """A twist from the reference's start to the camera's, each entry even in ± reach; m and rad."""
    scale = np.repeat([reach[0], np.deg2rad(reach[1])], 3)
    drawn = scale * np.random.default_rng(seed).uniform(-1, 1, 6)
    return tuple(float(entry) for entry in drawn)


def size(error: Array) -> Array:
    """E of figures 5 and 7: the norm of the error of all coordinates, (n, k) → (n,) in px."""
    return np.asarray(np.linalg.norm(error, axis=1), float)


def sideways(run: Run) -> Array:
    """Distance from the desired path in the top view, (n,) in m; positive to its left.

    The top view is x to the right and z upwards in the object frame, as in figures 6 and 9. A lag
    along the path is no distance from it: the nearest point of the path counts, whenever the
    reference is there, also before its start and after its end.
    """
    period = run.scenario.vision.period
    end = float(run.t[-1])
    beyond = 0.2 * end
    grid = np.linspace(-beyond, end + beyond, int(1.4 * FINE * end / period) + 1)
    reference = run.scenario.reference
    poses = reference.pose(grid)
    path = poses[:, [0, 2], 3]
    velocity = np.squeeze(poses[:, :3, :3] @ reference.twist(grid)[:, :3, None], -1)[:, [0, 2]]
    camera = run.pose[:, [0, 2], 3]
    nearest = np.argmin(np.sum((camera[:, None] - path) ** 2, axis=2), axis=1)
    along = velocity[nearest] / np.linalg.norm(velocity[nearest], axis=1)[:, None]
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    return np.asarray(np.sum((camera - path[nearest]) * normal, axis=1), float)


def last_outside(t: Array, values: Array, bound: float) -> float:
    """The time from which on |values| stays within a bound, s: the frame after the last outside.

    Infinite where the last frame is outside.
    """
    outside = np.flatnonzero(np.abs(values) > bound)
    if not outside.size:
        return float(t[0])
    return float(t[outside[-1] + 1]) if outside[-1] + 1 < len(t) else float("inf")
