"""The types of a scenario's values: how each is checked, and what an editor is told about it.

The checks are in ``fields``; beside each stands its JSON Schema.
"""

from typing import Annotated, Any, get_args

from pydantic import BeforeValidator as Check
from pydantic import GetCoreSchemaHandler, WithJsonSchema
from pydantic_core import CoreSchema, core_schema

from vsctrl.servo.scenario import fields
from vsctrl.servo.scenario.fields import maybe


class _Choice:
    """One of the words of a ``Literal``."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        check = fields.choice(*get_args(source))
        return core_schema.no_info_before_validator_function(check, handler(source))


def _array(items: dict[str, Any], least: int, most: int | None = None) -> WithJsonSchema:
    longest = {} if most is None else {"maxItems": most}
    return WithJsonSchema({"type": "array", "items": items, "minItems": least, **longest})


def _rows(least: int) -> WithJsonSchema:
    return _array(_array(_NUMBER, 3, 3).json_schema or {}, least)


_NUMBER, _ABOVE_ZERO = {"type": "number"}, {"type": "number", "exclusiveMinimum": 0}
_FROM_ZERO = {"type": "number", "minimum": 0}
_Six = tuple[float, float, float, float, float, float]

CHOICE = _Choice()
Text = Annotated[str, Check(fields.text)]
Switch = Annotated[bool, Check(fields.switch)]
Whole = Annotated[int, Check(fields.whole), WithJsonSchema({"type": "integer", "minimum": 0})]
Share = Annotated[float, Check(fields.share), WithJsonSchema({**_FROM_ZERO, "exclusiveMaximum": 1})]

Number = Annotated[float, Check(fields.number)]
Positive = Annotated[float, Check(fields.positive), WithJsonSchema(_ABOVE_ZERO)]
Nonnegative = Annotated[float, Check(fields.nonnegative), WithJsonSchema(_FROM_ZERO)]
Seconds = Annotated[float, Check(fields.seconds), WithJsonSchema(_FROM_ZERO)]
# What may be left out: None here, no value to an editor.
MaybeNumber = Annotated[float | None, Check(maybe(fields.number)), WithJsonSchema(_NUMBER)]
MaybePositive = Annotated[float | None, Check(maybe(fields.positive)), WithJsonSchema(_ABOVE_ZERO)]
MaybeSeconds = Annotated[float | None, Check(maybe(fields.seconds)), WithJsonSchema(_FROM_ZERO)]

Vector2 = Annotated[tuple[float, float], Check(fields.vector(2)), _array(_NUMBER, 2, 2)]
Vector3 = Annotated[fields.Vector3, Check(fields.vector(3)), _array(_NUMBER, 3, 3)]
Direction3 = Annotated[fields.Vector3, Check(fields.direction(3)), _array(_NUMBER, 3, 3)]
Twist = Annotated[_Six, Check(fields.vector(6)), _array(_NUMBER, 6, 6)]
Direction6 = Annotated[_Six, Check(fields.direction(6)), _array(_NUMBER, 6, 6)]
MaybeTwist = Annotated[_Six | None, Check(maybe(fields.vector(6))), _array(_NUMBER, 6, 6)]
MaybePair = Annotated[
    tuple[float, float] | None, Check(maybe(fields.positives(2))), _array(_NUMBER, 2, 2)
]

Points = Annotated[tuple[fields.Vector3, ...], Check(fields.points), _rows(3)]
Rows3 = Annotated[tuple[fields.Vector3, ...], Check(fields.rows), _rows(1)]
Times = Annotated[tuple[float, ...], Check(fields.times), _array(_ABOVE_ZERO, 1)]
MaybePositives = Annotated[
    tuple[float, ...] | None, Check(maybe(fields.each_positive)), _array(_ABOVE_ZERO, 1)
]
