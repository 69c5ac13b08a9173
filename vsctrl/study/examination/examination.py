"""One scenario looked at from all sides, in one value: what a report of it is drawn from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vsctrl import loop
from vsctrl.arrays import Array
from vsctrl.caching import Caching
from vsctrl.errors import InputError, LimitError
from vsctrl.loop import ScenarioLoop
from vsctrl.servo import Run, Scenario, simulate
from vsctrl.servo.results.outcome import Outcome, outcome
from vsctrl.servo.scenario import as_scenario
from vsctrl.study.examination.advice import Advice, advice
from vsctrl.study.examination.motion import LAST, LastPart, last_part
from vsctrl.study.examination.positioning import Positioning, positioning
from vsctrl.study.loop_report import LoopReport, examine


@dataclass(frozen=True, eq=False)
class Examination(Caching):
    """A scenario, its run as it is configured, and its loop with what that predicts.

    `loop` is None where the law cannot tell all motions apart, and `no_loop` says so. `figure_1`:
    the loop of the paper and its errors by all ways, where the scenario is no more than that.
    """

    scenario: Scenario
    run: Run
    loop: ScenarioLoop | None
    no_loop: str
    figure_1: LoopReport | None

    @cached_property
    def outcome(self) -> Outcome:
        """The run's summary."""
        return outcome(self.run)

    @cached_property
    def last(self) -> LastPart:
        """The last quarter of the run."""
        return last_part(self.run)

    @cached_property
    def positioning(self) -> Positioning | None:
        """How the camera arrives, where its reference is held and it does not start there."""
        return positioning(self.run, self.loop)

    @property
    def arrives(self) -> bool:
        """Whether it arrives there within the run: within 1 px and 1 mm, for good."""
        found = None if self.positioning is None else self.positioning.simulated
        return found is not None and None not in (found.to_image, found.to_space)

    @cached_property
    def advice(self) -> Advice | None:
        """What another gain would do; None without a loop."""
        return None if self.loop is None else advice(self.loop)

    @cached_property
    def predicted(self) -> Array | None:
        """The lag that the linear loop predicts at the frames of the run, (n, 6); None of none."""
        lag = None if self.loop is None else self.loop.predicted
        return None if lag is None else lag[: len(self.run.t)]

    @cached_property
    def difference(self) -> float | None:
        """The largest distance of the run from that in its last quarter, m.

        Where there is noise it is that of the means, since noise keeps every camera moving.
        """
        if self.predicted is None or not self.run.status.complete:
            return None
        n = max(1, round(LAST * len(self.run.t)))
        apart = self.run.lag[-n:, :3] - self.predicted[-n:, :3]
        if self.noisy:
            apart = apart.mean(axis=0, keepdims=True)
        return float(np.linalg.norm(apart, axis=1).max())

    @property
    def noisy(self) -> bool:
        """Whether something random keeps the camera moving."""
        vision = self.scenario.vision
        return bool(vision.noise_px or vision.quantum_px or vision.outliers or vision.jitter)

    @property
    def held_frames(self) -> int:
        """In how many frames limits held the camera back."""
        return sum(event.frames for event in self.run.events if event.kind == "saturated")

    def data(self) -> dict[str, Any]:
        """All of its numbers as JSON takes them."""
        return {
            "scenario": {"digest": self.scenario.digest, **self.scenario.model_dump(mode="json")},
            "loop": None if self.loop is None else self.loop.data(),
            "no_loop": self.no_loop,
            "advice": None if self.advice is None else self.advice.data(),
            "run": self.run.data(),
            "last_quarter": self.last.data(),
            "positioning": None if self.positioning is None else self.positioning.data(),
            "difference_m": self.difference,
        }


def examination(
    scenario: Scenario, progress: Callable[[str], None] = lambda step: None
) -> Examination:
    """Find the loop of a scenario, run it, and compare; `progress` is told each step as it begins.

    Errors: `InputError` for what is no scenario, and for a screw without any twist, which is more
    likely a slip of the pen than a wish to hold.
    """
    scenario = as_scenario(scenario)
    T = scenario.constant_twist
    if scenario.motion.kind == "screw" and T is not None and not T.any():
        raise InputError(
            "motion.V: the reference does not move; give motion.V a velocity, or motion.kind = "
            '"hold" for a goal at rest.'
        )
    progress("the loop")
    own, no_loop = _loop(scenario)
    progress("six-degree-of-freedom run")
    run, figure_1 = simulate(scenario), None
    if own is not None and not scenario.beyond_theory and scenario.motion.kind != "hold":
        try:
            figure_1 = examine(scenario, progress)
        except InputError:  # nothing to compare: a motion that does not translate
            figure_1 = None
    return Examination(scenario, run, own, no_loop, figure_1)


def examination_of_run(
    run: Run, progress: Callable[[str], None] = lambda step: None
) -> Examination:
    """The same of a run that there is already, without the paper's comparison."""
    progress("the loop")
    own, no_loop = _loop(run.scenario)
    return Examination(run.scenario, run, own, no_loop, None)


def _loop(scenario: Scenario) -> tuple[ScenarioLoop | None, str]:
    """The loop of a scenario, or the sentence that says why there is none."""
    try:
        return loop.of(scenario), ""
    except (InputError, LimitError) as error:
        return None, str(error)
