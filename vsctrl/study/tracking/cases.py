"""The cases that a comparison runs through: a scenario's options, each switched off and on.

A case knows its loop, as a system and as a run of the simulator; what is asked of the two is left
to the comparisons.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

from vsctrl import loop, timing
from vsctrl.diagram import Ramp, Signal
from vsctrl.servo import Run, Scenario, simulate
from vsctrl.study.modes import characteristic, dominant, gain_limit, sideways_ratio

if TYPE_CHECKING:
    from vsctrl.diagram.system import System
    from vsctrl.symbols import Expr

MOST_FRAMES = 10_000  #: the longest run that waiting for the end of a transient may cost
_WHERE = {"measurement": "late", "aligned": "late, aligned", "actuator": "late in the actuator"}


@dataclass(frozen=True)
class Case:
    """A scenario with this feed-forward gain, latency (s) and placement of the latency."""

    scenario: Scenario
    k_ff: float
    delay: float
    placement: loop.Placement

    @property
    def feedforward(self) -> bool:
        """Whether the derivative term is there."""
        return bool(self.k_ff)

    @property
    def name(self) -> str:
        """The case in words, as a table names it."""
        words = f"{1e3 * self.delay:g} ms {_WHERE[self.placement]}" if self.delay else "no latency"
        words += ", aligned" if self.placement == "aligned" and not self.delay else ""
        return f"{'with' if self.k_ff else 'without'} feed-forward, {words}"

    @property
    def labels(self) -> dict[str, Any]:
        """The fields of a `CaseResult`."""
        labels = {"case": self.name, "feedforward": self.feedforward}
        return labels | {"delay": self.delay, "placement": self.placement}

    @property
    def is_late_between_frames(self) -> bool:
        """Whether the reference is delayed too, and by no whole number of frames."""
        whole = timing.whole_periods(self.delay, self.scenario.vision.period)
        return self.placement == "aligned" and whole is None

    @property
    def kappa(self) -> float:
        """κ = ℓ/ℓ̂ along the motion."""
        return ratio_along_motion(self.scenario)

    @property
    def values(self) -> dict[str, float]:
        """λ (s⁻¹), k_ff and τ (s), by the names that a diagram takes."""
        return {"lam": self.scenario.law.lam, "k_ff": self.k_ff, "tau": self.delay}

    @property
    def system(self) -> System:
        """The loop of figure 1 in continuous time."""
        return loop.diagram(self.placement).at(self.values, ell=self.kappa, ell_hat=1.0)

    @property
    def sampled_limit(self) -> float:
        """λ (s⁻¹) from which on some direction is unstable with the velocity held over a frame."""
        return gain_limit(self.own)

    @property
    def is_stable_as_sampled(self) -> bool:
        """Whether the gain is below that limit."""
        return self.scenario.law.lam < self.sampled_limit

    @property
    def steady_lag(self) -> float:
        """The lag on a ramp of the scenario's speed in closed form, m; negative = behind."""
        ramp = Ramp(self.scenario.speed)
        return float(loop.tracking_error(ramp, self.placement, kappa=self.kappa, **self.values))

    def formula(self, reference: Signal) -> Expr:
        """The error on a reference in closed form, what is 0 or 1 in this case put in."""
        known: dict[str, Any] = {} if self.delay else {"tau": 0}
        known |= {"k_ff": int(self.k_ff)} if self.k_ff in (0.0, 1.0) else {}
        known |= {"kappa": 1} if self.kappa == 1 else {}
        return loop.tracking_error(reference, self.placement, **known)

    @property
    def own(self) -> Scenario:
        """The scenario of this case as theory has it: nothing but the law (10) and its timing."""
        return self.scenario.ideal.with_(
            k_ff=self.k_ff, latency=self.delay, placement=self.placement
        )

    def run(self, duration: float | None = None) -> Run:
        """The simulation, lasting as long as the scenario does or some other time (s)."""
        changes: dict[str, Any] = {} if duration is None else {"duration": duration}
        return simulate(self.own.with_(**changes))

    def left_after(self, seconds: float) -> float:
        """The share that is left of a transient, held over frames or not, whichever is more.

        By the dominant root of each loop: e^{σt}, and |z|ᵏ over the whole frames in that time. It
        is 1 where either loop is not stable.
        """
        frames = timing.last_frame(seconds, self.scenario.vision.period)
        held = abs(dominant(characteristic(self.own, self.kappa)))
        # e^{σt} of the rightmost root, kept from overflowing where that is right of the axis.
        smooth = math.exp(min(float(self.system.poles(1)[0].real) * seconds, 0.0))
        return max(min(held, 1.0) ** frames, smooth)


@dataclass(frozen=True, eq=False)
class CaseResult:
    """What every comparison says of a case first: its name, its latency and where that is."""

    case: str
    feedforward: bool
    delay: float  #: s
    placement: loop.Placement

    def data(self) -> dict[str, Any]:
        """The result as JSON takes it; every name ends in its unit."""
        return {
            "case": self.case,
            "feedforward": self.feedforward,
            "delay_s": self.delay,
            "placement": self.placement,
        }


def ratio_along_motion(scenario: Scenario) -> float:
    """κ = ℓ/ℓ̂ of the motion, which a wrong depth or focal length makes other than 1.

    The focal length counts where the motion is sideways; elsewhere it has no single κ.
    """
    return sideways_ratio(scenario) if is_sideways(scenario) else scenario.law.depth_ratio


def is_sideways(scenario: Scenario) -> bool:
    """Whether figure 1 describes the motion exactly: no turning, no change of depth."""
    return not scenario.reference.twist(scenario.t)[:, 2:].any()


def cases(scenario: Scenario) -> list[Case]:
    """Feed-forward off and on, latency 0 and the scenario's, in the measurement and aligned.

    And in the actuator if the scenario has it there. Feed-forward is 1 where the scenario has none.
    """
    latency, on = scenario.vision.latency, scenario.law.k_ff or 1.0
    placements: list[loop.Placement] = ["measurement", "aligned"]
    if scenario.law.placement == "actuator":
        placements.append("actuator")
    return [
        Case(scenario, k_ff, delay, placement)
        for k_ff, delay, placement in product((0.0, on), dict.fromkeys((0.0, latency)), placements)
        if delay or placement != "actuator"  # without latency it is the first case again
    ]
