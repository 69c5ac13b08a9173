"""The lag at every frame: figure 1 with its velocity held over a frame, and six degrees of freedom.

Each translation of the reference, in its own camera frame, drives one copy of figure 1. For a
motion sideways without turning this is exact, through every start and turn; where the reference
turns or changes depth it is the first order, and what it leaves out has a size that is known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from vsctrl import loop
from vsctrl.arrays import Array
from vsctrl.diagram import Block, Diagram
from vsctrl.diagram.sampled.system import SampledSystem
from vsctrl.servo import Run, Scenario, timing
from vsctrl.servo.motion.trajectory import Oscillation
from vsctrl.servo.pose import inverse, log
from vsctrl.study.modes import nearest_depth
from vsctrl.study.tracking.cases import Case, CaseResult, is_sideways
from vsctrl.symbols import k_ff
from vsctrl.tables import finite

ROUNDING = 1e-9  #: of the nearest depth or of the way, whichever is longer
FLOOR = 10e-6  #: m, below which a first order is not held to its size


@dataclass(frozen=True, eq=False)
class History(CaseResult):
    """One case: the lag in m at the times t (n,), predicted and simulated, negative = behind.

    Along the motion; of an oscillation along its direction, wherever it moves. `simulated` is
    shorter where the run ended early. `allowed` is the difference that counts as agreement, and
    `reason` where it comes from.

    >>> found = vs.validate(vs.paper.oscillation())
    >>> found.histories[0].agrees
    True
    """

    t: Array
    predicted: Array
    simulated: Array
    allowed: float
    reason: str
    note: str = ""

    @property
    def disagreement(self) -> float:
        """The largest difference at any frame, m; infinite where the run ended early."""
        if len(self.simulated) < len(self.t):
            return math.inf
        return float(np.abs(self.simulated - self.predicted).max())

    @property
    def agrees(self) -> bool:
        """Whether the difference is within what is allowed at every frame."""
        return self.disagreement <= self.allowed

    @property
    def largest(self) -> float:
        """The largest lag to either side that the simulation shows, m."""
        return float(np.abs(self.simulated).max(initial=0.0))

    @property
    def root_mean_square(self) -> float:
        """Of the simulated lag over all frames, m."""
        return float(np.sqrt(np.mean(self.simulated**2))) if len(self.simulated) else 0.0

    def data(self) -> dict[str, Any]:
        """The lag's sizes as JSON takes them; every name ends in its unit."""
        return super().data() | {
            "frames": len(self.simulated),
            "largest_m": self.largest,
            "rms_m": self.root_mean_square,
            "disagreement_m": finite(self.disagreement),
            "allowed_m": self.allowed,
            "agrees": self.agrees,
            "reason": self.reason,
            "note": self.note,
        }


@dataclass(frozen=True)
class Missing(CaseResult):
    """A case that has no history, and why."""

    note: str


def missing(case: Case) -> Missing:
    """The case of a loop that is unstable as sampled, for which no run is worth its while."""
    return Missing(
        **case.labels,
        note=f"unstable at {1e3 * case.scenario.vision.period:g} ms sampling",
    )


def history(case: Case, run: Run) -> History:
    """The history of a case from its run; the loop is stable as sampled."""
    scenario = run.scenario
    t = scenario.t
    along = _directions(scenario, t)
    predicted = np.einsum("ki,ki->k", predicted_lag(case, t), along)
    n = len(run.t)
    allowed, reason = _allowed(case, scenario)
    return History(
        **case.labels,
        t=t,
        predicted=predicted,
        simulated=np.einsum("ki,ki->k", run.lag[:, :3], along[:n]),
        allowed=allowed,
        reason=reason,
        note="" if run.status.complete else f"the simulation ended: {run.status.kind}",
    )


def predicted_lag(case: Case, t: Array) -> Array:
    """The translation of the lag at the frames t (n,), (n, 3) in m, by three copies of figure 1.

    The reference is what its poses add up to from frame to frame, ∑ log(oTc*_k⁻¹ oTc*_k+1), and
    its speed that of the frame, as the law has it.
    """
    reference = case.scenario.reference
    pose = reference.pose(t)
    steps = log(inverse(pose[:-1]) @ pose[1:])[:, :3]
    way = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    speed = reference.twist_at_frames(t)[:, :3]
    twin, compared = held_twin(case), way
    if case.is_late_between_frames:
        # A reference that is late by a part of a frame is a matter of its motion, not of samples.
        period = case.scenario.vision.period
        delayed = timing.delayed(t, period, case.delay / period)
        frame = np.searchsorted(t, delayed, side="right") - 1
        compared = way[frame] + log(inverse(pose[frame]) @ reference.pose(delayed))[:, :3]
    answer = np.zeros_like(way)
    for axis in np.flatnonzero(way.any(axis=0) | speed.any(axis=0)):
        answer[:, axis] = twin["S_ref", "S"].response(compared[:, axis]).y.ravel()
        answer[:, axis] += twin["S_rate", "S"].response(speed[:, axis]).y.ravel()
    return answer - way


def held_twin(case: Case) -> SampledSystem:
    """Figure 1 of a case with its velocity held over a frame, driven by S_ref and S_rate.

    Where the reference is late by a part of a frame, S_ref is to be given late.
    """
    placement = "measurement" if case.is_late_between_frames else case.placement
    values = {**case.values, "ell": case.kappa, "ell_hat": 1.0}
    return _driven_separately(placement).at(values).sampled(case.scenario.vision.period, hold="T")


@cache
def _driven_separately(placement: loop.Placement) -> Diagram:
    """Figure 1 whose feed-forward is given the speed of the reference, as a computer has it."""
    base = loop.diagram(placement)
    feedforward = Block("feed-forward", k_ff, "S_rate -> u_ff")
    parts = [feedforward if part.output == "u_ff" else part for part in base.parts]
    return Diagram(parts, inputs=["S_ref", "S_rate"], outputs=["S"])


def _directions(scenario: Scenario, t: Array) -> Array:
    """The unit vector at each frame that the lag is taken along, (n, 3)."""
    reference = scenario.reference
    if isinstance(reference, Oscillation):
        return np.broadcast_to(reference.direction[:3], (len(t), 3))
    V = reference.twist_at_frames(t)[:, :3]
    size = np.linalg.norm(V, axis=1)
    moving = np.flatnonzero(size > 1e-9 * size.max())
    # A frame at rest takes the direction of the last one that moved, else of the first that does.
    before = np.searchsorted(moving, np.arange(len(t)), side="right") - 1
    chosen = moving[np.maximum(before, 0)]
    return np.asarray(V[chosen] / size[chosen, None])


def _allowed(case: Case, scenario: Scenario) -> tuple[float, str]:
    """The difference between figure 1 and six degrees of freedom (m), and where it comes from."""
    T = scenario.reference.twist(scenario.t)
    depth = nearest_depth(scenario)
    if is_sideways(scenario):
        way = float(np.linalg.norm(T[:, :3], axis=1).max()) * scenario.motion.duration
        return ROUNDING * max(depth, way), "since a sideways motion is exact but for rounding"
    # In depths and radians, the lag is at most about what passes in τ + 1/κλ; where the reference
    # turns back, it changes by twice that.
    passing = np.linalg.norm(T[:, :3], axis=1) / depth + np.linalg.norm(T[:, 3:], axis=1)
    lag = float(passing.max()) * (case.delay + 1 / (case.kappa * scenario.law.lam))
    back = 2 if isinstance(scenario.reference, Oscillation) else 1
    reason = (
        f"since figure 1 is the first order, which leaves out the square of a lag of {lag:.2g} "
        "(depths or radians)"
    )
    return max(back * depth * lag**2, FLOOR), reason
