"""The description of one experiment: everything that a run depends on, and nothing else.

A ``Scenario`` is frozen and valid: whatever exists can be simulated. Every way to make one (a TOML
file, keywords, a variation of another one) passes the same checks and fails with one ``InputError``
that lists all problems. Checks of single values are in ``fields``, of the whole in ``feasible``.
"""

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from vsctrl import files, timing
from vsctrl.errors import InputError
from vsctrl.servo.motion.trajectory import ConstantScrew, Trajectory
from vsctrl.servo.pose import exp, from_euler_xyz
from vsctrl.servo.scenario import fields, toml
from vsctrl.servo.scenario.checks import (
    count_frames,
    frame_problems,
    image_problems,
    path_problems,
    plan_problems,
    start_problems,
)
from vsctrl.servo.scenario.contradictions import contradictions
from vsctrl.servo.scenario.experiment import (
    CameraTable,
    LawTable,
    StartTable,
    TargetTable,
    VisionTable,
)
from vsctrl.servo.scenario.links import KINDS, MOTION_FIELDS, AnyMotion, LinkedMotion, pick
from vsctrl.servo.scenario.options import (
    CalibrationTable,
    FaultsTable,
    PredictorTable,
    ReferenceImageTable,
    RobotTable,
)
from vsctrl.servo.scenario.tables import OWNER, Table, remedy
from vsctrl.servo.scenario.types import Text


def _meanings(path: str, model: type[Table]) -> dict[str, str]:
    """Descriptions of a table's keys by dotted name."""
    dot = f"{path}." if path else ""
    meanings = {name: field.description for name, field in model.model_fields.items()}
    return {f"{dot}{name}": text for name, text in meanings.items() if text}


class Scenario(Table):
    """One experiment, valid by construction; units and meaning of each field in its table.

    Raises InputError, with one sentence per problem, for anything that cannot be simulated.
    """

    name: Text = Field("scenario", description="short name")
    description: Text = Field("", description="what it is for")
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

    @model_validator(mode="after")
    def _feasible(self) -> Self:
        points = np.array(self.target.points)
        position, offset = np.array(self.start.position), np.array(self.start.offset)
        try:
            reference = self.reference
        except InputError as error:
            raise fields.FieldsError([("motion", str(error).rstrip("."))]) from None
        blamed = "motion.duration" if "duration" in type(self.motion).model_fields else "motion"
        problems = [
            *contradictions(self),
            *frame_problems(reference.duration, self.vision.period, len(points), blamed),
            *start_problems(points, position, reference.oTc0, offset),
        ]
        if not problems:
            what = "motion.V" if self.motion.kind == "screw" else "motion"
            problems += path_problems(points, reference, self.t, what)
        if not problems:
            problems += [*plan_problems(self), *image_problems(self, reference.oTc0 @ exp(offset))]
        if problems:
            raise fields.FieldsError(problems)
        return self

    @property
    def reference(self) -> Trajectory:
        """The motion that the camera is asked to make."""
        oTc0 = from_euler_xyz(self.start.position, self.start.euler_xyz_deg)
        return self.motion.trajectory(oTc0)

    @property
    def constant_twist(self) -> NDArray[np.float64] | None:
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
        return count_frames(self.motion.duration, self.vision.period)

    @property
    def t(self) -> NDArray[np.float64]:
        """Times of the frames, (N + 1,) in s."""
        return np.arange(self.frames + 1, dtype=np.float64) * self.vision.period

    @property
    def latency_frames(self) -> int:
        """Latency in video periods, d. Raises InputError when it is no whole number of them."""
        latency, period = self.vision.latency, self.vision.period
        d = timing.whole_periods(latency, period)
        if d is None:
            below = timing.last_frame(latency, period)
            raise fields.FieldsError(
                [
                    (
                        "vision.latency",
                        f"{latency:g} s is {timing.shown(latency / period)} video periods of "
                        f"{period:g} s; the sampled loop is solved here for whole frames "
                        "(simulate takes any), so choose "
                        f"{below * period:.9g} or {(below + 1) * period:.9g}",
                    )
                ]
            )
        return d

    @property
    def ideal(self) -> Self:
        """The same experiment as the theory of figure 1 has it: a perfect camera and robot.

        What remains: lens and points, start (without offset), motion, period and latency, the law
        (10) with its wrong depths and focal length. What a law may have besides is left out.
        """
        kept = ("lam", "k_ff", "interaction", "placement", "depth_ratio")
        return type(self)(
            name=self.name,
            description=self.description,
            camera={"Fx": self.camera.Fx, "Fy": self.camera.Fy},
            target={"points": self.target.points},
            start={
                "position": self.start.position,
                "euler_xyz_deg": self.start.euler_xyz_deg,
            },
            motion=self.motion,
            law={name: getattr(self.law, name) for name in kept},
            vision={"period": self.vision.period, "latency": self.vision.latency},
            calibration={"focal_ratio": self.calibration.focal_ratio},
        )

    @property
    def beyond_theory(self) -> dict[str, Any]:
        """What this scenario has and its ideal has not, by dotted names of its keys."""
        own, ideal = self.model_dump(), self.ideal.model_dump()
        return {
            f"{table}.{name}": value
            for table in TABLES
            for name, value in own[table].items()
            if value != ideal[table][name] and name != "seed"  # of what is random, and listed
        }

    @property
    def digest(self) -> str:
        """First 12 hex digits of the SHA-256 of the canonical JSON: same digits, same run.

        Values at their defaults are left out, so that a new option leaves old digests alone.
        """
        data = self.model_dump(mode="json", exclude_defaults=True)
        canonical = json.dumps(data, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()[:12]

    def with_(self, **changes: Any) -> Self:
        """The same experiment with some fields changed, by their own names: ``with_(lam=5)``.

        Another ``kind`` of motion keeps only those keys of the old one that it has itself.
        Raises InputError for an unknown name or a value that its field refuses.
        """
        data: dict[str, Any] = self.model_dump()
        unknown = [name for name in changes if name not in TABLE_OF]
        if unknown:
            raise fields.FieldsError(
                (name, f"no field of a scenario has this name{remedy(name, TABLE_OF)}")
                for name in unknown
            )
        kind = KINDS.get(str(changes.get("kind", self.motion.kind)))
        if kind is not None:
            data["motion"] = {k: v for k, v in data["motion"].items() if k in kind.model_fields}
        for name, value in changes.items():
            table = TABLE_OF[name]
            (data[table] if table else data)[name] = value
        return type(self)(**data)

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Scenario from TOML text. Raises InputError that lists all problems."""
        return cls(**toml.parse(text))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Scenario from a TOML file in UTF-8. Raises InputError that starts with the file."""
        try:
            return cls.from_toml(files.read_text(Path(path), "TOML file"))
        except fields.FieldsError as error:
            raise fields.FieldsError(error.problems, source=str(path)) from None

    def to_toml(self) -> str:
        """TOML text, ready to edit: a comment with meaning and unit on every key.

        ``Scenario.from_toml`` makes exactly the same scenario of it.
        """
        comments = COMMENTS | _meanings("motion", type(self.motion))
        if isinstance(self.motion, LinkedMotion):
            for number, part in enumerate(self.motion.parts):
                comments |= _meanings(f"motion.parts.{number}", type(part))
        return toml.emit(self.model_dump(), comments)

    def save(self, path: str | Path) -> None:
        """Write ``to_toml`` to a file: all of it or nothing. Raises InputError if impossible."""
        files.write(Path(path), self.to_toml(), "scenario")


# The tables by name; those of [motion] by kind are in ``links``.
TABLES: dict[str, type[Table]] = {
    "camera": CameraTable,
    "target": TargetTable,
    "start": StartTable,
    "law": LawTable,
    "vision": VisionTable,
    "calibration": CalibrationTable,
    "reference_image": ReferenceImageTable,
    "predictor": PredictorTable,
    "robot": RobotTable,
    "faults": FaultsTable,
}
# The table of every field, "" for those at the top.
TABLE_OF = {"name": "", "description": ""} | {
    name: table for table, model in TABLES.items() for name in model.model_fields
}
TABLE_OF |= dict.fromkeys(sorted(MOTION_FIELDS), "motion")
OWNER.update(TABLE_OF)
# Meaning and unit of every field outside [motion], by dotted name.
COMMENTS = {
    **_meanings("", Scenario),
    **{key: text for name, model in TABLES.items() for key, text in _meanings(name, model).items()},
}


def schema() -> str:
    """JSON Schema of a scenario file, for editors that complete and check TOML or JSON."""
    found = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **Scenario.model_json_schema(),
    }
    return json.dumps(found, indent=2, ensure_ascii=False) + "\n"
