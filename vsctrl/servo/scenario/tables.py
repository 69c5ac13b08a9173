"""The tables of a scenario file: names, units and checks of their keys, and errors as sentences.

A table checks its own keys only. The kinds of motion are in ``motions`` and ``links``; what the
tables must satisfy together is left to ``scenario``.
"""

from collections.abc import Iterable
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, WithJsonSchema

from vsctrl.errors import InputError, nearest
from vsctrl.servo.control.law import Interaction
from vsctrl.servo.scenario import fields

Placement = Literal["measurement", "aligned", "actuator"]


def _numbers(length: int) -> dict[str, Any]:
    items = {"type": "number"}
    return {"type": "array", "items": items, "minItems": length, "maxItems": length}


def _rows(length: int, least: int) -> dict[str, Any]:
    return {"type": "array", "items": _numbers(length), "minItems": least}


# For every type what is checked and what an editor is told about it (JSON Schema).
_ABOVE_ZERO = {"type": "number", "exclusiveMinimum": 0}
Text = Annotated[str, BeforeValidator(fields.text)]
Number = Annotated[float, BeforeValidator(fields.number)]
Positive = Annotated[float, BeforeValidator(fields.positive), WithJsonSchema(_ABOVE_ZERO)]
MaybePositive = Annotated[
    float | None, BeforeValidator(fields.maybe(fields.positive)), WithJsonSchema(_ABOVE_ZERO)
]
Nonnegative = Annotated[
    float,
    BeforeValidator(fields.nonnegative),
    WithJsonSchema({"type": "number", "minimum": 0}),
]
Whole = Annotated[
    int, BeforeValidator(fields.whole), WithJsonSchema({"type": "integer", "minimum": 0})
]
Switch = Annotated[bool, BeforeValidator(fields.switch)]
Vector3 = Annotated[fields.Vector3, BeforeValidator(fields.vector(3)), WithJsonSchema(_numbers(3))]
Direction3 = Annotated[
    fields.Vector3, BeforeValidator(fields.direction(3)), WithJsonSchema(_numbers(3))
]
MaybeLimits = Annotated[
    tuple[float, float] | None,
    BeforeValidator(fields.maybe(fields.positives(2))),
    WithJsonSchema(_numbers(2)),
]
Twist = Annotated[
    tuple[float, float, float, float, float, float],
    BeforeValidator(fields.vector(6)),
    WithJsonSchema(_numbers(6)),
]
Direction6 = Annotated[
    tuple[float, float, float, float, float, float],
    BeforeValidator(fields.direction(6)),
    WithJsonSchema(_numbers(6)),
]
Points = Annotated[
    tuple[fields.Vector3, ...], BeforeValidator(fields.points), WithJsonSchema(_rows(3, 3))
]
Rows3 = Annotated[
    tuple[fields.Vector3, ...], BeforeValidator(fields.rows), WithJsonSchema(_rows(3, 1))
]
Times = Annotated[
    tuple[float, ...],
    BeforeValidator(fields.times),
    WithJsonSchema({"type": "array", "items": _ABOVE_ZERO, "minItems": 1}),
]


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

    @classmethod
    def stranger(cls, name: str) -> str:
        """What to do with a key that this table does not have, as the end of a sentence."""
        belongs = OWNER.get(name)
        return f"; it belongs into [{belongs}]" if belongs else remedy(name, cls.model_fields)


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


# The table of every field, "" for those at the top; ``scenario`` adds what it owns.
OWNER: dict[str, str] = {}


def remedy(name: str, known: Iterable[str]) -> str:
    """`` (did you mean …?)``, or all names where none is near."""
    known = list(known)
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
            out += [(".".join(filter(None, (field, name))), text) for name, text in cause.problems]
        elif found["type"] == "missing":
            # Whatever has no meaning of its own is a table.
            kind = "a value" if meaning else f"a table [{field}]"
            out.append((field, f"missing; give it {kind}{about}"))
        elif found["type"] == "extra_forbidden":
            value = fields.show(found["input"])
            out.append((field, f"unknown key with value {value}{model.stranger(field)}"))
        elif found["type"] == "literal_error":
            out.append((field, f"{fields.show(found['input'])} is not {found['ctx']['expected']}"))
        elif cause is not None:
            out.append((field, f"{cause}{about}"))
        else:
            out.append((field, not_a_table(found["input"], field)))
    return out


def not_a_table(value: object, field: str) -> str:
    """The sentence about a value where a table belongs."""
    return f"{fields.show(value)} is not a table; write its keys under [{field}]"
