"""What an experiment is described by, and what follows from that alone: motion, frames, latency.

A ``Description`` need not be possible; ``Scenario`` is the one that was checked.
"""

from typing import Annotated

import numpy as np
from pydantic import BeforeValidator, Field

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.problems import FieldsError
from vsctrl.servo.motion.trajectory import ConstantScrew, Trajectory
from vsctrl.servo.pose import from_euler_xyz
from vsctrl.servo.scenario.experiment import (
    CameraTable,
    LawTable,
    StartTable,
    TargetTable,
    VisionTable,
)
from vsctrl.servo.scenario.links import MOTION_FIELDS, AnyMotion, pick
from vsctrl.servo.scenario.options import (
    CalibrationTable,
    FaultsTable,
    PredictorTable,
    ReferenceImageTable,
    RobotTable,
)
from vsctrl.servo.scenario.tables import Table
from vsctrl.servo.scenario.types import Switch, Text


class Description(Table):
    """The tables of one experiment; units and meaning of each field in its table."""

    name: Text = Field("scenario", description="short name")
    description: Text = Field("", description="what it is for")
    sure: Switch = Field(False, description="whether unusual values are meant so: asks no question")
    camera: CameraTable
    target: TargetTable
    start: StartTable
    motion: Annotated[AnyMotion, BeforeValidator(pick)]
    law: LawTable
    vision: VisionTable
    calibration: CalibrationTable = Field(default_factory=CalibrationTable)
    reference_image: ReferenceImageTable = Field(default_factory=ReferenceImageTable)
    predictor: PredictorTable = Field(default_factory=PredictorTable)
    robot: RobotTable = Field(default_factory=RobotTable)
    faults: FaultsTable = Field(default_factory=FaultsTable)

    @property
    def reference(self) -> Trajectory:
        """The motion that the camera is asked to make."""
        oTc0 = from_euler_xyz(self.start.position, self.start.euler_xyz_deg)
        return self.motion.trajectory(oTc0)

    @property
    def constant_twist(self) -> Array | None:
        """The reference twist where it never changes, (6,) in m/s and rad/s; None elsewhere."""
        reference = self.reference
        return reference.T if isinstance(reference, ConstantScrew) else None

    @property
    def speed(self) -> float:
        """Greatest translational speed of the reference over the frames, m/s."""
        V = self.reference.twist(self.t)[:, :3]
        # In units of the greatest component, no square overflows or vanishes.
        unit = float(np.abs(V).max())
        return unit * float(np.linalg.norm(V / unit, axis=1).max()) if unit else 0.0

    @property
    def frames(self) -> int:
        """Number N of the last frame: the run has the frames 0..N at ``t_k = k period``."""
        return timing.last_frame(self.motion.duration, self.vision.period)

    @property
    def t(self) -> Array:
        """Times of the frames, (N + 1,) in s."""
        return np.arange(self.frames + 1, dtype=np.float64) * self.vision.period

    @property
    def latency_frames(self) -> int:
        """Latency in video periods, d. Raises InputError when it is no whole number of them."""
        latency, period = self.vision.latency, self.vision.period
        d = timing.whole_periods(latency, period)
        if d is None:
            below = timing.last_frame(latency, period)
            sentence = (
                f"{latency:g} s is {timing.shown(latency / period)} video periods of "
                f"{period:g} s; the sampled loop is solved here for whole frames "
                "(simulate takes any), so choose "
                f"{below * period:.9g} or {(below + 1) * period:.9g}"
            )
            raise FieldsError([("vision.latency", sentence)])
        return d


def meanings(path: str, model: type[Table]) -> dict[str, str]:
    """Descriptions of a table's keys by dotted name."""
    dot = f"{path}." if path else ""
    return {
        f"{dot}{name}": field.description
        for name, field in model.model_fields.items()
        if field.description
    }


# The tables by name; those of [motion] by kind are in ``links``.
TABLES: dict[str, type[Table]] = {
    name: field.annotation
    for name, field in Description.model_fields.items()
    if isinstance(field.annotation, type) and issubclass(field.annotation, Table)
}
# The table of every field that a run or its name depends on, "" for those at the top.
TABLE_OF = {"name": "", "description": ""} | {
    name: table for table, model in TABLES.items() for name in model.model_fields
}
TABLE_OF |= dict.fromkeys(sorted(MOTION_FIELDS), "motion")
# Meaning and unit of every field outside [motion], by dotted name.
COMMENTS = {
    **meanings("", Description),
    **{key: text for name, model in TABLES.items() for key, text in meanings(name, model).items()},
}
