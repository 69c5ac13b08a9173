"""Which kind of motion a table of a scenario is, and the kind that links others.

A file without ``kind`` is a screw, so that constant twists need no more than V and Omega.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from vsctrl.arrays import Array
from vsctrl.problems import FieldsError, Problem, show
from vsctrl.servo.motion.linked import Blending, Linked
from vsctrl.servo.motion.trajectory import Trajectory
from vsctrl.servo.scenario import fields
from vsctrl.servo.scenario.motions import (
    KIND,
    HoldMotion,
    Motion,
    OscillationMotion,
    PathMotion,
    RotationMotion,
    ScrewMotion,
)
from vsctrl.servo.scenario.tables import not_a_table
from vsctrl.servo.scenario.types import CHOICE, MaybePair, Switch

Part = Annotated[
    ScrewMotion | HoldMotion | RotationMotion | OscillationMotion | PathMotion,
    Field(discriminator="kind"),
]


def _kind(value: object) -> object:
    return value.get("kind", "screw") if isinstance(value, Mapping) else None


def _part(value: object) -> Motion:
    """One part of a linked motion. Raises FieldsError that lists everything wrong with it."""
    if isinstance(value, LinkedMotion) or _kind(value) == "linked":
        sentence = "a linked motion cannot be a part; list its parts here instead"
        raise FieldsError([("kind", sentence)])
    part: Motion = pick(value, "[motion.parts]")
    if isinstance(part, PathMotion) and part.frame == "object":
        sentence = (
            "a part begins where the one before it ends; give its poses from there, with "
            'frame = "start"'
        )
        raise FieldsError([("frame", sentence)])
    return part


def _parts(value: object) -> tuple[Motion, ...]:
    """Every part of a linked motion, or all that is wrong with all of them."""
    if not isinstance(value, list | tuple) or not value:
        raise ValueError(
            f"{show(value)} is no list of motions; write one table [[motion.parts]] for each"
        )
    out: list[Motion] = []
    problems: list[Problem] = []
    for number, entry in enumerate(value, start=1):
        try:
            out.append(_part(entry))
        except FieldsError as error:
            problems += [
                ("", f"part {number}, {name}: {text}" if name else f"part {number}: {text}")
                for name, text in error.problems
            ]
    if problems:
        raise FieldsError(problems)
    return tuple(out)


class LinkedMotion(Motion):
    """kind = "linked": motions one after another, with blends between their twists."""

    kind: Literal["linked"] = Field(description=KIND)
    blend: Annotated[Blending, CHOICE] = Field(
        "linear", description="between the parts: none (jumps), linear (twist) or smooth"
    )
    max_acceleration: MaybePair = Field(
        None, description="greatest linear and angular acceleration of the blends, m/s² and rad/s²"
    )
    from_rest: Switch = Field(False, description="begin with a blend from rest")
    to_rest: Switch = Field(False, description="end with a blend to rest")
    parts: Annotated[tuple[Part, ...], BeforeValidator(_parts)] = Field(
        description="the motions, one table each, from where the one before it ends"
    )

    def problems(self) -> Iterator[Problem]:
        """Limits of a blend without one, or a blend without limits."""
        if self.blend == "none":
            sentence = 'belongs to a blend, and blend is "none"; choose another blend or leave it'
            given = {"max_acceleration": self.max_acceleration is not None}
            given |= {"from_rest": self.from_rest, "to_rest": self.to_rest}
            yield from ((name, f"{sentence} out") for name, there in given.items() if there)
        elif self.max_acceleration is None:
            yield (
                "max_acceleration",
                "missing; give the limits of the blends, such as [0.1, 0.5] in m/s² and rad/s², "
                'or blend = "none"',
            )

    @property
    def duration(self) -> float:
        """Length of the run with its blends, s."""
        return self.trajectory(np.eye(4)).duration

    def trajectory(self, oTc0: Array) -> Trajectory:
        """Parts and blends from a start pose (4, 4). Raises InputError where impossible."""
        return Linked(
            oTc0,
            [part.trajectory(np.eye(4)) for part in self.parts],
            self.blend,
            self.max_acceleration or (1.0, 1.0),
            self.from_rest,
            self.to_rest,
        )


AnyMotion = Annotated[
    ScrewMotion | HoldMotion | RotationMotion | OscillationMotion | PathMotion | LinkedMotion,
    Field(discriminator="kind"),
]
KINDS: dict[str, type[Motion]] = {model.name(): model for model in Motion.__subclasses__()}
MOTION_FIELDS = frozenset(name for model in KINDS.values() for name in model.model_fields)


def pick(value: object, table: str = "motion") -> Any:
    """The motion that a table describes, of the kind that it names ("screw" where it names none).

    Raises FieldsError that lists everything wrong with it, by the names of its keys.
    """
    if isinstance(value, Motion):
        return value
    if not isinstance(value, Mapping):
        raise FieldsError([("", not_a_table(value, table))])
    try:
        kind = fields.choice(*KINDS)(_kind(value))
    except ValueError as error:
        raise FieldsError([("kind", str(error))]) from None
    return KINDS[kind](**{str(key): entry for key, entry in value.items()})
