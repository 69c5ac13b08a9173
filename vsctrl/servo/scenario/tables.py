"""What a table of a scenario file is, and its errors as sentences.

A table checks its own keys only. The tables themselves are in ``experiment``, ``options``,
``motions`` and ``links``; what they must satisfy together is left to ``checks``.
"""

from collections.abc import Iterator
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from vsctrl.errors import InputError, nearest
from vsctrl.problems import FieldsError, Problem, remedy, show
from vsctrl.vocabulary import meant


class Table(BaseModel):
    """A frozen table of a scenario whose errors are ``InputError``, never pydantic's own."""

    heading: ClassVar[str] = ""  #: under which its keys stand in a file, "" for those at the top
    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise FieldsError(_problems(type(self), error)) from None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if problems := [*self.problems()]:
            raise FieldsError(problems)
        return self

    def problems(self) -> Iterator[Problem]:
        """What the table's values cannot mean together: the key to change, and the sentence."""
        yield from ()

    def __setattr__(self, name: str, value: object) -> None:
        raise InputError(
            f"{name}: a scenario cannot be changed; make another one with scenario.with_({name}=…)."
        )

    @classmethod
    def stranger(cls, name: str, value: object = None) -> str:
        """What to do with a key that this table does not have, as the end of a sentence."""
        if home := next((t.heading for t in _below(Table) if name in t.model_fields), ""):
            return f"; it belongs into [{home}]"
        if not meant(name, cls.model_fields):
            for table in _below(Table):
                if meant(name, table.model_fields):
                    hint = nearest(name, table.model_fields, value).removesuffix("?)")
                    return f"{hint} in [{table.heading}]?)"
        return remedy(name, cls.model_fields, value)


def _below(table: type[Table]) -> Iterator[type[Table]]:
    """Every table with a heading of its own."""
    for below in table.__subclasses__():
        if below.heading:
            yield below
        yield from _below(below)


def _problems(model: type[Table], error: ValidationError) -> list[Problem]:
    """pydantic's findings about one table as (dotted field, sentence), all of them."""
    known = model.model_fields
    out: list[Problem] = []
    refusals = error.errors(include_url=False)
    extra = {str(r["loc"][0]) for r in refusals if r["type"] == "extra_forbidden"}
    by_another_name = {
        name for found in (meant(word, known) for word in extra) if found for name in found.names
    }
    for refusal in refusals:
        field = ".".join(str(part) for part in refusal["loc"])
        cause = refusal.get("ctx", {}).get("error")
        meaning = known[field].description if field in known else None
        about = f" ({meaning})" if meaning else ""
        if isinstance(cause, FieldsError):
            out += [(".".join(filter(None, (field, name))), text) for name, text in cause.problems]
        elif refusal["type"] == "missing":
            if field in by_another_name:
                continue  # a word that means it was given, and that is one slip
            # Whatever has no meaning of its own is a table.
            kind = "a value" if meaning else f"a table [{field}]"
            out.append((field, f"missing; give it {kind}{about}"))
        elif refusal["type"] == "extra_forbidden":
            value, hint = refusal["input"], model.stranger(field, refusal["input"])
            out.append((field, f"unknown key with value {show(value)}{hint}"))
        elif refusal["type"] == "literal_error":
            out.append((field, f"{show(refusal['input'])} is not {refusal['ctx']['expected']}"))
        elif cause is not None:
            out.append((field, f"{cause}{about}"))
        else:
            out.append((field, not_a_table(refusal["input"], field)))
    return out


def not_a_table(value: object, field: str) -> str:
    """The sentence about a value where a table belongs."""
    return f"{show(value)} is not a table; write its keys under [{field}]"
