"""Runs of a scenario with something changed: what would have been, had this been otherwise.

A remedy is advised after it was tried. The simulator is handed in, so that it may ask this module
about a run that failed. Trials are short, and all of them together are bounded in frames and time,
so that a run that fails costs seconds more than one that does not, however long it is.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo.results.frames import Frames
from vsctrl.servo.scenario import Scenario
from vsctrl.servo.scenario.options import CalibrationTable, ReferenceImageTable

# What a camera, a robot and a target may have besides the loop itself, taken away.
UNLIMITED: dict[str, Any] = {
    "speed_limit": None, "rate_limit": None, "acceleration_limit": None,
    "angular_acceleration_limit": None,
}  # fmt: skip
CLEAR: dict[str, Any] = dict.fromkeys(
    ("noise_px", "quantum_px", "outliers", "missed", "jitter"), 0.0
)
ALONE: dict[str, Any] = UNLIMITED | CLEAR | {
    "carrier": "free", "joints": None, "avoidance": False, "size_px": None, "smooth": None,
    "drift": (0.0,) * 6, "sway": None,
}  # fmt: skip
CALIBRATED: dict[str, Any] = CalibrationTable().model_dump() | {"depth_ratio": 1.0}
PLANNED: dict[str, Any] = ReferenceImageTable().model_dump()
# A lag that is small: in shares of the depth and in rad, in no direction of its own.
_NEAR = 1e-4 * np.array([0.5, -0.6, 0.4, 0.5, 0.6, -0.4])
# What is left of it that is rounding.
_NOTHING = 1e-9
# Frames of a trial about the reference, the fewest and the most, and of any other one the most.
_FEWEST, _ENOUGH, _MOST = 60, 400, 2000
# All trials of a run together: frames, and seconds of the processor, which a law of many features
# takes and no other one comes near.
FRAMES, SECONDS = 20_000, 15.0
# A camera that ends within this of its reference (shares of the depth and rad), or within a fifth
# of where it began, has come to it.
ARRIVED, SHARE = 0.02, 0.2
# A stable loop is never so many times farther than it began; a remedy leaves at most this share.
FAR, BETTER = 10.0, 0.7


def lag_sizes(run: Frames) -> Array:
    """Distance from the reference as a share of the mean depth, and angle in rad, as one: (n,)."""
    depth = float(run.depths[0].mean())
    return np.linalg.norm(run.lag / ([depth] * 3 + [1.0] * 3), axis=1)


class TooManyError(Exception):
    """All the trials that one run is worth were made."""


class Trials:
    """Variations of one scenario, simulated when they are asked for.

    Whatever is asked for beyond FRAMES or SECONDS of them raises TooManyError.
    """

    def __init__(self, scenario: Scenario, simulate: Callable[[Scenario], Frames]) -> None:
        self.scenario, self._simulator = scenario, simulate
        self._frames, self._until = FRAMES, time.process_time() + SECONDS

    def _simulate(self, scenario: Scenario) -> Frames:
        if self._frames < scenario.frames or time.process_time() > self._until:
            raise TooManyError
        run = self._simulator(scenario)
        self._frames -= len(run.t)
        return run

    def shakes(self, **changes: Any) -> bool:
        """Whether the loop by itself leaves a reference at rest near which it was released."""
        try:
            scenario = self.scenario.with_(**ALONE | changes)
            period = scenario.vision.period
            late = timing.first_frame(scenario.vision.latency + scenario.robot.dead_time, period)
            frames = int(np.clip(scenario.frames, _FEWEST, _ENOUGH))
            frames = min(max(frames, 20 * (late + 1)), _MOST)
            depth = float(np.linalg.norm(np.array(scenario.start.position)))
            run = self._simulate(
                scenario.with_(
                    kind="hold", duration=frames * period,
                    offset=tuple(_NEAR * ([depth or 1.0] * 3 + [1.0] * 3)),
                )
            )  # fmt: skip
        except InputError:
            return True
        if not run.status.ok:
            return True
        size, third = lag_sizes(run), len(run.t) // 3
        last = size[-third:].max()
        grown = last > max(size[third:-third].max(), _NOTHING)
        # Far away the loop is another one, and may go on at one size.
        return bool(grown or last > FAR * size[0])

    def arrives(self, **changes: Any) -> bool:
        """Whether the experiment with these changes ends at its reference."""
        if self.scenario.frames > _MOST:
            return False
        try:
            run = self._simulate(self.scenario.with_(**changes))
        except InputError:
            return False
        if not run.status.ok:
            return False
        size = lag_sizes(run)
        began = size[0] if "offset" not in changes else 0.0
        return bool(size[-max(1, len(size) // 10) :].max() < max(ARRIVED, SHARE * began))

    def helps(self, run: Frames, **changes: Any) -> bool:
        """Whether the run with these changes ends clearly nearer to its reference than this one.

        Of a run that is too long to be made again it is believed.
        """
        if self.scenario.frames > self._frames:
            return True
        try:
            other = self._simulate(self.scenario.with_(**changes))
        except InputError:
            return False
        quarter = -max(1, len(run.t) // 4)
        here, there = lag_sizes(run)[quarter:].mean(), lag_sizes(other)[quarter:].mean()
        return bool(other.status.ok and there < BETTER * here)

    def lag_from_a_perfect_start(self) -> float | None:
        """``lag_sizes`` at the end of the run without start.offset, None if it fails.

        It decides whether the run is ok, and is made once whatever it costs.
        """
        try:
            run = self._simulator(self.scenario.with_(offset=(0.0,) * 6))
        except InputError:
            return None
        return float(lag_sizes(run)[-1]) if run.status.ok else None
