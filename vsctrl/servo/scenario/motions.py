"""The kinds of motion that [motion] of a scenario can ask for, each as a table of its own keys.

Every kind makes a ``Trajectory`` from the start pose. Which kind a table is, and the kind that
links others, is in ``links``.
"""

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from vsctrl.arrays import Array
from vsctrl.errors import nearest
from vsctrl.problems import Problem
from vsctrl.servo.motion import trajectory
from vsctrl.servo.motion.path import Ends, Path
from vsctrl.servo.motion.trajectory import Trajectory, Waveform
from vsctrl.servo.pose import from_euler_xyz
from vsctrl.servo.scenario.tables import Table
from vsctrl.servo.scenario.types import (
    CHOICE,
    Direction3,
    Direction6,
    MaybePositive,
    Number,
    Positive,
    Rows3,
    Times,
    Vector3,
)
from vsctrl.vocabulary import meant

Frame = Literal["object", "start"]

KIND = "screw (constant twist), hold, rotation, oscillation, path or linked"
_DURATION = "length of the run or part, s"


class Motion(Table):
    """[motion]: how the reference moves."""

    heading = "motion"

    @abstractmethod
    def trajectory(self, oTc0: Array) -> Trajectory:
        """The motion from a start pose (4, 4). Raises InputError where it is impossible."""

    @model_serializer(mode="wrap")
    def _dump(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without keys that were left out."""
        return {key: value for key, value in dump(self).items() if value is not None}

    @classmethod
    def stranger(cls, name: str, value: object = None) -> str:
        """What to do with a key that this kind does not have, as the end of a sentence."""
        homes = [f'"{m.name()}"' for m in Motion.__subclasses__() if name in m.model_fields]
        if not homes:
            return super().stranger(name, value)
        own = nearest(name, cls.model_fields, value) if meant(name, cls.model_fields) else ""
        kinds = " or ".join(homes)
        return f'; a motion of kind "{cls.name()}" has no such key, only kind {kinds}{own}'

    @classmethod
    def name(cls) -> str:
        """The word that ``kind`` has in this table."""
        (word,) = get_args(cls.model_fields["kind"].annotation)
        return str(word)


class ScrewMotion(Motion):
    """kind = "screw": constant twist of the reference in the camera frame."""

    kind: Literal["screw"] = Field("screw", description=KIND)
    V: Vector3 = Field(description="reference velocity in the camera frame, m/s")
    Omega: Vector3 = Field((0.0,) * 3, description="reference rotation in the camera frame, rad/s")
    duration: Positive = Field(description=_DURATION)

    def trajectory(self, oTc0: Array) -> Trajectory:
        """The constant twist from a start pose (4, 4)."""
        return trajectory.ConstantScrew(oTc0, np.array([*self.V, *self.Omega]), self.duration)


class HoldMotion(Motion):
    """kind = "hold": the reference rests."""

    kind: Literal["hold"] = Field(description=KIND)
    duration: Positive = Field(description=_DURATION)

    def trajectory(self, oTc0: Array) -> Trajectory:
        """The rest at the start from a start pose (4, 4)."""
        return trajectory.hold(oTc0, self.duration)


class RotationMotion(Motion):
    """kind = "rotation": about an axis that is fixed in the camera frame, and so in space."""

    kind: Literal["rotation"] = Field(description=KIND)
    axis: Direction3 = Field(description="direction of the axis in the camera frame")
    arm: Vector3 = Field(description="from the camera to the axis in the camera frame, m")
    speed: Number = Field(description="angular velocity about the axis, rad/s")
    duration: Positive = Field(description=_DURATION)

    def trajectory(self, oTc0: Array) -> Trajectory:
        """The rotation from a start pose (4, 4)."""
        return trajectory.rotation(oTc0, self.axis, self.arm, self.speed, self.duration)


class OscillationMotion(Motion):
    """kind = "oscillation": to and fro along a screw, from its middle."""

    kind: Literal["oscillation"] = Field(description=KIND)
    waveform: Annotated[Waveform, CHOICE] = Field("sine", description="sine or triangle")
    direction: Direction6 = Field(
        description="direction (V, Omega) in the camera frame; its length does not count"
    )
    amplitude: Positive = Field(description="from the middle to a peak, m (rad where V = 0)")
    cycle: MaybePositive = Field(None, description="length of one oscillation, s")
    speed: MaybePositive = Field(None, description="greatest speed, m/s (rad/s where V = 0)")
    duration: Positive = Field(description=_DURATION)

    def problems(self) -> Iterator[Problem]:
        """A cycle and a speed, or neither."""
        if (self.cycle is None) == (self.speed is None):
            yield (
                "cycle, speed",
                "with the amplitude each follows from the other; give one of the two (in with_, "
                "set the other to None)",
            )

    def trajectory(self, oTc0: Array) -> Trajectory:
        """The oscillation from a start pose (4, 4)."""
        way = 4 if self.waveform == "triangle" else 2 * math.pi  # of one cycle, at greatest speed
        period = self.cycle or way * self.amplitude / (self.speed or 1.0)
        return trajectory.Oscillation(
            oTc0, np.array(self.direction), self.amplitude, period, self.duration, self.waveform
        )


class PathMotion(Motion):
    """kind = "path": from the start through given poses, with a continuous twist."""

    kind: Literal["path"] = Field(description=KIND)
    times: Times = Field(description="when the poses are reached, s; the last one ends the run")
    positions: Rows3 = Field(description="x, y, z of the camera at these times, m")
    angles_xyz_deg: Rows3 = Field(description="its intrinsic XYZ angles then, degrees")
    frame: Annotated[Frame, CHOICE] = Field(
        "object", description="frame of the poses: object, or start (the camera at the start)"
    )
    ends: Annotated[Ends, CHOICE] = Field(
        "rest", description="rest (from and to zero velocity) or free"
    )

    def problems(self) -> Iterator[Problem]:
        """Another number of poses than of times."""
        n = len(self.times)
        for name in ("positions", "angles_xyz_deg"):
            if len(rows := getattr(self, name)) != n:
                yield name, f"{len(rows)} rows for {n} times; give one row for every time"

    @property
    def duration(self) -> float:
        """Length of the run, s: the last of the times."""
        return self.times[-1]

    def trajectory(self, oTc0: Array) -> Trajectory:
        """The path from a start pose (4, 4). Raises InputError where it is impossible."""
        poses = from_euler_xyz(self.positions, self.angles_xyz_deg)
        if self.frame == "start":
            poses = oTc0 @ poses
        return Path.through([0.0, *self.times], [oTc0, *poses], self.ends)
