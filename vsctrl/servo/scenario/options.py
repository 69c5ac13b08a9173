"""The tables that an experiment may have: calibration errors, prediction, robot and faults.

Each has a default for every key, and without them the experiment is the ideal one.
"""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from vsctrl.problems import Problem
from vsctrl.servo.scenario.tables import Table
from vsctrl.servo.scenario.types import (
    CHOICE,
    MaybeNumber,
    MaybePositive,
    MaybePositives,
    MaybeSeconds,
    MaybeTwist,
    Positive,
    Seconds,
    Switch,
    Twist,
    Vector2,
)

Predictor = Literal["none", "smith", "velocity", "acceleration"]
Carrier = Literal["free", "gantry"]
Fault = Annotated[Literal["end", "continue"], CHOICE]


class CalibrationTable(Table):
    """[calibration]: what the law believes of camera, depths and hand, where it is wrong."""

    heading = "calibration"
    focal_ratio: Positive = Field(1.0, description="focal length in L̂ over the true one")
    centre_px: Vector2 = Field((0.0, 0.0), description="error of the principal point in L̂, px")
    depth_ratios: MaybePositives = Field(
        None, description="of each point, times law.depth_ratio: depth in L̂ over the true one"
    )
    hand_eye: Twist = Field(
        (0.0,) * 6, description="twist from the true camera to where the hand believes it, m, rad"
    )


class ReferenceImageTable(Table):
    """[reference_image]: what s*(t) was computed with, where that is wrong.

    Points are found from the image at t = 0 with the believed camera and depths, moved as the
    reference moves, and projected again: s*(0) is right whatever is believed.
    """

    heading = "reference_image"
    reference_depth_ratio: Positive = Field(
        1.0, description="depth that s*(t) was computed with over the true depth"
    )
    reference_focal_ratio: Positive = Field(
        1.0, description="focal length that s*(t) was computed with over the true one"
    )
    reference_centre_px: Vector2 = Field(
        (0.0, 0.0), description="error of the principal point that s*(t) was computed with, px"
    )
    reference_k1: MaybeNumber = Field(
        None, description="distortion that s*(t) was computed with; left out: the camera's own"
    )
    reference_hand_eye: Twist = Field(
        (0.0,) * 6, description="hand_eye that the motion of s*(t) was computed with, m and rad"
    )


class PredictorTable(Table):
    """[predictor]: what is done about the latency and about targets that move."""

    heading = "predictor"
    predictor: Annotated[Predictor, CHOICE] = Field(
        "none",
        description="none, smith, or a Kalman filter: velocity or acceleration of the target",
    )
    tau_hat: MaybeSeconds = Field(
        None,
        description="latency that it believes in, s; left out: the true one, and with smith "
        "robot.dead_time on top",
    )
    process: Positive = Field(
        100.0, description="how unsteady the target is: px/s^1.5 (velocity), px/s^2.5 (else)"
    )
    measurement_px: Positive = Field(
        0.5, description="standard deviation of the image that the filter believes in, px"
    )

    def problems(self) -> Iterator[Problem]:
        """A latency for no predictor."""
        if self.predictor == "none" and self.tau_hat is not None:
            sentence = 'belongs to a predictor, and predictor is "none"; choose one or leave it out'
            yield "tau_hat", sentence


class RobotTable(Table):
    """[robot]: what carries the camera, and what that cannot do."""

    heading = "robot"
    carrier: Annotated[Carrier, CHOICE] = Field(
        "free", description="free (moves as told) or gantry (three slides and a wrist)"
    )
    dead_time: Seconds = Field(0.0, description="between a command and its motion, s")
    speed_limit: MaybePositive = Field(None, description="greatest speed of the camera, m/s")
    rate_limit: MaybePositive = Field(None, description="greatest rotation of the camera, rad/s")
    acceleration_limit: MaybePositive = Field(
        None,
        description="greatest |V'| of the twist's components in the camera frame, m/s²: what it "
        "feels on a circle at constant twist does not count",
    )
    angular_acceleration_limit: MaybePositive = Field(
        None, description="greatest |Ω'| of the twist's components in the camera frame, rad/s²"
    )
    time_constant: Seconds = Field(0.0, description="of the axes' first-order lag, s")
    joints: MaybeTwist = Field(None, description="of the gantry at the start, m and rad")
    avoidance: Switch = Field(False, description="slow down before a joint reaches its end")

    def problems(self) -> Iterator[Problem]:
        """A gantry without joints, or joints without a gantry."""
        if self.carrier == "gantry" and self.joints is None:
            yield (
                "joints",
                "missing; give where the gantry's joints are at the start, such as "
                "[0, 0, 0, 0, 0.5, 0] in m and rad",
            )
        if self.carrier == "free":
            given = {"joints": self.joints is not None, "avoidance": self.avoidance}
            sentence = 'belongs to carrier = "gantry"; choose it or leave this out'
            yield from ((name, sentence) for name, there in given.items() if there)


class FaultsTable(Table):
    """[faults]: whether the run ends where something fails, or goes on as well as it can."""

    heading = "faults"
    on_behind: Fault = Field(
        "end", description="a point comes to lie behind the camera: end or continue without it"
    )
    on_lost: Fault = Field(
        "end", description="fewer than 3 points in the image: end or continue with what is left"
    )
    on_rank_loss: Fault = Field(
        "end", description="L̂ loses rank: end or continue with the twist of least norm"
    )
    on_joint_limit: Fault = Field(
        "end", description="a joint reaches its end: end or continue standing still"
    )
