"""The linear elements of a scenario's loop, as numbers: what acts, how late and how fast.

All of them act on each direction alike, so that one loop with κ, or with the matrix M in its place,
stands for six degrees of freedom.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from vsctrl import timing

if TYPE_CHECKING:
    from vsctrl.loop.figure1 import Placement
    from vsctrl.servo import Scenario


@dataclass(frozen=True)
class Filter:
    """A Kalman filter on the image: `order` 2 (position, velocity) or 3 (and acceleration).

    `process`: px/s^1.5 or px/s^2.5; `measurement`: standard deviation of a coordinate, px.
    """

    order: int
    process: float
    measurement: float


@dataclass(frozen=True)
class Elements:
    """What is linear in a loop, times in s, λ in s⁻¹; `T_i` and `tau_hat` are None where absent.

    `lam`: of a gain that changes with the error that of no error, which decides near the reference.

    `tau`: latency, acting where `placement` says; `dead_time` and `time_constant`: of the robot;
    `tau_hat`: that a Smith predictor or a Kalman `filter` believes in; `preview`, `preview_ff`: how
    early the whole reference is used, and its derivative besides.
    """

    lam: float
    k_ff: float
    tau: float
    placement: Placement
    period: float
    dead_time: float = 0.0
    time_constant: float = 0.0
    T_i: float | None = None
    preview: float = 0.0
    preview_ff: float = 0.0
    tau_hat: float | None = None
    filter: Filter | None = None

    @property
    def smith(self) -> bool:
        """Whether the law sees what a Smith predictor says."""
        return self.tau_hat is not None and self.filter is None

    @property
    def image_age(self) -> float:
        """Age of the image that the law is given, s."""
        return 0.0 if self.placement == "actuator" else self.tau

    @property
    def reference_age(self) -> float:
        """Age of the reference that it is compared with, before any preview, s."""
        return self.tau if self.placement == "aligned" else 0.0

    @property
    def command_age(self) -> float:
        """From a command to its arrival at the axes, s."""
        return self.dead_time + (self.tau if self.placement == "actuator" else 0.0)


_ORDER = {"velocity": 2, "acceleration": 3}


def elements(scenario: Scenario) -> Elements:
    """The elements of a scenario; times that are whole periods to seven digits are that."""
    law, vision, robot = scenario.law, scenario.vision, scenario.robot
    table, tau = scenario.predictor, timing.settled(vision.latency, vision.period)
    tau_hat, image_filter = table.tau_hat, None
    if table.predictor == "none":
        tau_hat = None
    elif tau_hat is None:
        # The latency that is simulated, with what a Smith predictor knows of the robot on top.
        tau_hat = tau + (robot.dead_time if table.predictor == "smith" else 0.0)
    if table.predictor in _ORDER:
        image_filter = Filter(_ORDER[table.predictor], table.process, table.measurement_px)
    return Elements(
        lam=law.lam if law.lam_zero is None else law.lam_zero,
        k_ff=law.k_ff,
        tau=tau,
        placement=law.placement,
        period=vision.period,
        dead_time=robot.dead_time,
        time_constant=robot.time_constant,
        T_i=law.T_i,
        preview=law.preview,
        preview_ff=law.preview_ff,
        tau_hat=tau_hat,
        filter=image_filter,
    )
