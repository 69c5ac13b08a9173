"""The description of one experiment: everything that a run depends on, and nothing else.

A ``Scenario`` is frozen and valid: whatever exists can be simulated. Every way to make one (a TOML
file, keywords, a variation of another one) passes the same checks and fails with one ``InputError``
that lists all problems. Checks of single values are in ``fields``, of the whole in ``feasible``.
"""

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from vsctrl.errors import InputError, nearest
from vsctrl.servo import fields, toml
from vsctrl.servo.feasible import (
    WHOLE,
    count_frames,
    frame_problems,
    path_problems,
    start_problems,
)
from vsctrl.servo.law import Interaction
from vsctrl.servo.pose import from_euler_xyz
from vsctrl.servo.trajectory import ConstantScrew

Placement = Literal["measurement", "aligned", "actuator"]

Text = Annotated[str, BeforeValidator(fields.text)]
Number = Annotated[float, BeforeValidator(fields.number)]
Positive = Annotated[float, BeforeValidator(fields.positive)]
Nonnegative = Annotated[float, BeforeValidator(fields.nonnegative)]
Whole = Annotated[int, BeforeValidator(fields.whole)]
Vector3 = Annotated[tuple[float, float, float], BeforeValidator(fields.vector(3))]
Twist = Annotated[
    tuple[float, float, float, float, float, float], BeforeValidator(fields.vector(6))
]
Points = Annotated[tuple[fields.Vector3, ...], BeforeValidator(fields.points)]


class Table(BaseModel):
    """A frozen table of a scenario whose errors are ``InputError``, never pydantic's own."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise fields.FieldsError(_problems(type(self), error)) from None

    def __setattr__(self, name: str, value: object) -> None:
        raise InputError(
            f"{name}: a scenario cannot be changed; make another one with scenario.with_({name}=…)."
        )


class CameraTable(Table):
    """[camera]: focal lengths in px."""

    Fx: Positive = Field(description="focal length along x, px")
    Fy: Positive = Field(description="focal length along y, px")


class TargetTable(Table):
    """[target]: still points of the object frame."""

    points: Points = Field(description="x, y, z of each point in the object frame, m")


class StartTable(Table):
    """[start]: pose of the reference at t = 0, and where the camera really is then."""

    position: Vector3 = Field(description="camera in the object frame, m")
    euler_xyz_deg: Vector3 = Field(description="intrinsic XYZ angles of the camera, degrees")
    offset: Twist = Field(
        (0.0,) * 6, description="twist from the reference start to the true start, m and rad"
    )


class MotionTable(Table):
    """[motion]: constant twist of the reference in the camera frame."""

    V: Vector3 = Field(description="reference velocity in the camera frame, m/s")
    Omega: Vector3 = Field((0.0,) * 3, description="reference rotation in the camera frame, rad/s")
    duration: Positive = Field(description="length of the run, s")


class LawTable(Table):
    """[law]: the control law (10)."""

    lam: Positive = Field(description="gain λ, 1/s")
    k_ff: Number = Field(1.0, description="feed-forward gain: 1 the paper's law, 0 without")
    interaction: Annotated[Interaction, BeforeValidator(fields.choice(*get_args(Interaction)))] = (
        Field("current", description="L at: current, desired, mean or initial")
    )
    placement: Annotated[Placement, BeforeValidator(fields.choice(*get_args(Placement)))] = Field(
        "measurement", description="where the latency acts: measurement, aligned or actuator"
    )
    depth_ratio: Positive = Field(1.0, description="depth used by the law over the true depth")


class VisionTable(Table):
    """[vision]: timing and noise of the measurement."""

    period: Positive = Field(description="video period, s")
    latency: Nonnegative = Field(description="age of a measurement when it is used, s")
    noise_px: Nonnegative = Field(0.0, description="standard deviation per image coordinate, px")
    seed: Whole = Field(0, description="seed of the noise")


class Scenario(Table):
    """One experiment, valid by construction; units and meaning of each field in its table.

    Raises InputError, with one sentence per problem, for anything that cannot be simulated.
    """

    name: Text = Field("scenario", description="short name")
    description: Text = Field("", description="what it is for")
    camera: CameraTable
    target: TargetTable
    start: StartTable
    motion: MotionTable
    law: LawTable
    vision: VisionTable

    @model_validator(mode="after")
    def _feasible(self) -> Self:
        points = np.array(self.target.points)
        position, offset = np.array(self.start.position), np.array(self.start.offset)
        problems = [
            *frame_problems(self.motion.duration, self.vision.period, len(points)),
            *start_problems(points, position, self.reference.oTc0, offset),
        ]
        if not problems:
            problems += path_problems(points, self.reference, self.t)
        if problems:
            raise fields.FieldsError(problems)
        return self

    @property
    def reference(self) -> ConstantScrew:
        """The motion that the camera is asked to make."""
        oTc0 = from_euler_xyz(self.start.position, self.start.euler_xyz_deg)
        return ConstantScrew(oTc0, np.array([*self.motion.V, *self.motion.Omega]))

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
        ratio = latency / period
        d = round(ratio)
        if abs(ratio - d) > WHOLE:
            below = int(ratio)
            raise fields.FieldsError(
                [
                    (
                        "vision.latency",
                        f"{latency:g} s is {ratio:g} video periods of {period:g} s; the "
                        "simulation delays by whole frames, so choose "
                        f"{below * period:g} or {(below + 1) * period:g}",
                    )
                ]
            )
        return d

    @property
    def digest(self) -> str:
        """First 12 hex digits of the SHA-256 of the canonical JSON: same digits, same run."""
        canonical = json.dumps(self.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()[:12]

    def with_(self, **changes: Any) -> Self:
        """The same experiment with some fields changed, by their own names: ``with_(lam=5)``.

        Raises InputError for an unknown name or a value that its field refuses.
        """
        data: dict[str, Any] = self.model_dump()
        unknown = [name for name in changes if name not in TABLE_OF]
        if unknown:
            raise fields.FieldsError(
                (name, f"no field of a scenario has this name{_remedy(name, TABLE_OF)}")
                for name in unknown
            )
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
            return cls.from_toml(toml.read(Path(path)))
        except fields.FieldsError as error:
            raise fields.FieldsError(error.problems, source=str(path)) from None

    def to_toml(self) -> str:
        """TOML text, ready to edit: a comment with meaning and unit on every key.

        ``Scenario.from_toml`` makes exactly the same scenario of it.
        """
        return toml.emit(self.model_dump(), COMMENTS)

    def save(self, path: str | Path) -> None:
        """Write ``to_toml`` to a file: all of it or nothing. Raises InputError if impossible."""
        toml.write(Path(path), self.to_toml())


TABLES: dict[str, type[Table]] = {
    name: field.annotation
    for name, field in Scenario.model_fields.items()
    if isinstance(field.annotation, type) and issubclass(field.annotation, Table)
}
# The table of every field, "" for those at the top.
TABLE_OF = {name: "" for name in Scenario.model_fields if name not in TABLES} | {
    name: table for table, model in TABLES.items() for name in model.model_fields
}
# Meaning and unit of every field, by dotted name.
COMMENTS = {
    f"{table}.{name}" if table else name: (TABLES[table] if table else Scenario)
    .model_fields[name]
    .description
    or ""
    for name, table in TABLE_OF.items()
}


def _remedy(name: str, known: dict[str, str] | list[str]) -> str:
    return nearest(name, known) or f"; it has {', '.join(known)}"


def _problems(model: type[Table], error: ValidationError) -> list[tuple[str, str]]:
    """pydantic's findings about one table as (dotted field, sentence), all of them."""
    known = model.model_fields
    out: list[tuple[str, str]] = []
    for found in error.errors(include_url=False):
        field = ".".join(str(part) for part in found["loc"])
        cause = found.get("ctx", {}).get("error")
        meaning = known[field].description if field in known else None
        about = f" ({meaning})" if meaning else ""
        if isinstance(cause, fields.FieldsError):
            out += [(f"{field}.{name}" if field else name, text) for name, text in cause.problems]
        elif found["type"] == "missing":
            kind = f"a table [{field}]" if field in TABLES else "a value"
            out.append((field, f"missing; give it {kind}{about}"))
        elif found["type"] == "extra_forbidden":
            belongs = TABLE_OF.get(field)
            remedy = f"; it belongs into [{belongs}]" if belongs else _remedy(field, list(known))
            out.append((field, f"unknown key with value {fields.show(found['input'])}{remedy}"))
        elif cause is not None:
            out.append((field, f"{cause}{about}"))
        else:
            shown = fields.show(found["input"])
            out.append((field, f"{shown} is not a table; write its keys under [{field}]"))
    return out
