"""Runs that the experiments share, and how long a transient in them takes to end.

All start at the scenario's start pose, before its target, with its law (10) and its timing; only
the motion, the offset and the length of the run are theirs. Noise, limits, distortion and whatever
else a scenario may have besides is left out (`Scenario.ideal`): it would hide what is measured.
"""

from __future__ import annotations

import math
from typing import Any

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo import Run, Scenario
from vsctrl.servo.simulate import simulated
from vsctrl.study.modes import characteristic, dominant, eigenvalues, gain_limit

MOST_FRAMES = 4000  #: the longest wait for a transient to end
ENDED = 1e-10  #: what is left of a transient that is over


def latency(scenario: Scenario) -> int:
    """The latency in video periods, d, once it is clear that the experiments can be made.

    Errors: `InputError` where it is no whole number, or where the law cannot tell all motions apart
    even at the start.
    """
    frames = scenario.latency_frames
    possible(scenario)
    return frames


def possible(scenario: Scenario) -> None:
    """Errors: `InputError` where the law cannot tell all motions apart even at the start."""
    status = run(scenario, 1, kind="hold").status
    if not status.complete:
        raise InputError(f"{scenario.name}: no experiment can be made here. {status.sentence}")


def run(scenario: Scenario, frames: int, **changes: Any) -> Run:
    """A run of the frames 0 … `frames` of the ideal experiment, with some fields changed."""
    ideal = scenario.ideal
    return simulated(ideal.with_(duration=frames * scenario.vision.period, **changes))


def released(scenario: Scenario, offset: Array, frames: int, **changes: Any) -> Run:
    """A run with the reference at rest and the camera let go beside it, `offset` (6,) in m, rad."""
    there = tuple(float(entry) for entry in offset)
    return run(scenario, frames, kind="hold", offset=there, **changes)


def settling(scenario: Scenario, what: str) -> tuple[int, float]:
    """Frames until the transient is over, and the share that is left of it then.

    Errors: `InputError` where the loop is not stable as sampled, so that nothing settles.
    """
    possible(scenario)
    frames_late = timing.first_frame(scenario.vision.latency, scenario.vision.period)
    limit = gain_limit(scenario)
    if not scenario.law.lam < limit:
        raise InputError(
            f"law.lam: {scenario.law.lam:g} s⁻¹ is not below the limit of {limit:.4g} s⁻¹ at "
            f"{1e3 * scenario.vision.period:g} ms sampling, so there is no steady {what}; lower it."
        )
    roots = [dominant(characteristic(scenario, mu)) for mu in eigenvalues(scenario)]
    return ended(max(map(abs, roots)), frames_late)


def ended(modulus: float, frames_late: int) -> tuple[int, float]:
    """Frames until a mode of this modulus is over, and the share that is left of it then."""
    needed = math.log(ENDED) / math.log(modulus) if modulus > 1e-3 else 4.0
    frames = min(math.ceil(needed) + 2 * frames_late, MOST_FRAMES)
    return frames, max(modulus**frames, ENDED)
