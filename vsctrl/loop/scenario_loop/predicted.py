"""The lag of a scenario at every frame, by its linear loop: what its run should show."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vsctrl.arrays import Array
from vsctrl.loop.scenario_loop.elements import Elements
from vsctrl.loop.scenario_loop.frame_map import FrameMap

if TYPE_CHECKING:
    from vsctrl.servo import Scenario


def seen_drift(scenario: Scenario) -> Array:
    """The twist of the target as the camera at the start sees it, (6,)."""
    from vsctrl.servo.pose import adjoint, inverse

    oTc = scenario.reference.pose(0.0)
    return np.asarray(adjoint(inverse(oTc)) @ np.array(scenario.target.drift))


def predicted_lag(scenario: Scenario, elements: Elements, M: Array) -> Array | None:
    """The lag at the frames, (n, 6) in m and rad, from the start's offset on.

    First order in the lag. None where the reference turns as well as changes its twist, or where
    the target sways.
    """
    from vsctrl.servo.pose import inverse, log

    reference, t, e = scenario.reference, scenario.t, elements
    twists = reference.twist(t)
    constant = not np.ptp(twists, axis=0).any()
    if scenario.target.sway is not None or not (constant or not twists[:, 3:].any()):
        return None
    start = inverse(reference.pose(0.0))

    def moved(times: Array) -> Array:
        if constant:
            return times[:, None] * twists[0]
        return np.asarray(log(start @ reference.pose(times)))

    drift, now = seen_drift(scenario), moved(t)
    compared = moved(np.maximum(t - e.reference_age, 0.0) + e.preview)
    rates = reference.twist(t + (e.preview + e.preview_ff))
    target = np.maximum(t - e.image_age, 0.0)[:, None] * drift
    frames = FrameMap(e, M)
    state = frames.at_rest(np.array(scenario.start.offset, dtype=float))
    lags = np.empty((len(t), 6))
    for k in range(len(t)):
        lags[k] = state.q - now[k] - t[k] * drift
        state = frames.step(state, compared[k], rates[k], target[k])
    return lags
