"""The loop of figure 1 in a scenario: its stability and its errors by every way, in one value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.servo import Run, Scenario, simulate
from vsctrl.servo.scenario import GivenScenario, as_scenario
from vsctrl.study.stability import Stability, stability
from vsctrl.study.tracking.comparison import Comparison, validate


@dataclass(frozen=True)
class LoopReport:
    """A scenario's stability, its validated tracking errors, and its runs with and without k_ff.

    All are of what that theory knows of it (`Scenario.ideal`).

    >>> found = vs.study.examine(vs.paper.sliding())
    >>> found.comparison.agrees
    True
    """

    scenario: Scenario
    stability: Stability
    comparison: Comparison
    with_feedforward: Run
    without_feedforward: Run

    def data(self) -> dict[str, Any]:
        """All of its numbers as JSON takes them."""
        scenario = self.scenario
        return {
            "scenario": {"digest": scenario.digest, **scenario.model_dump(mode="json")},
            **self.stability.data(),
            **self.comparison.data(),
            "beyond_theory": scenario.beyond_theory,
        }


@keywords
def examine(
    scenario: GivenScenario, progress: Callable[[str], None] = lambda step: None
) -> LoopReport:
    """Compute all of it; `progress` is told each step as it begins.

    Where `validate` has nothing to compare, as with a reference that is held, the comparison is
    empty and its note says why. Errors: `InputError` as `stability`, and for a screw without any
    twist, which is more likely a slip of the pen than a wish to hold.

    >>> found = vs.study.examine(vs.paper.sliding())
    >>> found.with_feedforward.status.ok
    True
    """
    scenario = as_scenario(scenario)
    progress("margins and limits")
    margins = stability(scenario)
    progress("tracking errors, four ways")
    try:
        comparison = validate(scenario)
    except InputError as error:
        T = scenario.constant_twist
        if scenario.motion.kind == "screw" and T is not None and not T.any():
            raise
        comparison = Comparison(scenario, note=f"There is nothing to compare: {error}")
    progress("six-degree-of-freedom runs")
    on = simulate(scenario.ideal.with_(k_ff=scenario.law.k_ff or 1.0))
    off = simulate(scenario.ideal.with_(k_ff=0.0))
    return LoopReport(scenario, margins, comparison, on, off)
