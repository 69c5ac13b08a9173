"""The types of a scenario's values: how each is checked, and what an editor is told about it.

The checks are in ``fields``; beside each stands its JSON Schema.
"""

from typing import Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema

from vsctrl.servo.scenario import fields


def _numbers(length: int) -> dict[str, Any]:
    items = {"type": "number"}
    return {"type": "array", "items": items, "minItems": length, "maxItems": length}


def _rows(length: int, least: int) -> dict[str, Any]:
    return {"type": "array", "items": _numbers(length), "minItems": least}


_ABOVE_ZERO = {"type": "number", "exclusiveMinimum": 0}
Text = Annotated[str, BeforeValidator(fields.text)]
Number = Annotated[float, BeforeValidator(fields.number)]
Positive = Annotated[float, BeforeValidator(fields.positive), WithJsonSchema(_ABOVE_ZERO)]
MaybeNumber = Annotated[
    float | None,
    BeforeValidator(fields.maybe(fields.number)),
    WithJsonSchema({"type": "number"}),
]
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
MaybePair = Annotated[
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
MaybeNonnegative = Annotated[
    float | None,
    BeforeValidator(fields.maybe(fields.nonnegative)),
    WithJsonSchema({"type": "number", "minimum": 0}),
]
MaybeTwist = Annotated[
    tuple[float, float, float, float, float, float] | None,
    BeforeValidator(fields.maybe(fields.vector(6))),
    WithJsonSchema(_numbers(6)),
]
MaybePositives = Annotated[
    tuple[float, ...] | None,
    BeforeValidator(fields.maybe(fields.each_positive)),
    WithJsonSchema({"type": "array", "items": _ABOVE_ZERO, "minItems": 1}),
]
Vector2 = Annotated[
    tuple[float, float], BeforeValidator(fields.vector(2)), WithJsonSchema(_numbers(2))
]
Share = Annotated[
    float,
    BeforeValidator(fields.share),
    WithJsonSchema({"type": "number", "minimum": 0, "exclusiveMaximum": 1}),
]
