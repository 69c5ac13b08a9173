"""The loop of a scenario: what theory has to say of this very experiment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from vsctrl.arrays import Array
from vsctrl.caching import Caching
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.loop.scenario_loop.diagram import digital_blocks, scenario_diagram, scenario_system
from vsctrl.loop.scenario_loop.directions import Direction, directions
from vsctrl.loop.scenario_loop.elements import Elements, elements
from vsctrl.loop.scenario_loop.frame_map import FrameMap
from vsctrl.loop.scenario_loop.gain_range import gain_limit
from vsctrl.loop.scenario_loop.left_out import left_out
from vsctrl.loop.scenario_loop.predicted import predicted_lag, seen_drift
from vsctrl.loop.scenario_loop.summary import summary_lines
from vsctrl.tables import Lines

if TYPE_CHECKING:
    from vsctrl.diagram import Diagram, Loop
    from vsctrl.diagram.channel import OpenLoop
    from vsctrl.diagram.sampled.system import SampledSystem
    from vsctrl.diagram.system import System
    from vsctrl.servo import Scenario
    from vsctrl.servo.scenario import GivenScenario


DEFECTIVE = 1e7  #: condition of the eigenvectors from which on they are as good as dependent …
PARTING = 1e-9  #: … and by what M is then changed, so that they are not


@dataclass(frozen=True, eq=False)
class ScenarioLoop(Lines, Caching):
    """The linear loop of a scenario: its elements, and M, (6, 6) in m and rad, with directions.

    M is how strongly the law answers a small lag at the start, as the camera moves: 1 where all is
    calibrated. `left_out`: dotted keys that are not linear or not constant, and why.

    >>> print(round(vs.loop.of(vs.paper.sliding()).gain_limit, 3))
    15.451
    """

    scenario: Scenario
    elements: Elements
    M: Array
    directions: tuple[Direction, ...]
    left_out: dict[str, str]

    @property
    def diagram(self) -> Diagram:
        """The diagram of one direction; ℓ/ℓ̂ is its κ."""
        return scenario_diagram(self.elements)

    @cached_property
    def critical(self) -> Direction:
        """The direction that is unstable first, of several alike the first."""
        return min(self.directions, key=self.limit_of)

    def system(self, direction: Direction | None = None) -> System:
        """The diagram with its numbers, of the critical direction or a given one.

        Errors: `InputError` for a direction whose κ is complex: it is a pair that turns into each
        other, which `gain_limit` and `is_stable` know, and no diagram with one signal does.
        """
        chosen = direction or self.critical
        if chosen.kappa.imag:
            raise InputError(
                f"system: {chosen.name} is a complex pair of directions, which one loop with one "
                "signal does not have; see gain_limit, is_stable and eigenvalues."
            )
        return scenario_system(self.elements, chosen.kappa.real)

    def as_loop(self, direction: Direction | None = None) -> Loop:
        """The same as a `Loop`, opened at the command T, to draw, to save and to report.

        Errors: as of `system`.
        """
        from vsctrl.diagram import Loop

        system = self.system(direction)
        return Loop(system.diagram, system.values, name=self.scenario.name, opened="T")  # type: ignore[arg-type]

    def open(self, direction: Direction | None = None) -> OpenLoop:
        """The continuous loop, opened at the command T; its margins are those of the loop."""
        return self.system(direction).open("T")

    def sampled(self, direction: Direction | None = None) -> SampledSystem:
        """The same with the command held over a video period, and the law in the computer."""
        system = self.system(direction)
        return system.sampled(self.elements.period, "T", digital_blocks(self.elements))

    def frames(self, direction: Direction) -> FrameMap:
        """The loop of one direction as a map from frame to frame, for any κ."""
        return FrameMap(self.elements, direction.kappa)

    @cached_property
    def is_stable(self) -> bool:
        """Whether all directions are stable as sampled."""
        return self.growth < 1

    @cached_property
    def growth(self) -> float:
        """By what the slowest or fastest growing mode is multiplied each frame; 1 is the limit."""
        return max(self.frames(each).spectral_radius for each in self.directions)

    @cached_property
    def gain_limit(self) -> float:
        """The gain λ (s⁻¹) at which a direction first becomes unstable as sampled; inf if none."""
        return self.limit_of(self.critical)

    def limit_of(self, direction: Direction) -> float:
        """The same of one direction."""
        return gain_limit(self.elements, direction.kappa)

    @cached_property
    def steady_lag(self) -> Array | None:
        """The lag that a constant twist leaves, (6,) in m and rad; None where there is none.

        None of an unstable loop, and of a reference or a target that do not keep their twists.
        """
        T, target = self.scenario.constant_twist, self.scenario.target
        if self.scenario.motion.kind == "hold":
            T = np.zeros(6)
        if T is None or target.sway is not None or not self.is_stable:
            return None
        drift = seen_drift(self.scenario)
        kappas, V = np.linalg.eig(self.M)
        if np.linalg.cond(V) > DEFECTIVE:
            kappas, V = np.linalg.eig(self.M + PARTING * np.diag(np.arange(6.0)))
        rates, drifts = (np.linalg.solve(V, side.astype(complex)) for side in (T, drift))
        parts = [
            FrameMap(self.elements, complex(kappa)).steady(rate, d)
            for kappa, rate, d in zip(kappas, rates, drifts, strict=True)
        ]
        return np.asarray((V @ np.array(parts)).real)

    @cached_property
    def predicted(self) -> Array | None:
        """The lag at every frame by the linear loop, (n, 6) in m and rad, from the start's offset.

        To first order in the lag; None for a reference that turns as well as changes its twist.
        """
        return predicted_lag(self.scenario, self.elements, self.M)

    def _lines(self) -> dict[str, str]:
        return summary_lines(self)

    def data(self) -> dict[str, Any]:
        """Its numbers as JSON takes them, gains in s⁻¹."""
        lag, limit = self.steady_lag, self.gain_limit
        return {
            "stable": self.is_stable,
            "growth_per_frame": self.growth,
            "gain_limit": limit if math.isfinite(limit) else None,
            "kappa": [[each.kappa.real, each.kappa.imag] for each in self.directions],
            "directions": [each.name for each in self.directions],
            "steady_lag": None if lag is None else lag.tolist(),
            "left_out": self.left_out,
        }


@keywords
def of(scenario: GivenScenario) -> ScenarioLoop:
    """The loop of a scenario, with all that is linear in it, and what it leaves out.

    The scenario may be given by the path of its TOML file.
    Latency where it acts, with any fraction of a frame, dead time and lagging axes of the robot,
    integral, Smith predictor or Kalman filter, preview, feed-forward; and everything that the law
    believes of camera, depths and hand, as the matrix M of six degrees of freedom, whose
    eigenvalues κ each have a loop of their own.
    Errors: `InputError` for what is no scenario, and where the law cannot tell all motions apart at
    the start, so that there is no M.

    >>> vs.loop.of(vs.paper.sliding()).is_stable
    True
    """
    from vsctrl.servo.diagnosis.linearised import pull_of_camera
    from vsctrl.servo.scenario import as_scenario

    scenario = as_scenario(scenario)
    law = scenario.law
    constant = scenario
    if law.lam_zero is not None:  # the law near its reference, where that gain acts
        constant = scenario.with_(lam=law.lam_zero, lam_zero=None, lam_slope=None)
    M = pull_of_camera(constant)
    return ScenarioLoop(
        scenario, elements(scenario), M, directions(scenario, M), left_out(scenario)
    )
